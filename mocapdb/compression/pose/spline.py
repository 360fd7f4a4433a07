"""Cubic B-splines with knots every few frames: fitted to weighted samples, and evaluated.

A spline with knots every `spacing` frames has one coefficient a knot and one more at each end; with
a spacing of 1 the coefficients are the samples themselves. Coefficient k sits at frame
``(k - 1) * spacing``.

`factorise` gives the triangular form of the fit, in which coefficients can be quantised one after
the other, each making up for the errors of those before it.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import FloatArray, Int32Array, IntArray
from mocapdb.base.kernels import jit
from mocapdb.compression.tuning import SPLINE_RIDGE

__all__ = ["NOISE_GAIN", "coefficient_count", "evaluate", "evaluate_all", "factorise"]

NOISE_GAIN = 0.3304
"""Geometric mean of the power spectrum of a cubic B-spline's samples: the quantisation noise that a
coefficient leaves in a sample, in power, where later coefficients make up for earlier ones."""


@jit
def coefficient_count(n_frames: int, spacing: int) -> int:
    """Return how many coefficients a spline over so many frames has."""
    if spacing == 1:
        return n_frames
    return -(-(n_frames - 1) // spacing) + 3


@jit
def _basis(spacing: int) -> FloatArray:
    """Return (spacing, 4) values of the four splines that reach a frame, by its place."""
    table = np.empty((spacing, 4))
    for i in range(spacing):
        x = i / spacing
        y = 1.0 - x
        table[i, 0] = y * y * y / 6.0
        table[i, 1] = 2.0 / 3.0 - x * x + x * x * x / 2.0
        table[i, 2] = 2.0 / 3.0 - y * y + y * y * y / 2.0
        table[i, 3] = x * x * x / 6.0
    return table


@jit
def evaluate(coefficients: FloatArray, spacing: int, first: int, samples: FloatArray) -> None:
    """Write the values of a spline at the frames `first` and after into `samples`."""
    end = first + len(samples)
    if spacing == 1:
        for t in range(first, end):
            samples[t - first] = coefficients[t]
        return
    table = _basis(spacing)
    for k in range(first // spacing, (end + spacing - 1) // spacing):
        a, b, c = coefficients[k], coefficients[k + 1], coefficients[k + 2]
        d = coefficients[k + 3] if k + 3 < len(coefficients) else 0.0
        start = k * spacing
        for i in range(max(first - start, 0), min(spacing, end - start)):
            samples[start + i - first] = (
                table[i, 0] * a + table[i, 1] * b + table[i, 2] * c + table[i, 3] * d
            )


@jit
def evaluate_all(
    integers: Int32Array,
    starts: IntArray,
    spacings: IntArray,
    steps: FloatArray,
    first: int,
    columns: FloatArray,
) -> None:
    """Write samples of many splines, or of constants, into the rows of `columns` (C, F).

    Parameters
    ----------
    integers : (N,)
        The tracks one after the other, in steps.
    starts : (C + 1,)
        Where each begins.
    spacings : (C,)
        0 for a constant; below 0 for a transform's track, which is left alone.
    steps : (C,)
    first : int
        The frame that the columns begin with.
    columns : (C, F)
    """
    coefficients = np.empty(len(integers))
    for i in range(len(spacings)):
        n = starts[i + 1] - starts[i]
        for k in range(n):
            coefficients[k] = integers[starts[i] + k] * steps[i]
        if spacings[i] > 0:
            evaluate(coefficients[:n], spacings[i], first, columns[i])
        elif spacings[i] == 0:
            columns[i, :] = coefficients[0]


@jit
def factorise(
    samples: FloatArray, weights: FloatArray, spacing: int, n_coefficients: int
) -> tuple[FloatArray, FloatArray]:
    """Return the weighted least-squares spline and the triangular form of its fit.

    Parameters
    ----------
    samples, weights : (F,)
    spacing, n_coefficients : int

    Returns
    -------
    (N,) the best coefficients c
    (N, 4) the factor T
        Other coefficients b add ``sum_k (sum_d T[k, d] (b - c)[k - d]) ** 2`` to the weighted
        squared error: row k concerns coefficient k and the three before it.
    """
    n = n_coefficients
    factor = np.zeros((n, 4))
    best = np.empty(n)
    if spacing == 1:
        for k in range(n):
            factor[k, 0] = np.sqrt(weights[k])
            best[k] = samples[k]
        return best, factor

    table = _basis(spacing)
    gram = np.zeros((n + 3, 4))  # gram[k, d]: coefficients k and k + d; no frame reaches the last 3
    right = np.zeros(n + 3)
    for k in range(n):
        for t in range(k * spacing, min((k + 1) * spacing, len(samples))):
            place = t - k * spacing
            for i in range(4):
                weighted = weights[t] * table[place, i]
                right[k + i] += weighted * samples[t]
                for j in range(i, 4):
                    gram[k + i, j - i] += weighted * table[place, j]
    largest = 0.0
    for k in range(n):
        largest = max(largest, gram[k, 0])
    ridge = SPLINE_RIDGE * largest
    for k in range(n):
        gram[k, 0] += ridge

    # gram = T.T @ T with T lower triangular, from the last row upwards
    inverse = np.empty(n)  # of the diagonal
    for k in range(n - 1, -1, -1):
        square, rest = gram[k, 0], right[k]
        for m in range(k + 1, min(n, k + 4)):
            square -= factor[m, m - k] ** 2
            rest -= factor[m, m - k] * best[m]
        factor[k, 0] = np.sqrt(max(square, 1e-6 * ridge))
        inverse[k] = 1.0 / factor[k, 0]
        best[k] = rest * inverse[k]
        for d in range(1, min(4, k + 1)):
            j = k - d
            product = gram[j, d]
            for m in range(k + 1, min(n, j + 4)):
                product -= factor[m, m - k] * factor[m, m - j]
            factor[k, d] = product * inverse[k]
    for k in range(n):
        for d in range(1, min(4, k + 1)):
            best[k] -= factor[k, d] * best[k - d]
        best[k] *= inverse[k]
    return best, factor
