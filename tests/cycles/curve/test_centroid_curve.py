import numpy as np
import pytest

from mocapdb.cycles import excitation_regions, typical_trajectory
from mocapdb.errors import CycleError, NoPeriodError


def laps(n_frames, period, radius=1.0, at=(0.0, 0.0, 0.0, 0.0)):
    angle = 2 * np.pi * np.arange(n_frames) / period
    ring = np.zeros((n_frames, 4))
    ring[:, 0], ring[:, 1] = radius * np.cos(angle), radius * np.sin(angle)
    return ring + at


def test_the_typical_lap_is_the_lap():
    values = laps(400, 80.0) + np.random.default_rng(0).normal(0, 0.02, (400, 4))
    coordinates = np.arange(400) / 80 % 1
    lap = typical_trajectory(coordinates, values, 80)
    assert lap.shape == (80, 4)
    np.testing.assert_allclose(np.linalg.norm(lap[:, :2], axis=1), 1.0, atol=0.05)
    assert abs(np.unwrap(np.arctan2(lap[:, 1], lap[:, 0]))[-1]) == pytest.approx(2 * np.pi, rel=0.1)


def test_it_lingers_where_the_motion_does():
    time = np.arange(600) / 100
    coordinates = (time + 0.12 * np.sin(2 * np.pi * time)) % 1
    angle = 2 * np.pi * coordinates
    values = np.column_stack([np.cos(angle), np.sin(angle)])
    lap = typical_trajectory(coordinates, values, 100, n_components=10)
    speed = np.linalg.norm(np.diff(lap, axis=0), axis=1)
    assert np.percentile(speed, 90) > 2 * np.percentile(speed, 10)


def test_too_few_frames():
    with pytest.raises(CycleError, match="neighbour"):
        typical_trajectory(np.arange(5) / 5, np.ones((5, 2)), 10)


def test_each_class_is_excited_in_its_own_region():
    far = (9.0, 0.0, 0.0, 0.0)
    clip = np.vstack([laps(300, 50.0), laps(300, 60.0, 0.8, far)])
    found = excitation_regions(clip, n_classes=2, stride=3)
    assert [(region.rank, round(region.laps)) for region in found] == [(0, 6), (1, 5)]
    assert found[0].end <= 310
    assert found[1].start >= 290


def test_no_loop_no_excitation():
    with pytest.raises(NoPeriodError):
        excitation_regions(np.linspace(0, 1, 50)[:, None])
