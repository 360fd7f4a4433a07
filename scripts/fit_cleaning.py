"""Fit the constants of the fault detector: mocapdb/cleaning/data/calibration.json.

    python scripts/fit_cleaning.py CORPUS

Faults with sharp and with soft edges are injected into the clean joints of clips of the calibration
subjects (CMU's 01, 03, 05, 08, 16 and 35, and a quarter of HDM05's clips), at 120, 60 and 30 frames
a second. What is kept is a logistic regression for each kind of hypothesis. How well it does is
printed for subjects left out in turn, by threshold.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from sklearn.linear_model import LogisticRegression

from mocapdb.cleaning.detector import (
    FEATURES,
    MODELS,
    features,
    find_clip_consensus,
    gather,
    model_of,
)
from mocapdb.cleaning.evaluation import make_trials
from mocapdb.cleaning.texture import local_rotations, motion_texture
from mocapdb.io import read_clip

SUBJECTS = ("01", "03", "05", "08", "16", "35")
ROUNDS = ((1, 0.0), (1, (0.03, 0.5)), (2, 0.0), (4, 0.0))  # frame step, easing
LONGEST_FRAMES = 2400
WRONG, NEITHER, RIGHT = 0.4, 0.2, 0.1  # share of a fault from which a hypothesis is one
NEAR_S = 0.07
THRESHOLD = 0.7
OUTPUT = Path(__file__).parents[1] / "mocapdb" / "cleaning" / "data" / "calibration.json"


class Sample(NamedTuple):
    """A hypothesis: its regression, its evidence, how much of a fault it is, and whose it is."""

    model: str
    evidence: tuple[float, ...]
    overlap: float
    subject: str


def calibration_clips(corpus: Path):
    """Yield the clips of the calibration subjects."""
    for path in sorted((corpus / "cmu").rglob("*")):
        subject = path.stem.split("_")[0]
        is_clip = path.suffix in {".amc", ".bvh"} and "daz" not in str(path)
        if is_clip and subject in SUBJECTS:
            yield read_clip(path, drop_tpose=True)
    for path in sorted((corpus / "hdm05").rglob("*.amc"))[::4]:
        yield read_clip(path)


def overlap_of(a, b, near: float) -> float:
    """Return the frames that a hypothesis shares with a fault, over those that either has.

    At least `NEITHER` where one of its ends is in the fault, or nearly: what a fault's own edges
    give rise to is no evidence of what edges are like where nothing is wrong.
    """
    shared = max(0, min(a.end, b.end) - max(a.start, b.start))
    overlap = shared / (max(a.end, b.end) - min(a.start, b.start))
    touches = any(b.start - near <= edge <= b.end + near for edge in (a.start, a.end))
    return max(overlap, NEITHER) if touches else overlap


def collect(clips, seed: int, step: int, ease_s):
    """Yield the samples of one round of injections."""
    slower = [c.replace(channels=c.channels[::step], fps=c.fps / step) for c in clips]
    trials = make_trials(
        slower, seed=seed, size_deg=(10.0, 90.0), length_s=(0.1, 1.0), seconds_per_fault=4.0,
        ease_s=ease_s,
    )  # fmt: skip
    for trial in trials:
        native, texture = local_rotations(trial.clip), motion_texture(trial.clip)
        consensus = find_clip_consensus(texture, ())
        joints, counted = native.joints.tolist(), set(trial.joints.tolist())
        subject = trial.clip.name.split("_")[1 if trial.clip.name.startswith("HDM") else 0]
        for h in gather(native, texture, consensus):
            if joints[h.row] not in counted:
                continue
            own = [f for f in trial.faults if f.joint == joints[h.row]]
            shares = [overlap_of(h, f, NEAR_S * trial.clip.fps) for f in own]
            small = trial.ignored[h.start : h.end, joints[h.row]].any()
            overlap = NEITHER if small else max(shares, default=0.0)
            evidence = features(h, trial.clip.fps, texture, consensus)
            yield Sample(model_of(h), evidence, overlap, subject)


def fit(samples) -> tuple[float, np.ndarray]:
    """Return constant and weights of a regression."""
    kept = [s for s in samples if s.overlap > WRONG or s.overlap < RIGHT]
    evidence = np.array([s.evidence for s in kept])
    mean, scale = evidence.mean(axis=0), evidence.std(axis=0) + 1e-6
    model = LogisticRegression(C=1.0, max_iter=5000)
    model.fit((evidence - mean) / scale, [s.overlap > WRONG for s in kept])
    weights = model.coef_[0] / scale
    return float(model.intercept_[0] - weights @ mean), weights


def main() -> None:
    """Inject, collect evidence, fit, write."""
    clips = [c[:LONGEST_FRAMES] for c in calibration_clips(Path(sys.argv[1]))]
    samples: list[Sample] = []
    for seed, (step, ease_s) in enumerate(ROUNDS, start=11):
        samples += collect(clips, seed, step, ease_s)
        print(f"{120 // step} Hz, eased {ease_s}: {len(samples)} hypotheses", flush=True)
    models = {}
    for name in MODELS:
        of_model = [s for s in samples if s.model == name]
        _print_held_out(name, of_model)
        constant, weights = fit(of_model)
        models[name] = {
            "constant": round(constant, 4),
            "weights": dict(zip(FEATURES[name], np.round(weights, 4).tolist(), strict=True)),
        }
    OUTPUT.write_text(
        json.dumps({"threshold": THRESHOLD, "models": models}, indent=1) + "\n", encoding="utf-8"
    )


def _print_held_out(name: str, samples) -> None:
    """Print recall and precision of hypotheses of each subject, fitted on all others."""
    subjects = sorted({s.subject for s in samples})
    sure, overlap = [], []
    for subject in subjects:
        constant, weights = fit([s for s in samples if s.subject != subject])
        own = [s for s in samples if s.subject == subject]
        scores = np.array([s.evidence for s in own]) @ weights + constant
        sure += (1.0 / (1.0 + np.exp(-scores))).tolist()
        overlap += [s.overlap for s in own]
    sure, overlap = np.array(sure), np.array(overlap)
    figures = []
    for threshold in (0.2, 0.3, 0.5, 0.7, 0.9):
        found = ((sure >= threshold) & (overlap > WRONG)).sum()
        false = ((sure >= threshold) & (overlap < RIGHT)).sum()
        recall, precision = found / (overlap > WRONG).sum(), found / max(found + false, 1)
        figures.append(f"{threshold}: {recall:.3f}/{precision:.3f}")
    print(f"{name:8s}{(overlap > WRONG).sum():6d} of {len(samples):6d}   {'   '.join(figures)}")


if __name__ == "__main__":
    main()
