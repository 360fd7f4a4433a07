"""The encoder's search: integers whose errors cancel on the skin, and that code short.

The error that rounding leaves on the skin is, to first order, the norm of ``R e`` in every frame
(see `sensitivity`). R is triangular, so channels are rounded one after the other, last joint first
and root last, each aiming at what makes up best for the errors of those before it: Babai's nearest
plane in the lattice of R. It costs the decoder nothing.

Within a channel the same holds over time, with the triangular form of a spline's fit. There the
search keeps the few best beginnings (the M-algorithm) by distance plus `rate` times bits, the bits
that the integers would take after the very prediction that the decoder makes.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import ByteArray, FloatArray, IntArray
from mocapdb.base.kernels import jit, jit_sums
from mocapdb.compression.pose.entropy import (
    LIMIT,
    SYMBOL_BITS,
    cost_of,
    expected_size,
    index_of,
    new_filters,
    new_memory,
    new_starts,
    next_state,
    observe,
    predict,
    prepare,
    remember,
)

__all__ = ["BEAM", "aim", "search"]

BEAM = 8
_START_BITS = 10.0


@jit_sums
def aim(
    values: FloatArray,
    roots: FloatArray,
    stride: int,
    errors: FloatArray,
    channel: int,
    goal: FloatArray,
    weights: FloatArray,
) -> None:
    """Find what a channel should be, given what the later channels already miss.

    Parameters
    ----------
    values : (F,)
        The channel as it was.
    roots : (F / stride, C, C)
        R of every so many frames.
    stride : int
    errors : (F, C)
        What later channels lost: original less decoded.
    channel : int
    goal, weights : (F,)
        Written: the values to aim at, and what a squared miss costs.
    """
    n_channels = errors.shape[1]
    for t in range(len(values)):
        row = roots[t // stride, channel]
        feedback = 0.0
        for j in range(channel + 1, n_channels):
            feedback += row[j] * errors[t, j]
        goal[t] = values[t] + feedback / row[channel]
        weights[t] = row[channel] * row[channel]


@jit
def search(
    best: FloatArray, factor: FloatArray, bands: ByteArray, rate: float, beam: int
) -> tuple[IntArray, float]:
    """Return integers near `best` that code short.

    Parameters
    ----------
    best : (N,)
        The best coefficients, in steps.
    factor : (N, 4)
        What misses cost, per step (see `spline.factorise`).
    bands : (N,) or more
        See `track`.
    rate : float
        What a bit costs.
    beam : int
        How many beginnings are kept.

    Returns
    -------
    (N,) integers
    float, about how many bits they take
    """
    n = len(best)
    for k in range(n):
        if not abs(best[k]) < LIMIT / 2:
            return np.zeros(n, dtype=np.int64), np.inf
    empty_filters, empty_memory, starts = new_filters(), new_memory(), new_starts()
    choices = np.zeros((n, beam), dtype=np.int64)
    origins = np.zeros((n, beam), dtype=np.int64)
    # what each kept beginning knows, and room for the next ones
    filters = np.zeros((2, beam, *empty_filters.shape), dtype=np.int64)
    memory = np.zeros((2, beam, *empty_memory.shape), dtype=np.int64)
    missed = np.zeros((2, beam, 3))
    distance = np.zeros((2, beam))
    bits = np.zeros((2, beam))
    # what the candidates for the next value are
    candidate_cost = np.empty(3 * beam)
    candidate_distance = np.empty(3 * beam)
    candidate_bits = np.empty(3 * beam)
    candidate_value = np.empty(3 * beam, dtype=np.int64)
    candidate_origin = np.empty(3 * beam, dtype=np.int64)
    candidate_index = np.empty(3 * beam, dtype=np.int64)
    cheapest = np.empty(beam, dtype=np.int64)
    shares = np.empty(3)
    states = np.zeros((2, beam), dtype=np.int64)

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
                aimed -= shares[d] * missed[now, m, d]
            # where weights nearly vanish, making up for misses could run away
            aimed = min(max(aimed, -LIMIT / 2), LIMIT / 2)
            expected = predict(filters[now, m]) if band == 0 and k > 0 else 0
            if k > 0:
                prepare(memory[now, m], starts, band)
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
                    if k == 0 or abs(wanted) > 5.0 or low == 0 or low + step == 0:
                        continue
                value = expected + level
                index = index_of(level, odd) if k > 0 else 0
                cost = _START_BITS if k == 0 else cost_of(index, size, SYMBOL_BITS)
                miss = factor[k, 0] * (value - aimed)
                c = n_candidates
                candidate_distance[c] = distance[now, m] + miss * miss
                candidate_bits[c] = bits[now, m] + cost
                candidate_value[c] = value
                candidate_origin[c] = m
                candidate_index[c] = index
                n_candidates += 1
                # inserted among the best so far, after those that cost the same
                total = candidate_distance[c] + rate * candidate_bits[c]
                candidate_cost[c] = total
                place = min(n_best, beam - 1)
                if n_best == beam and not total < candidate_cost[cheapest[place]]:
                    continue
                while place > 0 and total < candidate_cost[cheapest[place - 1]]:
                    cheapest[place] = cheapest[place - 1]
                    place -= 1
                cheapest[place] = c
                n_best = min(n_best + 1, beam)

        n_kept = n_best
        following = 1 - now
        for kept in range(n_kept):
            c = cheapest[kept]
            m = candidate_origin[c]
            value = candidate_value[c]
            choices[k, kept] = value
            origins[k, kept] = m
            distance[following, kept] = candidate_distance[c]
            bits[following, kept] = candidate_bits[c]
            missed[following, kept, 0] = value - best[k]
            missed[following, kept, 1] = missed[now, m, 0]
            missed[following, kept, 2] = missed[now, m, 1]
            for i in range(memory.shape[2]):  # compiles in a fraction of the time of a slice
                memory[following, kept, i] = memory[now, m, i]
            for i in range(filters.shape[2]):
                filters[following, kept, i] = filters[now, m, i]
            if k > 0:
                remember(memory[following, kept], band, candidate_index[c])
                states[following, kept] = next_state(states[now, m], candidate_index[c])
            if band == 0:
                observe(filters[following, kept], value, k == 0)
        now = following

    path = np.empty(n, dtype=np.int64)
    m = 0
    for k in range(n - 1, -1, -1):
        path[k] = choices[k, m]
        m = origins[k, m]
    return path, bits[now, 0]
