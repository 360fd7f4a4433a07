from dataclasses import replace

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles import cycle_of_loop, extract_cycle, make_loop, seam_steps
from mocapdb.cycles.synthesis import loop as loop_module
from mocapdb.cycles.synthesis.loop import (
    _pops,
    calmest_phase,
    jerk,
    jerk_by_frame,
    root_relative_positions,
    turn_of_lap,
)
from mocapdb.cycles.tuning import CALM_TIMES, HOLDS
from mocapdb.errors import CycleError
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.foot_contacts import find_contacts, find_legs, foot_slide_mm
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.rotations import elementary


@pytest.mark.parametrize("fps", [24.0, 30.0, 120.0])
@pytest.mark.parametrize("root", ["advance", "in-place"])
def test_a_loop_goes_on_into_itself(walk, fps, root):
    loop = make_loop(walk.rephased(calmest_phase(walk)), fps, root=root)
    assert len(loop.clip) == round(walk.period_s * fps)
    assert seam_steps(loop.clip) < 1.2
    two = make_loop(walk, fps, n_laps=2, root=root).clip
    one = make_loop(walk, fps, root=root).clip
    first, second = two.channels[: len(one)], two.channels[len(one) :]
    np.testing.assert_allclose(first[:, 6:], second[:, 6:], atol=1e-6)
    moved = second[:, :3] - first[:, :3]
    np.testing.assert_allclose(moved, np.broadcast_to(moved[0], moved.shape), atol=1e-6)
    travels = np.linalg.norm(moved[0])
    assert travels > 10 if root == "advance" else travels < 1e-6


@pytest.mark.parametrize("turn_rad", [0.0, 0.8])
def test_a_closing_frame_is_the_first_carried_on(walk, turn_rad):
    turning = replace(walk, turn_rad=turn_rad)
    open_loop = make_loop(turning, 60.0)
    loop = make_loop(turning, 60.0, closed=True)
    assert len(loop.clip) == len(open_loop.clip) + 1 == loop.lap_frames + 1
    np.testing.assert_allclose(loop.clip.channels[:-1], open_loop.clip.channels, atol=1e-9)
    pose = forward_kinematics(walk.skeleton, loop.clip.channels)
    assert loop.heading_rad[-1] - loop.heading_rad[0] == pytest.approx(turn_rad)
    turn = elementary(walk.skeleton.up_axis, loop.heading_rad[-1:])[0]
    carried = (pose.positions[0] - loop.path[0]) @ turn.T + loop.path[-1]
    np.testing.assert_allclose(pose.positions[-1], carried, atol=1e-6)
    assert cycle_of_loop(loop.clip).period_s == pytest.approx(open_loop.clip.duration_s)
    still = make_loop(walk, 60.0, root="in-place", closed=True).clip.channels
    np.testing.assert_allclose(still[-1], still[0], atol=1e-9)


def test_a_carrier_and_a_loop_in_place_make_one_that_advances(walk):
    turning = replace(walk, turn_rad=0.8)
    whole, still = (make_loop(turning, 60.0, root=root) for root in ("advance", "in-place"))
    place = forward_kinematics(walk.skeleton, still.clip.channels).positions
    turned = elementary(walk.skeleton.up_axis, still.heading_rad)
    carried = np.einsum("fij,fkj->fki", turned, place) + still.path[:, None]
    expected = forward_kinematics(walk.skeleton, whole.clip.channels).positions
    np.testing.assert_allclose(carried, expected, atol=1e-6)


def test_a_loop_of_so_many_frames(walk):
    loop = make_loop(walk, 30.0, n_laps=2, lap_frames=40, most_jerk=1e9)
    assert (len(loop.clip), loop.clip.fps, loop.lap_frames) == (80, 30.0, 40)
    assert loop.tempo_error == pytest.approx(40 / (30 * walk.period_s) - 1)
    # feet rest as at the tempo of the motion
    slow = make_loop(walk, 40 / walk.period_s)
    assert loop.slide_after_mm == pytest.approx(slow.slide_after_mm, rel=0.3)
    assert make_loop(walk, lap_frames=10).lap_frames == 10
    with pytest.raises(CycleError, match="10 frames or more, but got 9"):
        make_loop(walk, lap_frames=9)


def test_feet_are_held_where_they_rest():
    walk = extract_cycle(synthetic.make_clip("walk", seed=1)).cycle
    loose = make_loop(walk, hold_feet=False)
    held = make_loop(walk)
    assert loose.slide_before_mm == loose.slide_after_mm == held.slide_before_mm
    assert held.slide_after_mm < 0.5 * held.slide_before_mm
    skeleton = walk.skeleton
    positions = forward_kinematics(skeleton, held.clip.channels).positions
    lengths = np.linalg.norm(np.diff(positions[:, [1, 2, 3]], axis=1), axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(lengths[0], lengths.shape), atol=1e-9)


def test_rests_are_where_the_truth_has_them():
    clip, truth = synthetic.make("walk", seed=1, n_cycles=3)
    positions = forward_kinematics(clip.skeleton, clip.channels).positions
    found = find_contacts(clip.skeleton, positions, clip.fps)
    assert len(find_legs(clip.skeleton)) == 2
    # balls are at rest for most of the time that the foot is down, and never while it is up
    assert (found & ~truth.contacts).mean() < 0.05
    assert 0.5 < found.mean() / truth.contacts.mean() < 1.1
    assert foot_slide_mm(clip.skeleton, positions, found) < 15


def test_legs_are_found_in_both_conventions(synthetic_walk):
    acclaim = find_legs(synthetic_walk.skeleton)
    names = synthetic_walk.skeleton.names
    assert [names[leg.knee] for leg in acclaim] == ["lfemur", "rfemur"]
    bvh = to_bvh_convention(synthetic_walk)
    legs = find_legs(bvh.skeleton)
    assert [bvh.skeleton.names[leg.knee] for leg in legs] == ["ltibia", "rtibia"]
    loop = make_loop(extract_cycle(bvh).cycle)
    assert loop.slide_after_mm < loop.slide_before_mm


def test_jerk_can_be_limited(walk):
    plain = make_loop(walk)
    limit = 0.8 * jerk(root_relative_positions(plain.clip), 120.0, closed=True)
    calm = make_loop(walk, most_jerk=limit)
    assert jerk(root_relative_positions(calm.clip), 120.0, closed=True) <= limit


def test_a_loop_that_turns_jerks_no_more_at_its_seam(walk):
    loops = [make_loop(replace(walk, turn_rad=turn)) for turn in (0.0, 0.3)]
    straight, turning = (root_relative_positions(loop.clip) for loop in loops)
    turn = turn_of_lap(replace(walk, turn_rad=0.3), "advance")
    assert turn_of_lap(walk, "in-place") is None
    usual = jerk(straight, 120.0, closed=True)
    assert jerk(turning, 120.0, closed=True) > 2 * usual
    assert jerk(turning, 120.0, closed=True, turn=turn) == pytest.approx(usual, rel=0.1)
    frames, values = jerk_by_frame(turning, 120.0, closed=True, turn=turn)
    assert len(values) == len(turning)
    assert 0 <= frames.min() < frames.max() < len(turning)
    assert values.max() < 4 * usual  # at the seam, too


def test_a_loop_that_turns_is_not_damped_for_it(walk):
    turning = replace(walk, turn_rad=0.3)
    plain = make_loop(turning)
    turn = turn_of_lap(turning, "advance")
    most = 1.01 * jerk(root_relative_positions(plain.clip), 120.0, closed=True, turn=turn)
    kept = make_loop(turning, most_jerk=most)
    np.testing.assert_allclose(kept.clip.channels, plain.clip.channels)


@pytest.mark.parametrize(
    "options", [{"fps": 0.0}, {"fps": np.nan}, {"fps": 1.0}, {"n_laps": 0}, {"root": "elsewhere"}]
)
def test_bad_loops(walk, options):
    with pytest.raises(CycleError):
        make_loop(walk, **options)


def test_fewer_than_eight_frames_have_no_jerk():
    positions = np.random.default_rng(0).normal(size=(9, 2, 3))
    assert jerk(positions, 60.0, closed=False) > 0
    assert jerk(positions[:7], 60.0, closed=False) == 0.0


def test_a_knee_that_jerks_when_its_foot_is_held_is_named(walk):
    loose = make_loop(walk, hold_feet=False).clip
    positions = forward_kinematics(loose.skeleton, loose.channels).positions
    knee = loose.skeleton.joint("lfemur")
    peak = np.linalg.norm(np.diff(positions[:, knee], n=2, axis=0), axis=1).max()
    for times, named in ((1.2, []), (1.8, ["lfemur"])):
        held = positions.copy()
        still = np.zeros(3)
        still[1] = times * peak / 2.0  # one frame aside: twice as much in the second difference
        calm = np.linalg.norm(np.diff(positions[:, knee], n=2, axis=0), axis=1).argmin() + 1
        held[calm, knee] += still
        assert list(_pops(loose.skeleton, positions, held)) == named


def test_a_loop_that_pops_nowhere_says_so(walk):
    assert make_loop(walk).pops == {}


def test_a_leg_whose_reach_would_pop_gets_a_softer_one(walk, monkeypatch):
    striding = replace(walk, advance=1.3 * walk.advance)  # feet are pulled far back as they leave
    loop = make_loop(striding, 60.0)
    assert loop.pops == {}
    slides = []
    for hold in HOLDS:
        monkeypatch.setattr(loop_module, "HOLDS", (hold,))
        found = make_loop(striding, 60.0)
        slides.append(found.slide_after_mm)
        if hold == HOLDS[0]:
            assert max(found.pops.values()) > 1.5
    assert loop.slide_after_mm == slides[1]
    assert slides[:8] == pytest.approx([1.42, 1.43, 1.46, 1.49, 1.52, 3.88, 4.42, 4.76], abs=0.01)


def test_feet_are_held_less_where_any_hold_pops(walk, monkeypatch):
    striding = replace(walk, advance=1.3 * walk.advance)
    pops = iter([2.6] * 8 + [1.9, 1.7])
    monkeypatch.setattr(loop_module, "_pops", lambda *args: {"lfemur": next(pops)})
    less = make_loop(striding, 60.0)
    assert (less.held_share, less.pops) == (0.25, {"lfemur": 1.7})
    assert less.slide_after_mm < less.slide_before_mm
    monkeypatch.setattr(loop_module, "_pops", lambda *args: {"lfemur": 2.6})
    none = make_loop(striding, 60.0)
    assert (none.held_share, none.pops) == (0.0, {})
    assert none.slide_after_mm == none.slide_before_mm
    monkeypatch.setattr(loop_module, "_pops", lambda *args: {"lfemur": 1.4})
    assert make_loop(striding, 60.0).held_share == 1.0


@pytest.mark.parametrize("turn_rad", [0.0, 0.8])
def test_many_laps_are_one_carried_on(walk, turn_rad):
    turning = replace(walk, turn_rad=turn_rad)
    one = make_loop(turning, 20.0).clip.channels
    loop = make_loop(turning, 20.0, n_laps=300)
    assert len(loop.clip) == len(loop.path) == 300 * len(one)
    np.testing.assert_allclose(loop.clip.channels[-len(one) :, 6:], one[:, 6:], atol=1e-6)
    way, turn = turning.steady_path(np.array([299.0]))
    roots = [
        forward_kinematics(walk.skeleton, channels).positions[:, 0]
        for channels in (one, loop.clip.channels[-len(one) :])
    ]
    turned = elementary(walk.skeleton.up_axis, turn)[0]
    np.testing.assert_allclose(roots[1], roots[0] @ turned.T + way, atol=1e-6)
    with pytest.raises(CycleError, match=r"1,000,000 frames at most, .* are 1,000,010"):
        make_loop(walk, n_laps=100_001, lap_frames=10)


def test_the_calmest_hold_is_taken_where_none_is_calm(walk, monkeypatch):
    striding = replace(walk, advance=1.3 * walk.advance)
    peaks = []
    for hold in HOLDS:
        monkeypatch.setattr(loop_module, "HOLDS", (hold,))
        monkeypatch.setattr(loop_module, "CALM_TIMES", 0.0)
        monkeypatch.setattr(loop_module, "POP_TIMES", 0.0)
        peaks.append(max(make_loop(striding, 60.0).pops.values()))
    monkeypatch.setattr(loop_module, "HOLDS", HOLDS)
    assert max(make_loop(striding, 60.0).pops.values()) == min(peaks)


@pytest.mark.parametrize(("calm", "n_tried"), [(1.35, 2), (1.8, 1), (0.9, 8)])
def test_holds_are_tried_until_one_is_calm(walk, monkeypatch, calm, n_tried):
    assert CALM_TIMES == 1.35
    tried = []
    monkeypatch.setattr(loop_module, "CALM_TIMES", calm)
    monkeypatch.setattr(loop_module, "_pops", lambda *args: tried.append(args[3]) or _pops(*args))
    make_loop(replace(walk, advance=1.3 * walk.advance), 60.0)
    assert tried == [calm] * n_tried


def test_feet_of_a_loop_that_climbs_are_held_alike_in_every_lap(walk):
    rising = walk.advance.copy()
    rising[walk.skeleton.up_index] = 0.2 * walk.skeleton.height
    climbing = replace(walk, advance=rising)
    peaks = []
    for hold in (False, True):
        clip = make_loop(climbing, 60.0, n_laps=2, hold_feet=hold).clip
        positions = forward_kinematics(clip.skeleton, clip.channels).positions
        bends = np.linalg.norm(np.diff(positions, n=2, axis=0), axis=2)
        peaks.append(bends.max())
    assert peaks[1] < 2.0 * peaks[0]
