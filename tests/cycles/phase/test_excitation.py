import numpy as np
import pytest
from repeating import circling

from mocapdb.cycles import excitation_regions
from mocapdb.errors import NoPeriodError


def test_each_class_is_excited_in_its_own_region():
    far = (9.0, 0.0, 0.0, 0.0)
    clip = np.vstack([circling(300, 50.0), circling(300, 60.0, 0.8, far)])
    found = excitation_regions(clip, n_classes=2, stride=3)
    assert [(region.rank, round(region.laps)) for region in found] == [(0, 6), (1, 5)]
    assert found[0].end <= 310
    assert found[1].start >= 290


def test_no_loop_no_excitation():
    with pytest.raises(NoPeriodError):
        excitation_regions(np.linspace(0, 1, 50)[:, None])
