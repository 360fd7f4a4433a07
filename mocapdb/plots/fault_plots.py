"""Faults of a capture: where they are, and what a repair did about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.plots._axes import COLOURS, axes_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mocapdb.cleaning import MovementDigressionMap, Span

__all__ = ["before_and_after", "digression_map"]

LETTER_POINTS = 4.2  # of a label


def digression_map(found: MovementDigressionMap, *, ax: Axes | None = None) -> Axes:
    """Draw the movement digression map: joints by name, time in seconds, hot where it is wrong.

    Parameters
    ----------
    found : MovementDigressionMap
        Joints that cannot rotate are left out; flagged spans are framed and named.
    ax : Axes, optional
    """
    skeleton, fps, scores, spans = found.skeleton, found.fps, found.scores, found.spans
    joints = list(skeleton.rotating_joints)
    ax = axes_or_new(ax, 10, 0.8 + 0.2 * len(joints))
    duration = len(scores) / fps
    picture = ax.imshow(
        scores[:, joints].T, aspect="auto", interpolation="nearest", cmap="inferno", vmin=0.0,
        vmax=1.0, extent=(0.0, duration, len(joints) - 0.5, -0.5),
    )  # fmt: skip
    rows = {joint: row for row, joint in enumerate(joints)}
    from matplotlib.patches import Rectangle

    letter = LETTER_POINTS * duration * ax.figure.dpi / (72 * ax.bbox.width)  # in seconds
    for span in spans:
        row, start, end = rows[span.joint], span.start / fps, span.end / fps
        frame = Rectangle(
            (start, row - 0.5), len(span) / fps, 1.0, fill=False, lw=1.2,
            edgecolor=COLOURS[-1], clip_on=False,
        )  # fmt: skip
        ax.add_patch(frame)
        others = [
            (other.start / fps, other.end / fps)
            for other in spans
            if other.joint == span.joint and other.start != span.start
        ]
        text = f"{span.kind} {span.confidence:.0%}"
        side = _free_side(start, end, (len(text) + 1) * letter, duration, others)
        if side:
            ax.annotate(
                text, (end if side > 0 else start, row), xytext=(3 * side, 0),
                textcoords="offset points", va="center", ha="left" if side > 0 else "right",
                fontsize=7, color="white",
            )  # fmt: skip
    ax.set_yticks(range(len(joints)), [skeleton.names[joint] for joint in joints], fontsize=7)
    ax.set_xlabel("time (s)")
    ax.figure.colorbar(picture, ax=ax, label="confidence that it is wrong", pad=0.01)
    return ax


def _free_side(
    start: float, end: float, width: float, duration: float, others: Sequence[tuple[float, float]]
) -> int:
    """Return on which side of a span a label of that width fits: 1 behind, -1 before, 0 neither."""
    for side, low, high in ((1, end, end + 2 * width), (-1, start - 2 * width, start)):
        near_edge = low + width if side > 0 else high - width
        if not 0 <= near_edge <= duration:
            continue
        # twice the room: the neighbour may want its label there too
        if all(other_end <= low or other_start >= high for other_start, other_end in others):
            return side
    return 0


def before_and_after(
    before: Clip,
    after: Clip,
    joint: int,
    *,
    spans: Sequence[Span] = (),
    ax: Axes | None = None,
) -> Axes:
    """Draw the angles of a joint before (thin) and after (thick) a repair, its spans shaded.

    Parameters
    ----------
    before, after : Clip
        Of one skeleton and length.
    joint : int
    spans : sequence of Span
        Those of other joints are left out.
    ax : Axes, optional

    Raises
    ------
    ClipError
        If the clips differ in skeleton or length, or the joint does not rotate.
    """
    skeleton = before.skeleton
    if skeleton != after.skeleton or len(before) != len(after):
        raise ClipError("Expected two clips of one skeleton and length, but they differ.")
    first = int(skeleton.channel_starts[joint])
    dofs = [(first + i, dof) for i, dof in enumerate(skeleton.dofs[joint]) if dof[0] == "r"]
    if not dofs:
        raise ClipError(f"Expected a joint that rotates, but {skeleton.names[joint]!r} does not.")
    ax = axes_or_new(ax, 8, 2.8)
    time = np.arange(len(before)) / before.fps
    for colour, (column, dof) in zip(COLOURS[1:], dofs, strict=False):
        ax.plot(time, before.channels[:, column], color=colour, lw=0.8, ls=":")
        ax.plot(time, after.channels[:, column], color=colour, lw=1.6, label=dof)
    for span in spans:
        if span.joint == joint:
            ax.axvspan(span.start / before.fps, span.end / before.fps, color="0.85", lw=0)
            ax.annotate(
                span.kind, (span.start / before.fps, 1.0), xycoords=("data", "axes fraction"),
                xytext=(2, -9), textcoords="offset points", fontsize=8,
            )  # fmt: skip
    ax.set_title(f"{skeleton.names[joint]}: before (dotted) and after", fontsize=9, loc="left")
    ax.set_xlabel("time (s)")
    ax.set_ylabel("angle (degrees)")
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, loc="upper left", bbox_to_anchor=(1, 1))
    return ax
