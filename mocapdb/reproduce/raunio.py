"""Tables A.1 to A.3 and B.1 to B.3 of Raunio's thesis (2014), computed beside his figures.

He names his clips. Those at hand only as BVH, another skeleton with another set of angles, are
computed too and marked; so are those whose period the thesis got wrong.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.cycles.curve.harmonics import MODELS, HarmonicRegression, finite_differences
from mocapdb.cycles.period.autocorrelation import guess_period
from mocapdb.cycles.phase.cohomology import CircularCoordinates
from mocapdb.cycles.phase.laps import fit_laps, forwards, uniformised, unwrapped
from mocapdb.cycles.phase.pose_cloud import aligned_positions, delay_embedding, principal_axes
from mocapdb.cycles.template_error import TemplateMatch, match_template
from mocapdb.errors import CorpusError, CycleError
from mocapdb.io import find_motion_files, read_with_settings
from mocapdb.io.find_files import TEXT_SUFFIXES
from mocapdb.motion.clip import Clip

__all__ = [
    "CONVENTIONS",
    "FAILED",
    "PAPER",
    "TABLES",
    "ThesisCycle",
    "printed_rows",
    "reproduce",
    "thesis_cycle",
]

PAPER = "Raunio 2014"
TABLES = {
    ("A", "boxing"): "A.1",
    ("A", "walking"): "A.2",
    ("A", "running"): "A.3",
    ("B", "boxing"): "B.1",
    ("B", "walking"): "B.2",
    ("B", "running"): "B.3",
}
CONVENTIONS = (
    "poses: all rotation channels as read, in radians, the root's with them, translation without",
    "m later frames are appended to each; epsilon is the distance of such rows",
    "the first frame and the last m + 1 are left out",
    "the longest bar is taken, bars alive at epsilon end there, edges are shorter than its end",
    "period count: frames times the slope of the unwrapped, uniformised coordinate, 1.00 at least",
    "template: the frames slide over a cycle of so many frames, rounded, repeated",
    "derivatives are missing for four frames at each end; those frames count for poses alone",
)
FAILED = 0.15  # off the autocorrelation's period count
COLUMNS = ("template", "index", "rmse")

Row = dict[str, Any]


@dataclass(frozen=True)
class ThesisCycle:
    """What the thesis reports of a clip.

    Attributes
    ----------
    period_count : float
    matches : dict of str to TemplateMatch
        Of each model.
    rmse : dict of (str, int) to float
        Of each model and derivative: 0 for poses, 1 and 2 for weighted velocities and
        accelerations (eqs. 4.1 to 4.3); M2's by the weights of M1.
    """

    period_count: float
    matches: dict[str, TemplateMatch]
    rmse: dict[tuple[str, int], float]


def reproduce(
    corpus: StrPath,
    *,
    clips: list[str] | None = None,
    progress: Progress = silent,
) -> list[Row]:
    """Compute the thesis's tables on the clips of a folder.

    Parameters
    ----------
    corpus : path-like
        A folder with CMU's files, at any depth, under CMU's names.
    clips : list of str, optional
        Only these of the thesis's clips.
    progress : callable, optional
        Called with clips done, clips in all, and the clip at work.

    Returns
    -------
    list of dict
        ``table``, ``row`` (the clip), ``column``, ``paper`` (None of M2's derivatives, which the
        thesis does not print), ``ours`` (None where the note says why) and ``note``; errors in
        radians.

    Raises
    ------
    CorpusError
        If there is no such folder or clip, or it has none of the thesis's clips.
    """
    figures = list(_figures())
    if clips is not None:
        unknown = set(clips) - {figure["clip"] for figure in figures}
        if unknown:
            raise CorpusError(f"Expected clips of the thesis, but got {min(unknown)!r}.")
        figures = [figure for figure in figures if figure["clip"] in clips]
    paths = _paths(Path(corpus), {figure["clip"] for figure in figures})
    rows: list[Row] = []
    for done, figure in enumerate(figures):
        progress(done, len(figures), figure["clip"])
        path = paths.get(figure["clip"])
        if path is None:
            rows += _rows(figure, None, f"clip {figure['clip']} not at hand")
            continue
        clip = read_with_settings(path, drop_tpose=True)
        if figure["first_frame"]:
            clip = clip[int(figure["first_frame"]) : int(figure["last_frame"])]
        try:
            ours = thesis_cycle(
                clip,
                max_epsilon=float(figure["max_epsilon"]),
                delay_factor=int(figure["delay_factor"]),
                n_harmonics=int(figure["n_harmonics"]),
            )
        except CycleError as problem:
            rows += _rows(figure, None, f"failed: {problem}")
            continue
        rows += _rows(figure, ours, _note(figure, clip, path, ours))
    progress(len(figures), len(figures), "done")
    return rows


def printed_rows(note: str) -> list[Row]:
    """Return the thesis's figures without ours."""
    return [row for figure in _figures() for row in _rows(figure, None, note)]


def thesis_cycle(
    clip: Clip, *, max_epsilon: float, delay_factor: int = 2, n_harmonics: int = 20
) -> ThesisCycle:
    """Return what the thesis's own method makes of a clip, by `CONVENTIONS`.

    Raises
    ------
    CycleError
        If no loop is found up to `max_epsilon`.
    """
    angles = np.deg2rad(clip.channels[:, clip.skeleton.rotation_channels])
    cloud = delay_embedding(angles[1:-1], delay_factor)
    used = slice(1, 1 + len(cloud))
    found = CircularCoordinates(max_epsilon=max_epsilon).fit_transform(cloud)
    phase = forwards(uniformised(found))
    slope, _ = fit_laps(unwrapped(phase))
    count = max(1.0, len(cloud) * slope)
    period = len(cloud) / count
    velocities, accelerations = finite_differences(angles, 1.0 / period)
    targets = (angles[used], velocities[used], accelerations[used])
    matches: dict[str, TemplateMatch] = {}
    rmse: dict[tuple[str, int], float] = {}
    for model in MODELS:
        curve = HarmonicRegression(n_harmonics, model=model).fit(phase, *targets)
        lap = curve.predict(np.arange(round(period)) / period)
        matches[model] = match_template(targets[0], lap)
        if model != "m2":  # it has none: its derivatives are weighed as M1's, to be compared
            weights = np.vstack([np.ones(angles.shape[1]), curve.weights_])
        for derivative, target in enumerate(targets):
            known = np.isfinite(target).all(axis=1)
            missing = curve.predict(phase[known], derivative) - target[known]
            rmse[model, derivative] = float(
                np.sqrt((weights[derivative] * missing**2).sum(axis=1).mean())
            )
    return ThesisCycle(count, matches, rmse)


def _figures() -> Iterator[dict[str, str]]:
    """Yield the thesis's own figures, one clip each."""
    table = files("mocapdb.reproduce").joinpath("data", "raunio2014_tables_A_B.csv")
    with table.open(encoding="utf-8") as lines:
        yield from csv.DictReader(lines)


def _paths(corpus: Path, names: set[str]) -> dict[str, Path]:
    """Return the file of each clip at hand, an AMC where there is one."""
    if not corpus.is_dir():
        raise CorpusError(f"{corpus}: expected a folder with CMU's clips, but got none.")
    found: dict[str, Path] = {}
    for suffix in TEXT_SUFFIXES:
        for path in find_motion_files(corpus, [suffix]):
            if path.stem in names:
                found.setdefault(path.stem, path)
    if not found:
        raise CorpusError(
            f"{corpus}: expected clips under CMU's names, such as 07_01.amc, but found none of "
            "the thesis's. Get them with: mocapdb fetch 02_03 07_01"
        )
    return found


def _rows(figure: Mapping[str, str], ours: ThesisCycle | None, note: str) -> list[Row]:
    """Return the rows of a clip: table A, then B."""

    def row(part: str, column: str, paper: str | None, own: float | None) -> Row:
        return {
            "table": TABLES[part, figure["class"]],
            "row": figure["clip"],
            "column": column,
            "paper": float(paper) if paper else None,
            "ours": None if own is None else round(own, 4),
            "note": note,
        }

    rows = []
    for model in MODELS:
        match = None if ours is None else ours.matches[model]
        name = model.upper()
        error = None if match is None else match.error
        index = None if match is None else float(match.offset)
        rows.append(row("A", f"{name} template", figure[f"{name}_template"], error))
        rows.append(row("A", f"{name} index", figure[f"{name}_index"], index))
    count = None if ours is None else ours.period_count
    rows.append(row("A", "period count", figure["period_count"], count))
    for model in MODELS:
        for derivative, name in enumerate(("pos", "vel", "acc")):
            key = f"{model.upper()}_rmse_{name}"
            own = None if ours is None else ours.rmse[model, derivative]
            rows.append(row("B", f"{model.upper()} {name}", figure.get(key), own))
    return rows


def _note(figure: Mapping[str, str], clip: Clip, path: Path, ours: ThesisCycle) -> str:
    """Return how far the thesis and we agree with the autocorrelation, and what was read."""
    notes = ["AMC" if path.suffix.lower() == ".amc" else "BVH only"]
    try:
        cloud = principal_axes(aligned_positions(clip).reshape(len(clip), -1), 8)
        true = len(clip) / guess_period(cloud).frames
    except CycleError:
        notes.append("no period by autocorrelation")
    else:
        notes.append(f"autocorrelation {true:.2f}")
        if abs(float(figure["period_count"]) / true - 1.0) > FAILED:
            notes.append("the thesis failed here")
        if abs(ours.period_count / true - 1.0) > FAILED:
            notes.append("we fail here")
    return "; ".join(notes)
