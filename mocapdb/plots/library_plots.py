"""Pictures of a library: what is in it, what it costs, what is flagged in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import ClipError
from mocapdb.plots._axes import COLOURS, axes_or_new, label_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "class_durations",
    "clip_costs",
    "flagged_joints",
    "rate_distortion",
    "variance_by_dimension",
]


def class_durations(
    seconds: Mapping[str, float],
    clips: Mapping[str, int],
    *,
    most: int = 20,
    ax: Axes | None = None,
) -> Axes:
    """Draw how much motion each class has, the most first.

    Parameters
    ----------
    seconds : mapping of str to float
        By class.
    clips : mapping of str to int
        How many clips each class has, written beside its bar.
    most : int
        Classes to show; the others are summed up as one.
    ax : Axes, optional

    Raises
    ------
    ClipError
        If there is no class.
    """
    if not seconds:
        raise ClipError("Expected a class at least, but got none.")
    names = sorted(seconds, key=lambda name: -seconds[name])
    rows = [(name, seconds[name], clips[name]) for name in names[:most]]
    if rest := names[most:]:
        total = (sum(seconds[name] for name in rest), sum(clips[name] for name in rest))
        rows.append((f"{len(rest)} others", *total))
    unit, scale = ("min", 60.0) if max(row[1] for row in rows) > 180 else ("s", 1.0)
    ax = axes_or_new(ax, 5, 0.8 + 0.26 * len(rows))
    lengths = [duration / scale for _, duration, _ in rows]
    bars = ax.barh(range(len(rows)), lengths, color=COLOURS[2], height=0.7)
    ax.bar_label(bars, [f"{count}" for _, _, count in rows], padding=3, fontsize=8)
    ax.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    ax.invert_yaxis()
    ax.margins(x=0.1)
    label_axes(ax, f"duration ({unit}); beside the bars, clips")
    return ax


def clip_costs(
    rates: Sequence[float],
    errors_mm: Sequence[float],
    *,
    error_label: str = "mean vertex error (mm)",
    ax: Axes | None = None,
) -> Axes:
    """Draw what each clip costs, and how far it is off: a dot for each, the medians as lines.

    Parameters
    ----------
    rates : sequence of float
        Bytes a frame.
    errors_mm : sequence of float
    error_label : str
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 5, 3.2)
    size = 18 if len(rates) < 200 else 6
    ax.scatter(errors_mm, rates, s=size, alpha=0.6, color=COLOURS[2], linewidths=0)
    if len(rates):
        for line, value in ((ax.axhline, np.median(rates)), (ax.axvline, np.median(errors_mm))):
            line(float(value), color="0.6", lw=1, zorder=0)
    ax.set_xlim(0, None)
    ax.set_ylim(0, None)
    label_axes(ax, error_label, "bytes a frame")
    return ax


def flagged_joints(
    counts: Mapping[str, Mapping[str, int]], *, most: int = 15, ax: Axes | None = None
) -> Axes:
    """Draw how often each joint is flagged, by what the fault looks like.

    Parameters
    ----------
    counts : mapping of str to mapping of str to int
        By joint, then by kind.
    most : int
        Joints to show, the most often flagged ones.
    ax : Axes, optional

    Raises
    ------
    ClipError
        If nothing is flagged.
    """
    totals = {joint: sum(kinds.values()) for joint, kinds in counts.items()}
    joints = sorted((joint for joint in totals if totals[joint]), key=lambda joint: -totals[joint])
    if not joints:
        raise ClipError("Expected a flagged joint at least, but got none.")
    from matplotlib.ticker import MaxNLocator

    joints = joints[:most]
    ax = axes_or_new(ax, 5, 1.1 + 0.26 * len(joints))
    kinds = sorted({kind for joint in joints for kind in counts[joint]})
    left = np.zeros(len(joints))
    for kind, colour in zip(kinds, COLOURS[1:], strict=False):
        widths = np.array([counts[joint].get(kind, 0) for joint in joints])
        ax.barh(range(len(joints)), widths, left=left, color=colour, height=0.7, label=kind)
        left += widths
    ax.set_yticks(range(len(joints)), joints)
    ax.invert_yaxis()
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    label_axes(ax, "flagged spans")
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=len(kinds), frameon=False, fontsize=8)
    return ax


def rate_distortion(
    curves: Mapping[str, Sequence[tuple[float, float]]],
    *,
    error_label: str = "mean vertex error (mm)",
    ax: Axes | None = None,
) -> Axes:
    """Draw how many bytes a frame an error costs: lower and further left is better.

    Parameters
    ----------
    curves : mapping of str to sequence of (bytes a frame, error)
        One curve for each codec or setting.
    error_label : str
        What the error is, with its unit.
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 5, 3.2)
    from matplotlib.ticker import LogLocator, NullFormatter

    for (name, points), colour, marker in zip(curves.items(), COLOURS, "os^Dvpx", strict=False):
        rates, errors = zip(*sorted(points), strict=True)
        ax.plot(errors, rates, marker=marker, ms=4, lw=1.5, color=colour, label=name)
    for set_scale, axis in ((ax.set_xscale, ax.xaxis), (ax.set_yscale, ax.yaxis)):
        set_scale("log")
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    label_axes(ax, error_label, "bytes a frame")
    ax.grid(True, which="major", alpha=0.3)
    ax.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax


def variance_by_dimension(
    shares: Mapping[str, FloatArray], *, most: int = 40, ax: Axes | None = None
) -> Axes:
    """Draw how much of the variance the first principal components hold.

    Parameters
    ----------
    shares : mapping of str to (D,) array
        Cumulative proportions of variance by what they are of, such as ``"walk, aligned"``: what
        comes before the comma has a line style, what comes after it a colour.
    most : int
        Dimensions to show.
    ax : Axes, optional

    Raises
    ------
    ClipError
        If there is nothing to draw.
    """
    if not shares:
        raise ClipError("Expected proportions of variance, but got none.")
    ax = axes_or_new(ax, 6.4, 4)
    kinds = list(dict.fromkeys(name.partition(",")[0] for name in shares))
    formats = list(dict.fromkeys(name.partition(",")[2] for name in shares))
    for name, held in shares.items():
        kind, _, format_ = name.partition(",")
        shown = held[:most]
        ax.plot(
            range(1, len(shown) + 1),
            100 * shown,
            linestyle=("-", "--", ":", "-.")[kinds.index(kind) % 4],
            color=COLOURS[formats.index(format_) % len(COLOURS)],
            label=name,
        )
    ax.axhline(99, color="0.8", linewidth=0.8, zorder=0)
    ax.set_ylim(40, 100.5)
    ax.legend(fontsize=7, ncols=2)
    label_axes(ax, "dimensions", "variance held (%)")
    return ax
