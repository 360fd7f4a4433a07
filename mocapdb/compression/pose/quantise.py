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
    context_of,
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
    columns: FloatArray,
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
    columns : (C, F)
        The channels as they were.
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
    for t in range(len(goal)):
        row = rows[t]
        own = factors[row, channel, channel]
        feedback = 0.0
        for j in range(channel + 1, n_channels):
            feedback += factors[row, channel, j] * errors[t, j]
        goal[t] = columns[channel, t] + feedback / own
        weights[t] = own * own


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
    first_sizes = new_first_sizes()
    choices = np.zeros((n, beam_width), dtype=np.int64)
    origins = np.zeros((n, beam_width), dtype=np.int64)
    # what each kept path knows: those of now, and room for the next ones
    now, following = 0, beam_width
    filters, memory = new_filters(2 * beam_width), new_size_memory(2 * beam_width)
    errors = np.zeros((2 * beam_width, 3))
    distance = np.zeros(2 * beam_width)
    bits = np.zeros(2 * beam_width)
    states = np.zeros(2 * beam_width, dtype=np.int64)
    predictions = np.zeros(2 * beam_width, dtype=np.int64)
    # what the candidates for the next value are
    candidate_cost = np.empty(3 * beam_width)
    candidate_distance = np.empty(3 * beam_width)
    candidate_bits = np.empty(3 * beam_width)
    candidate_value = np.empty(3 * beam_width, dtype=np.int64)
    candidate_origin = np.empty(3 * beam_width, dtype=np.int64)
    candidate_index = np.empty(3 * beam_width, dtype=np.int64)
    cheapest = np.empty(beam_width, dtype=np.int64)
    n_slots = SIZE_SLOTS  # of a memory that are in use
    last_predicted = 0  # filters are of no use after it
    for k in range(n):
        n_slots = max(n_slots, SIZE_SLOTS + bands[k])
        if bands[k] == 0:
            last_predicted = k

    n_kept = 1
    for k in range(n):
        band = bands[k]
        weight = factor[k, 0]
        share_0, share_1, share_2 = (
            factor[k, 1] / weight,
            factor[k, 2] / weight,
            factor[k, 3] / weight,
        )
        n_candidates, n_best = 0, 0
        limit = np.inf  # of what a candidate may cost
        for m in range(now, now + n_kept):
            aimed = best[k]
            if k > 0:
                aimed -= share_0 * errors[m, 0]
            if k > 1:
                aimed -= share_1 * errors[m, 1]
            if k > 2:
                aimed -= share_2 * errors[m, 2]
            # where weights nearly vanish, making up for errors could run away
            aimed = min(max(aimed, -VALUE_LIMIT / 2), VALUE_LIMIT / 2)
            expected = predictions[m] if band == 0 else 0
            odd = states[m] >> 1
            # the nearest points of this state's quantiser on either side, and no remainder
            wanted = aimed - expected
            context, shift = 0, 0
            if k == 0:
                low, step = int(np.floor(wanted)), 1
            else:
                low, step = 2 * int(np.floor((wanted - odd) / 2)) + odd, 2
                prepare_sizes(memory, m, first_sizes, band)
                context, shift = context_of(expected_size(memory, m, band))
            for option in range(3):
                level = low + option * step
                if option == 2:
                    level = 0
                    if k == 0 or abs(wanted) > ZERO_REACH or low == 0 or low + step == 0:
                        continue
                value = expected + level
                miss = weight * (value - aimed)
                far = distance[m] + miss * miss
                if far + bit_cost * bits[m] > limit:
                    continue
                index = index_of(level, odd) if k > 0 else 0
                cost = bits[m]
                cost += (
                    FIRST_VALUE_BITS
                    if k == 0
                    else estimate_bits(index, context, shift, SYMBOL_BITS)
                )
                total = far + bit_cost * cost
                if not total < limit:
                    continue
                c = n_candidates
                candidate_cost[c] = total
                candidate_distance[c] = far
                candidate_bits[c] = cost
                candidate_value[c] = value
                candidate_origin[c] = m
                candidate_index[c] = index
                n_candidates += 1
                # inserted among the best so far, after those that cost the same
                place = min(n_best, beam_width - 1)
                while place > 0 and total < candidate_cost[cheapest[place - 1]]:
                    cheapest[place] = cheapest[place - 1]
                    place -= 1
                cheapest[place] = c
                n_best = min(n_best + 1, beam_width)
                limit = candidate_cost[cheapest[0]] + BEAM_SLACK * bit_cost
                if n_best == beam_width:
                    limit = min(limit, candidate_cost[cheapest[beam_width - 1]])

        limit = candidate_cost[cheapest[0]] + BEAM_SLACK * bit_cost
        n_kept = 0
        while n_kept < n_best and candidate_cost[cheapest[n_kept]] <= limit:
            c = cheapest[n_kept]
            m = candidate_origin[c]
            to = following + n_kept
            value = candidate_value[c]
            choices[k, n_kept] = value
            origins[k, n_kept] = m - now
            distance[to] = candidate_distance[c]
            bits[to] = candidate_bits[c]
            errors[to, 0] = value - best[k]
            errors[to, 1] = errors[m, 0]
            errors[to, 2] = errors[m, 1]
            for i in range(n_slots):
                memory[to, i] = memory[m, i]
            if k > 0:
                update_sizes(memory, to, band, candidate_index[c])
                states[to] = next_state(states[m], candidate_index[c])
            if band == 0:
                advance_filters(filters, m, to, value, k == 0)
                predictions[to] = predict(filters, to)
            elif k < last_predicted:
                for i in range(filters.shape[1]):
                    filters[to, i] = filters[m, i]
                predictions[to] = predictions[m]
            n_kept += 1
        now, following = following, now

    path = np.empty(n, dtype=np.int64)
    m = 0
    for k in range(n - 1, -1, -1):
        path[k] = choices[k, m]
        m = origins[k, m]
    return path, bits[now]
