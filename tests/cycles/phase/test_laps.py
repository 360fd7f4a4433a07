import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.cycles.period.autocorrelation import guess_period, lag_differences, refined_period
from mocapdb.cycles.phase.laps import (
    fit_laps,
    forwards,
    gaussian_mixture,
    uniformised,
    unwrapped,
    whole_laps,
)
from mocapdb.cycles.phase.timing import TIMINGS, time_phases
from mocapdb.cycles.template_error import match_template
from mocapdb.errors import CycleError, NoPeriodError


def uneven(n_frames=400, laps=3.5, depth=0.1):
    """Coordinates that linger: a lap is passed fast in one half and slowly in the other."""
    time = laps * np.arange(n_frames) / n_frames
    return time, time + depth * np.sin(2 * np.pi * time)


def wave(phase):
    angle = 2 * np.pi * np.asarray(phase)
    return np.column_stack([np.sin(angle), np.cos(angle), 0.4 * np.sin(2 * angle + 1)])


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


def test_the_differences_equal_their_naive_twin():
    cloud = np.random.default_rng(0).normal(size=(60, 3)).cumsum(axis=0)
    fast = lag_differences(cloud)
    whole = cloud.var(axis=0).sum()
    for lag in range(1, len(fast)):
        first, last = cloud[:-lag], cloud[lag:]
        both = first.var(axis=0).sum() + last.var(axis=0).sum()
        shift = ((last.mean(axis=0) - first.mean(axis=0)) ** 2).sum()
        naive = (last - first).var(axis=0).sum() / both + shift / (2 * whole)
        assert fast[lag] == pytest.approx(naive, rel=1e-9)


def test_unrelated_stretches_differ_as_much_as_they_vary():
    noise = np.random.default_rng(0).normal(size=(2000, 4))
    np.testing.assert_allclose(lag_differences(noise)[1:1000], 1.0, atol=0.15)


def test_rest_before_and_after_a_motion_is_no_repetition():
    once = np.concatenate([np.zeros(60), np.sin(np.linspace(0, np.pi, 80)), np.zeros(60)])
    cloud = np.column_stack([once, once**2])
    with pytest.raises(NoPeriodError):
        guess_period(cloud + np.random.default_rng(0).normal(0, 0.005, cloud.shape))


def test_a_period_known_roughly_is_refined():
    cloud = wave(np.arange(200) / 70.3)
    assert refined_period(cloud, 66.0).frames == pytest.approx(70.3, abs=0.1)
    assert refined_period(cloud, 500.0).clarity == 0.0


@pytest.mark.parametrize("period", [31.0, 50.4, 88.7])
@pytest.mark.parametrize("laps", [1.25, 1.7, 2.5, 9.0])
def test_the_guard_finds_the_period_and_no_multiple(period, laps):
    cloud = wave(np.arange(round(laps * period)) / period)
    guess = guess_period(cloud + np.random.default_rng(1).normal(0, 0.02, cloud.shape))
    assert guess.frames == pytest.approx(period, rel=0.02)
    assert guess.clarity > 0.9


@pytest.mark.parametrize(
    "cloud",
    [
        np.zeros((200, 3)),
        np.column_stack([np.linspace(0, 1, 200), np.linspace(0, 1, 200) ** 2]),
        wave(np.arange(30) / 40),
        wave(np.arange(2) / 40),
        np.random.default_rng(0).normal(size=(300, 5)),
    ],
    ids=["constant", "one way", "less than a lap", "two frames", "noise"],
)
def test_nothing_repeats(cloud):
    with pytest.raises(NoPeriodError):
        guess_period(cloud)


@pytest.mark.parametrize("n_frames", [40, 97])
def test_template_equals_its_naive_twin(n_frames):
    rng = np.random.default_rng(2)
    cycle = rng.normal(size=(37, 4))
    values = cycle[(np.arange(n_frames) + 11) % 37] + rng.normal(0, 0.1, (n_frames, 4))
    errors = [
        np.sqrt(((values - cycle[(np.arange(n_frames) + shift) % 37]) ** 2).sum(axis=1).mean())
        for shift in range(37)
    ]
    match = match_template(values, cycle)
    assert match.offset == np.argmin(errors) == 11
    assert match.error == pytest.approx(min(errors))


def test_steady_time_is_refined():
    values = wave(np.arange(200) / 63.37)
    timing = time_phases(values, 62.0)
    assert timing.name == "linear"
    assert timing.period_frames == pytest.approx(63.37, abs=0.05)


def test_drifting_time_is_followed():
    frames = np.arange(500)
    laps = frames / 80 * (1 + 0.4 * (frames / 500 - 0.5))
    timing = time_phases(wave(laps), 80.0, laps % 1.0)
    assert timing.name == "drift"
    error = timing.phase - laps
    assert np.std(error - error.mean()) < 0.01


def test_each_timing_by_name():
    time, laps = uneven(600, 4.3)
    for name in TIMINGS:
        timing = time_phases(wave(time), 600 / 4.3, laps % 1.0, name)
        assert timing.name == name
        assert timing.period_frames == pytest.approx(600 / 4.3, rel=0.05)
        assert fit_laps(timing.phase)[0] > 0


def test_bad_timings():
    with pytest.raises(CycleError, match="timing"):
        time_phases(wave(np.arange(100) / 30), 30.0, None, "sundial")
    with pytest.raises(CycleError, match="coordinates"):
        time_phases(wave(np.arange(100) / 30), 30.0, None, "uniform")
