"""How much of jitter there is behind what a filter shows of it."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from mocapdb.cleaning.repair.gaps import _noise_of


@pytest.mark.parametrize("smooth", [1.0, 2.0, 3.0])
def test_size_and_smoothness_of_noise_are_found_though_its_slow_part_is_not_seen(smooth):
    rng = np.random.default_rng(0)
    noise = gaussian_filter1d(rng.normal(size=(200_000, 1)), smooth, axis=0)
    noise *= 10.0 / np.sqrt((noise**2).mean())
    width = 6.0
    quick = noise - gaussian_filter1d(noise, width, axis=0)
    seen = np.sqrt((quick**2).mean())
    size, found = _noise_of(seen, np.sqrt((np.diff(noise, axis=0) ** 2).mean()), width)
    assert seen < 0.97 * 10.0
    assert size == pytest.approx(10.0, rel=0.05)
    assert found == pytest.approx(smooth, rel=0.15)


def test_no_noise_is_none():
    assert _noise_of(0.0, 0.0, 6.0)[0] == 0.0
