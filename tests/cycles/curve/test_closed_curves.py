import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.corpus import synthetic
from mocapdb.cycles import (
    aligned,
    average_cycles,
    blend,
    cycle_of_loop,
    extract_cycle,
    make_loop,
    seam_steps,
    transition,
)
from mocapdb.cycles.class_cycle import mirror_rotations
from mocapdb.cycles.curve.closed_curves import best_phase_shift, interpolate_closed, shift_phase
from mocapdb.cycles.cycle import from_columns, joint_positions, to_columns
from mocapdb.cycles.synthesis.loop import calmest_phase, jerk, root_relative_positions
from mocapdb.errors import CycleError, NoPeriodError, SkeletonError
from mocapdb.io import read_clip, write_clip
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.foot_contacts import find_contacts, find_legs, foot_slide_mm
from mocapdb.motion.kinematics import forward_kinematics


@pytest.fixture(scope="module")
def walk():
    return extract_cycle(synthetic.make_clip("walk", seed=1, sensor_noise_deg=0.15)).cycle


@pytest.fixture(scope="module")
def run():
    return extract_cycle(synthetic.make_clip("run", seed=2, sensor_noise_deg=0.15)).cycle


def amplitude(cycle):
    positions = joint_positions(cycle)
    return np.sqrt(((positions - positions.mean(axis=0)) ** 2).sum())


# -- closed curves -------------------------------------------------------------------------------


@given(st.integers(3, 40), st.floats(-2, 2))
def test_trigonometric_interpolation_is_exact_on_waves(n_samples, shift):
    phase = np.arange(n_samples) / n_samples
    curve = np.column_stack([np.sin(2 * np.pi * phase), np.ones(n_samples)])
    moved = interpolate_closed(curve, phase + shift)
    np.testing.assert_allclose(moved[:, 0], np.sin(2 * np.pi * (phase + shift)), atol=1e-9)
    np.testing.assert_allclose(moved[:, 1], 1.0)


@given(st.floats(0, 0.999))
def test_the_best_shift_undoes_a_shift(shift):
    phase = np.arange(64) / 64
    angle = 2 * np.pi * phase
    curve = np.column_stack([np.sin(angle), np.cos(2 * angle), np.sin(3 * angle)])
    found = best_phase_shift(curve, shift_phase(curve, shift))
    assert abs((found - shift + 0.5) % 1 - 0.5) < 1e-3


def test_columns_are_rotations_again():
    from scipy.spatial.transform import Rotation

    rotations = Rotation.random(20, random_state=0).as_matrix()
    np.testing.assert_allclose(from_columns(to_columns(rotations)), rotations, atol=1e-12)
    np.testing.assert_allclose(from_columns(3.0 * to_columns(rotations)), rotations, atol=1e-12)


# -- loops ---------------------------------------------------------------------------------------


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


def test_a_loop_read_back_is_a_cycle_again(walk, tmp_path):
    loop = make_loop(walk, hold_feet=False).clip
    for name in ("loop.bvh", "loop.amc", "loop.npz"):
        write_clip(loop, tmp_path / name)
        again = cycle_of_loop(read_clip(tmp_path / name, fps=120.0))
        assert again.period_s == pytest.approx(walk.period_s, abs=0.01)
        size = np.linalg.norm(walk.advance)
        assert np.linalg.norm(again.advance) == pytest.approx(size, rel=0.02)
        if name == "loop.amc":
            np.testing.assert_allclose(joint_positions(again), joint_positions(walk), atol=0.6)


def test_open_ends_are_no_loop(synthetic_walk):
    with pytest.raises(NoPeriodError, match="steps apart"):
        cycle_of_loop(synthetic_walk[:70])
    with pytest.raises(NoPeriodError, match="steps apart"):
        cycle_of_loop(synthetic_walk[:2])


@pytest.mark.parametrize(
    "options", [{"fps": 0.0}, {"fps": np.nan}, {"fps": 1.0}, {"n_laps": 0}, {"root": "elsewhere"}]
)
def test_bad_loops(walk, options):
    with pytest.raises(CycleError):
        make_loop(walk, **options)


def test_a_cycle_that_turns_goes_round(walk):
    from dataclasses import replace

    circling = replace(walk, turn_rad=np.pi / 2)
    path, heading = circling.root_path(np.arange(5.0))
    assert heading[-1] == pytest.approx(2 * np.pi)
    np.testing.assert_allclose(path[0], path[4], atol=1e-6)
    loop = make_loop(circling, n_laps=2).clip
    assert np.isfinite(loop.channels).all()
    np.testing.assert_allclose(circling.rephased(0.3).advance, circling.advance)


# -- between cycles ------------------------------------------------------------------------------


def test_alignment_brings_phases_together(walk):
    moved = aligned([walk, walk.rephased(0.37)])[1]
    np.testing.assert_allclose(joint_positions(moved), joint_positions(walk), atol=0.05)


def test_an_aligned_midpoint_keeps_its_amplitude(walk, run):
    whole = (amplitude(walk) + amplitude(run)) / 2
    assert amplitude(blend([walk, run], [0.5, 0.5])) > 0.9 * whole
    first, second = aligned([walk, run])
    opposite = second.rephased(0.5)
    assert amplitude(blend([first, opposite], [0.5, 0.5], align=False)) < 0.6 * whole


def test_blending_goes_from_one_to_the_other(walk, run):
    same = blend([walk, run], [1.0, 0.0])
    np.testing.assert_allclose(same.columns, to_columns(from_columns(walk.columns)), atol=1e-9)
    assert same.period_s == walk.period_s
    middle = blend([walk, run], [0.5, 0.5])
    assert run.period_s < middle.period_s < walk.period_s
    assert seam_steps(make_loop(middle.rephased(calmest_phase(middle))).clip) < 1.2


def test_three_ways(walk, run):
    slow = extract_cycle(synthetic.make_clip("walk", seed=7, speed=0.8)).cycle
    mixed = blend([walk, run, slow], [0.2, 0.3, 0.5])
    expected = 0.2 * walk.period_s + 0.3 * run.period_s + 0.5 * slow.period_s
    assert mixed.period_s == pytest.approx(expected)


def test_a_transition_starts_as_one_and_ends_as_the_other(walk, run):
    clip = transition(walk, run, duration_s=1.5, lead_laps=1.0, hold_feet=False)
    before = make_loop(walk, hold_feet=False, root="in-place").clip
    np.testing.assert_allclose(clip.channels[:20, 6:], before.channels[:20, 6:], atol=0.6)
    steps = np.linalg.norm(np.diff(root_relative_positions(clip), axis=0), axis=(1, 2))
    alone = np.linalg.norm(
        np.diff(root_relative_positions(make_loop(run).clip), axis=0), axis=(1, 2)
    )
    assert steps.max() < 1.3 * alone.max()
    path = forward_kinematics(clip.skeleton, clip.channels).positions[:, 0]
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert speed[-60:].mean() > 1.5 * speed[:60].mean()


@pytest.mark.parametrize(
    "weights", [[0.5], [0.5, 0.6], [1.5, -0.5], [np.nan, 1.0], [0.2, 0.3, 0.5]]
)
def test_weights_that_do_not_fit(walk, run, weights):
    with pytest.raises(CycleError, match="weights"):
        blend([walk, run], weights)


def test_cycles_of_different_skeletons_do_not_blend(walk):
    other = extract_cycle(
        synthetic.make_clip("walk", seed=1, skeleton=synthetic.make_skeleton(1.95))
    ).cycle
    for mix in (lambda: blend([walk, other], [0.5, 0.5]), lambda: aligned([walk, other])):
        with pytest.raises(SkeletonError, match="one skeleton"):
            mix()
    with pytest.raises(CycleError):
        blend([], [])
    with pytest.raises(CycleError):
        transition(walk, walk, duration_s=0.0)


# -- classes -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def crowd():
    cycles = []
    for seed in range(5):
        clip = synthetic.make_clip(
            "walk", seed=seed, skeleton=synthetic.subject(seed), heading_deg=40.0 * seed,
            name=f"w{seed}",
        )  # fmt: skip
        cycles.append(extract_cycle(clip).cycle)
    return cycles


def test_a_class_is_the_mean_of_bodies(crowd):
    found = average_cycles(crowd, "walk")
    assert found.members == tuple(f"w{seed}" for seed in range(5))
    assert found.mirrored == ()
    heights = sorted(cycle.skeleton.height for cycle in crowd)
    assert found.cycle.skeleton.height == heights[2]
    assert found.spread_rad.shape == (len(found.cycle.sway), 31)
    assert np.rad2deg(found.spread_rad).mean() < 8
    ratio = amplitude(found.cycle) / np.median([amplitude(cycle) for cycle in crowd])
    assert 0.85 < ratio < 1.1


def test_an_outlier_is_left_out(crowd):
    squat = extract_cycle(synthetic.make_clip("squat", seed=0, n_cycles=3, name="odd")).cycle
    found = average_cycles([*crowd, squat], "walk")
    assert "odd" not in found.members
    assert "too far" in found.left_out["odd"]


def test_another_kind_of_skeleton_is_left_out(crowd, synthetic_walk):
    bvh = extract_cycle(to_bvh_convention(synthetic_walk.replace(name="bvh"))).cycle
    found = average_cycles([*crowd, bvh], "walk")
    assert "another kind" in found.left_out["bvh"]


def test_sides_are_brought_together():
    wave = extract_cycle(synthetic.make_clip("wave", seed=1, name="right")).cycle
    from dataclasses import replace

    other = replace(wave, columns=mirror_rotations(wave.columns, wave.skeleton), name="left")
    found = average_cycles([wave, other, wave], "wave")
    assert found.mirrored == ("left",)
    assert np.rad2deg(found.spread_rad).max() < 1


def test_mirroring_twice_is_nothing(walk):
    twice = mirror_rotations(mirror_rotations(walk.columns, walk.skeleton), walk.skeleton)
    np.testing.assert_allclose(from_columns(twice), from_columns(walk.columns), atol=1e-9)


def test_no_cycles_no_class():
    with pytest.raises(CycleError, match="Expected cycles"):
        average_cycles([], "walk")
