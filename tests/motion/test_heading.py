import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mocapdb.motion.heading import heading_angles


@pytest.mark.parametrize("up", [1, 2])
def test_a_turn_about_the_vertical_is_the_yaw(up):
    yaw = np.linspace(-2, 9, 300)
    rotations = Rotation.from_rotvec(np.outer(yaw, np.eye(3)[up])).as_matrix()
    np.testing.assert_allclose(heading_angles(rotations, up), yaw, atol=1e-12)


@pytest.mark.parametrize("axis", ["x", "z"], ids=["somersault", "cartwheel"])
@pytest.mark.parametrize("step_deg", [0.5, 7.0])
def test_heading_is_continuous_upside_down(axis, step_deg):
    angles = np.deg2rad(np.arange(0, 720, step_deg))
    body = Rotation.from_euler("y", 0.8) * Rotation.from_euler(axis, angles[:, None])
    heading = heading_angles(body.as_matrix(), 1)
    np.testing.assert_allclose(heading, 0.8, atol=1e-9)


@pytest.mark.parametrize("lean", [0.05, 0.2, 0.6])
def test_a_leaning_somersault_turns_no_faster_than_the_body(lean):
    angles = np.deg2rad(np.arange(0, 720, 1.0))
    body = Rotation.from_euler("z", lean) * Rotation.from_euler("x", angles[:, None])
    steps = np.abs(np.diff(heading_angles(body.as_matrix(), 1)))
    assert np.rad2deg(steps).max() < 5


@given(st.floats(-3, 3), st.integers(0, 1000))
def test_turning_the_world_turns_the_heading(turn, seed):
    rng = np.random.default_rng(seed)
    wobble = np.cumsum(rng.normal(scale=0.02, size=(100, 3)), axis=0)
    body = Rotation.from_rotvec(wobble)
    before = heading_angles(body.as_matrix(), 1)
    after = heading_angles((Rotation.from_euler("y", turn) * body).as_matrix(), 1)
    turns = (after - before - turn) / (2 * np.pi)
    np.testing.assert_allclose(turns, round(turns[0]), atol=1e-9)
