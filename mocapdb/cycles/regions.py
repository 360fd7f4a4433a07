"""Where in a clip something repeats: ranges of frames, each with its own period.

`periodic_ranges`      by comparing each stretch with the one a period later
`excitation_regions`   by circular coordinates that move (Vejdemo-Johansson et al. 2015, 4.6)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocapdb._typing import BoolArray, FloatArray
from mocapdb.cycles.cohomology import CircularCoordinates
from mocapdb.cycles.phase import unwrapped
from mocapdb.errors import NoPeriodError

__all__ = ["Excitation", "PeriodicRange", "excitation_regions", "periodic_ranges"]

RATE_HZ = 30.0
PERIODS_S = (0.3, 5.0)
ALIKE = 0.25  # of the difference of unrelated poses
LIVELY = 0.01  # of the whole clip's variance
ALMOST_AS_LONG = 0.7
MOST_RANGES = 12


class PeriodicRange(NamedTuple):
    """Frames ``start:stop`` in which a motion repeats.

    Attributes
    ----------
    start, stop : int
    period_frames : float
    clarity : float
        1 where it repeats exactly, 0 where poses a period apart are unrelated.
    """

    start: int
    stop: int
    period_frames: float
    clarity: float


def periodic_ranges(positions: FloatArray, fps: float) -> list[PeriodicRange]:
    """Return the ranges of a motion that repeat for two laps or more, in order.

    Parameters
    ----------
    positions : (F, D)
        Joint positions seen from the root, or their principal axes.
    fps : float, frames per second

    Notes
    -----
    For every period from 0.3 s to 5 s, each window of a lap is compared with the next one, relative
    to how much poses vary around there. The longest range is taken, of several as long the one
    of the shortest period; then the longest of what is left.
    """
    stride = max(1, round(fps / RATE_HZ))
    some = positions[::stride] - positions.mean(axis=0)
    rate = fps / stride
    lags = np.arange(max(3, int(PERIODS_S[0] * rate)), int(PERIODS_S[1] * rate) + 1)
    free = np.ones(len(some), dtype=bool)
    found: list[PeriodicRange] = []
    lively = LIVELY * float((some**2).sum(axis=1).mean())
    differences = {
        int(lag): _difference(some, int(lag), lively) for lag in lags if 2 * lag <= len(some)
    }
    while len(found) < MOST_RANGES:
        runs = [(*run, lag) for lag, own in differences.items() for run in _longest(own, lag, free)]
        if not runs:
            break
        most = max(stop - start for start, stop, _ in runs)
        start, stop, lag = min(
            (run for run in runs if run[1] - run[0] >= ALMOST_AS_LONG * most),
            key=lambda run: (run[2], run[0] - run[1]),
        )
        near = [
            (float(differences[other][start : stop - 2 * other + 1].mean()), other)
            for other in range(lag, min(lag + max(2, lag // 4), int(lags[-1])) + 1)
            if other in differences and stop - 2 * other + 1 > start
        ]
        score, lag = min(near)
        start, stop = max(
            [(start, stop), *_longest(differences[lag], lag, free)], key=lambda run: run[1] - run[0]
        )
        free[start:stop] = False
        start, stop = _without_loose_ends(some, start, stop, lag)
        found.append(
            PeriodicRange(
                start * stride,
                min(stop * stride, len(positions)),
                float(lag * stride),
                max(0.0, 1.0 - score),
            )
        )
    return sorted(found)


def _difference(some: FloatArray, lag: int, lively: float) -> FloatArray:
    """Return for each window of two laps how much its laps differ, relative to its variance.

    1 where the body hardly moves.
    """
    apart = ((some[lag:] - some[:-lag]) ** 2).sum(axis=1)
    mean_apart = _boxcar(apart, lag)
    variance = _boxcar((some**2).sum(axis=1), 2 * lag) - sum(
        _boxcar(column, 2 * lag) ** 2 for column in some.T
    )
    n = min(len(mean_apart), len(variance))
    ratio = mean_apart[:n] / np.maximum(2.0 * variance[:n], 1e-12)
    ratio[variance[:n] <= max(lively, 1e-12)] = 1.0
    return np.asarray(ratio)


def _boxcar(values: FloatArray, window: int) -> FloatArray:
    """Return the mean of each window, by its first value's index."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((sums[window:] - sums[:-window]) / window)


def _longest(difference: FloatArray, lag: int, free: BoolArray) -> list[tuple[int, int]]:
    """Return the longest run of windows that are alike, as frames ``start:stop``, if any."""
    blocked = np.concatenate([[0], np.cumsum(~free)])
    n = len(difference)
    inside = blocked[2 * lag : 2 * lag + n] == blocked[:n]
    good = np.flatnonzero((difference < ALIKE) & inside)
    if len(good) == 0:
        return []
    runs = np.split(good, np.flatnonzero(np.diff(good) > 1) + 1)
    run = max(runs, key=len)
    return [(int(run[0]), int(run[-1]) + 2 * lag)]


def _without_loose_ends(some: FloatArray, start: int, stop: int, lag: int) -> tuple[int, int]:
    """Leave out the ends of a range that differ from the next lap for a quarter of a lap.

    Two laps that are alike on the whole may begin or end with something else.
    """
    part = some[start:stop]
    apart = ((part[lag:] - part[:-lag]) ** 2).sum(axis=1) / (2.0 * part.var(axis=0).sum())
    quarter = max(1, lag // 4)
    alike = np.flatnonzero(_boxcar(apart, min(quarter, len(apart))) < ALIKE)
    if len(alike) == 0:
        return start, stop
    first, last = int(alike[0]), int(alike[-1]) + min(quarter, len(apart)) + lag
    return start + first, start + last


class Excitation(NamedTuple):
    """A range in which one circular coordinate moves.

    Attributes
    ----------
    start, stop : int
        Frames, end-exclusive.
    rank : int
        Of the class, 0 for the most persistent.
    laps : float
        How far the coordinate goes.
    """

    start: int
    stop: int
    rank: int
    laps: float


def excitation_regions(
    cloud: FloatArray,
    *,
    n_classes: int = 3,
    stride: int = 1,
    longest_rest: int = 60,
    least_laps: float = 1.5,
) -> list[Excitation]:
    """Return where each of the most persistent circular coordinates moves.

    Parameters
    ----------
    cloud : (F, D)
        Of a clip with several motions after each other.
    n_classes : int
        How many classes are looked at.
    stride : int
        Only every so many frames are put into the complex.
    longest_rest : int, frames
        A coordinate may rest so long within a lap: it stands while the motion does what it is
        not about.
    least_laps : float
        A coordinate that goes less far is not moving, but noise.

    Raises
    ------
    NoPeriodError
        If there is no loop at all.
    """
    regions = []
    for rank in range(n_classes):
        try:
            found = CircularCoordinates(rank=rank, stride=stride).fit(cloud)
        except NoPeriodError:
            if rank == 0:
                raise
            break
        laps = unwrapped(found.coordinates_)
        way = np.abs(np.diff(laps, append=laps[-1]))
        busy = way > 0.25 * max(float(way[way > 1e-6].mean()) if np.any(way > 1e-6) else 0.0, 1e-6)
        for start, stop in _bridged(busy, longest_rest):
            far = float(abs(laps[min(stop, len(laps) - 1)] - laps[start]))
            if far >= least_laps:
                regions.append(Excitation(start, stop, rank, far))
    return sorted(regions)


def _bridged(flags: BoolArray, gap: int) -> list[tuple[int, int]]:
    """Return the runs of True as ``start:stop``, runs less than `gap` apart as one."""
    frames = np.flatnonzero(flags)
    if len(frames) == 0:
        return []
    pieces = np.split(frames, np.flatnonzero(np.diff(frames) > gap) + 1)
    return [(int(piece[0]), int(piece[-1]) + 1) for piece in pieces]
