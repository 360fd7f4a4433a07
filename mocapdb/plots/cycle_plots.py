"""Pictures of a cycle: its loop, its phase, its fit, its seam."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.plots._axes import COLOURS, axes_or_new, label_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mocapdb.cycles.phase.excitation import LoopsOfClip

__all__ = [
    "barcode",
    "excitation",
    "harmonic_fit",
    "jerk",
    "persistence_diagram",
    "phase_path",
    "seam",
]

CYCLIC_COLOURS = "twilight"


RANKS_LABELLED = 6
LABELS_APART = 0.04  # of the axes' length


def persistence_diagram(bars: FloatArray, *, chosen: int = 0, ax: Axes | None = None) -> Axes:
    """Draw births and deaths of loops, the chosen one ringed: far from the diagonal is clear.

    The most persistent ones have their ranks beside them.

    Parameters
    ----------
    bars : (B, 2)
        Birth and death of each.
    chosen : int
        Row of the one that was taken.
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 4, 3.6)
    most = 1.05 * float(bars.max())
    ax.plot([0, most], [0, most], color="0.7", lw=1)
    ax.scatter(bars[:, 0], bars[:, 1], s=16, color=COLOURS[2], zorder=2)
    birth, death = bars[chosen]
    ax.scatter(
        birth, death, s=130, facecolors="none", edgecolors=COLOURS[1], linewidths=1.8, zorder=3
    )
    labelled: list[int] = []
    for rank in (chosen, *range(min(len(bars), RANKS_LABELLED))):
        apart = np.abs(bars[labelled] - bars[rank]).max(axis=1, initial=0.0)
        if labelled and apart.min() < LABELS_APART * most:
            continue  # its label would lie on another one
        labelled.append(rank)
        ax.annotate(str(rank), bars[rank], xytext=(8, 4), textcoords="offset points", fontsize=8)
    ax.set_xlim(0, most)
    ax.set_ylim(0, most)
    ax.set_aspect("equal")
    label_axes(ax, "born at distance", "dies at distance")
    return ax


def barcode(bars: FloatArray, *, n_loops: int = 1, ax: Axes | None = None) -> Axes:
    """Draw loops as bars from birth to death, the most persistent at the top.

    Parameters
    ----------
    bars : (B, 2)
        Birth and death of each, the most persistent first.
    n_loops : int
        How many are taken for loops; the others are drawn as noise. At most 40 bars are drawn.
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 5, 3)
    for row, (birth, death) in enumerate(bars[:40]):
        colour = COLOURS[1] if row < n_loops else "0.7"
        ax.plot([birth, death], [-row, -row], color=colour, lw=2.2, solid_capstyle="butt")
    ax.set_xlim(0, 1.05 * float(bars.max()))
    ax.set_yticks([])
    label_axes(ax, "distance")
    return ax


def excitation(
    found: LoopsOfClip, fps: float, *, start_s: float = 0.0, ax: Axes | None = None
) -> Axes:
    """Draw the circular coordinates of a clip over time, and where each goes round.

    Parameters
    ----------
    found : LoopsOfClip
    fps : float, frames per second
    start_s : float, seconds
        Of its first frame.
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 9, 3.4)
    seconds = start_s + np.arange(found.coordinates.shape[1]) / fps
    for rank, laps in enumerate(found.coordinates):
        ax.plot(seconds, -rank + 0.8 * (laps % 1.0), ".", color="0.6", ms=1)
    for region in found.regions:
        ends = [start_s + region.start / fps, start_s + region.end / fps]
        colour = COLOURS[1] if region.repeats else COLOURS[2]
        ax.plot(ends, [-region.rank - 0.08] * 2, color=colour, lw=3, solid_capstyle="butt")
        ax.text(ends[0], -region.rank - 0.06, f"{region.laps:.1f}", fontsize=7, va="bottom")
    ax.set_yticks(-np.arange(len(found.coordinates)), np.arange(len(found.coordinates)))
    label_axes(ax, "seconds", "coordinate of each loop (bar: laps round it)")
    return ax


def phase_path(
    path: FloatArray, phase: FloatArray, *, cycle: FloatArray | None = None, ax: Axes | None = None
) -> Axes:
    """Draw a motion in two dimensions, coloured by phase, and the cycle through it.

    Parameters
    ----------
    path : (F, 2)
        Two principal axes of the poses.
    phase : (F,)
        In laps; the colours go round with it.
    cycle : (N, 2), optional
        The closed curve, on the same axes.
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 4.6, 3.6)
    points = ax.scatter(
        path[:, 0], path[:, 1], c=phase % 1.0, cmap=CYCLIC_COLOURS, vmin=0, vmax=1, s=16,
        edgecolors="0.45", linewidths=0.3,
    )  # fmt: skip
    if cycle is not None:
        closed = np.vstack([cycle, cycle[:1]])
        ax.plot(closed[:, 0], closed[:, 1], color=COLOURS[1], lw=1.6)
    ax.figure.colorbar(points, ax=ax, label="phase (laps)")
    ax.set_aspect("equal", adjustable="datalim")
    label_axes(ax, "first principal axis (m)", "second")
    return ax


def harmonic_fit(
    phase: FloatArray,
    values_deg: FloatArray,
    curve_deg: FloatArray,
    *,
    name: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Draw the laps of one channel over each other, and the harmonics fitted to them.

    Parameters
    ----------
    phase : (F,)
        In laps, unwrapped.
    values_deg : (F,) degrees
    curve_deg : (N,) degrees
        At even phases of one lap.
    name : str
        Of the channel.
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 5, 3)
    lap = np.floor(phase).astype(int)
    for number in np.unique(lap):
        own = lap == number
        ax.plot(phase[own] % 1.0, values_deg[own], color="0.6", lw=1)
    ax.plot([], [], color="0.6", lw=1, label="laps")
    closed = np.append(curve_deg, curve_deg[0])
    ax.plot(np.linspace(0, 1, len(closed)), closed, color=COLOURS[1], lw=2, label="cycle")
    ax.set_xlim(0, 1)
    label_axes(ax, "phase (laps)", f"{name} (degrees)" if name else "degrees")
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, frameon=False)
    return ax


def jerk(
    phase: FloatArray,
    clip_m_s3: FloatArray,
    loop_phase: FloatArray,
    loop_m_s3: FloatArray,
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw how much a clip jerks, lap over lap, and how much its loop does.

    Parameters
    ----------
    phase : (N,)
        In laps, unwrapped, of the clip; zero where the loop begins.
    clip_m_s3 : (N,) metres a second cubed
        Over all joints, as of `mocapdb.cycles.synthesis.loop.jerk_by_frame`.
    loop_phase, loop_m_s3 : (M,)
        The same of one lap of the loop.
    ax : Axes, optional

    Notes
    -----
    Figure 6 of Vejdemo-Johansson et al. (2015), which has single coordinates.
    """
    ax = axes_or_new(ax, 5, 3)
    lap = np.floor(phase).astype(int)
    for number in np.unique(lap):
        own = lap == number
        ax.plot(phase[own] % 1.0, clip_m_s3[own], color="0.6", lw=1)
    ax.plot([], [], color="0.6", lw=1, label="laps of the clip")
    order = np.argsort(loop_phase % 1.0)
    ax.plot(loop_phase[order] % 1.0, loop_m_s3[order], color=COLOURS[1], lw=2, label="loop")
    ax.set_xlim(0, 1)
    ax.set_ylim(0, None)
    label_axes(ax, "phase (laps)", "jerk of joints (m/s³)")
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, frameon=False)
    return ax


def seam(steps: FloatArray, *, ax: Axes | None = None) -> Axes:
    """Draw how far the body moves from frame to frame round the loop, the seam in the middle.

    Parameters
    ----------
    steps : (N,)
        From each frame to the next, the last from the last frame to the first; any unit.
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 5, 2.6)
    relative = np.asarray(steps) / max(float(np.median(steps)), 1e-300)
    half = len(relative) // 2
    from_seam = np.arange(len(relative)) - half
    ax.plot(from_seam, np.roll(relative, half + 1), color=COLOURS[2], lw=1.4)
    ax.plot(0, relative[-1], "o", color=COLOURS[1], label=f"seam, {relative[-1]:.2f} median steps")
    ax.axhline(1, color="0.7", lw=1)
    ax.set_ylim(0, None)
    label_axes(ax, "frames from the seam", "step (medians)")
    ax.legend(frameon=False)
    return ax
