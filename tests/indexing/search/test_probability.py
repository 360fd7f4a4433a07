"""Distances as probabilities."""

import math

import numpy as np
import pytest

from mocapdb.errors import ClipError
from mocapdb.indexing import tuning
from mocapdb.indexing.search.probability import distance_of_probability, probability


def test_a_distance_of_nothing_is_certain_and_any_motion_is_not():
    assert probability(0.0) == 1.0
    assert probability(tuning.EVEN_ODDS) == pytest.approx(0.5)
    assert probability(1.0) == pytest.approx(0.049, abs=0.003)
    values = [probability(distance) for distance in np.linspace(0, 2, 50)]
    assert values == sorted(values, reverse=True)


def test_the_tables_numbers():
    assert (tuning.EVEN_ODDS, tuning.ODDS_POWER, tuning.STILL_MS) == (0.51, 4.4, 0.03)
    assert (tuning.POSE_S, tuning.APART_S) == (0.3, 0.5)


def test_a_cut_by_probability_is_one_by_distance():
    for likely in (0.1, 0.5, 0.8, 0.99):
        assert probability(distance_of_probability(likely)) == pytest.approx(likely)
    assert distance_of_probability(0.8) == pytest.approx(0.372, abs=0.004)
    assert math.isinf(distance_of_probability(0.0))
    assert distance_of_probability(1.0) == 0.0


@pytest.mark.parametrize("likely", [-0.1, 1.1, math.nan])
def test_what_is_no_probability(likely):
    with pytest.raises(ClipError, match="probability from 0 to 1"):
        distance_of_probability(likely)
