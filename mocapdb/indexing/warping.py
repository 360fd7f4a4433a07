"""Sub-sequence dynamic time warping: a query against every stretch of a library at once.

A path takes the steps (1, 1), (1, 2) and (2, 1) in (query, library) frames, so the stretch goes
half to twice as fast as the query. Every query frame is charged once, its distance to the library
frame that it is matched with, so costs do not depend on speed::

    C(i, j) = d(i, j) + min(C(i-1, j-1), C(i-1, j-2), C(i-2, j-1) + d(i-1, j))

with C(-1, j) = 0, for a stretch may start anywhere, and C(-2, j) infinite. A stretch never leaves
its clip. The cost of library frame j is C(n-1, j) / n, that of the best stretch that *ends* there.
No entry needs another of its own row, so a row, a query frame against a tile of the library, is a
loop that becomes vector instructions.

``widen``        frames from bytes, ready for the product that gives their distances
``lower_costs``  the recursion over a tile of library frames, carried on from the tile before
``backtrack``    which frames a stretch was matched with
``whole_cost``   two motions from beginning to end
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocapdb._jit import jit, jit_sums
from mocapdb._typing import Float32Array, IntArray

__all__ = ["backtrack", "lower_costs", "new_state", "whole_cost", "widen"]


def new_state(n_query: int) -> Float32Array:
    """Return the (n, 2) entries to the left of the first tile: there is nothing."""
    return np.full((n_query, 2), np.inf, dtype=np.float32)


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
