"""Changes of a motion's joints: some left out, one made the root, others named anew.

`mocapdb.motion.edits` changes where and when they move.
"""

from __future__ import annotations

import difflib
import fnmatch
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import SkeletonError
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Edited", "columns_of", "find_joints", "only_below", "renamed", "without_joints"]

SHIFTS = ("tx", "ty", "tz")


class Edited(NamedTuple):
    """A skeleton, and the channels (F, C) that move it."""

    skeleton: Skeleton
    channels: FloatArray


def find_joints(skeleton: Skeleton, names: Iterable[str]) -> list[int]:
    """Return the joints of some names, which may be patterns such as ``*Thumb*``.

    Raises
    ------
    SkeletonError
        If a name is no joint's; it tells the nearest ones.
    """
    found: list[int] = []
    for name in names:
        if not isinstance(name, str):
            raise SkeletonError(f"Expected the name of a joint, but got {name!r}.")
        if name in skeleton.names:
            found.append(skeleton.names.index(name))
            continue
        fitting = [i for i, own in enumerate(skeleton.names) if fnmatch.fnmatchcase(own, name)]
        if not fitting:
            by_case = {own.lower(): own for own in skeleton.names}
            near = difflib.get_close_matches(name.lower(), by_case, n=3, cutoff=0.5)
            hint = " or ".join(repr(by_case[own]) for own in near)
            meant = f"Did you mean {hint}?" if hint else f"It has: {', '.join(skeleton.names)}."
            raise SkeletonError(
                f"Expected a joint of skeleton {skeleton.name!r}, but got {name!r}. {meant}"
            )
        found += fitting
    return sorted(set(found))


def without_joints(skeleton: Skeleton, channels: FloatArray, joints: Iterable[int]) -> Edited:
    """Return a motion without some joints and all that hangs on them.

    Raises
    ------
    SkeletonError
        If nothing would be left.
    """
    gone = set(joints)
    for joint, parent in enumerate(skeleton.parents):
        if int(parent) in gone:
            gone.add(joint)
    if 0 in gone:
        raise SkeletonError(
            f"Expected joints other than the root, but {skeleton.names[0]!r} carries all others."
        )
    kept = [joint for joint in range(skeleton.n_joints) if joint not in gone]
    return Edited(_with_joints(skeleton, kept), channels[:, columns_of(skeleton, kept)])


def only_below(skeleton: Skeleton, channels: FloatArray, root: int) -> Edited:
    """Return the motion of a joint and what hangs on it, each where it is in the world.

    The joint has all its motion by itself, in three positions and three angles.
    """
    if root == 0:
        return Edited(skeleton, channels)
    kept = [root]
    for joint in range(root + 1, skeleton.n_joints):
        if int(skeleton.parents[joint]) in kept:
            kept.append(joint)
    body = _with_joints(skeleton, kept)
    order = skeleton.rotation_orders[root]
    turns = tuple(dof for dof in skeleton.dofs[root] if dof[0] == "r")
    if len(order) < 3:
        order, turns = "ZXY", ("rz", "rx", "ry")
    dofs = ((*SHIFTS, *turns), *body.dofs[1:])
    offsets = body.offsets.copy()
    offsets[0] = 0.0
    body = replace(
        body,
        dofs=dofs,
        offsets=offsets,
        rotation_orders=(order, *body.rotation_orders[1:]),
    )
    pose = forward_kinematics(skeleton, channels)
    alone = _with_joints(body, [0])
    top = channels_from_pose(alone, Pose(pose.positions[:, [root]], pose.rotations[:, [root]]))
    return Edited(body, np.hstack([top, channels[:, columns_of(skeleton, kept[1:])]]))


def renamed(skeleton: Skeleton, names: Mapping[str, str] | Callable[[str], str]) -> Skeleton:
    """Return a skeleton whose joints have other names.

    Raises
    ------
    SkeletonError
        If a name is no joint's, two joints would have the same, or a new name is none.
    """
    if callable(names):
        new = {name: names(name) for name in skeleton.names}
    else:
        find_joints(skeleton, [name for name in names if name not in skeleton.names])
        new = dict(names)
    for name in new.values():
        if not (isinstance(name, str) and name and name == name.strip() and name.isprintable()):
            raise SkeletonError(
                f"Expected a name of one line, without blanks around it, but got {name!r}."
            )
    return replace(
        skeleton,
        names=tuple(new.get(name, name) for name in skeleton.names),
        joint_map={joint: new.get(name, name) for joint, name in skeleton.joint_map.items()},
    )


def _with_joints(skeleton: Skeleton, kept: list[int]) -> Skeleton:
    """Return the skeleton of some joints, the first of which is its root."""
    index = {joint: i for i, joint in enumerate(kept)}
    names = tuple(skeleton.names[joint] for joint in kept)
    parents = [-1, *(index[int(skeleton.parents[joint])] for joint in kept[1:])]
    return replace(
        skeleton,
        names=names,
        parents=np.array(parents),
        offsets=skeleton.offsets[kept],
        dofs=tuple(skeleton.dofs[joint] for joint in kept),
        rotation_orders=tuple(skeleton.rotation_orders[joint] for joint in kept),
        axis_deg=skeleton.axis_deg[kept],
        joint_map={part: name for part, name in skeleton.joint_map.items() if name in names},
        body_root=index.get(skeleton.body_root, 0),
    )


def columns_of(skeleton: Skeleton, joints: Iterable[int]) -> list[int]:
    """Return the channels of some joints, in their order."""
    starts = skeleton.channel_starts
    return [column for joint in joints for column in range(starts[joint], starts[joint + 1])]
