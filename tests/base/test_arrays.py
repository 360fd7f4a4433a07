"""What is asked of arrays everywhere."""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import quantile_of


def test_a_quantile_of_a_few_values_is_that_of_numpy():
    rng = np.random.default_rng(0)
    for n in (1, 2, 3, 10, 101):
        values = rng.normal(size=n)
        for share in (0.0, 0.3, 0.5, 0.9, 1.0):
            np.testing.assert_allclose(quantile_of(values, share), np.quantile(values, share))
