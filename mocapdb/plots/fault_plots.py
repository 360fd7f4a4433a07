"""Faults of a capture: where they are, and what a repair did about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange, ranges_where
from mocapdb.plots._axes import COLOURS, axes_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mocapdb.cleaning import MovementDigressionMap, Span

__all__ = ["before_and_after", "digression_map"]

LETTER_POINTS = 4.2  # of a label
MOST_COLUMNS = 700  # of the map's picture, fewer than its pixels; each is the surest of its frames
LEAST_SHARE = 0.004  # of the picture's width that a frame of one frame takes
STILL_DEG = 0.01  # a joint that turns no further never moves
MARGIN_S = 0.5  # that is shown beside a span
MARGIN_LENGTHS = 1.0  # likewise, in lengths of the span


def digression_map(found: MovementDigressionMap, *, ax: Axes | None = None) -> Axes:
    """Draw the movement digression map: joints by name, time in seconds, hot where it is wrong.

    Parameters
    ----------
    found : MovementDigressionMap
        Joints that never move are left out; flagged spans are framed and named, and can be seen
        however short they are.
    ax : Axes, optional
    """
    skeleton, fps, scores, spans = found.skeleton, found.fps, found.scores, found.spans
    joints = _moving(found)
    ax = axes_or_new(ax, 10, 0.8 + 0.2 * len(joints))
    duration = len(scores) / fps
    picture = ax.imshow(
        _pooled(scores[:, joints]).T, aspect="auto", interpolation="nearest", cmap="inferno",
        vmin=0.0, vmax=1.0, extent=(0.0, duration, len(joints) - 0.5, -0.5),
    )  # fmt: skip
    rows = {joint: row for row, joint in enumerate(joints)}
    from matplotlib.patches import Rectangle

    letter = LETTER_POINTS * duration * ax.figure.dpi / (72 * ax.bbox.width)  # in seconds
    for span in spans:
        row, start, end = rows[span.joint], span.start / fps, span.end / fps
        width = max(end - start, LEAST_SHARE * duration)
        left = min(max((start + end - width) / 2, 0.0), duration - width)
        frame = Rectangle(
            (left, row - 0.5), width, 1.0, fill=False, lw=1.2,
            edgecolor=COLOURS[-1], clip_on=False,
        )  # fmt: skip
        ax.add_patch(frame)
        others = [
            (other.start / fps, other.end / fps)
            for other in spans
            if other.joint == span.joint and other.start != span.start
        ]
        text = f"{span.kind} {span.confidence:.0%}"
        side = _free_side(left, left + width, (len(text) + 1) * letter, duration, others)
        if side:
            ax.annotate(
                text, (left + width if side > 0 else left, row), xytext=(3 * side, 0),
                textcoords="offset points", va="center", ha="left" if side > 0 else "right",
                fontsize=7, color="white",
            )  # fmt: skip
    ax.set_yticks(range(len(joints)), [skeleton.names[joint] for joint in joints], fontsize=7)
    ax.set_xlabel("time (s)")
    ax.figure.colorbar(picture, ax=ax, label="confidence that it is wrong", pad=0.01)
    return ax


def _moving(found: MovementDigressionMap) -> list[int]:
    """Return the joints that move, those that are flagged, and all where none is left."""
    from mocapdb.motion.quaternions import angles_deg

    quats, joints = found.texture.quat_xyzw, found.texture.joints
    turned = angles_deg(quats[:1], quats).max(axis=0)
    rotating = list(found.skeleton.rotating_joints)
    moving = {int(joint) for joint in joints[turned > STILL_DEG]}
    flagged = {span.joint for span in found.spans}
    return sorted(moving & set(rotating) | flagged) or rotating


def _pooled(scores: FloatArray) -> FloatArray:
    """Return the surest of the frames that each column of a picture covers."""
    if len(scores) <= MOST_COLUMNS:
        return scores
    starts = np.arange(MOST_COLUMNS) * len(scores) // MOST_COLUMNS
    return np.asarray(np.maximum.reduceat(scores, starts, axis=0))


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
    around: FrameRange | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the angles of a joint before (dotted) and after (thick) a repair, its spans shaded.

    Angles go on where they would wrap at 180 degrees. Where only the translation of the joint has
    changed, that is drawn instead.

    Parameters
    ----------
    before, after : Clip
        Of one skeleton and length.
    joint : int
    spans : sequence of Span
        Those of other joints are left out.
    around : FrameRange, optional
        Show only this, such as a span, and a little on both sides.
    ax : Axes, optional

    Raises
    ------
    ClipError
        If the clips differ in skeleton or length, or the joint does not rotate.
    """
    skeleton = before.skeleton
    if skeleton != after.skeleton or len(before) != len(after):
        raise ClipError("Expected two clips of one skeleton and length, but they differ.")
    kind, dofs = _shown_dofs(before, after, joint)
    fps = before.fps
    shown = slice(0, len(before))
    if around is not None:
        margin = round(max(MARGIN_S * fps, MARGIN_LENGTHS * len(around)))
        shown = slice(max(around.start - margin, 0), min(around.end + margin, len(before)))
    ax = axes_or_new(ax, 8, 2.8)
    time = np.arange(shown.start, shown.stop) / fps
    for colour, (column, dof) in zip(COLOURS[1:], dofs, strict=False):
        old, new = before.channels[shown, column], after.channels[shown, column]
        if kind == "r":
            old, new = _unwrapped(old, new)
        ax.plot(time, old, color=colour, lw=1.0, ls=":")
        ax.plot(time, new, color=colour, lw=1.6, label=dof)
    for span in spans:
        if span.joint == joint and span.start < shown.stop and span.end > shown.start:
            ax.axvspan(span.start / fps, span.end / fps, color="0.85", lw=0)
            ax.annotate(
                span.kind, (max(span.start, shown.start) / fps, 1.0),
                xycoords=("data", "axes fraction"), xytext=(2, -9), textcoords="offset points",
                fontsize=8,
            )  # fmt: skip
    ax.set_xlim(time[0], max(time[-1], time[0] + 1 / fps))
    ax.set_title(f"{skeleton.names[joint]}: before (dotted) and after", fontsize=9, loc="left")
    ax.set_xlabel("time (s)")
    ax.set_ylabel("angle (degrees)" if kind == "r" else "translation (skeleton units)")
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, loc="upper left", bbox_to_anchor=(1, 1))
    return ax


def _shown_dofs(before: Clip, after: Clip, joint: int) -> tuple[str, list[tuple[int, str]]]:
    """Return whether rotation or translation is drawn, and the columns and names of that."""
    skeleton = before.skeleton
    first = int(skeleton.channel_starts[joint])
    dofs = [(first + i, dof) for i, dof in enumerate(skeleton.dofs[joint])]
    by_kind = {kind: [each for each in dofs if each[1][0] == kind] for kind in "rt"}
    changed = {
        kind: any((before.channels[:, at] != after.channels[:, at]).any() for at, _ in own)
        for kind, own in by_kind.items()
    }
    kind = "t" if changed["t"] and not changed["r"] else "r"
    if not by_kind[kind]:
        raise ClipError(f"Expected a joint that rotates, but {skeleton.names[joint]!r} does not.")
    return kind, by_kind[kind]


def _unwrapped(old: FloatArray, new: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return angles without jumps by whole turns; where both are the same they stay the same.

    Those of the repair go on throughout; a fault may have taken the others round, and what is
    whole turns apart outside of it is not.
    """
    second = np.unwrap(new, period=360.0)
    first = second.copy()
    for run in ranges_where(np.abs((new - old + 180.0) % 360.0 - 180.0) > 1e-9):
        before = second[max(0, run.start - 1) : run.start]
        seen = np.unwrap(np.concatenate([before, old[run.frames]]), period=360.0)[len(before) :]
        if not len(before):
            seen -= 360.0 * np.round(np.median(seen - second[run.frames]) / 360.0)
        first[run.frames] = seen
    return first, second
