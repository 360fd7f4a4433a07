"""Smooth channels: the same poses without jumps, of any frames, however they are asked for."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import clips

from mocapdb.compression.pose import smooth_channels
from mocapdb.compression.pose.smooth_channels import (
    SmoothChannels,
    channels_from_smooth,
    order_changes,
    three_angle_joints,
)
from mocapdb.corpus import synthetic
from mocapdb.motion.kinematics import forward_kinematics


@given(clip=clips())
def test_smooth_channels_are_of_the_same_poses(clip):
    made = SmoothChannels(clip)
    expected = forward_kinematics(clip.skeleton, clip.channels)
    found = forward_kinematics(made.skeleton, made.values())
    np.testing.assert_allclose(found.rotations, expected.rotations, atol=1e-11)
    np.testing.assert_allclose(found.positions, expected.positions, atol=1e-8)
    changes = order_changes(clip.skeleton, made.skeleton.rotation_orders)
    restored = forward_kinematics(clip.skeleton, channels_from_smooth(changes, made.values()))
    np.testing.assert_allclose(restored.rotations, expected.rotations, atol=1e-11)


@given(clip=clips(), chunk_frames=st.integers(1, 9), data=st.data())
def test_any_frames_are_the_same_whatever_is_computed_at_a_time(clip, chunk_frames, data):
    whole = SmoothChannels(clip)
    values = whole.values()
    orders = [whole.skeleton.rotation_orders[joint] for joint in three_angle_joints(clip.skeleton)]
    ends = st.integers(-len(clip), len(clip)) | st.none()
    frames = slice(data.draw(ends), data.draw(ends), data.draw(st.sampled_from([None, 1, 3, -2])))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(smooth_channels, "CHUNK_FRAMES", chunk_frames)
        made = SmoothChannels(clip, orders)
        np.testing.assert_array_equal(made.values(frames), values[frames])
        np.testing.assert_array_equal(np.concatenate(list(made.chunks())), values)
        assert SmoothChannels(clip).skeleton == whole.skeleton


def test_turns_go_on_from_part_to_part(monkeypatch):
    walk = synthetic.make_clip("walk", seed=1)
    smooth = walk.channels.copy()
    smooth[:, 4] += np.linspace(0, 5 * 360, len(walk))
    wrapped = walk.replace(channels=(smooth + 180) % 360 - 180)
    monkeypatch.setattr(smooth_channels, "CHUNK_FRAMES", 50)
    orders = [walk.skeleton.rotation_orders[joint] for joint in three_angle_joints(walk.skeleton)]
    values = SmoothChannels(wrapped, orders).values()
    np.testing.assert_allclose(np.diff(values[:, 4]), np.diff(smooth[:, 4]), atol=1e-9)


def test_a_long_clip_is_not_computed_whole():
    walk = synthetic.make_clip("walk", seed=1)
    clip = walk.replace(channels=np.tile(walk.channels, (-(-40_000 // len(walk)), 1)))
    tracemalloc.start()
    made = SmoothChannels(clip)
    made.values(slice(30_000, 30_100))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < clip.channels.nbytes / 2


def test_an_order_of_axes_has_to_be_a_tenth_smoother_than_a_joints_own():
    """Of a waving arm's shoulder the best order has 0.84 of the roughness of its own."""
    clip = synthetic.make_clip("wave", seed=1, duration_s=1.0, sensor_noise_deg=0.3)
    orders = SmoothChannels(clip).skeleton.rotation_orders
    changed = {
        joint: order
        for joint, order in enumerate(orders)
        if order != clip.skeleton.rotation_orders[joint]
    }
    assert changed == {25: "YZX"}
