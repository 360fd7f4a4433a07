"""The period of a motion by autocorrelation: quick, and right where topology fails.

The measure is YIN's (de Cheveigne and Kawahara, "YIN, a fundamental frequency estimator for speech
and music", 2002, section 2): the mean square difference between the motion and itself some time
later, divided by its mean over all shorter times.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocapdb._typing import FloatArray
from mocapdb.errors import NoPeriodError

__all__ = ["PeriodGuess", "guess_period", "normalised_difference"]

LARGEST_LAG = 0.75  # of the clip: less than a quarter of it says little
CLEAR = 0.2
UNCLEAR = 0.6
LEAST_PERIOD_FRAMES = 8


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


def normalised_difference(cloud: FloatArray) -> FloatArray:
    """Return YIN's cumulative-mean-normalised difference of a cloud (F, D) for each lag.

    Returns
    -------
    (L,)
        For lags of 0 to 3/4 of the frames; 1 at lag 0, near 0 at a period.
    """
    from scipy.fft import next_fast_len, rfft

    n_frames = len(cloud)
    n_lags = max(2, int(LARGEST_LAG * n_frames))
    centred = cloud - cloud.mean(axis=0)
    energy = np.concatenate([[0.0], np.cumsum((centred**2).sum(axis=1))])
    size = next_fast_len(n_frames + n_lags, real=True)
    spectrum = np.zeros(size // 2 + 1)
    for column in centred.T:
        spectrum += np.abs(rfft(column, size)) ** 2
    products = np.fft.irfft(spectrum, size)[:n_lags]
    lags = np.arange(n_lags)
    sums = energy[n_frames - lags] + (energy[n_frames] - energy[lags]) - 2.0 * products
    difference = np.maximum(sums, 0.0) / (n_frames - lags)
    so_far = np.cumsum(difference[1:]) / lags[1:]
    normalised = np.ones(n_lags)
    np.divide(difference[1:], so_far, out=normalised[1:], where=so_far > 0)
    return normalised


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
    good a match as the period itself.
    """
    if len(cloud) < 2 * LEAST_PERIOD_FRAMES:
        raise NoPeriodError(
            f"Expected {2 * LEAST_PERIOD_FRAMES} frames at least, but got {len(cloud)}: too short "
            "to hold a period."
        )
    if np.ptp(cloud, axis=0).max(initial=0.0) < 1e-9:
        raise NoPeriodError("Expected a motion, but every frame has the same pose.")
    difference = normalised_difference(cloud)
    inner = difference[1:-1]
    minima = np.flatnonzero((inner <= difference[:-2]) & (inner < difference[2:])) + 1
    minima = minima[minima >= LEAST_PERIOD_FRAMES]
    if len(minima) == 0 or difference[minima].min() > UNCLEAR:
        lowest = difference[minima].min() if len(minima) else 1.0
        raise NoPeriodError(
            f"Expected a motion that repeats, but in {len(cloud)} frames no pose comes back: the "
            f"least difference is {lowest:.2f} of the mean, and {UNCLEAR} is needed. "
            "Choose a range with two laps or more."
        )
    lowest = float(difference[minima].min())
    enough = max(CLEAR, 1.5 * lowest)
    best = int(minima[difference[minima] <= enough][0])
    return PeriodGuess(best + _vertex(*difference[best - 1 : best + 2]), 1.0 - difference[best])


def _vertex(before: float, at: float, after: float) -> float:
    """Return where a parabola through three points has its least, from the middle one."""
    bend = before - 2.0 * at + after
    return 0.0 if bend <= 0 else 0.5 * (before - after) / bend
