"""Splines: equal to their naive twin, and the triangular form tells the error exactly."""

import numpy as np
import pytest
from naive_codec import naive_spline

from mocapdb.compression.pose.spline import coefficient_count, evaluate, factorise

SPACINGS = [1, 2, 3, 6, 32]
LENGTHS = [1, 2, 3, 7, 33, 100]


@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("n_frames", LENGTHS)
def test_values_equal_the_naive_twins(spacing, n_frames):
    n = coefficient_count(n_frames, spacing)
    coefficients = np.random.default_rng(0).normal(size=n)
    samples = np.empty(n_frames)
    evaluate(coefficients, spacing, 0, samples)
    np.testing.assert_allclose(samples, naive_spline(coefficients, spacing, n_frames), atol=1e-12)
    for first in range(n_frames):
        some = np.empty((n_frames - first + 1) // 2)
        evaluate(coefficients, spacing, first, some)
        np.testing.assert_array_equal(some, samples[first : first + len(some)])


@pytest.mark.parametrize("spacing", SPACINGS[1:])
@pytest.mark.parametrize("n_frames", [33, 100])
def test_the_triangular_form_tells_what_other_coefficients_cost(spacing, n_frames):
    rng = np.random.default_rng(1)
    samples, weights = rng.normal(size=n_frames).cumsum(), rng.uniform(0.5, 2.0, n_frames)
    n = coefficient_count(n_frames, spacing)
    best, factor = factorise(samples, weights, spacing, n)

    def error(coefficients):
        values = naive_spline(coefficients, spacing, n_frames)
        return weights @ (samples - values) ** 2

    change = rng.normal(size=n)
    rows = [sum(factor[k, d] * change[k - d] for d in range(min(4, k + 1))) for k in range(n)]
    told = np.square(rows).sum()
    assert error(best + change) - error(best) == pytest.approx(told, rel=1e-4, abs=1e-4)


def test_a_cubic_is_fitted_exactly():
    time = np.linspace(-1, 1, 61)
    cubic = 3 * time**3 - time
    best, _ = factorise(cubic, np.ones(61), 12, coefficient_count(61, 12))
    samples = np.empty(61)
    evaluate(best, 12, 0, samples)
    np.testing.assert_allclose(samples, cubic, atol=1e-4)


def test_coefficients_that_no_sample_tells_apart_are_held_by_a_ridge():
    """Three coefficients of one sample: a ridge of 1e-10 of the largest entry."""
    _, factor = factorise(np.ones(1), np.ones(1), 4, 3)
    ridge = 1e-10 * 4 / 9
    assert factor[1, 0] ** 2 == pytest.approx(17 * ridge, rel=1e-3)
