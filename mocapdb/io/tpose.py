"""Finding the T-pose that some conversions put in front of a motion."""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.io.tuning import JUMP_RATIO, LATER_STEPS, LEAST_JUMP_DEG, STORED_POSE_DEG
from mocapdb.motion.clip import Clip

__all__ = ["count_tpose_frames", "without_tpose"]


def without_tpose(clip: Clip) -> Clip:
    """Return the clip without the T-pose in front of its motion; the same clip if there is none."""
    count = count_tpose_frames(clip)
    if count == 0:
        return clip
    return clip.replace(channels=clip.channels[count:], step=f"dropped {count} T-pose frame(s)")


def count_tpose_frames(clip: Clip) -> int:
    """Return how many frames in front of a clip hold a T-pose that was put there.

    Such a pose was not captured: the root is not turned by the smallest angle, while in the next
    pose it is, and the body jumps from one to the other: the mean change of its angles is over
    half a degree, and five times the median of the 30 steps after it. The pose may be repeated,
    so the count can be more than one. What a library stored of it may be off by a degree.
    """
    angles = clip.channels[:, clip.skeleton.rotation_channels]
    root = clip.channels[:, clip.skeleton.rotation_columns(0)]
    tolerance = STORED_POSE_DEG if clip.was_coded else 0.0
    turned = np.flatnonzero(np.abs(root).max(axis=1, initial=0.0) > tolerance)
    if len(turned) == 0 or turned[0] == 0:
        return 0
    count = int(turned[0])
    steps = _step_sizes_deg(angles[count - 1 : count + 1 + LATER_STEPS])
    jump, later = steps[0], steps[1:]
    if len(later) == 0 or np.any(np.abs(angles[:count] - angles[0]) > tolerance):
        return 0
    return count if jump > max(LEAST_JUMP_DEG, JUMP_RATIO * np.median(later)) else 0


def _step_sizes_deg(angles_deg: FloatArray) -> FloatArray:
    """Return the mean change of the angles at each step, full turns apart."""
    change = np.diff(angles_deg, axis=0)
    return np.asarray(np.abs(change - 360.0 * np.round(change / 360.0)).mean(axis=1))
