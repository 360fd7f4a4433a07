"""Tables 1 and 2 of Aristidou et al. (2018), computed beside their figures.

Their clips, faults and ground truth are not public, so this is their experiment on other data:
faults with a seed in clips of subjects that the detector was not calibrated on. `CONVENTIONS`
states it in full.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import TypeAlias

import numpy as np

from mocapdb.base.arrays import BoolArray, StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.cleaning.evaluation import Counts, Trial, cut_trial, make_trials, repair_errors, score
from mocapdb.cleaning.evidence.fault_shapes import KINDS
from mocapdb.cleaning.local_rotations import Texture, local_rotations, motion_texture
from mocapdb.cleaning.map.detector import detect_faults
from mocapdb.cleaning.map.digression_map import literal_map
from mocapdb.cleaning.neighbours.nearest_words import Neighbours, Vocabulary, find_neighbours
from mocapdb.cleaning.repair.repair import clean_clip
from mocapdb.errors import CorpusError
from mocapdb.io import find_motion_files, read_with_settings
from mocapdb.motion.clip import Clip
from mocapdb.motion.quaternions import angles_deg
from mocapdb.reproduce._tables import Job, Key, Row, printed_figures, run_jobs, table_row
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

Flag: TypeAlias = Callable[[Clip], BoolArray]
Cleaned: TypeAlias = tuple[Clip, BoolArray]


def reproduce(
    corpus: StrPath,
    *,
    tables: Sequence[str] = TABLES,
    clips: int | None = None,
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
        Of each motion so many at most, spread evenly; all by default.
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
    everything = _read_corpus(Path(corpus))
    sets = {
        "locomotion": _spread([c for c in everything if c.name.startswith(LOCOMOTION)], clips),
        "dance": _spread([c for c in everything if c.name.startswith(COMPLEX)], clips),
    }
    if not any(sets.values()):
        raise CorpusError(
            f"Expected clips of CMU's subjects 02, 06, 07, 12, 13, 26, 32, 49 or 131 in {corpus}, "
            "but there is none."
        )
    trials = {motion: make_trials(several, seed=seed) for motion, several in sets.items()}
    todo: dict[Key, Job] = {}
    for motion, several in trials.items():
        for i, trial in enumerate(several):
            todo["cleaned", motion, i] = partial(_cleaned, trial.clip)
    if "1" in tables:
        learning = [c for c in everything if c.name.split("_")[0] in CALIBRATION]
        for motion, several in trials.items():
            for method, context, flag in _detectors(everything, learning):
                todo["words", method, context, motion] = partial(_words, several, flag)
    if "spans" in tables:
        for motion, several in trials.items():
            todo["untouched", motion] = partial(_untouched, several)
        for motion, several_clips in sets.items():
            for name, harder in _harder_trials(several_clips, seed).items():
                todo[name, motion] = partial(_spans, harder)
    if "text" in tables:
        todo["speed",] = partial(_speed, everything)
    done = run_jobs(todo, n_jobs=jobs, progress=progress)
    cleaned = {
        motion: [done["cleaned", motion, i] for i in range(len(several))]
        for motion, several in trials.items()
    }
    ours: Figures = {}
    for key, counts in done.items():
        if key[0] == "words":
            ours["1", *map(str, key[1:]), "recall"] = counts.recall
            ours["1", *map(str, key[1:]), "precision"] = counts.precision
    for motion, several in trials.items():
        counts = score(several, _flags(several, cleaned[motion])).get("words", Counts())
        ours["1", "self-similarity", "local", motion, "recall"] = counts.recall
        ours["1", "self-similarity", "local", motion, "precision"] = counts.precision
        if "spans" in tables:
            _fill_in_spans(ours, motion, several, cleaned[motion])
            ours["spans", "untouched", "-", motion, "share flagged"] = done["untouched", motion]
            for name in HARDER:
                _fill_in_harder_spans(ours, name, motion, done[name, motion])
    _fill_in_repairs(ours, trials, cleaned)
    ours |= done.get(("speed",), {})
    return _rows(ours, tables, {m: sum(len(t.faults) for t in s) for m, s in trials.items()})


def printed_rows() -> list[Row]:
    """Return the paper's figures without ours."""
    return _rows({}, TABLES, {})


def _spread(clips: list[Clip], most: int | None) -> list[Clip]:
    """Return so many clips at most, evenly over the list."""
    if most is None or most >= len(clips):
        return clips
    return [clips[i * len(clips) // most] for i in range(most)]


def _read_corpus(folder: Path) -> list[Clip]:
    """Read every clip that is needed once, AMC rather than BVH, the first 40 s of each."""
    starts = (*LOCOMOTION, *COMPLEX, *(f"{subject}_" for subject in CALIBRATION))
    paths: dict[str, Path] = {}
    for suffix in (".amc", ".bvh"):
        for path in find_motion_files(folder, [suffix]):
            if path.stem.startswith(starts) and "daz" not in path.parent.name:
                paths.setdefault(path.stem, path)
    clips = [read_with_settings(path, drop_tpose=True) for _, path in sorted(paths.items())]
    return [clip[: round(LONGEST_S * clip.fps)] for clip in clips]


def _detectors(clips: list[Clip], learning: list[Clip]) -> list[tuple[str, str, Flag]]:
    """Return (method, context, what flags a clip) for the rows that are computed."""

    def similar(clip: Clip, n: int) -> list[Clip]:
        fitting = [
            other
            for other in clips
            if other.skeleton.names == clip.skeleton.names
            and other.name != clip.name
            and other.name.startswith(LOCOMOTION) == clip.name.startswith(LOCOMOTION)
        ]
        return fitting[:n]

    textures: dict[str, Texture] = {}

    def vocabulary(clip: Clip, n: int) -> Vocabulary | tuple[()]:
        others = similar(clip, n)
        for other in others:
            if other.name not in textures:
                textures[other.name] = motion_texture(other)
        return Vocabulary.of([textures[other.name] for other in others]) if others else ()

    def literally(clip: Clip, neighbours: Neighbours | None = None) -> BoolArray:
        texture = motion_texture(clip)
        if neighbours is None:
            neighbours = find_neighbours(texture, [texture])
        return literal_map(clip, texture, neighbours).mask

    limits: dict[tuple[str, ...], tuple[JointLimits, DerivativeLimits]] = {}

    def baseline(clip: Clip, angles: bool, speeds: bool) -> BoolArray:
        names = clip.skeleton.names
        if names not in limits:
            same = [other for other in learning if other.skeleton.names == names] or [clip]
            limits[names] = (JointLimits.learn(same), DerivativeLimits.learn(same))
        turned, fast = limits[names]
        flagged = np.zeros((len(clip), len(names)), dtype=np.bool_)
        if angles:
            flagged |= turned.flag(clip)
        if speeds:
            flagged |= fast.flag(clip)
        return flagged

    found: list[tuple[str, str, Flag]] = [
        ("baseline a: joint limits", "-", lambda clip: baseline(clip, True, False)),
        ("baseline b: derivative", "-", lambda clip: baseline(clip, False, True)),
        ("baseline c: a or b", "-", lambda clip: baseline(clip, True, True)),
        ("their rule as printed", "local", literally),
    ]
    for context, n in CONTEXTS.items():

        def flag(clip: Clip, n: int = n) -> BoolArray:
            return detect_faults(clip, vocabulary(clip, n)).mask

        def flag_by_pose(clip: Clip, n: int = n) -> BoolArray:
            return literally(clip, chai_hodgins_neighbours(clip, similar(clip, n)))

        if n > 0:  # the clip alone is cleaned anyway
            found.append(("self-similarity", context, flag))
        found.append(("Chai-Hodgins distance", context, flag_by_pose))
    return found


def _cleaned(clip: Clip) -> Cleaned:
    """Return a clip cleaned by itself, and where it was flagged."""
    cleaned = clean_clip(clip)
    return cleaned.clip, cleaned.digression_map.mask


def _words(trials: list[Trial], flag: Flag) -> Counts:
    return score(trials, flag).get("words", Counts())


def _spans(trials: list[Trial]) -> dict[str, Counts]:
    return score(trials, lambda clip: detect_faults(clip).mask)


def _untouched(trials: list[Trial]) -> float:
    """Return the share of all joints' seconds that is flagged without faults."""
    shares = [detect_faults(trial.original).mask.mean() for trial in trials]
    seconds = [trial.original.duration_s for trial in trials]
    return float(np.average(shares, weights=seconds)) if trials else float("nan")


def _flags(trials: list[Trial], cleaned: list[Cleaned]) -> Flag:
    """Return what flags the trials' clips as they were when they were cleaned."""
    masks = {id(t.clip): mask for t, (_, mask) in zip(trials, cleaned, strict=True)}
    return lambda clip: masks[id(clip)]


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
    for name, counts in score(trials, _flags(trials, cleaned)).items():
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


def _rows(ours: Figures, tables: Sequence[str], n_faults: dict[str, int]) -> list[Row]:
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
            note = f"{n_faults[motion]} faults"
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
