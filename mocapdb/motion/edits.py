"""Changes of a motion: other frames, another place, the other side.

Each takes a skeleton with its channels, and returns new channels. `Clip` offers them as methods,
which note in the clip's provenance what was done. `mocapdb.motion.joint_edits` changes the joints.
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.errors import ClipError
from mocapdb.motion.body.canonical_joints import other_side
from mocapdb.motion.body.joint_names import across_by_names
from mocapdb.motion.body.understanding import understand_pose
from mocapdb.motion.heading import heading_angles
from mocapdb.motion.joint_edits import columns_of
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.quaternions import from_euler_deg, slerp
from mocapdb.motion.rotations import elementary, extract_angles, nearest_angles
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "channels_at",
    "continued",
    "frames_of_rate",
    "in_place",
    "mirrored",
    "placed",
]

WHOLE = 1e-6  # a time this near to a frame, in frames, is that frame


# -- frames ----------------------------------------------------------------------------------------


def frames_of_rate(n_frames: int, step: float) -> FloatArray:
    """Return the times 0, `step`, 2 `step` ... within so many frames, in frames."""
    return np.asarray(step * np.arange(math.floor((n_frames - 1) / step + WHOLE) + 1))


def channels_at(skeleton: Skeleton, channels: FloatArray, frames: FloatArray) -> FloatArray:
    """Return the channels (T, C) at times between frames.

    Parameters
    ----------
    skeleton : Skeleton
    channels : (F, C)
    frames : (T,)
        Times in frames, from 0 to F - 1. Those that are whole are the frames as they are.

    Notes
    -----
    A joint with three rotation channels turns along the shortest arc between the rotations of the
    two frames (slerp, Shoemake 1985); its angles are the form nearest those of the frame before.
    A joint with one or two turns about each axis by the shorter way, which never leaves what it
    can reach. Translations go along straight lines.
    """
    last = len(channels) - 1
    frames = np.clip(frames, 0.0, last)
    before = np.floor(frames + WHOLE).astype(np.int64)
    share = np.maximum(frames - before, 0.0)
    share[share <= WHOLE] = 0.0
    first, second = channels[before], channels[np.minimum(before + 1, last)]
    found = first + share[:, None] * (second - first)
    between = np.flatnonzero(share)
    found[share == 0.0] = first[share == 0.0]
    for joint in skeleton.rotating_joints if len(between) else ():
        order = skeleton.rotation_orders[joint]
        columns = np.array(skeleton.rotation_columns(joint))
        a, b = first[between][:, columns], second[between][:, columns]
        if len(order) == 3:
            quats = slerp(from_euler_deg(order, a), from_euler_deg(order, b), share[between])
            angles = np.rad2deg(extract_angles(order, _matrices(quats)))
            found[np.ix_(between, columns)] = nearest_angles(angles, a)
        else:
            way = b - a
            way -= 360.0 * np.rint(way / 360.0)
            found[np.ix_(between, columns)] = a + share[between][:, None] * way
    return found


def _matrices(quats: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(quats).as_matrix())


# -- left and right --------------------------------------------------------------------------------


def mirrored(skeleton: Skeleton, channels: FloatArray) -> FloatArray:
    """Return the channels of the motion as a mirror in the plane x = 0 shows it.

    Raises
    ------
    ClipError
        If no joint has one on the other side.

    Notes
    -----
    With S the reflection of the world, a joint j takes over from the joint k on the other side
    ``R_j' = S @ R_k @ M_j``. The reflection M_j carries each bone of j onto the one of k: where
    the rest pose is symmetric, all M_j are the reflection of that pose. Bones keep their own
    lengths; a joint with fewer than three rotation channels takes the nearest rotation it can.
    So the motion mirrored twice is the first one only where every joint that turns has three.
    """
    pose = forward_kinematics(skeleton, channels)
    across = _across(skeleton, pose.positions)
    flip = np.array([-1.0, 1.0, 1.0])
    rotations = flip[:, None] * pose.rotations[:, across] @ _reflections(skeleton, across)
    return channels_from_pose(skeleton, Pose(pose.positions[:, across] * flip, rotations))


def _across(skeleton: Skeleton, positions: FloatArray) -> IntArray:
    """Return (J,) the joint on the other side of each, or itself: by names, else by shape."""
    joints = np.arange(skeleton.n_joints)
    across = across_by_names(skeleton.names)
    across = np.where(across[across] == joints, across, joints)
    if (across == joints).all():
        parts = understand_pose(skeleton, positions).parts
        for name, joint in parts.items():
            left, right = joint, parts.get(other_side(name), joint)
            while left != right and across[left] == left:  # up to where both sides meet
                across[left], across[right] = right, left
                left, right = int(skeleton.parents[left]), int(skeleton.parents[right])
    for joint in range(skeleton.n_joints):  # what hangs on a side is of that side
        below = [
            [child for child in skeleton.children[parent] if across[child] == child]
            for parent in (joint, across[joint])
        ]
        if across[joint] > joint and len(below[0]) == len(below[1]):
            across[below[0]], across[below[1]] = below[1], below[0]
    if (across == joints).all():
        raise ClipError(
            "Expected joints on a left and a right side, but neither names nor shape tell any. "
            "Rename them, such as LeftFoot and RightFoot."
        )
    return across


def _reflections(skeleton: Skeleton, across: IntArray) -> FloatArray:
    """Return (J, 3, 3) the reflection of each joint's bones onto those of the other side."""
    bones, carriers = skeleton.bone_joints, skeleton.bone_carriers
    own, other = skeleton.offsets[bones], skeleton.offsets[across[bones]]
    whole = _best_fit(other.T @ own, sign=-1.0)
    found = np.empty((skeleton.n_joints, 3, 3))
    for joint, parent in enumerate(skeleton.parents):
        found[joint] = whole if parent < 0 else found[parent]
        mine = carriers == joint
        if mine.any() and (other[mine] ** 2).sum() > 0:
            seen = own[mine] @ found[joint].T
            pull = other[mine].T @ seen / (other[mine] ** 2).sum()
            # what the bones leave open stays as it is: the least turn
            found[joint] = _best_fit(pull + 1e-6 * np.eye(3), sign=1.0) @ found[joint]
    return found


def _best_fit(pull: FloatArray, sign: float) -> FloatArray:
    """Return the orthogonal matrix of that determinant nearest to a sum of outer products.

    Kabsch (1976).
    """
    u, _, v = np.linalg.svd(pull)
    u[:, 2] *= sign * np.linalg.det(u @ v)
    return np.asarray(u @ v)


# -- places ----------------------------------------------------------------------------------------


def placed(
    skeleton: Skeleton,
    channels: FloatArray,
    at: tuple[float, float] | None = None,
    facing_deg: float | None = None,
) -> FloatArray:
    """Return the channels of the motion begun at another place, or in another direction.

    Parameters
    ----------
    skeleton : Skeleton
    channels : (F, C)
    at : (2,) skeleton units, optional
        Where the body's root is level in the first frame: x and z where y is up, x and y where z
        is.
    facing_deg : float, optional, degrees
        Where the body looks in the first frame: 0 along z (y up) or along -y (z up), 90 along x.

    Raises
    ------
    ClipError
        If the body has no root that can be moved.
    """
    pose = forward_kinematics(skeleton, channels)
    level = _level(skeleton)
    start = pose.positions[0, skeleton.body_root]
    goal = start.copy()
    if at is not None:
        goal[level] = at
    turn = 0.0
    if facing_deg is not None:
        turn = math.radians(facing_deg) - _facing(skeleton, pose)
    return _moved(skeleton, channels, pose, turn, start, goal)


def continued(
    skeleton: Skeleton, before: FloatArray, after: FloatArray
) -> tuple[FloatArray, float]:
    """Return the channels of a second motion begun at the place and heading a first one ends in.

    Its root is moved level and turned about the vertical; height and pose stay as they are.

    Returns
    -------
    channels : (F, C)
    gap : float, skeleton units
        How much higher its root begins than the first motion would go on.

    Raises
    ------
    ClipError
        If the body has no root that can be moved.
    """
    end = forward_kinematics(skeleton, before[-2:])
    pose = forward_kinematics(skeleton, after)
    level, root = _level(skeleton), skeleton.body_root
    start = pose.positions[0, root]
    goal = start.copy()
    step = end.positions[-1, root] - end.positions[0, root]
    onward = end.positions[-1, root] + step
    goal[level] = onward[level]
    headings = [
        float(heading_angles(rotations, skeleton.up_index)[0])
        for rotations in (end.rotations[-1:, root], pose.rotations[:1, root])
    ]
    gap = float((start - onward)[skeleton.up_index])
    return _moved(skeleton, after, pose, headings[0] - headings[1], start, goal), gap


def in_place(skeleton: Skeleton, channels: FloatArray) -> FloatArray:
    """Return the channels of the motion with the body's root over its first place.

    Raises
    ------
    ClipError
        If the body has no root that can be moved.
    """
    pose = forward_kinematics(skeleton, channels)
    level, root = _level(skeleton), skeleton.body_root
    goal = pose.positions[:, root].copy()
    goal[:, level] = goal[0, level]
    return _moved(skeleton, channels, pose, 0.0, pose.positions[:, root], goal)


def _moved(
    skeleton: Skeleton,
    channels: FloatArray,
    pose: Pose,
    turn_rad: float,
    pivot: FloatArray,
    goal: FloatArray,
) -> FloatArray:
    """Return channels of the motion turned about the vertical through `pivot`, put at `goal`."""
    root = next(
        (
            joint
            for joint in skeleton.chain_to_root(skeleton.body_root)
            if len(skeleton.dofs[joint]) == 6
        ),
        None,
    )
    if root is None:
        raise ClipError(
            f"Expected a root with three positions and three angles to move, but "
            f"{skeleton.names[skeleton.body_root]!r} has "
            f"{' '.join(skeleton.dofs[skeleton.body_root]) or 'none'}."
        )
    turn = elementary(skeleton.up_axis, np.array([turn_rad]))[0]
    positions, rotations = pose.positions.copy(), pose.rotations.copy()
    positions[:, root] = (positions[:, root] - pivot) @ turn.T + goal
    rotations[:, root] = turn @ rotations[:, root]
    own = columns_of(skeleton, [root])
    moved = channels.copy()
    moved[:, own] = channels_from_pose(skeleton, Pose(positions, rotations))[:, own]
    return moved


def _level(skeleton: Skeleton) -> list[int]:
    return [axis for axis in range(3) if axis != skeleton.up_index]


def _facing(skeleton: Skeleton, pose: Pose) -> float:
    """Return where the body looks in the first frame: radians from z (y up) or -y (z up) to x.

    By the line of its hips, else by how its root is turned.
    """
    parts = understand_pose(skeleton, pose.positions).parts
    if {"left_hip", "right_hip"} <= set(parts):
        left, right = (pose.positions[0, parts[f"{side}_hip"]] for side in ("left", "right"))
        ahead = np.cross(left - right, np.eye(3)[skeleton.up_index])
        along = ahead[2] if skeleton.up == "y" else -ahead[1]
        return math.atan2(ahead[0], along)
    root = skeleton.body_root
    return float(heading_angles(pose.rotations[:1, root], skeleton.up_index)[0])
