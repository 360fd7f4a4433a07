"""Fit the detector of faults anew: the regressions and the threshold of cleaning's table.

    python scripts/fit_cleaning.py CLIPS... [--subjects 01 03 HDM] [--trials 400] > entries.txt

Faults of the whole kit, and such as the figures of docs/cleaning.md are of, are injected into the
clean joints of the clips, which are files or folders of AMC and BVH files, and of synthetic motion.
The same clips come without faults, and as they are decoded from a library that keeps them to a
millimetre, too: what is found in these is wrong. Trials come in an order such that the first of
them, of which `--trials` says how many, are a fair sample.

Printed are the entries of ``mocapdb/cleaning/tuning.py`` that follow, from `DETECTION_THRESHOLD`
on: a logistic regression for each kind of hypothesis, and the threshold, which is the middle of
those with the best precision and recall (the sum of the F-scores of words and of spans) where every
subject is judged by regressions that were fitted on all others. A regression whose hypotheses are
all right or all wrong in these clips cannot be fitted: its entry stays as it is.

The table in the package comes from CMU's subjects 01, 03, 05, 08, 11, 16 and 35, actors bd, bk and
dg of HDM05 (two clips of each) and synthetic motion, none of whom the figures of docs/cleaning.md
are of. Its regressions of sharp edges are of an earlier fit, to more clips of the same subjects;
the others (`--kinds`) of two runs together, which docs/cleaning.md names.
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

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.evaluation import Counts, Trial, clean_joints, cut_trial, make_trials, score
from mocapdb.cleaning.evidence.corroboration import (
    SECOND_FEATURES,
    SECOND_MODELS,
    corroborated,
    corroboration,
)
from mocapdb.cleaning.evidence.fault_confidence import (
    FEATURES,
    MODELS,
    Model,
    Witnesses,
    log_odds_of,
    model_of,
    probability,
    restless_log_odds,
)
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.evidence.joint_limits import RotationLimits
from mocapdb.cleaning.evidence.pooled_spread import PooledSpread
from mocapdb.cleaning.kit_scores import CUT, kit_trials
from mocapdb.cleaning.local_rotations import local_rotations, motion_texture
from mocapdb.cleaning.map.detector import choose_spans, find_clip_consensus, gather
from mocapdb.compression import Target, decode, encode
from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic.fault_kit import RECIPES, Recipe
from mocapdb.io import read_clip
from mocapdb.motion.clip import CODED, Clip

MADE = ("walk", "box", "run", "hop", "sequence")
LONGEST_S, LEAST_FRAMES = 8.0, 60
DOUBTFUL, DOUBTFUL_WEIGHT = 0.05, 0.2  # on joints that jump by themselves: some are real faults
WRONG, NEITHER, RIGHT = 0.4, 0.2, 0.1  # share of a fault from which a hypothesis is one
REPEATED_WEIGHT = 0.3  # of what repeats a finer hypothesis, at a lower rate or by self-similarity
RARER = 0.45  # log-odds: captures have fewer faults than these trials, by clips left out
SECOND = "corroboration"
SECOND_DOUBTFUL_WEIGHT = 0.5
SECOND_C = 0.03  # as strong as it may be without loss, by clips left out
LIKELIER = 1.4  # log-odds: held down so, the second regressions are too careful, by clips left out
LEAST_RIGHT = 10  # a kind with fewer faults is not weighed again
CUT_WEIGHT = 0.3  # of faults that are cut off: clips are cut less often than these trials
NEAR_S = 0.07
LAST = ("similarity", "excursion")  # they leave to others what these explain
HARD = {
    "offset 10", "offset 20", "eased offset 45 and 90", "drift and snap 20", "drift and return",
    "jitter 20", "jitter 45", "yaw drift", "left and right exchanged",
}  # fmt: skip
"""Recipes that every clip gets; of the others it gets every second one."""
STEPS = (1, 4, 1, 2)
OF_CUT = ("cut offset", "drift", "held", "noise", "freeze")
"""What is learnt from clips that are cut in a fault."""
STORED_MM = 1.0
THRESHOLDS = (0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95)
AS_GOOD = 0.002  # of two F-scores: the middle of the thresholds that differ by less is taken


class Job(NamedTuple):
    """One trial to make of one clip."""

    clip: int
    seed: int
    recipe: Recipe | None = None  # of the kit; without one, faults as the figures are of
    step: int = 1  # every so manyeth frame is taken
    cut: bool = False  # in the middle of the first or last fault
    untouched: bool = False  # no faults: what is found is wrong
    stored: bool = False  # and the clip is decoded from what a library keeps of it


class Judged(NamedTuple):
    """A trial with its hypotheses: their evidence, and how much of a fault each is."""

    trial: Trial
    job: Job
    subject: str
    restless: list[bool]  # whether it is of a hand or a toe
    hypotheses: list[Hypothesis]
    spread: PooledSpread
    evidence: list[tuple[float, ...]]
    overlaps: list[float]


def calibration_clips(
    paths: Iterable[Path], subjects: Sequence[str], per_subject: int
) -> Iterator[Clip]:
    """Yield the first seconds of some clips of some subjects (of all, if none are named)."""
    counts: dict[str, int] = defaultdict(int)
    for path in paths:
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            subject = _subject(file.stem)
            is_wanted = not subjects or subject in subjects
            if file.suffix.lower() not in {".amc", ".bvh"} or not is_wanted:
                continue
            if counts[subject] < per_subject:
                counts[subject] += 1
                clip = read_clip(file, drop_tpose=True)
                yield clip[: round(LONGEST_S * clip.fps)]
    for seed, kind in enumerate(MADE, start=100):
        yield synthetic.make_clip(
            kind, seed=seed, sensor_noise_deg=0.02, phase_noise=0.2, duration_s=6.0
        )


def make_jobs(n_clips: int, seed: int) -> list[Job]:
    """Return the trials to make, in an order such that the first of them are a fair sample."""
    rng = np.random.default_rng(seed)
    jobs = []
    for clip in range(n_clips):
        for number, recipe in enumerate(RECIPES):
            if recipe.name in HARD or (clip + number) % 2 == 0:
                job = Job(clip, 100 * clip + number, recipe, int(rng.choice(STEPS)))
                jobs += [job]
                if recipe.where == "one joint" and (clip + number) % 3 == 0:
                    jobs.append(job._replace(cut=True))
        jobs += [Job(clip, clip, step=step, untouched=True) for step in (1, 4)]
        jobs.append(Job(clip, clip, step=4 if clip % 3 == 0 else 1, untouched=True, stored=True))
        jobs += [Job(clip, clip), Job(clip, clip + 1), Job(clip, clip + 2, stored=True)]
    return [jobs[i] for i in rng.permutation(len(jobs))]


def trials_of(clips: Sequence[Clip], job: Job) -> list[Trial]:
    """Return the trials of a job, if faults find room in the clip."""
    clip = clips[job.clip]
    if len(clip) // job.step >= LEAST_FRAMES:
        clip = clip.replace(channels=clip.channels[:: job.step], fps=clip.fps / job.step)
    if job.stored:
        clip = _stored(clip)
    if job.untouched:
        return [_untouched(clip)]
    if job.recipe:
        trials = [
            trial
            for name, trial in kit_trials(
                [clip], seed=job.seed, recipes=[job.recipe], seconds_per_fault=4.0
            )
            if name != CUT
        ]
    else:
        trials = make_trials([clip], seed=job.seed)
    if job.cut:
        trials = [cut_trial(trial, at_end=job.seed % 2 == 0) for trial in trials]
    return list(trials)


def judge(clips: Sequence[Clip], job: Job) -> Iterator[Judged]:
    """Yield the trials of a job with their hypotheses."""
    clip = clips[job.clip]
    for trial in trials_of(clips, job):
        native, texture = local_rotations(trial.clip), motion_texture(trial.clip)
        consensus, limits = find_clip_consensus(texture), RotationLimits(texture)
        witnesses = Witnesses(native, texture, consensus, limits)
        found = [h for h in gather(trial.clip, native, texture, consensus) if witnesses.moves(h)]
        yield Judged(
            trial,
            job,
            _subject(clip.name),
            [native.row_roles[h.row] in ("hand", "toe") for h in found],
            found,
            PooledSpread(texture),
            [witnesses.features(h) for h in found],
            [overlap_of(h, int(native.joints[h.row]), trial) for h in found],
        )


def _stored(clip: Clip) -> Clip:
    """Return a clip as it is decoded from a library."""
    payload = encode(clip, Target("mean_mm", STORED_MM)).data
    return clip.replace(channels=decode(payload, clip.skeleton), step=f"{CODED} pose")


def _subject(name: str) -> str:
    kind, *rest = name.split("_")
    return "synthetic" if kind in MADE else rest[0] if kind == "HDM" and rest else kind


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
    counts = joint in trial.joints or hypothesis.cue in ("root", "slow drift")  # both the root's
    if not trial.faults:
        # untouched: what is found is wrong, and probably on joints that jump by themselves
        return 0.0 if counts else DOUBTFUL
    if not counts:
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


def fit(judged: Iterable[Judged], kinds: Sequence[str] = ()) -> dict[str, Model]:
    """Return the regressions that trials make, of some kinds or of all; else the package's.

    Of what cut trials have, only what is cut off, or may be taken for it, tells. A hypothesis that
    repeats, at a lower rate or by self-similarity, what a finer one says of a fault tells less of
    soft edges.
    """
    samples: dict[str, list[tuple[tuple[float, ...], bool, float]]] = defaultdict(list)
    for one in judged:
        both = list(zip(one.hypotheses, one.overlaps, strict=True))
        right = [h for h, overlap in both if overlap > WRONG and h.cue not in LAST]
        for (hypothesis, overlap), evidence in zip(both, one.evidence, strict=True):
            name = model_of(hypothesis)
            if one.job.cut and name not in OF_CUT:
                continue
            if overlap < RIGHT or overlap > WRONG:
                weight = DOUBTFUL_WEIGHT if overlap == DOUBTFUL else 1.0
                if overlap > WRONG and _repeats(hypothesis, right):
                    weight = REPEATED_WEIGHT
                if overlap > WRONG and one.job.cut:
                    weight *= CUT_WEIGHT
                samples[name].append((evidence, overlap > WRONG, weight))
    models = dict(MODELS)
    for name, several in samples.items():
        if kinds and name not in kinds:
            continue
        model = _regression(several, 1.0)
        if model:
            models[name] = model._replace(constant=model.constant - RARER)
    return models


def fit_second(
    judged: Iterable[Judged], models: Mapping[str, Model], kinds: Sequence[str] = ()
) -> dict[str, Model]:
    """Return the regressions that weigh hypotheses beside each other; else the package's.

    Of what cut trials have, only what is cut off, or may be taken for it, tells.
    """
    if kinds and SECOND not in kinds:
        return dict(SECOND_MODELS)
    samples: dict[str, list[tuple[tuple[float, ...], bool, float]]] = defaultdict(list)
    for one in judged:
        clip, alone = one.trial.clip, log_odds_of_all(one, models)
        for i, evidence in corroboration(one.hypotheses, alone, one.spread, len(clip), clip.fps):
            name, overlap = model_of(one.hypotheses[i]), one.overlaps[i]
            if (one.job.cut and name not in OF_CUT) or RIGHT <= overlap <= WRONG:
                continue
            weight = SECOND_DOUBTFUL_WEIGHT if overlap == DOUBTFUL else 1.0
            samples[name].append((evidence, overlap > WRONG, weight))
    second = dict(SECOND_MODELS)
    for name, several in samples.items():
        model = _regression(several, SECOND_C)
        if model and sum(is_right for _, is_right, _ in several) >= LEAST_RIGHT:
            second[name] = model._replace(constant=model.constant + LIKELIER)
    return second


def _regression(several: list[tuple[tuple[float, ...], bool, float]], c: float) -> Model | None:
    """Return a regression on evidence, whether it is of a fault, and weights; None of one class."""
    evidence = np.array([e for e, *_ in several])
    is_right = [right for _, right, _ in several]
    if len(set(is_right)) < 2:
        return None
    mean, scale = evidence.mean(axis=0), evidence.std(axis=0) + 1e-6
    model = LogisticRegression(C=c, max_iter=5000)
    model.fit((evidence - mean) / scale, is_right, sample_weight=[w for *_, w in several])
    weights = model.coef_[0] / scale
    return Model(float(model.intercept_[0] - weights @ mean), weights)


def log_odds_of_all(one: Judged, models: Mapping[str, Model]) -> FloatArray:
    """Return what the first regressions say of the hypotheses of a trial."""
    both = zip(one.hypotheses, one.evidence, strict=True)
    return np.array([log_odds_of(h, evidence, models) for h, evidence in both])


def _repeats(hypothesis: Hypothesis, right: list[Hypothesis]) -> bool:
    return any(
        other.row == hypothesis.row
        and (other.halvings < hypothesis.halvings or hypothesis.cue in LAST)
        and other.start < hypothesis.end
        and hypothesis.start < other.end
        for other in right
    )


def score_left_out(
    judged: list[Judged],
    models: Mapping[str, tuple[dict[str, Model], dict[str, Model]]],
    threshold: float,
) -> dict[str, Counts]:
    """Return the counts of trials, each judged by regressions fitted without its subject."""
    flagged = {}
    for one in judged:
        first, second = models[one.subject]
        clip, less = one.trial.clip, restless_log_odds(one.trial.clip.fps)
        alone = log_odds_of_all(one, first)
        log_odds = corroborated(one.hypotheses, alone, one.spread, len(clip), clip.fps, second)
        likely = [
            (sure, h)
            for h, odds, restless in zip(
                one.hypotheses, log_odds.tolist(), one.restless, strict=True
            )
            if (sure := probability(odds - less * restless)) >= threshold
        ]
        mask = np.zeros_like(one.trial.mask)
        joints = local_rotations(one.trial.clip[:2]).joints
        for span in choose_spans(likely, joints, one.trial.clip.fps):
            mask[span.frames, span.joint] = True
        flagged[id(one.trial.clip)] = mask
    return score([one.trial for one in judged], lambda clip: flagged[id(clip)])


def choose_threshold(
    judged: list[Judged], tested: list[Judged], apart: Sequence[str], kinds: Sequence[str]
) -> float:
    """Return the middle of the best thresholds; print what every one of them makes."""
    left_out = {}
    for subject in {one.subject for one in judged}:
        others = [one for one in judged if one.subject != subject]
        first = fit(others, kinds)
        left_out[subject] = first, fit_second(others, first, kinds)
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


def entries(
    models: Mapping[str, Model], second: Mapping[str, Model], threshold: float
) -> Iterator[str]:
    """Yield the entries of the table as they stand there, without their comments."""
    yield f"DETECTION_THRESHOLD = {threshold}"
    for name, model in models.items():
        entry = f"{name.replace(' ', '_').upper()}_MODEL"
        if model is MODELS[name]:
            yield f"# {entry} stays as it is: these clips do not tell."
            continue
        yield f"{entry} = {{\n{textwrap.indent(_lines(model, FEATURES[name]), '    ')}\n}}"
    lines = ""
    for name, model in second.items():
        inner = textwrap.indent(_lines(model, SECOND_FEATURES[name]), "    ")
        lines += f'"{name}": {{\n{inner}\n}},\n'
    yield f"CORROBORATION_MODELS = {{\n{textwrap.indent(lines, '    ')}}}"


def _lines(model: Model, features: Sequence[str]) -> str:
    values = {"constant": model.constant}
    values |= dict(zip(features, model.weights.tolist(), strict=True))
    return "\n".join(f'"{key}": {round(value, 4)},' for key, value in values.items())


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
    parser.add_argument(
        "--kinds",
        nargs="+",
        default=[],
        help=f"regressions to fit, or {SECOND!r}: all that weigh hypotheses beside each other; "
        "others stay as they are",
    )
    parser.add_argument("--per-subject", type=int, default=2, help="clips of each")
    parser.add_argument("--trials", type=int, default=400, help="how many to make")
    parser.add_argument("--seed", type=int, default=1, help="of the trials")
    options = parser.parse_args()
    clips = list(calibration_clips(options.clips, options.subjects, options.per_subject))
    judged: list[Judged] = []
    for number, job in enumerate(make_jobs(len(clips), seed=options.seed)[: options.trials]):
        judged += judge(clips, job)
        if number % 50 == 0:
            say(f"{number} trials: {sum(len(one.hypotheses) for one in judged)} hypotheses")
    tested = [one for one in judged if one.job.recipe is None and not one.job.untouched]
    threshold = choose_threshold(judged, tested, options.apart, options.kinds)
    models = fit(judged, options.kinds)
    second = fit_second(judged, models, options.kinds)
    print("\n\n".join(entries(models, second, threshold)))


if __name__ == "__main__":
    main()
