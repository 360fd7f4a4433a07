"""Rotations as the regression fits them: numbers in radians that change smoothly.

Angles do, for nearly every joint. Where a joint turns all the way round, or its three Euler angles
come near the pose in which two of them are one, its rotation matrix is fitted instead and made a
rotation again: the constraint of Raunio (2014, eq. 6.4), for a sphere in place of a circle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.tuning import LOCK_COSINE, WIDEST_SWING_DEG
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import axis_rotations, forward_kinematics
from mocapdb.motion.rotations import continuous_angles, elementary
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "RotationValues",
    "choose_rotation_values",
    "euler_rotations",
    "local_rotations",
    "rotation_angles",
]

MATRIX_SCALE = math.sqrt(0.5)  # distances of matrices become angles, in radians


@dataclass(frozen=True)
class RotationValues:
    """How a skeleton's rotations are written as numbers.

    Attributes
    ----------
    skeleton : Skeleton
    matrix_joints : tuple of int
        Joints whose rotation is written as a matrix, 9 numbers; the others as their angles.
    """

    skeleton: Skeleton
    matrix_joints: tuple[int, ...]

    def encode(self, clip: Clip) -> FloatArray:
        """Return the numbers (F, D) of a clip's rotations, distances in radians."""
        blocks = []
        for joint in self._turning:
            block = _angles(self.skeleton, joint, clip.channels)
            if joint in self.matrix_joints:
                rotations = euler_rotations(self.skeleton.rotation_orders[joint], block)
                block = rotations.reshape(len(clip), 9) * MATRIX_SCALE
            blocks.append(block)
        return np.hstack(blocks)

    def decode(self, values: FloatArray) -> FloatArray:
        """Return each joint's rotation (F, J, 3, 3) relative to its parent."""
        skeleton = self.skeleton
        channels = np.zeros((len(values), skeleton.n_channels))
        matrices = {}
        at = 0
        for joint in self._turning:
            if joint in self.matrix_joints:
                matrices[joint] = values[:, at : at + 9].reshape(-1, 3, 3)
                at += 9
            else:
                columns = skeleton.rotation_columns(joint)
                channels[:, columns] = np.rad2deg(values[:, at : at + len(columns)])
                at += len(columns)
        local = local_rotations(skeleton, channels)
        axes = axis_rotations(skeleton)
        for joint, matrix in matrices.items():
            left, _, right = np.linalg.svd(matrix)
            left[..., 2] *= np.linalg.det(left @ right)[:, None]
            local[:, joint] = axes[joint] @ left @ right @ axes[joint].T
        return local

    def names(self) -> list[str]:
        """Return D names such as ``"lfemur.rx"``, or ``"lthumb[0,2]"`` of a matrix."""
        found = []
        for joint in self._turning:
            name = self.skeleton.names[joint]
            if joint in self.matrix_joints:
                found += [f"{name}[{i // 3},{i % 3}]" for i in range(9)]
            else:
                found += [
                    f"{name}.r{axis.lower()}" for axis in self.skeleton.rotation_orders[joint]
                ]
        return found

    @property
    def _turning(self) -> list[int]:
        return [joint for joint, order in enumerate(self.skeleton.rotation_orders) if order]


def choose_rotation_values(clip: Clip) -> RotationValues:
    """Return how to write a clip's rotations: as matrices where angles would jump."""
    skeleton = clip.skeleton
    matrix_joints = [
        joint
        for joint, order in enumerate(skeleton.rotation_orders)
        if order and _needs_matrix(order, _angles(skeleton, joint, clip.channels))
    ]
    return RotationValues(skeleton, tuple(matrix_joints))


def _needs_matrix(order: str, angles: FloatArray) -> bool:
    if np.ptp(angles, axis=0).max() > math.radians(WIDEST_SWING_DEG):
        return True
    return len(order) == 3 and float(np.abs(np.cos(angles[:, 1])).min()) < LOCK_COSINE


def _angles(skeleton: Skeleton, joint: int, channels: FloatArray) -> FloatArray:
    """Return the angles (F, n) of a joint in radians, continuous over time."""
    radians = np.deg2rad(channels[:, skeleton.rotation_columns(joint)])
    if len(radians) > 1 and np.abs(np.diff(radians, axis=0)).max() < math.pi / 4:
        return radians  # they are already: no need to search for jumps
    return continuous_angles(skeleton.rotation_orders[joint], radians)


def euler_rotations(order: str, angles: FloatArray) -> FloatArray:
    """Return the products (F, 3, 3) of elementary rotations by angles (F, n) in radians."""
    rotation = np.eye(3)
    for axis, angle in zip(order, angles.T, strict=True):
        rotation = rotation @ elementary(axis, angle)
    return np.asarray(rotation)


def rotation_angles(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the angles (...) in radians between rotations (..., 3, 3)."""
    trace = (a * b).sum(axis=(-2, -1))
    return np.asarray(np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0)))


def local_rotations(skeleton: Skeleton, channels: FloatArray) -> FloatArray:
    """Return the rotation (F, J, 3, 3) of each joint relative to its parent."""
    world = forward_kinematics(skeleton, channels).rotations
    local = world.copy()
    above = np.swapaxes(world[:, skeleton.parents[1:]], -1, -2)
    local[:, 1:] = above @ world[:, 1:]
    return local
