"""Bodies are parted from their scene and put back, and nothing moves."""

from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles import extract_cycle
from mocapdb.motion.body import part_from_scene
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics

FPS = 30.0


def clip_of(body):
    return Clip(body.skeleton, body.channels, FPS, name="made")


def test_a_body_without_a_scene_comes_back_as_it_is():
    for clip in (clip_of(made.make_walk()), synthetic.make_clip("walk", seed=1)):
        assert part_from_scene(clip) == (clip, None)


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("shape", ["plain", "along x"])
def test_every_joint_stays_where_it_is(shape, moving):
    plain = made.make_walk()
    plain = made.along_x(plain) if shape == "along x" else plain
    whole = clip_of(made.under_scene(plain, moving=moving))
    body, scene = part_from_scene(whole)
    assert body.skeleton.names == plain.skeleton.names
    expected = plain.pose
    found = forward_kinematics(body.skeleton, body.channels)
    np.testing.assert_allclose(found.positions, expected.positions, atol=1e-9)
    np.testing.assert_allclose(found.rotations, expected.rotations, atol=1e-9)
    again = scene.put_back(body)
    assert again.skeleton == whole.skeleton
    back = forward_kinematics(again.skeleton, again.channels)
    np.testing.assert_allclose(back.positions[:, 1:], expected.positions, atol=1e-9)
    if not moving:
        np.testing.assert_allclose(again.channels, whole.channels, atol=1e-9)


def test_a_scene_without_channels_is_left_out_too():
    plain = made.make_walk()
    whole = made.under_scene(plain)
    skeleton = whole.skeleton
    fixed = replace(
        skeleton, dofs=((), *skeleton.dofs[1:]), rotation_orders=("", *skeleton.rotation_orders[1:])
    )
    body, scene = part_from_scene(Clip(fixed, whole.channels[:, 6:], FPS))
    assert scene is not None
    assert body.skeleton.names == plain.skeleton.names


def test_a_cycle_is_found_below_a_scene_and_its_loop_has_the_scene():
    plain = made.make_walk(150)
    expected = extract_cycle(clip_of(plain))
    found = extract_cycle(clip_of(made.under_scene(plain)))
    assert found.period_frames == pytest.approx(30.0, abs=0.3)
    assert found.period_frames == pytest.approx(expected.period_frames, abs=0.05)
    assert found.cycle.skeleton.names == plain.skeleton.names
    loop, other = found.loop(), expected.loop()
    assert loop.clip.skeleton.names == ("scene", *plain.skeleton.names)
    at, there = (
        forward_kinematics(each.clip.skeleton, each.clip.channels).positions
        for each in (loop, other)
    )
    np.testing.assert_allclose(at[:, 1:], there, atol=0.02)
    assert not at[:, 0].any()
