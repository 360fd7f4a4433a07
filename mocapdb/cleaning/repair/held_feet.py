"""Feet that slide or sink, held where they were by bending the legs; bodies that sink, lifted."""

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
        Of the joint that turns the foot, or that carries a body which sinks: then only its own
        translation is changed, upwards, until the lowest ball is on that line.

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
    if leg is None and span.start >= 1 and span.end < len(channels):
        return _lift_body(clip, channels, span, [leg.ball for leg in legs])
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


def _lift_body(clip: Clip, channels: FloatArray, span: Span, balls: list[int]) -> float | None:
    """Lift the joint that carries the body until the foot that goes lowest is where it stood."""
    skeleton, up = clip.skeleton, clip.skeleton.up_index
    start = int(skeleton.channel_starts[span.joint])
    moving = {dof[1]: start + i for i, dof in enumerate(skeleton.dofs[span.joint]) if dof[0] == "t"}
    if len(moving) < 3 or not balls:
        return None
    pose = forward_kinematics(skeleton, channels[span.start - 1 : span.end + 1])
    heights = pose.positions[:, balls, up]
    lowest = int(heights[1:-1].min(axis=0).argmin())
    line = np.linspace(heights[0, lowest], heights[-1, lowest], len(heights))
    lift = np.maximum(line - heights[:, lowest], 0.0)[1:-1]
    if not lift.any():
        return None
    parent = int(skeleton.parents[span.joint])
    # the translation is in the frame of what is above
    axis = np.eye(3)[up] if parent < 0 else pose.rotations[1:-1, parent, up]
    moved = lift[:, None] * axis
    for i, name in enumerate("xyz"):
        channels[span.frames, moving[name]] += moved[:, i]
    there = forward_kinematics(skeleton, channels[span.frames]).positions[:, balls[lowest], up]
    left = float(np.maximum(line[1:-1] - there, 0.0).mean())
    return left * skeleton.metres_per_unit * 1000.0
