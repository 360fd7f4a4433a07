"""Searching by some of the joints only: a wave of an arm, whatever the rest of the body does.

The joints that are asked for are looked at from the nearest joint above them that is not: a wrist
from the hips, a whole arm from the chest. Where the body is, how it travels and how it turns then
count no more, unless the hips are asked for too.

The frames of an index are linear in the features that they were made from (`FeatureSpace`), so an
index of a part of the body is made from its numbers, without reading the motions again.

`PARTS`          the parts of the body that have a name
`part_joints`    the joints that names of parts and joints stand for
`index_of_part`  an index by these joints
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.base.spelling import did_you_mean
from mocapdb.errors import ClipError
from mocapdb.indexing.canonical.canonical_body import JOINTS, PARENTS
from mocapdb.indexing.search.features import N_FEATURES, N_POSE, FeatureSpace
from mocapdb.indexing.search.frame_store import MotionIndex, index_of
from mocapdb.indexing.tuning import PART_AXES

__all__ = ["PARTS", "index_of_part", "joint_above", "part_joints"]

_ARM = ("shoulder", "elbow", "wrist")
_LEG = ("hip", "knee", "ankle", "toe")


def _of_side(side: str, limb: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"{side}_{joint}" for joint in limb)


PARTS: Mapping[str, tuple[str, ...]] = {
    "left-arm": _of_side("left", _ARM),
    "right-arm": _of_side("right", _ARM),
    "arms": _of_side("left", _ARM) + _of_side("right", _ARM),
    "left-leg": _of_side("left", _LEG),
    "right-leg": _of_side("right", _LEG),
    "legs": _of_side("left", _LEG) + _of_side("right", _LEG),
    "trunk": ("spine", "chest"),
    "upper-body": (
        "spine", "chest", "head", *_of_side("left", _ARM), *_of_side("right", _ARM),
    ),
    "lower-body": ("hips", *_of_side("left", _LEG), *_of_side("right", _LEG)),
}  # fmt: skip


def part_joints(names: Sequence[str]) -> tuple[str, ...]:
    """Return the joints of the canonical body that names stand for, in its order.

    Parameters
    ----------
    names : sequence of str
        Parts (see `PARTS`) and joints; ``right-wrist`` is as good as ``right_wrist``.

    Raises
    ------
    ClipError
        If there is no name, or one stands for nothing.

    Examples
    --------
    >>> part_joints(["right-arm", "head"])
    ('head', 'right_shoulder', 'right_elbow', 'right_wrist')
    """
    found: set[str] = set()
    known = {joint.replace("_", "-"): (joint,) for joint in JOINTS} | dict(PARTS)
    for name in names:
        own = name.strip().lower().replace("_", "-")
        if own not in known:
            raise ClipError(
                f"Expected parts of the body ({', '.join(PARTS)}) or joints ({', '.join(JOINTS)}), "
                f"but got {name!r}." + did_you_mean(own, known)
            )
        found.update(known[own])
    if not found:
        raise ClipError(f"Expected parts of the body, such as {', '.join(PARTS)}, but got none.")
    return tuple(joint for joint in JOINTS if joint in found)


def index_of_part(index: MotionIndex, joints: Sequence[str]) -> MotionIndex:
    """Return an index in which only some joints count.

    Parameters
    ----------
    index : MotionIndex
    joints : sequence of str
        Of the canonical body: see `part_joints`.

    Returns
    -------
    MotionIndex
        Of the same clips, along as many axes as `PART_AXES` says.
    """
    space = _space_of_part(index.space, joints)
    turn = np.asarray(index.space.axes.T @ space.axes, dtype=np.float32)
    clips = (index.frames.values(slice(*ends)) @ turn for ends in pairwise(index.frames.starts))
    return index_of(space, clips, index.usual, index.turns if "hips" in joints else None)


def _space_of_part(space: FeatureSpace, joints: Sequence[str]) -> FeatureSpace:
    """Return the directions of a space along which some joints move most."""
    chosen = _choice(joints)
    scales = space.weights.scales()
    counted = np.where(scales > 0, 1.0 / np.where(scales > 0, scales, 1.0), 0.0)
    features = counted[:, None] * chosen * scales[_weighed_as(chosen)]
    part = space.axes.T @ features
    covariance = part.T @ (space.deviations[:, None] ** 2 * part)
    variances, own_axes = np.linalg.eigh(covariance)
    some = slice(None, -PART_AXES - 1, -1)
    axes = np.zeros((N_FEATURES, PART_AXES))
    directions = np.zeros((features.shape[1], PART_AXES))
    deviations = np.zeros(PART_AXES)
    found = space.axes @ part @ own_axes[:, some]
    axes[:, : found.shape[1]] = found
    directions[:, : found.shape[1]] = own_axes[:, some]
    deviations[: found.shape[1]] = np.sqrt(np.maximum(variances[some], 0.0))
    return FeatureSpace(
        space.weights, space.mean, axes, deviations, features, directions, space.still
    )


def _choice(joints: Sequence[str]) -> FloatArray:
    """Return the (107, m) matrix that takes features to those of some joints.

    Each joint as seen from the nearest one above that is not among them.
    """
    columns = []
    for joint in joints:
        row = JOINTS.index(joint)
        if row == 0:  # the body as a whole: its height, how it travels and turns
            columns += [np.eye(N_FEATURES)[i] for i in range(2 * N_POSE, N_FEATURES)]
            continue
        above = joint_above(joint, joints)
        for first in (0, N_POSE):
            for axis in range(3):
                column = np.zeros(N_FEATURES)
                column[first + 3 * (row - 1) + axis] = 1.0
                if above > 0:
                    column[first + 3 * (above - 1) + axis] = -1.0
                columns.append(column)
    return np.column_stack(columns)


def joint_above(joint: str, joints: Sequence[str]) -> int:
    """Return the row of the nearest joint above one that is not among some; 0, the hips, for none.

    What a joint is seen from, where only these count.
    """
    above = int(PARENTS[JOINTS.index(joint)]) if joints else 0
    while above > 0 and JOINTS[above] in joints:
        above = int(PARENTS[above])
    return above


def _weighed_as(chosen: FloatArray) -> FloatArray:
    """Return for each column of a choice the feature whose weight it has."""
    return np.asarray(chosen.argmax(axis=0))
