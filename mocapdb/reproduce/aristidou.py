"""Tables 1 and 2 of Aristidou et al. (2018), computed beside their figures.

Their clips, faults and ground truth are not public, so this is their experiment on other data:
faults with a seed in clips of subjects that the detector was not calibrated on. `CONVENTIONS`
states it in full.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from mocapdb.base.arrays import BoolArray, StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.cleaning.evaluation import Counts, Trial, cut_trial, make_trials, repair_errors, score
from mocapdb.cleaning.evidence.fault_shapes import KINDS
from mocapdb.cleaning.local_rotations import Texture, local_rotations, motion_texture
from mocapdb.cleaning.map.detector import detect_faults
from mocapdb.cleaning.map.digression_map import literal_map
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary, find_neighbours
from mocapdb.cleaning.repair.repair import clean_clip
from mocapdb.errors import CorpusError
from mocapdb.io import find_motion_files, read_with_settings
from mocapdb.motion.clip import Clip
from mocapdb.motion.quaternions import angles_deg
from mocapdb.reproduce._tables import Job, Key, Row, printed_figures, reported, run_jobs, table_row
from mocapdb.reproduce.aristidou_baselines import (
    DerivativeLimits,
    JointLimits,
    chai_hodgins_neighbours,
)
from mocapdb.reproduce.aristidou_kit import CALIBRATION

__all__ = ["CONTEXTS", "CONVENTIONS", "PAPER", "TABLES", "printed_rows", "reproduce"]

PAPER = "Aristidou 2018"
TABLES = ("1", "2", "spans", "text")
KIT = "kit"
LOCOMOTION = ("02_01", "02_02", "02_03", "06_", "07_", "12_", "26_", "32_")
COMPLEX = ("02_05", "02_07", "13_29", "13_30", "13_31", "49_", "131_")
CONTEXTS = {"local": 0, "small (5-10 clips)": 8, "large (20-30 clips)": 25}
LONGEST_S = 40.0
CLIPS = 12
TRIALS_A_JOB = 3  # that one process takes at once, so that several end together
SOFT_S = (0.2, 0.5)
RIVALS_OF_THE_PAPER = ("Holden 2015", "Feng 2015", "Burke-Lasenby 2016", "Gloersen-Federolf 2016")
HARDER = ("soft edges", "cut off")
CONVENTIONS = (
    "clips: CMU's, AMC where there is one, else BVH; locomotion 02_01..03, 06, 07, 12, 26, 32; for "
    "their dance, complex motion: 02_05, 02_07, 13_29..31, 49, 131; the first 40 s of each",
    "faults: offset, flip, noise, freeze and drift in turn, 20 to 90 degrees, 0.15 to 1 s, one for "
    "every 8 s, on joints that are clean in the clip (no jump over 8 degrees)",
    "figures are of words of 15 frames at 24 Hz, every 5 frames, wrong if any joint is",
    "self-similarity is this package's detector, which adds discontinuity and joint limits; "
    "calibrated on subjects 01, 03, 05, 08, 11, 16, 35, HDM05 and synthetic motion only; 'paper' "
    "rows below it are their rule as printed: rows divided by their means, flagged over 0.5",
    "baselines learn their limits from the calibration subjects' clips of the same file format",
    "Chai-Hodgins distance: neighbours by positions and velocities, then their rule as printed, so "
    "beside the row of that rule and not beside this package's detector",
    "the four rival repairs are not computed: the kit has others",
    "table 2: eq. 2 (half angles, radians) after a repair of what was detected; global: mean per "
    "frame over the joints of a clip, its average and maximum over clips; per joint: of the faulty "
    "joint in the faulty frames, average and maximum over faults",
    "spans: beyond the paper, by this package's detector on the clip alone; one is found if flags "
    "cover half of it and right if a fault covers half of it; untouched: share of all joints' "
    "seconds flagged without faults; degrees: mean angle to the truth in the faulty frames after a "
    "repair of what was detected, and with a straight line across the same spans",
    "soft edges: such faults that ease in and out over 0.2 to 0.5 s, but freezes do not; cut off: "
    "one fault a clip, in the middle of which every other clip ends and the rest begin",
    "seconds are CPU seconds of one core, kernels compiled, of the search for neighbours alone",
)

Figures: TypeAlias = dict[tuple[str, ...], float]
"""Figures by table, method, context, motion and metric."""

Limits: TypeAlias = dict[tuple[str, ...], tuple[JointLimits, DerivativeLimits]]
"""The baselines' limits by the joints of a family of bodies."""

Flag: TypeAlias = Callable[[Clip], BoolArray]
Cleaned: TypeAlias = tuple[Clip, BoolArray]


def reproduce(
    corpus: StrPath,
    *,
    tables: Sequence[str] = TABLES,
    clips: int | None = CLIPS,
    seed: int = 1,
    jobs: int = 1,
    progress: Progress = silent,
) -> list[Row]:
    """Return the rows of the paper's tables with ours beside them.

    Parameters
    ----------
    corpus : path-like
        Folder with CMU's AMC or BVH files, at any depth.
    tables : sequence of str
        Out of `TABLES`.
    clips : int, optional
        Of each motion so many at most, spread evenly over them; all with None.
    seed : int
        Of the faults.
    jobs : int
        Processes to share the work.
    progress : callable
        Called with steps done, steps in all, and what is being done.

    Returns
    -------
    list of Row
        Ours is None where the note says why, the paper's None for a row that it does not have.

    Raises
    ------
    CorpusError
        If the corpus has none of the clips.
    """
    everything = _read_corpus(Path(corpus), progress)
    found = {
        "locomotion": [c for c in everything if c.name.startswith(LOCOMOTION)],
        "dance": [c for c in everything if c.name.startswith(COMPLEX)],
    }
    if not any(found.values()):
        raise CorpusError(
            f"Expected clips of CMU's subjects 02, 06, 07, 12, 13, 26, 32, 49 or 131 in {corpus}, "
            "but there is none."
        )
    sets = {motion: _spread(several, clips) for motion, several in found.items()}
    trials = {motion: make_trials(several, seed=seed) for motion, several in sets.items()}
    harder = {motion: _harder_trials(several, seed) for motion, several in sets.items()}
    limits = _limits(everything, [t for several in trials.values() for t in several])
    todo: dict[Key, Job] = {}
    for motion, several in trials.items():
        for first, some in _some_at_a_time(several):
            others = [_similar(trial.clip, everything) for trial in some]
            asked = limits if "1" in tables else None
            todo["faults", motion, first] = partial(_detected, some, others, asked)
            if "spans" in tables:
                todo["untouched", motion, first] = partial(_untouched, some)
        if "spans" in tables:
            for name, those in harder[motion].items():
                for first, some in _some_at_a_time(those):
                    todo[name, motion, first] = partial(_masks, some)
    if "text" in tables:
        todo["speed",] = partial(_speed, everything)
    done = run_jobs(todo, n_jobs=jobs, progress=progress)

    def joined(what: str, motion: str) -> list[Any]:
        """Return what came of the trials of a motion, in their order."""
        return [each for key, several in done.items() if key[:2] == (what, motion)
                for each in several]  # fmt: skip

    ours: Figures = {}
    cleaned: dict[str, list[Cleaned]] = {}
    for motion, several in trials.items():
        answers: list[Detected] = joined("faults", motion)
        cleaned[motion] = [answer.cleaned for answer in answers]
        for method in answers[0].flags if answers else ():
            counts = _words(several, [answer.flags[method] for answer in answers])
            ours["1", *method, motion, "recall"] = counts.recall
            ours["1", *method, motion, "precision"] = counts.precision
        if "spans" in tables:
            _fill_in_spans(ours, motion, several, cleaned[motion])
            shares, seconds = joined("untouched", motion), [t.original.duration_s for t in several]
            share = float(np.average(shares, weights=seconds)) if several else float("nan")
            ours["spans", "untouched", "-", motion, "share flagged"] = share
            for name, those in harder[motion].items():
                masks = joined(name, motion)
                _fill_in_harder_spans(ours, name, motion, score(those, _flags(those, masks)))
    _fill_in_repairs(ours, trials, cleaned)
    ours |= done.get(("speed",), {})
    n_faults = {motion: sum(len(t.faults) for t in several) for motion, several in trials.items()}
    n_clips = {motion: f"{len(sets[motion])} of {len(found[motion])} clips" for motion in sets}
    return _rows(ours, tables, n_faults, n_clips)


def printed_rows() -> list[Row]:
    """Return the paper's figures without ours."""
    return _rows({}, TABLES, {}, {})


def _spread(clips: list[Clip], most: int | None) -> list[Clip]:
    """Return so many clips at most, evenly over the list."""
    if most is None or most >= len(clips):
        return clips
    return [clips[i * len(clips) // most] for i in range(most)]


def _read_corpus(folder: Path, progress: Progress) -> list[Clip]:
    """Read every clip that is needed once, AMC rather than BVH, the first 40 s of each."""
    starts = (*LOCOMOTION, *COMPLEX, *(f"{subject}_" for subject in CALIBRATION))
    paths: dict[str, Path] = {}
    for suffix in (".amc", ".bvh"):
        for path in find_motion_files(folder, [suffix]):
            if path.stem.startswith(starts) and "daz" not in path.parent.name:
                paths.setdefault(path.stem, path)
    clips = []
    for path in reported([paths[stem] for stem in sorted(paths)], progress, lambda p: p.stem):
        clip = read_with_settings(path, drop_tpose=True)
        clips.append(clip[: round(LONGEST_S * clip.fps)])
    return clips


def _some_at_a_time(trials: list[Trial]) -> Iterator[tuple[int, list[Trial]]]:
    """Yield trials for one process, with the number of the first."""
    for first in range(0, len(trials), TRIALS_A_JOB):
        yield first, trials[first : first + TRIALS_A_JOB]


def _similar(clip: Clip, clips: list[Clip]) -> list[Clip]:
    """Return other clips of the same joints and sort of motion, as many as the largest context."""
    fitting = [
        other
        for other in clips
        if other.skeleton.names == clip.skeleton.names
        and other.name != clip.name
        and other.name.startswith(LOCOMOTION) == clip.name.startswith(LOCOMOTION)
    ]
    return fitting[: max(CONTEXTS.values())]


def _limits(clips: list[Clip], trials: list[Trial]) -> Limits:
    """Return the baselines for each family of joints, learnt from the calibration's clips."""
    learning = [clip for clip in clips if clip.name.split("_")[0] in CALIBRATION]
    limits: Limits = {}
    for trial in trials:
        names = trial.clip.skeleton.names
        if names not in limits:
            same = [c for c in learning if c.skeleton.names == names] or [trial.clip]
            limits[names] = JointLimits.learn(same), DerivativeLimits.learn(same)
    return limits


class Detected(NamedTuple):
    """What was found in a trial.

    Attributes
    ----------
    cleaned : (Clip, (F, J) of bool)
        By the clip alone: repaired, and where it was flagged.
    flags : dict of (str, str) to (F, J) of bool
        By method and context.
    """

    cleaned: Cleaned
    flags: dict[tuple[str, str], BoolArray]


def _detected(
    trials: list[Trial], similar: list[list[Clip]], limits: Limits | None
) -> list[Detected]:
    """Clean trials, and flag them by every other method where the limits of the baselines say so.

    Parameters
    ----------
    trials : list of Trial
    similar : list of list of Clip
        For each the clips of its contexts.
    limits : dict, optional
    """
    found = []
    textures: dict[str, Texture] = {}
    for trial, others in zip(trials, similar, strict=True):
        clip = trial.clip
        by_itself = clean_clip(clip)
        mask = by_itself.digression_map.mask
        flags = {("self-similarity", "local"): mask}
        if limits is not None:
            turned, fast = (baseline.flag(clip) for baseline in limits[clip.skeleton.names])
            flags["baseline a: joint limits", "-"] = turned
            flags["baseline b: derivative", "-"] = fast
            flags["baseline c: a or b", "-"] = turned | fast
            own = motion_texture(clip)
            flags["their rule as printed", "local"] = literal_map(
                clip, own, find_neighbours(own, [own])
            ).mask
            for context, n in CONTEXTS.items():
                by_pose = literal_map(clip, own, chai_hodgins_neighbours(clip, others[:n]))
                flags["Chai-Hodgins distance", context] = by_pose.mask
                if n == 0:  # the clip alone is cleaned anyway
                    continue
                for other in others[:n]:
                    if other.name not in textures:
                        textures[other.name] = motion_texture(other)
                chosen = [textures[other.name] for other in others[:n]]
                vocabulary = Vocabulary.of(chosen) if chosen else ()
                flags["self-similarity", context] = detect_faults(clip, vocabulary).mask
        found.append(Detected((by_itself.clip, mask), flags))
    return found


def _masks(trials: list[Trial]) -> list[BoolArray]:
    """Return what is flagged in trials by their clips alone."""
    return [detect_faults(trial.clip).mask for trial in trials]


def _untouched(trials: list[Trial]) -> list[float]:
    """Return the shares of all joints' seconds that are flagged without faults."""
    return [float(detect_faults(trial.original).mask.mean()) for trial in trials]


def _words(trials: list[Trial], masks: list[BoolArray]) -> Counts:
    return score(trials, _flags(trials, masks)).get("words", Counts())


def _flags(trials: list[Trial], masks: Sequence[BoolArray]) -> Flag:
    """Return what flags the trials' clips as it is known to do."""
    known = {id(trial.clip): mask for trial, mask in zip(trials, masks, strict=True)}
    return lambda clip: known[id(clip)]


def _fill_in_repairs(
    ours: Figures, trials: dict[str, list[Trial]], cleaned: dict[str, list[Cleaned]]
) -> None:
    """Fill in the repair errors of table 2."""
    whole, single = [], []
    for motion, several in trials.items():
        for trial, (clip, _) in zip(several, cleaned[motion], strict=True):
            right, repaired = local_rotations(trial.original), local_rotations(clip)
            squares = (np.deg2rad(angles_deg(right.quat_xyzw, repaired.quat_xyzw)) / 2.0) ** 2
            whole.append(squares.sum(axis=1).mean())
            rows = right.joints.tolist()
            single += [squares[f.start : f.end, rows.index(f.joint)].mean() for f in trial.faults]
    for scope, errors in (("global", whole), ("per joint", single)):
        if errors:
            key = ("2", "self-similarity", "-", "artificial errors")
            ours[*key, f"{scope} average"] = float(np.mean(errors))
            ours[*key, f"{scope} maximum"] = float(np.max(errors))


def _fill_in_spans(ours: Figures, motion: str, trials: list[Trial], cleaned: list[Cleaned]) -> None:
    """Fill in recall and precision by span, and what a repair is worth."""
    flags = _flags(trials, [mask for _, mask in cleaned])
    for name, counts in score(trials, flags).items():
        ours["spans", name, "-", motion, "recall"] = counts.recall
        if ":" not in name:
            ours["spans", name, "-", motion, "precision"] = counts.precision
    mended = {id(trial.clip): both for trial, both in zip(trials, cleaned, strict=True)}
    errors = repair_errors(trials, lambda clip: mended[id(clip)])
    for column, values in zip(("degrees", "degrees, straight line"), errors.T, strict=True):
        ours["spans", "repair", "-", motion, column] = float(np.mean(values))


def _harder_trials(clips: list[Clip], seed: int) -> dict[str, list[Trial]]:
    """Return trials by what makes their faults hard to find."""
    single = make_trials(clips, seed=seed, seconds_per_fault=np.inf)
    soft = make_trials(clips, seed=seed, ease_s=SOFT_S)
    cut = [cut_trial(trial, at_end=i % 2 == 0) for i, trial in enumerate(single)]
    return dict(zip(HARDER, (soft, cut), strict=True))


def _fill_in_harder_spans(ours: Figures, name: str, motion: str, counts: dict[str, Counts]) -> None:
    """Fill in recall and precision by span of one sort of trials."""
    for unit, counted in counts.items():
        if unit == "spans" or unit.removeprefix("spans: ") in KINDS:
            ours["spans", unit.replace("spans", name), "-", motion, "recall"] = counted.recall
    ours["spans", name, "-", motion, "precision"] = counts.get("spans", Counts()).precision


def _speed(clips: list[Clip]) -> Figures:
    """Return the seconds that the search takes, on clips of one family put after each other."""
    longest = max(clips, key=lambda clip: clip.duration_s)
    texture = motion_texture(longest[: round(20.0 * longest.fps)])
    family = [motion_texture(c) for c in clips if c.skeleton.names == longest.skeleton.names]
    find_neighbours(texture, [texture])  # compiled, if it was not
    database, seconds, i = [], 0.0, 0
    while seconds < 600.0:
        database.append(family[i % len(family)])
        seconds += len(database[-1]) / texture.fps
        i += 1
    ours: Figures = {}
    column = "seconds (6-core i7, MATLAB)"
    start = time.process_time()
    find_neighbours(texture, [texture])
    ours["text", "self-similarity", "20 s clip", "-", column] = time.process_time() - start
    start = time.process_time()
    for source in database:
        find_neighbours(source, database)
    ours["text", "self-similarity", "600 s database", "-", column] = time.process_time() - start
    return ours


def _rows(
    ours: Figures, tables: Sequence[str], n_faults: dict[str, int], n_clips: dict[str, str]
) -> list[Row]:
    columns = itemgetter("table", "method", "context", "motion", "metric")
    paper: dict[tuple[str, ...], float | None] = {
        columns(row): float(row["value"]) for row in printed_figures("aristidou2018_tables.csv")
    }
    for key in ours:  # rows of ours that the paper does not have
        paper.setdefault(key, None)
    rows = []
    for key, value in paper.items():
        table, method, context, motion, metric = key
        if table not in tables:
            continue
        computed = ours.get(key)
        if computed is not None and not np.isfinite(computed):
            computed = None
        note = "" if computed is not None else _why_not(method, n_faults.get(motion))
        if computed is not None and motion in n_faults and not method.startswith(HARDER):
            note = f"{n_faults[motion]} faults in {n_clips[motion]}"
        row = method if context == "-" else f"{method}, {context}"
        column = metric if motion == "-" else f"{motion} {metric}"
        rows.append(table_row(table, row, column, value, computed, note))
    return rows


def _why_not(method: str, n_faults: int | None) -> str:
    """Return why there is no figure."""
    if method in RIVALS_OF_THE_PAPER:
        return "not computed: its program and what that learned are not at hand; see the kit"
    if n_faults == 0:
        return "not computed: no clip of this motion at hand that can hold a fault"
    return "not computed: nothing to count"
