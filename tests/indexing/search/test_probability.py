"""Distances as probabilities."""

import math

import numpy as np
import pytest

from mocapdb.errors import ClipError
from mocapdb.indexing import tuning
from mocapdb.indexing.search.probability import (
    LabelledHit,
    distance_of_probability,
    label_shares,
    probability,
)


def test_a_distance_of_nothing_is_certain_and_any_motion_is_not():
    assert probability(0.0) == 1.0
    assert probability(tuning.EVEN_ODDS) == pytest.approx(0.5)
    assert probability(1.0) == pytest.approx(0.115, abs=0.003)
    values = [probability(distance) for distance in np.linspace(0, 2, 50)]
    assert values == sorted(values, reverse=True)


def test_the_tables_numbers():
    assert (tuning.EVEN_ODDS, tuning.ODDS_POWER, tuning.STILL_MS) == (0.6, 4.0, 0.03)
    assert (tuning.NEAR_HITS, tuning.NEAR_POWER, tuning.NEAR_BY) == (10, 4.0, 0.1)
    assert tuning.UNTOLD_SHARE == 0.64
    assert (tuning.POSE_S, tuning.APART_S) == (0.3, 0.5)


def test_a_cut_by_probability_is_one_by_distance():
    for likely in (0.1, 0.5, 0.8, 0.99):
        assert probability(distance_of_probability(likely)) == pytest.approx(likely)
    assert distance_of_probability(0.8) == pytest.approx(0.424, abs=0.001)
    assert math.isinf(distance_of_probability(0.0))
    assert distance_of_probability(1.0) == 0.0


@pytest.mark.parametrize("likely", [-0.1, 1.1, math.nan])
def test_what_is_no_probability(likely):
    with pytest.raises(ClipError, match="probability from 0 to 1"):
        distance_of_probability(likely)


def hits(*seen):
    return [LabelledHit(place, *each) for place, each in enumerate(seen)]


def test_labels_that_are_as_near_share_what_the_distance_says():
    alone = hits((0.1, "walk"), (0.2, "walk"), (0.3, "walk"))
    assert label_shares(alone, alone) == [1.0, 1.0, 1.0]
    both = hits((0.2, "walk"), (0.2, "turn"), (0.2, "turn"), (0.2, "turn"))
    assert label_shares(both, both) == pytest.approx([0.25, 0.75, 0.75, 0.75])
    assert probability(0.2, 0.25) == pytest.approx(probability(0.2) / 4)


def test_what_is_far_hardly_counts():
    near, far = hits((0.1, "walk"), (0.9, "turn"))
    shares = label_shares([near, far], [near, far])
    assert shares[0] > 0.99 and sum(shares) == pytest.approx(1.0)


def test_a_hit_beyond_the_nearest_counts_itself():
    nearest = hits(*[(0.2, "walk")] * tuning.NEAR_HITS)
    beyond = LabelledHit("beyond", 0.2, "turn")
    assert label_shares([beyond], nearest) == pytest.approx([1 / (tuning.NEAR_HITS + 1)])
    assert label_shares([beyond], [*nearest, beyond]) == label_shares([beyond], nearest)


def test_without_labels_nothing_is_sure():
    untold = hits((0.0, None), (0.0, None), (0.0, "walk"))
    shares = label_shares(untold, untold)
    assert shares[:2] == [tuning.UNTOLD_SHARE] * 2
    assert shares[2] == pytest.approx((1 + 2 * tuning.UNTOLD_SHARE) / 3)
