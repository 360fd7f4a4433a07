"""What Vejdemo-Johansson et al. (2015) say of walks and runs, measured on some that are at hand.

Of the clips of their table hardly one is at hand, but what they say of such clips does not hang on
them: the same road is gone with CMU's other walks and runs.
"""

from __future__ import annotations

import time
from itertools import pairwise
from pathlib import Path

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.cycles.extract import extract_cycle
from mocapdb.cycles.period.autocorrelation import guess_period
from mocapdb.cycles.phase.centroid_curve import typical_trajectory
from mocapdb.cycles.phase.cohomology import CircularCoordinates
from mocapdb.cycles.phase.excitation import find_loops
from mocapdb.cycles.phase.laps import fit_laps, forwards, unwrapped
from mocapdb.cycles.phase.pose_cloud import aligned_positions, principal_axes
from mocapdb.cycles.synthesis.blending import blend
from mocapdb.cycles.synthesis.loop import make_loop, seam_steps
from mocapdb.errors import CycleError
from mocapdb.io import find_motion_files, read_with_settings
from mocapdb.motion.clip import Clip
from mocapdb.reproduce._tables import Row, corpus_folder, reported, table_row
from mocapdb.reproduce.vejdemo import paper_cloud

__all__ = ["CONVENTIONS", "EPSILON", "TABLE", "measure"]

TABLE = "walks"
CLIPS = ("02_01", "02_02", "02_03", "07_01", "07_02", "07_04")
PAIRS = (("02_01", "02_03"), ("07_02", "02_03"))
EPSILON = 50.0
OTHERS = (0.7, 1.4)
CONVENTIONS = (
    f"walks: beyond the table, the same road on {', '.join(CLIPS)}, as far as they are at hand as "
    f"AMC, to the distance of {EPSILON:g} that they begin with, and to {OTHERS[0]:g} and "
    f"{OTHERS[1]:g} times that; autocorrelation tells the laps without any of it",
    "jerk: root mean square of third differences, of the typical trajectory repeated, over that of "
    "the clip",
    "two in one: two clips put after each other; a motion is found if a circular coordinate goes "
    "round more than once within it alone",
)


def measure(corpus: StrPath, *, progress: Progress = silent) -> list[Row]:
    """Return rows of the walks and runs at hand, of blends of two, and of two in one clip.

    Raises
    ------
    CorpusError
        If there is no such folder.
    """
    paths = {
        path.stem: path
        for path in find_motion_files(corpus_folder(corpus, "CMU's clips"), [".amc"])
    }
    rows: list[Row] = []
    clips: dict[str, Clip] = {}
    for name in reported(CLIPS, progress, str):
        if name not in paths:
            rows.append(table_row(TABLE, name, "laps", None, None, f"clip {name} not at hand"))
            continue
        clips[name] = _read(paths[name])
        rows += _of_clip(name, clips[name])
    for first, second in PAIRS:
        if first in clips and second in clips:
            rows += _of_two(clips[first], clips[second])
    return rows


def _read(path: Path) -> Clip:
    return read_with_settings(path)


def _of_clip(name: str, clip: Clip) -> list[Row]:
    cloud = paper_cloud(clip)
    flat = principal_axes(aligned_positions(clip).reshape(len(clip), -1), 8)
    ours: dict[str, float] = {}
    start = time.perf_counter()
    coordinates, ours["laps"] = _laps(cloud, EPSILON)
    cohomology_s = time.perf_counter() - start
    ours["laps by autocorrelation"] = len(clip) / guess_period(flat).frames
    for share in OTHERS:
        ours[f"laps at {share:g} times the distance"] = _laps(cloud, share * EPSILON)[1]
    ours["laps on 3 axes"] = _laps(paper_cloud(clip, 3), EPSILON)[1]
    start = time.perf_counter()
    n_frames = max(2, round(len(clip) / max(ours["laps"], 1.0)))
    lap = typical_trajectory(coordinates, clip.channels, n_frames)
    post_s = time.perf_counter() - start
    ours["frames a second"] = len(clip) / (cohomology_s + post_s)
    ours["time after cohomology over its own"] = post_s / cohomology_s
    inner = slice(int(clip.skeleton.channel_starts[1]), None)
    repeated = np.vstack([lap, lap, lap])[:, inner]
    ours["jerk over the clip's"] = _jerk(repeated) / _jerk(clip.channels[:, inner])
    return [
        table_row(TABLE, name, column, None, round(value, 3), f"{len(clip)} frames")
        for column, value in ours.items()
    ]


def _laps(cloud: FloatArray, epsilon: float) -> tuple[FloatArray, float]:
    """Return circular coordinates, and how many laps they go; NaN where there is no loop."""
    try:
        found = CircularCoordinates(max_epsilon=epsilon).fit(cloud)
    except CycleError:
        return np.zeros(len(cloud)), float("nan")
    coordinates = forwards(found.coordinates_)
    slope, _ = fit_laps(unwrapped(coordinates))
    return coordinates, len(cloud) * slope


def _jerk(values: FloatArray) -> float:
    return float(np.sqrt((np.diff(values, 3, axis=0) ** 2).mean()))


def _of_two(first: Clip, second: Clip) -> list[Row]:
    """Return rows of a blend of two clips' cycles, and of the two put after each other."""
    name = f"{first.name} + {second.name}"
    try:
        cycles = [extract_cycle(clip).cycle for clip in (first, second)]
        gap = seam_steps(make_loop(blend(cycles, [0.5, 0.5]), fps=first.fps).clip)
    except CycleError as problem:
        rows = [table_row(TABLE, name, "seam of the blend, steps", None, None, str(problem))]
    else:
        note = "1 is a step like any other"
        rows = [table_row(TABLE, name, "seam of the blend, steps", None, round(gap, 3), note)]
    cloud = np.vstack([aligned_positions(clip).reshape(len(clip), -1) for clip in (first, second)])
    try:
        regions = [region for region in find_loops(cloud, first.fps).regions if region.repeats]
    except CycleError:
        regions = []
    ends = (0, len(first), len(cloud))
    found = sum(
        any(low <= (region.start + region.end) / 2 < high for region in regions)
        for low, high in pairwise(ends)
    )
    note = f"{len(first)} and {len(second)} frames"
    return [*rows, table_row(TABLE, name, "motions found of two in one", None, found, note)]
