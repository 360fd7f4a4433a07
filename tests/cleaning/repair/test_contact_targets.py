"""Contacts, given or found from feet: repairs choose by them and reach them."""

import numpy as np
import pytest

from mocapdb.cleaning import Span, detect_faults, repair_spans
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.cleaning.repair.contact_targets import (
    Contact,
    contact_distance,
    find_resting_feet,
    make_contact,
    reach_contacts,
)
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.motion.foot_contacts import find_contacts, find_legs, runs
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.quaternions import angles_deg


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=11, duration_s=6, sensor_noise_deg=0.02)


@pytest.fixture(scope="module")
def stance(walk):
    """A leg, and frames well within a rest of its foot."""
    positions = forward_kinematics(walk.skeleton, walk.channels).positions
    resting = find_contacts(walk.skeleton, positions, walk.fps)
    leg = find_legs(walk.skeleton)[0]
    rest = max(runs(resting[:, 0]), key=len)
    return leg, int(rest[0]) + 8, int(rest[-1]) - 7


def flagged(clip, joint, start, end):
    mask = np.zeros((len(clip), clip.skeleton.n_joints), dtype=bool)
    mask[start:end, joint] = True
    return mask


def turned(clip, joint, start, end, size_deg=40.0):
    channels = clip.channels.copy()
    first, last = clip.skeleton.channel_starts[[joint, joint + 1]]
    noise = np.random.default_rng(0).normal(0, size_deg, (end - start, last - first))
    channels[start:end, first:last] += noise
    return clip.replace(channels=channels)


def test_a_foot_that_rests_on_both_sides_rests_between(walk, stance):
    leg, start, end = stance
    faulty = turned(walk, leg.upper, start, end)
    (contact,) = find_resting_feet(faulty, flagged(walk, leg.upper, start, end))
    assert (contact.joint, contact.start, contact.end) == (leg.ball, start, end)
    truth = forward_kinematics(walk.skeleton, walk.channels).positions[start:end, leg.ball]
    apart = np.linalg.norm(contact.places - truth, axis=1) * walk.skeleton.metres_per_unit
    assert apart.max() < 0.03


def test_a_foot_in_the_air_has_no_contact(walk, stance):
    leg, _, end = stance
    assert find_resting_feet(walk, flagged(walk, leg.upper, end + 5, end + 50)) == []
    assert find_resting_feet(walk, flagged(walk, leg.upper, 0, len(walk))) == []
    assert find_resting_feet(walk, flagged(walk, walk.skeleton.joint("head"), 20, 40)) == []


@pytest.mark.parametrize(("shift_m", "n"), [(0.016, 1), (0.026, 0)])
def test_a_foot_that_rests_elsewhere_afterwards_has_moved(walk, stance, shift_m, n):
    """Over 3 cm; the whole body is moved, and so the foot, while the leg is flagged."""
    leg, start, end = stance
    column = walk.skeleton.channel_names.index("root.tx")
    channels = walk.channels.copy()
    drift = shift_m / walk.skeleton.metres_per_unit
    channels[start:end, column] += np.linspace(0.0, drift, end - start)
    channels[end:, column] += drift
    moved = walk.replace(channels=channels)
    before = forward_kinematics(walk.skeleton, moved.channels[[start - 1, end]]).positions
    apart = np.linalg.norm(np.diff(before[:, leg.ball], axis=0)) * walk.skeleton.metres_per_unit
    assert (apart < 0.03) == (n == 1)
    assert len(find_resting_feet(moved, flagged(walk, leg.upper, start, end))) == n


@pytest.mark.parametrize(("start", "n"), [(1, 0), (2, 1)])
def test_a_foot_has_to_be_seen_at_rest_for_two_frames(walk, stance, start, n):
    leg, first, _ = stance
    clip = walk[first:]
    assert len(find_resting_feet(clip, flagged(clip, leg.upper, start, 12))) == n


def test_holding_the_foot_helps_the_repair(walk, stance):
    leg, start, end = stance
    faulty = turned(walk, leg.upper, start, end)
    found = detect_faults(faulty)
    span = Span(start, end, leg.upper, 0.9, "noise")
    truth = local_rotations(walk)
    row = truth.joints.tolist().index(leg.upper)
    errors, distances = [], []
    for hold_feet in (False, True):
        repaired, (repair,) = repair_spans(faulty, found, [span], hold_feet=hold_feet)
        quats = local_rotations(repaired).quat_xyzw[start:end, row]
        errors.append(angles_deg(truth.quat_xyzw[start:end, row], quats).mean())
        distances.append(repair.contact_mm)
    assert np.isnan(distances[0])
    assert distances[1] < 15.0
    assert errors[1] <= errors[0]


def test_a_given_contact_is_reached_and_the_rest_stays_bit_for_bit(walk):
    arm = walk.skeleton.joint("lhumerus")
    faulty = turned(walk, arm, 200, 260)
    found = detect_faults(faulty)
    span = Span(200, 260, arm, 0.9, "noise")
    truth = forward_kinematics(walk.skeleton, walk.channels[200:260]).positions
    hand = walk.skeleton.joint("lhand")
    contact = Contact(200, 260, hand, truth[:, hand])
    plain, _ = repair_spans(faulty, found, [span])
    held, (repair,) = repair_spans(faulty, found, [span], contacts=[contact])
    before, after = (
        contact_distance(walk.skeleton, clip.channels, [contact], contact) for clip in (plain, held)
    )
    assert after < 0.5 * before
    assert repair.contact_mm == pytest.approx(after * walk.skeleton.metres_per_unit * 1000)
    changed = held.channels != faulty.channels
    first, last = walk.skeleton.channel_starts[[arm, arm + 1]]
    changed[200:260, first:last] = False
    assert not changed.any()


def test_reaching_moves_only_what_may_move(walk):
    hand = walk.skeleton.joint("lhand")
    there = forward_kinematics(walk.skeleton, walk.channels[10:20]).positions[:, hand]
    contact = Contact(10, 20, hand, there + 0.5)
    same = reach_contacts(walk.skeleton, walk.channels, [contact], flagged(walk, hand, 0, 0))
    np.testing.assert_array_equal(same, walk.channels)


def test_a_place_is_taken_where_the_joint_is_trusted(walk):
    hand = walk.skeleton.joint("lhand")
    mask = flagged(walk, walk.skeleton.joint("lradius"), 130, 200)
    contact = make_contact(walk, "lhand", 1.0, 1.5, flagged=mask)
    assert (contact.start, contact.end) == (120, 180)
    here = forward_kinematics(walk.skeleton, walk.channels).positions[120:130, hand]
    np.testing.assert_allclose(contact.places[7], here.mean(axis=0))
    given = make_contact(walk, "lhand", 1.0, 1.5, (1.0, 2.0, 3.0))
    np.testing.assert_array_equal(given.places, np.tile([1.0, 2.0, 3.0], (60, 1)))


def test_contacts_that_make_no_sense_are_refused(walk):
    with pytest.raises(SkeletonError, match="paw"):
        make_contact(walk, "paw", 0.0, 1.0)
    for start, end in [(2.0, 1.0), (-1.0, 1.0), (0.0, 99.0)]:
        with pytest.raises(ClipError, match="a contact within"):
            make_contact(walk, "lhand", start, end)
    with pytest.raises(ClipError, match="three numbers"):
        make_contact(walk, "lhand", 0.0, 1.0, (1.0, np.nan, 0.0))
    always = flagged(walk, walk.skeleton.joint("lhand"), 0, len(walk))
    with pytest.raises(ClipError, match="Give x, y and z"):
        make_contact(walk, "lhand", 0.0, 1.0, flagged=always)
