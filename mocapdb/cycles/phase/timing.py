"""The phase of every frame of a clip: steady time, drifting time, or time told by the pose.

=============  =====================================================================================
``linear``     a steady tempo, its period refined by least squares
``drift``      a tempo that changes smoothly: a spline, refined with the curve by Gauss-Newton
``whole-laps`` the circular coordinate, evened out over whole laps
``uniform``    the circular coordinate, evened out by ranks (Raunio 2014, eq. 3.20)
``mixture``    the circular coordinate through a Gaussian mixture (Raunio 2014, eq. 3.21)
=============  =====================================================================================
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.curve.harmonics import HarmonicRegression
from mocapdb.cycles.phase.laps import (
    fit_laps,
    forwards,
    gaussian_mixture,
    uniformised,
    unwrapped,
    whole_laps,
)
from mocapdb.cycles.phase.pose_cloud import principal_axes
from mocapdb.cycles.tuning import (
    DRIFT_DEVIATION,
    DRIFT_GAIN,
    LAPS_BETWEEN_KNOTS,
    NEWTON_STEPS,
    PERIOD_AXES,
    PERIOD_SEARCHES,
    ROUGH_HARMONICS,
    STEADY_LAPS,
    TEMPO_STIFFNESS,
)
from mocapdb.errors import CycleError

__all__ = [
    "TIMINGS",
    "Timing",
    "TimingName",
    "expect_timing",
    "left_over_share",
    "tempo_change",
    "time_phases",
]

TimingName: TypeAlias = Literal["linear", "drift", "whole-laps", "uniform", "mixture"]
TIMINGS: tuple[TimingName, ...] = get_args(TimingName)
BY_COORDINATES: tuple[TimingName, ...] = ("whole-laps", "uniform", "mixture")


class Timing(NamedTuple):
    """The phase of every frame.

    Attributes
    ----------
    name : str
        Which of `TIMINGS`.
    phase : (F,)
        In laps, unwrapped.
    period_frames : float
        Mean frames of a lap.
    """

    name: TimingName
    phase: FloatArray
    period_frames: float


def time_phases(
    values: FloatArray,
    period_frames: float,
    coordinates: FloatArray | None = None,
    name: TimingName | None = None,
) -> Timing:
    """Return the phase of every frame.

    Parameters
    ----------
    values : (F, D)
        What repeats, on a few principal axes.
    period_frames : float
        A first guess, within a few percent.
    coordinates : (F,), optional
        Circular coordinates in laps; needed by all but ``"linear"`` and ``"drift"``.
    name : str, optional
        One of `TIMINGS`; by default steady time, or drifting time where that fits far better.

    Raises
    ------
    CycleError
        If the name is unknown, or coordinates are needed and missing.
    """
    if name is not None:
        expect_timing(name)
    if name in BY_COORDINATES:
        if coordinates is None:
            raise CycleError(f"Expected circular coordinates for the timing {name!r}.")
        return _by_coordinates(name, coordinates)
    if name == "linear":
        return _linear(values, period_frames)
    if name == "drift":
        return _drift(values, period_frames, coordinates)
    if len(values) > STEADY_LAPS * period_frames:
        return _drift(values, period_frames, coordinates)
    steady = _linear(values, period_frames)
    if len(values) < LAPS_BETWEEN_KNOTS * period_frames:
        return steady
    drifting = _drift(values, steady.period_frames, coordinates)
    line = np.polyval(np.polyfit(np.arange(len(values)), drifting.phase, 1), np.arange(len(values)))
    deviation = float(np.sqrt(np.mean((drifting.phase - line) ** 2)))
    gain = _left_over(values, drifting.phase) / max(_left_over(values, steady.phase), 1e-300)
    return drifting if gain < DRIFT_GAIN and deviation > DRIFT_DEVIATION else steady


def left_over_share(values: FloatArray, timing: Timing) -> float:
    """Return how much laps differ from their mean, as a share of the variance of values (F, D)."""
    axes = principal_axes(values, PERIOD_AXES)
    return _left_over(axes, timing.phase) / max(float((axes**2).sum()), 1e-300)


def tempo_change(timing: Timing) -> float:
    """Return the tempo of the quickest lap less that of the slowest, over the mean one.

    Of a tempo that drifts; time told by coordinates stands still in rests, which are no tempo.
    """
    if timing.name != "drift":
        return 0.0
    starts = np.arange(timing.phase[0], timing.phase[-1] - 1.0 + 1e-9, 0.5)
    if len(starts) < 2:
        return 0.0
    frames = np.arange(len(timing.phase), dtype=np.float64)
    lengths = np.interp(starts + 1.0, timing.phase, frames) - np.interp(
        starts, timing.phase, frames
    )
    tempi = 1.0 / np.maximum(lengths, 1e-9)
    return float(np.ptp(tempi) / tempi.mean())


def expect_timing(name: str) -> None:
    """Raise a CycleError for a name that is none of `TIMINGS`."""
    if name not in TIMINGS:
        raise CycleError(f"Expected a timing out of {', '.join(TIMINGS)}, but got {name!r}.")


def _by_coordinates(name: TimingName, coordinates: FloatArray) -> Timing:
    coordinates = forwards(coordinates)
    if name == "whole-laps":
        phase = whole_laps(unwrapped(coordinates))
    else:
        even = uniformised(coordinates) if name == "uniform" else gaussian_mixture(coordinates)
        phase = unwrapped(even)
    slope, _ = fit_laps(phase)
    return Timing(name, phase, 1.0 / max(slope, 1.0 / len(phase)))


def _linear(values: FloatArray, period_frames: float) -> Timing:
    """Search the period whose harmonics leave least."""
    frames = np.arange(len(values))
    best = period_frames
    for reach, count in PERIOD_SEARCHES:
        tried = best * (1.0 + np.linspace(-reach, reach, count))
        best = float(tried[np.argmin([_left_over(values, frames / period) for period in tried])])
    return Timing("linear", frames / best, best)


def _drift(values: FloatArray, period_frames: float, coordinates: FloatArray | None) -> Timing:
    """Fit a spline of the phase and the curve in turns, each by least squares.

    The curve's slope tells how much later in phase would fit each frame better.
    """
    n_frames = len(values)
    basis = _spline_basis(n_frames, max(1, round(n_frames / period_frames / LAPS_BETWEEN_KNOTS)))
    phase = np.arange(n_frames) / period_frames
    if coordinates is not None:
        evened = whole_laps(unwrapped(forwards(coordinates)))
        gram = (basis.T @ basis).toarray()
        gram[np.diag_indices_from(gram)] += 1e-9 * np.trace(gram)
        phase = basis @ np.linalg.solve(gram, basis.T @ evened)
    bends = np.diff(np.eye(basis.shape[1]), n=2, axis=0)
    for _ in range(NEWTON_STEPS):
        curve = HarmonicRegression(_rough_harmonics(n_frames), model="m2").fit(phase, values)
        missing = values - curve.predict(phase)
        slope = curve.predict(phase, derivative=1)
        power = (slope**2).sum(axis=1)
        gram = (basis.T @ basis.multiply(power[:, None])).toarray()
        gram += TEMPO_STIFFNESS * np.trace(gram) / len(gram) * bends.T @ bends
        gram[np.diag_indices_from(gram)] += 1e-9 * np.trace(gram)
        step = np.linalg.solve(gram, basis.T @ (slope * missing).sum(axis=1))
        phase = phase + basis @ step
    phase = np.maximum.accumulate(phase - phase[0])
    return Timing("drift", phase, (n_frames - 1) / max(float(phase[-1]), 1e-9))


def _left_over(values: FloatArray, phase: FloatArray) -> float:
    """Return the sum of squares that a few harmonics of the phase leave."""
    curve = HarmonicRegression(_rough_harmonics(len(values)), model="m2")
    return float(curve.left_over(phase, values).sum())


def _rough_harmonics(n_frames: int) -> int:
    return min(ROUGH_HARMONICS, (n_frames - 1) // 4)


def _spline_basis(n_frames: int, n_pieces: int) -> Any:
    """Return (F, n_pieces + 3) cubic B-splines with even knots over the frames, sparse.

    What scipy's ``BSpline.design_matrix`` returns, by de Boor's recurrence (*A Practical Guide to
    Splines*, 1978, chapter X); importing scipy.interpolate takes longer than all of it.
    """
    from scipy.sparse import csr_array

    step = max(n_frames - 1, 1) / n_pieces
    knots = step * np.arange(-3, n_pieces + 4)
    frames = np.minimum(np.arange(n_frames, dtype=np.float64), n_pieces * step * (1 - 1e-12))
    piece = np.clip(np.searchsorted(knots, frames, side="right") - 1, 3, n_pieces + 2)
    values = np.zeros((4, n_frames))  # of the splines that are not 0 in a frame
    values[0] = 1.0
    for degree in range(1, 4):
        lower = values.copy()
        values[0] = 0.0
        for i in range(1, degree + 1):
            right, left = knots[piece + i], knots[piece + i - degree]
            share = lower[i - 1] / (right - left)
            values[i - 1] += share * (right - frames)
            values[i] = share * (frames - left)
    first = piece[:, None] - 3
    return csr_array(
        (values.T.ravel(), (first + np.arange(4)).ravel(), np.arange(0, 4 * n_frames + 1, 4)),
        shape=(n_frames, n_pieces + 3),
    )
