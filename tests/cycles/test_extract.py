import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles import HarmonicRegression, Settings, extract_cycle, match_template
from mocapdb.cycles.embedding import joint_angles
from mocapdb.cycles.extract import extract_cycles
from mocapdb.errors import CycleError, NoPeriodError
from mocapdb.io.convert import to_bvh_convention

NOISE = {"sensor_noise_deg": 0.15}


def error_against_truth(found, truth):
    """Root mean square distance of the cycle from the true one in radians, best phase."""
    phase = truth.phase / (2 * np.pi)
    grid = np.arange(256) / 256
    clean = joint_angles(truth.clean)
    true = HarmonicRegression(40, model="m2").fit(phase, clean).predict(grid)
    assert found.values.whole == ()
    return match_template(true, _in_channel_order(found, grid)).error


def _in_channel_order(found, grid):
    """The curve's columns go by rotation order, those of joint_angles by channel."""
    skeleton = found.clip.skeleton
    wanted = [skeleton.channel_names[i] for i in skeleton.rotation_channels]
    names = found.values.names()
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


@pytest.mark.parametrize("timing", ["linear", "drift", "whole-laps", "uniform", "mixture"])
def test_timings(synthetic_walk, timing):
    found = extract_cycle(synthetic_walk, Settings(timing=timing))
    assert found.timing.name == timing
    assert found.period_frames == pytest.approx(
        extract_cycle(synthetic_walk).period_frames, rel=0.05
    )


def test_without_topology_the_guard_stands_alone(synthetic_walk):
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


def test_a_cycle_is_closed_and_goes_as_far_as_the_clip(synthetic_walk):
    cycle = extract_cycle(synthetic_walk).cycle
    ends = cycle.pose(np.array([0.0, 1.0]), "in-place")
    np.testing.assert_allclose(ends.positions[0], ends.positions[1], atol=1e-9)
    path, _ = cycle.root_path(np.array([0.0, 2.0]))
    travelled = synthetic_walk.channels[-1, :3] - synthetic_walk.channels[0, :3]
    laps = len(synthetic_walk) / synthetic_walk.fps / cycle.period_s
    expected = 2 * np.hypot(travelled[0], travelled[2]) / laps
    assert np.hypot(*(path[1] - path[0])[[0, 2]]) == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda clip: clip[:2],
        lambda clip: clip[:1],
        lambda clip: clip[:100],  # three quarters of a lap
        lambda clip: clip.replace(channels=np.repeat(clip.channels[:1], 400, axis=0)),
        lambda clip: clip.replace(channels=np.linspace(0, 1, 400)[:, None] * clip.channels[:1]),
    ],
    ids=["two frames", "one frame", "less than a lap", "constant", "one way"],
)
def test_clips_without_a_period(synthetic_walk, spoil):
    with pytest.raises(NoPeriodError):
        extract_cycle(spoil(synthetic_walk))
    with pytest.raises(NoPeriodError):
        extract_cycles(spoil(synthetic_walk))


@pytest.mark.parametrize(
    "settings",
    [{"prime": 12}, {"timing": "sundial"}, {"model": "m9"}, {"n_harmonics": -1}, {"ridge": -1.0}],
)
def test_bad_settings(settings):
    with pytest.raises(CycleError):
        Settings(**settings)


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

    for label, mean, median in (("walk", 0.27, 0.26), ("run", 0.23, 0.22)):
        errors = []
        for name, path in real_clips(corpus, label).items():
            found = extract_cycle(read_clip(path, drop_tpose=True))
            errors.append(found.template_error_rad)
            assert found.period_frames == pytest.approx(found.guess.frames, rel=0.03), name
            assert found.confidence > 0.5, name
        assert len(errors) > 5
        assert np.mean(errors) < mean
        assert np.median(errors) < median
