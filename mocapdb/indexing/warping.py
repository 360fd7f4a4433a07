"""Sub-sequence dynamic time warping: a query against every stretch of a library at once.

A path takes the steps (1, 1), (1, 2) and (2, 1) in (query, library) frames, so the stretch goes
half to twice as fast as the query. Every query frame is charged once, its distance to the library
frame that it is matched with, so costs do not depend on speed::

    C(i, j) = d(i, j) + min(C(i-1, j-1), C(i-1, j-2), C(i-2, j-1) + d(i-1, j))

with C(-1, j) = 0, for a stretch may start anywhere, and C(-2, j) infinite. A stretch never leaves
its clip. The cost of library frame j is C(n-1, j) / n, that of the best stretch that *ends* there.
No entry needs another of its own column, so a column is a loop that becomes vector instructions.

``advance``      costs of a tile of library frames, carried on from the tile before
``backtrack``    which frames a stretch was matched with
``whole_cost``   two motions from beginning to end
"""

from __future__ import annotations

import numpy as np

from mocapdb._jit import jit
from mocapdb._typing import ByteArray, Float32Array, IntArray

__all__ = ["advance", "backtrack", "new_state", "whole_cost"]


def new_state(n_query: int) -> Float32Array:
    """Return the (3, n + 2) columns that the recursion starts with.

    Rows are C of the last frame, of the one before, and room for the next; in each, entries -2
    and -1 of a column come first.
    """
    state = np.full((3, n_query + 2), np.inf, dtype=np.float32)
    state[:, 1] = 0.0
    return state


@jit
def advance(
    products: Float32Array,
    norms: Float32Array,
    query_norms: Float32Array,
    is_start: ByteArray,
    state: Float32Array,
    costs: Float32Array,
) -> None:
    """Carry the recursion over a tile of T library frames.

    Parameters
    ----------
    products : (T, n)
        -2 times the inner products of library and query frames.
    norms, query_norms : (T,), (n,)
        Squared lengths of the frames.
    is_start : (T,)
        1 where a clip starts.
    state : (3, n + 2)
        See `new_state`; updated.
    costs : (T,)
        Filled with C(n-1, j) / n.
    """
    n = len(query_norms)
    zero = np.float32(0.0)
    scale = np.float32(1.0 / n)
    distance = np.zeros(n + 1, dtype=np.float32)  # from entry -1, which C(-2, j) makes infinite
    last, before, column = state[0], state[1], state[2]
    for j in range(len(norms)):
        if is_start[j]:
            last[2:] = np.inf
            before[2:] = np.inf
        row = products[j]
        norm = norms[j]
        for i in range(n):  # rounding may take a square below zero
            squared = row[i] + norm + query_norms[i]
            distance[i + 1] = np.sqrt(squared if squared > zero else zero)
        for i in range(n):
            even, fast = last[i + 1], before[i + 1]
            slow = last[i] + distance[i]
            best = even if even < fast else fast
            best = best if best < slow else slow
            column[i + 2] = best + distance[i + 1]
        costs[j] = column[n + 1] * scale
        before, last, column = last, column, before
    newest, older = last.copy(), before.copy()  # the rows have changed places on the way
    state[0], state[1] = newest, older


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
