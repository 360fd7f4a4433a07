"""The motion-texture: every joint's local rotation over time (Aristidou 2018, section 3.1).

Rotations are the products of the joints' own elementary rotations. Acclaim's constant axis
rotations C are left out: conjugation by a constant changes no angle between two rotations, so no
distance, neighbour or residual depends on them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.cleaning.joint_roles import Role, joint_roles
from mocapdb.cleaning.tuning import TEXTURE_FPS
from mocapdb.errors import ClipError
from mocapdb.motion.body import understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.heading import heading_angles
from mocapdb.motion.kinematics import axis_rotations
from mocapdb.motion.quaternions import continuous, from_euler_deg, slerp
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Texture", "local_rotations", "motion_texture", "sampling", "without_heading"]


@dataclass(frozen=True, eq=False)
class Texture:
    """Local rotations over time, of the joints that have rotation channels.

    Attributes
    ----------
    skeleton : Skeleton
    joints : (K,)
        Index of each row's joint in the skeleton.
    quat_xyzw : (F, K, 4)
        Unit quaternions, each in the hemisphere of the frame before.
    fps : float, frames per second
    name : str
        Name of the clip.
    roles : tuple of str
        What each row's joint is (see `joint_roles`); empty where nobody asked.
    root : int
        The joint that carries the body; -1 where nobody asked.
    """

    skeleton: Skeleton
    joints: IntArray
    quat_xyzw: FloatArray
    fps: float
    name: str
    roles: tuple[Role, ...] = ()
    root: int = -1

    def __len__(self) -> int:
        return len(self.quat_xyzw)

    @property
    def row_roles(self) -> tuple[Role, ...]:
        """K roles of joints; all are of the trunk where nobody asked."""
        if self.roles:
            return self.roles
        nobody: Role = "trunk"
        return (nobody,) * len(self.joints)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """K names of joints."""
        return tuple(self.skeleton.names[joint] for joint in self.joints)


def local_rotations(clip: Clip) -> Texture:
    """Return the texture of a clip at the clip's own rate, the root as it is.

    Raises
    ------
    ClipError
        If no joint of the skeleton rotates.
    """
    joints = _rotating(clip)
    roles = joint_roles(clip)
    return Texture(
        clip.skeleton, joints, _quats(clip.skeleton, joints, clip.channels), clip.fps, clip.name,
        tuple(roles[joint] for joint in joints),
        understand(clip.skeleton, clip.channels).root.value,
    )  # fmt: skip


def motion_texture(clip: Clip, fps: float = TEXTURE_FPS) -> Texture:
    """Return the texture that words are cut from: the body's heading removed, at a low rate.

    Frame f shows the clip at ``f / fps`` seconds, spherically interpolated, so that it can be
    mapped back to the clip's frames. A clip of a lower rate keeps its own.

    Raises
    ------
    ClipError
        If no joint of the skeleton rotates.
    """
    skeleton, joints = clip.skeleton, _rotating(clip)
    shown, first, second, between, rate = sampling(clip, fps)
    quats = _quats(skeleton, joints, clip.channels[shown])
    root = understand(skeleton, clip.channels).root.value
    row = np.flatnonzero(joints == root)
    if len(row):
        quats[:, row[0]] = without_heading(skeleton, root, quats[:, row[0]])
    sampled = slerp(quats[first], quats[second], between[:, None])
    return Texture(skeleton, joints, continuous(sampled), rate, clip.name)


class Sampling(NamedTuple):
    """Which frames of a clip show it at another rate.

    Attributes
    ----------
    shown : (S,)
        The clip's frames that are needed.
    first, second : (F,)
        Of these, the ones before and after each moment.
    between : (F,)
        How far it is from the one to the other, from 0 to 1.
    fps : float, frames per second
    """

    shown: IntArray
    first: IntArray
    second: IntArray
    between: FloatArray
    fps: float


def sampling(clip: Clip, fps: float) -> Sampling:
    """Return the frames that show a clip at a rate, or at its own if that is lower."""
    rate = min(fps, clip.fps)
    times = np.arange(int((len(clip) - 1) * rate / clip.fps + 1e-9) + 1) * (clip.fps / rate)
    before = np.minimum((times + 1e-9).astype(np.int64), len(clip) - 1)
    between = np.maximum(times - before, 0.0)
    after = np.minimum(before + (between > 1e-9), len(clip) - 1)
    shown, places = np.unique(np.concatenate([before, after]), return_inverse=True)
    first, second = np.split(places, 2)
    return Sampling(shown, first, second, between, rate)


def _rotating(clip: Clip) -> IntArray:
    """Return the joints that rotate."""
    joints = np.array(clip.skeleton.rotating_joints, dtype=np.int64)
    if len(joints) == 0:
        raise ClipError(
            f"Expected {clip.name!r} to have rotation channels, but its skeleton has none."
        )
    return joints


def _quats(skeleton: Skeleton, joints: IntArray, channels: FloatArray) -> FloatArray:
    """Return (F, K, 4) the local rotations of joints, continuous over time."""
    quats = np.empty((len(channels), len(joints), 4))
    for row, joint in enumerate(joints.tolist()):
        angles = channels[:, skeleton.rotation_columns(joint)]
        order = skeleton.rotation_orders[joint]
        quats[:, row] = from_euler_deg(order, angles)
    return continuous(quats)


def without_heading(skeleton: Skeleton, root: int, quats: FloatArray) -> FloatArray:
    """Return the rotations of the joint that carries the body, without their heading."""
    from scipy.spatial.transform import Rotation

    axes = Rotation.from_matrix(axis_rotations(skeleton)[root])
    world = axes * Rotation.from_quat(quats) * axes.inv()
    yaw = heading_angles(world.as_matrix(), skeleton.up_index)
    vertical = np.eye(3)[skeleton.up_index]
    level = Rotation.from_rotvec(-yaw[:, None] * vertical) * world
    return np.asarray((axes.inv() * level * axes).as_quat())
