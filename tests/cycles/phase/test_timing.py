import numpy as np
import pytest
from repeating import wave

from mocapdb.cycles.phase.laps import fit_laps
from mocapdb.cycles.phase.timing import TIMINGS, _spline_basis, time_phases
from mocapdb.errors import CycleError


def uneven(n_frames=400, laps=3.5, depth=0.1):
    """Coordinates that linger: a lap is passed fast in one half and slowly in the other."""
    time = laps * np.arange(n_frames) / n_frames
    return time, time + depth * np.sin(2 * np.pi * time)


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


@pytest.mark.parametrize(("n_laps", "name"), [(7.3, "linear"), (8.6, "drift")])
def test_more_than_eight_laps_are_never_steady(n_laps, name):
    assert time_phases(wave(np.arange(round(n_laps * 50)) / 50), 50.0).name == name


def drifting(deviation, noise=0.01, n_laps=5.25):
    """Laps whose phase is off a steady one by so much, root mean square."""
    n_frames = round(80 * n_laps)
    frames = np.arange(n_frames)
    change = deviation * 6 * np.sqrt(5) / n_laps
    laps = frames / 80 * (1 + change * (frames / n_frames - 0.5))
    return wave(laps) + np.random.default_rng(0).normal(0, noise, (n_frames, 3))


@pytest.mark.parametrize(("deviation", "name"), [(0.0165, "linear"), (0.0245, "drift")])
def test_time_within_a_fiftieth_of_a_lap_is_steady(deviation, name):
    assert time_phases(drifting(deviation), 80.0).name == name


@pytest.mark.parametrize(("noise", "name"), [(0.22, "drift"), (0.32, "linear")])
def test_a_drifting_tempo_must_fit_far_better(noise, name):
    assert time_phases(drifting(0.05, noise), 80.0).name == name


def test_a_tempo_drifts_over_two_laps_at_least():
    assert time_phases(drifting(0.05, n_laps=1.7), 80.0).name == "linear"
    assert time_phases(drifting(0.05, n_laps=2.2), 80.0).name == "drift"


@pytest.mark.parametrize(("n_frames", "n_pieces"), [(1, 1), (2, 3), (60, 7), (517, 40)])
def test_splines_are_those_of_scipy(n_frames, n_pieces):
    from scipy.interpolate import BSpline

    step = max(n_frames - 1, 1) / n_pieces
    knots = step * np.arange(-3, n_pieces + 4)
    frames = np.minimum(np.arange(n_frames), n_pieces * step * (1 - 1e-12))
    expected = BSpline.design_matrix(frames, knots, 3).toarray()
    found = _spline_basis(n_frames, n_pieces).toarray()
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)
