"""The pictures of ``mocapdb cycle --report``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.base.files import make_folder, replacing
from mocapdb.cycles.extract import Extraction, Settings, find_clip_loops
from mocapdb.cycles.phase.pose_cloud import aligned_positions
from mocapdb.cycles.synthesis.loop import jerk_by_frame, loop_steps, root_relative_positions
from mocapdb.errors import NoPeriodError
from mocapdb.motion.clip import Clip

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["write_clip_report", "write_report"]


def write_report(
    folder: Path, found: Extraction, lap: Clip, start: float, turn: FloatArray | None
) -> list[str]:
    """Draw what an extraction saw and made, and return the files.

    Parameters
    ----------
    folder : Path
        Made if need be.
    found : Extraction
    lap : Clip
        One lap of its loop.
    start : float
        Phase of the cycle that the lap begins at.
    turn : (3, 3), optional
        How the next lap is turned against it.
    """
    from mocapdb import plots

    pictures = _Pictures(folder)
    if found.topology is not None:
        axes = pictures.figure("persistence", 4, 3.6).subplots()
        plots.barcode(found.topology.bars, ax=pictures.figure("barcode", 5, 3).subplots())
        plots.persistence_diagram(found.topology.bars, chosen=found.topology.rank, ax=axes)
    path, cycle = _plane(found.clip, lap)
    axes = pictures.figure("phase", 5, 3.6).subplots()
    plots.phase_path(path, found.timing.phase - start, cycle=cycle, ax=axes)
    values = np.rad2deg(found.rotation_values.encode(found.clip))
    lap_deg = np.rad2deg(found.curve.predict(start + np.arange(200) / 200))
    widest = np.argsort(-np.ptp(lap_deg, axis=0), kind="stable")[:3]
    names = found.rotation_values.names()
    for axes, column in zip(pictures.figure("fit", 6, 7).subplots(3, 1), widest, strict=False):
        plots.harmonic_fit(
            found.timing.phase - start,
            values[:, column],
            lap_deg[:, column],
            name=names[column],
            ax=axes,
        )
    in_clip, of_clip = jerk_by_frame(
        root_relative_positions(found.clip), found.clip.fps, closed=False
    )
    rate = len(lap) / found.cycle.period_s
    in_lap, of_lap = jerk_by_frame(root_relative_positions(lap), rate, closed=True, turn=turn)
    phase = np.interp(in_clip, np.arange(len(found.clip)), found.timing.phase) - start
    unit_m = lap.skeleton.metres_per_unit
    axes = pictures.figure("jerk", 5, 3).subplots()
    plots.jerk(phase, of_clip * unit_m, in_lap / len(lap), of_lap * unit_m, ax=axes)
    plots.seam(loop_steps(lap), ax=pictures.figure("seam", 5, 2.6).subplots())
    return pictures.write()


def write_clip_report(folder: Path, clip: Clip, settings: Settings) -> list[str]:
    """Draw the loops of a whole clip and where each is gone round, and return the files.

    There are none where there is no loop, or cohomology is not asked.
    """
    from mocapdb import plots

    if not settings.topology:
        return []
    try:
        loops, first = find_clip_loops(clip, settings)
    except NoPeriodError:
        return []
    pictures = _Pictures(folder)
    height = max(3.0, 1.0 + 0.35 * loops.n_loops)
    bars, over_time = pictures.figure("excitation", 11, height).subplots(
        1, 2, width_ratios=(1, 3.4)
    )
    plots.barcode(loops.bars, n_loops=loops.n_loops, ax=bars)
    plots.excitation(loops, clip.fps, start_s=first / clip.fps, ax=over_time)
    return pictures.write()


class _Pictures:
    """Figures, and the files that they are written to."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.figures: list[tuple[Path, Figure]] = []

    def figure(self, name: str, width: float, height: float) -> Figure:
        """Return a new figure of that size in inches."""
        from matplotlib.figure import Figure

        made = Figure(figsize=(width, height), layout="constrained")
        self.figures.append((self.folder / f"{name}.png", made))
        return made

    def write(self) -> list[str]:
        """Write all, and return the files."""
        make_folder(self.folder)
        for file, made in self.figures:
            with replacing(file) as (temporary,):
                made.savefig(temporary, dpi=120, format="png")
        return [str(file) for file, _ in self.figures]


def _plane(clip: Clip, lap: Clip) -> tuple[FloatArray, FloatArray]:
    """Return clip and lap on the two principal axes of the clip's poses, in metres."""
    cloud = aligned_positions(clip).reshape(len(clip), -1)
    loop = aligned_positions(lap).reshape(len(lap), -1)
    centre = cloud.mean(axis=0)
    _, axes = np.linalg.eigh((cloud - centre).T @ (cloud - centre))
    plane = axes[:, [-1, -2]]
    return (cloud - centre) @ plane, (loop - centre) @ plane
