"""Going over ranges of frames: the distance of the best stretch that ends at each.

`distances`   of ranges of frames
`minima`      the frames where it is lowest: what hits can end with
`measured`    templates with the cost of a random stretch, `reference_of` `sample_costs`

Ranges are rows of an array of spans, (m, 2): first frame, and end. They are cut and joined to
shares of equal work, which threads take one after another.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from mocapdb.base.arrays import Float32Array, FloatArray, IntArray
from mocapdb.base.thread_pool import ThreadPool
from mocapdb.indexing.search.example_query import Template
from mocapdb.indexing.search.frame_store import Frames, MotionIndex
from mocapdb.indexing.search.warping import scan
from mocapdb.indexing.tuning import SAMPLE_FRAMES, SAMPLE_SPANS

__all__ = ["distances", "measured", "merged", "minima", "reference_of", "sample_costs"]

# these change only how long a search takes
TILE_NUMBERS = 16_384  # numbers of a tile: so many stay in a core's cache
LEAST_SHARED = 100_000  # from so many entries of the recursion on, threads share the work
SHARE = 2_000_000  # entries that one thread does at a time

Found = tuple[IntArray, Float32Array]
NOTHING: Found = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.float32)


def distances(frames: Frames, template: Template, spans: IntArray) -> Float32Array:
    """Return for each frame of some spans the distance of the best stretch that ends there."""
    return _scan(frames, template, spans, np.array([math.inf], dtype=np.float32))[1]


def minima(
    frames: Frames,
    templates: Sequence[Template],
    spans: Sequence[IntArray],
    pool: ThreadPool,
    *,
    limit: float = math.inf,
    most: int | None = None,
) -> list[Found]:
    """Return for each template the frames of its spans where the distance is a local minimum.

    Only those within the limit, and the `most` nearest of them.
    """
    limits = np.full((len(templates), 1), limit, dtype=np.float32)
    shares = [
        (number, share)
        for number, template in enumerate(templates)
        for share in _shares(spans[number], len(template))
    ]

    def of(numbered: tuple[int, IntArray]) -> Found:
        number, share = numbered
        return _scan(frames, templates[number], share, limits[number], True, most)

    parts: list[list[Found]] = [[NOTHING] for _ in templates]
    for (number, _), part in zip(shares, pool.map(of, shares), strict=True):
        parts[number].append(part)
    return [_lowest(own, most) for own in parts]


def _lowest(parts: Sequence[Found], most: int | None) -> Found:
    """Return what was found in parts as one, only the `most` nearest."""
    rows, values = (np.concatenate(each) for each in zip(*parts, strict=True))
    if most is None or len(values) <= most:
        return rows, values
    near = values <= np.partition(values, most - 1)[most - 1]
    return rows[near], values[near]


def measured(index: MotionIndex, template: Template) -> Template:
    """Return a template with the median of its costs over an even sample of the frames.

    It is infinite where no clip is as long as half the template.
    """
    return replace(template, reference=reference_of(sample_costs(index, template)))


def reference_of(costs: FloatArray, weights: FloatArray | None = None) -> float:
    """Return the cost of a stretch taken at random: the median of those of a sample.

    Parameters
    ----------
    costs : (n,)
    weights : (n,), optional
        How much each counts, where samples of several indexes are put together.
    """
    if not len(costs):
        return math.inf
    if weights is None:
        middle = float(np.median(costs))
    else:
        order = np.argsort(costs, kind="stable")
        upto = np.cumsum(weights[order])
        middle = float(costs[order[np.searchsorted(upto, upto[-1] / 2)]])
    # where the query is part of a small index, half of the costs may be 0
    return max(middle, 1e-6)


def sample_costs(index: MotionIndex, template: Template) -> FloatArray:
    """Return the costs of a template, in metres, over an even sample of the frames.

    Clips that lie out of all proportion are no part of it: what is usual does not depend on them.
    Nor are frames with which no stretch of half the template ends.
    """
    frames = index.frames
    lengths = np.diff(frames.starts)
    usual = index.usual if index.usual.any() else ~index.usual
    rows = np.flatnonzero(np.repeat(usual, lengths))
    firsts = np.linspace(0, max(len(rows) - SAMPLE_FRAMES, 0), SAMPLE_SPANS).astype(np.int64)
    spans = _on_rows(
        merged(np.column_stack([firsts, np.minimum(firsts + SAMPLE_FRAMES, len(rows))])), rows
    )
    costs = distances(frames, replace(template, reference=1.0), spans)
    return np.asarray(costs[np.isfinite(costs)], dtype=np.float64)


def _on_rows(spans: IntArray, rows: IntArray) -> IntArray:
    """Return spans of a choice of rows as spans of all rows, cut where rows are left out."""
    if not len(rows) or len(rows) == rows[-1] + 1:
        return spans
    cuts = np.flatnonzero(np.diff(rows) > 1) + 1
    parts = []
    for start, end in spans:
        edges = [start, *cuts[(cuts > start) & (cuts < end)], end]
        parts += [(rows[a], rows[b - 1] + 1) for a, b in pairwise(edges)]
    return np.array(parts, dtype=np.int64).reshape(-1, 2)


def _scan(
    frames: Frames,
    template: Template,
    spans: IntArray,
    limit: Float32Array,
    only_minima: bool = False,
    most: int | None = None,
) -> Found:
    fours = frames.codes.view(np.int32)
    fours.flags.writeable = False  # as those of a mapped file: one type, compiled once
    return scan(
        fours,
        frames.starts,
        spans,
        frames.steps,
        template.factors,
        template.scale,
        limit,
        only_minima,
        len(frames) + 1 if most is None else most,
        TILE_NUMBERS // len(frames.steps),
    )


def merged(spans: IntArray) -> IntArray:
    """Return spans by their first frames, those that touch or overlap as one."""
    if not len(spans):
        return spans
    spans = spans[np.argsort(spans[:, 0], kind="stable")]
    ends = np.maximum.accumulate(spans[:, 1])
    is_new = np.concatenate([[True], spans[1:, 0] > ends[:-1]])
    last = np.concatenate([np.flatnonzero(is_new)[1:] - 1, [len(spans) - 1]])
    return np.column_stack([spans[is_new, 0], ends[last]])


def _shares(spans: IntArray, n: int) -> list[IntArray]:
    """Return spans as shares of equal work for a template of n frames.

    The frames before a span from which a path may come count as work, too.
    """
    if not len(spans):
        return []
    lengths, reach = spans[:, 1] - spans[:, 0], 2 * n
    work = int((lengths + reach).sum())
    n_shares = (
        1 if work * n < LEAST_SHARED else 2 * math.ceil(work * n / (2 * SHARE))
    )  # an even number, for two threads
    size = math.ceil(work / n_shares)
    n_parts = -(-lengths // size)
    part = np.arange(n_parts.sum()) - np.repeat(np.cumsum(n_parts) - n_parts, n_parts)
    firsts = np.repeat(spans[:, 0], n_parts) + part * size
    parts = np.column_stack([firsts, np.minimum(firsts + size, np.repeat(spans[:, 1], n_parts))])
    done = np.cumsum(parts[:, 1] - parts[:, 0] + reach) - 1
    return np.split(parts, np.flatnonzero(np.diff(done // (size + reach))) + 1)
