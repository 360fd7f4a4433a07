"""Finding the stretches of many clips that are the motion of a query.

A hit ends where the distance of the best stretch for one of the query's templates that ends there
is lowest, the nearest hit first; of hits of a clip that overlap by more than half the better one
stays. Found

*roughly*: in a sketch of the index, a third of its frames along sixteen axes, or half of these. For
each template the nearest places of the sketch's outline, the nearest of these in the sketch, and of
all the nearest in full are what is returned; or

*exactly*: the k-th distance found so limits what can still be a hit. Distances of all frames are
measured then, each only as far as it may stay within the limit.

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
from mocapdb.indexing.search.example_query import Query, Template
from mocapdb.indexing.search.frame_store import OUTLINE_FRAMES, SKETCH_FRAMES, Frames, MotionIndex
from mocapdb.indexing.search.span_scan import Found, distances, measured, merged, minima
from mocapdb.indexing.search.warping import backtrack, frame_distances
from mocapdb.indexing.tuning import (
    EXACT_FRAMES,
    MOST_OVERLAP,
    OUTLINE_PLACES,
    SKETCH_PLACES,
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
    templates = query.templates(index.space)
    searching = _Search(index, templates, chosen, exact, pool)
    if expand and (best := searching.hits(expand, math.inf)):
        templates = [_expanded(index.frames, template, best) for template in templates]
        searching = _Search(index, templates, chosen, exact, pool)
    if unlike is None:
        return searching.hits(k, max_distance)
    others = [measured(index, template) for template in unlike.templates(index.space)]
    meant: list[Stretch] = []
    for n in (k, UNLIKE_HITS * k):  # most often the first k are enough
        found = searching.hits(n, max_distance)
        meant = [hit for hit in found if hit.distance < _nearest(index.frames, others, hit)]
        if len(meant) >= k or len(found) < n:
            break
    return meant[:k]


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
        measures = pool.map(partial(measured, index), templates)
        self._templates = [each for each in measures if each.reference < math.inf]
        if not self._templates:
            longest = int(np.diff(index.frames.starts).max(initial=0))
            raise ClipError(
                f"Expected a query that some clip is half as long as, but got "
                f"{templates[0].example_frames / FPS:.2f} s and the longest clip has "
                f"{longest / FPS:.2f} s. Choose a shorter range."
            )

    def hits(self, k: int, max_distance: float) -> list[Stretch]:
        """Return the k nearest stretches within a distance."""
        found = self._hits_within(self._candidates(), k, max_distance)
        if not self._exact:
            return found
        limit = found[-1].distance if len(found) == k else max_distance
        everywhere = [_spans(self._index.frames.starts, self._clips)] * len(self._templates)
        while True:
            found = self._hits_within(everywhere, k, limit)
            if len(found) == k or limit >= max_distance:
                return found
            # some of the first k overlapped better ones and were dropped: look further
            limit = min(WIDER * limit, max_distance)

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

    def _hits_within(self, spans: Sequence[IntArray], k: int, max_distance: float) -> list[Stretch]:
        """Return the k nearest of the stretches that end in each template's spans."""
        hits: list[Stretch] = []
        limit = max_distance + ROUNDING
        found = minima(self._index.frames, self._templates, spans, self._pool, limit=limit)
        for number, row in _lowest_first(found):
            if len(hits) == k:
                break
            hit = _stretch(self._index.frames, self._templates, number, row)
            if not any(_overlap(hit, other) > MOST_OVERLAP for other in hits):
                hits.append(hit)
        return sorted(
            (hit for hit in hits if hit.distance <= max_distance), key=lambda hit: hit.distance
        )


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


def _lowest_first(found: Sequence[Found]) -> Iterator[tuple[int, int]]:
    """Yield templates' numbers and rows, the lowest distance first.

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
            yield int(numbers[i]), int(rows[i])
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
        time_scale=(end - first) / template.example_frames,
        template=number,
        path=path,
    )


def aligned(frames: Frames, template: Template, row: int) -> tuple[int, IntArray, float]:
    """Return the clip, the frames of the clip along the best path that ends there, and its cost."""
    clip = frames.clip_of(row)
    first = max(int(frames.starts[clip]), row - 2 * len(template))
    distances = frame_distances(template.frames, frames.values(slice(first, row + 1)))
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
    return replace(template, frames=mean)
