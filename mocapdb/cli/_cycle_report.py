"""The pictures of ``mocapdb cycle --report``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.base.files import replacing
from mocapdb.cycles.extract import Extraction
from mocapdb.cycles.phase.pose_cloud import aligned_positions
from mocapdb.cycles.synthesis.loop import loop_steps
from mocapdb.motion.clip import Clip

__all__ = ["write_report"]


def write_report(folder: Path, found: Extraction, lap: Clip) -> list[str]:
    """Draw what an extraction saw and made, and return the files.

    Parameters
    ----------
    folder : Path
        Made if need be.
    found : Extraction
    lap : Clip
        One lap of its loop.
    """
    from matplotlib.figure import Figure

    from mocapdb import plots

    folder.mkdir(parents=True, exist_ok=True)
    written = []

    def figure(name: str, width: float, height: float) -> Figure:
        made = Figure(figsize=(width, height), layout="constrained")
        written.append((folder / f"{name}.png", made))
        return made

    if found.topology is not None:
        axes = figure("persistence", 4, 3.6).subplots()
        plots.barcode(found.topology.bars, ax=figure("barcode", 5, 3).subplots())
        plots.persistence_diagram(found.topology.bars, chosen=found.topology.rank, ax=axes)
    path, cycle = _plane(found.clip, lap)
    plots.phase_path(path, found.timing.phase, cycle=cycle, ax=figure("phase", 5, 3.6).subplots())
    values = np.rad2deg(found.rotation_values.encode(found.clip))
    lap_deg = np.rad2deg(found.curve.predict(np.arange(200) / 200))
    widest = np.argsort(-np.ptp(lap_deg, axis=0), kind="stable")[:3]
    names = found.rotation_values.names()
    for axes, column in zip(figure("fit", 6, 7).subplots(3, 1), widest, strict=False):
        plots.harmonic_fit(
            found.timing.phase,
            values[:, column],
            lap_deg[:, column],
            name=names[column],
            ax=axes,
        )
    plots.seam(loop_steps(lap), ax=figure("seam", 5, 2.6).subplots())
    for file, made in written:
        with replacing(file) as (temporary,):
            made.savefig(temporary, dpi=120, format="png")
    return [str(file) for file, _ in written]


def _plane(clip: Clip, lap: Clip) -> tuple[FloatArray, FloatArray]:
    """Return clip and lap on the two principal axes of the clip's poses, in metres."""
    cloud = aligned_positions(clip).reshape(len(clip), -1)
    loop = aligned_positions(lap).reshape(len(lap), -1)
    centre = cloud.mean(axis=0)
    _, axes = np.linalg.eigh((cloud - centre).T @ (cloud - centre))
    plane = axes[:, [-1, -2]]
    return (cloud - centre) @ plane, (loop - centre) @ plane
