"""Going over ranges of frames: the distance of the best stretch that ends at each.

`distances`   of ranges of frames
`minima`      the frames where it is lowest: what hits can end with
`measured`    templates with the cost of a random stretch

Ranges are rows of an array of spans, (m, 2): first frame, and end. They are cut and joined to
shares of equal work, which threads take one after another.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from mocapdb._typing import Float32Array, IntArray
from mocapdb.indexing.frames import Frames
from mocapdb.indexing.query import Template
from mocapdb.indexing.warping import find_minima, scan_costs

__all__ = ["distances", "measured", "merged", "minima"]

TILE_NUMBERS = 16_384
LEAST, SHARE = 16_384, 65_536
OUTWARDS = np.array([-1, 1])  # frames that tell whether those beside them are minima
SAMPLE_SPANS, SAMPLE_FRAMES = 64, 128


@dataclass(frozen=True, eq=False)
class _Wanted:
    """Templates as the kernels take them: see `mocapdb.indexing.warping.scan_costs`."""

    factors: Float32Array
    edges: IntArray
    scales: Float32Array

    @classmethod
    def of(cls, templates: Sequence[Template]) -> _Wanted:
        return cls(
            np.concatenate([template.factors for template in templates]),
            np.cumsum([0, *map(len, templates)]),
            np.array([template.scale for template in templates], dtype=np.float32),
        )

    @property
    def reach(self) -> int:
        """How many frames before its last a path can start."""
        return 2 * int(np.diff(self.edges).max())

    def distances(self, frames: Frames, spans: IntArray, limit: float) -> Float32Array:
        found = np.empty(int((spans[:, 1] - spans[:, 0]).sum()), dtype=np.float32)
        scan_costs(
            frames.codes,
            frames.starts,
            spans,
            frames.steps,
            self.factors,
            self.edges,
            self.scales,
            np.float32(limit),
            TILE_NUMBERS // len(frames.steps),
            found,
        )
        return found


def distances(frames: Frames, templates: Sequence[Template], spans: IntArray) -> Float32Array:
    """Return for each frame of some spans the distance of the best stretch that ends there."""
    return _Wanted.of(templates).distances(frames, spans, math.inf)


def minima(
    frames: Frames,
    templates: Sequence[Template],
    spans: IntArray,
    pool: ThreadPoolExecutor,
    *,
    limit: float = math.inf,
    most: int | None = None,
) -> tuple[IntArray, Float32Array]:
    """Return the frames of some spans where the distance is a local minimum, and the distances.

    Only those within the limit, and the `most` nearest of them.
    """
    wanted = _Wanted.of(templates)

    def of(share: IntArray) -> tuple[IntArray, Float32Array]:
        wider = np.clip(share + OUTWARDS, 0, len(frames))
        costs = wanted.distances(frames, wider, limit)
        rows, values = np.empty(len(costs), dtype=np.int64), np.empty_like(costs)
        n = find_minima(costs, wider, share, rows, values)
        return rows[:n], values[:n]

    shares = _shares(spans, wanted.reach)
    found = list(map(of, shares) if len(shares) == 1 else pool.map(of, shares))
    rows, values = np.concatenate([r for r, _ in found]), np.concatenate([v for _, v in found])
    if most is not None and len(values) > most:
        limit = min(limit, float(np.partition(values, most - 1)[most - 1]))
    near = values <= limit
    return rows[near], values[near]


def measured(
    frames: Frames, templates: Sequence[Template], pool: ThreadPoolExecutor
) -> list[Template]:
    """Return templates with the median of their costs over an even sample of the frames.

    It is infinite where no clip is as long as half the template.
    """
    firsts = np.linspace(0, max(len(frames) - SAMPLE_FRAMES, 0), SAMPLE_SPANS).astype(np.int64)
    spans = merged(np.column_stack([firsts, np.minimum(firsts + SAMPLE_FRAMES, len(frames))]))

    def of(template: Template) -> Template:
        costs = distances(frames, [replace(template, reference=1.0)], spans)
        finite = costs[np.isfinite(costs)]
        # where the query is part of a small index, half of the costs may be 0
        reference = max(float(np.median(finite)), 1e-6) if len(finite) else math.inf
        return replace(template, reference=reference)

    return list(pool.map(of, templates))


def merged(spans: IntArray) -> IntArray:
    """Return spans by their first frames, those that touch or overlap as one."""
    if not len(spans):
        return spans
    spans = spans[np.argsort(spans[:, 0], kind="stable")]
    ends = np.maximum.accumulate(spans[:, 1])
    is_new = np.concatenate([[True], spans[1:, 0] > ends[:-1]])
    last = np.concatenate([np.flatnonzero(is_new)[1:] - 1, [len(spans) - 1]])
    return np.column_stack([spans[is_new, 0], ends[last]])


def _shares(spans: IntArray, reach: int) -> list[IntArray]:
    """Return spans as shares of equal work; what a path can reach back to is work too."""
    lengths = spans[:, 1] - spans[:, 0]
    work = int((lengths + reach).sum())
    n_shares = 1 if work < LEAST else 2 * math.ceil(work / (2 * SHARE))  # two threads end at once
    size = math.ceil(max(work, 1) / n_shares)
    n_parts = -(-lengths // size)
    part = np.arange(n_parts.sum()) - np.repeat(np.cumsum(n_parts) - n_parts, n_parts)
    firsts = np.repeat(spans[:, 0], n_parts) + part * size
    parts = np.column_stack([firsts, np.minimum(firsts + size, np.repeat(spans[:, 1], n_parts))])
    done = np.cumsum(parts[:, 1] - parts[:, 0] + reach) - 1
    return np.split(parts, np.flatnonzero(np.diff(done // (size + reach))) + 1)
