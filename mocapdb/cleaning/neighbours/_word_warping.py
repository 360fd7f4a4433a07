"""Kernels of the neighbour search: distances of frames, constrained warping of words.

Distances are whole numbers of `UNIT` square radians, at most `LARGEST`. A cell of the recursion
packs the cost of its best path and the number of its cells in one 32-bit integer, cost first, so
that one minimum carries both; and `LANES` words that start at neighbouring frames go through the
recursion together, in loops that the compiler turns into vector instructions.

The constraints are those of the paper's appendix: a path starts at the first frames of both words
and ends at the last frame of either, after more than 10 frames of both; it goes forwards by (1, 1),
(1, 0) or (0, 1), never more than 3 times in a row by the same one of the last two.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mocapdb.base.arrays import Float32Array, IntArray
from mocapdb.base.kernels import jit, jit_fast, jit_inline

__all__ = [
    "CELL",
    "LANES",
    "LEAST_MATCHED",
    "TILE",
    "UNIT",
    "align",
    "backtrack",
    "bound_words",
    "frame_distances",
    "window_minima",
]

UNIT = 2.0**-14
LARGEST = 400_000
LENGTH_BITS, LENGTH_MASK = 6, 63
INFINITE = 2**30  # and still a 32-bit number after adding LARGEST in every cell of a path
LANES = 16
CELL = 7 * LANES
LONGEST_RUN = 3
LEAST_MATCHED = 11
MOST_DROPPED = 3
TILE = 512
ROUNDED_DOWN = np.float32(1.0 - 1e-6)  # no bound may exceed what it bounds by rounding


@jit_fast
def frame_distances(
    quats: Float32Array,
    frame: Float32Array,
    rows: IntArray,
    n_drop: int,
    start: int,
    out: Any,
    work: Any,
) -> None:
    """Fill `out` with the squared distances (eq. 1) of one frame to T frames of a context.

    Parameters
    ----------
    quats : (K, 4, N)
        Context, time last.
    frame : (K, 4)
    rows : (G,)
        Joints that count.
    n_drop : int
        How many of the largest are dropped, 0 to 3.
    start : int
        The first of the frames.
    out : (T,) of int32
        Filled, in units.
    work : (5, TILE) of float32
        The frames are gone over in tiles, so that this stays in the smallest cache.

    Notes
    -----
    The norm of the logarithm of q is half the angle of the rotation, arccos |q_w|. Its square is a
    smooth function of 1 - |q_w|, whose series needs no arccos: six terms are right to 0.1 %.
    """
    total, first, second, third = work[0], work[1], work[2], work[3]
    next_first = work[4]  # written to `first` at once: writing single values is slow
    for done in range(0, len(out), TILE):
        n_frames = min(TILE, len(out) - done)
        at = start + done
        for t in range(n_frames):
            total[t] = np.float32(0.0)
            first[t] = np.float32(0.0)
            second[t] = np.float32(0.0)
            third[t] = np.float32(0.0)
        for row in rows:
            a, b, c, d = frame[row, 0], frame[row, 1], frame[row, 2], frame[row, 3]
            x, y, z, w = quats[row, 0], quats[row, 1], quats[row, 2], quats[row, 3]
            x, y, z, w = x[at:], y[at:], z[at:], w[at:]
            for t in range(n_frames):
                u = np.float32(1.0) - abs(a * x[t] + b * y[t] + c * z[t] + d * w[t])
                u = max(u, np.float32(0.0))
                v = np.float32(16 / 1575) + u * np.float32(8 / 2079)
                v = np.float32(1 / 35) + u * v
                v = np.float32(4 / 45) + u * v
                v = np.float32(1 / 3) + u * v
                v = u * (np.float32(2.0) + u * v)
                # keep the three largest distances so far; add all smaller ones
                largest, second_largest, third_largest = first[t], second[t], third[t]
                next_first[t] = max(largest, v)
                v = min(largest, v)
                second[t] = max(second_largest, v)
                v = min(second_largest, v)
                third[t] = max(third_largest, v)
                total[t] += min(third_largest, v)
            first, next_first = next_first, first
        if n_drop < 3:
            for t in range(n_frames):
                total[t] += third[t]
        if n_drop < 2:
            for t in range(n_frames):
                total[t] += second[t]
        if n_drop < 1:
            for t in range(n_frames):
                total[t] += first[t]
        for t in range(n_frames):
            units = total[t] * np.float32(1.0 / UNIT)
            out[done + t] = np.int32(min(units, np.float32(LARGEST)))


@jit
def window_minima(row: Any, width: int, out: Any, work: Any) -> None:
    """Fill ``out[s]`` with the minimum of ``row[s : s + width]``, cut at the end of the row."""
    n = len(row)
    for s in range(n):
        work[s] = row[s]
    done = 1
    while 2 * done <= width:  # minima over windows of twice the width, in place
        for s in range(n - done):
            work[s] = work[s] if work[s] < work[s + done] else work[s + done]
        done *= 2
    shift = width - done
    for s in range(n):
        other = work[s + shift] if s + shift < n else work[n - 1]
        out[s] = work[s] if work[s] < other else other


@jit_fast
def bound_words(minima: Any, n_target: int, out: Float32Array) -> None:
    """Fill `out` with a lower bound of the distance between a word and each target.

    Parameters
    ----------
    minima : (N, T) of int32
        For each frame of the word the least distance to the frames of the target that starts at
        t, or to those that a path can match it with.
    n_target : int
        Frames of a target.
    out : (T,)

    Notes
    -----
    A path that matches R frames of the word has R cells, one in each row and none below its
    row's minimum, and at most ``n_target - 1`` more, none below the least minimum.
    """
    n_source, n_targets = minima.shape
    extra = n_target - 1
    total = np.empty(TILE, dtype=np.float32)
    least = np.empty(TILE, dtype=np.float32)
    for first in range(0, n_targets, TILE):
        n = min(TILE, n_targets - first)
        bounds = out[first : first + n]
        bounds[:] = np.float32(1e30)
        total[:] = np.float32(0.0)
        least[:] = np.float32(1e30)
        for i in range(n_source):
            row = minima[i, first : first + n]
            share = ROUNDED_DOWN / np.float32(i + 1 + extra)
            for t in range(n):
                value = np.float32(row[t])
                total[t] += value
                least[t] = min(least[t], value)
            if i + 1 >= LEAST_MATCHED:
                for t in range(n):
                    mean = (total[t] + np.float32(extra) * least[t]) * share
                    bounds[t] = min(bounds[t], mean)


@jit
def align(distances: Any, start: int, n_target: int, state: Any, out: Float32Array) -> None:
    """Find the distances of a word to `LANES` targets: the mean cost of the best path, in units.

    Parameters
    ----------
    distances : (N, T) of int32
        Of the word's frames to all frames of the context; T reaches `LANES` beyond the start.
    start : int
        The first target's first frame; the others start one frame later each.
    n_target : int
        M, frames of a target.
    state : (2, (M + 1) * CELL) of int32
        Room for two rows of cells, of the word's column -1 and its M columns.
    out : (LANES,)
        Filled.

    Notes
    -----
    A cell is seven groups of lanes: the best path, the best that does not end along the target, or
    along the word; those that end in one and in two steps along the target, and along the word.
    They lie side by side, for only where the distance of what is read and what is written is known
    do the lanes become vector instructions.
    """
    n_source = len(distances)
    for lane in range(LANES):
        out[lane] = np.float32(1e30)
    state[:] = INFINITE
    for i in range(n_source):
        now, above, row = state[i % 2], state[(i + 1) % 2], distances[i]
        low = max(0, i // (LONGEST_RUN + 1))  # at least one in four steps is along the target
        high = min(n_target - 1, (LONGEST_RUN + 1) * i + LONGEST_RUN)
        now[: (low + 1) * CELL] = INFINITE  # column j of the word is cell j + 1
        for j in range(low, high + 1):
            left, here = now[j * CELL : (j + 1) * CELL], now[(j + 1) * CELL : (j + 2) * CELL]
            corner, up = above[j * CELL : (j + 1) * CELL], above[(j + 1) * CELL : (j + 2) * CELL]
            squares = row[start + j : start + j + LANES]
            is_first = i == 0 and j == 0
            is_last = (i == n_source - 1 or j == n_target - 1) and min(i, j) + 1 >= LEAST_MATCHED
            for lane in range(LANES):
                cost = np.int32(squares[lane] * np.int32(LENGTH_MASK + 1) + np.int32(1))
                a = cost if is_first else np.int32(corner[lane] + cost)
                b1 = np.int32(left[LANES + lane] + cost)
                b2 = np.int32(left[3 * LANES + lane] + cost)
                b3 = np.int32(left[4 * LANES + lane] + cost)
                c1 = np.int32(up[2 * LANES + lane] + cost)
                c2 = np.int32(up[5 * LANES + lane] + cost)
                c3 = np.int32(up[6 * LANES + lane] + cost)
                h = min(b1, b2, b3)
                v = min(c1, c2, c3)
                best = min(a, h, v)
                here[lane] = min(best, np.int32(INFINITE))
                here[LANES + lane] = min(a, v, np.int32(INFINITE))
                here[2 * LANES + lane] = min(a, h, np.int32(INFINITE))
                here[3 * LANES + lane] = min(b1, np.int32(INFINITE))
                here[4 * LANES + lane] = min(b2, np.int32(INFINITE))
                here[5 * LANES + lane] = min(c1, np.int32(INFINITE))
                here[6 * LANES + lane] = min(c2, np.int32(INFINITE))
            if is_last:
                for lane in range(LANES):
                    best = here[lane]
                    if best < INFINITE:
                        mean = np.float32(best >> LENGTH_BITS) / np.float32(best & LENGTH_MASK)
                        out[lane] = min(out[lane], mean)
        now[(high + 2) * CELL :] = INFINITE


@jit_inline
def _least(cells: IntArray, first: int, end: int) -> int:
    """Return the place of the least of some cells, the first of equal ones."""
    least = first
    for i in range(first + 1, end):
        if cells[i] < cells[least]:
            least = i
    return least


@jit
def backtrack(distances: Any, n_source: int, n_target: int, matched: Any, work: Any) -> int:
    """Find the best path of one pair of words, and what each frame of the source is matched with.

    Parameters
    ----------
    distances : (N, M) of int32
    matched : (N,) of float64
        Filled with the mean target frame of each matched source frame; later ones go on frame
        by frame.
    work : (N, M, 7) of int64
        Room for the states: diagonal, one to three steps along the target, one to three along
        the source.

    Returns
    -------
    int
        How many source frames the path matches.
    """
    none = np.int64(1) << 40
    work[:] = none
    best_mean, end_i, end_j = 1e30, -1, -1
    for i in range(n_source):
        for j in range(n_target):
            cost = np.int64(distances[i, j]) * (LENGTH_MASK + 1) + 1
            if i == 0 and j == 0:
                work[0, 0, 0] = cost
                continue
            if i > 0 and j > 0:
                corner = work[i - 1, j - 1]
                work[i, j, 0] = corner[_least(corner, 0, 7)] + cost
            if j > 0:
                left = work[i, j - 1]
                work[i, j, 1] = min(left[0], left[_least(left, 4, 7)]) + cost
                work[i, j, 2] = left[1] + cost
                work[i, j, 3] = left[2] + cost
            if i > 0:
                up = work[i - 1, j]
                work[i, j, 4] = up[_least(up, 0, 4)] + cost
                work[i, j, 5] = up[4] + cost
                work[i, j, 6] = up[5] + cost
            is_last = i == n_source - 1 or j == n_target - 1
            if is_last and min(i, j) + 1 >= LEAST_MATCHED:
                best = work[i, j, _least(work[i, j], 0, 7)]
                if best < none:
                    mean = (best >> LENGTH_BITS) / (best & LENGTH_MASK)
                    if mean < best_mean:
                        best_mean, end_i, end_j = mean, i, j
    counts = np.zeros(n_source)
    matched[:] = 0.0
    i, j, state = end_i, end_j, _least(work[end_i, end_j], 0, 7)
    while True:
        matched[i] += j
        counts[i] += 1
        if i == 0 and j == 0:
            break
        if state == 0:
            i, j = i - 1, j - 1
            state = _least(work[i, j], 0, 7)
        elif state <= LONGEST_RUN:
            j -= 1
            if state > 1:
                state -= 1
            else:  # the step before was not along the target
                state = _least(work[i, j], 4, 7)
                state = 0 if work[i, j, 0] <= work[i, j, state] else state
        else:
            i -= 1
            state = state - 1 if state > LONGEST_RUN + 1 else _least(work[i, j], 0, 4)
    for i in range(n_source):
        matched[i] = matched[i] / counts[i] if counts[i] > 0 else matched[i - 1] + 1.0
    return end_i + 1
