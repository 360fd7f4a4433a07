"""Classes: recognition across people, and rejection of what was not learned.

python benchmarks/bench_classes.py [--only recognition rejection transfer open_set segments]

HDM05 leaves one actor out; CMU leaves one subject out; rejection leaves an actor and a class out.
Transfer: HDM05, CMU and Bandai are libraries in turn, and clips of the others that show what it has
not are unknown (`UNKNOWN`); known clips are by people, or in a style, left out. Open set: clips of
CMU whose label another subject has too; `other` is right when a clip is refused.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator

import numpy as np
from _corpus import corpus_or_exit
from bench_query import EXERCISES
from sklearn.metrics import roc_auc_score

from mocapdb import read_clip
from mocapdb.indexing import ClassIndex, canonical_motion
from mocapdb.indexing.recognition.class_models import NONE, Noise
from mocapdb.library.naming import subject_of

SEVERAL_ACTIONS = {"other"}
REFUSED = 0.05  # of known clips, where what is taken of unknown ones is counted
HANDS = ("bow", "call", "raise", "wave")
CMU_ALONE = ("sword", "box", "playground", "dance", "cartwheel", "balance")
UNKNOWN = {
    ("hdm05", "cmu"): CMU_ALONE,
    ("hdm05", "bandai"): HANDS,
    ("cmu", "hdm05"): ("deposit", "elbow", "grab", "kick", "lie", "rotate", "squat", "throw"),
    ("cmu", "bandai"): (*HANDS, "kick"),
    ("bandai", "hdm05"): ("deposit", "elbow", "grab", "hop", "lie", "rotate", "squat", "throw"),
    ("bandai", "cmu"): (*CMU_ALONE, "jump"),
}
"""Beginnings of labels of a corpus that are no class of a library; what may be one counts not."""


def read_motions(part: str, *, other: bool = False) -> tuple[list, np.ndarray, np.ndarray]:
    """Return labelled clips; those labelled `other`, by what their text says, only if asked for."""
    corpus = corpus_or_exit()
    motions, labels, subjects, seen = [], [], [], set()
    for row in csv.DictReader((corpus / "LABELS.csv").open(encoding="utf-8")):
        inside = row["path"].startswith(part) and "bvh_daz" not in row["path"]
        if not inside or row["clip"] in seen or (row["label"] in SEVERAL_ACTIONS and not other):
            continue
        if row["label"] == "run" and not row["description"].startswith("run"):
            continue  # jumping jacks first, and a jog at the end
        seen.add(row["clip"])
        skeleton = corpus / row["skeleton"] if row["skeleton"] else None
        fps = float(row["fps"]) if row["format"] == "amc" else None
        clip = read_clip(corpus / row["path"], skeleton=skeleton, fps=fps, drop_tpose=True)
        motions.append(canonical_motion(clip))
        of_other = row["label"] in SEVERAL_ACTIONS
        labels.append(f"other: {row['description']}" if of_other else row["label"])
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


def read_bandai() -> tuple[list, np.ndarray, np.ndarray]:
    """Return Bandai's clips, with the style of each for a person."""
    motions, labels, styles = [], [], []
    for path in sorted((corpus_or_exit().parent / "zoo" / "bandai").glob("*.bvh")):
        dataset, label, style, _ = path.stem.split("_")
        motions.append(canonical_motion(read_clip(path)))
        labels.append(label)
        styles.append(f"{dataset} {style}")
    return motions, np.array(labels), np.array(styles)


def left_out(motions, labels, people) -> Iterator[tuple[ClassIndex, np.ndarray]]:
    """Yield the classes of all but one person's clips, and rows of that one's of these classes."""
    for person in sorted(set(people)):
        rows = np.flatnonzero((people == person) & np.isin(labels, labels[people != person]))
        if len(rows):
            yield learned(motions, labels, people, people != person), rows


def unknown_to(library: str, corpus: str, motions: list, labels: np.ndarray) -> list:
    """Return the clips of a corpus that show what a library has not."""
    said = [str(label).removeprefix("other: ") for label in labels]
    return [
        motion
        for motion, label in zip(motions, said, strict=True)
        if label.startswith(UNKNOWN[library, corpus])
    ]


def transfer() -> None:
    """Print how well unknown clips of another corpus are told from known ones."""
    corpora = {part: read_motions(part, other=True) for part in ("hdm05", "cmu")}
    corpora["bandai"] = read_bandai()
    for library, everything in corpora.items():
        is_class = ~np.char.startswith(everything[1].astype(str), "other: ")
        motions = [everything[0][i] for i in np.flatnonzero(is_class)]
        labels, people = (each[is_class] for each in everything[1:])
        strange = {
            corpus: unknown_to(library, corpus, *corpora[corpus][:2])
            for corpus in corpora
            if corpus != library
        }
        known, right, rows_of = [], [], []
        found: dict[str, list[float]] = {corpus: [] for corpus in strange}
        for classes, rows in left_out(motions, labels, people):
            answers = [classes.classify(motions[i]) for i in rows]
            known += [answer.novelty for answer in answers]
            right += [a.ranking[0].label == labels[i] for a, i in zip(answers, rows, strict=True)]
            rows_of += list(rows)
            for corpus, clips in strange.items():
                found[corpus] += [classes.classify(motion).novelty for motion in clips]
        print(
            f"{library}, people or styles left out: {np.mean(right):.1%} of {len(right)} clips "
            f"right, {np.mean(np.array(known) > 1):.1%} refused"
        )
        groups = {"": np.ones(len(known), bool)}
        if library == "cmu":
            groups[", walks and runs alone known"] = np.isin(labels[rows_of], ["walk", "run"])
        for of, chosen in groups.items():
            for corpus, novelty in found.items():
                print_told(f"{library} <- {corpus}{of}", np.array(known)[chosen], novelty)


def print_told(name: str, known: np.ndarray, unknown: list[float]) -> None:
    is_new = np.repeat([False, True], [len(known), len(unknown)])
    taken = np.mean(np.array(unknown) <= np.quantile(known, 1 - REFUSED))
    print(
        f"  {name}: AUROC {roc_auc_score(is_new, [*known, *unknown]):.3f}, taken "
        f"{taken:.0%} where {REFUSED:.0%} of {len(known)} known are refused, "
        f"{np.mean(np.array(unknown) <= 1):.0%} at the shipped cut"
    )


def open_set() -> None:
    """Print how many clips of CMU are right; those of no class are where they are refused."""
    motions, labels, subjects = read_motions("cmu", other=True)
    is_class = ~np.char.startswith(labels.astype(str), "other: ")
    said, right, by_order = [], [], []
    for subject in sorted(set(subjects)):
        own, others = subjects == subject, (subjects != subject) & is_class
        classes = learned(motions, labels, subjects, others)
        for i in np.flatnonzero(own & (~is_class | np.isin(labels, labels[others]))):
            answer = classes.classify(motions[i])
            said.append(labels[i] if is_class[i] else "other")
            right.append(answer.label == labels[i] if is_class[i] else answer.rejected)
            by_order.append(answer.ranking[0].label == labels[i] or not is_class[i])
    names = np.array(said)
    each = {str(k): f"{np.mean(np.array(right)[names == k]):.2f}" for k in sorted(set(said))}
    ranked = {str(k): f"{np.mean(np.array(by_order)[names == k]):.2f}" for k in ("walk", "run")}
    print(
        f"cmu, subjects left out, classes that another subject has: {np.mean(right):.1%} of "
        f"{len(right)} clips right, {each}; first in the ranking {ranked}"
    )


def main() -> None:
    parts = {"recognition": recognise, "rejection": rejection, "transfer": transfer,
             "open_set": open_set, "segments": segments}  # fmt: skip
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", nargs="+", choices=list(parts), default=list(parts))
    for name in parser.parse_args().only:
        parts[name]()


def segments() -> None:
    """Print how many frames of exercises are `none` by walks and runs of other subjects."""
    chosen = [*EXERCISES]
    motions, labels, subjects = read_motions("cmu")
    known = np.isin(labels, ["walk", "run"]) & (subjects != subject_of(chosen[0]))
    classes = learned(motions, labels, subjects, known)
    said: dict[str, list[str]] = {}
    for row in csv.DictReader((corpus_or_exit() / "LABELS.csv").open(encoding="utf-8")):
        if row["clip"] not in chosen:
            continue
        chosen.remove(row["clip"])  # it may be there in other formats
        skeleton = corpus_or_exit() / row["skeleton"] if row["skeleton"] else None
        clip = read_clip(corpus_or_exit() / row["path"], skeleton=skeleton, drop_tpose=True)
        found = classes.segment(canonical_motion(clip))
        frames = np.repeat([each.label for each in found], [len(each) for each in found])
        for exercise, spans in EXERCISES[row["clip"]].items():
            for first, end in spans:
                said.setdefault(exercise, []).extend(frames[first:end])
    none = {exercise: np.mean(np.array(each) == NONE) for exercise, each in said.items()}
    print(
        "segments, exercises by walks and runs of CMU's other subjects: frames that are none of "
        "them " + ", ".join(f"{exercise} {share:.2f}" for exercise, share in none.items())
    )


def recognise() -> None:
    recognition("hdm05", ("floored", "shared", "own"))
    recognition("cmu", ("floored", "own"))


if __name__ == "__main__":
    main()
