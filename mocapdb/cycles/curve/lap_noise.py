"""How much laps differ, channel by channel, and how much smoothing that calls for.

A curve through few laps follows what was only theirs. By Wiener's rule a harmonic is worth
``S / (S + N / n)`` of what n laps have of it, where S is the variance that laps share and N that by
which each differs. N over S grows about as the cube of the harmonic.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.cycles.curve.harmonics import NEGLIGIBLE_VARIANCE
from mocapdb.cycles.tuning import POOLED_LAPS, SMOOTHING, SMOOTHING_HARMONICS

__all__ = ["lap_smoothing"]

NEAR_FRAMES = 0.75  # the nearest frame is half of one away at most, where there is one
FURTHEST_LAP = 2  # a lap that is missing between two others is jumped over


def lap_smoothing(phase: FloatArray, values: FloatArray, period_frames: float) -> FloatArray:
    """Return (D,) how much each channel is to be smoothed (see `HarmonicRegression.fit`).

    Parameters
    ----------
    phase : (F,)
        In laps, unwrapped, rising.
    values : (F, D)
    period_frames : float
        Frames of a lap.

    Returns
    -------
    (D,)
        Zeros where no two frames are of one phase, or channels do not differ from lap to lap.

    Notes
    -----
    N is half of the mean squared difference of frames a whole lap apart. Where few laps overlap it
    is drawn towards what all channels together have.
    """
    later, earlier = _pairs(phase, period_frames)
    if len(later) == 0:
        return np.zeros(values.shape[1])
    noise = ((values[later] - values[earlier]) ** 2).mean(axis=0) / 2.0
    varies = _shared_variance(phase, values)
    moving = varies > NEGLIGIBLE_VARIANCE
    if not moving.any():
        return np.zeros(values.shape[1])
    ratio = np.divide(noise, varies, out=np.zeros_like(noise), where=moving)
    pooled = float(noise.sum() / varies.sum())
    overlap = len(later) / period_frames
    ratio = (overlap * ratio + POOLED_LAPS * pooled) / (overlap + POOLED_LAPS)
    laps = max(1.0, len(phase) / period_frames)
    return np.where(moving, SMOOTHING * ratio / laps, 0.0)


def _pairs(phase: FloatArray, period_frames: float) -> tuple[IntArray, IntArray]:
    """Return frames, and for each the one a lap earlier, or two where that one is missing."""
    frames = np.arange(len(phase))
    before = np.full(len(phase), -1)
    for laps in range(1, FURTHEST_LAP + 1):
        wanted = phase - laps
        after = np.clip(np.searchsorted(phase, wanted), 1, len(phase) - 1)
        nearest = np.where(
            np.abs(phase[after] - wanted) < np.abs(phase[after - 1] - wanted), after, after - 1
        )
        close = np.abs(phase[nearest] - wanted) < NEAR_FRAMES / period_frames
        before = np.where((before < 0) & close, nearest, before)
    found = before >= 0
    return frames[found], before[found]


def _shared_variance(phase: FloatArray, values: FloatArray) -> FloatArray:
    """Return (D,) the variance of a smooth curve of the phase."""
    n_harmonics = max(1, min(SMOOTHING_HARMONICS, (len(phase) - 2) // 3))
    waves = np.exp(2j * np.pi * np.outer(phase, np.arange(1, n_harmonics + 1)))
    columns = np.hstack([np.ones((len(phase), 1)), waves.real, waves.imag])
    found = np.linalg.lstsq(columns, values, rcond=None)[0]
    return np.asarray((found[1:] ** 2).sum(axis=0) / 2.0)
