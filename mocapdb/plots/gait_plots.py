"""Pictures of gait: joint angles as gait laboratories draw them, and foot events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.gait.joint_angles import ANGLES
from mocapdb.plots._axes import COLOURS, axes_or_new, label_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mocapdb.gait.gait_analysis import GaitAnalysis

__all__ = ["angle_over_stride", "foot_events", "gait_chart"]

SIDE_COLOURS = {"left": COLOURS[1], "right": COLOURS[2]}
COLUMNS = 3
LEAST_RANGE_DEG = 10.0


def angle_over_stride(
    laps: Mapping[str, FloatArray],
    toe_off_pct: Mapping[str, float],
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw one angle over the stride: mean and a band of one standard deviation, each side.

    Parameters
    ----------
    laps : mapping of side to (N, 101) degrees
        Each stride at 0 to 100 %.
    toe_off_pct : mapping of side to float
        Where stance ends, drawn as an upright line.
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 3.4, 2.4)
    percent = np.arange(101)
    for side, values in laps.items():
        mean, spread = values.mean(axis=0), values.std(axis=0)
        ax.fill_between(
            percent, mean - spread, mean + spread, color=SIDE_COLOURS[side], alpha=0.2, lw=0
        )
        ax.plot(percent, mean, color=SIDE_COLOURS[side], lw=1.6, label=side)
        ax.axvline(toe_off_pct[side], color=SIDE_COLOURS[side], lw=0.8, ls="--")
    ax.axhline(0, color="0.7", lw=0.6, zorder=0)
    low, high = ax.get_ylim()
    missing = max(0.0, LEAST_RANGE_DEG - (high - low)) / 2  # noise is not blown up
    ax.set_ylim(low - missing, high + missing)
    ax.set_xlim(0, 100)
    label_axes(ax, "% of the stride", "degrees")
    return ax


def gait_chart(gaits: Sequence[GaitAnalysis]) -> Axes:
    """Draw every angle over the stride in a figure of its own, strides of all clips together.

    Parameters
    ----------
    gaits : sequence of GaitAnalysis

    Returns
    -------
    Axes
        Of the first angle.
    """
    from matplotlib import pyplot

    rows = -(-len(ANGLES) // COLUMNS)
    figure, grid = pyplot.subplots(
        rows, COLUMNS, figsize=(3.3 * COLUMNS, 1.9 * rows), sharex=True, layout="constrained"
    )
    places = list(np.ravel(grid))
    toe_off = {
        side: float(np.mean(shares))
        for side in SIDE_COLOURS
        if (shares := [s.stance_pct for gait in gaits for s in gait.of_side(side)])
    }
    for place, ((joint, angle), positive) in zip(places, ANGLES.items(), strict=False):
        laps = {
            side: np.concatenate(found)
            for side in toe_off
            if (
                found := [
                    gait.curves[side, joint, angle]
                    for gait in gaits
                    if (side, joint, angle) in gait.curves
                ]
            )
        }
        angle_over_stride(laps, toe_off, ax=place)
        place.set_title(f"{joint} {angle} (+ {positive})", fontsize=7, loc="left")
        place.tick_params(labelsize=7)
        place.set_ylabel("")
        place.set_xlabel("")
    for place in places[len(ANGLES) :]:
        place.set_axis_off()
    n = sum(len(gait.strides) for gait in gaits)
    named = gaits[0].clip.name if len(gaits) == 1 else f"{len(gaits)} clips"
    places[0].legend(fontsize=7, frameon=False)
    figure.suptitle(
        f"{named}: {n} strides, degrees over % of the stride; mean, band of one sd, toe-off dashed",
        fontsize=9,
    )
    first: Axes = places[0]
    return first


def foot_events(gait: GaitAnalysis, side: str = "left", *, ax: Axes | None = None) -> Axes:
    """Draw height and speed of a foot, with its strikes and toe-offs.

    Parameters
    ----------
    gait : GaitAnalysis
    side : {"left", "right"}
    ax : Axes, optional
    """
    from mocapdb.gait.feet import point_speeds

    ax = axes_or_new(ax, 9, 2.6)
    index = ("left", "right").index(side)
    foot, fps = gait.walker.feet[index], gait.walker.fps
    time = np.arange(len(foot.ball)) / fps
    floor = foot.points[..., 1].min()
    speeds = ax.twinx()
    for colour, name, path in zip(
        (COLOURS[2], COLOURS[3], COLOURS[5]), ("heel", "ball", "tip"), foot.points, strict=True
    ):
        ax.plot(time, 100 * (path[:, 1] - floor), color=colour, lw=1.4, label=f"{name}, height")
        speeds.plot(time, point_speeds(path, fps), color=colour, lw=0.8, ls=":")
    for contact in gait.contacts[index]:
        start = contact.frames.start if contact.strike is None else contact.strike
        end = contact.frames.end if contact.toe_off is None else contact.toe_off
        ax.axvspan(start / fps, end / fps, color="0.9", zorder=0)
        for event, style in ((contact.strike, "-"), (contact.toe_off, "--")):
            if event is not None:
                ax.axvline(event / fps, color=COLOURS[1], lw=1, ls=style)
    ax.set_xlim(0, time[-1])
    label_axes(ax, "seconds", "height (cm)")
    speeds.set_ylabel("speed (m/s, dotted)")
    speeds.spines[["top"]].set_visible(False)
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, frameon=False, fontsize=8)
    ax.set_title(f"{gait.clip.name}, {side} foot", fontsize=8, loc="right")
    return ax
