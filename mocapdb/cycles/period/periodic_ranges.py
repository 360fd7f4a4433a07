"""Where in a clip something repeats: ranges of frames, each with its own period.

Every stretch of a clip is compared with the one a lap later, for every length of a lap. The paper's
own method, by circular coordinates that move, is in `excitation`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.cycles.period.autocorrelation import PeriodGuess, guess_period, refined_period
from mocapdb.cycles.tuning import (
    ANALYSIS_HZ,
    CLEAR_PERIOD,
    COMPARABLE_PATH,
    END_DIFFERENCE,
    END_TEMPO,
    END_TOLERANCE,
    END_VARIANCE,
    END_WINDOW_LAPS,
    LAG_REACH,
    LAPS_BEYOND_DOUBT,
    LEAST_LAPS_OF_RANGE,
    LEAST_VARIANCE,
    LONGEST_PERIOD_S,
    MOST_RANGES,
    POSTURE_WEIGHT,
    SHARE_REPEATED,
    SHORTER_PERIOD,
    SHORTER_PERIOD_PATH,
    SHORTEST_PERIOD_S,
    SIMILAR_DIFFERENCE,
    TEMPO_CHANGE,
    UNRELATED_DIFFERENCE,
    WINDOW_LAPS,
)
from mocapdb.errors import NoPeriodError
from mocapdb.motion.frame_range import FrameRange

__all__ = ["PeriodicRange", "periodic_ranges", "repeating_ranges"]


@dataclass(frozen=True)
class PeriodicRange(FrameRange):
    """Frames ``start:end`` in which a motion repeats.

    Attributes
    ----------
    period_frames : float
    clarity : float
        1 where it repeats exactly, 0 where poses a period apart are unrelated.
    path_length : float
        How far the joints travel in the laps after the first, in the unit of the positions.
    """

    period_frames: float
    clarity: float
    path_length: float


def repeating_ranges(positions: FloatArray, fps: float) -> list[PeriodicRange]:
    """Return where a motion repeats, what is most likely meant by it first.

    That is the whole clip, without what differs at its ends, if it repeats, or else each range in
    which something does, the one in which the joints travel farthest first.

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
    thinned, stride = _thin(positions, fps)
    lag = max(1, round(guess.frames / stride))
    free = np.ones(len(thinned), dtype=bool)
    start, end = _trim_ends(thinned, 0, len(thinned), lag, free, SIMILAR_DIFFERENCE)
    whole = _in_all_frames(positions, thinned, stride, start, end, guess.frames)
    if guess.clarity <= CLEAR_PERIOD or _share_repeated(thinned[start:end], lag) < SHARE_REPEATED:
        return [*_farthest_first(periodic_ranges(positions, fps)), whole]
    if len(positions) < LAPS_BEYOND_DOUBT * guess.frames:
        parts = periodic_ranges(positions, fps, longest_s=SHORTER_PERIOD * guess.frames / fps)
        if sum(part.path_length for part in parts) > SHORTER_PERIOD_PATH * whole.path_length:
            return _farthest_first(parts)
    return [whole]


def periodic_ranges(
    positions: FloatArray, fps: float, longest_s: float = LONGEST_PERIOD_S
) -> list[PeriodicRange]:
    """Return the ranges of a motion that repeat for 1.65 laps or more, in order.

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
    joints travel farthest beyond the first lap is taken, of several in which they travel nearly as
    far the one of the shortest period; then that of what is left.
    """
    thinned, stride = _thin(positions, fps)
    rate = fps / stride
    lags = np.arange(max(3, int(SHORTEST_PERIOD_S * rate)), int(longest_s * rate) + 1)
    lags = lags[lags + np.rint(WINDOW_LAPS * lags) < len(thinned)]
    differences = _stretch_differences(thinned, lags)
    least = [differences[np.abs(lags / lag - 1.0) <= TEMPO_CHANGE].min(axis=0) for lag in lags]
    path = _path_lengths(thinned)
    free = np.ones(len(thinned), dtype=bool)
    found: list[PeriodicRange] = []
    while len(found) < MOST_RANGES:
        runs = [
            (path[end] - path[start + lag], int(lag), start, end)
            for lag, own in zip(lags, least, strict=True)
            for start, end in _longest_run(own, int(lag), free)
        ]
        if not runs:
            break
        enough = COMPARABLE_PATH * max(runs)[0]
        _, lag, start, end = min((run for run in runs if run[0] >= enough), key=lambda r: r[1])
        lag = _best_lag(differences, lags, lag, start, end)
        first, last = _trim_ends(thinned, start, end, lag, free, END_DIFFERENCE)
        part = _in_all_frames(positions, thinned, stride, first, last, lag * stride)
        free[start:end] = free[first:last] = False
        if len(part) >= LEAST_LAPS_OF_RANGE * part.period_frames:
            found.append(part)
    return sorted(found, key=lambda part: part.start)


def _farthest_first(ranges: list[PeriodicRange]) -> list[PeriodicRange]:
    return sorted(ranges, key=lambda found: -found.path_length)


def _thin(positions: FloatArray, fps: float) -> tuple[FloatArray, int]:
    """Return every so many frames, at 30 Hz or a little more, and how many."""
    stride = max(1, round(fps / ANALYSIS_HZ))
    return positions[::stride] - positions.mean(axis=0), stride


def _path_lengths(positions: FloatArray) -> FloatArray:
    """Return (F + 1,) how far the joints have travelled before each frame."""
    steps = np.linalg.norm(np.diff(positions, axis=0, prepend=positions[:1]), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _in_all_frames(
    positions: FloatArray, thinned: FloatArray, stride: int, start: int, end: int, period: float
) -> PeriodicRange:
    """Return a range of thinned frames as one of all frames, its period refined."""
    first = start * stride
    last = len(positions) if end == len(thinned) else end * stride
    guess = _shortest_period(positions[first:last], period)
    path = _path_lengths(thinned[start:end])
    lap = min(max(1, round(guess.frames / stride)), end - start)
    return PeriodicRange(first, last, guess.frames, guess.clarity, float(path[-1] - path[lap]))


def _shortest_period(part: FloatArray, near: float) -> PeriodGuess:
    """Return the period of a range: what it was found by, or a part of that if that repeats too."""
    refined = refined_period(part, near)
    try:
        guess = guess_period(part)
    except NoPeriodError:
        return refined
    return guess if guess.frames < refined.frames else refined


def _stretch_differences(positions: FloatArray, lags: IntArray) -> FloatArray:
    """Return (L, F) how much the stretch from each frame on differs from the one a lag later.

    Relative to the variance of both: 1 if they are unrelated, and where the body hardly moves, or
    the clip ends too soon.
    """
    sums = np.vstack([np.zeros(positions.shape[1]), np.cumsum(positions, axis=0)])
    squares = np.concatenate([[0.0], np.cumsum((positions**2).sum(axis=1))])
    still = 2.0 * max(LEAST_VARIANCE * squares[-1] / len(positions), 1e-12)
    found = np.ones((len(lags), len(positions)))
    for own, lag in zip(found, lags, strict=True):
        window = _window(lag)
        means = (sums[window:] - sums[:-window]) / window
        variance = (squares[window:] - squares[:-window]) / window - (means**2).sum(axis=1)
        both = variance[:-lag] + variance[lag:]
        apart = _window_means(((positions[lag:] - positions[:-lag]) ** 2).sum(axis=1), window)
        posture = ((means[lag:] - means[:-lag]) ** 2).sum(axis=1)
        moving = both > still
        ratio = own[: len(both)]
        ratio[moving] = (apart - (1.0 - POSTURE_WEIGHT) * posture)[moving] / both[moving]
    return found


def _share_repeated(positions: FloatArray, lag: int) -> float:
    """Return the share of a range's stretches that a lap later are no unrelated ones."""
    lags = np.unique(np.round(lag * np.linspace(1 - TEMPO_CHANGE, 1 + TEMPO_CHANGE, 7)).astype(int))
    n = len(positions) - int(lags[-1]) - _window(int(lags[-1])) + 1
    if n < 1:
        return 1.0
    least = _stretch_differences(positions, lags)[:, :n].min(axis=0)
    return float((least < UNRELATED_DIFFERENCE).mean())


def _window(lag: int) -> int:
    return max(3, round(WINDOW_LAPS * lag))


def _window_means(values: FloatArray, window: int) -> FloatArray:
    """Return the mean of each window, by its first value's index."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((sums[window:] - sums[:-window]) / window)


def _longest_run(difference: FloatArray, lag: int, free: BoolArray) -> list[tuple[int, int]]:
    """Return the longest run of stretches that are alike, as frames ``start:end``, if any."""
    taken = np.concatenate([[0], np.cumsum(~free)])
    reach = lag + _window(lag)
    inside = taken[reach:] == taken[:-reach]
    good = np.flatnonzero((difference[: len(inside)] < SIMILAR_DIFFERENCE) & inside)
    if len(good) == 0:
        return []
    runs = np.split(good, np.flatnonzero(np.diff(good) > 1) + 1)
    run = max(runs, key=len)
    return [(int(run[0]), int(run[-1]) + reach)]


def _best_lag(differences: FloatArray, lags: IntArray, lag: int, start: int, end: int) -> int:
    """Return the lag around another at which the stretches of a range differ least."""
    near = np.flatnonzero(np.abs(lags / lag - 1.0) <= LAG_REACH)
    means = [
        differences[i, start : max(start + 1, end - lags[i] - _window(lags[i]) + 1)].mean()
        for i in near
    ]
    return int(lags[near[np.argmin(means)]])


def _lap_variance(positions: FloatArray, lag: int) -> FloatArray:
    """Return how much the poses of the lap from each frame on vary."""
    means = sum(_window_means(column, lag) ** 2 for column in positions.T)
    return np.asarray(_window_means((positions**2).sum(axis=1), lag) - means)


def _trim_ends(
    positions: FloatArray, start: int, end: int, lag: int, free: BoolArray, least: float
) -> tuple[int, int]:
    """Move the ends of a range to where the pose still is like the one a lap later, or before.

    Two laps that are alike on the whole may begin or end with something else, and more than they
    may repeat. How alike is judged by the middle of the range, from `least` to
    `SIMILAR_DIFFERENCE`.
    """
    slack = max(1, round(END_TEMPO * lag))
    n = len(positions) - lag - slack
    window = max(1, int(END_WINDOW_LAPS * lag))
    if n <= window:
        return start, end
    lags = range(lag - slack, lag + slack + 1)
    apart = np.min(
        [((positions[i : i + n] - positions[:n]) ** 2).sum(axis=1) for i in lags], axis=0
    )
    apart = _window_means(apart, window) / max(2.0 * positions[start:end].var(axis=0).sum(), 1e-12)
    last = max(start, min(end - lag - window, len(apart) - 1))
    usual = float(np.median(apart[start : last + 1]))
    alike = apart < np.clip(END_TOLERANCE * usual, least, SIMILAR_DIFFERENCE)
    variance = _lap_variance(positions, lag)[: len(alike)]
    # rest is like rest: no lap
    alike &= variance > END_VARIANCE * variance[start : last + 1].max()
    good = start + np.flatnonzero(alike[start : last + 1])
    if len(good) == 0:
        return start, end
    first, last = int(good[0]), int(good[-1])
    while first > 0 and alike[first - 1] and free[first - 1]:
        first -= 1
    while last + 1 < len(alike) and alike[last + 1] and free[last + window + lag]:
        last += 1
    stop = last + window + lag + (slack if last + 1 == len(alike) else 0)
    return (first, stop) if stop - first >= LEAST_LAPS_OF_RANGE * lag else (start, end)
