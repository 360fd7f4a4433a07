"""The canonical body: 18 joints of one size that every skeleton is brought to.

Corpora name and split joints differently. Indexes and queries therefore work on a body of their
own: of each bone only its *direction* is taken from the clip, the length is a universal one. So
two people, or two conversions of one clip, give the same poses where they do the same.

`JOINTS`, `PARENTS`, `LENGTHS_M`   the body
`find_bones`                       between which joints of a skeleton its bones run
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.errors import SkeletonError
from mocapdb.motion.body import JOINTS, Body, understand
from mocapdb.motion.body.canonical_joints import other_side
from mocapdb.motion.representations import UNIVERSAL_BONES_M as BONES_M
from mocapdb.motion.skeleton import Skeleton

__all__ = ["JOINTS", "LENGTHS_M", "MIRRORED", "PARENTS", "BodyMap", "find_bones"]

_ABOVE = {
    "hips": "",
    "spine": "hips",
    "chest": "spine",
    "head": "chest",
    "shoulder": "chest",
    "elbow": "{side}_shoulder",
    "wrist": "{side}_elbow",
    "hip": "hips",
    "knee": "{side}_hip",
    "ankle": "{side}_knee",
    "toe": "{side}_ankle",
}
_LENGTHS_M = {
    "hips": 0.0,
    "spine": BONES_M["lowerback"] + BONES_M["upperback"] / 2,
    "chest": BONES_M["upperback"] / 2 + BONES_M["thorax"],
    "head": BONES_M["lowerneck"] + BONES_M["upperneck"],
    "shoulder": BONES_M["lclavicle"],
    "elbow": BONES_M["lhumerus"],
    "wrist": BONES_M["lradius"],
    "hip": BONES_M["lhipjoint"],
    "knee": BONES_M["lfemur"],
    "ankle": BONES_M["ltibia"],
    "toe": BONES_M["lfoot"],
}


def _split(joint: str) -> tuple[str, str]:
    """Return (side, joint) of a canonical joint's name; no side for the middle of the body."""
    side, _, limb = joint.rpartition("_")
    return side, limb


def _parent(joint: str) -> int:
    side, limb = _split(joint)
    above = _ABOVE[limb].format(side=side)
    return JOINTS.index(above) if above else -1


PARENTS: IntArray = np.array([_parent(joint) for joint in JOINTS])
LENGTHS_M: FloatArray = np.array([_LENGTHS_M[_split(joint)[1]] for joint in JOINTS])
MIRRORED: IntArray = np.array([JOINTS.index(other_side(joint)) for joint in JOINTS])
"""For each joint the one on the other side."""


@dataclass(frozen=True)
class BodyMap:
    """Between which joints of a skeleton the bones of the canonical body run.

    Attributes
    ----------
    evidence : str
        How they were found: by names or by shape.
    tails, heads : (18,)
        Joints of the skeleton at both ends of the bone that ends in each canonical joint; entry 0
        is not used. The hips have the other hip as their tail: the line between them counts. A
        foot that has no end has its ankle at both ends.
    """

    evidence: str
    tails: IntArray
    heads: IntArray


def find_bones(skeleton: Skeleton, channels: FloatArray | None = None) -> BodyMap:
    """Map a skeleton to the canonical body, as `mocapdb.motion.body.understand` understands it.

    Parameters
    ----------
    skeleton : Skeleton
    channels : (F, C), optional
        A motion of it; without one its rest pose is all there is.

    Raises
    ------
    SkeletonError
        If it is no whole human body, with the reason.
    """
    body = understand(skeleton, () if channels is None else channels)
    if not body.is_human:
        raise SkeletonError(
            f"Cannot map skeleton {skeleton.name!r} to the canonical body: {body.refusal}."
        )
    tails = np.array([0, *(_tail(body, joint) for joint in JOINTS[1:])])
    heads = [
        body.joints.value.get(joint, int(tail)) for joint, tail in zip(JOINTS, tails, strict=True)
    ]
    return BodyMap(body.joints.evidence, tails, np.array(heads))


def _tail(body: Body, joint: str) -> int:
    """Return the joint that the bone to a canonical joint starts in."""
    joints = body.joints.value
    limb = _split(joint)[1]
    if limb == "hip":
        return joints[other_side(joint)]
    if limb == "shoulder":
        return body.collars[joint]
    if limb == "head" and body.neck not in (None, joints["head"]):
        return int(body.neck)
    above = JOINTS[PARENTS[JOINTS.index(joint)]]
    while joints[above] == joints.get(joint) and above != "hips":  # a spine of one bone
        above = JOINTS[PARENTS[JOINTS.index(above)]]
    return joints[above]
