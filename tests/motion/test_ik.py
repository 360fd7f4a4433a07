"""Legs that reach softly; turns and smoothing are scipy's, without its imports."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from mocapdb.corpus import synthetic
from mocapdb.motion.foot_contacts import find_legs
from mocapdb.motion.ik import _gaussian_smoothed, _knee_axis, _rotation_about, _soft_reach, planted
from mocapdb.motion.kinematics import Pose, forward_kinematics


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


LENGTHS = np.linspace(0.5, 0.99999, 300)


def soft(was, wanted):
    was, wanted = np.broadcast_arrays(np.float64(was), np.float64(wanted))
    return _soft_reach(was, wanted, np.ones(was.shape), 0.98)


def test_a_leg_that_is_not_pulled_keeps_its_length():
    np.testing.assert_allclose(soft(LENGTHS, LENGTHS), LENGTHS, rtol=0, atol=1e-12)


def test_a_bent_leg_goes_where_it_is_wanted_and_a_long_one_nearly():
    assert soft(0.6, 0.9799) == pytest.approx(0.9799)
    # from .98 on: 1 - .02 exp(-(x - .98) / .02)
    assert soft(0.6, 1.0) == pytest.approx(1.0 - 0.02 / np.e)
    assert soft(0.98, 0.99) == pytest.approx(1.0 - 0.02 * np.exp(-0.5))
    assert soft(0.6, 5.0) <= 1.0


def test_a_straight_knee_hardly_changes_its_angle():
    near = np.array([0.999, 0.9999, 0.99999])
    for pull in (-0.01, 0.01):
        angles = [
            np.rad2deg(np.arccos(2 * length**2 - 1)) for length in (near, soft(near, near + pull))
        ]
        assert np.abs(angles[1] - angles[0]).max() < 3.5
        assert np.abs(angles[1] - angles[0])[2] < 0.4


def test_a_straight_knee_bends_about_its_usual_axis():
    angles = np.array([0.0, 0.05, 1.0, 1.2])
    thigh = np.tile([0.0, -1.0, 0.0], (4, 1))
    tilt = np.array([0.0, 1.0, 0.0, 0.0])  # of the second knee's plane, by a quarter turn
    axis = np.where(tilt[:, None] > 0, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    shank = np.einsum("fij,fj->fi", Rotation.from_rotvec(axis * angles[:, None]).as_matrix(), thigh)
    found = _knee_axis(thigh, shank, np.tile(np.eye(3), (4, 1, 1)))
    np.testing.assert_allclose(found[[0, 2]], [[1.0, 0.0, 0.0]] * 2, atol=0.05)
    # at a sine of .05 both directions count alike
    np.testing.assert_allclose(found[1], np.array([1.0, 0.0, 1.0]) / np.sqrt(2), atol=0.03)


def test_feet_out_of_reach_do_not_pop_the_knees():
    walk = synthetic.make_clip("walk", seed=1)
    pose = forward_kinematics(walk.skeleton, walk.channels)
    legs = find_legs(walk.skeleton)
    pulled = Pose(pose.positions.copy(), pose.rotations.copy())
    stride = np.sin(np.arange(len(walk)) / 40.0)
    pulled.positions[:, :, 0] += stride[:, None]  # the ground slides under the feet
    contacts = np.ones((len(walk), 2), dtype=bool)
    contacts[200:400] = False
    held = planted(walk.skeleton, pulled, contacts, walk.fps)
    knees = [leg.knee for leg in legs]
    peaks = [
        np.linalg.norm(np.diff(p.positions[:, knees], n=2, axis=0), axis=2).max()
        for p in (pulled, held)
    ]
    assert peaks[1] < 2.0 * peaks[0]
    lengths = np.linalg.norm(held.positions[:, knees[0]] - held.positions[:, legs[0].hip], axis=1)
    np.testing.assert_allclose(lengths, lengths[0], rtol=1e-9)
