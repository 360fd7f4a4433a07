import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles import HarmonicRegression, Settings, extract_cycle, match_template
from mocapdb.cycles.curve.rotation_values import local_rotations
from mocapdb.cycles.extract import extract_cycles
from mocapdb.cycles.phase.pose_cloud import Embedding, joint_angles
from mocapdb.cycles.synthesis.loop import jerk, root_relative_positions
from mocapdb.errors import CycleError, NoPeriodError
from mocapdb.io.conventions import to_bvh_convention

NOISE = {"sensor_noise_deg": 0.15}


def error_against_truth(found, truth):
    """Root mean square distance of the cycle from the true one in radians, best phase."""
    phase = truth.phase / (2 * np.pi)
    grid = np.arange(256) / 256
    clean = joint_angles(truth.clean)
    true = HarmonicRegression(40, model="m2").fit(phase, clean).predict(grid)
    assert found.rotation_values.matrix_joints == ()
    return match_template(true, _in_channel_order(found, grid)).error


def _in_channel_order(found, grid):
    """The curve's columns go by rotation order, those of joint_angles by channel."""
    skeleton = found.clip.skeleton
    wanted = [skeleton.channel_names[i] for i in skeleton.rotation_channels]
    names = found.rotation_values.names()
    return found.curve.predict(grid)[:, [names.index(name) for name in wanted]]


@pytest.mark.parametrize("kind", synthetic.CLASSES)
def test_the_period_is_found_with_nothing_set(kind):
    clip, truth = synthetic.make(kind, seed=5, n_cycles=3.4, **NOISE)
    found = extract_cycle(clip)
    assert found.period_frames == pytest.approx(truth.period_frames, rel=0.01)
    assert found.laps == pytest.approx(3.4, rel=0.02)
    assert found.confidence > 0.5
    assert error_against_truth(found, truth) < 0.05
    assert not found.warnings


@pytest.mark.parametrize("kind", ["walk", "run", "wave", "squat"])
@pytest.mark.parametrize("n_cycles", [1.25, 1.5])
def test_a_lap_and_a_bit_will_do(kind, n_cycles):
    clip, truth = synthetic.make(kind, seed=3, n_cycles=n_cycles, **NOISE)
    found = extract_cycle(clip)
    assert found.period_frames == pytest.approx(truth.period_frames, rel=0.02)
    assert any("laps" in warning for warning in found.warnings) == (found.laps < 1.5)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["walk", "run", "hop"])
def test_a_drifting_tempo(kind, seed):
    clip, truth = synthetic.make(kind, seed=seed, n_cycles=6, tempo_drift=0.1, **NOISE)
    assert error_against_truth(extract_cycle(clip), truth) < 0.1


def test_a_strongly_drifting_tempo_is_followed():
    clip, truth = synthetic.make("walk", seed=1, n_cycles=6, tempo_drift=0.5, **NOISE)
    found = extract_cycle(clip)
    assert found.timing.name == "drift"
    assert error_against_truth(found, truth) < 0.1


def test_both_families_of_skeletons(synthetic_walk):
    other = extract_cycle(to_bvh_convention(synthetic_walk))
    assert other.period_frames == pytest.approx(
        extract_cycle(synthetic_walk).period_frames, rel=1e-3
    )


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0])
def test_other_frame_rates(fps):
    clip, truth = synthetic.make("walk", seed=2, n_cycles=4, fps=fps, **NOISE)
    found = extract_cycle(clip)
    assert found.cycle.period_s == pytest.approx(truth.period_s, rel=0.02)


@pytest.mark.parametrize("radians", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("scattered", [True, False])
def test_a_hand_that_jumps_changes_nothing(synthetic_walk, radians, scattered):
    n_frames = len(synthetic_walk)
    jumping = np.arange(n_frames) < n_frames / 3
    if scattered:
        np.random.default_rng(0).shuffle(jumping)
    channels = synthetic_walk.channels.copy()
    hand = synthetic_walk.skeleton.joint("rhand")
    channels[jumping, synthetic_walk.skeleton.channel_starts[hand]] += np.rad2deg(radians)
    found = extract_cycle(synthetic_walk.replace(channels=channels))
    assert found.period_frames == pytest.approx(
        extract_cycle(synthetic_walk).period_frames, rel=0.03
    )


def test_what_comes_before_and_after_is_left_out():
    walk = synthetic.make_clip("walk", seed=4, n_cycles=4)
    before, after = (np.repeat(walk.channels[i : i + 1], 300, axis=0) for i in (0, -1))
    channels = np.vstack([before, walk.channels, after])
    noise = np.random.default_rng(0).normal(0, 0.05, channels.shape)
    padded = walk.replace(channels=channels + noise)
    found = extract_cycle(padded)
    start, stop = found.frames
    assert 240 <= start <= 420
    assert 300 + len(walk) - 120 <= stop <= 300 + len(walk) + 60
    assert found.period_frames == pytest.approx(extract_cycle(walk).period_frames, rel=0.02)
    assert any("left out" in warning for warning in found.warnings)


def test_frames_that_a_capture_held_are_left_out(synthetic_walk):
    channels = synthetic_walk.channels
    held = np.vstack([channels[:1].repeat(5, 0), channels, channels[-1:].repeat(11, 0)])
    found = extract_cycle(synthetic_walk.replace(channels=held))
    assert found.frames == (5, 5 + len(channels))
    assert any("held" in warning for warning in found.warnings)


def test_several_motions_in_one_clip():
    clip, truth = synthetic.make("sequence", seed=1, duration_s=18, **NOISE)
    found = extract_cycles(clip)
    assert len(found) == len(truth.segments)
    for part, segment in zip(found, truth.segments, strict=True):
        assert abs(part.frames[0] - segment.start) < 60
        assert abs(part.frames[1] - segment.end) < 60


@pytest.mark.parametrize("model", ["m1", "m2", "m3"])
def test_models(synthetic_walk, model):
    found = extract_cycle(synthetic_walk, Settings(model=model, n_harmonics=12))
    assert found.rmse_rad < 0.1
    assert found.curve.n_harmonics == 12


def test_the_typical_trajectory_is_a_model(synthetic_walk):
    found = extract_cycle(synthetic_walk, Settings(model="typical"))
    usual = extract_cycle(synthetic_walk)
    assert found.rmse_rad < 0.1
    assert found.rmse_rad != usual.rmse_rad
    np.testing.assert_array_equal(found.cycle.advance, usual.cycle.advance)
    grid = np.arange(60) / 60
    apart = found.curve.predict(grid) - usual.curve.predict(grid)
    assert 0.0 < np.sqrt((apart**2).sum(axis=1)).max() < 0.15
    loop = found.loop()
    assert jerk(root_relative_positions(loop.clip), 120.0, closed=True) <= found.source_jerk


@pytest.mark.parametrize("timing", ["linear", "drift", "whole-laps", "uniform", "mixture"])
def test_timings(synthetic_walk, timing):
    found = extract_cycle(synthetic_walk, Settings(timing=timing))
    assert found.timing.name == timing
    assert found.period_frames == pytest.approx(
        extract_cycle(synthetic_walk).period_frames, rel=0.05
    )


def test_without_topology_the_autocorrelation_stands_alone(synthetic_walk):
    found = extract_cycle(synthetic_walk, Settings(topology=False))
    assert found.topology is None
    assert found.confidence < 0.5
    assert found.method.startswith("autocorrelation")
    assert any("autocorrelation's alone" in warning for warning in found.warnings)


def test_periods_that_disagree_are_flagged(synthetic_walk, monkeypatch):
    from dataclasses import replace

    from mocapdb.cycles import extract

    honest = extract.find_coordinates

    def doubled(*args, **options):
        found = honest(*args, **options)
        return replace(found, period_frames=2 * found.period_frames)

    monkeypatch.setattr(extract, "find_coordinates", doubled)
    found = extract_cycle(synthetic_walk)
    assert found.confidence == 0.0
    assert any("disagree" in warning for warning in found.warnings)
    assert any("doubtful" in warning for warning in found.warnings)


@pytest.mark.parametrize(
    "embedding",
    [
        Embedding(features="rotations", root="differences"),
        Embedding(features="angles", root="orientation", by_bone_length=False, delays=2, lag=1),
        Embedding(joints=("lfemur", "ltibia", "rfemur", "rtibia"), normalise=True),
        Embedding(n_components=3, delays=0, join_neighbours=True),
    ],
)
def test_other_embeddings_find_the_same(synthetic_walk, embedding):
    found = extract_cycle(synthetic_walk, Settings(embedding=embedding))
    usual = extract_cycle(synthetic_walk)
    assert found.topology is not None
    assert found.period_frames == pytest.approx(usual.period_frames, rel=0.01)


def test_a_loop_chosen_by_hand_is_followed_or_an_error(synthetic_walk):
    usual = extract_cycle(synthetic_walk)
    by_hand = extract_cycle(synthetic_walk, Settings(max_epsilon=3.0))
    assert by_hand.period_frames == pytest.approx(usual.period_frames, rel=0.01)
    for nothing in (Settings(max_epsilon=1e-4), Settings(rank=500)):
        with pytest.raises(NoPeriodError, match="loop of rank"):
            extract_cycle(synthetic_walk, nothing)


def test_a_joint_that_turns_all_the_way_round():
    clip, truth = synthetic.make("walk", seed=6, n_cycles=3.2)
    skeleton, channels = clip.skeleton, clip.channels.copy()
    turning = skeleton.joint("rhand")
    channel = int(skeleton.channel_starts[turning])
    channels[:, channel] = np.rad2deg(truth.phase)
    found = extract_cycle(clip.replace(channels=channels))
    assert turning in found.rotation_values.matrix_joints
    assert found.period_frames == pytest.approx(truth.period_frames, rel=0.01)
    own = found.rotation_values.decode(found.curve.predict(found.timing.phase))[:, turning]
    true = local_rotations(skeleton, channels)[:, turning]
    angle = np.arccos(np.clip((np.einsum("fij,fij->f", own, true) - 1) / 2, -1, 1))
    assert np.sqrt(np.mean(angle**2)) < 0.05


def test_a_loop_comes_with_the_extraction(synthetic_walk):
    found = extract_cycle(synthetic_walk)
    loop = found.loop(fps=60, n_laps=2)
    assert loop.clip.fps == 60
    assert len(loop.clip) == 2 * round(60 * found.cycle.period_s)
    assert jerk(root_relative_positions(loop.clip), 60, closed=True) <= found.source_jerk


@pytest.mark.parametrize(
    "spoil",
    [
        lambda clip: clip[:2],
        lambda clip: clip[:1],
        lambda clip: clip[:100],  # three quarters of a lap
        lambda clip: clip[:138],  # hardly more than a lap
        lambda clip: clip.replace(channels=np.repeat(clip.channels[:1], 400, axis=0)),
        lambda clip: clip.replace(channels=np.linspace(0, 1, 400)[:, None] * clip.channels[:1]),
    ],
    ids=["two frames", "one frame", "less than a lap", "a lap", "constant", "one way"],
)
def test_clips_without_a_period(synthetic_walk, spoil):
    with pytest.raises(NoPeriodError):
        extract_cycle(spoil(synthetic_walk))
    with pytest.raises(NoPeriodError):
        extract_cycles(spoil(synthetic_walk))


@pytest.mark.parametrize(
    "settings",
    [
        {"prime": 12},
        {"timing": "sundial"},
        {"model": "m9"},
        {"n_harmonics": -1},
        {"ridge": -1.0},
        {"rank": -1},
        {"max_epsilon": 0.0},
    ],
)
def test_bad_settings(settings):
    with pytest.raises(CycleError):
        Settings(**settings)


@pytest.mark.parametrize(
    "options", [{"features": "smell"}, {"root": "tree"}, {"delays": -1}, {"lag": 0}]
)
def test_bad_embeddings(options):
    with pytest.raises(CycleError):
        Embedding(**options)


def test_delays_longer_than_the_clip(synthetic_walk):
    with pytest.raises(CycleError, match="delay shorter"):
        extract_cycle(synthetic_walk, Settings(embedding=Embedding(delays=2, lag=900)))


def real_clips(corpus, label):
    from mocapdb.corpus import read_labels

    seen = {}
    for row in read_labels(corpus / "LABELS.csv"):
        plain = not any(word in row.description for word in ("uneven", "Start", "leap", "jump"))
        if row.label == label and plain and row.path.startswith("cmu/"):
            seen.setdefault(row.clip, corpus / row.path)
    return seen


@pytest.mark.slow
def test_real_walks_and_runs(corpus):
    """Issue 4: every period agrees with the autocorrelation, and errors are half the thesis's."""
    from mocapdb.io import read_clip

    for label, mean, median in (("walk", 0.27, 0.26), ("run", 0.23, 0.23)):
        errors = []
        for name, path in real_clips(corpus, label).items():
            found = extract_cycle(read_clip(path, drop_tpose=True))
            errors.append(found.template_error_rad)
            assert found.period_frames == pytest.approx(found.guess.frames, rel=0.03), name
            assert found.confidence > 0.5, name
        assert len(errors) > 5
        assert np.mean(errors) < mean
        assert np.median(errors) < median


HANDS = ("lhand", "RightHand")


@pytest.mark.slow
def test_a_hand_that_jumps_on_real_walks(corpus):
    """Issue 4: the count stays within 3 % on every walk."""
    from mocapdb.io import read_clip

    for name, path in real_clips(corpus, "walk").items():
        clip = read_clip(path, drop_tpose=True)
        skeleton = clip.skeleton
        hand = next(skeleton.joint(hand) for hand in HANDS if hand in skeleton.names)
        usual = extract_cycle(clip).laps
        for third, radians in enumerate((1.0, 2.0, 3.0)):
            channels = clip.channels.copy()
            frames = slice(third * len(clip) // 3, (third + 1) * len(clip) // 3)
            channels[frames, skeleton.channel_starts[hand]] += np.rad2deg(radians)
            found = extract_cycle(clip.replace(channels=channels))
            assert found.laps == pytest.approx(usual, rel=0.03), (name, radians)


def test_the_defaults_are_the_documented_ones():
    settings = Settings()
    assert (settings.n_harmonics, settings.prime) == (40, 47)
    assert settings.embedding.n_components == 16


@pytest.mark.parametrize(("confidence", "is_first"), [(0.12, True), (0.09, False)])
def test_a_range_that_contradicts_itself_is_passed_over(monkeypatch, confidence, is_first):
    from mocapdb.cycles import extract

    clip = synthetic.make_clip("sequence", seed=1, duration_s=14, fps=60.0, **NOISE)
    usual = extract_cycle(clip)
    evidence = {"laps": confidence}
    monkeypatch.setattr(extract, "gather_evidence", lambda *_, **__: evidence)
    assert (extract_cycle(clip).frames == usual.frames) == is_first
