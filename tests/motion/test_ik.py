"""Turns and smoothing are scipy's, without its imports."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from mocapdb.motion.ik import _gaussian_smoothed, _rotation_about


def test_turns_are_those_of_scipy():
    axes = np.random.default_rng(0).normal(size=(60, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.concatenate([np.linspace(-3.0, 3.0, 41), np.linspace(-2e-3, 2e-3, 19)])
    expected = Rotation.from_rotvec(axes * angles[:, None]).as_matrix()
    np.testing.assert_allclose(_rotation_about(axes, angles), expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize(("n_frames", "sigma"), [(1, 2.0), (5, 4.0), (200, 0.4), (200, 4.8)])
def test_smoothing_is_that_of_scipy(n_frames, sigma):
    values = np.random.default_rng(0).normal(size=(n_frames, 3)).cumsum(axis=0)
    expected = gaussian_filter1d(values, sigma, axis=0)
    np.testing.assert_allclose(_gaussian_smoothed(values, sigma), expected, rtol=1e-12, atol=1e-14)
