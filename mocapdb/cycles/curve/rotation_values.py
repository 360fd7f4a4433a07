"""What the regression fits: numbers in radians that change smoothly whatever a joint does.

Angles do, for almost every joint. Where a joint turns all the way round, or its three Euler angles
come near the pose in which two of them are one, its rotation matrix is fitted instead and made a
rotation again: the constraint of Raunio (2014, eq. 6.4), for a sphere in place of a circle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.cycle import local_rotations
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import axis_rotations
from mocapdb.motion.rotations import continuous_angles, elementary
from mocapdb.motion.skeleton import Skeleton

__all__ = ["PoseValues", "choose_values"]

WIDEST_RAD = math.radians(270.0)
NEAR_LOCK = 0.2  # cosine of the middle angle
MATRIX_SCALE = math.sqrt(0.5)  # distances of matrices become angles, in radians


@dataclass(frozen=True)
class PoseValues:
    """How a skeleton's rotations are written as numbers.

    Attributes
    ----------
    skeleton : Skeleton
    whole : tuple of int
        Joints whose rotation is written as a matrix, 9 numbers; the others as their angles.
    """

    skeleton: Skeleton
    whole: tuple[int, ...]

    def encode(self, clip: Clip) -> FloatArray:
        """Return the numbers (F, D) of a clip's rotations, distances in radians."""
        blocks = [
            _matrices(self.skeleton, joint, clip.channels).reshape(len(clip), 9) * MATRIX_SCALE
            if joint in self.whole
            else _angles(self.skeleton, joint, clip.channels)
            for joint in self._turning
        ]
        return np.hstack(blocks)

    def decode(self, values: FloatArray) -> FloatArray:
        """Return each joint's rotation (F, J, 3, 3) relative to its parent."""
        skeleton = self.skeleton
        channels = np.zeros((len(values), skeleton.n_channels))
        matrices = {}
        at = 0
        for joint in self._turning:
            if joint in self.whole:
                matrices[joint] = values[:, at : at + 9].reshape(-1, 3, 3)
                at += 9
            else:
                columns = _columns(skeleton, joint)
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
            if joint in self.whole:
                found += [f"{name}[{i // 3},{i % 3}]" for i in range(9)]
            else:
                found += [
                    f"{name}.r{axis.lower()}" for axis in self.skeleton.rotation_orders[joint]
                ]
        return found

    @property
    def _turning(self) -> list[int]:
        return [joint for joint, order in enumerate(self.skeleton.rotation_orders) if order]


def choose_values(clip: Clip) -> PoseValues:
    """Return how to write a clip's rotations: as matrices where its angles are no good."""
    skeleton = clip.skeleton
    whole = [
        joint
        for joint, order in enumerate(skeleton.rotation_orders)
        if order and _unfit(order, _angles(skeleton, joint, clip.channels))
    ]
    return PoseValues(skeleton, tuple(whole))


def _unfit(order: str, angles: FloatArray) -> bool:
    if np.ptp(angles, axis=0).max() > WIDEST_RAD:
        return True
    return len(order) == 3 and float(np.abs(np.cos(angles[:, 1])).min()) < NEAR_LOCK


def _columns(skeleton: Skeleton, joint: int) -> list[int]:
    """Return the rotation channels of a joint, the outermost first."""
    first = int(skeleton.channel_starts[joint])
    order = skeleton.rotation_orders[joint].lower()
    return [first + skeleton.dofs[joint].index(f"r{axis}") for axis in order]


def _angles(skeleton: Skeleton, joint: int, channels: FloatArray) -> FloatArray:
    """Return the angles (F, n) of a joint in radians, continuous over time."""
    radians = np.deg2rad(channels[:, _columns(skeleton, joint)])
    if len(radians) > 1 and np.abs(np.diff(radians, axis=0)).max() < math.pi / 4:
        return radians  # already are: the search for jumps can be saved
    return continuous_angles(skeleton.rotation_orders[joint], radians)


def _matrices(skeleton: Skeleton, joint: int, channels: FloatArray) -> FloatArray:
    """Return the product (F, 3, 3) of a joint's elementary rotations."""
    rotation = np.eye(3)
    angles = _angles(skeleton, joint, channels)
    for axis, angle in zip(skeleton.rotation_orders[joint], angles.T, strict=True):
        rotation = rotation @ elementary(axis, angle)
    return np.asarray(rotation)
