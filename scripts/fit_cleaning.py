"""Fit the detector of faults anew: the regressions and the threshold of cleaning's table.

    python scripts/fit_cleaning.py CLIPS... [--subjects 01 03 HDM] > entries.txt

Faults are injected into the clean joints of the clips, which are files or folders of AMC and BVH
files, and of synthetic motion that is sharp over and over. The same clips come without faults, too:
what is found in them is wrong. Printed are the entries of ``mocapdb/cleaning/tuning.py`` that
follow from them, from `DETECTION_THRESHOLD` on: a logistic regression for each kind of hypothesis,
and the threshold, which is the middle of those with the best precision and recall (the sum of the
F-scores of words and of spans) where every subject is judged by regressions that were fitted on all
others. The trials that it is chosen by are as those of docs/cleaning.md. A regression whose
hypotheses are all right or all wrong in these clips cannot be fitted: its entry stays as it is.

The table in the package comes from CMU's subjects 01, 03, 05, 08, 11, 16 and 35 (AMC and BVH) and
the actors of HDM05, none of whom the figures of docs/cleaning.md are of.
"""

from __future__ import annotations

import argparse
import sys
import textwrap
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from sklearn.linear_model import LogisticRegression

from mocapdb.cleaning.evaluation import Counts, Trial, clean_joints, cut_trial, make_trials, score
from mocapdb.cleaning.evidence.fault_confidence import (
    FEATURES,
    MODELS,
    Model,
    Witnesses,
    confidence,
    model_of,
)
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.evidence.joint_limits import RotationLimits
from mocapdb.cleaning.kit_scores import kit_trials
from mocapdb.cleaning.local_rotations import local_rotations, motion_texture
from mocapdb.cleaning.map.detector import choose_spans, find_clip_consensus, gather
from mocapdb.corpus import synthetic
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip

SHARP = ("walk", "run", "hop", "box", "wave", "squat")
LONGEST_S = 40.0
DOUBTFUL, DOUBTFUL_WEIGHT = 0.05, 0.2  # on joints that jump by themselves: some are real faults
WRONG, NEITHER, RIGHT = 0.4, 0.2, 0.1  # share of a fault from which a hypothesis is one
NEAR_S = 0.07
LAST = ("similarity", "excursion")  # they leave to others what these explain
THRESHOLDS = (0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95)
AS_GOOD = 0.002  # of two F-scores: the middle of the thresholds that differ by less is taken


class Round(NamedTuple):
    """One injection into all clips."""

    seed: int
    step: int = 1  # every so manyeth frame is taken
    ease_s: float | tuple[float, float] = 0.0
    tremble_deg: float | tuple[float, float] = 0.0
    cut: bool = False  # clips are cut in the middle of their first or last fault
    kit: bool = False  # faults of the whole kit
    untouched: bool = False  # no faults: what is found is wrong
    as_tested: bool = False  # or with more faults, some of them smaller and shorter


ROUNDS = (
    Round(11), Round(12, step=2, ease_s=(0.03, 0.5)), Round(15, step=4, tremble_deg=(0.05, 0.8)),
    Round(16, cut=True), Round(17, step=2, cut=True), Round(18, untouched=True),
    Round(19, step=2, untouched=True), Round(20, step=4, untouched=True), Round(21, as_tested=True),
    Round(31, kit=True), Round(32, kit=True, step=2), Round(33, kit=True, step=4),
    Round(34, kit=True), Round(35, kit=True, step=4), Round(36, kit=True),
)  # fmt: skip


class Judged(NamedTuple):
    """A trial with its hypotheses: their evidence, and how much of a fault each is."""

    trial: Trial
    subject: str
    hypotheses: list[Hypothesis]
    evidence: list[tuple[float, ...]]
    overlaps: list[float]
    cut: bool


def calibration_clips(paths: Iterable[Path], subjects: Sequence[str]) -> Iterator[Clip]:
    """Yield the first seconds of the clips of some subjects (of all, if none are named)."""
    for path in paths:
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            is_wanted = not subjects or file.stem.split("_")[0] in subjects
            if file.suffix.lower() in {".amc", ".bvh"} and is_wanted:
                clip = read_clip(file, drop_tpose=True)
                yield clip[: round(LONGEST_S * clip.fps)]
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
    if of.kit:
        trials = [t for _, t in kit_trials(slower, seed=of.seed, seconds_per_fault=5.0)]
    if of.untouched:
        trials = [_untouched(clip) for clip in slower]
    if of.cut:
        trials = [cut_trial(t, at_end=i % 2 == 0) for i, t in enumerate(trials) if t.faults]
    for trial in trials:
        clip = trial.clip
        native, texture = local_rotations(clip), motion_texture(clip)
        consensus, limits = find_clip_consensus(texture), RotationLimits(texture)
        witnesses = Witnesses(native, texture, consensus, limits)
        found = [h for h in gather(clip, native, texture, consensus) if witnesses.moves(h)]
        likely = [(h, witnesses.features(h)) for h in found]
        yield Judged(
            trial,
            _subject(clip.name),
            [h for h, _ in likely],
            [evidence for _, evidence in likely],
            [overlap_of(h, int(native.joints[h.row]), trial) for h, _ in likely],
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
    if not trial.faults:
        # untouched: what is found is wrong, and probably on joints that jump by themselves
        return 0.0 if joint in trial.joints else DOUBTFUL
    if joint not in trial.joints and hypothesis.kind != "pop":
        return NEITHER
    if trial.ignored[start:end, joint].any():
        return NEITHER
    single = hypothesis.kind == "drift" or hypothesis.cue in ("cut off", "held")
    near, most = NEAR_S * trial.clip.fps, 0.0
    pop = hypothesis.kind == "pop"
    for fault in trial.faults:
        if fault.joint != joint or (fault.kind == "root jump") != pop:
            continue
        shared = max(0, min(end, fault.end) - max(start, fault.start))
        overlap = shared / (max(end, fault.end) - min(start, fault.start))
        touches = any(fault.start - near <= edge <= fault.end + near for edge in (start, end))
        most = max(most, overlap, NEITHER if touches and not single else 0.0)
    return most


def fit(judged: Iterable[Judged]) -> dict[str, Model]:
    """Return the regressions that trials make, those of the package where they make none.

    Cut trials only tell what is cut off. A hypothesis that repeats, at a lower rate or by
    self-similarity, what a finer one says of a fault tells nothing of soft edges.
    """
    samples: dict[str, list[tuple[tuple[float, ...], bool, float]]] = defaultdict(list)
    for one in judged:
        both = list(zip(one.hypotheses, one.overlaps, strict=True))
        right = [h for h, overlap in both if overlap > WRONG and h.cue not in LAST]
        for (hypothesis, overlap), evidence in zip(both, one.evidence, strict=True):
            name = model_of(hypothesis)
            if one.cut and name != "cut offset":
                continue
            if overlap < RIGHT or (overlap > WRONG and not _repeats(hypothesis, right)):
                weight = DOUBTFUL_WEIGHT if overlap == DOUBTFUL else 1.0
                samples[name].append((evidence, overlap > WRONG, weight))
    models = dict(MODELS)
    for name, several in samples.items():
        evidence, wrong = (
            np.array([e for e, *_ in several]),
            [is_wrong for _, is_wrong, _ in several],
        )
        if len(set(wrong)) < 2:
            continue
        mean, scale = evidence.mean(axis=0), evidence.std(axis=0) + 1e-6
        model = LogisticRegression(C=1.0, max_iter=5000)
        model.fit(
            (evidence - mean) / scale, wrong, sample_weight=[weight for *_, weight in several]
        )
        weights = model.coef_[0] / scale
        models[name] = Model(float(model.intercept_[0] - weights @ mean), weights)
    return models


def _repeats(hypothesis: Hypothesis, right: list[Hypothesis]) -> bool:
    return any(
        other.row == hypothesis.row
        and (other.halvings < hypothesis.halvings or hypothesis.cue in LAST)
        and other.start < hypothesis.end
        and hypothesis.start < other.end
        for other in right
    )


def score_left_out(
    judged: list[Judged], models: Mapping[str, dict[str, Model]], threshold: float
) -> dict[str, Counts]:
    """Return the counts of trials, each judged by regressions fitted without its subject."""
    flagged = {}
    for one in judged:
        likely = [
            (sure, h)
            for h, evidence in zip(one.hypotheses, one.evidence, strict=True)
            if (sure := confidence(h, evidence, models[one.subject])) >= threshold
        ]
        mask = np.zeros_like(one.trial.mask)
        joints = local_rotations(one.trial.clip[:2]).joints
        for span in choose_spans(likely, joints, one.trial.clip.fps):
            mask[span.frames, span.joint] = True
        flagged[id(one.trial.clip)] = mask
    return score([one.trial for one in judged], lambda clip: flagged[id(clip)])


def choose_threshold(judged: list[Judged], tested: list[Judged], apart: Sequence[str]) -> float:
    """Return the middle of the best thresholds; print what every one of them makes."""
    left_out = {
        subject: fit(one for one in judged if one.subject != subject)
        for subject in {one.subject for one in judged}
    }
    sets = {"all": tested, "apart": [one for one in tested if one.subject in apart]}
    worths = []
    for threshold in THRESHOLDS:
        line, worth = f"{threshold}:", 0.0
        for name, several in sets.items():
            counts = score_left_out(several, left_out, threshold) if several else {}
            for unit in ("words", "spans") if counts else ():
                recall, precision = counts[unit].recall, counts[unit].precision
                line += f"  {name} {unit} {recall:.3f}/{precision:.3f}"
                if name == "all" and recall + precision > 0:
                    worth += 2.0 * recall * precision / (recall + precision)
        say(line)
        worths.append(worth)
    good = np.flatnonzero(np.array(worths) >= max(worths) - AS_GOOD)
    return THRESHOLDS[good[len(good) // 2]]


def entries(models: Mapping[str, Model], threshold: float) -> Iterator[str]:
    """Yield the entries of the table as they stand there, without their comments."""
    yield f"DETECTION_THRESHOLD = {threshold}"
    for name, model in models.items():
        entry = f"{name.replace(' ', '_').upper()}_MODEL"
        if model is MODELS[name]:
            yield f"# {entry} stays as it is: these clips do not tell."
            continue
        values = {"constant": model.constant}
        values |= dict(zip(FEATURES[name], model.weights.tolist(), strict=True))
        lines = "\n".join(f'"{key}": {round(value, 4)},' for key, value in values.items())
        yield f"{entry} = {{\n{textwrap.indent(lines, '    ')}\n}}"


def say(line: str) -> None:
    """Print progress, apart from the entries."""
    print(line, file=sys.stderr, flush=True)


def main() -> None:
    """Inject, collect evidence, fit, choose the threshold, print the entries."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("clips", nargs="+", type=Path, help="AMC and BVH files, or folders of them")
    parser.add_argument(
        "--subjects", nargs="+", default=[], help="only files whose names begin so, before the '_'"
    )
    parser.add_argument(
        "--apart", nargs="+", default=[], help="subjects whose scores are printed apart, too"
    )
    options = parser.parse_args()
    clips = list(calibration_clips(options.clips, options.subjects))
    judged, tested = [], []
    for of in ROUNDS:
        several = list(judge(clips, of))
        judged += several
        tested += several if of.as_tested else []
        say(f"{of}: {sum(len(one.hypotheses) for one in several)} hypotheses")
    threshold = choose_threshold(judged, tested, options.apart)
    print("\n\n".join(entries(fit(judged), threshold)))


if __name__ == "__main__":
    main()
