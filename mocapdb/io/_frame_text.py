"""Reading frames of numbers out of text, fast and exactly.

A frame is a fixed pattern of lines: each starts with a known word (a joint's name in an AMC, no
word in a BVH) and goes on with a known count of numbers. The kernel reads as long as the text
keeps to the pattern; whoever calls it reads the file line by line when it does not, and finds
either a legal oddity or the error to report.

Every value is the double nearest to its text, as Python's ``float`` gives it. Up to 18 digits and
a small power of ten, that takes one division or product of two exact doubles (Clinger, *How to
Read Floating Point Numbers Accurately*, 1990, section 3), else a product of double-doubles; the
rare tokens that neither decides go to ``float``.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from mocapdb.base.arrays import ByteArray, FloatArray, IntArray
from mocapdb.base.kernels import jit, jit_inline
from mocapdb.io._text import Text

__all__ = ["Pattern", "read_frames"]

EASY, HARD, WRONG = 0, 1, 2

TAB, NEWLINE, RETURN, SPACE = 9, 10, 13, 32
PLUS, MINUS, POINT, ZERO, UPPER_E, LOWER_E = 43, 45, 46, 48, 69, 101

# Positions are unsigned: numba need not look for negative indices then, and reads faster by half.
# They stay unsigned only as long as what is added to them is.
Position: TypeAlias = Any
ONE = np.uintp(1)

MOST_DIGITS = 18  # of an int64 that cannot overflow
EXACT_INTEGER = 2**53
EXACT_POWER = 22
MOST_POWER = 60
UNDECIDED = 2.0**-98  # bound of the relative error of a product of two double-doubles, with room
SPLITTER = 2.0**27 + 1
POWERS = [Fraction(10) ** power for power in range(-MOST_POWER, MOST_POWER + 1)]
POWER_HIGH = np.array([float(power) for power in POWERS])
POWER_LOW = np.array([float(power - Fraction(float(power))) for power in POWERS])


class Pattern(NamedTuple):
    """The lines that make a frame.

    Parameters
    ----------
    words : sequence of bytes
        What each line starts with.
    columns : sequence of sequences of int
        For each line the column that each of its numbers goes to.
    first_number : int
        Number of the first frame where each frame starts with its number on a line of its own,
        counting up by one; -1 where frames have no numbers.
    """

    words: Sequence[bytes]
    columns: Sequence[Sequence[int]]
    first_number: int = -1


def read_frames(
    text: Text, start: int, pattern: Pattern, n_channels: int, most_frames: int
) -> FloatArray | None:
    """Read all frames from byte `start` on.

    Parameters
    ----------
    text : Text
        The file.
    start : int
        Byte at which the first frame's first line starts.
    pattern : Pattern
        What a frame looks like.
    n_channels : int
        Count of columns C.
    most_frames : int
        Count of frames that there can be.

    Returns
    -------
    (F, C) array or None
        None where the text breaks the pattern anywhere, or a number is too large for a double.
    """
    channels = np.empty((most_frames, n_channels))
    n_frames, hard = _read_frames(
        text.array,
        start,
        np.frombuffer(b"".join(pattern.words), dtype=np.uint8),
        _stops(pattern.words),
        np.array([column for columns in pattern.columns for column in columns], dtype=np.int64),
        _stops(pattern.columns),
        pattern.first_number,
        channels,
    )
    if n_frames < 0:
        return None
    for frame, column, first, last in hard.tolist():
        channels[frame, column] = float(text.data[first:last])
    if not np.isfinite(channels[hard[:, 0], hard[:, 1]]).all():
        return None
    return channels if n_frames == most_frames else channels[:n_frames].copy()


def _stops(parts: Sequence[Sequence[Any]]) -> IntArray:
    """Return where each part ends when all are joined."""
    return np.cumsum([len(part) for part in parts], dtype=np.int64)


@jit
def _read_frames(
    text: ByteArray,
    start: int,
    words: ByteArray,
    word_stops: IntArray,
    columns: IntArray,
    column_stops: IntArray,
    first_number: int,
    channels: FloatArray,
) -> tuple[int, IntArray]:
    """Fill `channels`; return the count of frames, or -1, and the tokens left to ``float``.

    The text must end with a line break: no loop below needs to look for the end of the array.
    """
    hard = np.empty((64, 4), dtype=np.int64)  # frame, column, start, stop
    n_hard = 0
    at: Position = np.uintp(start)
    end = np.uintp(len(text))
    frame = 0
    while True:
        while at < end and (_is_blank(text[at]) or text[at] == NEWLINE):
            at += ONE
        if at == end:
            return frame, hard[:n_hard]
        if frame == len(channels):
            return -1, hard[:n_hard]
        if first_number >= 0:
            number, at = _read_integer(text, at)
            at = _skip_blanks(text, at)
            if number != first_number + frame or text[at] != NEWLINE:
                return -1, hard[:n_hard]
            at += ONE
        word_start = column_start = 0
        for line in range(len(word_stops)):
            at = _skip_blanks(text, at)
            for i in range(word_start, word_stops[line]):
                if text[at] != words[i]:  # no word has a line break, so the text cannot run out
                    return -1, hard[:n_hard]
                at += ONE
            if word_stops[line] > word_start and not _is_blank(text[at]):
                return -1, hard[:n_hard]
            for i in range(column_start, column_stops[line]):
                at = _skip_blanks(text, at)
                value, stop, kind = _read_number(text, at)
                if kind == WRONG or not (_is_blank(text[stop]) or text[stop] == NEWLINE):
                    return -1, hard[:n_hard]
                channels[frame, columns[i]] = value
                if kind == HARD:
                    if n_hard == len(hard):
                        larger = np.empty((2 * n_hard, 4), dtype=np.int64)
                        for k in range(n_hard):
                            for j in range(4):
                                larger[k, j] = hard[k, j]
                        hard = larger
                    hard[n_hard, 0] = frame
                    hard[n_hard, 1] = columns[i]
                    hard[n_hard, 2] = at
                    hard[n_hard, 3] = stop
                    n_hard += 1
                at = stop
            at = _skip_blanks(text, at)
            if text[at] != NEWLINE:
                return -1, hard[:n_hard]
            at += ONE
            word_start = word_stops[line]
            column_start = column_stops[line]
        frame += 1


@jit
def _is_blank(byte: Any) -> bool:
    """Tell whether a byte parts words; the carriage return of a CRLF counts."""
    return byte in (SPACE, TAB, RETURN)


@jit
def _skip_blanks(text: ByteArray, at: Position) -> Position:
    """Return where the next word or the line break is."""
    while _is_blank(text[at]):
        at += ONE
    return at


@jit
def _read_integer(text: ByteArray, at: Position) -> tuple[int, Position]:
    """Return the digits at a byte as a number, or -1, and where they stop."""
    start = at
    value: Any = 0
    while ZERO <= text[at] < ZERO + 10:
        value = 10 * value + (text[at] - ZERO)
        at += ONE
    return value if start < at <= start + np.uintp(MOST_DIGITS) else -1, at


@jit_inline  # a call for every number would cost a third of the speed
def _read_number(text: ByteArray, at: Position) -> tuple[float, Position, int]:
    """Return the number at a byte, where it stops, and whether it is easy, hard or wrong."""
    negative = text[at] == MINUS
    if negative or text[at] == PLUS:
        at += ONE
    mantissa: Any = 0
    exponent: Any = 0
    start = at
    while ZERO <= text[at] < ZERO + 10:
        mantissa = 10 * mantissa + (text[at] - ZERO)
        at += ONE
    n_digits = np.int64(at - start)
    if text[at] == POINT:
        at += ONE
        start = at
        while ZERO <= text[at] < ZERO + 10:
            mantissa = 10 * mantissa + (text[at] - ZERO)
            at += ONE
        exponent = -np.int64(at - start)
        n_digits -= exponent
    if n_digits == 0:
        return 0.0, at, WRONG
    if text[at] == LOWER_E or text[at] == UPPER_E:
        at += ONE
        shrinks = text[at] == MINUS
        if shrinks or text[at] == PLUS:
            at += ONE
        power, at = _read_integer(text, at)
        if power < 0:
            return 0.0, at, WRONG
        exponent += -power if shrinks else power
    if n_digits > MOST_DIGITS:
        return 0.0, at, HARD
    if mantissa <= EXACT_INTEGER and abs(exponent) <= EXACT_POWER:
        value = float(mantissa)
        if exponent < 0:
            value /= POWER_HIGH[MOST_POWER - exponent]
        else:
            value *= POWER_HIGH[MOST_POWER + exponent]
    elif abs(exponent) <= MOST_POWER:
        value, sure = _scaled(mantissa, exponent)
        if not sure:
            return 0.0, at, HARD
    else:
        return 0.0, at, HARD
    return -value if negative else value, at, EASY


@jit
def _scaled(mantissa: int, exponent: int) -> tuple[float, bool]:
    """Return ``mantissa * 10**exponent`` rounded to a double, and whether that is sure.

    The product is formed as the unevaluated sum of two doubles (Dekker, *A Floating-Point
    Technique for Extending the Available Precision*, 1971). It is sure when both ends of its
    error interval round to the same double.
    """
    power = POWER_HIGH[MOST_POWER + exponent]
    whole = float(mantissa)
    rest = float(mantissa - np.int64(whole))
    product = whole * power
    whole_high = SPLITTER * whole - (SPLITTER * whole - whole)
    power_high = SPLITTER * power - (SPLITTER * power - power)
    whole_low = whole - whole_high
    power_low = power - power_high
    error = whole_low * power_low - (
        ((product - whole_high * power_high) - whole_low * power_high) - whole_high * power_low
    )
    tail = error + (whole * POWER_LOW[MOST_POWER + exponent] + rest * power)
    doubt = product * UNDECIDED
    least = product + (tail - doubt)
    return least, least == product + (tail + doubt)
