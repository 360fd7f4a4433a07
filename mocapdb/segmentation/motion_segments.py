"""A long take cut into motions: where each begins and ends, which repeat, which are alike."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cycles.curve.flips import bridge_flips
from mocapdb.cycles.period.periodic_ranges import PeriodicRange, periodic_ranges
from mocapdb.cycles.phase.pose_cloud import pose_cloud, principal_axes
from mocapdb.errors import ClipError
from mocapdb.motion.body import part_from_scene
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange
from mocapdb.segmentation.partition import optimal_cuts, refined_cuts
from mocapdb.segmentation.published_cuts import PUBLISHED
from mocapdb.segmentation.resemblance import differences, letter, motions_of
from mocapdb.segmentation.tuning import (
    LIKELY_LAPS,
    NEAR_RANGE_END_S,
    OUTER_LAPS,
    OUTER_S,
    POSE_AXES,
    POSE_FLOOR,
    SEGMENT_HZ,
    SHARE_PERIODIC,
    SHORTEST_S,
    VELOCITY_REACH_S,
    VELOCITY_S,
)

__all__ = ["METHODS", "CutMethod", "MotionSegment", "Segmentation", "segment_clip", "segment_poses"]

CutMethod: TypeAlias = Literal["partition", "pca", "ppca", "mixture"]
METHODS: tuple[CutMethod, ...] = get_args(CutMethod)


@dataclass(frozen=True)
class MotionSegment(FrameRange):
    """Frames ``start:end`` of one motion.

    Attributes
    ----------
    motion : str
        Its letter: segments of the same motion have the same.
    period_frames : float or None
        None where it does not repeat.
    repeats : FrameRange or None
        The frames that do, if not all.
    """

    motion: str
    period_frames: float | None
    repeats: FrameRange | None


@dataclass(frozen=True)
class Segmentation:
    """A take, cut into motions.

    Attributes
    ----------
    segments : tuple of MotionSegment
        In order; each begins where the one before ends.
    differences : (S, S)
        How much each two differ, in nats a dimension: the same motion is below
        `mocapdb.segmentation.tuning.SAME_MOTION`, or near to what is.
    path : (F, 3)
        First principal axes of the poses, to be looked at, in metres weighed by bone.
    method : str
        How it was cut, one of `METHODS`.
    """

    segments: tuple[MotionSegment, ...]
    differences: FloatArray
    path: FloatArray
    method: CutMethod


def segment_clip(clip: Clip, method: CutMethod = "partition") -> Segmentation:
    """Return the motions of a take.

    Parameters
    ----------
    clip : Clip
        Of any body. Where it goes and faces does not count.
    method : {"partition", "pca", "ppca", "mixture"}
        How it is cut: at the cuts that make the whole take likeliest, or as Barbic et al. (2004)
        do.

    Raises
    ------
    ClipError
        If the method is unknown, or the clip too short to hold a motion.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> found = segment_clip(synthetic.make_clip("sequence", seed=4, fps=30.0))
    >>> [(segment.motion, segment.period_frames is not None) for segment in found.segments]
    [('A', True), ('B', True), ('C', True)]
    """
    body, _ = part_from_scene(clip)
    mended, _ = bridge_flips(body)
    poses = pose_cloud(mended, by_bone_length=True)
    return segment_poses(poses, clip.fps, method)


def segment_poses(poses: FloatArray, fps: float, method: CutMethod = "partition") -> Segmentation:
    """Return the motions of a take of poses (F, D), such as weighed joint positions.

    Parameters
    ----------
    poses : (F, D)
        Not centred: what two of them differ by is compared with their norm.
    fps : float, frames per second
    method : str
        See `segment_clip`.

    Raises
    ------
    ClipError
        If the method is unknown, or there are too few poses.
    """
    if method not in METHODS:
        raise ClipError(f"Expected a method out of {', '.join(METHODS)}, but got {method!r}.")
    if len(poses) < SHORTEST_S * fps:
        raise ClipError(
            f"Expected {SHORTEST_S} s of motion at least, but got {len(poses) / fps:.2f} s "
            f"({len(poses)} frames). Take a longer clip."
        )
    stride = max(1, round(fps / SEGMENT_HZ))
    thinned, rate = poses[::stride], fps / stride
    floor = POSE_FLOOR * float(np.sqrt((thinned**2).sum(axis=1).mean()))
    axes = principal_axes(thinned, POSE_AXES)
    rows = np.hstack([axes, VELOCITY_S * _velocities(axes, rate)])
    whole = periodic_ranges(axes, rate)
    if method == "partition":
        cuts = optimal_cuts(rows, rate, floor, *_where_to_cut(whole, rate, len(rows)))
        cuts = refined_cuts(rows, cuts, rate, floor)
    else:
        cuts = PUBLISHED[method](axes, rate)
    bounds = [0, *cuts, len(rows)]
    ranges = [FrameRange(*pair) for pair in pairwise(bounds)]
    ranges = _joined(ranges, motions_of(differences(rows, ranges, floor)).tolist())
    apart = differences(rows, ranges, floor)
    segments = []
    for part, motion in zip(ranges, motions_of(apart).tolist(), strict=True):
        period, repeats = _period(axes, rate, part, whole)
        frames = _in_all_frames(part, stride, len(poses))
        if repeats is not None:
            repeats = _in_all_frames(repeats, stride, len(poses))
        segments.append(
            MotionSegment(
                frames.start,
                frames.end,
                letter(motion),
                None if period is None else period * stride,
                repeats,
            )
        )
    path = principal_axes(poses, 3)
    return Segmentation(tuple(segments), apart, path, method)


def _velocities(poses: FloatArray, fps: float) -> FloatArray:
    """Return (F, D) velocities a second, over `VELOCITY_REACH_S` to each side."""
    from scipy.ndimage import uniform_filter1d

    size = 2 * max(1, round(VELOCITY_REACH_S * fps)) + 1
    return np.asarray(uniform_filter1d(np.gradient(poses, axis=0) * fps, size, axis=0))


def _where_to_cut(
    ranges: list[PeriodicRange], fps: float, n_frames: int
) -> tuple[BoolArray, BoolArray]:
    """Return (F,) where a cut may be, and (F,) where it is likely.

    It may not be within a range that repeats, but for its outer laps, and is likely at its ends.
    """
    allowed, likely = np.ones(n_frames, dtype=bool), np.zeros(n_frames, dtype=bool)
    near = NEAR_RANGE_END_S * fps
    for part in ranges:
        outer = min(OUTER_LAPS * part.period_frames, OUTER_S * fps)
        allowed[int(part.start + outer) : max(0, int(np.ceil(part.end - outer)))] = False
        if len(part) < LIKELY_LAPS * part.period_frames:
            continue
        for end in (part.start, part.end):
            likely[max(0, int(end - near)) : int(end + near) + 1] = True
    return allowed, likely


def _joined(ranges: list[FrameRange], motions: list[int]) -> list[FrameRange]:
    """Return ranges, those that follow each other and are the same motion as one."""
    joined = [ranges[0]]
    for part, motion, last in zip(ranges[1:], motions[1:], motions[:-1], strict=True):
        if motion == last:
            joined[-1] = FrameRange(joined[-1].start, part.end)
        else:
            joined.append(part)
    return joined


def _period(
    poses: FloatArray, fps: float, part: FrameRange, ranges: list[PeriodicRange]
) -> tuple[float | None, FrameRange | None]:
    """Return the period of a segment, if it has one, and the frames that repeat, if not all.

    Those of the whole take count, and what repeats in the segment seen alone.
    """
    own = [
        replace(found, start=part.start + found.start, end=part.start + found.end)
        for found in periodic_ranges(poses[part.frames], fps)
    ]
    longest = max([*own, *ranges], key=part.overlap, default=None)
    if longest is None or part.overlap(longest) < SHARE_PERIODIC * len(part):
        return None, None
    inner = FrameRange(max(part.start, longest.start), min(part.end, longest.end))
    return longest.period_frames, None if len(inner) == len(part) else inner


def _in_all_frames(part: FrameRange, stride: int, n_frames: int) -> FrameRange:
    return FrameRange(part.start * stride, min(part.end * stride, n_frames))
