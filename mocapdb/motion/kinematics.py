"""Forward kinematics, a whole clip at a time, and its inverse.

``forward_kinematics``        channels -> world positions and rotations of every joint
``channels_from_pose``        world positions and rotations -> channels
``to_metres``                 positions in skeleton units -> canonical frame (metres, Y up)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.base.kernels import jit
from mocapdb.errors import SkeletonError
from mocapdb.motion.rotations import continuous_angles, extract_angles
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Pose", "axis_rotations", "channels_from_pose", "forward_kinematics", "to_metres"]


class Pose(NamedTuple):
    """World positions and rotations of every joint, frame by frame.

    Attributes
    ----------
    positions : (F, J, 3), skeleton units
        In Acclaim the end of the joint's bone, in BVH the joint itself.
    rotations : (F, J, 3, 3)
        World rotation matrices (they act on column vectors).
    """

    positions: FloatArray
    rotations: FloatArray


def forward_kinematics(skeleton: Skeleton, channels: FloatArray) -> Pose:
    """Return the world pose of every joint for every frame.

    Parameters
    ----------
    skeleton : Skeleton
    channels : (F, C)
        Degrees and skeleton units, as in `Clip.channels`.

    Returns
    -------
    Pose
        Positions (F, J, 3) in skeleton units and rotations (F, J, 3, 3), both in the file's own
        frame (see `to_metres`).

    Raises
    ------
    SkeletonError
        If the number of channels is not the skeleton's.

    Notes
    -----
    With ``R = R_parent @ C @ M @ C.T`` (O'Kane 2008, section 3.2.1), the frame ``G = R @ C``
    obeys ``G = G_parent @ A @ M`` with the constant ``A = C_parent.T @ C``. The kernel carries G:
    M is a product of rotations about coordinate axes, each of which mixes two columns.
    """
    if channels.ndim != 2 or channels.shape[1] != skeleton.n_channels:
        raise SkeletonError(
            f"Expected channels of shape (frames, {skeleton.n_channels}) for skeleton "
            f"{skeleton.name!r}, but got {channels.shape}."
        )
    plan = _plan(skeleton)
    values = np.array(channels, dtype=np.float64, order="C")  # writable, so compiled once
    radians = np.deg2rad(values)
    n_frames = len(values)
    positions = np.empty((n_frames, skeleton.n_joints, 3))
    rotations = np.empty((n_frames, skeleton.n_joints, 3, 3))
    _forward(
        values,
        np.cos(radians),
        np.sin(radians),
        skeleton.parents,
        plan.turn_starts,
        plan.turn_channels,
        plan.turn_axes,
        plan.shift_starts,
        plan.shift_channels,
        plan.shift_axes,
        plan.pre_rotations,
        plan.pre_is_identity,
        plan.axis_transposes,
        plan.axis_is_identity,
        plan.fixed_offsets,
        plan.bone_in_own_frame,
        positions,
        rotations,
    )
    return Pose(positions, rotations)


def channels_from_pose(skeleton: Skeleton, pose: Pose) -> FloatArray:
    """Return the channels that bring a skeleton into a pose: the inverse of `forward_kinematics`.

    Parameters
    ----------
    skeleton : Skeleton
    pose : Pose
        World rotations of every joint (joints without rotation channels are ignored), and
        positions of the joints that have translation channels and of their parents.

    Returns
    -------
    (F, C) degrees and skeleton units
        Angles are continuous over time: of the equivalent Euler angles each frame takes those
        nearest the frame before. Where a joint has fewer than three rotation channels, the
        nearest rotation that it can reach.
    """
    positions, rotations = pose
    channels = np.empty((len(positions), skeleton.n_channels))
    plan = _plan(skeleton)
    axes = plan.axis_matrices
    no_turn = np.tile(np.eye(3), (len(positions), 1, 1))
    turns = np.empty_like(no_turn)
    reached = np.empty_like(rotations)  # a joint makes up for what its parents could not reach
    for joint, (dofs, order) in enumerate(
        zip(skeleton.dofs, skeleton.rotation_orders, strict=True)
    ):
        first = int(skeleton.channel_starts[joint])
        parent = int(skeleton.parents[joint])
        columns = {dof: first + i for i, dof in enumerate(dofs)}
        above = np.ascontiguousarray(reached[:, parent]) if parent >= 0 else no_turn
        reached[:, joint] = above
        if order:
            _localise(above, np.ascontiguousarray(rotations[:, joint]), axes[joint], turns)
            angles = continuous_angles(order, extract_angles(order, turns))
            channels[:, [columns[f"r{axis.lower()}"] for axis in order]] = np.rad2deg(angles)
            if len(order) == 3:  # three turns reach any rotation
                reached[:, joint] = rotations[:, joint]
            else:
                turn_axes = plan.turn_axes[plan.turn_starts[joint] : plan.turn_starts[joint + 1]]
                _turn(above, axes[joint], turn_axes, angles, reached[:, joint])
        shifts = [dof for dof in dofs if dof[0] == "t"]
        if shifts:
            moved = positions[:, joint]
            if parent >= 0:
                moved = moved - positions[:, parent]
            if skeleton.convention == "acclaim":
                moved = moved - reached[:, joint] @ skeleton.offsets[joint]
            if parent >= 0:
                moved = np.einsum("fji,fj->fi", above, moved)
            if skeleton.displaces:
                moved = moved - skeleton.offsets[joint]
            for dof in shifts:
                channels[:, columns[dof]] = moved[:, "xyz".index(dof[1])]
    return channels


def axis_rotations(skeleton: Skeleton) -> FloatArray:
    """Return the (J, 3, 3) constant axis rotations C of a skeleton."""
    return _plan(skeleton).axis_matrices


def to_metres(skeleton: Skeleton, positions: FloatArray) -> FloatArray:
    """Return positions of shape (..., 3) in the canonical frame: metres, right-handed, Y up."""
    scaled = positions * skeleton.metres_per_unit
    if skeleton.up == "z":  # x stays, z becomes y, y becomes -z
        scaled = np.stack([scaled[..., 0], scaled[..., 2], -scaled[..., 1]], axis=-1)
    return np.asarray(scaled)


@dataclass(frozen=True)
class _Plan:
    """What the kernel needs to know of a skeleton, as flat arrays.

    Turns are rotation channels, shifts translation channels; ``*_starts`` delimits a joint's own.
    """

    turn_starts: IntArray
    turn_channels: IntArray
    turn_axes: IntArray
    shift_starts: IntArray
    shift_channels: IntArray
    shift_axes: IntArray
    pre_rotations: FloatArray
    pre_is_identity: Any
    axis_matrices: FloatArray
    axis_transposes: FloatArray
    axis_is_identity: Any
    fixed_offsets: FloatArray
    bone_in_own_frame: bool


@lru_cache(maxsize=256)
def _plan(skeleton: Skeleton) -> _Plan:
    axes = _matrices_from_axes(skeleton.axis_deg)
    axes[~skeleton.axis_deg.any(axis=1)] = np.eye(3)  # exact, so that it can be skipped
    identity = np.eye(3)
    parents = skeleton.parents
    above = np.concatenate([identity[None], axes[parents[1:]]])
    pre_rotations = np.swapaxes(above, -1, -2) @ axes

    turn_starts, shift_starts = [0], [0]
    turn_channels, turn_axes, shift_channels, shift_axes = [], [], [], []
    fixed_offsets = skeleton.offsets.copy()
    for joint, (dofs, order) in enumerate(
        zip(skeleton.dofs, skeleton.rotation_orders, strict=True)
    ):
        first = int(skeleton.channel_starts[joint])
        for axis in order:
            turn_channels.append(first + dofs.index(f"r{axis.lower()}"))
            turn_axes.append("XYZ".index(axis))
        for i, dof in enumerate(dofs):
            if dof[0] == "t":
                axis_index = "xyz".index(dof[1])
                shift_channels.append(first + i)
                shift_axes.append(axis_index)
                if not skeleton.adds_offsets:
                    fixed_offsets[joint, axis_index] = 0.0
        turn_starts.append(len(turn_channels))
        shift_starts.append(len(shift_channels))

    def indices(values: list[int]) -> IntArray:
        return np.array(values, dtype=np.int64)

    return _Plan(
        turn_starts=indices(turn_starts),
        turn_channels=indices(turn_channels),
        turn_axes=indices(turn_axes),
        shift_starts=indices(shift_starts),
        shift_channels=indices(shift_channels),
        shift_axes=indices(shift_axes),
        pre_rotations=np.ascontiguousarray(pre_rotations),
        pre_is_identity=(pre_rotations == identity).all(axis=(1, 2)),
        axis_matrices=axes,
        axis_transposes=np.ascontiguousarray(np.swapaxes(axes, -1, -2)),
        axis_is_identity=(axes == identity).all(axis=(1, 2)),
        fixed_offsets=fixed_offsets,
        bone_in_own_frame=skeleton.convention == "acclaim",
    )


def _matrices_from_axes(axis_deg: FloatArray) -> FloatArray:
    """Return the (J, 3, 3) products of turns by (J, 3) degrees about the fixed x, y and z axes.

    Bit for bit those of scipy's ``Rotation.from_euler("xyz", ...)``, whose import would take most
    of the time that a short command takes.
    """
    matrices = np.empty((len(axis_deg), 3, 3))
    for joint, angles in enumerate(np.deg2rad(axis_deg).tolist()):
        x, w = math.sin(angles[0] / 2), math.cos(angles[0] / 2)
        sine, cosine = math.sin(angles[1] / 2), math.cos(angles[1] / 2)
        x, y, z, w = cosine * x, sine * w, -sine * x, cosine * w
        sine, cosine = math.sin(angles[2] / 2), math.cos(angles[2] / 2)
        x, y = cosine * x - sine * y, cosine * y + sine * x
        z, w = cosine * z + sine * w, cosine * w - sine * z
        matrices[joint] = [
            [x * x - y * y - z * z + w * w, 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), -x * x + y * y - z * z + w * w, 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), -x * x - y * y + z * z + w * w],
        ]
    return matrices


@jit
def _forward(
    values: FloatArray,
    cosines: FloatArray,
    sines: FloatArray,
    parents: IntArray,
    turn_starts: IntArray,
    turn_channels: IntArray,
    turn_axes: IntArray,
    shift_starts: IntArray,
    shift_channels: IntArray,
    shift_axes: IntArray,
    pre_rotations: FloatArray,
    pre_is_identity: Any,
    axis_transposes: FloatArray,
    axis_is_identity: Any,
    fixed_offsets: FloatArray,
    bone_in_own_frame: bool,
    positions: FloatArray,
    rotations: FloatArray,
) -> None:
    n_joints = len(parents)
    frames = np.empty((n_joints, 3, 3))  # G = R C of every joint, for the frame at hand
    for f in range(len(values)):
        for j in range(n_joints):
            parent = parents[j]
            g = frames[j]
            if parent < 0:
                for r in range(3):
                    for c in range(3):
                        g[r, c] = pre_rotations[j, r, c]
            elif pre_is_identity[j]:
                for r in range(3):
                    for c in range(3):
                        g[r, c] = frames[parent, r, c]
            else:
                for r in range(3):
                    for c in range(3):
                        g[r, c] = (
                            frames[parent, r, 0] * pre_rotations[j, 0, c]
                            + frames[parent, r, 1] * pre_rotations[j, 1, c]
                            + frames[parent, r, 2] * pre_rotations[j, 2, c]
                        )
            for t in range(turn_starts[j], turn_starts[j + 1]):
                cosine = cosines[f, turn_channels[t]]
                sine = sines[f, turn_channels[t]]
                a = (turn_axes[t] + 1) % 3
                b = (turn_axes[t] + 2) % 3
                for r in range(3):
                    first = g[r, a]
                    second = g[r, b]
                    g[r, a] = first * cosine + second * sine
                    g[r, b] = second * cosine - first * sine
            rotation = rotations[f, j]
            if axis_is_identity[j]:
                for r in range(3):
                    for c in range(3):
                        rotation[r, c] = g[r, c]
            else:
                for r in range(3):
                    for c in range(3):
                        rotation[r, c] = (
                            g[r, 0] * axis_transposes[j, 0, c]
                            + g[r, 1] * axis_transposes[j, 1, c]
                            + g[r, 2] * axis_transposes[j, 2, c]
                        )
            carrier = j if bone_in_own_frame else parent
            for r in range(3):
                place = 0.0 if parent < 0 else positions[f, parent, r]
                if carrier < 0:
                    place += fixed_offsets[j, r]
                else:
                    for c in range(3):
                        place += rotations[f, carrier, r, c] * fixed_offsets[j, c]
                for s in range(shift_starts[j], shift_starts[j + 1]):
                    shift = values[f, shift_channels[s]]
                    axis = shift_axes[s]
                    if parent < 0:
                        place += shift if axis == r else 0.0
                    else:
                        place += rotations[f, parent, r, axis] * shift
                positions[f, j, r] = place


@jit
def _localise(
    above: FloatArray, rotations: FloatArray, axis_rotation: FloatArray, turns: FloatArray
) -> None:
    """Find M of ``R = above @ C @ M @ C.T`` in every frame."""
    left = np.empty((3, 3))
    right = np.empty((3, 3))
    for f in range(len(turns)):
        for r in range(3):
            for c in range(3):
                left[r, c] = 0.0
                right[r, c] = 0.0
                for k in range(3):
                    left[r, c] += above[f, r, k] * axis_rotation[k, c]
                    right[r, c] += rotations[f, r, k] * axis_rotation[k, c]
        for r in range(3):
            for c in range(3):
                turns[f, r, c] = (
                    left[0, r] * right[0, c] + left[1, r] * right[1, c] + left[2, r] * right[2, c]
                )


@jit
def _turn(
    above: FloatArray,
    axis_rotation: FloatArray,
    turn_axes: IntArray,
    angles_rad: FloatArray,
    rotations: FloatArray,
) -> None:
    """Find ``R = above @ C @ M @ C.T`` in every frame, M being a product of turns."""
    g = np.empty((3, 3))
    for f in range(len(rotations)):
        for r in range(3):
            for c in range(3):
                g[r, c] = 0.0
                for k in range(3):
                    g[r, c] += above[f, r, k] * axis_rotation[k, c]
        for t in range(len(turn_axes)):
            cosine, sine = math.cos(angles_rad[f, t]), math.sin(angles_rad[f, t])
            a = (turn_axes[t] + 1) % 3
            b = (turn_axes[t] + 2) % 3
            for r in range(3):
                first = g[r, a]
                second = g[r, b]
                g[r, a] = first * cosine + second * sine
                g[r, b] = second * cosine - first * sine
        for r in range(3):
            for c in range(3):
                rotations[f, r, c] = (
                    g[r, 0] * axis_rotation[c, 0]
                    + g[r, 1] * axis_rotation[c, 1]
                    + g[r, 2] * axis_rotation[c, 2]
                )
