"""Fit the constants of the fault detector: mocapdb/cleaning/data/calibration.json.

    python scripts/fit_cleaning.py CORPUS

Faults are injected into the clean joints of clips of the calibration subjects: CMU's 01, 03, 05,
08, 11, 16 and 35 and the three actors of HDM05, none of whom the figures of docs/cleaning.md are
of, and of synthetic motion that is sharp over and over. The same clips come without faults, too:
what is found in them is wrong. What is kept is a logistic regression for each kind of hypothesis,
and a threshold: the middle of those with the best precision and recall (the sum of the F-scores of
words and of spans) where every subject is judged by constants that were fitted on all others. The
trials that it is chosen by are as those of docs/cleaning.md. COMPLEX, a playground and dance, is
printed apart.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from sklearn.linear_model import LogisticRegression

from mocapdb.cleaning.evaluation import Counts, Trial, clean_joints, cut_trial, make_trials, score
from mocapdb.cleaning.evidence.fault_confidence import (
    FEATURES,
    MODELS,
    Calibration,
    features,
    model_of,
)
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.evidence.joint_limits import RotationLimits
from mocapdb.cleaning.local_rotations import local_rotations, motion_texture
from mocapdb.cleaning.map.detector import choose_spans, find_clip_consensus, gather
from mocapdb.corpus import synthetic
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip

SUBJECTS = ("01", "03", "05", "08", "11", "16", "35")
COMPLEX = ("01", "05")
SHARP = ("walk", "run", "hop", "box", "wave", "squat")
LONGEST_S = 40.0
WRONG, NEITHER, RIGHT = 0.4, 0.2, 0.1  # share of a fault from which a hypothesis is one
NEAR_S = 0.07
THRESHOLDS = (0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95)
AS_GOOD = 0.002  # of two F-scores: the middle of the thresholds that differ by less is taken
OUTPUT = Path(__file__).parents[1] / "mocapdb" / "cleaning" / "data" / "calibration.json"


class Round(NamedTuple):
    """One injection into all clips."""

    seed: int
    step: int = 1  # every so manyeth frame is taken
    ease_s: float | tuple[float, float] = 0.0
    tremble_deg: float | tuple[float, float] = 0.0
    cut: bool = False  # clips are cut in the middle of their first or last fault
    untouched: bool = False  # no faults: what is found is wrong
    as_tested: bool = False  # or with more faults, some of them smaller and shorter


ROUNDS = (
    Round(11), Round(12, ease_s=(0.03, 0.5)), Round(13, step=2), Round(14, step=4),
    Round(15, tremble_deg=(0.05, 0.8)), Round(16, cut=True), Round(17, cut=True),
    Round(18, untouched=True), Round(19, step=2, untouched=True), Round(21, as_tested=True),
    Round(22, as_tested=True),
)  # fmt: skip


class Judged(NamedTuple):
    """A trial with its hypotheses: their evidence, and how much of a fault each is."""

    trial: Trial
    subject: str
    hypotheses: list[Hypothesis]
    evidence: list[tuple[float, ...]]
    overlaps: list[float]
    cut: bool


def calibration_clips(corpus: Path) -> Iterator[Clip]:
    """Yield the clips of the calibration subjects."""
    for path in sorted((corpus / "cmu").rglob("*")):
        subject = path.stem.split("_")[0]
        is_clip = path.suffix in {".amc", ".bvh"} and "daz" not in str(path)
        if is_clip and subject in SUBJECTS:
            yield read_clip(path, drop_tpose=True)
    for path in sorted((corpus / "hdm05").rglob("*.amc")):
        yield read_clip(path)
    for seed, kind in enumerate(SHARP * 4, start=100):
        yield synthetic.make_clip(kind, seed=seed, sensor_noise_deg=0.02, phase_noise=0.2)


def judge(clips: list[Clip], of: Round) -> Iterator[Judged]:
    """Yield the trials of one round."""
    slower = [c.replace(channels=c.channels[:: of.step], fps=c.fps / of.step) for c in clips]
    sizes = {} if of.as_tested else {"size_deg": (10.0, 90.0), "length_s": (0.1, 1.0)}
    trials = make_trials(
        slower, seed=of.seed, seconds_per_fault=8.0 if of.as_tested else 4.0, ease_s=of.ease_s,
        tremble_deg=of.tremble_deg, **sizes,
    )  # fmt: skip
    if of.untouched:
        trials = [_untouched(clip) for clip in slower]
    if of.cut:
        trials = [cut_trial(t, at_end=i % 2 == 0) for i, t in enumerate(trials) if t.faults]
    for trial in trials:
        clip = trial.clip
        native, texture = local_rotations(clip), motion_texture(clip)
        consensus, limits = find_clip_consensus(texture), RotationLimits(texture)
        hypotheses = gather(native, texture, consensus)
        yield Judged(
            trial,
            _subject(clip.name),
            hypotheses,
            [features(h, clip.fps, texture, consensus, limits) for h in hypotheses],
            [overlap_of(h, int(native.joints[h.row]), trial) for h in hypotheses],
            of.cut,
        )


def _subject(name: str) -> str:
    kind, *rest = name.split("_")
    return "synthetic" if kind in SHARP else rest[0] if kind == "HDM" else kind


def _untouched(clip: Clip) -> Trial:
    nowhere = np.zeros((len(clip), clip.skeleton.n_joints), dtype=np.bool_)
    return Trial(clip, clip, clean_joints(clip), nowhere, (), nowhere)


def overlap_of(hypothesis: Hypothesis, joint: int, trial: Trial) -> float:
    """Return the frames that a hypothesis shares with a fault, over those that either has.

    At least `NEITHER`, which counts neither way, on joints that are not clean, where a freeze is
    small, and where a hypothesis with several edges has one in the fault, or nearly: what a fault's
    own edges give rise to is no evidence of what edges are like where nothing is wrong. A single
    edge, however, has a right and a wrong side.
    """
    start, end = hypothesis.start, hypothesis.end
    if joint not in trial.joints or trial.ignored[start:end, joint].any():
        return NEITHER
    single = hypothesis.kind == "drift" or hypothesis.sign in ("edge", "held")
    near, most = NEAR_S * trial.clip.fps, 0.0
    for fault in (f for f in trial.faults if f.joint == joint):
        shared = max(0, min(end, fault.end) - max(start, fault.start))
        overlap = shared / (max(end, fault.end) - min(start, fault.start))
        touches = any(fault.start - near <= edge <= fault.end + near for edge in (start, end))
        most = max(most, overlap, NEITHER if touches and not single else 0.0)
    return most


def fit(judged: Iterable[Judged], threshold: float = 1.0) -> Calibration:
    """Return the constants that trials make.

    Cut trials only tell what is cut off. A hypothesis that repeats, at a lower rate or by
    self-similarity, what a finer one says of a fault tells nothing of soft edges.
    """
    samples: dict[str, list[tuple[tuple[float, ...], bool]]] = defaultdict(list)
    for one in judged:
        both = list(zip(one.hypotheses, one.overlaps, strict=True))
        right = [h for h, overlap in both if overlap > WRONG and h.sign != "unlike"]
        for (hypothesis, overlap), evidence in zip(both, one.evidence, strict=True):
            name = model_of(hypothesis)
            if one.cut and name != "cut offset":
                continue
            if overlap < RIGHT or (overlap > WRONG and not _repeats(hypothesis, right)):
                samples[name].append((evidence, overlap > WRONG))
    constants, weights = {}, {}
    for name in MODELS:
        evidence = np.array([e for e, _ in samples[name]])
        mean, scale = evidence.mean(axis=0), evidence.std(axis=0) + 1e-6
        model = LogisticRegression(C=1.0, max_iter=5000)
        model.fit((evidence - mean) / scale, [wrong for _, wrong in samples[name]])
        weights[name] = model.coef_[0] / scale
        constants[name] = float(model.intercept_[0] - weights[name] @ mean)
    return Calibration(threshold, constants, weights)


def _repeats(hypothesis: Hypothesis, right: list[Hypothesis]) -> bool:
    return any(
        other.row == hypothesis.row
        and (other.coarseness < hypothesis.coarseness or hypothesis.sign == "unlike")
        and other.start < hypothesis.end
        and hypothesis.start < other.end
        for other in right
    )


def score_left_out(
    judged: list[Judged], models: dict[str, Calibration], threshold: float
) -> dict[str, Counts]:
    """Return the counts of trials, each judged by constants fitted without its subject."""
    flagged = {}
    for one in judged:
        likely = [
            (sure, h)
            for h, evidence in zip(one.hypotheses, one.evidence, strict=True)
            if (sure := models[one.subject].confidence(h, evidence)) >= threshold
        ]
        mask = np.zeros_like(one.trial.mask)
        joints = local_rotations(one.trial.clip[:2]).joints
        for span in choose_spans(likely, joints, one.trial.clip.fps):
            mask[span.start : span.end, span.joint] = True
        flagged[id(one.trial.clip)] = mask
    return score([one.trial for one in judged], lambda clip: flagged[id(clip)])


def main() -> None:
    """Inject, collect evidence, fit, choose the threshold, write."""
    clips = [c[: round(LONGEST_S * c.fps)] for c in calibration_clips(Path(sys.argv[1]))]
    judged, tested = [], []
    for of in ROUNDS:
        several = list(judge(clips, of))
        judged += several
        tested += several if of.as_tested else []
        print(f"{of}: {sum(len(one.hypotheses) for one in several)} hypotheses", flush=True)
    left_out = {
        subject: fit(one for one in judged if one.subject != subject)
        for subject in {one.subject for one in judged}
    }
    worths = []
    sets = {"all": tested, "complex": [one for one in tested if one.subject in COMPLEX]}
    for threshold in THRESHOLDS:
        line, worth = f"{threshold}:", 0.0
        for name, several in sets.items():
            counts = score_left_out(several, left_out, threshold)
            for unit in ("words", "spans"):
                recall, precision = counts[unit].recall, counts[unit].precision
                line += f"  {name} {unit} {recall:.3f}/{precision:.3f}"
                if name == "all":
                    worth += 2.0 * recall * precision / (recall + precision)
        print(line, flush=True)
        worths.append(worth)
    good = np.flatnonzero(np.array(worths) >= max(worths) - AS_GOOD)
    model = fit(judged, THRESHOLDS[good[len(good) // 2]])
    stored = {
        "threshold": model.threshold,
        "models": {
            name: {
                "constant": round(model.constants[name], 4),
                "weights": dict(
                    zip(FEATURES[name], np.round(model.weights[name], 4).tolist(), strict=True)
                ),
            }
            for name in MODELS
        },
    }
    OUTPUT.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
