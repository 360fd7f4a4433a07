"""Pictures of queries and of classes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.plots._axes import COLOURS, axes_or_new, label_axes
from mocapdb.plots.strip_plots import skeleton_strip

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mocapdb.indexing import Agreement

__all__ = ["confusion_matrix", "log_density", "precision_recall", "query_hits", "search_growth"]


POSE_SPACING_M = 1.2  # from one pose to the next: eight fill the width
STRIP_MARGIN_M = 0.6  # beside the first pose and the last


def confusion_matrix(
    truth: Sequence[str], answers: Sequence[str], *, ax: Axes | None = None
) -> Axes:
    """Draw which classes are taken for which, in percent of each row.

    Parameters
    ----------
    truth, answers : sequence of str
        What each clip is, and what it was taken for.
    ax : Axes, optional

    Raises
    ------
    ClipError
        If there is nothing to draw, or the two differ in length.
    """
    if not truth or len(truth) != len(answers):
        raise ClipError(
            f"Expected as many answers as clips, one at least, but got {len(answers)} and "
            f"{len(truth)}."
        )
    rows = sorted(set(truth))
    columns = rows + sorted(set(answers) - set(rows))
    counts = np.zeros((len(rows), len(columns)))
    for was, taken_for in zip(truth, answers, strict=True):
        counts[rows.index(was), columns.index(taken_for)] += 1
    percent = 100 * counts / counts.sum(axis=1, keepdims=True)
    ax = axes_or_new(ax, 1.8 + 0.45 * len(columns), 1.4 + 0.4 * len(rows))
    ax.imshow(percent, cmap="Blues", vmin=0, vmax=100, aspect="auto")
    for i, j in np.argwhere(counts > 0):
        colour = "white" if percent[i, j] > 50 else "black"
        ax.text(j, i, f"{percent[i, j]:.0f}", ha="center", va="center", color=colour, fontsize=8)
    ax.set_xticks(range(len(columns)), columns, rotation=45, ha="right")
    ax.set_yticks(
        range(len(rows)), [f"{row} ({n:.0f})" for row, n in zip(rows, counts.sum(1), strict=True)]
    )
    ax.set_xlabel("taken for (%)")
    ax.set_ylabel("class (clips)")
    return ax


def log_density(densities: Mapping[str, FloatArray], fps: float, *, ax: Axes | None = None) -> Axes:
    """Draw the log density of each frame under some classes; the highest explains it best.

    Parameters
    ----------
    densities : mapping of str to (F,)
        By class, in nats; `ClassIndex.log_densities` has the columns.
    fps : float
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 7, 3)
    for (label, values), colour in zip(densities.items(), COLOURS * 9, strict=False):
        ax.plot(np.arange(len(values)) / fps, values, lw=1.2, color=colour, label=label)
    label_axes(ax, "time (s)", "log density (nats)")
    ax.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1, 1))
    return ax


def precision_recall(
    curves: Mapping[str, tuple[FloatArray, FloatArray]], *, ax: Axes | None = None
) -> Axes:
    """Draw precision over recall: further up and right is better.

    Parameters
    ----------
    curves : mapping of str to ((N,), (N,))
        Recall and precision, each in [0, 1], by name; in the order of falling scores.
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 4.2, 3.4)
    for (name, (recall, precision)), colour in zip(curves.items(), COLOURS * 9, strict=False):
        order = np.argsort(recall, kind="stable")
        ax.plot(recall[order], precision[order], lw=1.6, color=colour, label=name)
    ax.set_xlim(0, 1.01)
    ax.set_ylim(0, 1.01)
    label_axes(ax, "recall", "precision")
    ax.grid(True, alpha=0.3)
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, frameon=False, fontsize=8)
    return ax


def query_hits(
    query: Clip,
    hits: Sequence[Clip],
    titles: Sequence[str],
    *,
    agreements: Sequence[Agreement] = (),
    times_s: Sequence[FloatArray] = (),
    query_title: str = "query",
    n_poses: int = 8,
    ax: Axes | None = None,
) -> Axes:
    """Draw a query and the stretches that were found, pose under pose at the same share of time.

    With `agreements`, below each hit stands which parts of the body are like the query's, and when:
    white is the same, dark is as far apart as any two frames are. Each pose stands over its moment.

    ``mocapdb query --plot`` gives the frames that the query was matched with, so that poses stand
    below those that they are like.

    Parameters
    ----------
    query : Clip
    hits : sequence of Clip
        The stretches, the nearest first.
    titles : sequence of str
        What to write over each hit.
    agreements : sequence of Agreement
        Of each hit with the query.
    times_s : sequence of (F,), seconds
        When each frame is, of the query and then of each hit; each from 0 by default.
    query_title : str
        What to write over the query.
    n_poses : int
    ax : Axes, optional
        Its place is divided among the strips.
    """
    row_in = 2.6 if agreements else 1.9
    ax = axes_or_new(ax, 9, row_in * (1 + len(hits)))
    ax.set_axis_off()
    height = 1 / (1 + len(hits))
    clips = [query, *hits]
    share = 0.48 if agreements else 0.66
    strips = []
    for row, (clip, title) in enumerate(zip(clips, [query_title, *titles], strict=True)):
        room = ax.inset_axes((0.0, 1 - (row + 0.12 + share) * height, 1.0, share * height))
        skeleton_strip(
            clip, n_poses=min(n_poses, len(clip)), times_s=times_s[row] if times_s else None,
            spacing_m=POSE_SPACING_M, ax=room,
        )  # fmt: skip
        room.set_title(title, fontsize=9, loc="left")
        room.tick_params(labelsize=7)
        if row:
            room.set_xlabel("")
        strips.append(room)
    # one scale for all, and no strip narrower than another
    bottom = min(room.get_ylim()[0] for room in strips)
    top = max(room.get_ylim()[1] for room in strips)
    last = max(room.get_xticks()[-1] for room in strips)
    for room in strips:
        room.set_aspect("auto")
        room.set_xlim(-STRIP_MARGIN_M, last + STRIP_MARGIN_M)
        room.set_ylim(bottom, top)
    for row, (agreement, room) in enumerate(zip(agreements, strips[1:], strict=False), start=1):
        ends = room.get_xticks()[[0, -1]]
        first, end = (ends + STRIP_MARGIN_M) / (last + 2 * STRIP_MARGIN_M)
        below = ax.inset_axes(
            (first, 1 - (row + 0.93) * height, max(end - first, 0.01), 0.22 * height)
        )
        _draw_agreement(agreement, below)
    return ax


def _draw_agreement(agreement: Agreement, ax: Axes) -> None:
    """Draw how far each part of the body is from the query's, moment by moment."""
    parts = agreement.part_moments()
    ax.imshow(
        np.stack(list(parts.values())), aspect="auto", cmap="Blues", vmin=0, vmax=1,
        interpolation="nearest",
    )  # fmt: skip
    ax.set_xticks([])
    ax.set_yticks(np.arange(len(parts)), list(parts), fontsize=6)
    ax.tick_params(length=0)


def search_growth(
    frames: Sequence[int], times_ms: Mapping[str, FloatArray], *, ax: Axes | None = None
) -> Axes:
    """Draw how the time of a query grows with a library, and the power law that fits it.

    Parameters
    ----------
    frames : sequence of int
        Sizes of the library.
    times_ms : mapping of str to (n,)
        Milliseconds at each size, by way of searching.
    ax : Axes, optional
    """
    ax = axes_or_new(ax, 5, 3.5)
    for (way, times), colour in zip(times_ms.items(), COLOURS, strict=False):
        power, factor = np.polyfit(np.log(frames), np.log(times), 1)
        ax.loglog(frames, times, "o", color=colour, label=f"{way}: frames to the {power:.2f}")
        ax.loglog(frames, np.exp(factor) * np.asarray(frames, float) ** power, color=colour, lw=1)
    ax.set_xticks(list(frames), [f"{n / 1000:,.0f}" for n in frames])
    ax.set_xticks([], minor=True)
    for formatter in (ax.yaxis.set_major_formatter, ax.yaxis.set_minor_formatter):
        formatter("{x:g}")
    label_axes(ax, "thousand frames of 24 fps in the library", "time of a query (ms)")
    ax.legend(frameon=False, fontsize=8)
    return ax
