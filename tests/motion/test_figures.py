"""Figures of seeded motion that the tuned numbers of this package decide."""

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.motion.foot_contacts import find_contacts, find_legs, foot_slide_mm, runs
from mocapdb.motion.ik import pull_to_rest, reach
from mocapdb.motion.kinematics import forward_kinematics

FPS = 120.0


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=1, duration_s=3)


def foot_at(walk, height_m=(), speed_m_s=()):
    """The rest pose for a while, its first foot at given heights or moving at given speeds."""
    skeleton = walk.skeleton
    n_frames = max(len(height_m), len(speed_m_s))
    positions = np.repeat(skeleton.rest_positions[None], n_frames, axis=0)
    ball = find_legs(skeleton)[0].ball
    if len(height_m):
        positions[:, ball, skeleton.up_index] += np.array(height_m) / skeleton.metres_per_unit
    if len(speed_m_s):
        way_m = np.cumsum(speed_m_s) / FPS
        positions[:, ball, 0] += way_m / skeleton.metres_per_unit
    return positions


def rests(walk, positions, fps=FPS):
    return [len(run) for run in runs(find_contacts(walk.skeleton, positions, fps)[:, 0])]


def test_a_foot_rests_within_six_centimetres_of_its_lowest(walk):
    # the step from one height to the other is fast
    assert rests(walk, foot_at(walk, height_m=[0.0] * 20 + [0.055] * 20)) == [19, 19]
    raised = rests(walk, foot_at(walk, height_m=[0.0] * 20 + [0.065] * 20))
    assert sum(raised) < 20


@pytest.mark.parametrize(("speed_m_s", "rest"), [(0.41, [40]), (0.49, [])])
def test_a_foot_that_is_slow_rests(walk, speed_m_s, rest):
    assert rests(walk, foot_at(walk, speed_m_s=[speed_m_s] * 40)) == rest


@pytest.mark.parametrize(("speed_m_s", "rest"), [(0.55, True), (0.65, False)])
def test_beside_a_fast_swing_a_slow_foot_may_be_faster(walk, speed_m_s, rest):
    swing = [4.0] * 40
    found = rests(walk, foot_at(walk, speed_m_s=[*swing, *[speed_m_s] * 40]))
    assert bool(found) is rest


@pytest.mark.parametrize(("n_frames", "rest"), [(7, False), (9, True)])
def test_a_rest_lasts_six_hundredths_of_a_second(walk, n_frames, rest):
    speeds = [2.0] * 20 + [0.0] * n_frames + [2.0] * 20
    assert bool(rests(walk, foot_at(walk, speed_m_s=speeds))) is rest


def test_leaves_near_the_lowest_end_legs(walk):
    skeleton = walk.skeleton
    hand = skeleton.joint("lthumb")
    leaf_height = skeleton.rest_positions[:, skeleton.up_index]
    lowest = leaf_height.min()
    for share, n_legs in ((0.10, 3), (0.14, 2)):
        offsets = skeleton.offsets.copy()
        offsets[hand, skeleton.up_index] += lowest + share * skeleton.height - leaf_height[hand]
        lowered = type(skeleton)(
            [f"bone{i}" for i in range(skeleton.n_joints)],  # names would tell the legs
            skeleton.parents,
            offsets,
            skeleton.dofs,
            skeleton.rotation_orders,
            convention="acclaim",
            metres_per_unit=skeleton.metres_per_unit,
        )
        assert len(find_legs(lowered)) == n_legs


def test_the_pull_on_a_foot_eases_over_a_fifth_of_a_second_and_has_no_corner():
    contact = np.zeros(120, dtype=bool)
    contact[50:70] = True
    ball = np.zeros((120, 3))
    ball[:, 0] = np.where(np.arange(120) < 60, -1.0, 1.0)
    pull = pull_to_rest(ball, contact, 1, FPS)[:, 0]
    # the raised cosine of each distance from the rest, and what a Gaussian makes of its steps
    smoothed = [0.0, 0.0875, 0.5, 0.9879, 0.1662]
    np.testing.assert_allclose(pull[[20, 30, 38, 50, 59]], smoothed, atol=2e-4)
    assert abs(pull[:22]).max() < 1e-3
    assert pull[110] == pytest.approx(0.0, abs=1e-6)


def test_held_feet_and_reached_places(walk):
    pose = forward_kinematics(walk.skeleton, walk.channels)
    contacts = find_contacts(walk.skeleton, pose.positions, walk.fps)
    assert contacts.sum(axis=0).tolist() == [231, 197]
    assert foot_slide_mm(walk.skeleton, pose.positions, contacts) == pytest.approx(
        1.72585, rel=1e-4
    )


def test_reaching_stops_a_fifth_of_a_millimetre_away(walk):
    skeleton = walk.skeleton
    hand, arm = skeleton.joint("lhand"), [skeleton.joint("lhumerus"), skeleton.joint("lradius")]
    here = forward_kinematics(skeleton, walk.channels[:1]).positions[:, hand]
    for share, moved in ((0.8e-4, False), (1.2e-4, True)):
        place = here + np.array([share * skeleton.height, 0.0, 0.0])
        solved = reach(skeleton, walk.channels[:1], {hand: place}, arm)
        assert bool((solved != walk.channels[:1]).any()) is moved


@pytest.mark.parametrize(
    ("off", "apart", "angles_deg"),
    [
        # in reach: which of the arm's many poses is found depends on the damping of the start
        ((2.0, 3.0, 4.0), (-0.00057, 0.00228, 0.00025), (63.775, -9.658, -33.546, 78.474)),
        # out of reach: every round goes a little nearer
        ((6.0, 30.0, -2.0), (-3.61135, -8.33833, 2.44912), None),
    ],
)
def test_how_an_arm_reaches(walk, off, apart, angles_deg):
    skeleton = walk.skeleton
    hand, arm = skeleton.joint("lhand"), [skeleton.joint("lhumerus"), skeleton.joint("lradius")]
    place = forward_kinematics(skeleton, walk.channels[:1]).positions[:, hand] + np.array(off)
    solved = reach(skeleton, walk.channels[:1], {hand: place}, arm)
    there = forward_kinematics(skeleton, solved).positions[:, hand]
    np.testing.assert_allclose((there - place)[0], apart, atol=1e-4)
    if angles_deg:
        columns = [column for joint in arm for column in skeleton.rotation_columns(joint)]
        np.testing.assert_allclose(solved[0, columns], angles_deg, atol=2e-3)
