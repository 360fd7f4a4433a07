import numpy as np
import pytest
from hypothesis import given
from naive import naive_forward_kinematics
from scipy.spatial.transform import Rotation
from strategies import clips

from mocapdb.errors import SkeletonError
from mocapdb.motion.kinematics import (
    Pose,
    axis_rotations,
    channels_from_pose,
    forward_kinematics,
    to_metres,
)
from mocapdb.motion.skeleton import Skeleton


def chain(convention, offsets, dofs, orders, **fields):
    names = [f"j{i}" for i in range(len(offsets))]
    return Skeleton(
        names, range(-1, len(offsets) - 1), offsets, dofs, orders, convention=convention, **fields
    )


@given(clips())
def test_the_kernel_equals_its_naive_twin(clip):
    pose = forward_kinematics(clip.skeleton, clip.channels)
    positions, rotations = naive_forward_kinematics(clip)
    np.testing.assert_allclose(pose.positions, positions, atol=1e-9)
    np.testing.assert_allclose(pose.rotations, rotations, atol=1e-12)


@given(clips())
def test_channels_from_pose_is_the_inverse(clip):
    pose = forward_kinematics(clip.skeleton, clip.channels)
    again = forward_kinematics(clip.skeleton, channels_from_pose(clip.skeleton, pose))
    np.testing.assert_allclose(again.positions, pose.positions, atol=1e-9)
    np.testing.assert_allclose(again.rotations, pose.rotations, atol=1e-9)


def test_an_acclaim_bone_turns_with_its_own_joint():
    skeleton = chain("acclaim", [[0, 0, 0], [1, 0, 0]], [("tx",), ("rz",)], ["", "Z"])
    pose = forward_kinematics(skeleton, np.array([[5.0, 90.0]]))
    np.testing.assert_allclose(pose.positions[0], [[5, 0, 0], [5, 1, 0]], atol=1e-12)


def test_a_bvh_bone_turns_with_its_parent():
    skeleton = chain(
        "bvh", [[0, 0, 0], [1, 0, 0], [1, 0, 0]], [("rz",), ("rz",), ()], ["Z", "Z", ""]
    )
    pose = forward_kinematics(skeleton, np.array([[0.0, 90.0]]))
    np.testing.assert_allclose(pose.positions[0], [[0, 0, 0], [1, 0, 0], [1, 1, 0]], atol=1e-12)


def test_x_is_applied_first_in_an_acclaim_joint():
    skeleton = chain("acclaim", [[0, 0, 0], [0, 1, 0]], [(), ("rx", "ry", "rz")], ["", "ZYX"])
    pose = forward_kinematics(skeleton, np.array([[90.0, 90.0, 0.0]]))
    # y -> z by the turn about x, z -> x by the turn about y
    np.testing.assert_allclose(pose.positions[0, 1], [1, 0, 0], atol=1e-12)


def test_the_axis_of_an_acclaim_joint_turns_its_degrees_of_freedom():
    skeleton = chain(
        "acclaim", [[0, 0, 0], [0, 1, 0]], [(), ("rx",)], ["", "X"],
        axis_deg=[[0, 0, 0], [0, 0, 90]],
    )  # fmt: skip
    pose = forward_kinematics(skeleton, np.array([[90.0]]))
    # its x axis is the world's y axis, so a bone along y stays where it is
    np.testing.assert_allclose(pose.positions[0, 1], [0, 1, 0], atol=1e-12)


def test_the_rotations_of_axes_are_scipys_to_the_last_bit():
    axis_deg = np.random.default_rng(0).uniform(-180, 180, (300, 3)).round(3)
    axis_deg[:100:2, 0] = axis_deg[::5, 1] = 0.0
    skeleton = chain("acclaim", np.zeros((300, 3)), [()] * 300, [""] * 300, axis_deg=axis_deg)
    expected = Rotation.from_euler("xyz", axis_deg, degrees=True).as_matrix()
    np.testing.assert_array_equal(axis_rotations(skeleton), expected)


def test_position_channels_replace_a_bvh_offset_and_add_to_an_acclaim_one():
    fields = {"offsets": [[0, 0, 7.0]], "dofs": [("tz",)], "orders": [""]}
    for convention, expected in (("bvh", 3.0), ("acclaim", 10.0)):
        pose = forward_kinematics(chain(convention, **fields), np.array([[3.0]]))
        assert pose.positions[0, 0, 2] == expected


def test_a_joint_makes_up_for_what_its_parent_cannot_reach():
    skeleton = chain(
        "acclaim", [[0, 0, 0], [1, 0, 0], [1, 0, 0]], [(), ("rx",), ("rx", "ry", "rz")],
        ["", "X", "ZYX"],
    )  # fmt: skip
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    rotations = np.stack([np.eye(3), turned, turned])[None]
    channels = channels_from_pose(skeleton, Pose(np.zeros((1, 3, 3)), rotations))
    reached = forward_kinematics(skeleton, channels)
    np.testing.assert_allclose(reached.rotations[0, 1], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(reached.rotations[0, 2], turned, atol=1e-12)


def test_angles_are_continuous_over_time():
    skeleton = chain("acclaim", [[0, 0, 0]], [("rx", "ry", "rz")], ["ZYX"])
    turns = np.linspace(0, 1000, 400)
    channels = np.column_stack([0.3 * turns, 0.1 * turns, turns])
    again = channels_from_pose(skeleton, forward_kinematics(skeleton, channels))
    assert np.abs(np.diff(again, axis=0)).max() < 10
    np.testing.assert_allclose(again - again[0], channels - channels[0], atol=1e-6)


def test_metres_are_y_up():
    skeleton = chain("bvh", [[0, 0, 0]], [("tx",)], [""], up="z", metres_per_unit=0.01)
    np.testing.assert_allclose(
        to_metres(skeleton, np.array([100.0, 200.0, 300.0])), [1.0, 3.0, -2.0]
    )


def test_the_wrong_number_of_channels_is_told():
    skeleton = chain("bvh", [[0, 0, 0]], [("tx",)], [""])
    with pytest.raises(SkeletonError, match=r"shape \(frames, 1\).*got \(5, 2\)"):
        forward_kinematics(skeleton, np.zeros((5, 2)))
