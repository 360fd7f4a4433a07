"""Rate and distortion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from mocapdb.plots._axes import COLOURS, axes_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["rate_distortion"]


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
    ax.set_xlabel(error_label)
    ax.set_ylabel("bytes a frame")
    ax.grid(True, which="major", alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax
