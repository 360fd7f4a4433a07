import numpy as np
import pytest
from repeating import wave

from mocapdb.cycles.period.autocorrelation import (
    _fast_length,
    guess_period,
    lag_differences,
    refined_period,
)
from mocapdb.errors import NoPeriodError


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
def test_the_period_is_found_and_no_multiple(period, laps):
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


def alternating(n_laps, amplitude, noise=0.0, seed=0):
    """Laps of 50 frames of which every second one differs, in a column of its own."""
    phase = np.arange(n_laps * 50) / 50
    other = amplitude * np.cos(np.pi * phase)[:, None]
    still = np.zeros((len(phase), 6))
    cloud = np.hstack([wave(phase), other, still])
    return cloud + np.random.default_rng(seed).normal(0, noise, cloud.shape)


@pytest.mark.parametrize(("difference", "period"), [(0.10, 50), (0.14, 100)])
def test_a_lap_may_differ_a_little_from_the_next(difference, period):
    amplitude = np.sqrt(1.08 * difference / (1 - difference / 2))
    assert guess_period(alternating(12, amplitude)).frames == pytest.approx(period, rel=0.02)


@pytest.mark.parametrize(("ratio", "period"), [(1.3, 50), (1.75, 100)])
def test_in_noise_it_may_differ_by_a_ratio(ratio, period):
    noise = 0.27 / 10
    amplitude = np.sqrt(0.27 * (ratio - 1))
    cloud = alternating(60, amplitude, np.sqrt(noise))
    assert guess_period(cloud).frames == pytest.approx(period, rel=0.03)


def test_unrelated_laps_are_no_period():
    assert guess_period(alternating(60, 0.0, np.sqrt(0.08))).clarity == pytest.approx(
        0.57, abs=0.03
    )
    with pytest.raises(NoPeriodError, match="comes back"):
        guess_period(alternating(60, 0.0, np.sqrt(0.17)))


def test_periods_of_fewer_than_eight_frames_are_not_seen():
    assert guess_period(wave(np.arange(120) / 9)).frames == pytest.approx(9, abs=0.1)
    assert guess_period(wave(np.arange(120) / 7)).frames == pytest.approx(14, abs=0.1)


def test_a_seventh_of_a_lap_must_repeat():
    assert guess_period(wave(np.arange(240) / 200)).frames == pytest.approx(200, rel=0.02)
    with pytest.raises(NoPeriodError):
        guess_period(wave(np.arange(220) / 200))


def test_a_period_is_refined_within_an_eighth():
    cloud = wave(np.arange(200) / 50)
    assert refined_period(cloud, 44.9).frames == pytest.approx(50, abs=0.1)
    assert refined_period(cloud, 42.5).frames < 49.8


def test_lengths_are_quick_to_transform():
    from scipy.fft import next_fast_len

    lengths = [1, 2, 7, 11, 97, 1025, 4097, 6001]
    assert [_fast_length(length) for length in lengths] == [
        next_fast_len(length, real=True) for length in lengths
    ]
