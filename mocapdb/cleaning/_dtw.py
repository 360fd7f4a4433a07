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

from mocapdb._jit import jit
from mocapdb._typing import Float32Array, IntArray

__all__ = [
    "LANES",
    "LEAST_MATCHED",
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
LONGEST_RUN = 3
LEAST_MATCHED = 11
MOST_DROPPED = 3


@jit
def frame_distances(
    quats: Float32Array, frame: Float32Array, rows: IntArray, n_drop: int, out: Any, work: Any
) -> None:
    """Fill `out` with the squared distances (eq. 1) of one frame to all frames of a context.

    Parameters
    ----------
    quats : (K, 4, T)
        Context, time last.
    frame : (K, 4)
    rows : (G,)
        Joints that count.
    n_drop : int
        How many of the largest are dropped, 0 to 3.
    out : (T,) of int32
        Filled, in units.
    work : (5, T) of float32

    Notes
    -----
    The norm of the logarithm of q is half the angle of the rotation, arccos |q_w|. Its square is a
    smooth function of 1 - |q_w|, whose series needs no arccos: six terms are right to 0.1 %.
    """
    n_frames = quats.shape[2]
    total, first, second, third = work[0], work[1], work[2], work[3]
    for t in range(n_frames):
        total[t] = np.float32(0.0)
        first[t] = np.float32(0.0)
        second[t] = np.float32(0.0)
        third[t] = np.float32(0.0)
    for row in rows:
        a, b, c, d = frame[row, 0], frame[row, 1], frame[row, 2], frame[row, 3]
        x, y, z, w = quats[row, 0], quats[row, 1], quats[row, 2], quats[row, 3]
        for t in range(n_frames):
            u = np.float32(1.0) - abs(a * x[t] + b * y[t] + c * z[t] + d * w[t])
            u = u if u > np.float32(0.0) else np.float32(0.0)
            v = np.float32(16 / 1575) + u * np.float32(8 / 2079)
            v = np.float32(1 / 35) + u * v
            v = np.float32(4 / 45) + u * v
            v = np.float32(1 / 3) + u * v
            v = u * (np.float32(2.0) + u * v)
            if n_drop > 0:  # the largest so far stay behind, what they push out is counted
                low = first[t] if first[t] < v else v
                first[t] = v if first[t] < v else first[t]
                v = low
            if n_drop > 1:
                low = second[t] if second[t] < v else v
                second[t] = v if second[t] < v else second[t]
                v = low
            if n_drop > 2:
                low = third[t] if third[t] < v else v
                third[t] = v if third[t] < v else third[t]
                v = low
            total[t] += v
    for t in range(n_frames):
        units = total[t] * np.float32(1.0 / UNIT)
        out[t] = np.int32(units if units < np.float32(LARGEST) else np.float32(LARGEST))


@jit
def window_minima(row: Any, width: int, out: Any, work: Any) -> None:
    """Fill ``out[s]`` with the minimum of ``row[s : s + width]``, cut at the end of the row."""
    n = len(row)
    work[:n] = row
    done = 1
    while 2 * done <= width:  # minima over windows of twice the width, in place
        for s in range(n - done):
            work[s] = work[s] if work[s] < work[s + done] else work[s + done]
        done *= 2
    shift = width - done
    for s in range(n):
        other = work[s + shift] if s + shift < n else work[n - 1]
        out[s] = work[s] if work[s] < other else other


@jit
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
    for t in range(n_targets):
        total = np.float32(0.0)
        least = np.float32(1e30)
        bound = np.float32(1e30)
        for i in range(n_source):
            value = np.float32(minima[i, t])
            total += value
            least = value if value < least else least
            if i + 1 >= LEAST_MATCHED:
                mean = (total + extra * least) / np.float32(i + 1 + extra)
                bound = mean if mean < bound else bound
        out[t] = bound


@jit
def align(distances: Any, starts: IntArray, n_target: int, state: Any, out: Float32Array) -> None:
    """Find the distances of a word to `LANES` targets: the mean cost of the best path, in units.

    Parameters
    ----------
    distances : (N, T) of int32
        Of the word's frames to all frames of the context; T reaches `LANES` beyond the last start.
    starts : (1,)
        The first target's first frame; the others start one frame later each.
    n_target : int
        M, frames of a target.
    state : (2, 7, M + 1, LANES) of int32
        Room for two rows of cells.
    out : (LANES,)
        Filled.
    """
    start = starts[0]
    n_source = len(distances)
    for lane in range(LANES):
        out[lane] = np.float32(1e30)
    state[:] = INFINITE
    for i in range(n_source):
        now, above = state[i % 2], state[(i + 1) % 2]
        low = max(0, i // (LONGEST_RUN + 1))  # at least one in four steps is along the target
        high = min(n_target - 1, (LONGEST_RUN + 1) * i + LONGEST_RUN)
        now[:, : low + 1] = INFINITE  # column j of the word is cell j + 1
        for j in range(low, high + 1):
            any_, not_h, not_v = now[0, j + 1], now[1, j + 1], now[2, j + 1]
            h1, h2, v1, v2 = now[3, j + 1], now[4, j + 1], now[5, j + 1], now[6, j + 1]
            left_h, left_h1, left_h2 = now[1, j], now[3, j], now[4, j]
            up_v, up_v1, up_v2 = above[2, j + 1], above[5, j + 1], above[6, j + 1]
            diagonal = above[0, j]
            row = distances[i]
            is_first = i == 0 and j == 0
            is_last = (i == n_source - 1 or j == n_target - 1) and min(i, j) + 1 >= LEAST_MATCHED
            for lane in range(LANES):
                cost = row[start + j + lane] * np.int32(LENGTH_MASK + 1) + np.int32(1)
                a = cost if is_first else diagonal[lane] + cost
                b1 = left_h[lane] + cost
                b2 = left_h1[lane] + cost
                b3 = left_h2[lane] + cost
                c1 = up_v[lane] + cost
                c2 = up_v1[lane] + cost
                c3 = up_v2[lane] + cost
                h = min(b1, b2, b3)
                v = min(c1, c2, c3)
                best = min(a, h, v)
                any_[lane] = min(best, np.int32(INFINITE))
                not_h[lane] = min(a, v, np.int32(INFINITE))
                not_v[lane] = min(a, h, np.int32(INFINITE))
                h1[lane] = min(b1, np.int32(INFINITE))
                h2[lane] = min(b2, np.int32(INFINITE))
                v1[lane] = min(c1, np.int32(INFINITE))
                v2[lane] = min(c2, np.int32(INFINITE))
                if is_last and best < INFINITE:
                    mean = np.float32(best >> LENGTH_BITS) / np.float32(best & LENGTH_MASK)
                    out[lane] = min(out[lane], mean)
        if high + 2 <= n_target:
            now[:, high + 2 :] = INFINITE


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
                work[i, j, 0] = work[i - 1, j - 1].min() + cost
            if j > 0:
                left = work[i, j - 1]
                work[i, j, 1] = min(left[0], left[4:].min()) + cost
                work[i, j, 2] = left[1] + cost
                work[i, j, 3] = left[2] + cost
            if i > 0:
                up = work[i - 1, j]
                work[i, j, 4] = up[:4].min() + cost
                work[i, j, 5] = up[4] + cost
                work[i, j, 6] = up[5] + cost
            is_last = i == n_source - 1 or j == n_target - 1
            if is_last and min(i, j) + 1 >= LEAST_MATCHED:
                best = work[i, j].min()
                if best < none:
                    mean = (best >> LENGTH_BITS) / (best & LENGTH_MASK)
                    if mean < best_mean:
                        best_mean, end_i, end_j = mean, i, j
    counts = np.zeros(n_source)
    matched[:] = 0.0
    i, j, state = end_i, end_j, int(work[end_i, end_j].argmin())
    while True:
        matched[i] += j
        counts[i] += 1
        if i == 0 and j == 0:
            break
        if state == 0:
            i, j = i - 1, j - 1
            state = int(work[i, j].argmin())
        elif state <= LONGEST_RUN:
            j -= 1
            if state > 1:
                state -= 1
            else:  # the step before was not along the target
                state = int(work[i, j, 4:].argmin()) + 4
                state = 0 if work[i, j, 0] <= work[i, j, state] else state
        else:
            i -= 1
            state = state - 1 if state > LONGEST_RUN + 1 else int(work[i, j, :4].argmin())
    for i in range(n_source):
        matched[i] = matched[i] / counts[i] if counts[i] > 0 else matched[i - 1] + 1.0
    return end_i + 1
