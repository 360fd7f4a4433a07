"""A typical trajectory from circular coordinates alone (Vejdemo-Johansson et al. 2015, 4.4)."""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.phase.laps import fit_mixture
from mocapdb.cycles.tuning import CENTROID_NEIGHBOURS, CENTROID_SAMPLES, MIXTURE_COMPONENTS
from mocapdb.errors import CycleError

__all__ = ["typical_trajectory"]


def typical_trajectory(
    coordinates: FloatArray,
    values: FloatArray,
    n_frames: int,
    *,
    n_components: int = MIXTURE_COMPONENTS,
    n_samples: int = CENTROID_SAMPLES,
    n_neighbours: int = CENTROID_NEIGHBOURS,
    seed: int = 0,
) -> FloatArray:
    """Return one lap (n_frames, D) of centroids of poses with like coordinates.

    Parameters
    ----------
    coordinates : (F,)
        In laps, in [0, 1).
    values : (F, D)
        Poses.
    n_frames : int
        Of the lap.
    n_components, n_samples, n_neighbours : int
        Components of the Gaussian mixture that is fitted to three copies of the coordinates, a
        lap apart; coordinates drawn from its middle lap; poses nearest to each, whose mean is
        taken. The paper's are 30, 500 and 10.
    seed : int
        Of the drawing.

    Raises
    ------
    CycleError
        If there are fewer frames than neighbours.

    Notes
    -----
    Drawn in proportion to the density, a coordinate where the motion lingers comes up more often,
    which brings its speed back. The lap is not smooth: neighbours change from draw to draw.
    """
    if len(coordinates) < n_neighbours:
        raise CycleError(
            f"Expected {n_neighbours} frames at least, one for each neighbour, but got "
            f"{len(coordinates)}."
        )
    mixture = fit_mixture(coordinates, n_components, seed)
    drawn = np.empty(0)
    while len(drawn) < n_samples:
        more = mixture.sample(3 * n_samples)[0][:, 0]
        drawn = np.concatenate([drawn, more[(more >= 0) & (more < 1)]])
        mixture.random_state = None if mixture.random_state is None else mixture.random_state + 1
    drawn = np.sort(drawn[:n_samples])
    apart = np.abs(drawn[:, None] - coordinates)
    apart = np.minimum(apart, 1.0 - apart)
    nearest = np.argpartition(apart, n_neighbours - 1, axis=1)[:, :n_neighbours]
    centroids = values[nearest].mean(axis=1)
    at = np.arange(n_frames) * n_samples / n_frames
    closed = np.vstack([centroids, centroids[:1]])
    before = at.astype(np.int64)
    share = (at - before)[:, None]
    return np.asarray((1 - share) * closed[before] + share * closed[before + 1])
