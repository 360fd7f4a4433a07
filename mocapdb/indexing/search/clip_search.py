"""Finding whole clips that are like a clip, whatever their length and speed.

Both are brought to one number of frames and compared from beginning to end. Distances that are
averaged with those from the best hits find the others better. What is nearer to the query itself
than on average keeps its own distance, so that the same motion is 0 away: on HDM05 across actors
the mean average precision is 0.983 without averaging, 0.986 with it, and 0.987 so
(benchmarks/bench_query.py).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mocapdb.base.arrays import BoolArray, Float32Array, FloatArray, IntArray
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.search.course import Course, course_cost
from mocapdb.indexing.search.example_query import Query
from mocapdb.indexing.search.frame_store import MotionIndex
from mocapdb.indexing.search.signature import clip_signature, signature_distances
from mocapdb.indexing.search.stretch_search import Stretch
from mocapdb.indexing.search.turning import net_turn, stretch_turn, turn_cost
from mocapdb.indexing.search.warping import warp_whole
from mocapdb.indexing.tuning import (
    ANY_STRETCH,
    CLIP_FRAMES,
    EXPAND,
    EXPAND_WITHIN,
    SHORTLIST,
    WHOLE_TURN_COST,
)

__all__ = ["search_clips", "whole_costs", "whole_distances"]


def search_clips(
    index: MotionIndex,
    query: Query,
    *,
    k: int = 10,
    clips: BoolArray | None = None,
    expand: int = EXPAND,
    exact: bool = False,
    unlike: Query | None = None,
    references: Sequence[float] | None = None,
) -> list[Stretch]:
    """Return the k clips nearest to the query's examples from beginning to end, the nearest first.

    Of more than 500 clips, those 500 are compared whose mean and deviation are nearest; all of
    them if `exact`.

    Parameters
    ----------
    index : MotionIndex
    query : Query
        Several examples count by the nearest.
    k : int
    clips : (n,) of bool, optional
        Only these clips.
    expand : int
        Average the distances with those from this many of the best hits, if they are near, where
        that makes them less; 0 for none.
    exact : bool
    unlike : Query, optional
        What is not meant: clips that are nearer to one of its examples are left out.
    references : sequence of float, metres, optional
        Where several indexes are searched: what the median clip of all of them costs, for each
        performance of the query and then of `unlike`. Nothing is averaged then, and all features
        count, also those that the axes of this index leave out.

    Returns
    -------
    list of Stretch
        Whole clips; a distance of 1 is that of any clip. What a clip turns by more or less than the
        query and its course count as well.
    """
    examples = query.performances()
    lengths = np.diff(index.frames.starts)
    open_to = (lengths > 0) & (np.ones(len(index), np.bool_) if clips is None else clips)
    found = np.full((len(examples), len(index)), math.inf)
    others_examples = [] if unlike is None else unlike.performances()
    nothing: list[float | None] = [None] * len(examples + others_examples)
    known = iter(nothing if references is None else references)
    for row, example in enumerate(examples):
        found[row] = whole_distances(
            index, example, open_to, expand, exact=exact, reference=next(known)
        )
    for example in others_examples:
        others = whole_distances(index, example, open_to, expand, exact=True, reference=next(known))
        found[:, others <= found.min(axis=0)] = math.inf
    best, nearest = found.min(axis=0), found.argmin(axis=0)
    order = [int(clip) for clip in np.argsort(best, kind="stable")[:k] if math.isfinite(best[clip])]
    return [
        Stretch(
            0,
            int(lengths[clip]),
            clip=clip,
            distance=float(best[clip]),
            time_scale=float(lengths[clip]) / len(examples[nearest[clip]]),
            template=int(nearest[clip]),
            path=np.arange(lengths[clip]),
        )
        for clip in order
    ]


def whole_distances(
    index: MotionIndex,
    example: CanonicalMotion,
    clips: BoolArray,
    expand: int = EXPAND,
    *,
    exact: bool = False,
    reference: float | None = None,
) -> FloatArray:
    """Return the (n,) distances of clips from an example over their median, inf if left out.

    With a reference they are over that (see `search_clips`), and nothing is averaged.
    """
    own, candidates, others = _brought_to_length(
        index, example, clips, exact=exact, all_features=reference is not None
    )
    distances = np.full(len(index), math.inf)
    if not len(candidates):
        return distances
    lengths = np.diff(index.frames.starts)
    turns = (stretch_turn(index, clip, 0, int(lengths[clip])) for clip in candidates)
    turning = np.array([turn_cost(each, net_turn(example), WHOLE_TURN_COST) for each in turns])
    found = [_compared(index, own, others, reference)]
    if expand and reference is None and len(candidates) > expand:
        first = found[0] + turning
        near = [hit for hit in np.argsort(first, kind="stable")[:expand]
                if first[hit] <= ANY_STRETCH * EXPAND_WITHIN]  # fmt: skip
        found += [_compared(index, others[hit], others, None) for hit in near]
    nearer = np.minimum(found[0], np.mean(found, axis=0))
    distances[candidates] = (nearer + turning) / ANY_STRETCH
    return distances


def whole_costs(
    index: MotionIndex, example: CanonicalMotion, clips: BoolArray, *, exact: bool = False
) -> FloatArray:
    """Return what an example costs, in metres, against each of the clips it is compared with.

    As for `search_clips` with references.
    """
    own, _, others = _brought_to_length(index, example, clips, exact=exact, all_features=True)
    return np.array([_warped(own, other)[1] for other in others])


def _compared(
    index: MotionIndex,
    own: Float32Array,
    others: Sequence[Float32Array],
    reference: float | None,
) -> FloatArray:
    """Return what frames cost against those of others: warped, over the median, and as a whole."""
    warped = [_warped(own, other) for other in others]
    costs = np.array([cost for _, cost in warped])
    middle = float(np.median(costs)) if reference is None else reference
    axes = slice(0, index.space.n_dims)  # without what lies beside them
    courses = [
        course_cost(*(Course.of(each[rows, axes], index.space) for each, rows in zip(
            (own, other), path.T, strict=True)))
        for other, (path, _) in zip(others, warped, strict=True)
    ]  # fmt: skip
    return np.asarray(costs / max(middle, 1e-9) + courses)


def _brought_to_length(
    index: MotionIndex,
    example: CanonicalMotion,
    clips: BoolArray,
    *,
    exact: bool,
    all_features: bool,
) -> tuple[Float32Array, IntArray, list[Float32Array]]:
    """Return an example, the clips it is compared with, and these, at one number of frames."""
    frames = index.space.frames(example)
    candidates = np.flatnonzero(clips) if exact else _shortlist(index, frames, clips)
    every = [_frames(index, clip) for clip in candidates]
    if all_features:  # what lies beside the axes is one axis more
        frames, left_out = index.space.all_features(example)
        frames = np.column_stack([frames, np.sqrt(left_out)])
        every = [np.column_stack([each, np.zeros(len(each), np.float32)]) for each in every]
    return _at_length(frames), candidates, [_at_length(each) for each in every]


def _shortlist(index: MotionIndex, frames: Float32Array, clips: BoolArray) -> IntArray:
    candidates = np.flatnonzero(clips)
    if len(candidates) <= SHORTLIST:
        return candidates
    own = clip_signature(frames)[None]
    distances = signature_distances(own, index.signatures[candidates])[0]
    return candidates[np.argpartition(distances, SHORTLIST)[:SHORTLIST]]


def _frames(index: MotionIndex, clip: int) -> Float32Array:
    return index.frames.values(slice(*index.frames.starts[clip : clip + 2]))


def _at_length(frames: Float32Array) -> Float32Array:
    """Return (48, D) frames at even steps from the first to the last, interpolated linearly."""
    times = np.linspace(0, len(frames) - 1, CLIP_FRAMES)
    before = np.minimum(times.astype(np.int64), len(frames) - 1)
    after = np.minimum(before + 1, len(frames) - 1)
    share = (times - before)[:, None]
    return np.asarray(frames[before] * (1 - share) + frames[after] * share, dtype=np.float32)


def _warped(a: Float32Array, b: Float32Array) -> tuple[IntArray, float]:
    """Return which frames are matched, (n, 2), and what that costs, in metres."""
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * (a @ b.T)
    return warp_whole(np.sqrt(np.maximum(squares, 0.0)).astype(np.float32))
