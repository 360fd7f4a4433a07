import numpy as np
import pytest

from mocapdb.cycles.curve.unroll_path import unroll_path
from mocapdb.motion.heading import heading_angles
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.rotations import elementary


def turning(clip, radians):
    """The clip, its heading turned by so much from the first frame to the last."""
    pose = forward_kinematics(clip.skeleton, clip.channels)
    forth = elementary("Y", np.linspace(0, radians, len(clip)))
    steps = np.einsum("fij,fj->fi", forth[:-1], np.diff(pose.positions[:, 0], axis=0))
    path = np.vstack([pose.positions[:1, 0], pose.positions[0, 0] + np.cumsum(steps, axis=0)])
    around = np.einsum("fij,fkj->fki", forth, pose.positions - pose.positions[:, :1])
    turned = Pose(path[:, None] + around, forth[:, None] @ pose.rotations)
    return clip.replace(channels=channels_from_pose(clip.skeleton, turned))


def test_a_clip_that_turns_is_unrolled(synthetic_walk):
    skeleton = synthetic_walk.skeleton
    pose = forward_kinematics(skeleton, synthetic_walk.channels)
    found = unroll_path(turning(synthetic_walk, 2.5), 130)
    assert found.turn_rad == pytest.approx(2.5 * 130 / len(synthetic_walk), rel=0.05)
    straight = forward_kinematics(skeleton, found.clip.channels)
    assert np.ptp(heading_angles(straight.rotations[:, 0], 1)) < 0.2
    level = np.ptp(straight.positions[:, 0], axis=0)
    original = np.ptp(pose.positions[:, 0], axis=0)
    assert np.hypot(level[0], level[2]) == pytest.approx(
        np.hypot(original[0], original[2]), rel=0.02
    )
    assert unroll_path(synthetic_walk, 130).clip is synthetic_walk


@pytest.mark.parametrize(("turn_deg", "is_unrolled"), [(8.7, False), (11.5, True)])
def test_up_to_ten_degrees_a_lap_are_straight(synthetic_walk, turn_deg, is_unrolled):
    clip = turning(synthetic_walk, np.deg2rad(turn_deg) * len(synthetic_walk) / 130)
    assert (unroll_path(clip, 130).turn_rad != 0.0) == is_unrolled
