"""Table 1 of Vejdemo-Johansson et al. (2015), computed beside their figures.

They list, for each clip, the distance at which the chosen class is born, the number of simplices,
and their times. A birth is compared by its own settings: channels in degrees and file units, the
root's position and orientation replaced by first differences, Euclidean distance, a projection on
principal axes where the table gives one.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from mocapdb.base.arrays import Float32Array, FloatArray, StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.cycles.phase.centroid_curve import typical_trajectory
from mocapdb.cycles.phase.cohomology import CircularCoordinates
from mocapdb.cycles.phase.laps import fit_laps, forwards, unwrapped
from mocapdb.cycles.phase.pose_cloud import principal_axes
from mocapdb.cycles.tuning import LARGEST_CLOUD
from mocapdb.errors import CorpusError, CycleError
from mocapdb.io import find_motion_files, read_with_settings
from mocapdb.motion.clip import Clip

__all__ = ["CONVENTIONS", "PAPER", "paper_cloud", "reproduce"]

PAPER = "Vejdemo-Johansson et al. 2015"
TABLE = "1"
CONVENTIONS = (
    "cloud: the channels in degrees and file units, the root's six as first differences",
    "projected on principal axes where the table says so",
    "clips of over 1,000 frames are taken every so many frames, which the note says",
    "times are this machine's, one run; the paper's are of a laptop of 2013",
    "after the cohomology: coordinates, mixture, 500 centroids of ten neighbours, resampling",
)

Row = dict[str, Any]


def reproduce(corpus: StrPath, *, progress: Progress = silent) -> list[Row]:
    """Compute the paper's table on the clips of a folder.

    Parameters
    ----------
    corpus : path-like
        A folder with CMU's AMC files, at any depth, under CMU's names.
    progress : callable, optional
        Called with clips done, clips in all, and the clip at work.

    Returns
    -------
    list of dict
        ``table``, ``row`` (motion and clip), ``column``, ``paper``, ``ours`` (None where the clip
        is not at hand) and ``note``.

    Raises
    ------
    CorpusError
        If there is no such folder.
    """
    folder = Path(corpus)
    if not folder.is_dir():
        raise CorpusError(f"{corpus}: expected a folder with CMU's clips, but got none.")
    paths = {path.stem: path for path in find_motion_files(folder, [".amc"])}
    table = files("mocapdb.reproduce").joinpath("data", "vejdemo2015_table_1.csv")
    with table.open(encoding="utf-8") as lines:
        figures = list(csv.DictReader(lines))
    rows: list[Row] = []
    for done, figure in enumerate(figures):
        progress(done, len(figures), figure["clip"])
        path = paths.get(figure["clip"])
        if path is None:
            rows += _rows(figure, {}, f"clip {figure['clip']} not at hand")
            continue
        clip = read_with_settings(path)
        first, last = int(figure["first_frame"]), int(figure["last_frame"])
        if last > len(clip):
            rows += _rows(figure, {}, f"has {len(clip)} frames, and the paper took {last}")
            continue
        try:
            ours, note = _computed(clip[first:last], figure)
        except CycleError as problem:
            ours, note = {}, f"failed: {problem}"
        rows += _rows(figure, ours, note)
    progress(len(figures), len(figures), "done")
    return rows


def paper_cloud(clip: Clip, n_components: int | None = None) -> FloatArray:
    """Return the paper's cloud (F, D) of a clip: section 4.1."""
    channels = clip.channels
    n_root = int(clip.skeleton.channel_starts[1])
    steps = np.diff(channels[:, :n_root], axis=0, append=channels[-1:, :n_root])
    turns = [i for i, dof in enumerate(clip.skeleton.dofs[0]) if dof[0] == "r"]
    steps[:, turns] -= 360.0 * np.round(steps[:, turns] / 360.0)
    cloud = np.hstack([steps, channels[:, n_root:]])
    return cloud if n_components is None else principal_axes(cloud, n_components)


def _computed(clip: Clip, figure: Mapping[str, str]) -> tuple[dict[str, float], str]:
    stride = -(-len(clip) // LARGEST_CLOUD)
    n_components = int(figure["pca_dim"]) if figure["pca_dim"] else None
    epsilon = float(figure["max_epsilon"])
    start = time.perf_counter()
    cloud = paper_cloud(clip, n_components)
    found = CircularCoordinates(max_epsilon=epsilon, stride=stride).fit(cloud)
    cohomology_s = time.perf_counter() - start
    ours = {
        "birth": float(found.persistence_[0, 0]),
        "simplices": float(_n_simplices(cloud[::stride], epsilon)),
        "cohomology_s": cohomology_s,
    }
    note = f"every {stride} frames" if stride > 1 else ""
    if figure["post_s"]:
        start = time.perf_counter()
        coordinates = forwards(found.coordinates_)
        slope, _ = fit_laps(unwrapped(coordinates))
        n_frames = max(2, round(1.0 / max(slope, 1.0 / len(clip))))
        typical_trajectory(coordinates, clip.channels, n_frames)
        ours["post_s"] = time.perf_counter() - start
        ours["overall_fps"] = len(clip) / (ours["post_s"] + cohomology_s)
        note = f"{note}{'; ' if note else ''}{len(clip) * slope:.2f} laps"
    return ours, note


def _n_simplices(cloud: FloatArray, epsilon: float) -> int:
    """Return the number of points, edges and triangles up to a distance."""
    from scipy.spatial.distance import pdist, squareform

    joined: Float32Array = (squareform(pdist(cloud)) <= epsilon).astype(np.float32)
    np.fill_diagonal(joined, 0.0)
    edges = int(joined.sum()) // 2
    triangles = round(float(((joined @ joined) * joined).sum(dtype=np.float64)) / 6)
    return len(joined) + edges + triangles


def _rows(figure: Mapping[str, str], ours: Mapping[str, float], note: str) -> list[Row]:
    return [
        {
            "table": TABLE,
            "row": f"{figure['motion']} {figure['clip']}",
            "column": column,
            "paper": float(figure[column]),
            "ours": round(ours[column], 3) if column in ours else None,
            "note": note,
        }
        for column in ("birth", "simplices", "cohomology_s", "post_s", "overall_fps")
        if figure[column]
    ]
