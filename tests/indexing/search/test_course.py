"""How two stretches go as a whole, whatever pose they go around."""

from dataclasses import replace

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.indexing import FeatureSpace, MotionIndex, Query, canonical_motion, tuning
from mocapdb.indexing.canonical.canonical_body import JOINTS
from mocapdb.indexing.search.body_parts import index_of_part, part_joints
from mocapdb.indexing.search.course import Course, course_cost
from mocapdb.indexing.search.stretch_search import search

WALK = canonical_motion(synthetic.make_clip("walk", seed=5, duration_s=4))
WAVE = canonical_motion(synthetic.make_clip("wave", seed=7, duration_s=4))
SPACE = FeatureSpace.fit([WALK, WAVE], dims=107)


def course(motion):
    return Course.of(SPACE.frames(motion), SPACE)


def to_the_side(motion, radians):
    """The same poses, carried elsewhere than where the body faces."""
    c, s = np.cos(radians), np.sin(radians)
    x, y, z = motion.root.T
    return replace(motion, root=np.column_stack([c * x + s * z, y, c * z - s * x]))


def held(motion, pitch_m):
    """The same motion with the head and chest held elsewhere."""
    pose = motion.pose.copy()
    pose[:, [JOINTS.index("head"), JOINTS.index("chest")], 2] += pitch_m
    return replace(motion, pose=pose)


def test_a_stretch_costs_nothing_against_itself():
    assert course_cost(course(WALK), course(WALK)) == pytest.approx(0, abs=1e-6)
    still = course(replace(WALK, pose=WALK.pose * 0, root=WALK.root * 0, yaw=WALK.yaw * 0))
    assert course_cost(still, still) == pytest.approx(0, abs=1e-6)


def test_how_it_is_held_does_not_count():
    assert course_cost(course(WALK), course(held(WALK, 0.3))) < 0.01


def test_another_motion_of_other_joints_costs_more_than_either_share():
    cost = course_cost(course(WALK), course(WAVE))
    together = course_cost(course(WALK), course(replace(WALK, pose=WALK.pose[::-1])))
    assert cost > 0.3
    assert 0.05 < together < cost + tuning.COURSE_COST


def test_the_wave_of_the_other_hand_moves_in_other_joints():
    other = course(WAVE.mirrored())
    shares = float(np.linalg.norm(course(WAVE).shares - other.shares))
    assert shares > 0.5
    assert course_cost(course(WAVE), other) > tuning.SHARES_COST * shares


@pytest.mark.parametrize(("radians", "counted"), [(0.1, 0.0), (0.5, 0.3), (1.5, 0.7)])
def test_who_goes_elsewhere_than_they_face_goes_elsewhere(radians, counted):
    ahead, aside = course(WALK), course(to_the_side(WALK, radians))
    speed = float(np.hypot(*ahead.travel_ms))
    expected = tuning.DIRECTION_COST * counted
    expected += tuning.TRAVEL_COST * 2 * np.sin(radians / 2) * speed / (speed + 0.5)
    assert course_cost(
        replace(ahead, frames=aside.frames, size_m=aside.size_m, shares=aside.shares), aside
    ) == pytest.approx(expected, abs=0.02)


def test_where_travelling_does_not_count_nothing_of_it_is_compared():
    index = MotionIndex.of([WALK, WAVE])
    arm = index_of_part(index, part_joints(["right-arm"]))
    assert Course.of(arm.frames.values(slice(0, 40)), arm.space).travel_ms is None
    assert Course.of(index.frames.values(slice(0, 40)), index.space).travel_ms is not None


def test_a_hit_of_the_same_course_is_nearer_than_one_of_the_same_poses():
    """Of a walk held otherwise and the walk backwards, the first is the walk."""
    backwards = replace(WALK, pose=WALK.pose[::-1], root=WALK.root[::-1], yaw=WALK.yaw[::-1])
    index = MotionIndex.of([held(WALK, 0.2), backwards, WAVE])
    first, *_ = search(index, Query([WALK]), k=1)
    assert first.clip == 0
    assert first.distance < first.warped


def test_the_tables_numbers():
    assert (tuning.COURSE_COST, tuning.SHARES_COST) == (0.5, 0.9)
    assert (tuning.TRAVEL_COST, tuning.DIRECTION_COST, tuning.GOING_MS) == (0.15, 0.5, 0.3)
    assert (tuning.UNSURE_TRAVEL_MS, tuning.STILL_SPREAD_M) == (0.5, 0.05)
    assert (tuning.ANY_STRETCH, tuning.WHOLE_TURN_COST, tuning.MOST_DIRECTION_RAD) == (
        2.3,
        0.15,
        0.7,
    )
    assert (tuning.CLASS_POWER, tuning.MOST_STRICTER) == (0.5, 2.0)
