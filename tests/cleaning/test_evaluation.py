"""The evaluation kit: what counts as clean, wrong, flagged, found."""

import numpy as np
import pytest

from mocapdb.cleaning.evaluation import (
    Trial,
    clean_joints,
    cut_trial,
    make_trials,
    repair_errors,
    score,
)
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic.faults import Fault
from mocapdb.motion.quaternions import angles_deg


@pytest.fixture(scope="module")
def run():
    return synthetic.make_clip("run", seed=4, sensor_noise_deg=0.02, phase_noise=0.2)


def test_joints_that_jump_are_not_clean(run):
    joint = run.skeleton.joint("head")
    channels = run.channels.copy()
    channels[100:, int(run.skeleton.channel_starts[joint])] += 30.0
    assert joint in clean_joints(run)
    assert joint not in clean_joints(run.replace(channels=channels))
    assert 0 not in clean_joints(run)


def test_scores_of_a_perfect_and_of_a_blind_detector(run):
    trials = make_trials([run, run], seed=1, seconds_per_fault=1.0)
    truth = {id(trial.clip): trial.mask for trial in trials}
    perfect = score(trials, lambda clip: truth[id(clip)])
    for unit in ("words", "joint words", "spans", "frames"):
        assert perfect[unit].recall == perfect[unit].precision == 1.0
    blind = score(trials, lambda clip: np.zeros_like(truth[id(clip)]))
    assert blind["spans"].recall == 0.0
    assert np.isnan(blind["spans"].precision)
    everything = score(trials, lambda clip: np.ones_like(truth[id(clip)]))
    assert everything["frames"].recall == 1.0
    assert everything["frames"].precision < 0.1


def test_trials_follow_from_the_seed(run):
    first, again, other = (make_trials([run], seed=seed)[0] for seed in (1, 1, 2))
    assert first.clip == again.clip
    assert first.clip != other.clip


@pytest.mark.parametrize("at_end", [False, True])
def test_a_cut_trial_ends_or_begins_in_the_middle_of_a_fault(run, at_end):
    (trial,) = make_trials([run], seed=1, seconds_per_fault=1.0)
    fault = trial.faults[-1 if at_end else 0]
    cut = cut_trial(trial, at_end=at_end)
    middle = (fault.start + fault.end) // 2
    assert cut.clip == (trial.clip[:middle] if at_end else trial.clip[middle:])
    assert cut.mask[-1 if at_end else 0, fault.joint]
    for kept in cut.faults:
        assert cut.mask[kept.start : kept.end, kept.joint].all()
    assert sum(kept.end - kept.start for kept in cut.faults) == cut.mask.sum()
    assert cut_trial(trial._replace(faults=()), at_end=at_end).clip == trial.clip


def test_eased_faults_have_no_edges_and_repairs_are_measured_against_a_line(run):
    (trial,) = make_trials([run], seed=2, kinds=["offset"], ease_s=0.1, length_s=0.5)
    (fault,) = trial.faults
    a, b = local_rotations(run), local_rotations(trial.clip)
    row = a.joints.tolist().index(fault.joint)
    apart = angles_deg(a.quat_xyzw[:, row], b.quat_xyzw[:, row])
    assert apart.max() == pytest.approx(fault.size_deg, abs=1e-6)
    assert apart[[fault.start, fault.end - 1]].max() < 0.05 * fault.size_deg
    assert np.abs(np.diff(apart)).max() < 0.2 * fault.size_deg
    errors = repair_errors([trial], lambda clip: (run, trial.mask))
    assert errors[0, 0] == pytest.approx(0.0, abs=1e-4)
    assert 0.0 < errors[0, 1] < 30.0
    nothing = repair_errors([trial], lambda clip: (clip, np.zeros_like(trial.mask)))
    inside = apart[fault.start : fault.end].mean()
    np.testing.assert_allclose(nothing, [[inside, inside]])


@pytest.mark.parametrize(("jump_deg", "is_clean"), [(7.0, True), (9.5, False)])
def test_a_clean_joint_never_jumps_by_8_degrees(run, jump_deg, is_clean):
    joint = run.skeleton.joint("head")
    channels = run.channels.copy()
    channels[100:, int(run.skeleton.channel_starts[joint])] += jump_deg
    assert (joint in clean_joints(run.replace(channels=channels))) == is_clean


def test_a_fault_for_every_8_seconds():
    (trial,) = make_trials([synthetic.make_clip("walk", seed=1, duration_s=24)], seed=1)
    assert len(trial.faults) == 3


def counts_of(run, flagged_frames, *, fault=(100, 140)):
    """Scores of one fault of one joint, where so many of its first frames are flagged."""
    joint = int(clean_joints(run)[0])
    mask, flags = (np.zeros((len(run), run.skeleton.n_joints), dtype=bool) for _ in range(2))
    mask[slice(*fault), joint] = True
    flags[slice(*flagged_frames), joint] = True
    faults = (Fault(joint, *fault, "offset", 40.0),)
    trial = Trial(run, run, clean_joints(run), mask, faults, np.zeros_like(mask))
    return score([trial], lambda clip: flags)


@pytest.mark.parametrize(("end", "recall"), [(118, 0.0), (122, 1.0)])
def test_a_fault_is_found_that_is_half_flagged(run, end, recall):
    assert counts_of(run, (100, end))["spans"].recall == recall


@pytest.mark.parametrize(("end", "precision"), [(177, 1.0), (184, 0.0)])
def test_a_flag_is_right_that_is_half_in_a_fault(run, end, precision):
    assert counts_of(run, (100, end))["spans"].precision == precision


@pytest.mark.parametrize(("end", "n_words"), [(101, 0), (102, 3)])
def test_a_word_is_flagged_with_two_frames(run, end, n_words):
    words = counts_of(run, (100, end))["words"]
    assert words.right_alarms + words.false_alarms == n_words
