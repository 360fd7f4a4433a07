"""A clip on the canonical body, at one frame rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import ClipError
from mocapdb.indexing.canonical.canonical_body import (
    JOINTS,
    LENGTHS_M,
    MIRRORED,
    PARENTS,
    find_bones,
)
from mocapdb.indexing.tuning import FPS
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics, to_metres

__all__ = ["FPS", "CanonicalMotion", "canonical_motion", "turned"]

LEFT_HIP = JOINTS.index("left_hip")
RIGHT_HIP = JOINTS.index("right_hip")
LEG = [JOINTS.index(joint) for joint in ("left_knee", "left_ankle", "right_knee", "right_ankle")]
TINY = 1e-9  # no length is divided by less


@dataclass(frozen=True)
class CanonicalMotion:
    """Frames of the canonical body.

    Attributes
    ----------
    pose : (F, 18, 3), metres
        Joint positions from the middle of the hips, Y up, turned so that the line of the hips
        has no part along Z: the body looks along Z.
    root : (F, 3), metres
        Where the middle of the hips is in the world, scaled as the legs are.
    yaw : (F,) radians
        Heading that was taken out of the pose, continuous.
    fps : float, frames per second
    """

    pose: FloatArray
    root: FloatArray
    yaw: FloatArray
    fps: float

    def __len__(self) -> int:
        return len(self.pose)

    def part(self, frames: slice) -> CanonicalMotion:
        """Return a range of its frames."""
        return CanonicalMotion(self.pose[frames], self.root[frames], self.yaw[frames], self.fps)

    def mirrored(self) -> CanonicalMotion:
        """Return the motion as a mirror shows it: left and right have changed places."""
        flip = np.array([-1.0, 1.0, 1.0])
        return CanonicalMotion(self.pose[:, MIRRORED] * flip, self.root * flip, -self.yaw, self.fps)

    def resampled(self, fps: float, speed: float = 1.0) -> CanonicalMotion:
        """Return the motion at another rate and, if wished, `speed` times as fast.

        Between frames, positions go along straight lines.
        """
        step = self.fps / fps * speed
        if step == 1.0:
            return self
        times: FloatArray = step * np.arange(int((len(self) - 1) / step + 1e-6) + 1.0)
        return CanonicalMotion(
            _between(self.pose, times), _between(self.root, times), _between(self.yaw, times), fps
        )


def canonical_motion(clip: Clip, fps: float | None = FPS) -> CanonicalMotion:
    """Return a clip on the canonical body.

    Parameters
    ----------
    clip : Clip
        Of any skeleton that can be mapped.
    fps : float, optional, frames per second
        The clip's own rate if None.

    Raises
    ------
    SkeletonError
        If the skeleton cannot be mapped.
    """
    bones = find_bones(clip.skeleton, clip.channels)
    world = to_metres(clip.skeleton, forward_kinematics(clip.skeleton, clip.channels).positions)
    spans = world[:, bones.heads] - world[:, bones.tails]
    lengths = np.linalg.norm(spans, axis=2, keepdims=True)
    steps = spans / np.maximum(lengths, TINY) * LENGTHS_M[:, None]
    pose = np.zeros_like(steps)
    for joint, parent in enumerate(PARENTS[1:], start=1):
        pose[:, joint] = pose[:, parent] + steps[:, joint]

    hips = world[:, bones.heads[[LEFT_HIP, RIGHT_HIP]]].mean(axis=1)
    legs_m = float(lengths[0, LEG].sum())
    if legs_m < TINY:
        raise ClipError(f"Expected legs of some length, but {clip.name!r} has none.")
    yaw = _hip_yaw(pose[:, LEFT_HIP] - pose[:, RIGHT_HIP])
    motion = CanonicalMotion(
        turned(pose, -yaw), hips * (LENGTHS_M[LEG].sum() / legs_m), yaw, clip.fps
    )
    return motion if fps is None else motion.resampled(fps)


def _hip_yaw(across: FloatArray) -> FloatArray:
    """Return (F,) the angle about Y that turns x to the line from the right hip to the left."""
    return np.asarray(np.unwrap(np.arctan2(-across[:, 2], across[:, 0])))


def turned(positions: FloatArray, yaw: FloatArray) -> FloatArray:
    """Return positions (F, ..., 3) turned about Y by (F,) radians."""
    shape = (-1,) + (1,) * (positions.ndim - 2)
    cos, sin = np.cos(yaw).reshape(shape), np.sin(yaw).reshape(shape)
    x, y, z = np.moveaxis(positions, -1, 0)
    return np.stack([cos * x + sin * z, y, cos * z - sin * x], axis=-1)


def _between(values: FloatArray, times: FloatArray) -> FloatArray:
    """Return values (F, ...) at times given in frames."""
    before = np.minimum(times.astype(np.int64), len(values) - 1)
    after = np.minimum(before + 1, len(values) - 1)
    share = (times - before).reshape((-1,) + (1,) * (values.ndim - 1))
    return np.asarray(values[before] * (1 - share) + values[after] * share)
