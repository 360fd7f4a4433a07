"""Legs by hierarchy, feet at rest, and limbs that reach."""

import made_bodies as made
import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.foot_contacts import find_contacts, find_legs, foot_slide_mm, runs
from mocapdb.motion.ik import planted, reach
from mocapdb.motion.kinematics import forward_kinematics


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=1, duration_s=3)


def test_legs_are_found_in_both_conventions(walk):
    names = walk.skeleton.names
    assert [names[leg.knee] for leg in find_legs(walk.skeleton)] == ["lfemur", "rfemur"]
    bvh = to_bvh_convention(walk).skeleton
    assert [bvh.names[leg.knee] for leg in find_legs(bvh)] == ["ltibia", "rtibia"]


@pytest.mark.parametrize("n_frames", [1, 2])
def test_very_short_motions_have_contacts_of_their_length(walk, n_frames):
    positions = forward_kinematics(walk.skeleton, walk.channels[:n_frames]).positions
    assert find_contacts(walk.skeleton, positions, 120.0).shape == (n_frames, 2)


def test_runs():
    flags = np.array([True, True, False, True, False])
    assert [run.tolist() for run in runs(flags)] == [[0, 1], [3]]
    assert runs(flags & False) == []


def test_planted_feet_slide_less(walk):
    pose = forward_kinematics(walk.skeleton, walk.channels)
    contacts = find_contacts(walk.skeleton, pose.positions, walk.fps)
    pose.positions[:, :, 0] += 0.4 * np.sin(np.arange(len(walk)) / 9)[:, None]
    before = foot_slide_mm(walk.skeleton, pose.positions, contacts)
    held = planted(walk.skeleton, pose, contacts, walk.fps)
    assert foot_slide_mm(walk.skeleton, held.positions, contacts) < 0.2 * before


@pytest.mark.parametrize("convention", ["acclaim", "bvh"])
def test_a_hand_reaches_what_an_arm_can(walk, convention):
    clip = to_bvh_convention(walk) if convention == "bvh" else walk
    skeleton = clip.skeleton
    hand = skeleton.joint("lhand")
    arm = [skeleton.joint(name) for name in ("lhumerus", "lradius", "lwrist")]
    rng = np.random.default_rng(0)
    wanted = clip.channels.copy()
    columns = [
        int(skeleton.channel_starts[j]) + i for j in arm for i in range(len(skeleton.dofs[j]))
    ]
    wanted[:, columns] += rng.uniform(-15, 15, len(columns))
    places = forward_kinematics(skeleton, wanted).positions[:, hand]
    places[5] = np.nan  # anywhere
    solved = reach(skeleton, clip.channels, {hand: places}, arm)
    there = forward_kinematics(skeleton, solved).positions[:, hand]
    apart = np.delete(np.linalg.norm(there - places, axis=1), 5) * skeleton.metres_per_unit
    assert apart.max() < 1e-3
    changed = (solved != clip.channels).any(axis=0)
    assert set(np.flatnonzero(changed)) <= set(columns)
    assert (solved[5] == clip.channels[5]).all()


def test_a_place_out_of_reach_is_approached(walk):
    hand, arm = walk.skeleton.joint("lhand"), [walk.skeleton.joint("lhumerus")]
    here = forward_kinematics(walk.skeleton, walk.channels[:3]).positions
    far = here[:, hand] + 100.0
    solved = reach(walk.skeleton, walk.channels[:3], {hand: far}, arm)
    there = forward_kinematics(walk.skeleton, solved).positions[:, hand]
    shoulder = here[:, walk.skeleton.parents[arm[0]]]
    straight = far - shoulder
    # the arm points there
    cosine = np.sum((there - shoulder) * straight, axis=1) / (
        np.linalg.norm(there - shoulder, axis=1) * np.linalg.norm(straight, axis=1)
    )
    assert cosine.min() > 0.999
    assert np.isfinite(solved).all()


def test_nothing_to_turn_changes_nothing(walk):
    places = {3: np.zeros((len(walk), 3))}
    np.testing.assert_array_equal(reach(walk.skeleton, walk.channels, places, []), walk.channels)
    np.testing.assert_array_equal(reach(walk.skeleton, walk.channels, {}, [3]), walk.channels)


def test_legs_and_contacts_are_the_same_in_every_exporter_s_convention():
    plain = made.make_walk()
    expected = find_contacts(plain.skeleton, plain.pose.positions, 5.0)
    assert 0.2 < expected.mean() < 0.9
    for body in (made.along_x(plain), made.under_scene(plain), made.renamed(made.along_x(plain))):
        legs = find_legs(body.skeleton, body.pose.positions)
        assert [body.roles[leg.ball] for leg in legs] == ["left_toe", "right_toe"]
        assert [body.roles[leg.upper] for leg in legs] == ["left_hip", "right_hip"]
        np.testing.assert_array_equal(
            find_contacts(body.skeleton, body.pose.positions, 5.0), expected
        )


def test_legs_of_a_body_without_arms_and_of_a_dog():
    legs_only = made.without(made.make_walk(), "left_collar", "right_collar")
    found = find_legs(legs_only.skeleton, legs_only.pose.positions)
    assert [legs_only.roles[leg.knee] for leg in found] == ["left_knee", "right_knee"]
    dog = made.renamed(made.make_dog())
    balls = {dog.roles[leg.ball] for leg in find_legs(dog.skeleton, dog.pose.positions)}
    assert len(balls) == 4
