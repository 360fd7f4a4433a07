"""Tracks: the sequences of integers that channels become, predicted and entropy-coded.

A bank of small Kalman filters (level, trend and bend) predicts every value; the prediction is the
mean of the two filters that did best lately. The residual, called the *level*, is coded by an
adaptive model. Its context is the size of the last levels, and the activity, at the same frames, of
the channels coded before this one. All of it in integers.

Levels come from two interleaved quantisers: the even numbers, or zero and the odd numbers. The
parities of the indices so far tell which one is next (trellis-coded quantisation with four states:
Marcellin and Fischer, *Trellis coded quantization*, 1990; in the form of the VVC video standard).
The encoder chooses a path through the trellis, whose error is smaller than that of rounding.

The values of a track belong to *bands*: all of a spline's to band 0, the coefficients of a
transform to a band each few frequencies. Only band 0 is predicted, and each band remembers the size
of its own levels.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import ByteArray, FloatArray, IntArray
from mocapdb.base.kernels import jit, jit_inline
from mocapdb.compression.pose.range_coder import (
    N_SYMBOLS,
    ModelArray,
    code_bit,
    code_bits,
    code_number,
    code_symbol,
    new_models,
)
from mocapdb.compression.tuning import FILTER_GAINS, FIRST_SIZES

__all__ = [
    "LENGTH_CONTEXT",
    "N_BANDS",
    "SIZE_SLOTS",
    "SYMBOL_BITS",
    "VALUE_LIMIT",
    "advance_filters",
    "code_track",
    "context_of",
    "estimate_bits",
    "expected_size",
    "index_of",
    "level_of",
    "new_activity",
    "new_filters",
    "new_first_sizes",
    "new_size_memory",
    "new_track_models",
    "next_state",
    "predict",
    "prepare_sizes",
    "update_filters",
    "update_sizes",
]

VALUE_LIMIT = 1 << 26
"""Values of a track are smaller than this in magnitude."""

N_BANDS = 16
CELL_FRAMES = 2  # activity is kept in cells of so many frames

_GAINS = np.array(FILTER_GAINS, dtype=np.int64)
_N_FILTERS = _GAINS.shape[1]
# where a bank of filters keeps what each holds
_LEVEL, _TREND, _BEND, _SCORE = 0, _N_FILTERS, 2 * _N_FILTERS, 3 * _N_FILTERS
_BANK = 4 * _N_FILTERS
_FILTER_BITS = 3
_NO_FILTER = 1 << 62
_FRACTION_BITS = 16
_SCORE_DECAY = 5  # a filter's score sums its residuals, fading by 1/32 a value

_NEXT_STATE = np.array([[0, 2], [2, 0], [1, 3], [3, 1]], dtype=np.int64)

# Sizes are magnitudes of indices, times 256. A context is a quarter of an octave of size.
_SIZE_UNIT = 256
_NEUTRAL_QUARTERS = 44  # of the usual activity, 8 * _SIZE_UNIT
_SIZE_FLOOR = 8  # added to every expected size
_SMALLEST_QUARTER = 12  # 2 ** (12 / 4) / 256: three hundredths
_PLAIN_BITS_QUARTER = 40  # from 2 ** (40 / 4) / 256 = 4 on, the low bits are coded plainly
_LARGEST_QUARTER = 127
_N_PLAIN = _PLAIN_BITS_QUARTER - _SMALLEST_QUARTER
_N_SIZES = _N_PLAIN + 4
_ESCAPE_CONTEXT = 2 * _N_SIZES
_FIRST_CONTEXT = _ESCAPE_CONTEXT + 2
LENGTH_CONTEXT = _FIRST_CONTEXT + 2
"""The context of a track's length, where that has to be told."""

N_CONTEXTS = LENGTH_CONTEXT + 2

_FIRST_SIZES = np.array(FIRST_SIZES, dtype=np.int64)
_N_FIRST = len(_FIRST_SIZES)  # values at the start of a track, before its filters have settled
_FAST, _COUNT, _SLOW = 0, 1, 2  # slots of a memory; a slow size a band follows
SIZE_SLOTS = _SLOW + 1  # of a memory of one band
_SLOW_SHARES = np.array([65536 // (count + 2) for count in range(23)], dtype=np.int64)


def _geometric_table() -> FloatArray:
    """Return (contexts, N_SYMBOLS) distributions of two-sided geometric levels.

    Uses only arithmetic and square roots, which IEEE 754 rounds alike on every machine.
    """
    table = np.full((N_CONTEXTS, N_SYMBOLS), 1.0 / N_SYMBOLS)
    quarter = np.sqrt(np.sqrt(2.0))
    mean = _octaves(_SMALLEST_QUARTER) / _SIZE_UNIT
    for context in range(_N_SIZES):
        ratio = (np.sqrt(1.0 + mean * mean) - 1.0) / mean
        merged = 1 + int(context >= _N_PLAIN)  # magnitudes a symbol
        probabilities = np.empty((N_SYMBOLS - 1) * merged)
        probabilities[0] = (1.0 - ratio) / (1.0 + ratio)
        probability = 2.0 * probabilities[0]
        for i in range(1, len(probabilities)):
            probability *= ratio
            probabilities[i] = probability
        for symbol in range(N_SYMBOLS - 1):
            table[context, symbol] = 0.0
            for i in range(merged):
                table[context, symbol] += probabilities[symbol * merged + i]
        rest = 1.0
        for symbol in range(N_SYMBOLS - 1):
            rest -= table[context, symbol]
        table[context, -1] = max(rest, 0.0)
        mean *= quarter
    table[_N_SIZES : 2 * _N_SIZES] = table[:_N_SIZES]
    for context in (
        _ESCAPE_CONTEXT,
        _FIRST_CONTEXT,
    ):  # lengths of numbers: long ones are rare
        for symbol in range(N_SYMBOLS):
            table[context, symbol] = 0.4 / (1 << symbol) + 0.2 / N_SYMBOLS
    for symbol in range(8):
        table[_FIRST_CONTEXT, symbol] = 0.8 / 8 + 0.2 / N_SYMBOLS
    table[_FIRST_CONTEXT, 8:] = 0.2 / N_SYMBOLS
    return table


def _octaves(quarters: int) -> float:
    """Return ``2 ** (quarters / 4)`` by multiplication."""
    power, quarter = 1.0, float(np.sqrt(np.sqrt(2.0)))
    for _ in range(quarters):
        power *= quarter
    return power


def _quarter_table() -> ByteArray:
    """Return the number of whole quarter octaves of the numbers below 4096, 0 of 0."""
    table = np.zeros(1 << 12, dtype=np.uint8)  # 4 KB: it shares the first cache with the models
    for quarters in range(48):
        table[int(np.ceil(_octaves(quarters) - 1e-6)) :] = quarters
    return table


_TABLE = _geometric_table()
_QUARTER_TABLE = _quarter_table()
_MODELS = new_models(_TABLE)
_INVERSE_SIZES = np.array(
    [int(2.0**24 / _octaves(quarters)) for quarters in range(_LARGEST_QUARTER + 1)], dtype=np.int64
)
SYMBOL_BITS: FloatArray = -np.log2(np.maximum(_TABLE[:_N_SIZES], 1e-7))
"""What the encoder takes a symbol to cost: its bits before the models have learnt."""


def new_track_models() -> ModelArray:
    """Return the distributions that a block starts from."""
    return _MODELS.copy()


@jit
def new_filters(n_tracks: int) -> IntArray:
    """Return a bank of filters for each of some tracks, before its first value: one a row."""
    return np.zeros((n_tracks, _BANK), dtype=np.int64)


@jit
def new_size_memory(n_tracks: int) -> IntArray:
    """Return the remembered sizes of some tracks: the last ones', their number, and each band's."""
    return np.zeros((n_tracks, _SLOW + N_BANDS), dtype=np.int64)


@jit
def new_first_sizes() -> IntArray:
    """Return the usual sizes of a track's first levels."""
    return _FIRST_SIZES.copy()


@jit
def new_activity(n_frames: int) -> IntArray:
    """Return the activity of the channels coded so far, cell by cell; 2048 is the usual."""
    return np.full(n_frames // CELL_FRAMES + 2, 8 * _SIZE_UNIT)


# -- values ----------------------------------------------------------------------------------------

# Functions take an array and a row of it: in an inner loop a slice costs more than its use.


@jit_inline
def predict(filters: IntArray, row: int) -> int:
    """Return the next value of a track as its two best filters predict it."""
    # a score and its filter in one number: the two smallest are found without a branch
    best = filters[row, _SCORE] << _FILTER_BITS
    second = _NO_FILTER
    for i in range(1, _N_FILTERS):
        ranked = (filters[row, _SCORE + i] << _FILTER_BITS) | i
        second = min(second, max(best, ranked))
        best = min(best, ranked)
    total = 1 << _FRACTION_BITS
    for ranked in (best, second):
        i = ranked & (_N_FILTERS - 1)
        total += filters[row, _LEVEL + i] + filters[row, _TREND + i]
        total += filters[row, _BEND + i] >> 1
    return min(max(total >> (_FRACTION_BITS + 1), -VALUE_LIMIT), VALUE_LIMIT)


@jit_inline
def update_filters(filters: IntArray, row: int, value: int, is_first: bool) -> None:
    """Update every filter of a bank by the value that came."""
    advance_filters(filters, row, row, value, is_first)


@jit_inline
def advance_filters(filters: IntArray, row: int, into: int, value: int, is_first: bool) -> None:
    """Write into another bank what every filter becomes by the value that came."""
    position = value << _FRACTION_BITS
    if is_first:
        for i in range(_N_FILTERS):
            filters[into, _LEVEL + i] = position
            filters[into, _TREND + i] = 0
            filters[into, _BEND + i] = 0
            filters[into, _SCORE + i] = 0
        return
    for i in range(_N_FILTERS):
        trend = filters[row, _TREND + i] + filters[row, _BEND + i]
        expected = filters[row, _LEVEL + i] + filters[row, _TREND + i]
        expected += filters[row, _BEND + i] >> 1
        residual = position - expected
        score = filters[row, _SCORE + i]
        filters[into, _SCORE + i] = score + (abs(residual) >> 8) - (score >> _SCORE_DECAY)
        filters[into, _LEVEL + i] = expected + ((_GAINS[0, i] * residual) >> 16)
        filters[into, _TREND + i] = (_GAINS[3, i] * trend + _GAINS[1, i] * residual) >> 16
        filters[into, _BEND + i] = filters[row, _BEND + i] + ((_GAINS[2, i] * residual) >> 16)


# -- levels ----------------------------------------------------------------------------------------


@jit_inline
def level_of(index: int, odd: int) -> int:
    """Return the level of an index: an even number, or zero or an odd one."""
    if index > 0:
        return 2 * index - odd
    return 2 * index + odd if index < 0 else 0


@jit_inline
def index_of(level: int, odd: int) -> int:
    """Return the index of a level: the inverse of `level_of`."""
    if level > 0:
        return (level + odd) >> 1
    return -((odd - level) >> 1) if level < 0 else 0


@jit_inline
def next_state(state: int, index: int) -> int:
    """Return the state of the trellis after an index. States 2 and 3 have the odd levels."""
    following: int = _NEXT_STATE[state, index & 1]
    return following


# -- sizes -----------------------------------------------------------------------------------------


@jit_inline
def prepare_sizes(memory: IntArray, row: int, first_sizes: IntArray, band: int) -> None:
    """Set the expected sizes of a track's first values, and of a band's first."""
    count = memory[row, _COUNT]
    if band == 0 and count < _N_FIRST:
        memory[row, _FAST] = first_sizes[count]
        memory[row, _SLOW] = first_sizes[count]
    elif memory[row, _SLOW + band] == 0:
        memory[row, _SLOW + band] = memory[row, _FAST] if count > 0 else first_sizes[0]


@jit_inline
def expected_size(memory: IntArray, row: int, band: int) -> int:
    """Return the size of the next index, from the last ones and from those of its band."""
    size: int = (memory[row, _FAST] + memory[row, _SLOW + band]) >> 1
    return size + _SIZE_FLOOR


@jit_inline
def update_sizes(memory: IntArray, row: int, band: int, index: int) -> None:
    """Take the size of an index into account."""
    size = abs(index) * _SIZE_UNIT
    share = _SLOW_SHARES[min(memory[row, _COUNT] + 1, len(_SLOW_SHARES) - 1)]
    memory[row, _COUNT] += 1
    memory[row, _FAST] += ((size - memory[row, _FAST]) * 5) >> 4
    memory[row, _SLOW + band] += ((size - memory[row, _SLOW + band]) * share) >> 16


@jit_inline
def _quarters(size: int) -> int:
    """Return the number of whole quarter octaves of a positive number."""
    octaves = 0
    while size >= len(_QUARTER_TABLE):
        size >>= 8
        octaves += 8
    quarters = int(_QUARTER_TABLE[size]) + 4 * octaves
    return min(quarters, _LARGEST_QUARTER)


@jit_inline
def context_of(size: int) -> tuple[int, int]:
    """Return the context of an index of some expected size, and how many low bits are plain."""
    return _context(_quarters(size))


@jit_inline
def _context(quarters: int) -> tuple[int, int]:
    if quarters < _PLAIN_BITS_QUARTER:
        return max(quarters - _SMALLEST_QUARTER, 0), 0
    return _N_PLAIN + (quarters & 3), (quarters - _PLAIN_BITS_QUARTER + 4) >> 2


@jit_inline
def estimate_bits(index: int, context: int, shift: int, symbol_bits: FloatArray) -> float:
    """Return about how many bits an index takes in a context (see `context_of`)."""
    magnitude = abs(index)
    high = magnitude >> shift
    bits = symbol_bits[context, min(high, N_SYMBOLS - 1)] + shift
    if magnitude > 0:
        bits += 1.0
    high -= N_SYMBOLS - 1
    while high > 0:
        bits += 2.0
        high >>= 1
    return float(bits)


# -- tracks ----------------------------------------------------------------------------------------


@jit
def code_track(
    coder: IntArray,
    data: ByteArray,
    models: ModelArray,
    activity: IntArray,
    first_sizes: IntArray,
    filters: IntArray,
    memory: IntArray,
    bands: ByteArray,
    spacing: int,
    values: IntArray,
) -> None:
    """Write a track, or read it into `values`.

    Parameters
    ----------
    coder, data, models
        See `range_coder`.
    activity : (cells,), first_sizes : (4,)
        Contexts that pass from track to track: this one is coded with them and updates them.
    filters, memory
        New ones of one track.
    bands : (N,) or more
        The band of every value.
    spacing : int
        Frames from a value to the next; 0 if values are not in the order of time.
    values : (N,)
    """
    reading = coder[3] == 1
    last_cell = len(activity) - 1
    state = 0
    for k in range(len(values)):
        if k == 0:
            values[0] = _code_start(coder, data, models, values[0])
            update_filters(filters, 0, values[0], True)
            continue
        band = bands[k]
        prepare_sizes(memory, 0, first_sizes, band)
        size = expected_size(memory, 0, band)
        own_quarters = _quarters(size)
        cell = min((k * spacing) // CELL_FRAMES, last_cell)
        quarters = own_quarters
        if spacing > 0:
            activity_quarters = _quarters(activity[cell]) - _NEUTRAL_QUARTERS
            quarters = min(max(quarters + (activity_quarters >> 1), 0), _LARGEST_QUARTER)

        odd = state >> 1
        expected = predict(filters, 0) if band == 0 else 0
        index = 0 if reading else index_of(values[k] - expected, odd)
        index = _code_index(coder, data, models, quarters, odd, index)
        if reading:
            values[k] = min(max(expected + level_of(index, odd), -VALUE_LIMIT), VALUE_LIMIT)
        state = next_state(state, index)

        magnitude = abs(index)
        if spacing > 0:
            relative_size = min((magnitude * _INVERSE_SIZES[own_quarters]) >> 8, 4 * _SIZE_UNIT)
            activity[cell] += relative_size - (activity[cell] >> 3)
        count = memory[0, _COUNT]
        if band == 0 and count < _N_FIRST:
            first_sizes[count] += (magnitude * _SIZE_UNIT - first_sizes[count]) >> 2
        update_sizes(memory, 0, band, index)
        if band == 0:
            update_filters(filters, 0, values[k], False)


@jit_inline
def _code_index(
    coder: IntArray, data: ByteArray, models: ModelArray, quarters: int, odd: int, index: int
) -> int:
    context, shift = _context(quarters)
    last = N_SYMBOLS - 1
    magnitude = abs(index)
    high = code_symbol(coder, data, models, context + odd * _N_SIZES, min(magnitude >> shift, last))
    if high == last:
        high += code_number(coder, data, models, _ESCAPE_CONTEXT, (magnitude >> shift) - last, 28)
    if shift > 0:
        low = code_bits(coder, data, shift, magnitude & ((1 << shift) - 1))
        high = (high << shift) | low
    magnitude = min(high, VALUE_LIMIT)
    if magnitude > 0 and code_bit(coder, data, int(index < 0)):
        return -magnitude
    return magnitude


@jit
def _code_start(coder: IntArray, data: ByteArray, models: ModelArray, value: int) -> int:
    magnitude = min(code_number(coder, data, models, _FIRST_CONTEXT, abs(value), 27), VALUE_LIMIT)
    if magnitude > 0 and code_bit(coder, data, int(value < 0)):
        return -magnitude
    return magnitude
