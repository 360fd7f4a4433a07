"""Sub-sequence dynamic time warping: a query against every stretch of a library at once.

A path takes the steps (1, 1), (1, 2) and (2, 1) in (query, library) frames, so the stretch goes
half to twice as fast as the query. Every query frame is charged once, its distance to the library
frame that it is matched with, so costs do not depend on speed::

    C(i, j) = d(i, j) + min(C(i-1, j-1), C(i-1, j-2), C(i-2, j-1) + d(i-1, j))

with C(-1, j) = 0, for a stretch may start anywhere, and C(-2, j) infinite. A stretch never leaves
its clip. The cost of library frame j is C(n-1, j) / n, that of the best stretch that *ends* there.
No entry needs another of its own row, so a row, a query frame against a tile of the library, is a
loop that becomes vector instructions.

``scan_costs``   the costs of all frames, for several queries
``widen``        frames from bytes, ready for the product that gives their distances
``lower_costs``  the recursion over a tile of library frames, carried on from the tile before

And what no cost falls below, for half the work: two library frames are both at least as far from a
query frame as their middle is, less half their distance. A path goes from pair to pair, or stays::

    B(i, p) = max(0, |q_i - middle_p| - half_p) + min(B(i-1, p), B(i-1, p-1))

``scan_bounds``   the bounds of all pairs, for several queries
``widen_pairs``   middles and half distances of pairs of frames
``bound_costs``   this recursion, likewise

Of single stretches and clips:

``frame_distances``  of the frames of two motions
``backtrack``    which frames a stretch was matched with
``whole_cost``   two motions from beginning to end
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocapdb._jit import jit, jit_sums
from mocapdb._typing import Float32Array, IntArray

__all__ = [
    "backtrack",
    "bound_costs",
    "frame_distances",
    "lower_costs",
    "scan_bounds",
    "scan_costs",
    "whole_cost",
    "widen",
    "widen_pairs",
]


@jit_sums
def widen(codes: NDArray[np.int8], steps: Float32Array, tile: Float32Array) -> None:
    """Turn frames into what gives squared distances when multiplied by ``[-2 q, 1, |q|^2]``.

    Parameters
    ----------
    codes : (T, D)
        Or more columns, of which the first D count.
    steps : (D,)
        What a step of each axis stands for.
    tile : (T, D + 2)
        Filled with the frame f, ``|f|^2`` and 1.
    """
    n_axes = len(steps)
    for j in range(len(tile)):
        norm = np.float32(0.0)
        for axis in range(n_axes):
            value = codes[j, axis] * steps[axis]
            tile[j, axis] = value
            norm += value * value
        tile[j, n_axes] = norm
        tile[j, n_axes + 1] = np.float32(1.0)


@jit
def lower_costs(
    squares: Float32Array,
    one_back: Float32Array,
    two_back: Float32Array,
    state: Float32Array,
    scale: np.float32,
    costs: Float32Array,
) -> None:
    """Carry the recursion over a tile of T library frames.

    Parameters
    ----------
    squares : (n, T)
        Squared distances of query and library frames; turned into distances.
    one_back, two_back : (T,)
        What it costs to have come from one, or two, frames before: infinity where that is another
        clip, else 0.
    state : (n, 2)
        The entries of the two frames before the tile; updated.
    scale : float
        What C(n-1, j) is multiplied by.
    costs : (T,)
        Lowered to that, where it is more.
    """
    n, n_frames = squares.shape
    zero = np.float32(0.0)
    two_above = np.zeros(n_frames + 2, dtype=np.float32)  # two frames of the tile before come first
    above = two_above.copy()
    here = two_above.copy()
    start = two_above[2:].copy()
    for i in range(n):
        row = squares[i]
        for j in range(n_frames):  # rounding may take a square below zero
            row[j] = np.sqrt(row[j] if row[j] > zero else zero)
        here[0], here[1] = state[i, 0], state[i, 1]
        if i == 0:
            here[2:] = row
        else:
            charged = squares[i - 1]
            barrier = start if i == 1 else one_back  # C(-1, j) is 0 in any clip
            for j in range(n_frames):
                even = above[j + 1] + one_back[j]
                fast = above[j] + two_back[j]
                slow = two_above[j + 1] + charged[j] + barrier[j]
                best = even if even < fast else fast
                best = best if best < slow else slow
                here[j + 2] = best + row[j]
        state[i, 0], state[i, 1] = here[n_frames], here[n_frames + 1]
        two_above, above, here = above, here, two_above
    for j in range(n_frames):
        cost = above[j + 2] * scale
        costs[j] = cost if cost < costs[j] else costs[j]


@jit_sums
def widen_pairs(
    codes: NDArray[np.int8], steps: Float32Array, tile: Float32Array, halves: Float32Array
) -> None:
    """Turn pairs of frames into their middles, as `widen` does, and halves of their distances.

    Parameters
    ----------
    codes : (2 T, D)
        Or one less: the last pair is then twice the same frame.
    steps : (D,)
    tile : (T, D + 2)
        Filled.
    halves : (T,)
        Filled.
    """
    n_axes = len(steps)
    for p in range(len(tile)):
        first, second = 2 * p, min(2 * p + 1, len(codes) - 1)
        norm, apart = np.float32(0.0), np.float32(0.0)
        for axis in range(n_axes):
            half = np.float32(0.5) * steps[axis]
            middle = half * (np.int32(codes[first, axis]) + np.int32(codes[second, axis]))
            gap = half * (np.int32(codes[first, axis]) - np.int32(codes[second, axis]))
            tile[p, axis] = middle
            norm += middle * middle
            apart += gap * gap
        tile[p, n_axes] = norm
        tile[p, n_axes + 1] = np.float32(1.0)
        halves[p] = np.sqrt(apart)


@jit
def bound_costs(
    squares: Float32Array,
    halves: Float32Array,
    state: Float32Array,
    scale: np.float32,
    bounds: Float32Array,
) -> None:
    """Carry the recursion of the bounds over a tile of T pairs of library frames.

    Paths go on from one clip to the next here, which can only lower a bound.

    Parameters
    ----------
    squares : (n, T)
        Squared distances of query frames and middles.
    halves : (T,)
    state : (n, 2)
        The entries of the pair before the tile, in the last column; updated.
    scale : float
        What B(n-1, p) is multiplied by.
    bounds : (T,)
        Lowered to that, where it is more.
    """
    n, n_pairs = squares.shape
    zero = np.float32(0.0)
    above = np.zeros(n_pairs + 1, dtype=np.float32)  # the pair before the tile comes first
    here = above.copy()
    for i in range(n):
        row = squares[i]
        here[0] = state[i, 1]
        for p in range(n_pairs):
            distance = np.sqrt(row[p] if row[p] > zero else zero) - halves[p]
            distance = distance if distance > zero else zero
            stays, comes = above[p + 1], above[p]
            here[p + 1] = distance + (stays if stays < comes else comes)
        state[i, 1] = here[n_pairs]
        above, here = here, above
    for p in range(n_pairs):
        bound = above[p + 1] * scale
        bounds[p] = bound if bound < bounds[p] else bounds[p]


@jit
def scan_costs(
    codes: NDArray[np.int8],
    steps: Float32Array,
    one_back: Float32Array,
    two_back: Float32Array,
    factors: Float32Array,
    edges: IntArray,
    scales: Float32Array,
    size: int,
    costs: Float32Array,
) -> None:
    """Lower the costs of N library frames to those of K queries, a tile after the other.

    Parameters
    ----------
    codes, steps
        See `widen`.
    one_back, two_back : (N,)
        See `lower_costs`.
    factors : (n, D + 2)
        All query frames, ``[-2 q, 1, |q|^2]``.
    edges : (K + 1,)
        Where the frames of each query start.
    scales : (K,)
        What the sum of distances of each is multiplied by.
    size : int
        Frames of a tile.
    costs : (K, N)
    """
    n_frames = len(codes)
    tile = np.empty((size, factors.shape[1]), dtype=np.float32)
    squares = np.empty((len(factors), size), dtype=np.float32)
    state = np.full((len(factors), 2), np.inf, dtype=np.float32)  # nothing comes before
    for a in range(0, n_frames, size):
        b = min(a + size, n_frames)
        if b - a < size:
            tile = np.empty((b - a, factors.shape[1]), dtype=np.float32)
            squares = np.empty((len(factors), b - a), dtype=np.float32)
        widen(codes[a:b], steps, tile)
        np.dot(factors, tile.T, squares)
        for k in range(len(scales)):
            first, end = edges[k], edges[k + 1]
            lower_costs(
                squares[first:end],
                one_back[a:b],
                two_back[a:b],
                state[first:end],
                scales[k],
                costs[k, a:b],
            )


@jit
def scan_bounds(
    codes: NDArray[np.int8],
    steps: Float32Array,
    factors: Float32Array,
    edges: IntArray,
    scales: Float32Array,
    size: int,
    bounds: Float32Array,
) -> None:
    """Lower the bounds (K, ceil(N / 2)) of pairs of N library frames, as `scan_costs` does costs.

    The arguments are the same.
    """
    n_pairs = bounds.shape[1]
    tile = np.empty((size, factors.shape[1]), dtype=np.float32)
    squares = np.empty((len(factors), size), dtype=np.float32)
    halves = np.empty(n_pairs, dtype=np.float32)
    state = np.full((len(factors), 2), np.inf, dtype=np.float32)
    for a in range(0, n_pairs, size):
        b = min(a + size, n_pairs)
        if b - a < size:
            tile = np.empty((b - a, factors.shape[1]), dtype=np.float32)
            squares = np.empty((len(factors), b - a), dtype=np.float32)
        widen_pairs(codes[2 * a : 2 * b], steps, tile, halves[a:b])
        np.dot(factors, tile.T, squares)
        for k in range(len(scales)):
            first, end = edges[k], edges[k + 1]
            bound_costs(
                squares[first:end], halves[a:b], state[first:end], scales[k], bounds[k, a:b]
            )


@jit_sums
def frame_distances(a: Float32Array, b: Float32Array) -> Float32Array:
    """Return the (n, m) distances of frames (n, D) and (m, D)."""
    found = np.empty((len(a), len(b)), dtype=np.float32)
    for i in range(len(a)):
        for j in range(len(b)):
            square = np.float32(0.0)
            for axis in range(a.shape[1]):
                square += (a[i, axis] - b[j, axis]) ** 2
            found[i, j] = np.sqrt(square)
    return found


@jit
def backtrack(distances: Float32Array, end: int) -> IntArray:
    """Return the (n,) frame matched with each query frame, or -1 if no path ends there.

    Parameters
    ----------
    distances : (n, T)
        Of the query to the frames of one clip, or of a part of it that the path cannot leave.
    end : int
        The frame that the stretch ends with.
    """
    n = len(distances)
    cost = np.full((n + 2, end + 1), np.inf, dtype=np.float32)
    cost[1] = 0.0
    step = np.zeros((n, end + 1), dtype=np.int8)
    for j in range(end + 1):
        cost[2, j] = distances[0, j]
        for i in range(1, n):
            best = np.float32(np.inf)
            if j >= 1 and cost[i + 1, j - 1] < best:
                best = cost[i + 1, j - 1]
                step[i, j] = 1
            if j >= 2 and cost[i + 1, j - 2] < best:
                best = cost[i + 1, j - 2]
                step[i, j] = 2
            slow = np.float32(np.inf)
            if i == 1:
                slow = distances[0, j]
            elif j >= 1:
                slow = cost[i, j - 1] + distances[i - 1, j]
            if slow < best:
                best = slow
                step[i, j] = 3
            cost[i + 2, j] = distances[i, j] + best
    path = np.full(n, -1, dtype=np.int64)
    if not np.isfinite(cost[n + 1, end]):
        return path
    i, j = n - 1, end
    while i >= 0:
        path[i] = j
        if i > 0 and step[i, j] == 3:
            path[i - 1] = j
            i -= 2
            j -= 1
        else:
            j -= step[i, j]
            i -= 1
    return path


@jit
def whole_cost(distances: Float32Array) -> float:
    """Return the mean distance along the best path through a whole (n, m) matrix.

    Steps (1, 1), (1, 2), (2, 1) as above but from corner to corner, and every frame of *both* is
    charged; both must be at least half as long as the other, or the cost is infinite.
    """
    n, m = distances.shape
    cost = np.full((n, m), np.inf, dtype=np.float32)
    cost[0, 0] = 2 * distances[0, 0]
    for i in range(1, n):
        for j in range(1, m):
            d = distances[i, j]
            best = cost[i - 1, j - 1] + 2 * d
            if j >= 2:
                best = min(best, cost[i - 1, j - 2] + 2 * distances[i, j - 1] + d)
            if i >= 2:
                best = min(best, cost[i - 2, j - 1] + 2 * distances[i - 1, j] + d)
            cost[i, j] = best
    return float(cost[n - 1, m - 1] / (n + m))
