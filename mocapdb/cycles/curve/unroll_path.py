"""The path of a body that turns, unrolled: going round a corner becomes going straight on.

A cycle is the same wherever the body faces. Of a clip that turns, the trend of the heading is taken
out, and every step of the path is turned back by it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.tuning import UNROLLED_TURN_DEG
from mocapdb.motion.clip import Clip
from mocapdb.motion.heading import heading_angles
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.rotations import elementary

__all__ = ["UnrolledClip", "unroll_path"]


class UnrolledClip(NamedTuple):
    """A clip whose heading has no trend.

    Attributes
    ----------
    clip : Clip
        The clip itself where it goes straight.
    heading_rad : float
        Its mean heading.
    turn_rad : float
        How far a lap of the original turned: the median over its frames.
    """

    clip: Clip
    heading_rad: float
    turn_rad: float


def unroll_path(clip: Clip, period_frames: float) -> UnrolledClip:
    """Take the trend of the heading out of a clip that turns by more than 10 degrees a lap.

    Parameters
    ----------
    clip : Clip
    period_frames : float
        The trend is the mean over so many frames: what swings within a lap stays.
    """
    skeleton = clip.skeleton
    pose = forward_kinematics(skeleton, clip.channels)
    heading = heading_angles(pose.rotations[:, 0], skeleton.up_index)
    trend = _trend(heading, max(3, round(period_frames)))
    laps = max(1.0, len(clip) / period_frames)
    if np.ptp(trend) / laps < math.radians(UNROLLED_TURN_DEG):
        return UnrolledClip(clip, float(heading.mean()), 0.0)
    turn = float(np.median(np.diff(trend))) * period_frames
    back = elementary(skeleton.up_axis, trend.mean() - trend)
    rotations = back[:, None] @ pose.rotations
    path = _unrolled(pose.positions[:, 0], back, skeleton.up_index)
    around = pose.positions - pose.positions[:, :1]
    positions = path[:, None] + np.einsum("fij,fkj->fki", back, around)
    channels = channels_from_pose(skeleton, Pose(positions, rotations))
    unrolled = clip.replace(channels=channels, step="took the trend of the heading out")
    return UnrolledClip(unrolled, float(trend.mean()), turn)


def _trend(heading: FloatArray, window: int) -> FloatArray:
    """Return the mean over a window, and beyond its reach a straight line."""
    if len(heading) <= window + 2:
        frames = np.arange(len(heading))
        return np.asarray(np.polyval(np.polyfit(frames, heading, 1), frames))
    inner = np.convolve(heading, np.full(window, 1.0 / window), mode="valid")
    before = window // 2
    after = len(heading) - len(inner) - before
    reach = max(2, min(len(inner), window // 2))
    first = (inner[reach - 1] - inner[0]) / (reach - 1)
    last = (inner[-1] - inner[-reach]) / (reach - 1)
    return np.concatenate(
        [
            inner[0] - first * np.arange(before, 0, -1),
            inner,
            inner[-1] + last * np.arange(1, after + 1),
        ]
    )


def _unrolled(path: FloatArray, back: FloatArray, up_index: int) -> FloatArray:
    """Return the path (F, 3) with each step turned back by the heading at that time."""
    steps = np.einsum("fij,fj->fi", back[:-1], np.diff(path, axis=0))
    unrolled = np.vstack([path[:1], path[0] + np.cumsum(steps, axis=0)])
    unrolled[:, up_index] = path[:, up_index]
    return unrolled
