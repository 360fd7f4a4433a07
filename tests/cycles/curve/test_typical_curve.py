import numpy as np
import pytest

from mocapdb.cycles.curve.typical_curve import TypicalCurve
from mocapdb.errors import CycleError


def test_the_typical_curve_is_the_mean_of_the_nearest_poses():
    rng = np.random.default_rng(0)
    phase = np.sort(rng.uniform(0, 2.7, 300))
    values = rng.normal(0, 1, (300, 2))
    curve = TypicalCurve(phase, values, 110.0)
    for sample in (0, 1, 64, 127):
        apart = np.abs(phase % 1 - sample / 128)
        nearest = np.argsort(np.minimum(apart, 1 - apart))[:11]  # four of each of 2.7 laps
        np.testing.assert_allclose(curve.centroids[sample], values[nearest].mean(axis=0))
    np.testing.assert_allclose(curve.predict(np.array([1.5])), curve.centroids[[64]], atol=1e-9)


def test_few_frames_are_refused():
    with pytest.raises(CycleError, match="10 frames at least"):
        TypicalCurve(np.arange(5) / 4, np.ones((5, 1)), 4.0)
