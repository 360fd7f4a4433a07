import numpy as np
import pytest

from mocapdb.compression.okane.pca import principal_components


def poses(n_frames, n_columns, spread, seed=0):
    """Poses whose variances along hidden orthonormal directions are known."""
    rng = np.random.default_rng(seed)
    directions, _ = np.linalg.qr(rng.normal(size=(n_columns, len(spread))))
    scores = rng.normal(size=(n_frames, len(spread)))
    scores -= scores.mean(axis=0)
    scores, _ = np.linalg.qr(scores)
    return scores * spread @ directions.T + 2.0, directions.T


@pytest.mark.parametrize("n_frames", [6, 40])
def test_finds_the_directions_that_the_poses_were_made_of(n_frames):
    values, directions = poses(n_frames, 10, np.array([5.0, 2.0, 1.0]))
    components = principal_components(values)
    np.testing.assert_allclose(components.mean, 2.0, atol=1e-6)
    overlap = np.abs(components.axes[:3] @ directions.T)
    np.testing.assert_allclose(overlap, np.eye(3), atol=1e-6)


def test_what_is_left_out_is_the_variance_of_the_other_axes():
    spread = np.array([5.0, 2.0, 1.0])
    values, _ = poses(40, 10, spread)
    for count in range(4):
        chosen = principal_components(values).first(count)
        residual = values - chosen.restore(chosen.project(values))
        assert np.sum(residual**2) == pytest.approx(np.sum(spread[count:] ** 2), abs=1e-9)


@pytest.mark.parametrize("shape", [(1, 5), (2, 5), (5, 5), (9, 5), (3, 0), (4, 1)])
def test_all_components_bring_any_poses_back(shape):
    values = np.random.default_rng(1).normal(size=shape)
    components = principal_components(values)
    assert len(components) <= shape[1]
    back = components.restore(components.project(values))
    np.testing.assert_allclose(back, values, atol=1e-6)


def test_still_poses_need_no_axes_beyond_rounding():
    values = np.tile([1.0, 2.0, 3.0], (7, 1))
    components = principal_components(values).first(0)
    np.testing.assert_array_equal(components.restore(components.project(values)), values)


def test_numbers_are_those_that_float32_holds():
    components = principal_components(np.random.default_rng(2).normal(size=(20, 4)))
    for numbers in (components.mean, components.axes):
        np.testing.assert_array_equal(numbers, numbers.astype(np.float32))
    assert components.n_numbers == 4 + 4 * 4


def test_the_largest_entry_of_an_axis_is_positive():
    values = np.random.default_rng(3).normal(size=(30, 6))
    for axis in principal_components(values).axes:
        assert axis[np.abs(axis).argmax()] > 0
    np.testing.assert_allclose(
        principal_components(values).axes, principal_components(2 - values).axes, atol=1e-6
    )
