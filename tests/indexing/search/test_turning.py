"""What a stretch turns by, and hits at other speeds."""

from dataclasses import replace

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.indexing import MotionIndex, Query, canonical_motion, search_clips, tuning
from mocapdb.indexing.search import stretch_search
from mocapdb.indexing.search.body_parts import index_of_part, part_joints
from mocapdb.indexing.search.stretch_search import search
from mocapdb.indexing.search.turning import net_turn, stretch_turn, turn_cost


def turning(motion, radians):
    """The motion along a curve: it ends that much further to the left."""
    yaw = motion.yaw + np.linspace(0, radians, len(motion))
    return replace(motion, yaw=yaw)


WALK = canonical_motion(synthetic.make_clip("walk", seed=5, duration_s=4))
OTHER = canonical_motion(
    synthetic.make_clip("walk", seed=6, skeleton=synthetic.subject(2), duration_s=4)
)
HOP = canonical_motion(synthetic.make_clip("hop", seed=7, duration_s=4))
SQUAT = canonical_motion(synthetic.make_clip("squat", seed=8, duration_s=4))
BOX = canonical_motion(synthetic.make_clip("box", seed=9, duration_s=4))
# the walk itself round a corner, and somebody else's straight on
MOTIONS = [turning(WALK, 1.6), OTHER, HOP, SQUAT, BOX]
INDEX = MotionIndex.of(MOTIONS)
STRAIGHT = 1
PART_OF_THE_WALK = Query(
    [replace(WALK, pose=WALK.pose[6:84], root=WALK.root[6:84], yaw=WALK.yaw[6:84])]
)


def test_turns_are_kept_and_add_up():
    for clip, motion in enumerate(MOTIONS):
        kept = stretch_turn(INDEX, clip, 10, 60)
        assert kept == pytest.approx(motion.yaw[59] - motion.yaw[10], abs=0.01)
        read = stretch_turn(replace(INDEX, turns=None), clip, 10, 60)
        assert read == pytest.approx(kept, abs=0.25)
    assert net_turn(MOTIONS[0]) == pytest.approx(net_turn(WALK) + 1.6)


@pytest.mark.parametrize("exact", [True, False])
def test_the_turn_is_added_to_the_warping(monkeypatch, exact):
    monkeypatch.setattr(stretch_search, "course_cost", lambda first, second: 0.0)
    monkeypatch.setattr(stretch_search, "ANY_STRETCH", 1.0)
    hits = search(INDEX, PART_OF_THE_WALK, k=2, exact=exact)
    turns = {hit.clip: hit.distance - hit.warped for hit in hits}
    expected = tuning.TURN_COST * (1.6 * 77 / 95 - tuning.SWAY_RAD)
    assert turns[0] == pytest.approx(expected, abs=0.05)
    assert turns[STRAIGHT] < 0.02


def test_who_goes_round_a_corner_is_not_who_goes_straight_on():
    for exact in (True, False):
        hits = search(INDEX, PART_OF_THE_WALK, k=2, exact=exact)
        round_a_corner = next(hit for hit in hits if hit.clip != STRAIGHT)
        turned = 1.6 * 77 / 95
        expected = tuning.TURN_COST * (turned - tuning.SWAY_RAD)
        more = tuning.ANY_STRETCH * round_a_corner.distance - round_a_corner.warped
        assert more > expected  # and it does not go where it faces
    costs = {hit.clip: hit.distance for hit in search_clips(INDEX, Query([WALK]), expand=0)}
    plain = {
        hit.clip: hit.distance
        for hit in search_clips(MotionIndex.of([WALK, *MOTIONS[1:]]), Query([WALK]), expand=0)
    }
    assert plain[0] == pytest.approx(0, abs=0.02)
    corner = tuning.WHOLE_TURN_COST * (1.6 - tuning.SWAY_RAD) / tuning.ANY_STRETCH
    assert costs[0] > corner - 0.02


def test_a_part_of_the_body_does_not_turn_unless_the_hips_count():
    arms = index_of_part(INDEX, part_joints(["arms"]))
    assert stretch_turn(arms, 0, 0, 90) is None
    lower = index_of_part(INDEX, part_joints(["lower-body"]))
    assert stretch_turn(lower, 0, 0, 90) == stretch_turn(INDEX, 0, 0, 90)


def test_what_a_turn_costs():
    assert turn_cost(0.0, 9.0, 0.3) == tuning.MOST_TURN_COST == 0.5
    assert turn_cost(0.0, 0.19, 0.3) == 0.0
    assert turn_cost(0.0, -1.2, 0.3) == pytest.approx(0.3)


def test_what_goes_three_times_as_fast_is_no_hit():
    fast = MotionIndex.of([WALK.resampled(24, 3.0), WALK.resampled(24, 1.9), HOP, SQUAT, BOX])
    hits = search(fast, Query([WALK]), k=9)
    assert hits[0].clip == 1
    assert 0 not in {hit.clip for hit in hits}
    scales = [hit.time_scale for hit in hits]
    assert min(scales) >= 1 / tuning.MOST_SPEED_RATIO


def test_the_tables_numbers():
    assert (tuning.LOOKED_AT, tuning.LEAST_LOOKED_AT) == (2, 20)
    assert (tuning.EXPAND, tuning.EXPAND_WITHIN, tuning.TURN_KNOWN) == (2, 0.7, 0.5)
