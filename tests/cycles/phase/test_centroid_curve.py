import numpy as np
import pytest
from repeating import circling

from mocapdb.cycles import typical_trajectory
from mocapdb.errors import CycleError


def test_the_typical_lap_is_the_lap():
    values = circling(400, 80.0) + np.random.default_rng(0).normal(0, 0.02, (400, 4))
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
