"""Feet that slide or sink, held where they were: hip, knee and ankle are bent for it."""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.map.digression_map import Span
from mocapdb.cleaning.tuning import SAME_PLACE_M
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_legs
from mocapdb.motion.ik import reach
from mocapdb.motion.kinematics import forward_kinematics

__all__ = ["hold_foot"]


def hold_foot(clip: Clip, channels: FloatArray, span: Span) -> float | None:
    """Hold a foot on the line from where it is before a span to where it is after it.

    Of a foot that slides level, of one that sinks upwards, and level, too, if it is at the same
    place afterwards.

    Parameters
    ----------
    clip : Clip
        As it came; it tells the legs.
    channels : (F, C)
        Changed in place, in the span's frames, in hip, knee and ankle.
    span : Span
        Of the joint that turns the foot.

    Returns
    -------
    float or None
        The mean distance that is left, in millimetres; None where the foot cannot be held, and
        nothing was changed.
    """
    skeleton = clip.skeleton
    few = clip.channels[:: max(1, len(clip) // 48)]
    legs = find_legs(skeleton, forward_kinematics(skeleton, few).positions)
    leg = next((leg for leg in legs if leg.foot == span.joint), None)
    if leg is None or span.start < 1 or span.end >= len(channels):
        return None
    around = channels[span.start - 1 : span.end + 1]
    positions = forward_kinematics(skeleton, around).positions
    path = positions[:, leg.ball]
    line = np.linspace(path[0], path[-1], len(path))
    pull = line - path
    up = skeleton.up_index
    if span.kind == "slide":
        pull[:, up] = 0.0
    else:
        stood = np.linalg.norm(path[-1] - path[0]) * skeleton.metres_per_unit < SAME_PLACE_M
        if not stood:
            pull[:, [axis for axis in range(3) if axis != up]] = 0.0
        pull[:, up] = np.maximum(pull[:, up], 0.0)
    pull = pull[1:-1]
    goals = {joint: positions[1:-1, joint] + pull for joint in {leg.ankle, leg.ball}}
    turning = list(dict.fromkeys((leg.upper, leg.lower, leg.foot)))
    held = reach(skeleton, around[1:-1], goals, turning)
    there = forward_kinematics(skeleton, held).positions[:, leg.ball]
    left = float(np.linalg.norm(there - goals[leg.ball], axis=1).mean())
    if left >= float(np.linalg.norm(pull, axis=1).mean()):
        return None
    channels[span.frames] = held
    return left * skeleton.metres_per_unit * 1000.0
