"""How far each joint turns and shifts by itself, and how much of that another motion loses.

Millimetres on the skin say little of a hand, a jaw or a fingertip, which move few of its points.
Here each joint is compared with itself: the angle between its local rotations, and, where it has
translation channels and is not the root, the distance between its translations.

Arrays (2, J) are of rotations, in degrees, and of translations, in millimetres.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mocapdb.base.arrays import FloatArray, FrameSource, IntArray
from mocapdb.base.kernels import jit
from mocapdb.motion.kinematics import Pose, forward_kinematics
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import CHUNK_FRAMES

__all__ = [
    "JointErrors",
    "JointMotion",
    "joint_errors",
    "joint_motion",
    "missing_swing",
    "own_errors",
]


@dataclass(frozen=True)
class JointMotion:
    """How much each joint moves by itself.

    Attributes
    ----------
    swing : (2, J), degrees and millimetres
        The largest angle found between two of its local rotations; the largest extent of its
        translation along an axis, 0 for the root.
    spread : (2, J), degrees and millimetres
        Root mean square of the angle to its mean rotation, and of the distance to its mean
        translation.
    ends : (2, 2, J)
        The frames at the two ends of the swing, of rotations and of translations.
    rotations : (2, J, 3, 3)
        Its local rotations at the ends.
    places : (2, J), millimetres
        Its translation at the ends, along the axis of the largest extent.
    axes : (J,)
        The channel of that axis; -1 without one.
    """

    swing: FloatArray
    spread: FloatArray
    ends: IntArray
    rotations: FloatArray
    places: FloatArray
    axes: IntArray


@dataclass(frozen=True)
class JointErrors:
    """How much of each joint's own motion is lost.

    Attributes
    ----------
    motion : JointMotion
        That of the original.
    mean, rms, worst : (2, J), degrees and millimetres
        Angle between its local rotations of before and after, and distance between its
        translations, over all frames.
    worst_frame : (2, J)
        Where they are largest.
    kept : (2, J), degrees and millimetres
        What is left of the swing between the same two frames.
    """

    motion: JointMotion
    mean: FloatArray
    rms: FloatArray
    worst: FloatArray
    worst_frame: IntArray
    kept: FloatArray


def joint_motion(skeleton: Skeleton, channels: FloatArray) -> JointMotion:
    """Return how much each joint moves in channels (F, C).

    Notes
    -----
    The largest angle is found by two sweeps: the frame farthest from the first one, and the frame
    farthest from that. For one axis of rotation that is exact; it is never less than half of it.
    """
    joints = np.arange(skeleton.n_joints)
    ends = np.zeros((2, 2, skeleton.n_joints), dtype=np.int64)
    first_ones = _local_rotations(skeleton, forward_kinematics(skeleton, channels[:1]))[0]
    rotations = np.stack([first_ones, first_ones])
    poses = list(_poses(skeleton, channels)) if len(channels) <= CHUNK_FRAMES else None
    for sweep in range(2):
        reference = rotations[sweep - 1]
        total, turned = np.zeros_like(reference), np.zeros(skeleton.n_joints)
        for first, pose in poses or _poses(skeleton, channels):
            local = _local_rotations(skeleton, pose)
            total += local.sum(axis=0)
            angles = _angles_deg(local, reference)
            highest = angles.argmax(axis=0)
            beyond = angles[highest, joints] > turned
            turned[beyond] = angles[highest, joints][beyond]
            ends[sweep, 0, beyond] = first + highest[beyond]
            rotations[sweep, beyond] = local[highest, joints][beyond]
    swing = np.stack([turned, np.zeros(skeleton.n_joints)])
    spread = np.stack([_spread_deg(total / len(channels)), np.zeros(skeleton.n_joints)])
    places, axes = np.zeros((2, skeleton.n_joints)), np.full(skeleton.n_joints, -1)
    unit_mm = 1000.0 * skeleton.metres_per_unit
    for joint, columns in _shift_columns(skeleton):
        own = channels[:, columns]
        axis = int(np.ptp(own, axis=0).argmax())
        axes[joint] = columns[axis]
        ends[:, 1, joint] = own[:, axis].argmin(), own[:, axis].argmax()
        places[:, joint] = unit_mm * own[ends[:, 1, joint], axis]
        swing[1, joint] = unit_mm * np.ptp(own[:, axis])
        spread[1, joint] = unit_mm * np.sqrt(own.var(axis=0).sum())
    return JointMotion(swing, spread, ends, rotations, places, axes)


def joint_errors(
    skeleton: Skeleton, original: FloatArray, other: FrameSource, motion: JointMotion | None = None
) -> JointErrors:
    """Return what the joints of channels (F, C) lost, in little memory.

    Parameters
    ----------
    skeleton : Skeleton
    original : (F, C)
    other : (F, C), or what gives the channels of a slice
    motion : JointMotion, optional
        That of the original, where it is known.
    """
    motion = motion or joint_motion(skeleton, original)
    n_joints = skeleton.n_joints
    total, squares, worst = np.zeros((3, 2, n_joints))
    worst_frame = np.zeros((2, n_joints), dtype=np.int64)
    rotations, places = motion.rotations.copy(), motion.places.copy()
    for first, before in _poses(skeleton, original):
        frames = slice(first, first + len(before.positions))
        channels = other[frames]
        after = forward_kinematics(skeleton, channels)
        errors = own_errors(skeleton, original[frames], before, channels, after)
        total += errors.sum(axis=1)
        squares += (errors * errors).sum(axis=1)
        highest = errors.argmax(axis=1)
        peaks = np.take_along_axis(errors, highest[:, None], axis=1)[:, 0]
        worst_frame = np.where(peaks > worst, first + highest, worst_frame)
        worst = np.maximum(worst, peaks)
        _put_ends(skeleton, motion, channels, after, first, rotations, places)
    kept = np.stack([_angles_deg(*rotations), places[1] - places[0]])
    n_frames = len(original)
    return JointErrors(
        motion, total / n_frames, np.sqrt(squares / n_frames), worst, worst_frame, kept
    )


def missing_swing(
    skeleton: Skeleton, motion: JointMotion, channels: FloatArray, pose: Pose, first: int
) -> FloatArray:
    """Return how much of each joint's swing some of another motion's frames miss.

    To first order the two ends add up.

    Parameters
    ----------
    skeleton : Skeleton
    motion : JointMotion
        That of the original.
    channels : (F, C)
        The other motion, from frame `first` on.
    pose : Pose
        That of these channels.

    Returns
    -------
    (2, 2, J), degrees and millimetres
        What each end misses of rotations and translations; 0 for ends in other frames.
    """
    rotations, places = motion.rotations.copy(), motion.places.copy()
    _put_ends(skeleton, motion, channels, pose, first, rotations, places)
    turned = _angles_deg(rotations, motion.rotations[::-1])
    shifted = (places - motion.places[::-1]) * [[-1.0], [1.0]]
    return motion.swing - np.stack([turned, shifted], axis=1)


def _put_ends(
    skeleton: Skeleton,
    motion: JointMotion,
    channels: FloatArray,
    pose: Pose,
    first: int,
    rotations: FloatArray,
    places: FloatArray,
) -> None:
    """Write rotations and places at the ends of the swings that lie in frames from `first` on."""
    unit_mm = 1000.0 * skeleton.metres_per_unit
    here = (motion.ends >= first) & (motion.ends < first + len(channels))
    end, joint = np.nonzero(here[:, 0])
    frame, parent = motion.ends[end, 0, joint] - first, skeleton.parents[joint]
    turned = pose.rotations[frame, parent].transpose(0, 2, 1) @ pose.rotations[frame, joint]
    is_root = (parent < 0)[:, None, None]
    rotations[end, joint] = np.where(is_root, pose.rotations[frame, joint], turned)
    for end, joint in np.argwhere(here[:, 1] & (motion.axes >= 0)):
        frame = int(motion.ends[end, 1, joint]) - first
        places[end, joint] = unit_mm * channels[frame, motion.axes[joint]]


def own_errors(
    skeleton: Skeleton, channels: FloatArray, pose: Pose, others: FloatArray, other: Pose
) -> FloatArray:
    """Return the error (2, F, J) of each joint's own rotation and translation.

    Parameters
    ----------
    skeleton : Skeleton
    channels, others : (F, C)
    pose, other : Pose
        That of the channels, and of the others (see `forward_kinematics`).

    Returns
    -------
    (2, F, J), degrees and millimetres
    """
    errors = np.zeros((2, len(channels), skeleton.n_joints))
    squares = np.empty(errors.shape[1:])
    _square_differences(pose.rotations, other.rotations, skeleton.parents, squares)
    errors[0] = _angle_of_square(squares)
    for joint, columns in _shift_columns(skeleton):
        distances = np.linalg.norm(channels[:, columns] - others[:, columns], axis=1)
        errors[1, :, joint] = 1000.0 * skeleton.metres_per_unit * distances
    return errors


def _poses(skeleton: Skeleton, channels: FloatArray) -> Iterator[tuple[int, Pose]]:
    """Yield the first frame of every few thousand, and their poses."""
    for first in range(0, len(channels), CHUNK_FRAMES):
        yield first, forward_kinematics(skeleton, channels[first : first + CHUNK_FRAMES])


@lru_cache(maxsize=64)
def _shift_columns(skeleton: Skeleton) -> tuple[tuple[int, IntArray], ...]:
    """Return the joints that translation channels shift, but for the root, and these channels."""
    found = []
    for joint in range(1, skeleton.n_joints):
        start = int(skeleton.channel_starts[joint])
        columns = [start + i for i, dof in enumerate(skeleton.dofs[joint]) if dof[0] == "t"]
        if columns:
            found.append((joint, np.array(columns)))
    return tuple(found)


def _local_rotations(skeleton: Skeleton, pose: Pose) -> FloatArray:
    """Return the rotation (F, J, 3, 3) of each joint in its parent's frame."""
    local = np.empty_like(pose.rotations)
    _turn_back(pose.rotations, skeleton.parents, local)
    return local


def _angles_deg(rotations: FloatArray, others: FloatArray) -> FloatArray:
    """Return the angles between rotation matrices (..., 3, 3), exact for small ones too."""
    differences = rotations - others
    return _angle_of_square(np.einsum("...ij,...ij->...", differences, differences))


def _angle_of_square(squares: FloatArray) -> FloatArray:
    """Return the angle between two rotations from the squared norm of their difference."""
    return np.rad2deg(2.0 * np.arcsin(np.sqrt(np.clip(squares / 8.0, 0.0, 1.0))))


def _spread_deg(means: FloatArray) -> FloatArray:
    """Return the root mean square angle to their mean of rotations with mean matrices (J, 3, 3).

    The mean rotation M is nearest to the mean matrix; the mean of ``|L - M|^2`` is 6 less twice the
    sum of the mean matrix's singular values, the last of them negative where its determinant is.
    """
    values = np.linalg.svd(means, compute_uv=False)
    values[:, 2] *= np.sign(np.linalg.det(means))
    return _angle_of_square(6.0 - 2.0 * values.sum(axis=1))


@jit
def _turn_back(rotations: FloatArray, parents: IntArray, local: FloatArray) -> None:
    """Write the transpose of the parent's rotation, times the joint's."""
    for f in range(len(rotations)):
        for j in range(len(parents)):
            parent = parents[j]
            for r in range(3):
                for c in range(3):
                    value = rotations[f, j, r, c]
                    if parent >= 0:
                        value = 0.0
                        for k in range(3):
                            value += rotations[f, parent, k, r] * rotations[f, j, k, c]
                    local[f, j, r, c] = value


@jit
def _square_differences(
    rotations: FloatArray, others: FloatArray, parents: IntArray, squares: FloatArray
) -> None:
    """Write the squared norm (F, J) of the difference of each joint's two local rotations."""
    for f in range(len(rotations)):
        for j in range(len(parents)):
            parent = parents[j]
            square = 0.0
            for r in range(3):
                for c in range(3):
                    moved = rotations[f, j, r, c] - others[f, j, r, c]
                    if parent >= 0:
                        moved = 0.0
                        for k in range(3):
                            moved += rotations[f, parent, k, r] * rotations[f, j, k, c]
                            moved -= others[f, parent, k, r] * others[f, j, k, c]
                    square += moved * moved
            squares[f, j] = square
