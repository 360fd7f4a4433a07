"""Motion that stops and goes on: laps by circular coordinates, which know nothing of time.

Autocorrelation compares poses some time apart, and a rest within a lap moves all that follows. A
circular coordinate of the pose (Vejdemo-Johansson et al. 2015, section 4.2) stands still while the
body does; how long a part of a lap takes is told by the quicker of the times that it is passed.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.cycles.phase.circular_coordinates import Topology, find_coordinates
from mocapdb.cycles.phase.laps import unwrapped
from mocapdb.cycles.phase.timing import Timing
from mocapdb.cycles.tuning import (
    COORDINATE_REACH_S,
    LAP_PARTS,
    LEAST_LAPS_OF_RANGE,
    LEAST_REST_S,
    MOST_BACKTRACKING,
    REST_REACH_S,
    RESTING_SPEED,
    USUAL_PASS,
)
from mocapdb.errors import NoPeriodError
from mocapdb.motion.frame_range import ranges_where

__all__ = ["StopAndGo", "find_rests", "time_stop_and_go"]


class StopAndGo(NamedTuple):
    """The phase of every frame, and the loop that tells it."""

    timing: Timing
    topology: Topology


def find_rests(cloud: FloatArray, fps: float) -> BoolArray:
    """Return (F,) where the body rests within a motion, not at its ends.

    Parameters
    ----------
    cloud : (F, D)
        Poses, such as joint positions seen from the root.
    fps : float, frames per second
    """
    from scipy.ndimage import uniform_filter1d

    size = 2 * max(1, round(REST_REACH_S * fps)) + 1
    smooth = uniform_filter1d(cloud, size, axis=0, mode="nearest")
    speed = np.linalg.norm(np.gradient(smooth, axis=0), axis=1)
    slow = speed < RESTING_SPEED * np.quantile(speed, 0.75)
    rests = np.zeros(len(cloud), dtype=bool)
    for part in ranges_where(slow):
        inside = part.start > 0 and part.end < len(cloud)
        if inside and len(part) >= LEAST_REST_S * fps:
            rests[part.frames] = True
    return rests


def time_stop_and_go(cloud: FloatArray, fps: float) -> StopAndGo | None:
    """Return the phase of a motion that stops and goes on, and its loop; None where it is none.

    Parameters
    ----------
    cloud : (F, D)
        Poses.
    fps : float, frames per second

    Notes
    -----
    The loop is looked for among poses that move, without delays: they would tell the same pose
    apart by whether a rest follows. A coordinate that often goes back is no lap's.
    """
    rests = find_rests(cloud, fps)
    if not rests.any():
        return None
    moving = np.flatnonzero(~rests)
    try:
        found = find_coordinates(cloud[moving], len(moving) / 2, fps, delays=0)
    except NoPeriodError:
        return None
    laps = _in_all_frames(unwrapped(found.coordinates), moving, len(cloud), fps)
    if found.backtracking > MOST_BACKTRACKING or laps[-1] - laps[0] < LEAST_LAPS_OF_RANGE:
        return None
    phase, period = _by_usual_lap(laps)
    return StopAndGo(Timing("whole-laps", phase, period), replace(found, period_frames=period))


def _in_all_frames(laps: FloatArray, moving: IntArray, n_frames: int, fps: float) -> FloatArray:
    """Return laps (n_frames,) that stand still in rests, without what jitters in them."""
    from scipy.ndimage import gaussian_filter1d

    smooth = gaussian_filter1d(laps, COORDINATE_REACH_S * fps, mode="nearest")
    whole = np.interp(np.arange(n_frames), moving, smooth)
    steady = np.maximum.accumulate(whole)
    return np.asarray(steady + 1e-9 * np.arange(n_frames))


def _by_usual_lap(laps: FloatArray) -> tuple[FloatArray, float]:
    """Return (F,) the phase by a clock on which each part of a lap takes as long as usual.

    And the frames of that lap.
    """
    parts = np.linspace(0.0, 1.0, LAP_PARTS + 1)
    passes = np.arange(np.floor(laps[0]), np.ceil(laps[-1]))
    edges = passes[:, None] + parts
    inside = (edges >= laps[0]) & (edges <= laps[-1])
    frames = np.where(inside, np.interp(edges, laps, np.arange(len(laps))), np.nan)
    spent = np.diff(frames, axis=1)
    usual = np.nanquantile(spent, USUAL_PASS, axis=0)
    # nothing between two passes: the longer one may be a rest's
    few = np.isfinite(spent).sum(axis=0) < 3
    usual[few] = np.nanmin(spent[:, few], axis=0)
    clock = np.concatenate([[0.0], np.cumsum(usual)]) / usual.sum()
    whole = np.floor(laps)
    return np.asarray(whole + np.interp(laps - whole, parts, clock)), float(usual.sum())
