"""From coordinates on a circle to time: unwrapping, laps, and three ways to even out speed.

A circular coordinate goes with the shape of the motion, not with time: it hardly moves while the
body does not. Each function here takes coordinates in laps, in [0, 1), and returns phases in which
time runs evenly.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.tuning import CLOCK_PARTS, MIXTURE_COMPONENTS, MIXTURE_VARIANCE
from mocapdb.errors import CycleError

__all__ = [
    "fit_laps",
    "fit_mixture",
    "forwards",
    "gaussian_mixture",
    "uniformised",
    "unwrapped",
    "whole_laps",
]


def unwrapped(coordinates: FloatArray) -> FloatArray:
    """Return coordinates that go on counting laps (Raunio 2014, figure 3.8)."""
    return np.asarray(np.unwrap(coordinates, period=1.0))


def fit_laps(laps: FloatArray) -> tuple[float, float]:
    """Return laps a frame and the lap at frame 0 by a line fit (Raunio 2014, section 3.6)."""
    slope, start = np.polyfit(np.arange(len(laps)), laps, 1)
    return float(slope), float(start)


def forwards(coordinates: FloatArray) -> FloatArray:
    """Return the coordinates, or their mirror image, so that time runs forwards.

    Mirrored coordinates must be unwrapped anew: a step of just half a lap changes its sign.
    """
    slope, _ = fit_laps(unwrapped(coordinates))
    return coordinates if slope >= 0 else np.asarray((-coordinates) % 1.0)


def uniformised(coordinates: FloatArray) -> FloatArray:
    """Return coordinates spread evenly over [0, 1), by their ranks (Raunio 2014, eq. 3.20)."""
    ranks = np.empty(len(coordinates))
    ranks[np.argsort(coordinates, kind="stable")] = np.arange(len(coordinates))
    return ranks / len(coordinates)


def gaussian_mixture(
    coordinates: FloatArray, *, n_components: int = MIXTURE_COMPONENTS, seed: int = 0
) -> FloatArray:
    """Return coordinates through the distribution function of a mixture (Raunio 2014, eq. 3.21).

    The mixture is restricted to the middle one of its three laps.
    """
    from scipy.stats import norm

    mixture = fit_mixture(coordinates, n_components, seed)
    means, widths = mixture.means_[:, 0], np.sqrt(mixture.covariances_[:, 0, 0])

    def below(x: FloatArray) -> FloatArray:
        return np.asarray(norm.cdf(x[:, None], means, widths) @ mixture.weights_)

    first, last = below(np.array([0.0, 1.0]))
    return np.asarray((below(coordinates) - first) / (last - first))


def fit_mixture(coordinates: FloatArray, n_components: int, seed: int) -> Any:
    """Return scikit-learn's Gaussian mixture of three copies of the coordinates, a lap apart.

    Vejdemo-Johansson et al. (2015), section 5.2.
    """
    from sklearn.mixture import GaussianMixture

    copies = np.concatenate([coordinates - 1.0, coordinates, coordinates + 1.0])[:, None]
    return GaussianMixture(
        min(n_components, len(copies)),
        reg_covar=MIXTURE_VARIANCE,
        random_state=seed,
    ).fit(copies)


def whole_laps(laps: FloatArray) -> FloatArray:
    """Return unwrapped phases in which time runs evenly, judged by whole laps only.

    Parameters
    ----------
    laps : (F,)
        Unwrapped, in laps.

    Raises
    ------
    CycleError
        If there is no whole lap.

    Notes
    -----
    Ranking all frames, as `uniformised` does, gives poses that occur once more than others more
    time. Here a frame counts for how often its part of the circle is passed: densities are summed
    over windows of whole laps, from every possible start, so that each part counts the same.
    """
    n_laps = int(np.floor(laps[-1] - laps[0]))
    if n_laps < 1:
        raise CycleError(f"Expected a whole lap, but got {laps[-1] - laps[0]:.2f}.")
    steady = np.maximum.accumulate(laps)
    steady = steady + 1e-9 * np.arange(len(steady))
    times = np.arange(len(laps), dtype=np.float64)
    grid = np.linspace(0.0, 1.0, CLOCK_PARTS + 1)
    # how long each part of the circle takes, the mean over every time that it is passed
    starts = np.arange(np.ceil(steady[0]), steady[-1])
    edges = grid + np.concatenate([[starts[0] - 1], starts])[:, None]
    inside = (edges >= steady[0]) & (edges <= steady[-1])
    spent = np.where(inside, np.interp(edges, steady, times), np.nan)
    durations = np.nanmean(np.diff(spent, axis=1), axis=0)
    clock = np.concatenate([[0.0], np.cumsum(durations)]) / durations.sum()
    whole = np.floor(laps)
    return np.asarray(whole + np.interp(laps - whole, grid, clock))
