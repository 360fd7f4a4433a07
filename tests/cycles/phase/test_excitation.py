import numpy as np
import pytest
from repeating import circling

from mocapdb.cycles import excitation_regions
from mocapdb.cycles.phase.excitation import find_loops, loop_chances
from mocapdb.errors import NoPeriodError

FAR = (9.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def two():
    """Six laps of one circle, a way across, five laps of another, with a little noise."""
    way = np.linspace(0, 1, 40)[:, None] * FAR
    parts = [circling(300, 50.0), circling(1, 50.0) + way, circling(300, 60.0, 0.8, FAR)]
    rng = np.random.default_rng(0)
    clip = np.vstack(parts)
    return clip + rng.normal(0, 0.03, clip.shape)


def test_each_loop_is_gone_round_in_its_own_region(two):
    found = excitation_regions(two, 30.0)
    assert [round(region.laps) for region in found] == [6, 5]
    assert [region.repeats for region in found] == [True, True]
    assert found[0].end <= 340
    assert found[1].start >= 300
    assert found[1].period_frames == pytest.approx(60.0, rel=0.1)


def test_how_many_loops_there_are_is_decided_by_what_noise_makes(two):
    found = find_loops(two, 30.0)
    assert found.n_loops == 2
    assert found.chances[:2].max() < 1e-3
    assert np.median(found.chances) > 0.2
    noise = np.random.default_rng(1).normal(size=(300, 3))
    assert find_loops(noise, 30.0).n_loops == 0
    assert np.mean(loop_chances(find_loops(noise, 30.0).bars) < 0.1) < 0.2


def test_as_many_loops_as_are_asked_for(two):
    found = find_loops(two, 30.0, n_loops=1)
    assert found.coordinates.shape == (1, len(two))
    assert {region.rank for region in found.regions} == {0}


def test_a_rest_within_a_motion_is_part_of_its_region():
    clip = circling(240, 40.0)
    rested = np.vstack([clip[:125], np.repeat(clip[125:126], 12, axis=0), clip[125:]])
    (region,) = excitation_regions(
        rested + np.random.default_rng(0).normal(0, 0.01, (252, 4)), 30.0
    )
    assert region.laps == pytest.approx(6, abs=0.3)


def test_no_loop_no_excitation():
    with pytest.raises(NoPeriodError):
        excitation_regions(np.linspace(0, 1, 50)[:, None])
