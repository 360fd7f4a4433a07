"""Principal components of poses (O'Kane 2008, section 3.2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray

__all__ = ["FLOAT32_LIMIT", "Components", "principal_components"]

FLOAT32_LIMIT = 1e30  # values beyond it do not fit float32 once they are summed over time


@dataclass(frozen=True)
class Components:
    """A mean pose and directions in which poses differ from it.

    Attributes
    ----------
    mean : (D,)
    axes : (K, D)
        Orthonormal rows, the direction of most variance first. Mean and axes hold numbers that
        float32 can hold, because float32 is what is stored.
    weights : (D,), optional
        Of the columns: the axes are orthonormal where each column is so many times as large.
        Whoever only restores poses need not know them.
    """

    mean: FloatArray
    axes: FloatArray
    weights: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.axes)

    @property
    def n_numbers(self) -> int:
        """How many numbers have to be stored."""
        return self.mean.size + self.axes.size

    def first(self, count: int) -> Components:
        """Return the same mean with the first `count` axes."""
        return Components(self.mean, self.axes[:count], self.weights)

    def project(self, values: FloatArray) -> FloatArray:
        """Return the scores (F, K) of poses (F, D)."""
        centred = values - self.mean
        if self.weights is not None:
            centred = centred * self.weights**2
        return np.asarray(centred @ self.axes.T)

    def restore(self, scores: FloatArray) -> FloatArray:
        """Return the poses (F, D) that have these scores (F, K)."""
        return np.asarray(scores @ self.axes + self.mean)


def principal_components(values: FloatArray, weights: FloatArray | None = None) -> Components:
    """Return all principal components of poses (F, D): as many as the poses span, at most D.

    Where columns have weights (D,), of poses whose columns are so many times as large. The largest
    entry of every axis is positive, so that the same poses always give the same axes.
    """
    mean = values.mean(axis=0)
    centred = values - mean
    if weights is not None and (weights == 1.0).all():
        weights = None
    if weights is not None:
        centred = centred * weights
    if len(values) >= values.shape[1]:
        variances, vectors = np.linalg.eigh(centred.T @ centred)
        axes = vectors.T[::-1][: np.count_nonzero(variances > 0)]
    else:
        _, spread, axes = np.linalg.svd(centred, full_matrices=False)
        axes = axes[spread > 0]
    if len(axes):
        largest = np.take_along_axis(axes, np.abs(axes).argmax(axis=1)[:, None], axis=1)
        axes = axes * np.sign(largest)
    if weights is not None:
        axes = axes / weights
    return Components(_as_float32(mean), _as_float32(axes), weights)


def _as_float32(values: FloatArray) -> FloatArray:
    return values.astype(np.float32).astype(np.float64)
