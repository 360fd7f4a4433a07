import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles import aligned, blend, extract_cycle, make_loop, seam_steps, transition
from mocapdb.cycles.cycle import from_columns, joint_positions, to_columns
from mocapdb.cycles.synthesis.loop import calmest_phase, root_relative_positions
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
