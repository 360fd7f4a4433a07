"""Classes: recognition across people, and rejection of what was not learned.

python benchmarks/bench_classes.py

HDM05 leaves one actor out; CMU leaves one subject out; rejection leaves an actor and a class out.
"""

from __future__ import annotations

import csv

import numpy as np
from _corpus import corpus_or_exit
from sklearn.metrics import roc_auc_score

from mocapdb import read_clip
from mocapdb.indexing import ClassIndex, canonical_motion
from mocapdb.indexing.recognition.class_models import Noise
from mocapdb.library.naming import subject_of

SEVERAL_ACTIONS = {"other"}


def read_motions(part: str) -> tuple[list, np.ndarray, np.ndarray]:
    corpus = corpus_or_exit()
    motions, labels, subjects, seen = [], [], [], set()
    for row in csv.DictReader((corpus / "LABELS.csv").open(encoding="utf-8")):
        inside = row["path"].startswith(part) and "bvh_daz" not in row["path"]
        if not inside or row["clip"] in seen or row["label"] in SEVERAL_ACTIONS:
            continue
        if row["label"] == "run" and not row["description"].startswith("run"):
            continue  # jumping jacks first, and a jog at the end
        seen.add(row["clip"])
        skeleton = corpus / row["skeleton"] if row["skeleton"] else None
        fps = float(row["fps"]) if row["format"] == "amc" else None
        clip = read_clip(corpus / row["path"], skeleton=skeleton, fps=fps, drop_tpose=True)
        motions.append(canonical_motion(clip))
        labels.append(row["label"])
        subjects.append(subject_of(row["clip"]))
    return motions, np.array(labels), np.array(subjects)


def learned(motions, labels, subjects, chosen, noise: Noise = "floored") -> ClassIndex:
    rows = np.flatnonzero(chosen)
    return ClassIndex(noise=noise).fit(
        [motions[i] for i in rows], labels[rows].tolist(), groups=subjects[rows].tolist()
    )


def recognition(part: str, noises: tuple[Noise, ...]) -> None:
    motions, labels, subjects = read_motions(part)
    for noise in noises:
        answers = np.empty(len(labels), dtype=object)
        rejected = np.zeros(len(labels), dtype=bool)
        for subject in sorted(set(subjects)):
            classes = learned(motions, labels, subjects, subjects != subject, noise)
            for i in np.flatnonzero(subjects == subject):
                answer = classes.classify(motions[i])
                answers[i], rejected[i] = answer.ranking[0].label, answer.rejected
        right = answers == labels
        recall = {str(k): f"{right[labels == k].mean():.2f}" for k in sorted(set(labels))}
        print(
            f"{part}, {noise} noise: {right.mean():.1%} of {len(labels)} clips right, "
            f"{rejected.mean():.1%} rejected; recall {recall}"
        )


def rejection() -> None:
    motions, labels, subjects = read_motions("hdm05")
    alone, together, missed, false = [], [], [], []
    for actor in sorted(set(subjects)):
        for unknown in sorted(set(labels)):
            classes = learned(motions, labels, subjects, (subjects != actor) & (labels != unknown))
            rows = np.flatnonzero(
                (subjects == actor) & (np.isin(labels, classes.labels) | (labels == unknown))
            )
            is_new = labels[rows] == unknown
            if not is_new.any():
                continue
            answers = [classes.classify(motions[i]) for i in rows]
            novelty = np.array([answer.novelty for answer in answers])
            density = np.array([answer.ranking[0].log_density for answer in answers])
            together.append(roc_auc_score(is_new, novelty))
            alone.append(roc_auc_score(is_new, -density))
            missed.append((novelty[is_new] <= 1).mean())
            false.append((novelty[~is_new] > 1).mean())
    print(
        f"rejection, HDM05, {len(alone)} pairs of actor and class left out: AUROC density alone "
        f"{np.mean(alone):.3f}, with the nearest clip {np.mean(together):.3f}; at novelty 1 "
        f"{np.mean(missed):.1%} of the new are missed, {np.mean(false):.1%} of the known rejected"
    )


def main() -> None:
    recognition("hdm05", ("floored", "shared", "own"))
    recognition("cmu", ("floored", "own"))
    rejection()


if __name__ == "__main__":
    main()
