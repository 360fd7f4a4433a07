"""How far joints move by themselves, and what another motion loses of that."""

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.motion import joint_errors as module
from mocapdb.motion.joint_errors import joint_errors, joint_motion
from mocapdb.motion.skeleton import Skeleton


def chain(order="Z"):
    """A root, a joint that also shifts, and a leaf that only turns."""
    turns = [f"r{axis.lower()}" for axis in order]
    return Skeleton(
        ["root", "jaw", "tip"],
        [-1, 0, 1],
        [[0, 0, 0], [0, 10, 0], [0, 5, 0]],
        [["tx", "ty", "tz", "rz"], ["tx", "ty", "tz", *turns], turns],
        ["Z", order, order],
        convention="bvh",
        metres_per_unit=0.01,
    )


def waving(n_frames=60, degrees=20.0, shift=0.3):
    """The tip swings by twice so many degrees, the jaw shifts by twice so many units."""
    skeleton = chain()
    channels = np.zeros((n_frames, skeleton.n_channels))
    phase = np.linspace(0.0, 2.0 * np.pi, n_frames)
    channels[:, 0] = 500.0 * np.linspace(0, 1, n_frames)  # the root walks away
    channels[:, skeleton.channel_starts[1] + 1] = 10.0 + shift * np.sin(phase)
    channels[:, skeleton.rotation_columns(2)[0]] = degrees * np.cos(phase)
    return skeleton, channels


def test_a_swing_is_the_largest_angle_and_the_largest_shift():
    skeleton, channels = waving(61)
    motion = joint_motion(skeleton, channels)
    np.testing.assert_allclose(motion.swing[0], [0.0, 0.0, 40.0], atol=1e-6)
    np.testing.assert_allclose(motion.swing[1], [0.0, 6.0, 0.0], rtol=1e-2)  # not the root's
    assert sorted(motion.ends[:, 0, 2] % 60) == [0, 30]
    assert motion.spread[0, 2] == pytest.approx(np.std(channels[:, -1]), rel=0.01)
    assert motion.spread[1, 1] == pytest.approx(10 * np.std(channels[:, 5]), rel=1e-9)


def test_turning_on_and_on_is_half_a_turn_at_the_most():
    skeleton, channels = waving()
    channels[:, -1] = np.linspace(0, 720, len(channels))
    assert 175.0 < joint_motion(skeleton, channels).swing[0, 2] <= 180.0


def test_nothing_lost():
    skeleton, channels = waving()
    errors = joint_errors(skeleton, channels, channels)
    for figure in (errors.mean, errors.rms, errors.worst):
        assert figure.max() < 1e-5
    np.testing.assert_allclose(errors.kept, errors.motion.swing, atol=1e-5)


def test_a_joint_held_still_loses_its_swing_and_no_other_does():
    skeleton, channels = waving()
    still = channels.copy()
    still[:, -1] = 0.0
    errors = joint_errors(skeleton, channels, still)
    assert errors.kept[0, 2] == pytest.approx(0.0, abs=1e-5)
    assert errors.worst[0, 2] == pytest.approx(20.0)
    assert errors.worst_frame[0, 2] == 0
    assert errors.mean[0, 2] == pytest.approx(np.abs(channels[:, -1]).mean())
    assert errors.rms[0, 2] == pytest.approx(np.sqrt((channels[:, -1] ** 2).mean()))
    assert errors.worst[0, :2].max() < 1e-5
    assert errors.kept[1, 1] == pytest.approx(errors.motion.swing[1, 1])


def test_a_shift_that_is_lost():
    skeleton, channels = waving()
    still = channels.copy()
    still[:, 5] = 10.0
    errors = joint_errors(skeleton, channels, still)
    assert errors.kept[1, 1] == pytest.approx(0.0, abs=1e-9)
    assert errors.worst[1, 1] == pytest.approx(3.0, rel=1e-2)
    assert errors.worst[1, 0] == 0.0


def test_a_parents_error_is_not_its_childs():
    clip = synthetic.make_clip("walk", seed=2, duration_s=0.5)
    channels = clip.channels.copy()
    joint = clip.skeleton.joint("lradius")
    channels[:, clip.skeleton.rotation_columns(joint)[0]] += 5.0
    errors = joint_errors(clip.skeleton, clip.channels, channels)
    assert errors.worst[0, joint] == pytest.approx(5.0)
    assert np.delete(errors.worst[0], joint).max() < 1e-5


def test_long_clips_are_measured_in_parts(monkeypatch):
    skeleton, channels = waving(97)
    other = channels + np.random.default_rng(0).normal(0.0, 0.5, channels.shape)
    whole = joint_errors(skeleton, channels, other)
    monkeypatch.setattr(module, "CHUNK_FRAMES", 10)
    parts = joint_errors(skeleton, channels, other)
    for name in ("mean", "rms", "worst", "worst_frame", "kept"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), atol=1e-9)
    np.testing.assert_array_equal(parts.motion.ends, whole.motion.ends)
    np.testing.assert_allclose(parts.motion.spread, whole.motion.spread, atol=1e-9)


def test_what_two_ends_miss_adds_up():
    skeleton, channels = waving(61)
    motion = joint_motion(skeleton, channels)
    other = channels.copy()
    other[:, -1] *= 0.9
    other[:, 5] = 10.0 + 0.8 * (channels[:, 5] - 10.0)
    pose = module.forward_kinematics(skeleton, other)
    missing = module.missing_swing(skeleton, motion, other, pose, 0)
    lost = motion.swing - joint_errors(skeleton, channels, other).kept
    np.testing.assert_allclose(missing.sum(axis=0), lost, atol=1e-6)
    assert lost[0, 2] == pytest.approx(4.0)
    first_half = module.missing_swing(
        skeleton, motion, other[:20], module.Pose(pose.positions[:20], pose.rotations[:20]), 0
    )
    assert first_half[:, 0, 2].max() == pytest.approx(2.0)
    assert first_half[:, 0, 2].min() == pytest.approx(0.0, abs=1e-6)
