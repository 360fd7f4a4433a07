"""A target is held by what is decoded: measured there, and where it is not, coded more finely.

What a codec's own search holds may break on the decoded clip: a joint's swing ends in two blocks
that were searched apart, or a codec knows of no single joint.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from mocapdb.base.arrays import FrameSource
from mocapdb.compression.payload import Payload
from mocapdb.compression.targets import Target
from mocapdb.compression.tuning import TIGHTENED_BY, TIGHTENINGS
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_errors import JointMotion, joint_errors
from mocapdb.motion.skin import channels_error
from mocapdb.motion.tuning import CHUNK_FRAMES

__all__ = ["Coded", "first_that_holds"]


class Coded(NamedTuple):
    """What a codec made of a clip: the payload's bytes, and what they decode to."""

    data: bytes
    decoded: FrameSource
    description: str
    counted_bytes: int


def first_that_holds(
    clip: Clip,
    target: Target,
    code: Callable[[Target], Coded | None],
    motion: JointMotion | None = None,
) -> Payload | None:
    """Return the first payload that holds a target when it is decoded.

    Parameters
    ----------
    clip : Clip
    target : Target
    code : callable
        Codes the clip to a target: this one, then tighter ones, each time by what was missing. None
        where it can not.
    motion : JointMotion, optional
        The joints' own motion, where it is known.

    Returns
    -------
    Payload, or None where `code` gives none or even the tightest did not hold.
    """
    aim = target
    for _ in range(TIGHTENINGS):
        coded = code(aim)
        if coded is None:
            return None
        decoded = coded.decoded
        if len(clip) <= CHUNK_FRAMES:  # decoded once for all that is measured
            decoded = decoded[:]
        error = measured = channels_error(clip.skeleton, clip.channels, decoded)
        if target.points != "skin":
            measured = channels_error(clip.skeleton, clip.channels, decoded, points=target.points)
        joints = joint_errors(clip.skeleton, clip.channels, decoded, motion)
        motion = joints.motion
        if target.holds(measured, joints):
            return Payload(coded.data, error, joints, coded.description, coded.counted_bytes)
        # what was held anyway need not be asked for
        reached = min(target.measure(measured) / aim.value, 1.0) or 1.0
        least, most = TIGHTENED_BY
        broken = max(target.broken(measured, joints), 1.0)
        aim = aim.tighter(reached * min(max(1.0 / broken, least), most))
    return None
