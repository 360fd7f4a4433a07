"""Three ways to cut a take of Barbic et al. (2004), as O'Kane (2008, section 2.5) describes them.

Departures: poses are joint positions seen from the root, not quaternions; the number of Gaussians
of the mixture is chosen by Schwarz's criterion, not by the user.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.segmentation.tuning import (
    ERROR_REACH_S,
    FIRST_PCA_S,
    GAUSSIAN_S,
    GROWTH_S,
    JUMP_SDS,
    KEPT_BY_AXES,
    MOST_MIXED,
    PEAK_RISE,
    SHORTEST_S,
)

__all__ = ["PUBLISHED"]


def pca_cuts(poses: FloatArray, fps: float) -> list[int]:
    """Return cuts where the poses so far need more principal axes than the first ones did.

    Axes are fitted to the first two seconds of a motion; as it goes on they are fitted anew to all
    of it, as many as at first. Where the error of the projection begins to rise far more quickly
    than it did, another motion has begun (Barbic et al. 2004, section 3.1).

    Parameters
    ----------
    poses : (F, D)
    fps : float, frames per second
    """
    first, reach = round(FIRST_PCA_S * fps), max(1, round(ERROR_REACH_S * fps))
    cuts: list[int] = []
    start = 0
    while len(poses) - start > first + reach:
        spreads = _spreads(poses[start : start + first])
        kept = np.cumsum(spreads) < KEPT_BY_AXES * spreads.sum()
        n_axes = min(int(kept.sum()) + 1, len(spreads))
        errors: list[float] = []
        found = None
        for end in range(start + first, len(poses)):
            errors.append(float(_spreads(poses[start:end])[n_axes:].sum()) * (end - start))
            rises = np.subtract(errors[reach:], errors[:-reach])
            if len(rises) > reach:
                usual = rises[:-1]
                if rises[-1] > usual.mean() + JUMP_SDS * max(usual.std(), 1e-12):
                    found = end - reach // 2
                    break
        if found is None:
            break
        cuts.append(found)
        start = found
    return cuts


def ppca_cuts(poses: FloatArray, fps: float) -> list[int]:
    """Return cuts where what follows is least like what was, by probabilistic PCA.

    A Gaussian is fitted to the poses since the last cut; the mean Mahalanobis distance of those
    that follow falls while the motion goes on and peaks where another begins (Barbic et al. 2004,
    section 3.2).

    Parameters
    ----------
    poses : (F, D)
    fps : float, frames per second
    """
    from sklearn.decomposition import PCA

    window, growth = round(GAUSSIAN_S * fps), max(1, round(GROWTH_S * fps))
    cuts: list[int] = []
    start = 0
    while True:
        ends = range(start + window, len(poses) - window + 1, growth)
        distances: list[float] = []
        for end in ends:
            density = PCA(KEPT_BY_AXES, svd_solver="full").fit(poses[start:end])
            apart = poses[end : end + window] - density.mean_
            distances.append(float(((apart @ density.get_precision()) * apart).sum(axis=1).mean()))
        peak = _first_peak(np.array(distances))
        if peak is None:
            return cuts
        start = ends[peak]
        cuts.append(start)


def mixture_cuts(poses: FloatArray, fps: float) -> list[int]:
    """Return cuts where poses leave one Gaussian of a mixture for another.

    Each motion is a cloud of poses of its own (Barbic et al. 2004, section 3.3). What is too short
    to be a motion belongs to what was before.

    Parameters
    ----------
    poses : (F, D)
    fps : float, frames per second
    """
    from sklearn.mixture import GaussianMixture

    best, label = np.inf, np.zeros(len(poses), dtype=int)
    for count in range(1, min(MOST_MIXED, len(poses) // 2) + 1):
        mixture = GaussianMixture(count, reg_covar=1e-4, random_state=0).fit(poses)
        criterion = mixture.bic(poses)
        if criterion < best:
            best, label = criterion, mixture.predict(poses)
    changes = np.flatnonzero(np.diff(label)) + 1
    cuts: list[int] = []
    kept = int(label[0])
    for start, end in pairwise([*changes.tolist(), len(poses)]):
        if label[start] != kept and end - start >= SHORTEST_S * fps:
            cuts.append(start)
            kept = int(label[start])
    return cuts


PUBLISHED: dict[str, Callable[[FloatArray, float], list[int]]] = {
    "pca": pca_cuts,
    "ppca": ppca_cuts,
    "mixture": mixture_cuts,
}


def _spreads(poses: FloatArray) -> FloatArray:
    """Return (D,) the variances along the principal axes, the largest first."""
    return np.asarray(np.maximum(np.linalg.eigvalsh(np.cov(poses.T, bias=True))[::-1], 0.0))


def _first_peak(values: FloatArray) -> int | None:
    """Return the first peak that rises far enough over the valley before it, and falls again."""
    valley = peak = np.inf
    at = None
    for place, value in enumerate(values):
        if at is None:
            valley = min(valley, value)
            if value > (1.0 + PEAK_RISE) * valley:
                at, peak = place, value
        elif value > peak:
            at, peak = place, value
        else:
            return at
    return at
