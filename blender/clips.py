"""Motions of armatures as clips of mocapdb, and the other way. Runs in the worker: no bpy.

A bone of Blender is turned at its head and carries what hangs on it, as a joint of a BVH does; a
bone of an Acclaim skeleton is the joint that it ends in.
"""

from __future__ import annotations

import numpy as np

from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.skeleton import Skeleton

from .motions import FloatArray, Motion

__all__ = ["clip_of", "motion_of"]

MOVES_M = 1e-4  # a bone whose head moves less against its parent only turns
SHORT = 1e-3  # of the body's height: shorter bones get a tail that can be seen, for Blender
STUB = 0.03  # of the body's height: how long that is
Z_UP = {"z": np.eye(3), "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])}


def clip_of(motion: Motion) -> Clip:
    """Return a motion as a clip: a joint at each bone's head, and one at each last bone's tail.

    Several bones without a parent hang on a joint of their own that never moves.
    """
    names, parents = list(motion.names), motion.parents.tolist()
    heads, tails = motion.heads, motion.tails
    positions, rotations = motion.positions, motion.rotations
    first = 0
    if parents.count(-1) > 1:
        first = 1
        names.insert(0, _unused("armature", names))
        parents = [-1, *(parent + 1 for parent in parents)]
        still = np.zeros((1, 3))
        heads, tails = np.concatenate([still, heads]), np.concatenate([still, tails])
        here = np.zeros((len(positions), 1, 3))
        positions = np.concatenate([here, positions], axis=1)
        unturned = np.broadcast_to(np.eye(3), (len(positions), 1, 3, 3))
        rotations = np.concatenate([unturned, rotations], axis=1)
    offsets = [np.zeros(3)]
    dofs: list[tuple[str, ...]] = [() if first else ("tx", "ty", "tz", "rz", "ry", "rx")]
    for bone in range(1, len(names)):
        parent = parents[bone]
        offset = heads[bone] - heads[parent]
        apart = positions[:, bone] - positions[:, parent]
        local = np.einsum("fji,fj->fi", rotations[:, parent], apart)
        moves = parent < first or bool(np.abs(local - offset).max() > MOVES_M)
        offsets.append(offset)
        dofs.append(("tx", "ty", "tz", "rz", "ry", "rx") if moves else ("rz", "ry", "rx"))
    ends = [bone for bone in range(first, len(names)) if bone not in parents]
    for bone in ends:
        names.append(_unused(f"{names[bone]} end", names))
        parents.append(bone)
        offsets.append(tails[bone] - heads[bone])
        dofs.append(())
    skeleton = Skeleton(
        names=names,
        parents=parents,
        offsets=np.array(offsets),
        dofs=dofs,
        rotation_orders=["ZYX" if own else "" for own in dofs],
        convention="bvh",
        metres_per_unit=1.0,
        up="z",
        name=motion.name,
    )
    where = positions[:, ends] + np.einsum(
        "fbij,bj->fbi", rotations[:, ends], tails[ends] - heads[ends]
    )
    pose = Pose(
        np.concatenate([positions, where], axis=1),
        np.concatenate([rotations, rotations[:, ends]], axis=1),
    )
    return Clip(skeleton, channels_from_pose(skeleton, pose), motion.fps, name=motion.name)


def motion_of(clip: Clip, fps: float | None = None) -> Motion:
    """Return a clip as the motion of bones, in metres and Z up.

    The ends of bones of a BVH (its End Sites) are the tails of bones and no bones themselves. Where
    the file says no place at rest for a joint, because its position is a channel, its usual place
    is taken.
    """
    if fps is not None and fps != clip.fps:
        clip = clip.resample(fps)
    skeleton = clip.skeleton
    pose = forward_kinematics(skeleton, clip.channels)
    rest = _rest_positions(skeleton, pose)
    turn, unit = Z_UP[skeleton.up], skeleton.metres_per_unit
    height = max(skeleton.height, float(np.ptp(rest, axis=0).max()), 1e-6)
    up = np.eye(3)[skeleton.up_index]
    is_acclaim = skeleton.convention == "acclaim"
    bones = [
        joint
        for joint in range(skeleton.n_joints)
        if is_acclaim or skeleton.dofs[joint] or skeleton.children[joint] or joint == 0
    ]
    heads, tails, positions = [], [], []
    for joint in bones:
        parent = int(skeleton.parents[joint])
        if is_acclaim:
            offset = rest[joint] - rest[parent] if parent >= 0 else skeleton.offsets[joint]
            heads.append(rest[joint] - offset)
            tails.append(rest[joint])
            positions.append(pose.positions[:, joint] - pose.rotations[:, joint] @ offset)
        else:
            below = rest[list(skeleton.children[joint])]
            heads.append(rest[joint])
            tails.append(below.mean(axis=0) if len(below) else rest[joint])
            positions.append(pose.positions[:, joint])
        if np.linalg.norm(tails[-1] - heads[-1]) < SHORT * height:
            tails[-1] = heads[-1] + STUB * height * up
    index = {joint: bone for bone, joint in enumerate(bones)}
    return Motion(
        names=tuple(skeleton.names[joint] for joint in bones),
        parents=np.array([index.get(int(skeleton.parents[joint]), -1) for joint in bones]),
        heads=unit * np.array(heads) @ turn.T,
        tails=unit * np.array(tails) @ turn.T,
        positions=unit * np.stack(positions, axis=1) @ turn.T,
        rotations=turn @ pose.rotations[:, bones] @ turn.T,
        fps=clip.fps,
        name=clip.name,
    )


def _rest_positions(skeleton: Skeleton, pose: Pose) -> FloatArray:
    """Return (J, 3) where joints are at rest, the root at the origin."""
    rest = np.zeros((skeleton.n_joints, 3))
    for joint in range(1, skeleton.n_joints):
        parent = int(skeleton.parents[joint])
        offset = skeleton.offsets[joint]
        if not skeleton.adds_offsets and any(dof[0] == "t" for dof in skeleton.dofs[joint]):
            apart = pose.positions[:, joint] - pose.positions[:, parent]
            offset = np.median(np.einsum("fji,fj->fi", pose.rotations[:, parent], apart), axis=0)
        rest[joint] = rest[parent] + offset
    return rest


def _unused(name: str, names: list[str]) -> str:
    while name in names:
        name += "_"
    return name
