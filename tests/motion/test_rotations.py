from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mocapdb.motion.rotations import (
    basis_along,
    change_orders,
    continuous_angles,
    elementary,
    extract_angles,
)

ORDERS = ["".join(axes) for n in (1, 2, 3) for axes in permutations("XYZ", n)]


@pytest.mark.parametrize("order", ORDERS)
def test_extracted_angles_give_the_rotation_back(order):
    rng = np.random.default_rng(0)
    angles = rng.uniform(-np.pi, np.pi, (200, len(order)))
    if len(order) == 3:  # gimbal lock, exactly and nearly
        angles[:20, 1] = np.pi / 2
        angles[20:40, 1] = -np.pi / 2 + 1e-9
    rotations = Rotation.from_euler(order, angles).as_matrix()
    found = extract_angles(order, rotations)
    again = Rotation.from_euler(order, found).as_matrix()
    np.testing.assert_allclose(again, rotations, atol=1e-14)
    smooth = Rotation.from_euler(order, continuous_angles(order, found)).as_matrix()
    np.testing.assert_allclose(smooth, rotations, atol=1e-12)


@pytest.mark.parametrize("order", ORDERS)
def test_continuous_angles_go_on_from_those_before(order):
    angles = np.random.default_rng(1).uniform(-9, 9, (60, len(order)))
    whole = continuous_angles(order, angles)
    later = continuous_angles(order, angles[30:], before=whole[29])
    np.testing.assert_array_equal(later, whole[30:])
    np.testing.assert_array_equal(whole[0], angles[0])
    assert np.abs(np.diff(whole, axis=0)).max() <= np.pi + 1e-12


@pytest.mark.parametrize("order", ["XYZ", "ZXY", "YXZ"])
@pytest.mark.parametrize("other", ["ZYX", "XZY"])
def test_another_order_of_axes_is_the_same_rotation(order, other):
    values = np.random.default_rng(0).uniform(-400, 400, (50, 5))
    before, after = [1, 4, 2], [2, 1, 4]
    changes = np.array([[before, [*map("XYZ".index, order)], after, [*map("XYZ".index, other)]]])
    changed = values.copy()
    change_orders(changes, values, changed)
    expected = Rotation.from_euler(order, values[:, before], degrees=True).as_matrix()
    found = Rotation.from_euler(other, changed[:, after], degrees=True).as_matrix()
    np.testing.assert_allclose(found, expected, atol=1e-13)
    np.testing.assert_array_equal(changed[:, [0, 3]], values[:, [0, 3]])


@pytest.mark.parametrize("axis", "XYZ")
def test_one_axis_gives_the_nearest_turn_about_it(axis):
    rotation = Rotation.from_rotvec([0.4, -0.5, 0.7]).as_matrix()[None]
    (found,) = extract_angles(axis, rotation)
    candidates = np.linspace(-np.pi, np.pi, 20001)
    distances = ((elementary(axis, candidates) - rotation) ** 2).sum(axis=(1, 2))
    assert found[0] == pytest.approx(candidates[distances.argmin()], abs=1e-3)


@given(
    st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 1e-6)
)
def test_a_basis_along_a_direction(direction):
    basis = basis_along(np.array(direction))
    np.testing.assert_allclose(basis[:, 0], direction / np.linalg.norm(direction), atol=1e-14)
    np.testing.assert_allclose(basis.T @ basis, np.eye(3), atol=1e-14)
    assert np.linalg.det(basis) == pytest.approx(1.0)


def test_a_basis_is_exact_next_to_minus_x():
    basis = basis_along(np.array([-1.0, 3e-6, 0.0]))
    np.testing.assert_allclose(basis.T @ basis, np.eye(3), atol=1e-15)
