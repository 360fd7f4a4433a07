"""The canonical body: 18 joints of one size that every skeleton is brought to.

Corpora name and split joints differently. Indexes and queries therefore work on a body of their
own: of each bone only its *direction* is taken from the clip, the length is a universal one. So
two people, or two conversions of one clip, give the same poses where they do the same.

`JOINTS`, `PARENTS`, `LENGTHS_M`   the body
`find_bones`                       between which joints of a skeleton its bones run
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files
from typing import Any

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.indexing.canonical.limbs_by_shape import guess_bones
from mocapdb.motion.representations import UNIVERSAL_BONES_M as BONES_M
from mocapdb.motion.skeleton import Skeleton

__all__ = ["JOINTS", "LENGTHS_M", "MIRRORED", "PARENTS", "BodyMap", "find_bones"]

SIDES = ("left", "right")
_LIMBS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "toe")
JOINTS: tuple[str, ...] = (
    "hips",
    "spine",
    "chest",
    "head",
    *(f"{side}_{joint}" for side in SIDES for joint in _LIMBS),
)
"""Names of the canonical joints: the middle of the hips first, the left side before the right."""

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
MIRRORED: IntArray = np.array(
    [JOINTS.index(joint.replace(*SIDES) if SIDES[0] in joint else joint.replace(*SIDES[::-1]))
     for joint in JOINTS]
)  # fmt: skip
"""For each joint the one on the other side."""


@dataclass(frozen=True)
class BodyMap:
    """Between which joints of a skeleton the bones of the canonical body run.

    Attributes
    ----------
    table : str
        Name of the table that fitted, or ``"hierarchy"``.
    tails, heads : (18,)
        Joints of the skeleton at both ends of the bone that ends in each canonical joint; entry 0
        is not used. The hips have the other hip as their tail: the line between them counts.
    """

    table: str
    tails: IntArray
    heads: IntArray


@lru_cache(maxsize=256)
def find_bones(skeleton: Skeleton) -> BodyMap:
    """Map a skeleton to the canonical body: by its names if they are known, else by its hierarchy.

    Raises
    ------
    SkeletonError
        If the skeleton has no two legs, two arms and a head to be found.
    """
    for name, table in _tables().items():
        bones = _bones_of(table, skeleton)
        if bones is not None:
            return _body_map(name, bones)
    return _body_map("hierarchy", guess_bones(skeleton))


def _body_map(table: str, bones: dict[str, tuple[int, int]]) -> BodyMap:
    hips = [bones[f"{side}_knee"][0] for side in SIDES]
    bones = bones | {"left_hip": (hips[1], hips[0]), "right_hip": (hips[0], hips[1])}
    pairs = np.array([(0, 0), *(bones[joint] for joint in JOINTS[1:])])
    return BodyMap(table, pairs[:, 0], pairs[:, 1])


@cache
def _tables() -> dict[str, dict[str, Any]]:
    text = files("mocapdb.indexing").joinpath("data", "joint_names.toml").read_text("utf-8")
    return tomllib.loads(text)


def _bones_of(table: dict[str, Any], skeleton: Skeleton) -> dict[str, tuple[int, int]] | None:
    """Return the bones that a table names, or None where the skeleton lacks a joint of it."""
    if table["convention"] != skeleton.convention:
        return None
    index = {name: joint for joint, name in enumerate(skeleton.names)}
    bones = {}
    for joint in JOINTS[1:]:
        side, limb = _split(joint)
        if limb == "hip":  # follows from the knees
            continue
        said = table["sides"][SIDES.index(side)] if side else ""
        tail, head = (index.get(name.replace("{side}", said)) for name in table[limb])
        if tail is None or head is None:
            return None
        bones[joint] = (tail, head)
    return bones
