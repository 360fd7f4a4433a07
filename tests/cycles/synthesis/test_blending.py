from dataclasses import replace

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles import aligned, blend, extract_cycle, make_loop, seam_steps, transition
from mocapdb.cycles.cycle import from_columns, joint_positions, to_columns
from mocapdb.cycles.synthesis.blending import loop_peaks, make_transition, peaks_over_parents
from mocapdb.cycles.synthesis.loop import calmed, calmest_phase, jerk, root_relative_positions
from mocapdb.errors import CycleError
from mocapdb.motion.kinematics import forward_kinematics


def amplitude(cycle):
    positions = joint_positions(cycle)
    return np.sqrt(((positions - positions.mean(axis=0)) ** 2).sum())


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


def test_a_transition_in_place_is_carried_by_its_path(walk, run):
    options = {"duration_s": 0.5, "lead_laps": 0.3, "fps": 60.0}
    there = make_transition(walk, run, **options)
    still = make_transition(walk, run, root="in-place", **options)
    roots = [
        forward_kinematics(each.clip.skeleton, each.clip.channels).positions[:, 0]
        for each in (there, still)
    ]
    np.testing.assert_allclose(roots[0], roots[1] + still.path, atol=1e-6)
    assert still.slide_after_mm < still.slide_before_mm


@pytest.mark.parametrize(
    "weights", [[0.5], [0.5, 0.6], [1.5, -0.5], [np.nan, 1.0], [0.2, 0.3, 0.5]]
)
def test_weights_that_do_not_fit(walk, run, weights):
    with pytest.raises(CycleError, match="weights"):
        blend([walk, run], weights)


def test_what_cannot_be_blended(walk):
    with pytest.raises(CycleError):
        blend([], [])
    with pytest.raises(CycleError):
        aligned([])
    with pytest.raises(CycleError):
        transition(walk, walk, duration_s=0.0)


def kinked(cycle, size):
    """The cycle with its root thrown aside, a share of its height, in one of its samples."""
    sway = cycle.sway.copy()
    sway[len(sway) // 3, 0] += size * cycle.skeleton.height
    return replace(cycle, sway=sway)


def test_neither_blends_nor_transitions_jerk_more_than_their_parents(walk, run):
    assert make_transition(walk, run, duration_s=0.7).peaks == {}
    assert peaks_of(blend([walk, run], [0.4, 0.6]), walk, run) == {}


def test_what_jerks_more_than_its_parents_is_told(walk, run):
    over = peaks_of(kinked(blend([walk, run], [0.5, 0.5]), 0.02), walk, run)
    assert over["root"] > 3.0
    assert len(over) > 20  # all that hangs on it
    assert list(over.values()) == sorted(over.values(), reverse=True)
    # a parent that jerks itself is what is asked for
    assert peaks_of(kinked(walk, 0.02), kinked(walk, 0.02), run) == {}


def peaks_of(cycle, *parents):
    loop = make_loop(cycle)
    peaks = loop_peaks(loop.clip, loop.path, loop.heading_rad)
    return peaks_over_parents(peaks, parents, [120.0] * len(parents))


def test_a_cycle_that_jerks_is_calmed_as_its_loop_is(run):
    rough = replace(run, columns=run.columns + 0.01 * np.cos(np.pi * np.arange(128))[:, None, None])
    rough = rough.rephased(0.003)
    lap = make_loop(run, hold_feet=False).clip
    most = jerk(root_relative_positions(lap), 120.0, closed=True)
    calm = calmed(rough, 120.0, most)
    again = make_loop(calm, hold_feet=False).clip
    assert jerk(root_relative_positions(again), 120.0, closed=True) <= most
    assert calmed(run, 120.0, 1.01 * most) is run
