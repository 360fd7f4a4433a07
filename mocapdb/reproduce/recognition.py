"""Tables 4.5 to 4.8 of O'Kane's thesis (2008): the recognition of classes, beside his figures.

He trains a density on the poses of each of three classes and counts the poses of other clips that
are over a threshold, chosen so that the nine shares add up to 300 %. His clips are not named.
`CONVENTIONS` says what stands in for them. Beside each figure stands that of the floored density,
and below, how many HDM05 clips of an actor who was left out both densities recognise.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.compression.okane.body_and_root import split_root
from mocapdb.indexing.recognition.ppca import PPCA
from mocapdb.io import find_motion_files, read_with_settings
from mocapdb.motion.clip import Clip
from mocapdb.motion.representations import RepresentationName, represent
from mocapdb.reproduce._tables import (
    Row,
    check_tables,
    corpus_folder,
    printed_figures,
    reported,
    table_row,
)

__all__ = ["CONVENTIONS", "TABLES", "reproduce"]

TABLES = ("4.5", "4.6", "4.7", "4.8")
FIGURES = "okane2008_tables.csv"
CONVENTIONS = (
    "recognition: the printed tables are read with rows as test sets and columns as classes, the "
    "other way round than labelled: all eight figures of the row 'run class' are whole numbers of "
    "560ths, to both decimals, so a row is of one set of frames; no column is",
    "recognition: CMU's walks, runs and boxing of the MotionBuilder conversion, which has runs by "
    "several people; no one is in both training and test, but for boxing: one clip, halved",
    "recognition: his density (eq. 3.13) with 99 % of the variance and rho of each class's own; "
    "floored: rho at least the square of 0.1 m, or of 10 degrees",
    "recognition: a threshold for each class, at which its three cells add up to 100 %, for log "
    "densities of classes with noise of their own do not compare; in the note one for each table, "
    "at which its nine cells add up to 300 %, as his text says",
    "HDM05: a clip goes to the class of largest mean log density, learned from the other actors",
)

REPRESENTATIONS: Mapping[str, RepresentationName] = {
    "4.5": "aligned",
    "4.6": "channels",
    "4.7": "scaled",
    "4.8": "normalised",
}
TRAINING = {
    "walk class": ("07_01", "07_02", "07_03", "08_01", "08_02", "35_02", "35_03", "35_04"),
    "run class": ("35_17", "35_18", "35_20", "35_21", "35_22"),
    "boxing class": ("02_05",),
}
TESTS = {
    "test walks": ("02_01", "02_02", "05_01", "12_01", "16_15", "16_16", "26_01", "32_01"),
    "test run": ("02_03", "49_04", "49_05"),
    "test boxing": ("02_05",),
}
HALVED = "02_05"
VARIANCE = 0.99
FLOOR_M, FLOOR_DEG = 0.1, 10.0
STRIDE = 4


def reproduce(
    corpus: StrPath, *, tables: Sequence[str] = TABLES, progress: Progress = silent
) -> list[Row]:
    """Compute tables of the thesis on the clips of a folder.

    Parameters
    ----------
    corpus : path-like
        A folder with CMU's BVH files and HDM05's AMC files, at any depth, under their names.
    tables : sequence of str
        Out of `TABLES`.
    progress : callable, optional
        Called with tables done, tables in all, and the table at work.

    Returns
    -------
    list of dict
        ``table``, ``row``, ``column``, ``paper`` (None where the thesis has no such figure),
        ``ours`` (percent; None where the clips are missing) and ``note``.

    Raises
    ------
    CorpusError
        If there is no such table or folder.
    """
    check_tables(tables, TABLES)
    root = corpus_folder(corpus, "motion files")
    found = find_motion_files(root, [".bvh"])
    paths = {path.stem: path for path in found if "daz" not in path.parent.name}
    actors = [path for path in find_motion_files(root, [".amc"]) if path.match("HDM_*_*")]
    rows: list[Row] = []
    for table in reported(tables, progress, str):
        rows += _nine_cells(table, paths)
        rows += _across_actors(table, actors)
    return rows


def _nine_cells(table: str, paths: Mapping[str, Path]) -> list[Row]:
    wanted = {name for names in (*TRAINING.values(), *TESTS.values()) for name in names}
    missing = sorted(wanted - set(paths))
    by_class: dict[str, dict[tuple[str, str], float]] = {}
    by_table: dict[tuple[str, str], float] = {}
    if not missing:
        own = {label: _bodies(table, paths, names, True) for label, names in TRAINING.items()}
        tests = {label: _bodies(table, paths, names, False) for label, names in TESTS.items()}
        floor = _floor(table, read_with_settings(paths[TRAINING["walk class"][0]]))
        for kind, least in (("own", 0.0), ("floored", floor)):
            scores = {}
            for label, poses in own.items():
                model = PPCA(VARIANCE, least).fit(np.vstack(poses))
                for test, bodies in tests.items():
                    scores[label, test] = model.score_samples(np.vstack(bodies))
            if kind == "own":
                by_table = _shares(scores, _threshold(scores.values(), 3.0))
            by_class[kind] = {}
            for label in own:
                cells = {cell: values for cell, values in scores.items() if cell[0] == label}
                by_class[kind] |= _shares(cells, _threshold(cells.values(), 1.0))
    answers = []
    for figure in printed_figures(FIGURES):
        if figure["table"] != table:
            continue
        cell = _transposed(figure["row"], figure["column"])
        if missing:
            note = f"cannot be computed: {', '.join(missing)} are not at hand as BVH"
        else:
            note = (
                f"{cell[1]} under the {cell[0]}; one threshold for all: {by_table[cell]:.2f} %; "
                f"floored: {by_class['floored'][cell]:.2f} %"
            )
        ours = None if missing else round(by_class["own"][cell], 2)
        paper = float(figure["value"])
        answers.append(table_row(table, figure["row"], figure["column"], paper, ours, note))
    return answers


def _transposed(row: str, column: str) -> tuple[str, str]:
    """Return the class and the test set that a printed cell belongs to (see `CONVENTIONS`)."""
    own, tests = list(TRAINING), list(TESTS)
    return own[tests.index(column)], tests[own.index(row)]


def _across_actors(table: str, paths: Sequence[Path]) -> list[Row]:
    """Return the share of HDM05 clips that are recognised by the other actors' classes."""
    clips = [_read_body(path, table) for path in paths]
    labels = np.array([path.stem.split("_")[2] for path in paths])
    actors = np.array([path.stem.split("_")[1] for path in paths])
    answers = []
    for kind in ("own", "floored"):
        ours, note = None, "cannot be computed: needs HDM05 clips of two actors"
        if len(set(actors)) > 1:
            floor = 0.0 if kind == "own" else _floor(table, _read(paths[0]))
            right = []
            for actor in sorted(set(actors)):
                known = sorted(set(labels[actors != actor]))
                models = [
                    PPCA(VARIANCE, floor).fit(
                        np.vstack(
                            [clips[i] for i in np.flatnonzero((labels == k) & (actors != actor))]
                        )
                    )
                    for k in known
                ]
                for i in np.flatnonzero(actors == actor):
                    best = int(np.argmax([model.score(clips[i]) for model in models]))
                    right.append(known[best] == labels[i])
            ours = round(100 * float(np.mean(right)), 2)
            note = f"{len(paths)} clips, {len(set(labels))} classes, {len(set(actors))} actors"
        column = f"clips right, {kind} rho"
        answers.append(table_row(table, "HDM05, one actor left out", column, None, ours, note))
    return answers


def _shares(
    scores: Mapping[tuple[str, str], FloatArray], threshold: float
) -> dict[tuple[str, str], float]:
    """Return the percentage of each cell's poses that are over a threshold."""
    return {cell: 100 * float((own > threshold).mean()) for cell, own in scores.items()}


def _threshold(scores: Iterable[FloatArray], total: float) -> float:
    """Return the log density over which the shares of the cells add up to a total."""
    cells = list(scores)
    values = np.sort(np.concatenate(cells))
    low, high = 0, len(values) - 1
    while low < high:  # the sum falls as the threshold rises
        middle = (low + high) // 2
        if sum((cell > values[middle]).mean() for cell in cells) > total:
            low = middle + 1
        else:
            high = middle
    return float(values[low])


def _floor(table: str, clip: Clip) -> float:
    """Return the floor in the unit of a representation."""
    if table == "4.6":
        return FLOOR_DEG
    units = FLOOR_M / clip.skeleton.metres_per_unit
    return units / clip.skeleton.height if table == "4.7" else units


def _bodies(
    table: str, paths: Mapping[str, Path], names: Sequence[str], training: bool
) -> list[FloatArray]:
    """Return the poses of clips, every 4th frame; of the one for both uses, one half."""
    found = []
    for name in names:
        body = _read_body(paths[name], table)
        if name == HALVED:
            middle = len(body) // 2
            body = body[:middle] if training else body[middle:]
        found.append(body)
    return found


@lru_cache(maxsize=512)
def _read(path: Path) -> Clip:
    return read_with_settings(path, drop_tpose=path.suffix == ".bvh")


@lru_cache(maxsize=2048)
def _read_body(path: Path, table: str) -> FloatArray:
    """Return the poses (F, D) of a file without the root's motion."""
    clip = _read(path)
    representation = represent(clip, REPRESENTATIONS[table])
    return split_root(clip.skeleton, representation).body[::STRIDE]
