"""Where a fault begins and ends: flagged spans, carried on as far as the fault goes.

A hypothesis is as long as what gave it away. Soft edges show where they are steepest, jitter where
it is strongest; what is left beside the span is wrong and would be the edge of its repair. So a
span grows at an edge

- while the joint jumps beside it as far as within, or as is seen, and not as it usually does;
- where the edge is no jump, while the joint is still on its way to where the fault has it.

A drift that begins with the clip has been cut off: it is wrong from the first frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.map.digression_map import Span
from mocapdb.cleaning.tuning import (
    BACKGROUND_QUANTILE,
    CALM_PAUSE_S,
    CUT_DRIFT_S,
    GROWN_JUMP_RATIO,
    GROWN_JUMP_SHARE,
    GROWN_NOISE_RATIO,
    GROWN_PACE_SHARE,
    JUMP_OVER_MEDIAN,
    LEAST_ANGLE_DEG,
    LEAST_MOVED_DEG,
    LONGEST_NOISE_S,
    MOST_GROWN_S,
    PACE_FRAMES,
)
from mocapdb.motion.quaternions import conjugate, multiply, rotation_vectors_deg

__all__ = ["grow_spans"]

GROWING = ("noise", "offset", "flip", "drift")


def grow_spans(spans: Iterable[Span], native: Texture) -> list[Span]:
    """Return spans, those of jitter and of soft edges carried on to where the fault ends.

    Parameters
    ----------
    spans : iterable of Span
    native : Texture
        Of the clip at its own rate.
    """
    rows = {joint: row for row, joint in enumerate(native.joints.tolist())}
    grown, paces = [], {}
    for span in spans:
        if span.kind in GROWING:
            row = rows[span.joint]
            if row not in paces:
                quats = native.quat_xyzw[:, row]
                turns = multiply(conjugate(quats[:-1]), quats[1:])
                paces[row] = rotation_vectors_deg(turns)
            grown.append(_grown(span, paces[row], native.fps))
        else:
            grown.append(span)
    return grown


def _grown(span: Span, steps: FloatArray, fps: float) -> Span:
    """Return a span that grows at both edges; `steps` (F - 1, 3) lead from frame to frame."""
    n_frames, is_noise = len(steps) + 1, span.kind == "noise"
    most = round(MOST_GROWN_S * fps)
    jumps = np.linalg.norm(np.diff(steps, axis=0), axis=1)  # jump i bends at frame i + 1
    if len(jumps) < 2:
        return span
    # a fault that fills much of a short clip raises the quantile, but hardly the median
    usual = min(np.quantile(jumps, BACKGROUND_QUANTILE), JUMP_OVER_MEDIAN * np.median(jumps))
    inside = jumps[max(0, span.start - 1) : max(span.start, span.end - 2)]
    within = float(np.median(inside) if is_noise else inside.max(initial=0.0))
    ratio = GROWN_NOISE_RATIO if is_noise else GROWN_JUMP_RATIO
    share = GROWN_JUMP_SHARE * within
    if span.kind not in ("offset", "flip"):
        share = min(share, LEAST_MOVED_DEG)
    limit = max(share, ratio * float(usual), LEAST_ANGLE_DEG)
    start, end = span.start, span.end
    pause = max(1, round(CALM_PAUSE_S * fps))
    # frame f is bent by jump f - 1; the edge itself bends the frames on both of its sides
    far = round(LONGEST_NOISE_S * fps) if is_noise else most
    start -= _reach(jumps[max(0, start - 2 - far) : max(0, start - 2)][::-1], limit, pause)
    end += _reach(jumps[end : end + far], limit, pause)
    if start == span.start and not is_noise and not _is_sharp(jumps, start, limit):
        start -= _on_its_way(steps[max(0, start - most) : start + PACE_FRAMES][::-1])
    if end == span.end and not is_noise and not _is_sharp(jumps, end, limit):
        end += _on_its_way(steps[max(0, end - 1 - PACE_FRAMES) : end + most])
    if span.kind == "drift" and start <= CUT_DRIFT_S * fps:
        start = 0
    return replace(span, start=max(start, 0), end=min(end, n_frames))


def _reach(jumps: FloatArray, limit: float, pause: int) -> int:
    """Return how many frames outwards the joint jumps, over pauses of so many frames."""
    far = np.flatnonzero(jumps > limit)
    reached = 0
    for at in far.tolist():
        if at >= reached + pause:
            break
        reached = at + 1
    return reached


def _is_sharp(jumps: FloatArray, edge: int, limit: float) -> bool:
    """Return whether a joint jumps at the edge before a frame, or at an end of the clip."""
    beside = jumps[max(0, edge - 2) : edge]
    return not len(beside) or bool(beside.max() > limit)


def _on_its_way(steps: FloatArray) -> int:
    """Return for how many frames outwards a joint goes as it does at the edge.

    The first `PACE_FRAMES` steps lie within the span.
    """
    edge = steps[:PACE_FRAMES].mean(axis=0)
    pace = float(np.linalg.norm(edge))
    if pace < LEAST_ANGLE_DEG:
        return 0
    along = steps[PACE_FRAMES:] @ (edge / pace)
    slow = np.flatnonzero(along < GROWN_PACE_SHARE * pace)
    return int(slow[0]) if len(slow) else len(along)
