"""Going over ranges of frames: the distance of the best stretch that ends at each.

`minima`         the frames where it is lowest: what hits can end with
`lower_bounds`   less than it, in less time, for blocks of frames
`measured`       templates with the cost of a random stretch

Ranges are rows of an array of spans, (m, 2): first frame, and end. They are cut and joined to
pieces of equal work, which threads take one after another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from mocapdb._typing import BoolArray, ByteArray, Float32Array, IntArray
from mocapdb.indexing.frames import Codes, Frames
from mocapdb.indexing.query import Template
from mocapdb.indexing.warping import scan_bounds, scan_costs

__all__ = ["distances", "lower_bounds", "measured", "merged", "minima"]

TILE_CELLS, SMALLEST_TILE = 32_768, 64
PIECE = 4_096, 16_384
BLOCK = 64
SAMPLE_SPANS, SAMPLE_FRAMES = 64, 128

Result = TypeVar("Result")


def minima(
    frames: Frames, templates: Sequence[Template], spans: IntArray, pool: ThreadPoolExecutor
) -> tuple[IntArray, Float32Array]:
    """Return the frames of some spans where the distance is a local minimum, and the distances."""
    wanted = _Wanted.of(templates, frames.steps)

    def of(piece: Piece) -> tuple[IntArray, Float32Array]:
        found = piece.distances(wanted).min(axis=0)
        lowest = piece.is_asked & np.isfinite(found)
        lowest[1:] &= found[1:] < found[:-1]
        lowest[:-1] &= found[:-1] <= found[1:]
        return piece.rows[lowest], found[lowest]

    return _both(_over(frames, spans, wanted.reach, pool, of))


def lower_bounds(
    frames: Frames,
    templates: Sequence[Template],
    spans: IntArray,
    n_axes: int,
    pool: ThreadPoolExecutor,
) -> tuple[IntArray, Float32Array]:
    """Return blocks of at most 64 frames of some spans, and what no distance in each falls below.

    It is found from pairs of frames (`mocapdb.indexing.warping`), and along the first axes: no path
    costs more along some than along all.
    """
    wanted = _Wanted.of(templates, frames.steps[:n_axes])

    def of(piece: Piece) -> tuple[IntArray, Float32Array]:
        is_asked = np.concatenate([[False], piece.is_asked, [False]])
        runs = np.flatnonzero(is_asked[1:] != is_asked[:-1]).reshape(-1, 2)
        firsts, ends = _cut(runs, BLOCK).T
        blocks = np.column_stack([piece.rows[firsts], piece.rows[ends - 1] + 1])
        # what follows a run's last block counts for it too, which can only lower its bound
        return blocks, np.minimum.reduceat(piece.bounds(wanted), firsts)

    return _both(_over(frames, spans, wanted.reach, pool, of))


def measured(
    frames: Frames, templates: Sequence[Template], pool: ThreadPoolExecutor
) -> list[Template]:
    """Return templates with the median of their costs over an even sample of the frames.

    It is infinite where no clip is as long as half the template.
    """
    firsts = np.linspace(0, max(len(frames) - SAMPLE_FRAMES, 0), SAMPLE_SPANS).astype(np.int64)
    spans = merged(np.column_stack([firsts, np.minimum(firsts + SAMPLE_FRAMES, len(frames))]))
    wanted = _Wanted.of([replace(each, reference=1.0) for each in templates], frames.steps)

    def of(piece: Piece) -> Float32Array:
        return piece.distances(wanted)[:, piece.is_asked]

    found = []
    all_costs = np.concatenate(_over(frames, spans, wanted.reach, pool, of), axis=1)
    for template, costs in zip(templates, all_costs, strict=True):
        finite = costs[np.isfinite(costs)]
        # where the query is part of a small index, half of the costs may be 0
        reference = max(float(np.median(finite)), 1e-6) if len(finite) else np.inf
        found.append(replace(template, reference=reference))
    return found


def distances(frames: Frames, templates: Sequence[Template], first: int, end: int) -> Float32Array:
    """Return for each frame of a range the distance of the best stretch that ends there."""
    wanted = _Wanted.of(templates, frames.steps)
    piece = _piece(frames, np.array([[first, end]]), wanted.reach)
    return np.asarray(piece.distances(wanted)[:, piece.is_asked].min(axis=0))


def merged(spans: IntArray) -> IntArray:
    """Return spans by their first frames, those that touch or overlap as one."""
    if not len(spans):
        return spans
    spans = spans[np.argsort(spans[:, 0], kind="stable")]
    ends = np.maximum.accumulate(spans[:, 1])
    is_new = np.concatenate([[True], spans[1:, 0] > ends[:-1]])
    last = np.concatenate([np.flatnonzero(is_new)[1:] - 1, [len(spans) - 1]])
    return np.column_stack([spans[is_new, 0], ends[last]])


# -- pieces ----------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Piece:
    """Frames to go over at once: those asked for, and around them what their distances need.

    Attributes
    ----------
    codes : (F, D) int8
    is_start : (F,)
        1 where no path may come from the frame before.
    rows : (F,)
        Which frames of all they are.
    is_asked : (F,)
    """

    codes: Codes
    is_start: ByteArray
    rows: IntArray
    is_asked: BoolArray

    def distances(self, wanted: _Wanted) -> Float32Array:
        """Return (K, F) the distance of the stretch best for each of K templates."""
        one_back = np.where(self.is_start, np.float32(np.inf), np.float32(0.0))
        two_back = one_back.copy()
        two_back[1:] += one_back[:-1]
        found = np.full((len(wanted.scales), len(self.codes)), np.inf, dtype=np.float32)
        scan_costs(
            self.codes,
            wanted.steps,
            one_back,
            two_back,
            wanted.factors,
            wanted.edges,
            wanted.scales,
            wanted.tile,
            found,
        )
        return found

    def bounds(self, wanted: _Wanted) -> Float32Array:
        """Return (F,) what no distance falls below, the same for both frames of a pair."""
        n_pairs = -(-len(self.codes) // 2)
        found = np.full((len(wanted.scales), n_pairs), np.inf, dtype=np.float32)
        scan_bounds(
            self.codes,
            wanted.steps,
            wanted.factors,
            wanted.edges,
            wanted.scales,
            wanted.tile,
            found,
        )
        return np.repeat(found.min(axis=0), 2)[: len(self.codes)]


@dataclass(frozen=True, eq=False)
class _Wanted:
    """Templates as the kernels take them: see `mocapdb.indexing.warping.scan_costs`."""

    steps: Float32Array
    factors: Float32Array
    edges: IntArray
    scales: Float32Array

    @classmethod
    def of(cls, templates: Sequence[Template], steps: Float32Array) -> _Wanted:
        """Take the axes of some steps only."""
        return cls(
            steps,
            np.concatenate([template.factors(len(steps)) for template in templates]),
            np.cumsum([0, *map(len, templates)]),
            np.array([template.scale for template in templates], dtype=np.float32),
        )

    @property
    def reach(self) -> int:
        """How many frames before its last a path can start."""
        return 2 * int(np.diff(self.edges).max())

    @property
    def tile(self) -> int:
        """Frames to go over in one go, so that their distances stay in a core's cache."""
        return max(TILE_CELLS // len(self.factors), SMALLEST_TILE)


def _over(
    frames: Frames,
    spans: IntArray,
    reach: int,
    pool: ThreadPoolExecutor,
    of: Callable[[Piece], Result],
) -> list[Result]:
    """Return what a function makes of the pieces of some spans, in order."""
    n_frames = int((spans[:, 1] - spans[:, 0] + reach).sum())
    size = int(np.clip(n_frames // 4, *PIECE))
    parts = _cut(spans, size)
    done = np.cumsum(parts[:, 1] - parts[:, 0] + reach) - 1
    groups = np.split(parts, np.flatnonzero(np.diff(done // (size + reach))) + 1)
    return list(pool.map(lambda group: of(_piece(frames, group, reach)), groups))


def _cut(spans: IntArray, size: int) -> IntArray:
    """Return spans cut into parts of a size, but for the last of each."""
    n_parts = -(-(spans[:, 1] - spans[:, 0]) // size)
    part = np.arange(n_parts.sum()) - np.repeat(np.cumsum(n_parts) - n_parts, n_parts)
    firsts = np.repeat(spans[:, 0], n_parts) + part * size
    return np.column_stack([firsts, np.minimum(firsts + size, np.repeat(spans[:, 1], n_parts))])


def _piece(frames: Frames, spans: IntArray, reach: int) -> Piece:
    """Return spans with as many frames before each as a path reaches back, and one after."""
    firsts = np.maximum(spans[:, 0] - reach, 0)
    ends = np.minimum(spans[:, 1] + 1, len(frames))
    if len(spans) == 1:  # no need for a copy
        rows = np.arange(firsts[0], ends[0])
        own: slice | IntArray = slice(int(firsts[0]), int(ends[0]))
        is_start = frames.is_start[own]
        is_asked = np.zeros(len(rows), dtype=np.bool_)
        is_asked[spans[0, 0] - firsts[0] : spans[0, 1] - firsts[0]] = True
    else:
        lengths = ends - firsts
        places = np.cumsum(lengths) - lengths
        own = rows = np.arange(lengths.sum()) + np.repeat(firsts - places, lengths)
        is_start = frames.is_start[rows]
        is_start[places] = 1
        is_asked = (rows >= np.repeat(spans[:, 0], lengths)) & (
            rows < np.repeat(spans[:, 1], lengths)
        )
    return Piece(frames.codes[own], is_start, rows, is_asked)


def _both(
    results: Sequence[tuple[IntArray, Float32Array]],
) -> tuple[IntArray, Float32Array]:
    return np.concatenate([r for r, _ in results]), np.concatenate([v for _, v in results])
