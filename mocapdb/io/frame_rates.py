"""The frame rate that a frame time stands for, as spelt in a file."""

from __future__ import annotations

from decimal import ROUND_DOWN, ROUND_HALF_EVEN, ROUND_HALF_UP, Decimal
from fractions import Fraction
from functools import lru_cache

from mocapdb.io.tuning import LEAST_RATE_AS_TIME

__all__ = ["nearby_rate", "rate_instead_of_time", "rate_of_frame_time"]

# The usual ones first: where the digits leave it open, 60 is meant rather than 59.94.
WHOLE_RATES = (
    *(30, 60, 120, 24, 25, 50, 100, 240, 48, 90, 200, 72, 96, 144, 150, 180, 250, 300, 360),
    *(400, 480, 500, 600, 960, 1000),
)
NTSC_RATES = tuple(Fraction(1000 * rate, 1001) for rate in (30, 60, 24, 120, 240))
RATES = (*map(Fraction, WHOLE_RATES), *NTSC_RATES)
NEARBY = 1e-5  # of a rate that was worked out of single precision
NEARLY_EXACT = Fraction(2, 10**6)  # as a float32 is, or the period of 29.97 for 30000 / 1001


def rate_instead_of_time(text: str) -> float | None:
    """Return the rate that a frame time too long for any capture must stand for, else None.

    A fraction that only in milliseconds gives a usual rate is in milliseconds, everything else is
    the rate itself.

    Examples
    --------
    >>> [rate_instead_of_time(text) for text in ("30", "33.3333", "1.0")]
    [30.0, 30.0, None]
    """
    value = Fraction(Decimal(text))
    if value < LEAST_RATE_AS_TIME:
        return None
    from_milliseconds = rate_of_frame_time(str(Decimal(text).scaleb(-3)))
    is_usual = Fraction(from_milliseconds).limit_denominator(1001) in RATES
    if value.denominator > 1 and value not in RATES and is_usual:
        return from_milliseconds
    return float(value)


@lru_cache(maxsize=64)
def rate_of_frame_time(text: str) -> float:
    """Return the frames per second that a frame time stands for.

    It is the usual rate whose period gives the text when it is rounded to the digits that were
    written, or cut off there, or kept in single precision; otherwise the text's own inverse.

    Examples
    --------
    >>> [rate_of_frame_time(text) for text in ("0.0083", "0.0333333", "0.04", "0.0125")]
    [120.0, 30.0, 25.0, 80.0]
    >>> round(rate_of_frame_time("0.0333667"), 3)
    29.97
    """
    written = Decimal(text)
    value = Fraction(written)
    for rate in RATES:
        if abs(value * rate - 1) <= NEARLY_EXACT:
            return float(rate)
    step = Decimal(1).scaleb(int(written.as_tuple().exponent))
    for roundings in ((ROUND_HALF_EVEN, ROUND_HALF_UP), (ROUND_DOWN,)):
        for rate in RATES:
            period = Decimal(rate.denominator) / Decimal(rate.numerator)
            if any(period.quantize(step, rounding) == written for rounding in roundings):
                return float(rate)
    return round(float(1 / value), 9)  # so that a frame time written in full gives its rate again


def nearby_rate(fps: float) -> float:
    """Return the usual rate that is meant where one was worked out of times in single precision.

    Any other rate is rounded to six digits.

    Examples
    --------
    >>> nearby_rate(29.9700301), nearby_rate(119.99998), nearby_rate(31.2500002)
    (29.97002997002997, 120.0, 31.25)
    """
    for rate in RATES:
        if abs(fps / float(rate) - 1) <= NEARBY:
            return float(rate)
    return float(f"{fps:.6g}")
