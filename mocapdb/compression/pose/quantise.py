"""The search for integers: errors cancel each other on the skin, and the integers cost few bits.

The error that quantisation leaves on the skin is, to first order, the norm of ``R e`` in every
frame (see `skin_metric`). R is upper triangular, so channels are quantised one after the other,
last joint first and root last, and each makes up for the errors of those before it: Babai's
nearest-plane algorithm in the lattice that R spans. It costs the decoder nothing.

Within a channel the same holds over time, with the triangular factor of a spline's fit. There a
beam search (the M-algorithm) keeps the few paths of least rate-distortion cost: squared error plus
bits times what a bit costs, the bits being those that the integers take after the decoder's own
prediction.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import ByteArray, FloatArray, IntArray
from mocapdb.base.kernels import jit, jit_sums
from mocapdb.compression.pose.entropy import (
    SIZE_SLOTS,
    SYMBOL_BITS,
    VALUE_LIMIT,
    advance_filters,
    estimate_bits,
    expected_size,
    index_of,
    new_filters,
    new_first_sizes,
    new_size_memory,
    next_state,
    predict,
    prepare_sizes,
    update_sizes,
)
from mocapdb.compression.tuning import BEAM_SLACK, FIRST_VALUE_BITS, ZERO_REACH

__all__ = ["beam_search", "feed_back_errors"]


@jit_sums
def feed_back_errors(
    values: FloatArray,
    factors: FloatArray,
    rows: IntArray,
    errors: FloatArray,
    channel: int,
    goal: FloatArray,
    weights: FloatArray,
) -> None:
    """Find what a channel should be, given the errors of the channels quantised before it.

    Parameters
    ----------
    values : (F,)
        The channel as it was.
    factors : (N, C, C)
        R of some frames.
    rows : (F,)
        Which of them is that of each frame.
    errors : (F, C)
        Of the channels after this one: original less decoded.
    channel : int
    goal, weights : (F,)
        Written: the values to quantise, and what a squared error of theirs costs.
    """
    n_channels = errors.shape[1]
    for t in range(len(values)):
        row = factors[rows[t], channel]
        feedback = 0.0
        for j in range(channel + 1, n_channels):
            feedback += row[j] * errors[t, j]
        goal[t] = values[t] + feedback / row[channel]
        weights[t] = row[channel] * row[channel]


@jit
def beam_search(
    best: FloatArray, factor: FloatArray, bands: ByteArray, bit_cost: float, beam_width: int
) -> tuple[IntArray, float]:
    """Return integers near `best` that cost few bits.

    Parameters
    ----------
    best : (N,)
        The best coefficients, in steps.
    factor : (N, 4)
        What errors cost, per step (see `spline.factorise`).
    bands : (N,) or more
        The band of every integer (see `entropy`).
    bit_cost : float
        What a bit costs, in squared error.
    beam_width : int
        How many paths are kept.

    Returns
    -------
    (N,) integers
    float, about how many bits they take
    """
    n = len(best)
    for k in range(n):
        if not abs(best[k]) < VALUE_LIMIT / 2:
            return np.zeros(n, dtype=np.int64), np.inf
    empty_filters, empty_memory, first_sizes = new_filters(), new_size_memory(), new_first_sizes()
    choices = np.zeros((n, beam_width), dtype=np.int64)
    origins = np.zeros((n, beam_width), dtype=np.int64)
    # what each kept path knows, and room for the next ones
    filters = np.zeros((2, beam_width, *empty_filters.shape), dtype=np.int64)
    memory = np.zeros((2, beam_width, *empty_memory.shape), dtype=np.int64)
    errors = np.zeros((2, beam_width, 3))
    distance = np.zeros((2, beam_width))
    bits = np.zeros((2, beam_width))
    # what the candidates for the next value are
    candidate_cost = np.empty(3 * beam_width)
    candidate_distance = np.empty(3 * beam_width)
    candidate_bits = np.empty(3 * beam_width)
    candidate_value = np.empty(3 * beam_width, dtype=np.int64)
    candidate_origin = np.empty(3 * beam_width, dtype=np.int64)
    candidate_index = np.empty(3 * beam_width, dtype=np.int64)
    cheapest = np.empty(beam_width, dtype=np.int64)
    shares = np.empty(3)
    states = np.zeros((2, beam_width), dtype=np.int64)
    predictions = np.zeros((2, beam_width), dtype=np.int64)
    n_slots = SIZE_SLOTS  # of a memory that are in use
    for k in range(n):
        n_slots = max(n_slots, SIZE_SLOTS + bands[k])

    n_kept = 1
    now = 0
    for k in range(n):
        band = bands[k]
        n_candidates, n_best = 0, 0
        for d in range(3):
            shares[d] = factor[k, d + 1] / factor[k, 0]
        for m in range(n_kept):
            aimed = best[k]
            for d in range(min(3, k)):
                aimed -= shares[d] * errors[now, m, d]
            # where weights nearly vanish, making up for errors could run away
            aimed = min(max(aimed, -VALUE_LIMIT / 2), VALUE_LIMIT / 2)
            expected = predictions[now, m] if band == 0 else 0
            if k > 0:
                prepare_sizes(memory[now, m], first_sizes, band)
            size = expected_size(memory[now, m], band)
            odd = states[now, m] >> 1
            # the nearest points of this state's quantiser on either side, and no remainder
            wanted = aimed - expected
            if k == 0:
                low, step = int(np.floor(wanted)), 1
            else:
                low, step = 2 * int(np.floor((wanted - odd) / 2)) + odd, 2
            for option in range(3):
                level = low + option * step
                if option == 2:
                    level = 0
                    if k == 0 or abs(wanted) > ZERO_REACH or low == 0 or low + step == 0:
                        continue
                value = expected + level
                index = index_of(level, odd) if k > 0 else 0
                cost = FIRST_VALUE_BITS if k == 0 else estimate_bits(index, size, SYMBOL_BITS)
                miss = factor[k, 0] * (value - aimed)
                c = n_candidates
                candidate_distance[c] = distance[now, m] + miss * miss
                candidate_bits[c] = bits[now, m] + cost
                candidate_value[c] = value
                candidate_origin[c] = m
                candidate_index[c] = index
                n_candidates += 1
                # inserted among the best so far, after those that cost the same
                total = candidate_distance[c] + bit_cost * candidate_bits[c]
                candidate_cost[c] = total
                place = min(n_best, beam_width - 1)
                if n_best == beam_width and not total < candidate_cost[cheapest[place]]:
                    continue
                while place > 0 and total < candidate_cost[cheapest[place - 1]]:
                    cheapest[place] = cheapest[place - 1]
                    place -= 1
                cheapest[place] = c
                n_best = min(n_best + 1, beam_width)

        limit = candidate_cost[cheapest[0]] + BEAM_SLACK * bit_cost
        n_kept = 1
        while n_kept < n_best and candidate_cost[cheapest[n_kept]] <= limit:
            n_kept += 1
        following = 1 - now
        for kept in range(n_kept):
            c = cheapest[kept]
            m = candidate_origin[c]
            value = candidate_value[c]
            choices[k, kept] = value
            origins[k, kept] = m
            distance[following, kept] = candidate_distance[c]
            bits[following, kept] = candidate_bits[c]
            errors[following, kept, 0] = value - best[k]
            errors[following, kept, 1] = errors[now, m, 0]
            errors[following, kept, 2] = errors[now, m, 1]
            for i in range(n_slots):  # compiles in a fraction of the time of a slice
                memory[following, kept, i] = memory[now, m, i]
            if k > 0:
                update_sizes(memory[following, kept], band, candidate_index[c])
                states[following, kept] = next_state(states[now, m], candidate_index[c])
            if band == 0:
                advance_filters(filters[now, m], filters[following, kept], value, k == 0)
                predictions[following, kept] = predict(filters[following, kept])
            elif k > 0:
                for i in range(filters.shape[2]):
                    filters[following, kept, i] = filters[now, m, i]
                predictions[following, kept] = predictions[now, m]
        now = following

    path = np.empty(n, dtype=np.int64)
    m = 0
    for k in range(n - 1, -1, -1):
        path[k] = choices[k, m]
        m = origins[k, m]
    return path, bits[now, 0]
