"""Sub-sequence dynamic time warping: a query against every stretch of a library at once.

A path takes the steps (1, 1), (1, 2) and (2, 1) in (query, library) frames, so the stretch goes
half to twice as fast as the query. Every query frame is charged once, its distance to the library
frame that it is matched with, so costs do not depend on speed::

    C(i, j) = d(i, j) + min(C(i-1, j-1), C(i-1, j-2), C(i-2, j-1) + d(i-1, j))

with C(-1, j) = 0, for a stretch may start anywhere, and C(-2, j) infinite. A stretch never leaves
its clip. The cost of library frame j is C(n-1, j) / n, that of the best stretch that *ends* there.

The library is gone over in tiles of frames, so short that all of it stays in a core's cache, and a
tile row by row, a row being one query frame. No entry needs another of its own row, so a row is a
loop that becomes vector instructions. Entries only grow along a path: where two rows are above what
is asked for, so is all that follows from there, and most tiles are left after a third of the rows.

``scan``         the costs of ranges of frames, or where they are lowest
``lay_out``      which frames that takes, a tile at a time
``widen``        the frames of a tile from bytes
``two_rows``     the squared distances of two query frames from a tile
``fill_entries`` one step of the recursion
``fill_costs``   the recursion over a tile, carried on from the tile before
``mark``         where costs are lowest

Of single stretches and clips:

``frame_distances``  of the frames of two motions
``backtrack``    which frames a stretch was matched with
``warp_whole``   two motions from beginning to end
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import BoolArray, Float32Array, IntArray
from mocapdb.base.kernels import jit, jit_fast, jit_sums
from mocapdb.base.selection import kth_smallest

__all__ = ["backtrack", "frame_distances", "scan", "warp_whole"]

ZERO, INFINITE = np.float32(0.0), np.float32(np.inf)


@jit_fast
def widen(
    fours: NDArray[np.int32],
    source: IntArray,
    steps: Float32Array,
    column: NDArray[np.int32],
    tile: Float32Array,
    norms: Float32Array,
) -> None:
    """Turn the frames of a tile into metres, an axis after the other.

    Parameters
    ----------
    fours : (N, D / 4)
        The frames, four axes of 8 bits to a number.
    source : (T,)
        Which frames are the tile's.
    steps : (D,)
        What a step of each axis stands for.
    column : (T,)
        To work in.
    tile : (D, T)
        Filled with the frames.
    norms : (T,)
        Filled with their squared lengths.
    """
    n_frames = len(source)
    norms[:n_frames] = ZERO
    for axis in range(0, len(steps), 2):
        row, other = tile[axis], tile[axis + 1]
        step, other_step = steps[axis], steps[axis + 1]
        if axis % 4 == 0:  # a loop of its own: it does not become vector instructions
            four = np.uint64(axis // 4)  # unsigned: numba need not look for negative ones
            for j in range(n_frames):
                column[j] = fours[np.uint64(source[j]), four]
        shift = np.int32(8 * (axis % 4))
        for j in range(n_frames):
            code = column[j] >> shift
            x = np.float32(np.int8(code)) * step
            y = np.float32(np.int8(code >> np.int32(8))) * other_step
            row[j] = x
            other[j] = y
            norms[j] += x * x + y * y


@jit_fast
def two_rows(
    tile: Float32Array,
    norms: Float32Array,
    f: Float32Array,
    g: Float32Array,
    first: int,
    row: Float32Array,
    other: Float32Array,
) -> None:
    """Fill two rows with the squared distances of two query frames from some frames of a tile.

    Two at once, and four axes at once, because reading and writing takes longer than multiplying.

    Parameters
    ----------
    tile, norms
        See `widen`.
    f, g : (D + 1,)
        Query frames, ``[-2 q, |q|^2]``.
    first : int
        First of the frames of the tile.
    row, other : (m,)
        Filled; rounding may take a square below zero.
    """
    n_axes, n_frames = len(f) - 1, len(row)
    own = slice(first, first + n_frames)
    own_norms = norms[own]
    for j in range(n_frames):
        row[j] = own_norms[j] + f[n_axes]
        other[j] = own_norms[j] + g[n_axes]
    for axis in range(0, n_axes, 4):
        f0, f1, f2, f3 = f[axis], f[axis + 1], f[axis + 2], f[axis + 3]
        g0, g1, g2, g3 = g[axis], g[axis + 1], g[axis + 2], g[axis + 3]
        t0, t1, t2, t3 = tile[axis], tile[axis + 1], tile[axis + 2], tile[axis + 3]
        t0, t1, t2, t3 = t0[own], t1[own], t2[own], t3[own]
        for j in range(n_frames):
            x0, x1, x2, x3 = t0[j], t1[j], t2[j], t3[j]
            row[j] += f0 * x0 + f1 * x1 + f2 * x2 + f3 * x3
            other[j] += g0 * x0 + g1 * x1 + g2 * x2 + g3 * x3


@jit_fast
def fill_entries(
    two_above: Float32Array,
    above: Float32Array,
    charged: Float32Array,
    row: Float32Array,
    here: Float32Array,
) -> None:
    """Take one step of the recursion for m frames in a row.

    Parameters
    ----------
    two_above : (m,)
        C(i-2, j-1).
    above : (m + 1,)
        C(i-1, j-2), and one more.
    charged : (m,)
        d(i-1, j-1).
    row : (m,)
        Squares of d(i, j); turned into distances.
    here : (m,)
        Filled with C(i, j).
    """
    for j in range(len(row)):
        row[j] = np.sqrt(max(row[j], ZERO))
        even, fast, slow = above[j + 1], above[j], two_above[j] + charged[j]
        here[j] = min(even, fast, slow) + row[j]


@jit_fast
def fill_costs(
    tile: Float32Array,
    norms: Float32Array,
    starts: IntArray,
    factors: Float32Array,
    scale: np.float32,
    limit: np.float32,
    state: Float32Array,
    rows: Float32Array,
    entries: Float32Array,
    costs: Float32Array,
) -> None:
    """Carry the recursion over a tile of T library frames.

    Parameters
    ----------
    tile, norms
        See `widen`.
    starts : (S,)
        Frames of the tile that clips start with; -1 is the last of the tile before.
    factors : (n, D + 1)
        See `two_rows`.
    scale : float
        What C(n-1, j) is multiplied by.
    limit : float
        Costs above it may be left out.
    state : (n, 2)
        The entries of the two frames before the tile; updated.
    rows, entries : (4, T), (3, T + 2)
        To work in: distances, and C(i, -2), C(i, -1), C(i, 0) and so on.
    costs : (T,)
        Filled; infinite where no stretch ends, or nothing within the limit.
    """
    n, n_frames = len(factors), len(costs)
    costs[:] = INFINITE
    most = limit / scale
    last = n - 1  # the last row where a path that may stay within the limit enters the tile
    while last >= 0 and min(state[last, 0], state[last, 1]) > most:
        last -= 1
    entries[:] = ZERO  # C(-1, j); C(-2, j) may be 0, too: with d added it is not less
    rows[3] = ZERO
    first, end = 0, n_frames
    for i in range(n):
        row, charged = rows[i % 4], rows[(i + 3) % 4]
        two_above, above, here = entries[(i + 1) % 3], entries[(i + 2) % 3], entries[i % 3]
        if i % 2 == 0:
            if i > last + 2:  # outside of first:end, two rows are above the limit
                while first < end and min(above[first + 2], two_above[first + 2]) > most:
                    first += 1
                while first < end and min(above[end + 1], two_above[end + 1]) > most:
                    end -= 1
                if first == end:
                    state[i:] = INFINITE
                    return
                end = min(end + 4, n_frames)  # as far as two rows can get from there
            second = factors[min(i + 1, n - 1)]
            other = rows[(i + 1) % 4]
            two_rows(tile, norms, factors[i], second, first, row[first:end], other[first:end])
        for back in range(2):
            here[first + back] = state[i, back] if first == 0 else INFINITE
        fill_entries(
            two_above[first + 1 : end + 1],
            above[first : end + 1],
            charged[first:end],
            row[first:end],
            here[first + 2 : end + 2],
        )
        for start in starts:  # no path crosses the start of a clip, but one may begin there
            if i > 0 and first <= start < end:
                here[start + 2] = row[start] + charged[start] if i == 1 else INFINITE
            if i > 0 and first <= start + 1 < end:
                slow = two_above[start + 2] + charged[start + 1]
                here[start + 3] = row[start + 1] + min(above[start + 2], slow)
        here[end + 2 : end + 5] = INFINITE
        for back in range(2):
            state[i, back] = here[n_frames + back] if end >= n_frames - 2 else INFINITE
    here = entries[(n - 1) % 3]
    for j in range(first, end):
        costs[j] = here[j + 2] * scale


@jit
def lay_out(
    starts: IntArray,
    spans: IntArray,
    reach: int,
    place: IntArray,
    source: IntArray,
    is_start: BoolArray,
    is_asked: BoolArray,
) -> int:
    """Fill in the next frames to go over for some spans; return how many.

    They are what paths to a span come from, the span, and the frame after it.

    Parameters
    ----------
    starts, spans
        See `scan`.
    reach : int
        How many frames a path goes back at most.
    place : (3,)
        Number of the span, the frame to go on with (0: its first), and the clip; updated.
    source : (T,)
        Filled with the numbers of the frames.
    is_start : (T,)
        Filled with where no path comes from the frame before.
    is_asked : (T,)
        Filled with whether it is of the spans.
    """
    n = 0
    while n < len(source) and place[0] < len(spans):
        first, end = spans[place[0]]
        while starts[place[2] + 1] <= max(first, place[1]):
            place[2] += 1
        clip = place[2]
        lead, last = max(starts[clip], first - reach), min(end + 1, starts[-1])
        begin = max(lead, place[1])
        stop = min(last, begin + len(source) - n)
        own = slice(n, n + stop - begin)
        is_start[own], is_asked[own] = False, False
        is_start[n] = begin == lead
        is_asked[n + max(first - begin, 0) : n + max(min(end, stop) - begin, 0)] = True
        frames = source[own]
        for j in range(len(frames)):
            frames[j] = begin + j
        while starts[clip] < stop:
            if starts[clip] >= begin:
                is_start[n + starts[clip] - begin] = True
            clip += 1
        n += stop - begin
        place[1] = stop
        if stop == last:
            place[0] += 1
            place[1] = 0
    return n


@jit_fast
def mark(
    costs: Float32Array,
    is_start: BoolArray,
    limit: np.float32,
    only_minima: bool,
    marks: BoolArray,
) -> None:
    """Mark the costs within a limit, or the minima of each clip; not the first and the last."""
    before, own, after, marked = costs[:-2], costs[1:-1], costs[2:], marks[1:-1]
    is_first, is_last = is_start[1:-1], is_start[2:]
    if only_minima:
        for j in range(len(own)):
            falls = (before[j] > own[j]) | (is_first[j] & (own[j] < INFINITE))
            marked[j] = (own[j] <= limit) & falls & ((own[j] <= after[j]) | is_last[j])
    else:
        for j in range(len(own)):
            marked[j] = own[j] <= limit


@jit
def scan(
    fours: NDArray[np.int32],
    starts: IntArray,
    spans: IntArray,
    steps: Float32Array,
    factors: Float32Array,
    scale: np.float32,
    limit: Float32Array,
    only_minima: bool,
    most: int,
    size: int,
) -> tuple[IntArray, Float32Array]:
    """Return the frames of some spans where the cost is within a limit, and the costs.

    Parameters
    ----------
    fours : (N, D / 4)
        All frames (see `widen`).
    starts : (n + 1,)
        The first frame of each clip, and N.
    spans : (S, 2)
        First frames, and ends.
    steps : (D,)
        See `widen`.
    factors : (n, D + 1)
        See `two_rows`.
    scale : float
        See `fill_costs`.
    limit : (1,)
        Costs above it are left out. Lowered to what `most` costs were found within: what goes over
        other frames in another thread may share it.
    only_minima : bool
        Only those whose neighbours in the clip cost more.
    most : int
        How many of the lowest are wanted; there may be more.
    size : int
        Frames of a tile.
    """
    n_asked = 0
    for first, end in spans:
        n_asked += end - first
    found, costs = np.empty(n_asked, dtype=np.int64), np.empty(n_asked, dtype=np.float32)
    selected = np.empty(n_asked, dtype=np.float32)
    n_found = 0
    tile = np.empty((len(steps), size), dtype=np.float32)
    norms = np.empty(size, dtype=np.float32)
    column = np.empty(size, dtype=np.int32)
    rows = np.empty((4, size), dtype=np.float32)
    entries = np.empty((3, size + 2), dtype=np.float32)
    state = np.full((len(factors), 2), INFINITE)  # no path has begun
    place = np.zeros(3, dtype=np.int64)
    # a tile's, after those of the last two frames of the tile before
    source, own = np.zeros(size + 2, dtype=np.int64), np.full(size + 2, INFINITE)
    is_start, is_asked = np.zeros(size + 2, dtype=np.bool_), np.zeros(size + 2, dtype=np.bool_)
    is_near, first_frames = np.zeros(size + 2, dtype=np.bool_), np.empty(size + 2, dtype=np.int64)
    n = 1
    while n:
        n = lay_out(starts, spans, 2 * len(factors), place, source[2:], is_start[2:], is_asked[2:])
        n_first = 0
        for j in range(1, n + 2):
            if is_start[j]:
                first_frames[n_first] = j - 2
                n_first += 1
        widen(fours, source[2 : n + 2], steps, column, tile, norms)
        fill_costs(
            tile,
            norms,
            first_frames[:n_first],
            factors,
            scale,
            limit[0],
            state,
            rows,
            entries,
            own[2 : n + 2],
        )
        for j in range(n + 2, size + 2):
            own[j] = INFINITE
        mark(own, is_start, limit[0], only_minima, is_near)
        for j in range(1, max(n, 1) + 1):  # the last one is judged with the next tile
            if is_near[j] and is_asked[j]:
                found[n_found], costs[n_found] = source[j], own[j]
                n_found += 1
        if n_found >= 2 * most:
            for i in range(n_found):
                selected[i] = costs[i]
            limit[0] = min(limit[0], kth_smallest(selected, n_found, most - 1))
            n_kept = 0
            for i in range(n_found):
                found[n_kept], costs[n_kept] = found[i], costs[i]
                n_kept += int(costs[i] <= limit[0])
            n_found = n_kept
        for j in range(2):  # compiles in a fraction of the time of slices
            own[j], source[j] = own[n + j], source[n + j]
            is_start[j], is_asked[j] = is_start[n + j], is_asked[n + j]
    return found[:n_found], costs[:n_found]


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
def backtrack(distances: Float32Array, end: int) -> tuple[IntArray, float]:
    """Return the (n,) frame matched with each query frame, and the cost.

    Where no path ends there, -1 and infinity.

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
    total = float(cost[n + 1, end])
    if not np.isfinite(total):
        return path, total
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
    return path, total / n


@jit
def warp_whole(distances: Float32Array) -> tuple[IntArray, float]:
    """Return the best path through a whole (n, m) matrix, and the mean distance along it.

    Steps (1, 1), (1, 2), (2, 1) as above but from corner to corner, and every frame of *both* is
    charged; both must be at least half as long as the other, or the cost is infinite.

    Returns
    -------
    path : (k, 2)
        Frames of both that are matched, from the first on.
    cost : float
    """
    n, m = distances.shape
    cost = np.full((n, m), np.inf, dtype=np.float32)
    step = np.zeros((n, m), dtype=np.int8)
    cost[0, 0] = 2 * distances[0, 0]
    for i in range(1, n):
        for j in range(1, m):
            d = distances[i, j]
            best = cost[i - 1, j - 1] + 2 * d
            if j >= 2:
                fast = cost[i - 1, j - 2] + 2 * distances[i, j - 1] + d
                if fast < best:
                    best = fast
                    step[i, j] = 1
            if i >= 2:
                slow = cost[i - 2, j - 1] + 2 * distances[i - 1, j] + d
                if slow < best:
                    best = slow
                    step[i, j] = 2
            cost[i, j] = best
    path = np.zeros((min(n, m), 2), dtype=np.int64)
    i, j, first = n - 1, m - 1, min(n, m) - 1
    path[first, 0], path[first, 1] = i, j
    while i > 0 and j > 0 and first > 0:
        i, j = i - 1 - int(step[i, j] == 2), j - 1 - int(step[i, j] == 1)
        first -= 1
        path[first, 0], path[first, 1] = i, j
    return path[first:], float(cost[n - 1, m - 1] / (n + m))
