"""Bodies are parted from their scene and put back, and nothing moves."""

from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest

from mocapdb.compression.pose.skin_metric import error_points
from mocapdb.corpus import synthetic
from mocapdb.cycles import extract_cycle
from mocapdb.errors import SkeletonError
from mocapdb.io import read_clip, write_clip
from mocapdb.io.conventions import to_acclaim_convention
from mocapdb.motion.body import part_from_scene, understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.representations import REPRESENTATIONS, represent, restore_channels
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import channels_error

FPS = 30.0
TOPS = ("collar", "hip")


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


def test_a_body_that_is_not_human_begins_below_what_stands_still():
    worm = made.without(made.make_walk(), "neck", *(f"{s}_{j}" for s in made.SIDES for j in TOPS))
    whole = made.under_scene(worm)
    assert understand(whole.skeleton, whole.channels).root.value == 1
    turning = whole.channels.copy()
    turning[:, 3] = np.linspace(0, 90, len(turning))  # of the scene: it turns what hangs on it
    turning[:, 6:9] = (0.3, 0.0, 0.1)
    assert understand(whole.skeleton, turning).root.value == 0


def test_the_skin_and_the_shell_begin_at_the_body():
    plain = made.make_walk()
    whole = made.under_scene(plain, moving=True)
    below = replace(whole.skeleton, body_root=1)
    rng = np.random.default_rng(5)
    noise = rng.normal(0, 0.5, whole.channels.shape)
    noise[:, :6] = 0
    for points in ("skin", "shell"):
        error = channels_error(
            below, whole.channels, whole.channels + noise, points=points
        ).vertices.to_dict()
        body, _ = part_from_scene(Clip(below, whole.channels, FPS))
        other, _ = part_from_scene(Clip(below, whole.channels + noise, FPS))
        expected = channels_error(
            body.skeleton, body.channels, other.channels, points=points
        ).vertices.to_dict()
        assert error == pytest.approx(expected, rel=1e-6)
        mine, theirs = error_points(below, points), error_points(body.skeleton, points)
        np.testing.assert_array_equal(mine.joints, theirs.joints + 1)
        np.testing.assert_array_equal(mine.weights, theirs.weights)


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("name", ["aligned", "scaled", "normalised"])
def test_alignment_is_as_if_there_were_no_scene(name, moving):
    plain = made.along_x(made.make_walk())
    whole = made.under_scene(plain, moving=moving)
    below = Clip(replace(whole.skeleton, body_root=1), whole.channels, FPS)
    found, expected = represent(below, name), represent(part_from_scene(below)[0], name)
    np.testing.assert_allclose(found.root, expected.root, atol=1e-9)
    n_body = 3 * plain.skeleton.n_joints
    np.testing.assert_allclose(
        found.values[:, 3 : 3 + n_body], expected.values[:, :n_body], atol=1e-9
    )
    if not moving:
        assert np.ptp(found.values[:, :3], axis=0).max() == 0
    again = forward_kinematics(below.skeleton, restore_channels(below.skeleton, found))
    before = forward_kinematics(below.skeleton, below.channels)
    np.testing.assert_allclose(again.positions, before.positions, atol=1e-9)
    np.testing.assert_allclose(again.rotations, before.rotations, atol=1e-9)


@pytest.mark.parametrize("convention", ["bvh", "acclaim"])
@pytest.mark.parametrize("name", REPRESENTATIONS)
def test_representations_below_a_scene_have_an_exact_inverse(name, convention):
    whole = made.under_scene(made.make_walk(), moving=True)
    clip = Clip(replace(whole.skeleton, body_root=1), whole.channels, FPS)
    if convention == "acclaim":
        channels = clip.channels.copy()
        channels[:, 6:9] = (0.0, 1.0, 0.5)
        clip = to_acclaim_convention(clip.replace(channels=channels))
        assert clip.skeleton.names[clip.skeleton.body_root] == whole.skeleton.names[1]
    before = forward_kinematics(clip.skeleton, clip.channels)
    again = forward_kinematics(
        clip.skeleton, restore_channels(clip.skeleton, represent(clip, name))
    )
    np.testing.assert_allclose(again.positions, before.positions, atol=1e-9)
    np.testing.assert_allclose(again.rotations, before.rotations, atol=1e-8)


def test_a_file_is_read_with_the_root_of_its_body(tmp_path):
    whole = clip_of(made.under_scene(made.make_walk()))
    write_clip(whole, tmp_path / "walk.bvh")
    clip = read_clip(tmp_path / "walk.bvh")
    assert clip.skeleton.body_root == 1
    assert clip.skeleton.scene_joints == (0,)
    assert Skeleton.from_dict(clip.skeleton.to_dict()) == clip.skeleton
    assert "body_root" not in whole.skeleton.to_dict()  # and libraries of before keep their digests
    write_clip(clip, tmp_path / "again.bvh")
    assert read_clip(tmp_path / "again.bvh").skeleton == clip.skeleton


def test_a_root_that_is_no_joint_is_refused():
    skeleton = made.make_walk().skeleton
    with pytest.raises(SkeletonError, match="the body's root to be one of"):
        replace(skeleton, body_root=skeleton.n_joints)
