"""Kernels that search a vocabulary: all of it, or the most promising blocks only.

Targets are evaluated in blocks of `warping.LANES` that start at neighbouring frames.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mocapdb.base.arrays import BoolArray, Float32Array, FloatArray, IntArray
from mocapdb.base.kernels import jit
from mocapdb.base.selection import make_heap, sift_down
from mocapdb.cleaning.neighbours import _word_warping as warping
from mocapdb.cleaning.tuning import SOURCE_FRAMES, TARGET_FRAMES

__all__ = ["search_all", "search_candidates", "search_matrix"]

RECOUNT_BLOCKS = 8  # blocks evaluated between two looks at the minima; no result depends on it
UNKNOWN = 1e30


@jit
def search_all(
    quats: Float32Array,
    source: Float32Array,
    rows: IntArray,
    n_drop: int,
    starts: IntArray,
    valid: BoolArray,
    own: int,
    targets: IntArray,
    distances: FloatArray,
    frames: FloatArray,
) -> None:
    n_context = quats.shape[2]
    n_targets = n_context - warping.LANES - TARGET_FRAMES
    n_blocks = (n_targets + warping.LANES - 1) // warping.LANES
    ring = np.empty((SOURCE_FRAMES, n_context), dtype=np.int32)
    full = np.empty((SOURCE_FRAMES, n_context), dtype=np.int32)  # minima over whole targets
    held = np.full(SOURCE_FRAMES, -1, dtype=np.int64)
    word = np.empty((SOURCE_FRAMES, n_context), dtype=np.int32)
    minima = np.empty((SOURCE_FRAMES, n_context), dtype=np.int32)
    work = np.empty((5, warping.TILE), dtype=np.float32)
    slide = np.empty(n_context, dtype=np.int32)
    bounds = np.empty(n_context, dtype=np.float32)
    block_bounds, heap = np.empty(n_blocks, dtype=np.float32), np.empty(n_blocks, dtype=np.int64)
    values = np.empty(n_blocks * warping.LANES, dtype=np.float32)
    state = np.empty((2, (TARGET_FRAMES + 1) * warping.CELL), dtype=np.int32)
    k = targets.shape[1]
    for w in range(len(starts)):
        for first in range(
            0, n_context, warping.TILE
        ):  # a tile stays in the cache for all new frames
            end = min(first + warping.TILE, n_context)
            for f in range(starts[w], starts[w] + SOURCE_FRAMES):
                slot = f % SOURCE_FRAMES
                if held[slot] != f:
                    warping.frame_distances(
                        quats, source[f], rows, n_drop, first, ring[slot, first:end], work
                    )
        for i in range(SOURCE_FRAMES):
            f = starts[w] + i
            slot = f % SOURCE_FRAMES
            if held[slot] != f:
                warping.window_minima(ring[slot], TARGET_FRAMES, full[slot], slide)
                held[slot] = f
            for t in range(n_context):  # compiles in a fraction of the time of a slice
                word[i, t] = ring[slot, t]
            reach = (warping.LONGEST_RUN + 1) * (i + 1)
            if reach < TARGET_FRAMES:  # the first rows reach only the first columns
                warping.window_minima(ring[slot], reach, minima[i], slide)
            else:
                for t in range(n_context):
                    minima[i, t] = full[slot, t]
        warping.bound_words(minima, TARGET_FRAMES, bounds)
        for block in range(n_blocks):
            least = np.float32(UNKNOWN)
            for t in range(block * warping.LANES, min(n_targets, (block + 1) * warping.LANES)):
                if valid[t] and bounds[t] < least:
                    least = bounds[t]
            block_bounds[block] = least
        make_heap(block_bounds, heap)
        values[:] = UNKNOWN
        for done in range(n_blocks):
            block = heap[0]
            heap[0] = heap[n_blocks - 1 - done]
            sift_down(block_bounds, heap, 0, n_blocks - 1 - done)
            if block_bounds[block] >= UNKNOWN:
                break
            if done % RECOUNT_BLOCKS == 0 and done > 0:
                take_minima(values, valid, starts[w], own, n_targets, targets[w], distances[w])
                if targets[w, k - 1] >= 0 and distances[w, k - 1] < block_bounds[block]:
                    break
            first = block * warping.LANES
            _align_block(word, first, first, valid, n_targets, state, values)
        take_minima(values, valid, starts[w], own, n_targets, targets[w], distances[w])
        for n in range(k):
            t = targets[w, n]
            if t >= 0:
                _trace(word[:, t : t + TARGET_FRAMES], t, frames[w, n])
        for n in range(k):
            distances[w, n] *= warping.UNIT


@jit
def search_matrix(
    matrix: Any,
    starts: IntArray,
    valid: BoolArray,
    own: int,
    targets: IntArray,
    distances: FloatArray,
    frames: FloatArray,
) -> None:
    """Fill in the neighbours by any distances of frames, given in units: every target is evaluated.

    Parameters
    ----------
    matrix : (F, T + padding) of int32
        Between the frames of source and context.
    """
    n_targets = matrix.shape[1] - warping.LANES - TARGET_FRAMES
    state = np.empty((2, (TARGET_FRAMES + 1) * warping.CELL), dtype=np.int32)
    values = np.empty(n_targets + warping.LANES, dtype=np.float32)
    k = targets.shape[1]
    for w in range(len(starts)):
        word = matrix[starts[w] : starts[w] + SOURCE_FRAMES]
        values[:] = UNKNOWN
        for first in range(0, n_targets, warping.LANES):
            _align_block(word, first, first, valid, n_targets, state, values)
        take_minima(values, valid, starts[w], own, n_targets, targets[w], distances[w])
        for n in range(k):
            t = targets[w, n]
            if t >= 0:
                _trace(word[:, t : t + TARGET_FRAMES], t, frames[w, n])
        for n in range(k):
            distances[w, n] *= warping.UNIT


@jit
def search_candidates(
    quats: Float32Array,
    source: Float32Array,
    rows: IntArray,
    n_drop: int,
    starts: IntArray,
    valid: BoolArray,
    own: int,
    chosen: IntArray,
    targets: IntArray,
    distances: FloatArray,
    frames: FloatArray,
) -> None:
    """Fill in the neighbours among blocks (W, n) that were chosen for each word; -1 is none."""
    n_context = quats.shape[2]
    n_targets = n_context - warping.LANES - TARGET_FRAMES
    n_blocks = (n_targets + warping.LANES - 1) // warping.LANES
    width = warping.LANES + TARGET_FRAMES - 1
    work = np.empty((5, warping.TILE), dtype=np.float32)
    values = np.empty(n_blocks * warping.LANES, dtype=np.float32)
    state = np.empty((2, (TARGET_FRAMES + 1) * warping.CELL), dtype=np.int32)
    near = np.empty((SOURCE_FRAMES, width), dtype=np.int32)
    pair = np.empty((SOURCE_FRAMES, TARGET_FRAMES), dtype=np.int32)
    evaluated = np.empty(n_blocks, dtype=np.bool_)
    k = targets.shape[1]
    for w in range(len(starts)):
        values[:] = UNKNOWN
        evaluated[:] = False
        for n in range(chosen.shape[1]):
            block = chosen[w, n]
            if block >= 0:
                _evaluate(block, quats, source, starts[w], rows, n_drop, valid, n_targets,
                          near, work, state, values)  # fmt: skip
                evaluated[block] = True
        for n in range(k if w > 0 else 0):  # what the word before has found goes on
            ahead = targets[w - 1, n] + starts[w] - starts[w - 1]
            if targets[w - 1, n] >= 0 and 0 <= ahead < n_targets:
                block = ahead // warping.LANES
                if not evaluated[block]:
                    _evaluate(block, quats, source, starts[w], rows, n_drop, valid, n_targets,
                              near, work, state, values)  # fmt: skip
                    evaluated[block] = True
        while True:
            take_minima(values, valid, starts[w], own, n_targets, targets[w], distances[w])
            # a minimum at the edge of what was evaluated may not be one
            block = _unknown_beside(targets[w], evaluated, valid, n_targets)
            if block < 0:
                break
            _evaluate(block, quats, source, starts[w], rows, n_drop, valid, n_targets,
                      near, work, state, values)  # fmt: skip
            evaluated[block] = True
        for n in range(k):
            t = targets[w, n]
            if t < 0:
                break
            for i in range(SOURCE_FRAMES):
                warping.frame_distances(
                    quats, source[starts[w] + i], rows, n_drop, t, pair[i], work
                )
            _trace(pair, t, frames[w, n])
        for n in range(k):
            distances[w, n] *= warping.UNIT


@jit
def _evaluate(
    block: int,
    quats: Float32Array,
    source: Float32Array,
    start: int,
    rows: IntArray,
    n_drop: int,
    valid: BoolArray,
    n_targets: int,
    near: Any,
    work: Float32Array,
    state: Any,
    values: Float32Array,
) -> None:
    """Fill in the distances between the word at a frame and the targets of a block."""
    first = block * warping.LANES
    for i in range(SOURCE_FRAMES):
        warping.frame_distances(quats, source[start + i], rows, n_drop, first, near[i], work)
    _align_block(near, 0, first, valid, n_targets, state, values)


@jit
def _align_block(
    word: Any,
    column: int,
    first: int,
    valid: BoolArray,
    n_targets: int,
    state: Any,
    values: Float32Array,
) -> None:
    """Fill in the distances of a block's targets, the first of which begins at a column."""
    lanes = np.empty(warping.LANES, dtype=np.float32)
    warping.align(word, column, TARGET_FRAMES, state, lanes)
    for lane in range(warping.LANES):
        if first + lane < n_targets and valid[first + lane]:
            values[first + lane] = lanes[lane]


@jit
def _trace(pair: Any, target: int, frames: FloatArray) -> None:
    """Fill in the context's frames that a word is matched with in a target."""
    cells = np.empty((SOURCE_FRAMES, TARGET_FRAMES, 7), dtype=np.int64)
    warping.backtrack(pair, SOURCE_FRAMES, TARGET_FRAMES, frames, cells)
    for i in range(len(frames)):
        frames[i] += target


@jit
def _unknown_beside(
    targets: IntArray, evaluated: BoolArray, valid: BoolArray, n_targets: int
) -> int:
    """Return a block next to a neighbour that was not evaluated; -1 where there is none."""
    for t in targets:
        if t < 0:
            break
        for other in (t - 1, t + 1):
            if 0 <= other < n_targets and valid[other] and not evaluated[other // warping.LANES]:
                return int(other // warping.LANES)
    return -1


@jit
def take_minima(
    values: Float32Array,
    valid: BoolArray,
    start: int,
    own: int,
    n_targets: int,
    targets: IntArray,
    distances: FloatArray,
) -> None:
    """Insert the smallest local minima into `targets` and `distances`, in units.

    The first of equal ones counts. Words whose middles are less than half a word from the
    source's own are passed over.
    """
    k = len(targets)
    targets[:] = -1
    distances[:] = np.inf
    middle = own + start + SOURCE_FRAMES / 2 - TARGET_FRAMES / 2
    for t in range(n_targets):
        value = values[t]
        if value >= UNKNOWN or value >= distances[k - 1]:
            continue
        if t > 0 and valid[t - 1] and values[t - 1] <= value:
            continue
        if t + 1 < n_targets and valid[t + 1] and values[t + 1] < value:
            continue
        if abs(t - middle) < SOURCE_FRAMES / 2:
            continue
        n = k - 1
        while n > 0 and distances[n - 1] > value:
            distances[n] = distances[n - 1]
            targets[n] = targets[n - 1]
            n -= 1
        distances[n] = value
        targets[n] = t
