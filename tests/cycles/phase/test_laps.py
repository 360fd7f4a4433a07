import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.cycles.phase.laps import (
    fit_laps,
    forwards,
    gaussian_mixture,
    uniformised,
    unwrapped,
    whole_laps,
)
from mocapdb.errors import CycleError


def uneven(n_frames=400, laps=3.5, depth=0.1):
    """Coordinates that linger: a lap is passed fast in one half and slowly in the other."""
    time = laps * np.arange(n_frames) / n_frames
    return time, time + depth * np.sin(2 * np.pi * time)


def test_uniformised_are_ranks():
    assert uniformised(np.array([0.9, 0.1, 0.4, 0.2])).tolist() == [0.75, 0.0, 0.5, 0.25]


@given(st.lists(st.floats(0, 0.999), min_size=1, max_size=60))
def test_uniformised_is_a_permutation_of_even_steps(values):
    even = uniformised(np.array(values))
    np.testing.assert_allclose(np.sort(even), np.arange(len(values)) / len(values))


def test_unwrapping_counts_laps_both_ways():
    laps = 2.6 * np.arange(90) / 90
    np.testing.assert_allclose(unwrapped(laps % 1.0), laps)
    np.testing.assert_allclose(unwrapped(-laps % 1.0), -laps, atol=1e-12)
    slope, start = fit_laps(laps)
    assert (slope, start) == pytest.approx((2.6 / 90, 0.0))


def test_forwards_mirrors_what_runs_backwards():
    laps = 2.6 * np.arange(90) / 90
    assert fit_laps(unwrapped(forwards(-laps % 1.0)))[0] > 0
    np.testing.assert_array_equal(forwards(laps % 1.0), laps % 1.0)


def test_whole_laps_give_time_back():
    time, laps = uneven()
    even = whole_laps(laps)
    error = even - time
    assert np.ptp(error - error.mean()) < 0.01
    # ranks count the poses of the half lap that is there once more
    ranks = unwrapped(uniformised(laps % 1.0))
    assert np.ptp(ranks - time) > 3 * np.ptp(error)


def test_whole_laps_need_one():
    with pytest.raises(CycleError, match="whole lap"):
        whole_laps(np.linspace(0, 0.8, 50))


def test_a_mixture_evens_out_roughly():
    _, laps = uneven(laps=4)
    even = gaussian_mixture(laps % 1.0, n_components=12)
    assert np.all((even >= -1e-9) & (even <= 1 + 1e-9))
    before = np.histogram(laps % 1.0, 10)[0].std()
    assert np.histogram(even, 10)[0].std() < 0.4 * before
