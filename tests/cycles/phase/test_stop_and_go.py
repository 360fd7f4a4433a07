import numpy as np
import pytest
from repeating import wave

from mocapdb.corpus import synthetic
from mocapdb.cycles import extract_cycle
from mocapdb.cycles.phase.stop_and_go import find_rests, time_stop_and_go

RESTS = ((130, 40), (215, 60), (290, 25))
PERIOD = 60.0
FPS = 60.0


def with_rests(rows, rests):
    """Rows held for so many frames at some of them."""
    times = np.ones(len(rows), dtype=int)
    for at, length in rests:
        times[at] += length
    return np.repeat(rows, times, axis=0)


@pytest.fixture(scope="module")
def cloud():
    moving = wave(np.arange(360) / PERIOD)
    return with_rests(moving, RESTS) + np.random.default_rng(0).normal(0, 0.002, (485, 3))


def test_rests_within_are_found(cloud):
    rests = find_rests(cloud, FPS)
    assert rests.sum() == pytest.approx(125, abs=20)
    assert rests[140:165].all()
    assert not find_rests(cloud[:120], FPS).any()


def test_rests_at_the_ends_are_none(cloud):
    padded = np.vstack([np.repeat(cloud[:1], 50, axis=0), cloud[:100]])
    assert not find_rests(padded, FPS)[:50].any()


def test_a_lap_takes_as_long_as_without_rests(cloud):
    found = time_stop_and_go(cloud, FPS)
    assert found.timing.period_frames == pytest.approx(PERIOD, rel=0.02)
    assert found.timing.phase[-1] - found.timing.phase[0] == pytest.approx(6, abs=0.1)
    assert np.ptp(found.timing.phase[140:165]) < 0.02


def test_what_does_not_rest_is_left_to_autocorrelation(cloud):
    assert time_stop_and_go(cloud[:125], FPS) is None


def test_what_goes_there_and_back_is_no_lap():
    swing = np.sin(2 * np.pi * np.arange(240) / 60)[:, None] * [1.0, 0.2, 0.1]
    swing += np.random.default_rng(0).normal(0, 0.002, swing.shape)
    assert time_stop_and_go(with_rests(swing, ((100, 40),)), FPS) is None


def test_cohomology_decides_where_a_walk_stops_and_goes_on():
    clip, truth = synthetic.make("walk", seed=3, n_cycles=4.5, fps=FPS, sensor_noise_deg=0.1)
    period = truth.period_frames
    stops = [(round(share * period), length) for share, length in ((1.3, 50), (2.1, 70), (2.9, 40))]
    stopping = clip.replace(channels=with_rests(clip.channels, stops))
    found = extract_cycle(stopping)
    assert found.period_frames == pytest.approx(period, rel=0.03)
    assert found.method == "cohomology, whole-laps time"
    assert found.laps == pytest.approx(4.5, abs=0.1)
    assert found.frames == (0, len(stopping))
    assert extract_cycle(clip).method == "autocorrelation, linear time"
