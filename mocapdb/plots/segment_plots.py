"""Pictures of a take that is cut into motions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mocapdb.motion.body import part_from_scene
from mocapdb.motion.clip import Clip
from mocapdb.plots._axes import COLOURS, axes_or_new, label_axes
from mocapdb.plots.strip_plots import skeleton_strip
from mocapdb.segmentation.motion_segments import Segmentation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["motion_segments", "segmentation_chart"]

POSES_A_ROW = 26
ROW_S = 20.0


def motion_segments(
    found: Segmentation, fps: float, *, span_s: tuple[float, float] | None = None,
    ax: Axes | None = None,
) -> Axes:  # fmt: skip
    """Draw the principal axes of a take over time, a colour and a letter for each motion.

    Parameters
    ----------
    found : Segmentation
    fps : float, frames per second
    span_s : (float, float), seconds, optional
        Which part is drawn; all by default.
    ax : Axes, optional

    Notes
    -----
    A bar above a segment, with the period beside the letter, is where it repeats.
    """
    ax = axes_or_new(ax, 11, 2.2)
    time = np.arange(len(found.path)) / fps
    first, last = (0.0, float(time[-1])) if span_s is None else span_s
    ax.plot(time, found.path[:, :3], lw=1.1, color="0.25", alpha=0.8)
    top = float(found.path.max())
    letters = list(dict.fromkeys(segment.motion for segment in found.segments))
    for segment in found.segments:
        start, end = segment.start / fps, segment.end / fps
        if end <= first or start >= last:
            continue
        colour = COLOURS[1:][letters.index(segment.motion) % (len(COLOURS) - 1)]
        ax.axvspan(start, end, color=colour, alpha=0.25, lw=0)
        ax.axvline(start, color="0.3", lw=0.8)
        told = segment.motion
        if segment.period_frames is not None:
            told += f"  {segment.period_frames / fps:.2f} s"
            inner = segment if segment.repeats is None else segment.repeats
            ax.plot(
                [inner.start / fps, inner.end / fps], [1.25 * top] * 2, color=colour, lw=4,
                solid_capstyle="butt",
            )  # fmt: skip
        ax.text(max(start, first) + 0.06, 1.38 * top, told, fontsize=8, va="bottom", clip_on=False)
    ax.set_xlim(first, last)
    label_axes(ax, "seconds", "axes (m)")
    return ax


def segmentation_chart(clip: Clip, found: Segmentation) -> Figure:
    """Draw a take in rows of 20 s: poses, and under them the motions.

    Parameters
    ----------
    clip : Clip
    found : Segmentation
        Of the clip.
    """
    from matplotlib.figure import Figure

    body, _ = part_from_scene(clip)
    n_rows = max(1, int(np.ceil(len(clip) / clip.fps / ROW_S - 0.05)))
    per_row = -(-len(clip) // n_rows)
    figure = Figure(figsize=(11, 3.1 * n_rows), layout="constrained")
    places = figure.subplots(2 * n_rows, 1, height_ratios=[1.0, 1.6] * n_rows, squeeze=False)[:, 0]
    for row in range(n_rows):
        start, end = row * per_row, min((row + 1) * per_row, len(clip))
        poses, motions = places[2 * row], places[2 * row + 1]
        if end > start:
            skeleton_strip(body[start:end], n_poses=POSES_A_ROW, ax=poses)
        # poses stand over the time that they are of
        poses.set_aspect("auto")
        poses.margins(x=0.01)
        poses.set_axis_off()
        motion_segments(found, clip.fps, span_s=(start / clip.fps, end / clip.fps), ax=motions)
    named = len({segment.motion for segment in found.segments})
    figure.suptitle(
        f"{clip.name}: {len(found.segments)} segments, {named} motions; "
        "bar and seconds: where it repeats, and its period",
        fontsize=9,
    )
    return figure
