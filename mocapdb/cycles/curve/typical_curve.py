"""The typical trajectory: of each phase the centroid of the poses nearest to it.

Vejdemo-Johansson et al. (2015), section 4.4. They draw coordinates by their density, to bring the
tempo back that circular coordinates have lost; phases of `Timing` have it already, and are taken
evenly.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.curve.closed_curves import interpolate_closed
from mocapdb.cycles.tuning import CENTROID_NEIGHBOURS, N_SAMPLES, NEIGHBOURS_A_LAP
from mocapdb.errors import CycleError

__all__ = ["TypicalCurve"]


class TypicalCurve:
    """A closed curve of centroids.

    Parameters
    ----------
    phase : (F,)
        In laps.
    values : (F, D)
    period_frames : float
        Frames of a lap: of many laps more neighbours are taken, some of each.

    Attributes
    ----------
    centroids : (S, D)
        At phases 0, 1/S, ...

    Raises
    ------
    CycleError
        If there are fewer frames than neighbours.

    Examples
    --------
    >>> phase = np.arange(200) / 80
    >>> curve = TypicalCurve(phase, np.sin(2 * np.pi * phase)[:, None], 80.0)
    >>> curve.predict(np.array([0.25, 0.75])).round(1).ravel().tolist()
    [1.0, -1.0]
    """

    def __init__(self, phase: FloatArray, values: FloatArray, period_frames: float) -> None:
        laps = len(phase) / period_frames
        n_neighbours = max(CENTROID_NEIGHBOURS, round(NEIGHBOURS_A_LAP * laps))
        if len(phase) < n_neighbours:
            raise CycleError(
                f"Expected {n_neighbours} frames at least, one for each neighbour, but got "
                f"{len(phase)}."
            )
        order = np.argsort(phase % 1.0, kind="stable")
        around = (phase % 1.0)[order]
        rows = values[order]
        # the neighbours of a phase are a stretch of the frames in the order of their phases
        around = np.concatenate([around - 1.0, around, around + 1.0])
        self.centroids = np.empty((N_SAMPLES, values.shape[1]))
        for sample, at in enumerate(np.arange(N_SAMPLES) / N_SAMPLES):
            middle = int(np.searchsorted(around, at))
            near = np.arange(middle - n_neighbours, middle + n_neighbours)
            near = near[np.argsort(np.abs(around[near] - at), kind="stable")[:n_neighbours]]
            self.centroids[sample] = rows[near % len(rows)].mean(axis=0)

    def predict(self, phase: FloatArray) -> FloatArray:
        """Return the curve at phases (F,) as (F, D)."""
        return interpolate_closed(self.centroids, np.asarray(phase))
