"""Where in a clip something repeats: ranges of frames, each with its own period.

Every stretch of a clip is compared with the one a lap later, for every length of a lap. The paper's
own way, by circular coordinates that move, is in `excitation`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.cycles.period.autocorrelation import PeriodGuess, guess_period, refined_period
from mocapdb.errors import NoPeriodError

__all__ = ["PeriodicRange", "periodic_ranges", "repeating_ranges"]

RATE_HZ = 30.0
PERIODS_S = (0.3, 5.0)
WINDOW = 0.75  # of a lap, compared with the same part of the next
TEMPO = 0.07  # how much longer or shorter the next lap may be
POSTURE = 0.25  # weight of a change of posture from lap to lap, beside what the motion does
ALIKE = 0.25  # of the difference of unrelated stretches
MORE_ALIKE = 0.5
THROUGHOUT = 0.75  # of a whole clip's stretches
LIVELY = 0.003  # of the whole clip's variance
ALMOST_AS_MUCH = 0.7
NEIGHBOURS = 0.25
MOST_RANGES = 12
LEAST_LAPS_OF_PART = 1.65  # in a long clip two stretches may be alike by chance
END_WINDOW = 0.12  # of a lap
END_TEMPO = 0.03
MOVING = 0.1  # of the liveliest lap's variance
LIKE_USUAL = 5.0  # times the difference in the middle of a range
VERY_ALIKE = 0.05
CLEAR = 0.75
CLEARLY_REPEATED = 2.2  # laps: fewer may be one long way and back, made of many short laps
MUCH_SHORTER = 0.6
MOST_OF_THE_WAY = 0.5


class PeriodicRange(NamedTuple):
    """Frames ``start:stop`` in which a motion repeats.

    Attributes
    ----------
    start, stop : int
    period_frames : float
    clarity : float
        1 where it repeats exactly, 0 where poses a period apart are unrelated.
    way : float
        How far the joints go in the laps after the first, in the unit of the positions.
    """

    start: int
    stop: int
    period_frames: float
    clarity: float
    way: float


def repeating_ranges(positions: FloatArray, fps: float) -> list[PeriodicRange]:
    """Return where a motion repeats, what is most likely meant by it first.

    That is the whole clip, without loose ends, if it repeats, or else each range in which
    something does, the one in which the joints go farthest first.

    Parameters
    ----------
    positions : (F, D)
        Joint positions seen from the root, or their principal axes.
    fps : float, frames per second

    Raises
    ------
    NoPeriodError
        If nothing repeats.
    """
    try:
        guess = guess_period(positions)
    except NoPeriodError:
        found = _farthest_first(periodic_ranges(positions, fps))
        if not found:
            raise
        return found
    some, stride = _fewer(positions, fps)
    lag = max(1, round(guess.frames / stride))
    start, stop = _fitted_ends(some, 0, len(some), lag, np.ones(len(some), dtype=bool), ALIKE)
    whole = _in_frames(positions, some, stride, start, stop, guess.frames)
    if guess.clarity <= CLEAR or _share_alike(some[start:stop], lag) < THROUGHOUT:
        return [*_farthest_first(periodic_ranges(positions, fps)), whole]
    if len(positions) < CLEARLY_REPEATED * guess.frames:
        parts = periodic_ranges(positions, fps, longest_s=MUCH_SHORTER * guess.frames / fps)
        if sum(part.way for part in parts) > MOST_OF_THE_WAY * whole.way:
            return _farthest_first(parts)
    return [whole]


def periodic_ranges(
    positions: FloatArray, fps: float, longest_s: float = PERIODS_S[1]
) -> list[PeriodicRange]:
    """Return the ranges of a motion that repeat for 1.75 laps or more, in order.

    Parameters
    ----------
    positions : (F, D)
        Joint positions seen from the root, or their principal axes.
    fps : float, frames per second
    longest_s : float, seconds
        Longer periods are not looked at.

    Notes
    -----
    For every period from 0.3 s on, each window of three quarters of a lap is compared with the
    same part of the next lap, relative to how much poses vary in them. The range in which the
    joints go farthest beyond the first lap is taken, of several that go nearly as far the one of
    the shortest period; then that of what is left.
    """
    some, stride = _fewer(positions, fps)
    rate = fps / stride
    lags = np.arange(max(3, int(PERIODS_S[0] * rate)), int(longest_s * rate) + 1)
    lags = lags[lags + np.rint(WINDOW * lags) < len(some)]
    differences = _differences(some, lags)
    tolerant = [differences[np.abs(lags / lag - 1.0) <= TEMPO].min(axis=0) for lag in lags]
    way = _way(some)
    free = np.ones(len(some), dtype=bool)
    found: list[PeriodicRange] = []
    while len(found) < MOST_RANGES:
        runs = [
            (way[stop] - way[start + lag], int(lag), start, stop)
            for lag, own in zip(lags, tolerant, strict=True)
            for start, stop in _longest(own, int(lag), free)
        ]
        if not runs:
            break
        enough = ALMOST_AS_MUCH * max(runs)[0]
        _, lag, start, stop = min((run for run in runs if run[0] >= enough), key=lambda r: r[1])
        lag = _best_lag(differences, lags, lag, start, stop)
        first, last = _fitted_ends(some, start, stop, lag, free)
        part = _in_frames(positions, some, stride, first, last, lag * stride)
        free[start:stop] = free[first:last] = False
        if part.stop - part.start >= LEAST_LAPS_OF_PART * part.period_frames:
            found.append(part)
    return sorted(found)


def _farthest_first(ranges: list[PeriodicRange]) -> list[PeriodicRange]:
    return sorted(ranges, key=lambda found: -found.way)


def _fewer(positions: FloatArray, fps: float) -> tuple[FloatArray, int]:
    """Return every so many frames, at 30 Hz or a little more, and how many."""
    stride = max(1, round(fps / RATE_HZ))
    return positions[::stride] - positions.mean(axis=0), stride


def _way(some: FloatArray) -> FloatArray:
    """Return (F + 1,) how far the joints have gone before each frame."""
    steps = np.linalg.norm(np.diff(some, axis=0, prepend=some[:1]), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _in_frames(
    positions: FloatArray, some: FloatArray, stride: int, start: int, stop: int, period: float
) -> PeriodicRange:
    """Return a range of the frames that were looked at as one of all frames, its period refined."""
    first = start * stride
    last = len(positions) if stop == len(some) else stop * stride
    guess = _period(positions[first:last], period)
    way = _way(some[start:stop])
    lap = min(max(1, round(guess.frames / stride)), stop - start)
    return PeriodicRange(first, last, guess.frames, guess.clarity, float(way[-1] - way[lap]))


def _period(part: FloatArray, near: float) -> PeriodGuess:
    """Return the period of a range: what it was found by, or a part of that if that repeats too."""
    refined = refined_period(part, near)
    try:
        guess = guess_period(part)
    except NoPeriodError:
        return refined
    return guess if guess.frames < refined.frames else refined


def _differences(some: FloatArray, lags: IntArray) -> FloatArray:
    """Return (L, F) how much the stretch from each frame on differs from the one a lag later.

    Relative to the variance of both: 1 if they are unrelated, and where the body hardly moves, or
    the clip ends too soon.
    """
    sums = np.vstack([np.zeros(some.shape[1]), np.cumsum(some, axis=0)])
    squares = np.concatenate([[0.0], np.cumsum((some**2).sum(axis=1))])
    still = 2.0 * max(LIVELY * squares[-1] / len(some), 1e-12)
    found = np.ones((len(lags), len(some)))
    for own, lag in zip(found, lags, strict=True):
        window = _window(lag)
        means = (sums[window:] - sums[:-window]) / window
        variance = (squares[window:] - squares[:-window]) / window - (means**2).sum(axis=1)
        both = variance[:-lag] + variance[lag:]
        apart = _boxcar(((some[lag:] - some[:-lag]) ** 2).sum(axis=1), window)
        shift = ((means[lag:] - means[:-lag]) ** 2).sum(axis=1)
        moving = both > still
        ratio = own[: len(both)]
        ratio[moving] = (apart - (1.0 - POSTURE) * shift)[moving] / both[moving]
    return found


def _share_alike(some: FloatArray, lag: int) -> float:
    """Return the share of a range's stretches that are more alike than not to those a lap later."""
    lags = np.unique(np.round(lag * np.linspace(1 - TEMPO, 1 + TEMPO, 7)).astype(np.int64))
    n = len(some) - int(lags[-1]) - _window(int(lags[-1])) + 1
    if n < 1:
        return 1.0
    return float((_differences(some, lags)[:, :n].min(axis=0) < MORE_ALIKE).mean())


def _window(lag: int) -> int:
    return max(3, round(WINDOW * lag))


def _boxcar(values: FloatArray, window: int) -> FloatArray:
    """Return the mean of each window, by its first value's index."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((sums[window:] - sums[:-window]) / window)


def _longest(difference: FloatArray, lag: int, free: BoolArray) -> list[tuple[int, int]]:
    """Return the longest run of stretches that are alike, as frames ``start:stop``, if any."""
    taken = np.concatenate([[0], np.cumsum(~free)])
    reach = lag + _window(lag)
    inside = taken[reach:] == taken[:-reach]
    good = np.flatnonzero((difference[: len(inside)] < ALIKE) & inside)
    if len(good) == 0:
        return []
    runs = np.split(good, np.flatnonzero(np.diff(good) > 1) + 1)
    run = max(runs, key=len)
    return [(int(run[0]), int(run[-1]) + reach)]


def _best_lag(differences: FloatArray, lags: IntArray, lag: int, start: int, stop: int) -> int:
    """Return the lag around another at which the stretches of a range differ least."""
    near = np.flatnonzero(np.abs(lags / lag - 1.0) <= NEIGHBOURS)
    means = [
        differences[i, start : max(start + 1, stop - lags[i] - _window(lags[i]) + 1)].mean()
        for i in near
    ]
    return int(lags[near[np.argmin(means)]])


def _lap_variance(some: FloatArray, lag: int) -> FloatArray:
    """Return how much the poses of the lap from each frame on vary."""
    means = sum(_boxcar(column, lag) ** 2 for column in some.T)
    return np.asarray(_boxcar((some**2).sum(axis=1), lag) - means)


def _fitted_ends(
    some: FloatArray,
    start: int,
    stop: int,
    lag: int,
    free: BoolArray,
    least: float = VERY_ALIKE,
) -> tuple[int, int]:
    """Move the ends of a range to where the pose still is like the one a lap later, or before.

    Two laps that are alike on the whole may begin or end with something else, and more than they
    may repeat. How alike is judged by the middle of the range, from `least` to `ALIKE`.
    """
    slack = max(1, round(END_TEMPO * lag))
    n = len(some) - lag - slack
    window = max(1, int(END_WINDOW * lag))
    if n <= window:
        return start, stop
    lags = range(lag - slack, lag + slack + 1)
    apart = np.min([((some[i : i + n] - some[:n]) ** 2).sum(axis=1) for i in lags], axis=0)
    apart = _boxcar(apart, window) / max(2.0 * some[start:stop].var(axis=0).sum(), 1e-12)
    last = max(start, min(stop - lag - window, len(apart) - 1))
    usual = float(np.median(apart[start : last + 1]))
    alike = apart < np.clip(LIKE_USUAL * usual, least, ALIKE)
    variance = _lap_variance(some, lag)[: len(alike)]
    alike &= variance > MOVING * variance[start : last + 1].max()  # rest is like rest: no lap
    good = start + np.flatnonzero(alike[start : last + 1])
    if len(good) == 0:
        return start, stop
    first, last = int(good[0]), int(good[-1])
    while first > 0 and alike[first - 1] and free[first - 1]:
        first -= 1
    while last + 1 < len(alike) and alike[last + 1] and free[last + window + lag]:
        last += 1
    end = last + window + lag + (slack if last + 1 == len(alike) else 0)
    return (first, end) if end - first >= LEAST_LAPS_OF_PART * lag else (start, stop)
