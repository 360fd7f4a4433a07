"""The low-pass is scipy's, without scipy.signal's import."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from mocapdb.cycles.synthesis.lowpass import lowpass, lowpass_sections


@pytest.mark.parametrize("cutoff", [0.01, 12 / 240, 0.1, 0.2, 12 / 50, 0.5, 0.8, 0.9])
def test_sections_are_those_of_scipy(cutoff):
    np.testing.assert_allclose(
        lowpass_sections(cutoff), butter(4, cutoff, output="sos"), rtol=1e-12
    )


@pytest.mark.parametrize(("n_frames", "padding"), [(300, 15), (8, 7), (20, 0)])
def test_values_are_those_of_scipy(n_frames, padding):
    values = np.random.default_rng(0).normal(size=(n_frames, 5, 3)).cumsum(axis=0)
    expected = sosfiltfilt(butter(4, 0.2, output="sos"), values, axis=0, padlen=padding)
    np.testing.assert_allclose(lowpass(values, 0.2, padding), expected, rtol=1e-10, atol=1e-10)
