"""Joints that turn over for a few frames: faults of a capture that no cycle should have."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cycles.curve.rotation_values import euler_rotations, rotation_angles
from mocapdb.cycles.tuning import IMPOSSIBLE_STEP_RAD
from mocapdb.motion.clip import Clip
from mocapdb.motion.rotations import continuous_angles

__all__ = ["BridgedClip", "bridge_flips"]


class BridgedClip(NamedTuple):
    """A clip without flips.

    Attributes
    ----------
    clip : Clip
        The clip itself where there are none.
    n_samples : int
        How many poses of a single joint were replaced.
    """

    clip: Clip
    n_samples: int


def bridge_flips(clip: Clip) -> BridgedClip:
    """Replace poses of joints that jump away and back by what lies between their neighbours.

    A joint's frames are cut wherever it turns by more than 1.5 radians in one frame. Pieces that
    are more than that away from the joint's mean rotation, as long as they are less than half of
    the frames, are faults.
    """
    skeleton = clip.skeleton
    channels = clip.channels
    n_samples = 0
    for joint, order in enumerate(skeleton.rotation_orders):
        if not order or joint == 0:
            continue
        columns = skeleton.rotation_columns(joint)
        angles = np.deg2rad(clip.channels[:, columns])
        if np.abs(np.diff(angles, axis=0)).max(initial=0.0) < IMPOSSIBLE_STEP_RAD / 3:
            continue
        bad = _flipped(order, angles)
        if not bad.any():
            continue
        if channels is clip.channels:
            channels = clip.channels.copy()
        good = np.flatnonzero(~bad)
        smooth = np.rad2deg(continuous_angles(order, angles[good]))
        channels[good[:, None], columns] = smooth
        for column, values in zip(columns, smooth.T, strict=True):
            channels[bad, column] = np.interp(np.flatnonzero(bad), good, values)
        n_samples += int(bad.sum())
    if n_samples == 0:
        return BridgedClip(clip, 0)
    step = f"bridged {n_samples} flips of single joints"
    return BridgedClip(clip.replace(channels=channels, step=step), n_samples)


def _flipped(order: str, angles: FloatArray) -> BoolArray:
    """Return (F,) where a joint is turned over."""
    rotation = euler_rotations(order, angles)
    steps = rotation_angles(rotation[1:], rotation[:-1])
    cuts = np.flatnonzero(steps > IMPOSSIBLE_STEP_RAD) + 1
    bad = np.zeros(len(angles), dtype=bool)
    if len(cuts) == 0:
        return bad
    left, _, right = np.linalg.svd(np.median(rotation, axis=0))
    far = rotation_angles(rotation, left @ right) > IMPOSSIBLE_STEP_RAD
    for piece in np.split(np.arange(len(angles)), cuts):
        bad[piece] = far[piece].mean() > 0.5
    return bad if bad.mean() < 0.5 else np.zeros_like(bad)
