import numpy as np
import pytest
from repeating import circling, noise

from mocapdb.cycles import periodic_ranges
from mocapdb.cycles.period.periodic_ranges import repeating_ranges
from mocapdb.errors import NoPeriodError


def test_ranges_have_their_own_periods():
    rest = np.zeros((120, 4))
    clip = np.vstack([rest, circling(360, 60.0), rest, circling(480, 100.0, 0.8), rest])
    found = periodic_ranges(clip, 120.0)
    assert [round(part.period_frames, -1) for part in found] == [60, 100]
    for part, (start, stop) in zip(found, ((120, 480), (600, 1080)), strict=True):
        assert abs(part.start - start) < 40
        assert abs(part.end - stop) < 40
        assert part.clarity > 0.8


def test_nothing_repeats_in_rest_or_on_one_way():
    assert periodic_ranges(np.zeros((300, 3)), 120.0) == []
    assert periodic_ranges(np.linspace(0, 1, 300)[:, None] * np.ones(3), 120.0) == []
    assert periodic_ranges(np.zeros((2, 3)), 120.0) == []


@pytest.mark.parametrize("n_laps", [1.9, 2.6, 5.0])
@pytest.mark.parametrize("rest", [40, 200])
def test_rest_at_either_end_is_left_out(n_laps, rest):
    motion = circling(round(n_laps * 60), 60.0)
    clip = np.vstack([np.zeros((rest, 4)), motion, np.zeros((rest, 4))])
    found = repeating_ranges(clip + noise(len(clip)), 30.0)[0]
    assert found.period_frames == pytest.approx(60, rel=0.03)
    assert abs(found.start - rest) < 12
    assert abs(found.end - (rest + len(motion))) < 12


def test_a_clip_that_repeats_throughout_is_taken_whole():
    clip = circling(250, 60.0) + noise(250)
    (found,) = repeating_ranges(clip, 30.0)
    assert (found.start, found.end) == (0, 250)
    assert found.clarity > 0.95


def test_a_period_that_changes_from_lap_to_lap_is_one_range():
    tempo = np.interp(np.arange(480), [0, 480], [1 / 57, 1 / 63])
    angle = 2 * np.pi * np.cumsum(tempo)
    motion = np.column_stack([np.cos(angle), np.sin(angle), 0.4 * np.cos(2 * angle), 0 * angle])
    clip = np.vstack([np.zeros((150, 4)), motion, np.zeros((150, 4))])
    found = periodic_ranges(clip + noise(len(clip)), 30.0)
    assert len(found) == 1
    assert found[0].end - found[0].start > 440


def test_a_motion_that_fills_most_of_a_clip_is_not_all_of_it():
    clip = np.vstack([circling(1800, 60.0), circling(500, 43.0, 0.5)])
    found = repeating_ranges(clip + noise(len(clip)), 30.0)
    assert round(found[0].period_frames) == 60
    assert abs(found[0].end - 1800) < 60


def test_posture_may_drift():
    drift = np.linspace(0, 0.8, 300)[:, None] * np.array([0, 0, 0, 1.0])
    found = periodic_ranges(circling(300, 60.0) + drift + noise(300), 30.0)
    assert [round(part.period_frames) for part in found] == [60]


def test_there_and_back_again_is_two_ranges():
    there = circling(110, 60.0)
    turn = there[-1] + 4 * np.sin(np.linspace(0, np.pi / 2, 60))[:, None] * np.array([0, 0, 0, 1.0])
    back = circling(110, 60.0) + turn[-1] - circling(1, 60.0)[0]
    clip = np.vstack([there, turn, back, turn[::-1], there])
    assert repeating_ranges(clip + noise(len(clip)), 30.0)[0].period_frames == pytest.approx(
        60, rel=0.05
    )


def test_nothing_repeats():
    once = np.sin(np.linspace(0, np.pi, 120))[:, None] * np.ones(4)
    clip = np.vstack([np.zeros((90, 4)), once, np.zeros((90, 4))])
    with pytest.raises(NoPeriodError):
        repeating_ranges(clip + 0.1 * noise(len(clip)), 30.0)


def in_rest(motion, rest=60):
    """A motion with rest before and after it."""
    still = np.zeros((rest, motion.shape[1]))
    clip = np.vstack([still + motion[0], motion, still + motion[-1]])
    return clip + 0.1 * np.random.default_rng(0).normal(0, 0.02, clip.shape)


@pytest.mark.parametrize(("period", "is_found"), [(9, True), (7, False), (135, True), (180, False)])
def test_parts_repeat_after_a_third_of_a_second_to_five_seconds(period, is_found):
    found = periodic_ranges(in_rest(circling(round(2.4 * period), period)), 30.0)
    assert bool(found) == is_found


@pytest.mark.parametrize(("n_laps", "is_found"), [(1.75, True), (1.5, False)])
def test_a_part_needs_more_than_a_lap_and_a_half(n_laps, is_found):
    found = periodic_ranges(in_rest(circling(round(n_laps * 60), 60)), 30.0)
    assert bool(found) == is_found


def test_at_most_twelve_ranges_are_found():
    clip = np.zeros((14 * 60, 28))
    for k in range(14):
        clip[60 * k : 60 * k + 45, 2 * k : 2 * k + 2] = circling(45, 15)[:, :2]
        clip[60 * k + 45 : 60 * k + 60, 2 * k] = 1.0
    assert len(periodic_ranges(clip, 30.0)) == 12


@pytest.mark.parametrize(("radius", "is_found"), [(0.048, True), (0.04, False)])
def test_what_moves_little_beside_the_rest_of_a_clip_is_rest(radius, is_found):
    clip = np.vstack(
        [circling(200, 60), np.ones((60, 1)) * circling(1, 60), circling(200, 40, radius)]
    )
    clip[260:] += np.array([1.0, 0, 0, 0]) - clip[260]
    found = periodic_ranges(clip, 30.0)
    assert any(abs(part.period_frames - 40) < 2 for part in found) == is_found


def there_and_back(n_laps, share):
    """Laps of 240 frames with short ones of 30 frames in the first share of each."""
    frames = np.arange(round(240 * n_laps))
    angle = 2 * np.pi * (frames % 240) / 30
    short = np.zeros((len(frames), 4))
    short[:, 2], short[:, 3] = 0.6 * np.cos(angle) - 0.6, 0.6 * np.sin(angle)
    short[frames % 240 >= 240 * share] = 0.0
    return circling(len(frames), 240) + short + 0.1 * noise(len(frames))


@pytest.mark.parametrize(("n_laps", "is_whole"), [(2.05, False), (2.35, True)])
def test_few_long_laps_may_be_many_short_ones(n_laps, is_whole):
    found = repeating_ranges(there_and_back(n_laps, 1.0), 30.0)
    assert (found[0].period_frames > 200) == is_whole


@pytest.mark.parametrize(("share", "is_whole"), [(0.22, True), (0.28, False)])
def test_short_laps_must_be_half_of_the_path(share, is_whole):
    found = repeating_ranges(there_and_back(2.05, share), 30.0)
    assert (found[0].period_frames > 200) == is_whole


def test_a_quarter_of_a_clip_may_not_repeat():
    clip = np.vstack([circling(1200, 60.0), circling(600, 43.0, 0.5)])
    assert len(repeating_ranges(clip + noise(1800), 30.0)) == 1
