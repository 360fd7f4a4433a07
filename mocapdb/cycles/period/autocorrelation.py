"""The period of a motion by autocorrelation: quick, and right where cohomology fails.

A motion is laid over itself some time later, and what the two differ by is compared with how much
they vary. Two unrelated stretches differ by as much as they vary; a lap and the next by far less.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.tuning import (
    CLEAR_DIFFERENCE,
    LEAST_LAPS,
    LEAST_PERIOD_FRAMES,
    NEAR_LOWEST,
    PERIOD_REACH,
    UNRELATED_DIFFERENCE,
)
from mocapdb.errors import NoPeriodError

__all__ = ["PeriodGuess", "guess_period", "lag_differences", "refined_period"]

STILL = 1e-9  # share of the variance below which rounding is all that is left


class PeriodGuess(NamedTuple):
    """A period and how clear it is.

    Attributes
    ----------
    frames : float
        The period in frames.
    clarity : float
        1 where the motion repeats exactly, 0 where a period later it is as different as ever.
    """

    frames: float
    clarity: float


def lag_differences(cloud: FloatArray) -> FloatArray:
    """Return how much a cloud (F, D) differs from itself at each lag.

    Returns
    -------
    (L,)
        For lags of 0 to F / 1.15; 0 where it repeats, about 1 where it does not.

    Notes
    -----
    The variance of the difference, over the sum of the variances of the two stretches that
    overlap: rest before and after a motion does not make it repeat. What posture has changed
    between the two counts against the whole motion's variance.
    """
    n_frames = len(cloud)
    lags = np.arange(max(2, int(n_frames / LEAST_LAPS)))
    overlap = n_frames - lags
    centred = cloud - cloud.mean(axis=0)
    squares = np.concatenate([[0.0], np.cumsum((centred**2).sum(axis=1))])
    sums = np.vstack([np.zeros(centred.shape[1]), np.cumsum(centred, axis=0)])
    size = _fast_length(n_frames + len(lags))
    spectrum = np.zeros(size // 2 + 1)
    for column in centred.T:
        spectrum += np.abs(np.fft.rfft(column, size)) ** 2
    products = np.fft.irfft(spectrum, size)[: len(lags)] / overlap
    of_first, of_last = squares[overlap] / overlap, (squares[-1] - squares[lags]) / overlap
    first = sums[overlap] / overlap[:, None]
    last = (sums[-1] - sums[lags]) / overlap[:, None]
    shift = ((last - first) ** 2).sum(axis=1)
    difference = of_first + of_last - 2.0 * products - shift
    variances = of_first + of_last - (first**2).sum(axis=1) - (last**2).sum(axis=1)
    whole = max(squares[-1] / n_frames, 1e-300)
    ratio = np.maximum(difference, 0.0) / np.maximum(variances, STILL * whole)
    return np.asarray(ratio + shift / (2.0 * whole))


def _fast_length(least: int) -> int:
    """Return the first number from `least` on that has no prime factors but 2, 3 and 5."""
    size = least
    while True:
        rest = size
        for factor in (2, 3, 5):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return size
        size += 1


def guess_period(cloud: FloatArray) -> PeriodGuess:
    """Return the period of a motion, whatever its shape.

    Parameters
    ----------
    cloud : (F, D)
        One row a frame, such as joint positions.

    Raises
    ------
    NoPeriodError
        If the motion stands still, is too short, or does not come back to where it was.

    Notes
    -----
    The first minimum that is clear is taken, and not the lowest: a multiple of the period is as
    good a match as the period itself (de Cheveigne and Kawahara, "YIN, a fundamental frequency
    estimator for speech and music", 2002, section 2.D).
    """
    if len(cloud) < 2 * LEAST_PERIOD_FRAMES:
        raise NoPeriodError(
            f"Expected {2 * LEAST_PERIOD_FRAMES} frames at least, but got {len(cloud)}: too short "
            "to hold a period."
        )
    if np.ptp(cloud, axis=0).max(initial=0.0) < 1e-9:
        raise NoPeriodError("Expected a motion, but every frame has the same pose.")
    difference = lag_differences(cloud)
    inner = difference[1:-1]
    minima = np.flatnonzero((inner <= difference[:-2]) & (inner < difference[2:])) + 1
    # within a lap the motion gets as far from itself as unrelated ones
    risen = np.maximum.accumulate(difference)[minima] > UNRELATED_DIFFERENCE
    minima = minima[risen & (minima >= LEAST_PERIOD_FRAMES)]
    lowest = float(difference[minima].min(initial=1.0))
    if lowest > UNRELATED_DIFFERENCE:
        raise NoPeriodError(
            f"Expected a motion that repeats, but in {len(cloud)} frames no pose comes back: the "
            f"least difference of two laps is {lowest:.2f} of their variance, and "
            f"{UNRELATED_DIFFERENCE} is needed. Choose a range with two laps or more."
        )
    enough = max(CLEAR_DIFFERENCE, NEAR_LOWEST * lowest)
    return _guess(difference, int(minima[difference[minima] <= enough][0]))


def refined_period(cloud: FloatArray, near: float) -> PeriodGuess:
    """Return the period of a motion (F, D) that is known to about a tenth."""
    difference = lag_differences(cloud)
    first = max(1, round((1.0 - PERIOD_REACH) * near))
    last = min(len(difference) - 1, round((1.0 + PERIOD_REACH) * near) + 1)
    if first >= last:
        return PeriodGuess(near, 0.0)
    return _guess(difference, first + int(np.argmin(difference[first:last])))


def _guess(difference: FloatArray, lag: int) -> PeriodGuess:
    """Return a period between whole frames: where a parabola through three has its least."""
    before, at, after = difference[lag - 1 : lag + 2]
    bend = before - 2.0 * at + after
    offset = 0.5 * (before - after) / bend if bend > 0 else 0.0
    return PeriodGuess(lag + float(np.clip(offset, -1.0, 1.0)), float(np.clip(1.0 - at, 0, 1)))
