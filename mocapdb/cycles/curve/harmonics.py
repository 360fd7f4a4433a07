"""Harmonic regression: a periodic curve through poses whose phase is known.

Raunio (2014), sections 3.2 to 3.4 and 3.9.
"""

from __future__ import annotations

import math
from typing import Literal, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import CycleError

__all__ = ["MODELS", "HarmonicRegression", "Model", "finite_differences"]

Model: TypeAlias = Literal["m1", "m2", "m3"]
MODELS: tuple[Model, ...] = get_args(Model)

TURN = 2.0 * math.pi
STENCIL_REACH = 4
# the 9-point central differences of Fornberg (1988), eqs. 3.23 and 3.24
FIRST_STENCIL = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND_STENCIL = np.array(
    [-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560]
)
NEGLIGIBLE_VARIANCE = 1e-20  # a channel with less is at rest, up to rounding
SMOOTHED_POWER = 3  # laps differ by less in high harmonics, but what they share falls off faster
LEAST_SMOOTHING = 1e-6  # of the median, so that every channel's equations can be solved
NEARLY_SINGULAR = 1e-12  # added to diagonals of 1, so that the system can be solved


class HarmonicRegression:
    """A sum of harmonics of the phase, fitted channel by channel.

    Parameters
    ----------
    n_harmonics : int
        K: sines and cosines of 1 to K cycles a lap.
    model : {"m1", "m2", "m3"}
        What is fitted: ``"m2"`` the values (eq. 3.8), ``"m3"`` velocities and accelerations as
        well (eq. 3.9), ``"m1"`` the same with each channel's weights estimated by feasible
        generalised least squares (eqs. 3.11 to 3.15, 3.19).
    linear : bool
        Adds a term linear in the phase, for translations (eq. 3.27). Phases must then not be
        wrapped.
    ridge : float
        Penalty on the squares of all coefficients but the constant and the linear one, relative
        to the number of frames (chapter 6).
    use_velocities, use_accelerations : bool
        Whether ``"m1"`` and ``"m3"`` fit them, too; of one that they do not the weight is zero.

    Attributes
    ----------
    coefficients_ : (P, D)
        The constant, K sines, K cosines, and the linear term if there is one.
    weights_ : (2, D)
        Of velocities and accelerations; zeros for ``"m2"``.

    Examples
    --------
    >>> phase = np.arange(100) / 40
    >>> model = HarmonicRegression(2, model="m2").fit(phase, np.sin(TURN * phase)[:, None])
    >>> model.predict(np.array([0.25])).round(6).tolist()
    [[1.0]]
    """

    coefficients_: FloatArray
    weights_: FloatArray

    def __init__(
        self,
        n_harmonics: int = 20,
        *,
        model: Model = "m1",
        linear: bool = False,
        ridge: float = 0.0,
        use_velocities: bool = True,
        use_accelerations: bool = True,
    ) -> None:
        if n_harmonics < 0 or ridge < 0:
            raise CycleError(
                f"Expected n_harmonics and ridge of 0 or more, but got {n_harmonics} and {ridge}."
            )
        if model not in MODELS:
            raise CycleError(f"Expected a model out of {', '.join(MODELS)}, but got {model!r}.")
        self.n_harmonics = n_harmonics
        self.model: Model = model
        self.linear = linear
        self.ridge = ridge
        self.use_velocities = use_velocities
        self.use_accelerations = use_accelerations

    @property
    def n_coefficients(self) -> int:
        """P, the number of coefficients of a channel."""
        return 2 * self.n_harmonics + 1 + self.linear

    def fit(
        self,
        phase: FloatArray,
        values: FloatArray,
        velocities: FloatArray | None = None,
        accelerations: FloatArray | None = None,
        *,
        smoothing: FloatArray | None = None,
    ) -> HarmonicRegression:
        """Fit the curve.

        Parameters
        ----------
        phase : (F,)
            In laps.
        values : (F, D)
        velocities, accelerations : (F, D), optional
            Derivatives by the phase, a lap; rows of NaN are left out. Needed but for ``"m2"``.
        smoothing : (D,), optional
            Of each channel the penalty on the squares of its first harmonic, relative to the number
            of frames; that on harmonic k is ``k ** 3`` times it. For ``"m2"`` alone.

        Raises
        ------
        CycleError
            If there are fewer frames than coefficients, derivatives are missing, or a model other
            than ``"m2"`` is to be smoothed.
        """
        if len(phase) < self.n_coefficients:
            raise CycleError(
                f"Expected {self.n_coefficients} frames at least for {self.n_harmonics} harmonics, "
                f"but got {len(phase)}. Use fewer harmonics."
            )
        gram, moment = self._normal_equations(phase, values, 0)
        if smoothing is not None and smoothing.any():
            if self.model != "m2":
                raise CycleError(f"Expected the model m2 to be smoothed, but got {self.model}.")
            self.weights_ = np.zeros((2, values.shape[1]))
            self.coefficients_ = self._smoothed(gram, moment, smoothing, len(phase))
            return self
        grams, moments = [gram], [moment]
        self.weights_ = np.zeros((2, values.shape[1]))
        if self.model != "m2":
            if velocities is None or accelerations is None:
                raise CycleError(f"Expected velocities and accelerations for {self.model}.")
            known = np.isfinite(velocities).all(axis=1) & np.isfinite(accelerations).all(axis=1)
            rates = (velocities[known], accelerations[known])
            for derivative, rate in enumerate(rates, start=1):
                gram, moment = self._normal_equations(phase[known], rate, derivative)
                grams.append(gram)
                moments.append(moment)
            if self.model == "m3":
                self.weights_[:] = 1.0
            else:
                self.weights_ = self._estimated_weights(phase, values, phase[known], rates)
            self.weights_[[not self.use_velocities, not self.use_accelerations]] = 0.0
        weights = np.vstack([np.ones(values.shape[1]), self.weights_])[: len(grams)]
        self.coefficients_ = self._solved(np.stack(grams), np.stack(moments), weights, len(phase))
        return self

    def predict(self, phase: FloatArray, derivative: int = 0) -> FloatArray:
        """Return the curve at phases (F,), or its derivatives by the phase, as (F, D)."""
        return np.asarray(self._columns(np.asarray(phase), derivative) @ self.coefficients_)

    def left_over(self, phase: FloatArray, values: FloatArray) -> FloatArray:
        """Return (D,) the sum of squares that ``"m2"`` would leave, without keeping the fit."""
        return _left_over(self._columns(phase, 0), values - values.mean(axis=0))

    def _columns(self, phase: FloatArray, derivative: int) -> FloatArray:
        """Return (F, P) the basis or its first or second derivative."""
        K = self.n_harmonics
        speeds = TURN * np.arange(1, K + 1)
        # e^ix, e^2ix, ... as running products: far cheaper than a sine for each
        waves = np.cumprod(np.repeat(np.exp(1j * TURN * phase)[:, None], K, axis=1), axis=1)
        waves *= (1j * speeds) ** derivative
        columns = np.empty((len(phase), self.n_coefficients))
        columns[:, 0] = derivative == 0
        columns[:, 1 : K + 1] = waves.imag
        columns[:, K + 1 : 2 * K + 1] = waves.real
        if self.linear:
            columns[:, -1] = (phase, 1.0, 0.0)[derivative]
        return columns

    def _normal_equations(
        self, phase: FloatArray, values: FloatArray, derivative: int
    ) -> tuple[FloatArray, FloatArray]:
        columns = self._columns(phase, derivative)
        return columns.T @ columns, columns.T @ values

    def _estimated_weights(
        self,
        phase: FloatArray,
        values: FloatArray,
        rate_phase: FloatArray,
        rates: tuple[FloatArray, FloatArray],
    ) -> FloatArray:
        """Return (2, D) the weights that make the three errors' variances equal (eq. 3.15)."""
        of_values = self._residual_variance(phase, values, 0)
        variances = [
            self._residual_variance(rate_phase, rate, derivative)
            for derivative, rate in enumerate(rates, start=1)
        ]
        weights = np.zeros((2, values.shape[1]))
        for own, variance in zip(weights, variances, strict=True):
            moving = variance > NEGLIGIBLE_VARIANCE  # a channel at rest has no errors to balance
            own[moving] = of_values[moving] / variance[moving]
        return weights

    def _residual_variance(
        self, phase: FloatArray, values: FloatArray, derivative: int
    ) -> FloatArray:
        """Return (D,) the variance that a regression of its own leaves (eqs. 3.11 to 3.13)."""
        columns = self._columns(phase, derivative)
        columns = columns[:, columns.any(axis=0)]  # derivatives have no constant (eq. 3.12)
        centred = values if derivative else values - values.mean(axis=0)
        freedom = max(1, len(phase) - columns.shape[1])
        return np.asarray(_left_over(columns, centred) / freedom)

    def _solved(
        self, grams: FloatArray, moments: FloatArray, weights: FloatArray, n_frames: int
    ) -> FloatArray:
        """Solve every channel's weighted normal equations, columns scaled to unit length."""
        alike = bool((weights == weights[:, :1]).all())  # then one system does for all channels
        gram = np.einsum("sd,spq->dpq", weights[:, :1] if alike else weights, grams)
        moment = np.einsum("sd,spd->dp", weights, moments)
        penalised = slice(1, 2 * self.n_harmonics + 1)
        diagonal = np.arange(self.n_coefficients)
        gram[:, diagonal[penalised], diagonal[penalised]] += self.ridge * n_frames
        scale = 1.0 / np.sqrt(np.maximum(gram[:, diagonal, diagonal], NEGLIGIBLE_VARIANCE))
        gram *= scale[:, :, None] * scale[:, None, :]
        # phases that leave a gap make it all but singular
        gram[:, diagonal, diagonal] += NEARLY_SINGULAR
        scaled = moment * scale
        if alike:
            return np.asarray(np.linalg.solve(gram[0], scaled.T) * scale.T)
        return np.asarray((np.linalg.solve(gram, scaled[..., None])[..., 0] * scale).T)

    def _smoothed(
        self, gram: FloatArray, moment: FloatArray, smoothing: FloatArray, n_frames: int
    ) -> FloatArray:
        """Solve every channel's normal equations, each with a penalty of its own strength.

        All penalties have one shape, so that the basis in which it and the normal equations are
        both diagonal solves them all.
        """
        speeds = np.arange(1.0, self.n_harmonics + 1) ** SMOOTHED_POWER
        shape = np.zeros(self.n_coefficients)
        shape[1 : 2 * self.n_harmonics + 1] = n_frames * np.concatenate([speeds, speeds])
        middle = max(float(np.median(smoothing)), LEAST_SMOOTHING * float(smoothing.max()))
        penalised = np.zeros(self.n_coefficients)
        penalised[1 : 2 * self.n_harmonics + 1] = self.ridge * n_frames
        whole = gram + np.diag(penalised + middle * shape)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(whole), NEGLIGIBLE_VARIANCE))
        whole = whole * scale * scale[:, None] + NEARLY_SINGULAR * np.eye(len(whole))
        root = np.linalg.inv(np.linalg.cholesky(whole))
        strengths, axes = np.linalg.eigh(root * (shape * scale**2) @ root.T)
        axes = axes.T @ root * scale
        own = np.maximum(smoothing, LEAST_SMOOTHING * middle) - middle
        return np.asarray(axes.T @ (axes @ moment / (1.0 + strengths[:, None] * own)))


def _left_over(columns: FloatArray, values: FloatArray) -> FloatArray:
    """Return (D,) the sum of squares of what a combination of the columns cannot explain."""
    from scipy.linalg import solve_triangular

    gram, moment = columns.T @ columns, columns.T @ values
    scale = 1.0 / np.sqrt(np.diag(gram))
    gram *= scale[:, None] * scale
    gram[np.diag_indices_from(gram)] += NEARLY_SINGULAR
    explained = solve_triangular(np.linalg.cholesky(gram), moment * scale[:, None], lower=True)
    return np.asarray(np.maximum((values**2).sum(axis=0) - (explained**2).sum(axis=0), 0.0))


def finite_differences(values: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Return velocities and accelerations (F, D) by 9-point central differences.

    Parameters
    ----------
    values : (F, D)
        One row a frame.
    step : float
        Time between frames: a lap over the frames of a period (eq. 3.25).

    Notes
    -----
    The first and last four rows, which the stencil does not reach, are NaN.
    """
    velocities = np.full(values.shape, np.nan)
    accelerations = np.full(values.shape, np.nan)
    if len(values) > 2 * STENCIL_REACH:
        windows = np.lib.stride_tricks.sliding_window_view(values, 2 * STENCIL_REACH + 1, axis=0)
        inner = slice(STENCIL_REACH, len(values) - STENCIL_REACH)
        velocities[inner] = windows @ FIRST_STENCIL / step
        accelerations[inner] = windows @ SECOND_STENCIL / step**2
    return velocities, accelerations
