"""How phase runs in time: steady, drifting, wandering, or with cycles of unequal length."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.corpus.tuning import N_WAVES, WAVE_CYCLES
from mocapdb.errors import ClipError

__all__ = ["Tempo"]

TURN = 2 * math.pi


@dataclass(frozen=True)
class Tempo:
    """The unsteadiness of a tempo.

    Attributes
    ----------
    drift : float
        Change of tempo from the first frame to the last, relative to the mean.
    noise : float, radians
        Standard deviation of a slow wandering of the phase.
    jitter : float
        Standard deviation of the durations of the cycles, relative to their mean.
    """

    drift: float = 0.0
    noise: float = 0.0
    jitter: float = 0.0

    @property
    def steady(self) -> bool:
        """Whether every cycle is as long as the others."""
        return not (self.drift or self.noise or self.jitter)

    def cycles(
        self, rng: np.random.Generator, n_frames: int, period_s: float, fps: float
    ) -> FloatArray:
        """Return (F,) the phase counted in cycles, which starts anywhere in the first one.

        Raises
        ------
        ClipError
            If the phase would not run forwards.
        """
        first = rng.uniform()
        time = np.arange(n_frames) / fps / period_s  # in mean periods
        length = max(float(time[-1]), 1.0)
        cycle = time + self.drift * time * (time - length) / (2 * length)
        if self.jitter:
            n_cycles = math.ceil(cycle[-1]) + 2
            durations = np.clip(1.0 + self.jitter * rng.standard_normal(n_cycles), 0.2, None)
            cycle = _unequal_cycles(cycle, durations)
        if self.noise:
            longest, shortest = WAVE_CYCLES
            waves = TURN * rng.uniform(1 / longest, 1 / shortest, N_WAVES)
            shifts = rng.uniform(0.0, TURN, N_WAVES)
            wandering = np.sin(np.outer(time, waves) + shifts).sum(axis=1)
            cycle = cycle + self.noise / TURN * math.sqrt(2 / N_WAVES) * wandering
        if not np.all(np.diff(cycle) > 0):
            raise ClipError(
                f"Expected a phase that runs forwards, but got {self}, which turns it back. "
                "Use smaller values."
            )
        return np.asarray(first + cycle)


def _unequal_cycles(time: FloatArray, durations: FloatArray) -> FloatArray:
    """Return the cycles done by each time when cycle k lasts ``durations[k]``, smoothly."""
    from scipy.interpolate import PchipInterpolator

    ends = np.concatenate([[0.0], np.cumsum(durations)]) / durations.mean()
    return np.asarray(PchipInterpolator(ends, np.arange(len(ends)))(time))
