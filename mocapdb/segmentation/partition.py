"""The cuts after which each stretch fits a Gaussian of its own best.

Probabilistic PCA, in one search over all cuts in place of one after the other: a stretch is the
density of its poses and velocities, a Gaussian with a floor under its variance (O'Kane 2008,
section 3.2.4), and the cuts are those that make the whole take the likeliest, each cut at a price
(optimal partitioning: Jackson et al., "An algorithm for optimal partitioning of data on an
interval", IEEE Signal Processing Letters 12, 2005).
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.segmentation.tuning import (
    CUT_PENALTY,
    CUT_STEP_S,
    LIKELY_CUT,
    LONGEST_S,
    SHORTEST_S,
)

__all__ = ["log_determinants", "optimal_cuts", "refined_cuts"]


def optimal_cuts(
    rows: FloatArray, fps: float, floor: float, allowed: BoolArray, likely: BoolArray
) -> list[int]:
    """Return where a take is cut, to `CUT_STEP_S`.

    Parameters
    ----------
    rows : (F, D)
        Poses and velocities.
    fps : float, frames per second
    floor : float
        Standard deviation below which no direction of a Gaussian falls, in the unit of the rows.
    allowed : (F,)
        Where a cut may be.
    likely : (F,)
        Where it costs `LIKELY_CUT` of the usual price.
    """
    step = max(1, round(CUT_STEP_S * fps))
    n_frames, n_dims = rows.shape
    places = np.arange(step, n_frames - step, step)
    grid = np.concatenate([[0], places[allowed[places]], [n_frames]])
    sums, products = _moments_before(rows, grid)
    penalty = np.full(len(grid), CUT_PENALTY * fps * n_dims)
    penalty[:-1][likely[grid[:-1]]] *= LIKELY_CUT
    best, before = np.full(len(grid), np.inf), np.zeros(len(grid), dtype=int)
    best[0] = 0.0
    for end in range(1, len(grid)):
        lengths = grid[end] - grid[:end]
        starts = np.flatnonzero((lengths >= SHORTEST_S * fps) & (lengths <= LONGEST_S * fps))
        if len(starts) == 0 or not np.isfinite(best[starts]).any():
            # a range longer than any stretch may be, or the rest of a short one
            starts = np.flatnonzero(np.isfinite(best[:end]))[-1:]
        count = lengths[starts].astype(np.float64)
        mean = (sums[end] - sums[starts]) / count[:, None]
        spread = (products[end] - products[starts]) / count[:, None, None]
        spread -= mean[:, :, None] * mean[:, None, :]
        total = best[starts] + 0.5 * count * log_determinants(spread, floor)
        total += penalty[starts]
        lowest = int(np.argmin(total))
        best[end], before[end] = total[lowest], starts[lowest]
    cuts: list[int] = []
    place = int(before[-1])
    while place > 0:
        cuts.insert(0, int(grid[place]))
        place = int(before[place])
    return cuts


def refined_cuts(rows: FloatArray, cuts: list[int], fps: float, floor: float) -> list[int]:
    """Return cuts moved by a step at most, to where each frame is on the side that it fits best."""
    reach = max(1, round(CUT_STEP_S * fps))
    bounds = [0, *cuts, len(rows)]
    refined = []
    for first, cut, last in zip(bounds[:-2], cuts, bounds[2:], strict=True):
        near = slice(max(first + 1, cut - reach), min(last, cut + reach))
        before, after = (
            _surprise(rows[part], rows[near], floor)
            for part in (slice(first, cut), slice(cut, last))
        )
        costs = np.cumsum(np.append(0.0, before)) + np.append(np.cumsum(after[::-1])[::-1], 0.0)
        refined.append(near.start + int(np.argmin(costs)))
    return refined


def log_determinants(spread: FloatArray, floor: float) -> FloatArray:
    """Return (...,) the log determinants of covariances (..., D, D) above a floor."""
    lower = np.linalg.cholesky(spread + floor**2 * np.eye(spread.shape[-1]))
    return np.asarray(2.0 * np.log(np.diagonal(lower, axis1=-2, axis2=-1)).sum(axis=-1))


def _surprise(fitted: FloatArray, rows: FloatArray, floor: float) -> FloatArray:
    """Return (F,) minus the log density of rows under the Gaussian of others."""
    spread = np.cov(fitted.T, bias=True) + floor**2 * np.eye(fitted.shape[1])
    apart = rows - fitted.mean(axis=0)
    squares = (apart * np.linalg.solve(spread, apart.T).T).sum(axis=1)
    return np.asarray(0.5 * (squares + log_determinants(spread, 0.0)))


def _moments_before(rows: FloatArray, grid: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return (G, D) the sums and (G, D, D) the sums of products of the rows before each place."""
    n_dims = rows.shape[1]
    sums = np.zeros((len(grid), n_dims))
    products = np.zeros((len(grid), n_dims, n_dims))
    for i in range(1, len(grid)):
        part = rows[grid[i - 1] : grid[i]]
        sums[i] = sums[i - 1] + part.sum(axis=0)
        products[i] = products[i - 1] + part.T @ part
    return sums, products
