"""An adaptive range coder in integers, the same on every machine.

One function serves both directions, so that a reader cannot disagree with the writer:
``code_symbol(coder, data, models, context, symbol)`` writes `symbol` if the coder writes and
returns the symbol that it reads if it reads.

A *coder* is the small integer array that `new_writer` or `new_reader` gives. *Models* are adaptive
distributions over `N_SYMBOLS` symbols, one a context, each the mean of one that learns fast and one
that learns slowly (no mixing weights, so nothing to go wrong between machines).

After Martin, *Range encoding* (1979), with carries resolved in the output, and the adaptive
cumulative distributions of the AV1 video codec.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import ByteArray, FloatArray, IntArray
from mocapdb.base.kernels import jit, jit_inline

__all__ = [
    "N_SYMBOLS",
    "ModelArray",
    "code_bit",
    "code_bits",
    "code_number",
    "code_signed",
    "code_symbol",
    "finish_writer",
    "new_models",
    "new_reader",
    "new_writer",
]

N_SYMBOLS = 16
_TOTAL_BITS = 15
_TOTAL = 1 << _TOTAL_BITS
_RAW_BITS = 12  # at most so many bits at once without a model
_TOP = 1 << 32
_BOTTOM = 1 << 24

# A model is the upper bounds of its symbols, twice: of one that learns fast and one that learns
# slowly. When a symbol comes, they move by 1/16 and 1/64 of the way to where it has everything but
# 1 for each of the others.
_RATE_BITS = 6
_RATES = np.repeat(np.array([4, 1], dtype=np.int32), N_SYMBOLS)
_GOALS = np.array(
    [
        [i + 1 + (_TOTAL - N_SYMBOLS if i >= symbol else 0) for i in range(N_SYMBOLS)] * 2
        for symbol in range(N_SYMBOLS)
    ],
    dtype=np.int32,
)

# what the slots of a coder hold
_LOW, _RANGE, _AT, _READING = 0, 1, 2, 3

ModelArray: TypeAlias = NDArray[np.int32]


def new_models(probabilities: FloatArray) -> ModelArray:
    """Return models (contexts, 2 * N_SYMBOLS) that start from some probabilities.

    Parameters
    ----------
    probabilities : (contexts, N_SYMBOLS)
        Rows that sum to 1; every symbol stays possible, however small its own.
    """
    share = (_TOTAL - N_SYMBOLS) * np.cumsum(probabilities, axis=1)
    cumulative = np.floor(share).astype(np.int32) + np.arange(1, N_SYMBOLS + 1, dtype=np.int32)
    cumulative[:, -1] = _TOTAL
    return np.concatenate([cumulative, cumulative], axis=1)


def new_writer() -> IntArray:
    """Return a coder that writes."""
    return np.array([0, _TOP - 1, 0, 0], dtype=np.int64)


def new_reader(data: ByteArray) -> IntArray:
    """Return a coder at the start of some bytes; beyond their end it reads zeros.

    The bytes have to be writable, for the functions that read are those that write.
    """
    code = int.from_bytes(data[:4].tobytes().ljust(4, b"\0"), "big")
    return np.array([min(code, _TOP - 2), _TOP - 1, 4, 1], dtype=np.int64)


def finish_writer(coder: IntArray, data: ByteArray) -> bytes:
    """Return the bytes written: as few as tell the last interval from every other."""
    low, width, at = int(coder[_LOW]), int(coder[_RANGE]), int(coder[_AT])
    for n_bytes in range(5):
        spare = (1 << (32 - 8 * n_bytes)) - 1
        value = (low + spare) & ~spare
        if value < low + width:
            break
    written = int.from_bytes(data[:at].tobytes(), "big") * 256**4 + value
    return written.to_bytes(at + 4, "big").rstrip(b"\0")


@jit_inline
def code_symbol(
    coder: IntArray, data: ByteArray, models: ModelArray, context: int, symbol: int
) -> int:
    """Write or read one of `N_SYMBOLS` symbols, and let its context's model learn it."""
    n_bounds = models.shape[1]  # loops as long as an array become vector instructions
    if coder[_READING]:
        value = np.int32(_peek(coder, _TOTAL_BITS))
        passed = np.int32(0)
        for i in range(n_bounds >> 1):
            bound = np.int32(models[context, i] + models[context, N_SYMBOLS + i]) >> 1
            passed = np.int32(passed + np.int32(np.int32(bound) <= value))
        symbol = int(passed)
    below = 0
    if symbol > 0:
        below = (models[context, symbol - 1] + models[context, N_SYMBOLS + symbol - 1]) >> 1
    above = (models[context, symbol] + models[context, N_SYMBOLS + symbol]) >> 1
    _narrow(coder, data, below, above - below, _TOTAL_BITS)
    for i in range(n_bounds):
        way = np.int32(_GOALS[symbol, i] - models[context, i])
        models[context, i] += np.int32(way * _RATES[i]) >> _RATE_BITS
    return symbol


@jit_inline
def code_bit(coder: IntArray, data: ByteArray, bit: int) -> int:
    """Write or read one bit, as likely 0 as 1."""
    if coder[_READING]:
        bit = int(coder[_LOW] >= coder[_RANGE] >> 1)
    _narrow(coder, data, bit, 1, 1)
    return bit


@jit
def code_bits(coder: IntArray, data: ByteArray, n_bits: int, value: int) -> int:
    """Write or read a number of so many bits, all values alike; the highest bits first."""
    result = 0
    while n_bits > 0:
        n = min(n_bits, _RAW_BITS)
        n_bits -= n
        part = _peek(coder, n) if coder[_READING] else (value >> n_bits) & ((1 << n) - 1)
        _narrow(coder, data, part, 1, n)
        result = (result << n) | part
    return result


@jit
def code_number(
    coder: IntArray, data: ByteArray, models: ModelArray, context: int, value: int, most_bits: int
) -> int:
    """Write or read a number from 0 to ``2**most_bits - 1``: its length by a model, then its bits.

    Lengths take two symbols where `N_SYMBOLS` do not suffice, from `context` and the one after it.
    """
    length = 0
    while (value >> length) > 0:
        length += 1
    last = N_SYMBOLS - 1
    head = code_symbol(coder, data, models, context, min(length, last))
    if head == last:
        length = last + code_symbol(coder, data, models, context + 1, min(length, 2 * last) - last)
    else:
        length = head
    length = min(length, most_bits)
    if length <= 1:
        return length
    return (1 << (length - 1)) | code_bits(
        coder, data, length - 1, value & ((1 << (length - 1)) - 1)
    )


@jit
def code_signed(
    coder: IntArray, data: ByteArray, models: ModelArray, context: int, value: int, most_bits: int
) -> int:
    """Write or read a number with a sign, folded: 0, -1, 1, -2, 2... are 0, 1, 2, 3, 4..."""
    folded = 2 * value if value >= 0 else -2 * value - 1
    folded = code_number(coder, data, models, context, folded, most_bits)
    return -((folded + 1) >> 1) if folded & 1 else folded >> 1


@jit_inline
def _peek(coder: IntArray, n_bits: int) -> int:
    value: int = coder[_LOW] // (coder[_RANGE] >> n_bits)
    return min(value, (1 << n_bits) - 1)  # the cap matters for damaged bytes only


@jit_inline
def _narrow(coder: IntArray, data: ByteArray, below: int, width: int, n_bits: int) -> None:
    """Cut the interval down to `width` parts of ``2**n_bits`` after the first `below`."""
    part = coder[_RANGE] >> n_bits
    coder[_RANGE] = part * width
    reading = coder[_READING]
    if reading:
        # no writer points beyond the interval; held inside it, damaged bytes cannot do harm
        coder[_LOW] = min(coder[_LOW] - part * below, coder[_RANGE] - 1)
    else:
        coder[_LOW] += part * below
        if coder[_LOW] >= _TOP:
            coder[_LOW] -= _TOP
            at = coder[_AT] - 1
            while data[at] == 255:
                data[at] = 0
                at -= 1
            data[at] += 1
    while coder[_RANGE] < _BOTTOM:
        coder[_RANGE] <<= 8
        at = coder[_AT]
        coder[_AT] += 1
        if reading:
            following = data[at] if at < len(data) else 0
            coder[_LOW] = (coder[_LOW] << 8) | following
        else:
            data[at] = coder[_LOW] >> 24
            coder[_LOW] = (coder[_LOW] & (_BOTTOM - 1)) << 8
