"""Faults that were put in are found, on the right joint, in the right place, of the right kind."""

import numpy as np
import pytest

from mocapdb.cleaning import detect_faults
from mocapdb.cleaning.evaluation import clean_joints, make_trials, score
from mocapdb.cleaning.evidence.discontinuities import find_jumps
from mocapdb.cleaning.evidence.fault_confidence import FEATURES, MODELS, Witnesses, model_of
from mocapdb.cleaning.evidence.fault_shapes import KINDS
from mocapdb.cleaning.evidence.hypotheses import EVIDENCE, find_hypotheses, jump_scales
from mocapdb.cleaning.evidence.joint_limits import RotationLimits
from mocapdb.cleaning.local_rotations import local_rotations, motion_texture
from mocapdb.cleaning.map.detector import find_clip_consensus, gather
from mocapdb.cleaning.map.digression_map import Span
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary
from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.clip import Clip
from mocapdb.motion.quaternions import angles_deg
from mocapdb.motion.skeleton import Skeleton


def noisy(kind, seed, **options):
    return synthetic.make_clip(kind, seed=seed, sensor_noise_deg=0.02, phase_noise=0.2, **options)


@pytest.fixture(scope="module")
def run():
    return noisy("run", 4)


def overlap(span, fault):
    shared = min(span.end, fault.end) - max(span.start, fault.start)
    return shared / (max(span.end, fault.end) - min(span.start, fault.start))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_each_kind_is_found_and_named(run, kind, seed):
    faulty, _, (fault,) = synthetic.inject_faults(
        run, seed=seed, kinds=[kind], n=1, size_deg=(30, 80), length_s=(0.2, 0.5)
    )
    if fault.size_deg < 10:
        pytest.skip("a freeze where the joint hardly moves is no fault to find")
    spans = detect_faults(faulty).spans
    assert [span.joint for span in spans] == [fault.joint]
    assert overlap(spans[0], fault) > 0.7
    assert spans[0].kind == kind
    assert 0.75 <= spans[0].confidence <= 1.0


@pytest.mark.parametrize("kind", ["walk", "run", "box", "sequence"])
def test_clean_motion_is_left_alone(kind):
    clip = noisy(kind, 7)
    found = detect_faults(clip)
    assert found.mask.mean() < 0.001
    assert found.scores.shape == (len(clip), clip.skeleton.n_joints)


@pytest.mark.parametrize("step", [2, 4])
def test_lower_rates(step):
    clip = noisy("walk", 5, fps=120.0 / step)
    trials = make_trials([clip], seed=3, seconds_per_fault=1.5)
    counts = score(trials, lambda clip: detect_faults(clip).mask)
    assert counts["spans"].recall >= 0.6
    assert counts["spans"].precision >= 0.6


def test_another_family_of_skeletons(run):
    clip = to_bvh_convention(run)
    faulty, _, (fault,) = synthetic.inject_faults(clip, seed=2, kinds=["offset"], n=1, size_deg=40)
    (span,) = detect_faults(faulty).spans
    assert span.joint == fault.joint
    assert overlap(span, fault) > 0.9


def test_a_context_counts_and_must_have_the_same_joints(run):
    faulty = synthetic.inject_faults(run, seed=1, kinds=["drift"], n=1).clip
    other = synthetic.warp(run, 0.9)[0]
    other = other.replace(channels=other.channels[::2], fps=60.0)
    alone, with_context = detect_faults(faulty), detect_faults(faulty, [other])
    assert with_context.consensus.residual_deg.mean() < alone.consensus.residual_deg.mean()
    with pytest.raises(SkeletonError, match="Leave it out"):
        detect_faults(faulty, [_chain(60)])
    with pytest.raises(ClipError, match="at 24 Hz"):
        detect_faults(faulty, [noisy("run", 9, fps=12.0)])


def _chain(n_frames, seed=0):
    """A tail of three joints that swings."""
    skeleton = Skeleton(
        ["a", "b", "c"], [-1, 0, 1], np.ones((3, 3)), [("rx", "ry", "rz"), ("rz",), ("rx", "ry")],
        ["XYZ", "Z", "XY"], convention="bvh", name="tail",
    )  # fmt: skip
    time = np.arange(n_frames)[:, None] / 60.0
    swing = 30.0 * np.sin(2 * np.pi * (time + np.arange(6) / 6))
    swing += np.random.default_rng(seed).normal(0, 0.02, swing.shape)
    return Clip(skeleton, swing, 60.0, name="tail")


def test_any_skeleton_will_do():
    clip = _chain(600)
    faulty, _, (fault,) = synthetic.inject_faults(clip, seed=4, kinds=["flip"], n=1)
    (span,) = detect_faults(faulty).spans
    assert (span.joint, span.start, span.end, span.kind) == (
        fault.joint, fault.start, fault.end, "flip",
    )  # fmt: skip


@pytest.mark.parametrize("n_frames", [1, 2, 3, 10, 40])
def test_short_clips_are_judged_by_jumps_alone(run, n_frames):
    found = detect_faults(run[:n_frames])
    assert found.spans == ()
    assert found.consensus is None


def test_an_isolated_spike_is_found(run):
    joint = run.skeleton.joint("lradius")
    column = int(run.skeleton.channel_starts[joint])
    channels = run.channels.copy()
    channels[200, column] += 40.0
    (span,) = detect_faults(run.replace(channels=channels)).spans
    assert span.joint == joint
    assert (span.start, span.end) == (200, 201)


def test_a_clip_that_is_wrong_throughout_does_not_fail(run):
    rng = np.random.default_rng(0)
    wild = run.replace(channels=rng.uniform(-180, 180, run.channels.shape))
    found = detect_faults(wild)
    assert np.isfinite(found.scores).all()


def test_still_motion_has_no_faults(run):
    still = run.replace(channels=np.repeat(run.channels[:1], 300, axis=0))
    assert detect_faults(still).spans == ()


@pytest.mark.parametrize("threshold", [0.0, -1.0, 1.5, float("nan")])
def test_thresholds_out_of_range_are_refused(run, threshold):
    with pytest.raises(ClipError, match="threshold in"):
        detect_faults(run, threshold=threshold)


def test_a_skeleton_without_rotations_is_refused():
    skeleton = Skeleton(["a"], [-1], [[0, 0, 0]], [("tx",)], [""], convention="bvh", name="slider")
    with pytest.raises(ClipError, match="rotation channels"):
        detect_faults(Clip(skeleton, np.zeros((50, 1)), 60.0))


def test_a_higher_threshold_flags_less(run):
    faulty = synthetic.inject_faults(run, seed=8, n=6, size_deg=(10, 30)).clip
    loose, tight = (detect_faults(faulty, threshold=t).mask for t in (0.05, 0.95))
    assert not (tight & ~loose).any()
    assert tight.sum() < loose.sum()


def test_spans_of_a_joint_do_not_touch_and_are_in_the_scores(run):
    faulty = synthetic.inject_faults(run, seed=6, n=8).clip
    found = detect_faults(faulty)
    last = {}
    for span in found.spans:
        assert last.get(span.joint, -1) < span.start < span.end <= len(run)
        last[span.joint] = span.end
        assert found.scores[span.start : span.end, span.joint].max() >= span.confidence
    assert isinstance(found.spans[0], Span)


# -- parts -------------------------------------------------------------------------------------


def test_a_jump_is_the_size_of_the_offset(run):
    texture = local_rotations(run)
    faulty, _, (fault,) = synthetic.inject_faults(run, seed=1, kinds=["offset"], n=1, size_deg=50)
    row = texture.joints.tolist().index(fault.joint)
    sizes = find_jumps(local_rotations(faulty)).sizes_deg[:, row]
    assert sizes[[fault.start - 1, fault.end - 1]] == pytest.approx([50, 50], abs=5)
    assert np.sort(sizes)[-3] < 5


def test_angles_are_those_of_the_faults(run):
    faulty, mask, (fault,) = synthetic.inject_faults(
        run, seed=1, kinds=["offset"], n=1, size_deg=50
    )
    a, b = local_rotations(run), local_rotations(faulty)
    row = a.joints.tolist().index(fault.joint)
    angles = angles_deg(a.quat_xyzw[:, row], b.quat_xyzw[:, row])
    np.testing.assert_allclose(angles, np.where(mask[:, fault.joint], 50.0, 0.0), atol=1e-6)


def test_faults_in_most_of_a_clip_do_not_raise_the_scale(run):
    clean = jump_scales(find_jumps(local_rotations(run)), run.fps)
    faulty = synthetic.inject_faults(run, seed=1, kinds=["noise"], n=1, length_s=2.9, size_deg=60)
    raised = jump_scales(find_jumps(local_rotations(faulty.clip)), run.fps)
    assert np.all(raised < 6 * clean)


def test_evidence_is_finite_and_in_its_order(run):
    faulty = synthetic.inject_faults(run, seed=3, n=5).clip
    native, texture = local_rotations(faulty), motion_texture(faulty)
    consensus, limits = find_clip_consensus(texture), RotationLimits(texture)
    hypotheses = gather(faulty, native, texture, consensus)
    assert {"edges", "cut off", "similarity"} <= {hypothesis.cue for hypothesis in hypotheses}
    witnesses = Witnesses(native, texture, consensus, limits)
    for hypothesis in hypotheses:
        evidence = witnesses.features(hypothesis)
        assert model_of(hypothesis) in MODELS
        assert len(evidence) == len(FEATURES[model_of(hypothesis)])
        assert np.isfinite(evidence).all()
        assert 0 <= hypothesis.start < hypothesis.end <= len(run)


def test_a_stretched_knee_may_rest(run):
    """A joint that stands still at the end of its range is not frozen; within it, it is."""
    joint = run.skeleton.joint("ltibia")
    column = int(run.skeleton.channel_starts[joint])
    straight = run.channels.copy()
    straight[:, column] = np.maximum(
        run.channels[:, column], np.quantile(run.channels[:, column], 0.3)
    )
    assert detect_faults(run.replace(channels=straight)).spans == ()
    stuck = run.channels.copy()
    start = 60 + int(np.abs(stuck[100:-60, column] - stuck[60:-100, column]).argmax())
    stuck[start : start + 40, column] = stuck[start, column]
    (span,) = detect_faults(run.replace(channels=stuck)).spans
    assert (span.joint, span.kind) == (joint, "freeze")


def test_a_frozen_joint_makes_up_for_what_it_missed_and_a_resting_one_sets_off(run):
    joint = run.skeleton.joint("ltibia")
    column = int(run.skeleton.channel_starts[joint])
    angles = run.channels[:, column]
    resting, frozen = run.channels.copy(), run.channels.copy()
    resting[:, column] = np.maximum(angles, np.quantile(angles, 0.3))
    start = 60 + int(np.abs(angles[100:-60] - angles[60:-100]).argmax())
    frozen[start : start + 40, column] = angles[start]
    releases = []
    for channels in (resting, frozen):
        texture = local_rotations(run.replace(channels=channels))
        releases.append(
            [
                hypothesis.evidence[EVIDENCE.index("release")]
                for hypothesis in find_hypotheses(texture)
                if hypothesis.kind == "freeze" and texture.joints[hypothesis.row] == joint
            ]
        )
    assert max(releases[0]) < 0.5
    assert max(releases[1]) > 1.0


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_soft_edges_are_found_by_lower_rates_or_by_similarity(seed):
    clip = noisy("run", 4, duration_s=8)
    faulty, _, (fault,) = synthetic.inject_faults(
        clip, seed=seed, kinds=["offset"], n=1, size_deg=60, length_s=0.5, ease_s=0.08
    )
    spans = [span for span in detect_faults(faulty).spans if span.joint == fault.joint]
    assert len(spans) == 1
    assert overlap(spans[0], fault) > 0.5


def test_a_bump_without_edges_is_found_by_similarity_alone():
    clip = noisy("walk", 4, duration_s=10)
    faulty, _, (fault,) = synthetic.inject_faults(
        clip, seed=2, kinds=["offset"], n=1, size_deg=50, length_s=0.9, ease_s=0.45,
        joints=[clip.skeleton.joint("lfoot")],
    )  # fmt: skip
    with_it, without = detect_faults(faulty), detect_faults(faulty, similarity=False)
    assert [span.joint for span in with_it.spans] == [fault.joint]
    assert without.spans == ()


def test_real_clips_of_subjects_that_nothing_was_fitted_on(corpus):
    from mocapdb.io import read_clip

    folder = corpus / "cmu" / "asfamc"
    clips = [read_clip(folder / name[:2] / f"{name}.amc") for name in ("02_01", "07_01", "07_05")]
    trials = [t for seed in range(1, 9) for t in make_trials(clips, seed=seed)]
    counts = score(trials, lambda clip: detect_faults(clip).mask)
    assert counts["words"].recall > 0.9
    assert counts["words"].precision > 0.85
    for clip in clips:
        joints = clean_joints(clip)
        assert detect_faults(clip).mask[:, joints].mean() < 0.01


def test_a_context_has_one_vocabulary_of_the_clips_joints(run):
    vocabulary = Vocabulary.of([motion_texture(run)])
    for context in ([vocabulary, vocabulary], [vocabulary, run]):
        with pytest.raises(ClipError, match="one vocabulary of the clip's joints"):
            detect_faults(run, context)
