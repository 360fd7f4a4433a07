import numpy as np
import pytest
from repeating import circling

from mocapdb.cycles import excitation_regions
from mocapdb.cycles.period.autocorrelation import guess_period
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


def lap_of(plane, n_frames):
    """Return one round of a circle in a plane, from the origin back to it."""
    turn = np.linspace(0.0, 2 * np.pi, n_frames, endpoint=False)
    lap = np.zeros((n_frames, 4))
    lap[:, 2 * plane], lap[:, 2 * plane + 1] = 1.0 - np.cos(turn), np.sin(turn)
    return lap


def test_laps_of_a_tempo_that_wanders_are_counted():
    rng = np.random.default_rng(4)
    poses = np.vstack([lap_of(0, n_frames) for n_frames in (74, 61, 130, 55, 46, 90)])
    poses += rng.normal(0.0, 0.03, poses.shape)
    found = find_loops(poses, 60.0)
    assert found.n_loops == 1
    assert np.ptp(found.coordinates[0]) == pytest.approx(6, abs=0.5)
    assert guess_period(poses).frames > 1.5 * len(poses) / 6  # a lap and more


def test_laps_of_two_loops_through_one_pose_are_counted():
    rng = np.random.default_rng(3)
    lengths = rng.integers(48, 72, 8)
    parts = [lap_of(p, n) for p, n in zip((0, 0, 0, 1, 1, 1, 0, 0), lengths, strict=True)]
    poses = np.vstack(parts)
    poses += rng.normal(0.0, 0.03, poses.shape)
    found = find_loops(poses, 60.0)
    laps = sorted(np.ptp(found.coordinates[:2], axis=1))
    assert laps == pytest.approx([3, 5], abs=0.4)
