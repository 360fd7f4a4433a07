import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles.phase.pose_cloud import (
    aligned_positions,
    delay_embedding,
    joint_angles,
    pose_cloud,
    principal_axes,
)
from mocapdb.errors import CycleError, SkeletonError


def test_delays_append_later_rows():
    rows = delay_embedding(np.arange(6.0)[:, None], 2, 2)
    assert rows.tolist() == [[0, 2, 4], [1, 3, 5]]


@pytest.mark.parametrize(("factor", "lag"), [(2, 3), (-1, 1), (1, 0)])
def test_delays_that_do_not_fit(factor, lag):
    with pytest.raises(CycleError, match="delay"):
        delay_embedding(np.ones((6, 2)), factor, lag)


def test_aligned_positions_do_not_depend_on_place_or_heading():
    one = synthetic.make_clip("walk", seed=3, n_cycles=1)
    other = synthetic.make_clip("walk", seed=3, n_cycles=1, heading_deg=130)
    np.testing.assert_allclose(aligned_positions(one), aligned_positions(other), atol=1e-6)


def test_clouds_by_kind(synthetic_walk):
    n_frames, skeleton = len(synthetic_walk), synthetic_walk.skeleton
    assert pose_cloud(synthetic_walk).shape == (n_frames, 3 * skeleton.n_joints)
    angles = pose_cloud(synthetic_walk, "angles", root="orientation")
    np.testing.assert_allclose(angles, _unordered(angles, joint_angles(synthetic_walk)))
    assert pose_cloud(synthetic_walk, "rotations", joints=["lfemur"]).shape == (n_frames, 6)
    differences = pose_cloud(synthetic_walk, "angles", root="differences")
    assert differences.shape == (n_frames, angles.shape[1] + 3)
    assert pose_cloud(synthetic_walk, n_components=4).shape == (n_frames, 4)


def _unordered(like, angles):
    """The same columns, in the order of rotation orders instead of dofs."""
    order = [int(np.argmin(np.abs(angles - column[:, None]).sum(axis=0))) for column in like.T]
    return angles[:, order]


def test_normalised_dimensions_have_unit_variance(synthetic_walk):
    spread = pose_cloud(synthetic_walk, "angles", normalise=True).std(axis=0)
    assert set(np.round(spread[spread > 1e-9], 6)) == {1.0}


def test_bone_length_makes_a_finger_small(synthetic_walk):
    finger = pose_cloud(synthetic_walk, "rotations", joints=["lfingers"], by_bone_length=True)
    thigh = pose_cloud(synthetic_walk, "rotations", joints=["lfemur"], by_bone_length=True)
    assert np.linalg.norm(finger[0]) < 0.15 * np.linalg.norm(thigh[0])


def test_principal_axes_keep_distances():
    rows = np.random.default_rng(0).normal(size=(50, 4)) @ np.random.default_rng(1).normal(
        size=(4, 9)
    )
    flat = principal_axes(rows, 4)
    np.testing.assert_allclose(
        np.linalg.norm(flat[0] - flat[1:], axis=1), np.linalg.norm(rows[0] - rows[1:], axis=1)
    )


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        ({"features": "smell"}, CycleError, "features"),
        ({"root": "tree"}, CycleError, "root"),
        ({"joints": ["tail"]}, SkeletonError, "tail"),
        ({"features": "angles", "joints": ["lhipjoint"]}, CycleError, "no channels"),
        ({"n_components": 0}, CycleError, "principal axis"),
    ],
)
def test_bad_clouds(synthetic_walk, options, error, text):
    with pytest.raises(error, match=text):
        pose_cloud(synthetic_walk, **options)
