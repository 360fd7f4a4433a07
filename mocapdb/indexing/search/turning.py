"""By how much a stretch turns: what frames that are compared one by one do not see.

A walk that turns by a right angle in three seconds is, in each of its frames, hardly different from
one that goes straight on. So what a whole stretch turns by counts once more, beyond what hips sway
by anyway.
"""

from __future__ import annotations

import numpy as np

from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.search.frame_store import TURN_STEPS, MotionIndex
from mocapdb.indexing.tuning import FPS, MOST_TURN_COST, SWAY_RAD, TURN_KNOWN

__all__ = ["net_turn", "stretch_turn", "turn_cost"]


def net_turn(motion: CanonicalMotion) -> float:
    """Return by how many radians a motion turns in all, to the left positive."""
    return float(motion.yaw[-1] - motion.yaw[0])


def stretch_turn(index: MotionIndex, clip: int, start: int, end: int) -> float | None:
    """Return by how many radians frames ``start:end`` of a clip turn in all.

    An index that an earlier version has written does not have the turns; they are read from its
    frames then, to some degrees. None where turning does not count, as with most parts of the body.
    """
    space = index.space
    if space.weights.turn_ms <= 0:
        return None
    first = int(index.frames.starts[clip])
    if index.turns is not None:
        steps = index.turns[first + start + 1 : first + end]
        return float(steps.sum(dtype=np.int64)) / TURN_STEPS
    of_turn = space.axes[-1]  # the last feature: see `features`
    if np.linalg.norm(of_turn) < TURN_KNOWN:
        return None
    values = index.frames.values(slice(first + start, first + end))
    rates = (values @ of_turn + space.mean[-1]) / space.weights.turn_ms
    return float((rates[:-1] + rates[1:]).sum() / 2 / FPS)


def turn_cost(first: float | None, second: float | None, per_radian: float) -> float:
    """Return what is added to a distance where two stretches turn by so much; 0 if unknown.

    Examples
    --------
    >>> turn_cost(0.1, 0.0, 0.3), turn_cost(1.2, 0.0, 0.3), turn_cost(None, 1.0, 0.3)
    (0.0, 0.3, 0.0)
    """
    if first is None or second is None:
        return 0.0
    more = max(abs(first - second) - SWAY_RAD, 0.0)
    return min(per_radian * more, MOST_TURN_COST)
