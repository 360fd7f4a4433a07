"""Finding the stretches of many clips that are the motion of a query.

A hit ends where the distance of the best stretch for one of the query's templates that ends there
is lowest, the nearest hit first; of hits of a clip that overlap by more than half the better one
stays, and none is faster or slower than the query by more than two and a half times. To what the
warping costs is added what a hit turns by more or less than the query (`turning`) and what its
course costs (`course`), and the sum divided so that any stretch is 1 away. Found

*roughly*: in a sketch of the index, a third of its frames along sixteen axes, or half of these. For
each template the nearest places of the sketch's outline, the nearest of these in the sketch, and of
all the nearest in full are what is returned; or

*exactly*: what the warping of the k-th found so costs limits what can still be one of the k nearest
by warping. Distances of all frames are measured then, each only as far as it may stay within the
limit. Of these none is missed; as many again, of those found roughly, are ranked with them by what
they cost as a whole.

`search`    the hits
`Stretch`   one of them
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from mocapdb.base.arrays import BoolArray, IntArray
from mocapdb.base.thread_pool import ThreadPool
from mocapdb.errors import ClipError
from mocapdb.indexing.canonical.canonical_motion import FPS
from mocapdb.indexing.search.course import Course, course_cost
from mocapdb.indexing.search.example_query import Query, Template
from mocapdb.indexing.search.frame_store import OUTLINE_FRAMES, SKETCH_FRAMES, Frames, MotionIndex
from mocapdb.indexing.search.span_scan import Found, distances, measured, merged, minima
from mocapdb.indexing.search.turning import stretch_turn, turn_cost
from mocapdb.indexing.search.warping import backtrack
from mocapdb.indexing.tuning import (
    ANY_STRETCH,
    APART_S,
    EXACT_FRAMES,
    LEAST_LOOKED_AT,
    LOOKED_AT,
    MOST_OVERLAP,
    MOST_SPEED_RATIO,
    OUTLINE_PLACES,
    SKETCH_PLACES,
    TURN_COST,
    UNLIKE_HITS,
)
from mocapdb.motion.frame_range import FrameRange

__all__ = ["Stretch", "search"]

ROUNDING = 2e-3  # more than float32 rounds a distance by
WIDER = 1.5  # a limit that was too narrow grows by this; it changes only the time


@dataclass(frozen=True)
class Stretch(FrameRange):
    """A hit: frames ``start:end`` of a clip, at the rate of the index.

    Attributes
    ----------
    start, end : int
        Frames from the clip's first, end-exclusive.
    clip : int
        Number of the clip in the index.
    distance : float
        0 for the same motion, about 1 for any motion.
    warped : float
        What the warping alone costs, where any stretch costs 1.
    time_scale : float
        Duration of the stretch over that of the example: 2 is half as fast.
    template : int
        Which of the query's templates it fits.
    path : (n,)
        Frame of the clip that each frame of the template is matched with.
    """

    clip: int
    distance: float
    time_scale: float
    template: int
    path: IntArray = field(repr=False, compare=False)
    warped: float = 0.0


def search(
    index: MotionIndex,
    query: Query,
    *,
    k: int = 10,
    clips: BoolArray | None = None,
    max_distance: float = math.inf,
    expand: int = 0,
    exact: bool | None = None,
    unlike: Query | None = None,
    references: Sequence[float] | None = None,
    threads: int | None = None,
) -> list[Stretch]:
    """Return the k stretches nearest to a query, the nearest first.

    Parameters
    ----------
    index : MotionIndex
    query : Query
    k : int
    clips : (n,) of bool, optional
        Only search these clips.
    max_distance : float
        Leave out what is further away.
    expand : int
        Search again with the query averaged with this many of its best hits.
    exact : bool, optional
        Whether nothing may be missed; by default where the index has up to 3 million frames.
    unlike : Query, optional
        What is not meant: stretches that are nearer to one of its examples are left out. Only the
        16 k nearest are gone through, so that fewer than k may be left.
    references : sequence of float, metres, optional
        Where several indexes are searched: what a stretch taken at random from all of them costs,
        for each template of the query and then of `unlike`. All features count then, also those
        that the axes of this index leave out, and nothing is raised for want of long clips.
    threads : int, optional
        As many as there are processors by default.

    Raises
    ------
    ClipError
        If no clip of the index is as long as half the query.
    """
    if exact is None:
        exact = len(index.frames) <= EXACT_FRAMES
    chosen = np.ones(len(index), dtype=np.bool_) if clips is None else clips
    pool = ThreadPool.shared(threads or os.cpu_count() or 1)
    if references is None:
        templates = _measured(index, query.templates(index.space), pool)
        others = [] if unlike is None else _measured(index, unlike.templates(index.space), pool)
        _expect_long_clips(index, templates)
    else:
        known = iter(references)
        templates, others = (
            [
                replace(each, reference=next(known))
                for each in (own.templates(index.space, all_features=True) if own else ())
            ]
            for own in (query, unlike)
        )
    searching = _Search(index, templates, chosen, exact, pool)
    if expand and (best := searching.hits(expand, math.inf)):
        templates = [_expanded(index.frames, template, best) for template in templates]
        templates = _measured(index, templates, pool)
        searching = _Search(index, templates, chosen, exact, pool)
    if unlike is None:
        return searching.hits(k, max_distance)
    meant: list[Stretch] = []
    for n in (k, UNLIKE_HITS * k):  # most often the first k are enough
        found = searching.hits(n, max_distance)
        meant = [hit for hit in found if hit.warped < _nearest(index.frames, others, hit)]
        if len(meant) >= k or len(found) < n:
            break
    return meant[:k]


def _measured(
    index: MotionIndex, templates: Sequence[Template], pool: ThreadPool
) -> list[Template]:
    return pool.map(partial(measured, index), templates)


def _expect_long_clips(index: MotionIndex, templates: Sequence[Template]) -> None:
    """Refuse templates if no clip is as long as half of any."""
    if any(each.reference < math.inf for each in templates):
        return
    longest = int(np.diff(index.frames.starts).max(initial=0))
    raise ClipError(
        f"Expected a query that some clip is half as long as, but got "
        f"{templates[0].example_frames / FPS:.2f} s and the longest clip has "
        f"{longest / FPS:.2f} s. Choose a shorter range."
    )


class _Search:
    """A search of some clips of an index for templates."""

    def __init__(
        self,
        index: MotionIndex,
        templates: Sequence[Template],
        clips: BoolArray,
        exact: bool,
        pool: ThreadPool,
    ) -> None:
        self._index, self._clips, self._exact, self._pool = index, clips, exact, pool
        self._templates = [each for each in templates if each.reference < math.inf]
        self._courses = [Course.of(each.frames, index.space) for each in self._templates]

    def hits(self, k: int, max_distance: float) -> list[Stretch]:
        """Return the k nearest stretches within a distance."""
        furthest = ANY_STRETCH * max_distance
        rough = self._minima(self._candidates(), furthest)
        hits, reach = self._ranked(rough, k)
        everywhere = [_spans(self._index.frames.starts, self._clips)] * len(self._templates)
        limit = -1.0 if self._exact else math.inf
        while limit < min(reach, furthest):  # in a second round some overlapped better ones
            limit = min(max(reach, WIDER * limit, ROUNDING), furthest)
            hits, reach = self._ranked(_together(self._minima(everywhere, limit), rough), k)
        return [hit for hit in hits if hit.distance <= max_distance]

    def _minima(self, spans: Sequence[IntArray], limit: float) -> list[Found]:
        """Return for each template where its warping costs least, within a limit."""
        frames = self._index.frames
        return minima(frames, self._templates, spans, self._pool, limit=limit + ROUNDING)

    def _candidates(self) -> list[IntArray]:
        """Return for each template the spans around the places that are nearest in the sketch.

        The sketch may be half a query off: two performances that do not overlap are further apart.
        Places are counted for each template, so templates need not be comparable in the sketch.
        """
        frames, sketch, outline = self._index.frames, self._index.sketch, self._index.outline
        spans = [_spans(outline.starts, self._clips)] * len(self._templates)
        outlined = [template.outlined() for template in self._templates]
        found = minima(outline, outlined, spans, self._pool, most=OUTLINE_PLACES)
        spans = [
            _around(outline, rows, sketch, OUTLINE_FRAMES, 2 * OUTLINE_FRAMES) for rows, _ in found
        ]
        sketched = [template.sketched() for template in self._templates]
        found = minima(sketch, sketched, spans, self._pool, most=SKETCH_PLACES)
        n = max(map(len, self._templates)) // 2
        return [_around(sketch, rows, frames, SKETCH_FRAMES, n) for rows, _ in found]

    def _ranked(self, found: Sequence[Found], k: int) -> tuple[list[Stretch], float]:
        """Return the k nearest of the stretches that end in some frames.

        So many as `LOOKED_AT` says are compared as a whole, the nearest by warping. The second
        answer is what warping costs for the k-th of these; infinite where there are fewer.
        """
        hits: list[Stretch] = []
        places: list[Stretch] = []
        frames, most = self._index.frames, max(LOOKED_AT * k, LEAST_LOOKED_AT)
        for number, row, warped in _lowest_first(found):
            if len(hits) >= k and _kth_nearest(hits, k) <= warped / ANY_STRETCH:
                break
            hit = _stretch(frames, self._templates, number, row)
            if any(self._is_one(hit, other) for other in places):
                continue
            places.append(hit)  # what fits best at another speed is no hit at this one either
            still = self._index.space.still  # a pose has no speed
            if still or 1 / MOST_SPEED_RATIO <= hit.time_scale <= MOST_SPEED_RATIO:
                hits.append(self._as_a_whole(hit))
            if len(hits) == most:
                break
        reach = hits[k - 1].warped if len(hits) >= k else math.inf
        return sorted(hits, key=lambda hit: hit.distance)[:k], reach

    def _is_one(self, hit: Stretch, other: Stretch) -> bool:
        """Say whether two hits are one: they overlap, or the same pose is held in both."""
        if not self._index.space.still:
            return _overlap(hit, other) > MOST_OVERLAP
        return hit.clip == other.clip and abs(hit.start - other.start) < FPS * APART_S

    def _as_a_whole(self, hit: Stretch) -> Stretch:
        """Return a hit with its distance: what it turns by and its course count as well."""
        if self._index.space.still:
            return replace(hit, distance=hit.warped / ANY_STRETCH, time_scale=1.0)
        template, index = self._templates[hit.template], self._index
        turned = stretch_turn(index, hit.clip, hit.start, hit.end)
        cost = hit.warped + turn_cost(turned, template.turn, TURN_COST)
        matched = index.frames.values(hit.path + int(index.frames.starts[hit.clip]))
        cost += course_cost(self._courses[hit.template], Course.of(matched, index.space))
        return replace(hit, distance=cost / ANY_STRETCH)


def _kth_nearest(hits: Sequence[Stretch], k: int) -> float:
    """Return the distance of the k-th nearest of some hits."""
    return sorted(hit.distance for hit in hits)[k - 1]


def _together(first: Sequence[Found], second: Sequence[Found]) -> list[Found]:
    """Return what was found for each template in two searches; some of it twice."""
    return [
        (np.concatenate([a[0], b[0]]), np.concatenate([a[1], b[1]]))
        for a, b in zip(first, second, strict=True)
    ]


def _nearest(frames: Frames, templates: Sequence[Template], hit: Stretch) -> float:
    """Return the lowest distance of a template from a stretch that ends with a hit or near it.

    Near is half of the hit's length: the motion of another example may begin and end elsewhere.
    """
    first, end = (int(frames.starts[hit.clip + i]) for i in (0, 1))
    near = max(len(hit) // 2, 1)
    span = np.array([[max(first + hit.end - near, first), min(first + hit.end + near, end)]])
    known = (template for template in templates if template.reference < math.inf)
    return min((float(distances(frames, each, span).min()) for each in known), default=math.inf)


def _spans(starts: IntArray, clips: BoolArray) -> IntArray:
    """Return the ranges of frames of the chosen clips, neighbours as one."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], clips, [False]]).astype(np.int8)))
    spans = starts[edges].reshape(-1, 2)
    return np.asarray(spans[spans[:, 0] < spans[:, 1]])


def _around(coarse: Frames, rows: IntArray, fine: Frames, ratio: int, n: int) -> IntArray:
    """Return the spans of n frames to either side of where some coarser frames are."""
    clips = np.searchsorted(coarse.starts, rows, side="right") - 1
    middles = fine.starts[clips] + (rows - coarse.starts[clips]) * ratio + ratio // 2
    firsts = np.maximum(middles - n, fine.starts[clips])
    ends = np.minimum(middles + n + 1, fine.starts[clips + 1])
    return merged(np.column_stack([firsts, ends]))


def _lowest_first(found: Sequence[Found]) -> Iterator[tuple[int, int, float]]:
    """Yield templates' numbers, rows and distances, the lowest distance first.

    Only as many are sorted as are asked for.
    """
    numbers = np.repeat(np.arange(len(found)), [len(rows) for rows, _ in found])
    rows, values = (np.concatenate(parts) for parts in zip(*found, strict=True))
    done, some = 0, 256
    while done < len(rows):
        some = min(2 * some, len(rows))
        part = np.argpartition(values, some - 1)[:some]
        best = part[np.lexsort((rows[part], values[part]))]
        for i in best[done:]:
            yield int(numbers[i]), int(rows[i]), float(values[i])
        done = some


def _stretch(frames: Frames, templates: Sequence[Template], number: int, row: int) -> Stretch:
    """Return the best stretch for a template that ends with a frame of the index."""
    template = templates[number]
    clip, path, cost = aligned(frames, template, row)
    first, end = int(path[0]), int(path[-1]) + 1
    return Stretch(
        first,
        end,
        clip=clip,
        distance=cost / template.reference,
        warped=cost / template.reference,
        time_scale=(end - first) / template.example_frames,
        template=number,
        path=path,
    )


def aligned(frames: Frames, template: Template, row: int) -> tuple[int, IntArray, float]:
    """Return the clip, the frames of the clip along the best path that ends there, and its cost."""
    clip = frames.clip_of(row)
    first = max(int(frames.starts[clip]), row - 2 * len(template))
    distances = template.distances(frames.values(slice(first, row + 1)))
    path, cost = backtrack(distances, row - first)
    return clip, path + (first - int(frames.starts[clip])), cost


def _overlap(a: Stretch, b: Stretch) -> float:
    """Return the share of the shorter stretch that lies in the other."""
    return a.overlap(b) / min(len(a), len(b)) if a.clip == b.clip else 0.0


def _expanded(frames: Frames, template: Template, hits: Sequence[Stretch]) -> Template:
    """Return a template averaged with the hits, each warped to it."""
    members = [template.frames]
    for hit in hits:
        start = int(frames.starts[hit.clip])
        _, path, cost = aligned(frames, template, start + hit.end - 1)
        if math.isfinite(cost):
            members.append(frames.values(start + path))
    mean = np.asarray(np.mean(members, axis=0, dtype=np.float64), dtype=np.float32)
    return replace(template, frames=mean, left_out=None)
