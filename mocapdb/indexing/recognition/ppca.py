"""Probabilistic principal components: the density of a class of poses.

O'Kane (2008, section 3.2.4, eq. 3.13), after Moghaddam and Pentland, "Probabilistic visual learning
for object representation" (1997): a Gaussian whose covariance is kept along Q principal axes and is
rho in every other direction.

*The noise variance rho decides everything.* Fitted to a class of its own, as in the thesis, it is
the variance of the few people the class was learned from; someone else is then rejected, by the
tightest class most of all. A floor, the square of what one body differs from another by, mends it.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, DensityMixin
from sklearn.utils.validation import check_array, check_is_fitted

from mocapdb.base.arrays import FloatArray
from mocapdb.indexing.tuning import KEPT_VARIANCE

__all__ = ["PPCA"]

LOG_TWO_PI = float(np.log(2 * np.pi))


class PPCA(DensityMixin, BaseEstimator):  # type: ignore[misc]
    """Gaussian density with principal axes and isotropic noise; a scikit-learn estimator.

    Parameters
    ----------
    variance : float
        Share of the variance that the principal axes keep; 0.99 in the thesis.
    floor : float
        Standard deviation, in the unit of the data, that no direction may fall below. 0 gives the
        thesis's density.
    noise_variance : float, optional
        Take this for rho instead of fitting it, such as one rho for all classes.

    Attributes
    ----------
    mean_ : (D,)
    components_ : (Q, D)
        Orthonormal axes by falling variance, signs fixed by the largest entry.
    explained_variance_ : (Q,)
        Variance along each axis, never under `noise_variance_`.
    noise_variance_ : float
        Variance in every other direction, rho: the mean of what is left, or the floor's square.
    n_features_in_ : int

    References
    ----------
    Tipping and Bishop, "Probabilistic principal component analysis", J. R. Stat. Soc. B 61 (1999),
    doi:10.1111/1467-9868.00196, for the noise variance.
    """

    def __init__(
        self,
        variance: float = KEPT_VARIANCE,
        floor: float = 0.0,
        noise_variance: float | None = None,
    ) -> None:
        self.variance = variance
        self.floor = floor
        self.noise_variance = noise_variance

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Fit to rows.

        Parameters
        ----------
        X : (F, D)
            At least two rows.
        y : ignored
        """
        values = self._checked(X, reset=True)
        mean = values.mean(axis=0)
        covariance = (values - mean).T @ (values - mean) / len(values)
        return self._set(mean, covariance)

    def fit_moments(self, mean: ArrayLike, covariance: ArrayLike) -> Self:
        """Fit to rows of which only the mean (D,) and the covariance (D, D) are known."""
        self.n_features_in_ = len(np.asarray(mean))
        return self._set(np.asarray(mean, np.float64), np.asarray(covariance, np.float64))

    def _set(self, mean: FloatArray, covariance: FloatArray) -> Self:
        if not 0 < self.variance <= 1:
            raise ValueError(f"Expected variance in (0, 1], but got {self.variance}.")
        if not self.floor >= 0:
            raise ValueError(f"Expected a floor of 0 or more, but got {self.floor}.")
        spread, axes = np.linalg.eigh(covariance)
        spread, axes = np.maximum(spread[::-1], 0.0), axes[:, ::-1]
        kept = np.cumsum(spread) < self.variance * spread.sum() * (1 - 1e-12)
        count = min(int(kept.sum()) + 1, len(spread))
        left = spread[count:]
        # a class of one pose is still a class, and rounding must not decide what is far from it
        smallest = max(1e-12 * float(spread.sum()), float(np.finfo(np.float64).tiny) ** 0.5)
        own = float(left.mean()) if len(left) else 0.0
        noise = own if self.noise_variance is None else self.noise_variance
        noise = max(noise, self.floor**2, smallest)
        axes = axes[:, :count].T
        signs = np.sign(axes[np.arange(count), np.abs(axes).argmax(axis=1)])
        self.mean_ = mean
        self.components_ = axes * signs[:, None]
        self.explained_variance_ = np.maximum(spread[:count], noise)
        self.noise_variance_ = noise
        return self

    def score_samples(self, X: ArrayLike) -> FloatArray:
        """Return the (F,) log density of rows (O'Kane eq. 3.13)."""
        check_is_fitted(self)
        centred = self._checked(X, reset=False) - self.mean_
        along = centred @ self.components_.T
        beside = ((centred - along @ self.components_) ** 2).sum(axis=1)
        count, dims = self.components_.shape
        constant = (
            dims * LOG_TWO_PI
            + np.log(self.explained_variance_).sum()
            + (dims - count) * np.log(self.noise_variance_)
        )
        squares = (along**2 / self.explained_variance_).sum(axis=1) + beside / self.noise_variance_
        return np.asarray(-0.5 * (constant + squares))

    def score(self, X: ArrayLike, y: Any = None) -> float:
        """Return the mean log density of rows."""
        return float(self.score_samples(X).mean())

    def _checked(self, X: ArrayLike, *, reset: bool) -> FloatArray:
        try:
            from sklearn.utils.validation import validate_data
        except ImportError:  # scikit-learn before 1.6
            values = check_array(X, dtype=np.float64, ensure_min_samples=1)
            if reset:
                self.n_features_in_ = values.shape[1]
            elif values.shape[1] != self.n_features_in_:
                raise ValueError(
                    f"X has {values.shape[1]} features, but PPCA is expecting "
                    f"{self.n_features_in_} features as input."
                ) from None
            return np.asarray(values)
        return np.asarray(
            validate_data(
                self, X, reset=reset, dtype=np.float64, ensure_min_samples=2 if reset else 1
            )
        )
