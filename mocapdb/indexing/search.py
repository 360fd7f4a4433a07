"""Finding the stretches of many clips that are the motion of a query.

Every stretch is compared: `mocapdb.indexing.warping` gives the cost of the best one that ends at
each frame. What ends at a local minimum of the cost is a hit, the best first; of hits of a clip
that overlap by more than half the better one stays.

A query is searched twice, as it is and at double speed, because its velocities count and the
velocities of a slow performance fit anything. Costs of the two, as of queries of any kind, become
comparable when each is divided by its median over the index: a distance of 1 is that of a stretch
taken at random, and one threshold serves every query.

`MotionIndex`    the frames of many clips
`Query`          what to look for
`search`         the hits
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

import numpy as np

from mocapdb._typing import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from mocapdb.errors import ClipError
from mocapdb.indexing.canonical import FPS, CanonicalMotion
from mocapdb.indexing.features import FeatureSpace
from mocapdb.indexing.signature import clip_signatures
from mocapdb.indexing.warping import advance, backtrack, new_state

__all__ = ["MIN_QUERY_S", "MotionIndex", "Query", "Stretch", "search"]

MIN_QUERY_S = 0.3
SPEEDS = (1.0, 2.0)

TILE = 512
SAMPLE_BLOCKS, SAMPLE_FRAMES = 64, 512
MOST_OVERLAP = 0.5


@dataclass(frozen=True, eq=False)
class MotionIndex:
    """The frames of many clips, one after another, in a space where distances mean something.

    Parameters
    ----------
    space : FeatureSpace
    frames : (N, D) float32
        May be memory-mapped.
    starts : (n + 1,)
        First frame of each clip, and N at the end.
    """

    space: FeatureSpace
    frames: Float32Array
    starts: IntArray

    @classmethod
    def of(
        cls, motions: Sequence[CanonicalMotion], space: FeatureSpace | None = None
    ) -> MotionIndex:
        """Return the index of motions held in memory; the space is fitted to them by default."""
        space = space or FeatureSpace.fit(motions)
        starts = np.zeros(len(motions) + 1, dtype=np.int64)
        np.cumsum([len(motion) for motion in motions], out=starts[1:])
        frames = np.empty((starts[-1], space.n_dims), dtype=np.float32)
        for start, motion in zip(starts, motions, strict=False):
            frames[start : start + len(motion)] = space.frames(motion)
        return cls(space, frames, starts)

    def __len__(self) -> int:
        return len(self.starts) - 1

    @property
    def n_frames(self) -> int:
        """Number of frames N of all clips."""
        return int(self.starts[-1])

    @cached_property
    def norms(self) -> Float32Array:
        """(N,) squared length of each frame."""
        return np.asarray(np.einsum("ij,ij->i", self.frames, self.frames))

    @cached_property
    def is_start(self) -> ByteArray:
        """(N,) 1 where a clip starts."""
        marks = np.zeros(self.n_frames, dtype=np.uint8)
        marks[self.starts[:-1][np.diff(self.starts) > 0]] = 1
        return marks

    @cached_property
    def sample(self) -> list[tuple[int, int]]:
        """Ranges of frames, evenly spread, that stand for all of them."""
        if self.n_frames <= SAMPLE_BLOCKS * SAMPLE_FRAMES:
            return [(0, self.n_frames)]
        firsts = np.linspace(0, self.n_frames - SAMPLE_FRAMES, SAMPLE_BLOCKS).astype(int)
        return [(int(first), int(first) + SAMPLE_FRAMES) for first in firsts]

    @cached_property
    def signatures(self) -> Float32Array:
        """(n, 2 D) mean and deviation of each clip's frames."""
        return clip_signatures(self.frames, self.starts)

    def clip_of(self, frame: int) -> int:
        """Return the clip that a frame belongs to."""
        return int(np.searchsorted(self.starts, frame, side="right")) - 1


@dataclass(frozen=True)
class Query:
    """What to look for: one motion, or several examples of it.

    Parameters
    ----------
    examples : sequence of CanonicalMotion
        At the rate of the index, `FPS`.
    mirror : bool
        Whether left and right may have changed places.

    Raises
    ------
    ClipError
        If there is no example, or one is shorter than 0.3 s.
    """

    examples: tuple[CanonicalMotion, ...]
    mirror: bool = False

    def __init__(self, examples: Iterable[CanonicalMotion], *, mirror: bool = False) -> None:
        object.__setattr__(self, "examples", tuple(examples))
        object.__setattr__(self, "mirror", mirror)
        if not self.examples:
            raise ClipError("Expected at least one example to look for, but got none.")
        for example in self.examples:
            if len(example) / example.fps < MIN_QUERY_S - 1e-9:
                raise ClipError(
                    f"Expected a query of {MIN_QUERY_S} s or more, but got "
                    f"{len(example) / example.fps:.2f} s. Choose a longer range."
                )

    def templates(self, space: FeatureSpace) -> list[Template]:
        """Return the sequences of frames that stand for the query."""
        found = []
        for example in self.examples:
            for motion in (example, example.mirrored()) if self.mirror else (example,):
                for speed in SPEEDS:
                    values = space.frames(motion.resampled(FPS, speed))
                    found.append(Template(values, len(example)))
        return found


@dataclass(frozen=True, eq=False)
class Template:
    """Frames to look for, (n, D), and the length in frames of the example that they stand for."""

    frames: Float32Array
    example_frames: int
    reference: float = 1.0

    @cached_property
    def norms(self) -> Float32Array:
        """(n,) squared length of each frame."""
        return np.asarray(np.einsum("ij,ij->i", self.frames, self.frames))

    @cached_property
    def factors(self) -> Float32Array:
        """(D, n) what frames are multiplied by for `advance`."""
        return np.ascontiguousarray(-2.0 * self.frames.T)

    def __len__(self) -> int:
        return len(self.frames)


@dataclass(frozen=True, eq=False)
class Stretch:
    """A hit: frames ``start:end`` of a clip, at the rate of the index.

    Attributes
    ----------
    clip : int
        Number of the clip in the index.
    start, end : int
        Frames from the clip's first, end-exclusive.
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
    start: int
    end: int
    distance: float
    time_scale: float
    template: int
    path: IntArray = field(repr=False)


def search(
    index: MotionIndex,
    query: Query,
    *,
    k: int = 10,
    clips: BoolArray | None = None,
    max_distance: float = math.inf,
    expand: int = 0,
    threads: int | None = None,
) -> list[Stretch]:
    """Return the k stretches nearest to a query, the nearest first. Nothing is approximated.

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
    threads : int, optional
        As many as there are processors by default.

    Raises
    ------
    ClipError
        If no clip of the index is as long as half the query.
    """
    threads = threads or os.cpu_count() or 1
    templates = query.templates(index.space)
    chosen = np.ones(len(index), dtype=np.bool_) if clips is None else clips
    hits = _search(index, templates, k, chosen, max_distance, threads)
    if expand and hits:
        best = hits[:expand]
        if len(best) < expand:
            best = _search(index, templates, expand, chosen, math.inf, threads)
        templates = [_expanded(index, template, best) for template in templates]
        hits = _search(index, templates, k, chosen, max_distance, threads)
    return hits


def _search(
    index: MotionIndex,
    templates: Sequence[Template],
    k: int,
    clips: BoolArray,
    max_distance: float,
    threads: int,
) -> list[Stretch]:
    with _one_blas_thread(), ThreadPoolExecutor(threads) as pool:
        templates = with_references(index, templates, pool)
        costs = np.full(index.n_frames, np.inf, dtype=np.float32)

        def fill(span: tuple[int, int]) -> None:
            first, end = span
            costs[first:end] = normalised_costs(index, templates, first, end)

        list(pool.map(fill, _shares(index, clips, threads)))
    return pick(index, templates, _minima(costs), k, max_distance)


def with_references(
    index: MotionIndex, templates: Sequence[Template], pool: ThreadPoolExecutor
) -> list[Template]:
    """Return the templates with the median of their costs over the index's sample."""

    def measured(template: Template) -> Template:
        costs = np.concatenate([_costs(index, template, first, end) for first, end in index.sample])
        costs = costs[np.isfinite(costs)]
        # where the query is part of a small index, half of the costs may be 0
        reference = max(float(np.median(costs)), 1e-6) if len(costs) else math.inf
        return Template(template.frames, template.example_frames, reference)

    found = list(pool.map(measured, templates))
    if all(template.reference == math.inf for template in found):
        longest = int(np.diff(index.starts).max(initial=0))
        raise ClipError(
            f"Expected a query that some clip is half as long as, but got "
            f"{templates[0].example_frames / FPS:.2f} s and the longest clip has "
            f"{longest / FPS:.2f} s. Choose a shorter range."
        )
    return found


def normalised_costs(
    index: MotionIndex, templates: Sequence[Template], first: int, end: int
) -> Float32Array:
    """Return for each frame of a range the distance of the best stretch that ends there."""
    best = np.full(end - first, np.inf, dtype=np.float32)
    for template in templates:
        if template.reference < math.inf:
            costs = _costs(index, template, first, end)
            costs /= np.float32(template.reference)
            np.minimum(best, costs, out=best)
    return best


def _costs(index: MotionIndex, template: Template, first: int, end: int) -> Float32Array:
    """Return (end - first,) costs; a path can reach back 2 n frames, so that many come before."""
    n = len(template)
    before = max(0, first - 2 * n)
    costs = np.empty(end - before, dtype=np.float32)
    state = new_state(n)
    room = np.empty((TILE, n), dtype=np.float32)
    for a in range(before, end, TILE):
        b = min(a + TILE, end)
        products = np.matmul(index.frames[a:b], template.factors, out=room[: b - a])
        advance(
            products,
            index.norms[a:b],
            template.norms,
            index.is_start[a:b],
            state,
            costs[a - before : b - before],
        )
    return costs[first - before :]


def _shares(index: MotionIndex, clips: BoolArray, threads: int) -> list[tuple[int, int]]:
    """Return the ranges of frames of the chosen clips, cut into about equal parts."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], clips, [False]]).astype(np.int8)))
    runs = [(int(index.starts[a]), int(index.starts[b])) for a, b in edges.reshape(-1, 2)]
    total = sum(end - first for first, end in runs)
    size = max(math.ceil(total / threads), TILE)
    return [
        (first, min(first + size, end)) for start, end in runs for first in range(start, end, size)
    ]


def _minima(costs: Float32Array) -> Iterator[tuple[int, float]]:
    """Yield (frame, cost) of the local minima, the lowest first.

    The first frames of a clip cost infinity, so a neighbour in another clip does no harm.
    """
    fenced = np.concatenate([[np.inf], costs, [np.inf]])
    lowest = (costs < fenced[:-2]) & (costs <= fenced[2:])
    frames = np.flatnonzero(lowest)
    values = costs[frames]
    done, some = 0, 256
    while done < len(frames):
        some = min(2 * some, len(frames))
        part = np.argpartition(values, some - 1)[:some] if some < len(frames) else slice(None)
        best = np.arange(len(frames))[part]
        best = best[np.lexsort((frames[best], values[best]))]
        for i in best[done:]:
            yield int(frames[i]), float(values[i])
        done = some


def pick(
    index: MotionIndex,
    templates: Sequence[Template],
    minima: Iterable[tuple[int, float]],
    k: int,
    max_distance: float,
) -> list[Stretch]:
    """Return the first k of the minima whose stretches do not overlap a better one by half."""
    hits: list[Stretch] = []
    for frame, cost in minima:
        if len(hits) == k or cost > max_distance or not math.isfinite(cost):
            break
        hit = _stretch(index, templates, frame)
        if not any(_overlap(hit, other) > MOST_OVERLAP for other in hits):
            hits.append(hit)
    return hits


def _stretch(index: MotionIndex, templates: Sequence[Template], frame: int) -> Stretch:
    """Return the best stretch that ends with a frame of the index."""
    found = []
    for number, template in enumerate(templates):
        clip, path, cost = _aligned(index, template, frame)
        found.append((cost / template.reference, number, clip, path))
    distance, number, clip, path = min(found, key=lambda each: each[0])
    length = int(path[-1] + 1 - path[0])
    return Stretch(
        clip,
        int(path[0]),
        int(path[-1]) + 1,
        distance,
        length / templates[number].example_frames,
        number,
        path,
    )


def _aligned(index: MotionIndex, template: Template, frame: int) -> tuple[int, IntArray, float]:
    """Return the clip, the frames of the clip along the best path that ends there, and its cost."""
    clip = index.clip_of(frame)
    first = max(int(index.starts[clip]), frame - 2 * len(template))
    distances = _distances(template.frames, index.frames[first : frame + 1])
    path = backtrack(distances, frame - first)
    if path[0] < 0:
        return clip, path, math.inf
    cost = float(distances[np.arange(len(path)), path].mean())
    return clip, path + (first - int(index.starts[clip])), cost


def _distances(a: Float32Array, b: Float32Array) -> Float32Array:
    """Return (n, m) distances of frames."""
    difference = a[:, None, :] - b[None, :, :]
    return np.asarray(np.sqrt(np.einsum("ijk,ijk->ij", difference, difference)))


def _overlap(a: Stretch, b: Stretch) -> float:
    """Return the share of the shorter stretch that lies in the other."""
    if a.clip != b.clip:
        return 0.0
    shared = min(a.end, b.end) - max(a.start, b.start)
    return shared / min(a.end - a.start, b.end - b.start)


def _expanded(index: MotionIndex, template: Template, hits: Sequence[Stretch]) -> Template:
    """Return a template averaged with the hits, each warped to it."""
    members: list[FloatArray | Float32Array] = [template.frames]
    for hit in hits:
        start = int(index.starts[hit.clip])
        _, path, cost = _aligned(index, template, start + hit.end - 1)
        if math.isfinite(cost):
            members.append(index.frames[start + path])
    mean = np.asarray(np.mean(members, axis=0, dtype=np.float64), dtype=np.float32)
    return Template(mean, template.example_frames)


def _one_blas_thread() -> Any:
    """Return a context in which a product of matrices takes one thread: ours are many already."""
    return _controller().limit(limits=1, user_api="blas")


@cache
def _controller() -> Any:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
