import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles.curve.flips import bridge_flips
from mocapdb.cycles.curve.rotation_values import choose_rotation_values
from mocapdb.cycles.curve.unroll_path import unroll_path
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


def with_offset(clip, joint, frames, degrees):
    channels = clip.channels.copy()
    first = clip.skeleton.channel_starts[clip.skeleton.joint(joint)]
    channels[frames, first] += degrees
    return clip.replace(channels=channels)


def test_flips_are_bridged(synthetic_walk):
    flipped = with_offset(synthetic_walk, "lhand", slice(100, 107), 175.0)
    bridged, count = bridge_flips(flipped)
    assert count == 7
    np.testing.assert_allclose(bridged.channels, synthetic_walk.channels, atol=1.0)
    assert bridge_flips(synthetic_walk) == (synthetic_walk, 0)


def test_what_is_mostly_flipped_is_left_alone(synthetic_walk):
    flipped = with_offset(synthetic_walk, "lhand", slice(100, None), 175.0)
    bridged, _ = bridge_flips(flipped)
    np.testing.assert_allclose(bridged.channels[300:], flipped.channels[300:], atol=1e-9)


def test_a_clip_that_turns_is_unroll_path(synthetic_walk):
    from mocapdb.motion.heading import heading_angles
    from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
    from mocapdb.motion.rotations import elementary

    skeleton = synthetic_walk.skeleton
    pose = forward_kinematics(skeleton, synthetic_walk.channels)
    yaw = np.linspace(0, 2.5, len(synthetic_walk))
    forth = elementary("Y", yaw)
    steps = np.einsum("fij,fj->fi", forth[:-1], np.diff(pose.positions[:, 0], axis=0))
    path = np.vstack([pose.positions[:1, 0], pose.positions[0, 0] + np.cumsum(steps, axis=0)])
    around = np.einsum("fij,fkj->fki", forth, pose.positions - pose.positions[:, :1])
    turned = Pose(path[:, None] + around, forth[:, None] @ pose.rotations)
    circling = synthetic_walk.replace(channels=channels_from_pose(skeleton, turned))
    found = unroll_path(circling, 130)
    assert found.turn_rad == pytest.approx(2.5 * 130 / len(synthetic_walk), rel=0.05)
    straight = forward_kinematics(skeleton, found.clip.channels)
    assert np.ptp(heading_angles(straight.rotations[:, 0], 1)) < 0.2
    level = np.ptp(straight.positions[:, 0], axis=0)
    original = np.ptp(pose.positions[:, 0], axis=0)
    assert np.hypot(level[0], level[2]) == pytest.approx(
        np.hypot(original[0], original[2]), rel=0.02
    )
    assert unroll_path(synthetic_walk, 130).clip is synthetic_walk


def test_values_go_there_and_back(synthetic_walk):
    from mocapdb.cycles.curve.rotation_values import local_rotations

    plain = choose_rotation_values(synthetic_walk)
    assert plain.matrix_joints == ()
    local = local_rotations(synthetic_walk.skeleton, synthetic_walk.channels)
    np.testing.assert_allclose(plain.decode(plain.encode(synthetic_walk)), local, atol=1e-9)
    whole = type(plain)(plain.skeleton, (0, plain.skeleton.joint("lhumerus")))
    values = whole.encode(synthetic_walk)
    np.testing.assert_allclose(whole.decode(values), local, atol=1e-9)
    assert len(whole.names()) == values.shape[1] == plain.encode(synthetic_walk).shape[1] + 12


def test_a_joint_that_turns_all_the_way_round_is_written_whole(synthetic_walk):
    spin = with_offset(
        synthetic_walk, "lhumerus", slice(None), 360.0 * np.arange(len(synthetic_walk)) / 130
    )
    assert choose_rotation_values(spin).matrix_joints == (spin.skeleton.joint("lhumerus"),)
