import numpy as np
import pytest
from repeating import wave

from mocapdb.cycles.phase.laps import (
    fit_laps,
)
from mocapdb.cycles.phase.timing import TIMINGS, time_phases
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
