"""What every picture shares: axes to draw on, and colours that colour-blind people tell apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's palette, black first
COLOURS = ("#000000", "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


def axes_or_new(ax: Axes | None, width: float, height: float) -> Axes:
    """Return `ax`, or the axes of a new figure of that size in inches."""
    if ax is not None:
        return ax
    from matplotlib import pyplot

    _, new = pyplot.subplots(figsize=(width, height), layout="constrained")
    return new


def label_axes(ax: Axes, across: str, up: str | None = None) -> None:
    """Say what the axes are, and leave out the frame where there is none."""
    ax.set_xlabel(across)
    if up is not None:
        ax.set_ylabel(up)
    ax.spines[["top", "right"]].set_visible(False)
