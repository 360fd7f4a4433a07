"""Foot faults: a foot that slides while the body stands on it, or that goes through the floor.

Captured feet slide on purpose, so only what no purpose explains is a fault. A foot *stands* where
it is low and still. It *slides* where ball and ankle move alike, level, from where it stood, in one
go to elsewhere and in one go back. It goes through the floor, it *sinks*, where its ball or its
ankle is lower than feet ever are in the clip, and comes back. One that lands low and leaves from
there stands on lower ground. Where both feet are below the floor in one go, the body has sunk:
that is a fault of the joint that carries it. How sure it is follows from how far.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cleaning.evidence.fault_shapes import Kind
from mocapdb.cleaning.tuning import (
    ALIKE_GLIDE_SHARE,
    BESIDE_SINK_S,
    FLOOR_SHARE,
    FOOT_FAULT_SLOPE,
    FOOT_SPEED_S,
    LEAST_GLIDE_M_S,
    LEAST_SINK_M,
    LEAST_SLIDE_M,
    LEAST_STAND_S,
    LONGEST_FOOT_FAULT_S,
    MOST_GLIDE_M_S,
    MOST_RISE_M_S,
    MOST_UNEVEN_M,
    ONE_GO_SHARE,
    QUICK_GLIDE_M_S,
    RETURNED_SHARE,
    SOLE_DOWN_M,
    STANDING_M_S,
    SWINGING_M_S,
    TIMES_USUAL_SINK,
)
from mocapdb.errors import MocapdbError
from mocapdb.motion.body import understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import Leg, find_legs
from mocapdb.motion.frame_range import FrameRange, ranges_where
from mocapdb.motion.kinematics import forward_kinematics

__all__ = ["FOOT_KINDS", "FootFault", "find_foot_faults", "foot_paths"]

FOOT_KINDS: tuple[Kind, ...] = ("slide", "sink")
FRAMES_AT_ONCE = 4000  # no result depends on it


class FootFault(NamedTuple):
    """A stretch in which a foot slides or sinks.

    Attributes
    ----------
    leg : Leg
        Of the body that sinks the one that is lowest.
    joint : int
        What is wrong: the joint that turns the foot, or the one that carries the body.
    start, end : int
        Frames ``start:end``.
    kind : {"slide", "sink"}
    size_m : float, metres
        How far the foot is off at most.
    confidence : float
    """

    leg: Leg
    joint: int
    start: int
    end: int
    kind: Kind
    size_m: float
    confidence: float


class _Foot(NamedTuple):
    """Heights and speeds of a foot, in metres and seconds."""

    ball: FloatArray  # (F, 2) level
    height: FloatArray  # (F, 2) of ball and ankle
    level: FloatArray  # (F, 2, 2) velocities of ball and ankle
    rising: FloatArray  # (F, 2) vertical velocities
    low: BoolArray  # (F,) whether it is as low as where it may stand
    stands: BoolArray  # (F,)


def find_foot_faults(clip: Clip) -> list[FootFault]:
    """Return the stretches in which feet slide or sink, with how sure that is a fault.

    None of a body without legs, and none of a foot that never stands: it has no floor.
    """
    try:
        legs, paths = foot_paths(clip)
    except MocapdbError:
        return []
    feet = [foot for path in paths if (foot := _foot(path, clip.fps)) is not None]
    if len(feet) < len(legs) or not feet:
        return []
    floor = _floor(feet)
    root = understand(clip.skeleton, clip.channels).root.value
    is_below = np.array([(floor - foot.height).max(axis=1) > 0.0 for foot in feet])
    found: list[FootFault] = []
    for leg, foot in zip(legs, feet, strict=True):
        found += [
            FootFault(
                leg, leg.foot, run.start, run.end, "slide", size, _confidence(size, LEAST_SLIDE_M)
            )
            for run, size in _slides(foot, clip.fps)
        ]
        found += [
            FootFault(
                leg, root if is_below[:, run.frames].any(axis=1).sum() > 1 else leg.foot,
                run.start, run.end, "sink", size, _confidence(size, LEAST_SINK_M),
            )
            for run, size in _sinks(foot, floor, clip.fps)
        ]  # fmt: skip
    found = _of_bodies_once(found, root)
    return sorted(found, key=lambda fault: (fault.start, fault.leg))


def _of_bodies_once(found: list[FootFault], root: int) -> list[FootFault]:
    """Return faults of which those of the whole body are told once, by the foot that is lowest."""
    kept: list[FootFault] = []
    for fault in sorted(found, key=lambda fault: -fault.size_m):
        if fault.joint != root or not any(
            other.joint == root and fault.start < other.end and other.start < fault.end
            for other in kept
        ):
            kept.append(fault)
    return kept


def foot_paths(clip: Clip) -> tuple[tuple[Leg, ...], list[FloatArray]]:
    """Return the legs and, of each, (F, 2, 3) its ball and ankle in metres, the vertical last."""
    skeleton = clip.skeleton
    few = clip.channels[:: max(1, len(clip) // 48)]
    legs = find_legs(skeleton, forward_kinematics(skeleton, few).positions)
    points = [joint for leg in legs for joint in (leg.ball, leg.ankle)]
    up = skeleton.up_index
    axes = [axis for axis in range(3) if axis != up] + [up]
    unit_m = understand(skeleton, clip.channels).unit_m.value
    parts = [
        forward_kinematics(skeleton, clip.channels[first : first + FRAMES_AT_ONCE]).positions[
            :, points
        ][..., axes]
        for first in range(0, len(clip), FRAMES_AT_ONCE)
    ]
    path = np.concatenate(parts) * unit_m
    return legs, [path[:, 2 * i : 2 * i + 2] for i in range(len(legs))]


def _confidence(size_m: float, least_m: float) -> float:
    """Return how sure a foot fault of some size is one: a half at the least size that counts."""
    return float(1.0 / (1.0 + (least_m / max(size_m, 1e-9)) ** FOOT_FAULT_SLOPE))


def _foot(path: FloatArray, fps: float) -> _Foot | None:
    """Return what is to be known of a foot; None of one that never stands."""
    reach = max(1, round(FOOT_SPEED_S * fps / 2))
    n_frames = len(path)
    if n_frames <= 2 * reach:
        return None
    after = np.minimum(np.arange(n_frames) + reach, n_frames - 1)
    before = np.maximum(np.arange(n_frames) - reach, 0)
    velocity = (path[after] - path[before]) * (fps / (after - before))[:, None, None]
    height, speed = path[..., 2], np.linalg.norm(velocity, axis=-1).min(axis=1)
    low = height[:, 0] < np.quantile(height[:, 0], FLOOR_SHARE) + MOST_UNEVEN_M
    stands = low & (speed < STANDING_M_S)
    if stands.sum() < LEAST_STAND_S * fps:
        return None
    return _Foot(path[:, 0, :2], height, velocity[..., :2], velocity[..., 2], low, stands)


def _slides(foot: _Foot, fps: float) -> Iterator[tuple[FrameRange, float]]:
    """Yield stretches of a foot that slides aside in one go, and back in one, and how far it does.

    It stands before it and after it. A slow wander is what captured feet do.
    """
    speeds = np.linalg.norm(foot.level, axis=-1)
    slowest, quickest = speeds.min(axis=1), speeds.max(axis=1)
    apart = np.linalg.norm(foot.level[:, 0] - foot.level[:, 1], axis=-1)
    glides = (
        foot.low
        & (slowest > LEAST_GLIDE_M_S)
        & (quickest < MOST_GLIDE_M_S)
        & (np.abs(foot.rising).max(axis=1) < MOST_RISE_M_S)
        & (apart < ALIKE_GLIDE_SHARE * quickest)
    )
    beside = max(1, round(LEAST_STAND_S * fps / 2))
    runs = [run for run in ranges_where(glides) if slowest[run.frames].max() > QUICK_GLIDE_M_S]
    starts = [run for run in runs if foot.stands[max(0, run.start - beside) : run.start].any()]
    ends = [run for run in runs if foot.stands[run.end : run.end + beside].any()]
    done = 0
    for first in starts:
        for last in reversed(ends):
            whole = FrameRange(first.start, last.end)
            if first.start < done or len(whole) > LONGEST_FOOT_FAULT_S * fps:
                continue
            if len(whole) < LEAST_STAND_S * fps:
                break
            size = _slid(foot, whole)
            out, back = (np.ptp(foot.ball[run.frames], axis=0) for run in (first, last))
            if 0.0 < size < min(np.linalg.norm(out), np.linalg.norm(back)) / ONE_GO_SHARE:
                yield whole, size
                done = whole.end
                break


def _slid(foot: _Foot, whole: FrameRange) -> float:
    """Return how far a foot slides in a stretch, in metres; 0 where it steps or goes elsewhere."""
    heights, path = foot.height[whole.frames], foot.ball[whole.frames]
    line = np.linspace(heights[0], heights[-1], len(heights))
    if not foot.low[whole.frames].all() or np.abs(heights - line).max() > SOLE_DOWN_M:
        return 0.0
    size = float(np.linalg.norm(path - (path[0] + path[-1]) / 2.0, axis=1).max())
    return size if np.linalg.norm(path[-1] - path[0]) < RETURNED_SHARE * size else 0.0


def _floor(feet: list[_Foot]) -> FloatArray:
    """Return (2,) below which heights of ball and ankle feet hardly ever come, in metres."""
    both = np.concatenate([foot.height for foot in feet])
    low, usual = np.quantile(both, [FLOOR_SHARE, 4 * FLOOR_SHARE], axis=0)
    return np.asarray(low - TIMES_USUAL_SINK * (usual - low))


def _sinks(foot: _Foot, floor: FloatArray, fps: float) -> Iterator[tuple[FrameRange, float]]:
    """Yield stretches of a foot below its floor, from where it goes down, and how far it goes."""
    below = (floor - foot.height).max(axis=1)
    near = below > -LEAST_SINK_M / 2.0
    falls, rises = (sign * foot.rising[:, 0] > LEAST_GLIDE_M_S / 2.0 for sign in (-1.0, 1.0))
    most = round(LEAST_STAND_S * fps)
    for run in ranges_where(below > 0.0):
        size = float(below[run.frames].max())
        start, end = run.start, run.end
        while start > max(0, run.start - most) and falls[start - 1] and near[start - 1]:
            start -= 1
        while end < min(len(below), run.end + most) and rises[end] and near[end]:
            end += 1
        whole = FrameRange(start, end)
        inside = start > 0 and end < len(below) and len(whole) <= LONGEST_FOOT_FAULT_S * fps
        if inside and not _lands_and_leaves(foot, whole, fps):
            yield whole, size


def _lands_and_leaves(foot: _Foot, low: FrameRange, fps: float) -> bool:
    """Return whether a foot swings both to a stretch and from it: the ground is lower there."""
    beside = max(1, round(BESIDE_SINK_S * fps))
    speeds = np.linalg.norm(foot.level, axis=-1).min(axis=1)
    ends = speeds[max(0, low.start - beside) : low.start], speeds[low.end : low.end + beside]
    return all(float(np.median(part)) > SWINGING_M_S for part in ends)
