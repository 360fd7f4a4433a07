"""Clips: what the truth says of them is so."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from synthetic_channels import best_lag, bvh_clip, positions_m

from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic import CLASSES, SEQUENCE
from mocapdb.errors import ClipError, SkeletonError

KINDS = (*CLASSES, SEQUENCE)
GAITS = ("walk", "run")


@pytest.mark.parametrize("kind", KINDS)
def test_same_seed_same_bytes(kind: str) -> None:
    options = {"sensor_noise_deg": 0.2, "phase_noise": 0.1, "period_jitter": 0.03}
    first = synthetic.make_clip(kind, seed=5, **options)
    again = synthetic.make_clip(kind, seed=5, **options)
    other = synthetic.make_clip(kind, seed=6, **options)
    assert first.channels.tobytes() == again.channels.tobytes()
    assert first.channels.shape != other.channels.shape or not np.array_equal(
        first.channels, other.channels
    )


def test_make_clip_is_the_clip_of_make() -> None:
    clip, _ = synthetic.make("box", seed=2, speed=1.2, name="punch")
    assert clip == synthetic.make_clip("box", seed=2, speed=1.2, name="punch")
    assert clip.name == "punch"


@pytest.mark.parametrize("kind", KINDS)
def test_labels(kind: str) -> None:
    clip, truth = synthetic.make(kind, seed=1)
    assert clip.label == truth.label == kind
    assert clip.name == f"{kind}_1"
    assert len(truth.phase) == len(truth.contacts) == len(clip)


def test_lengths() -> None:
    assert len(synthetic.make_clip("walk", seed=1)) == 600
    assert len(synthetic.make_clip("run", seed=1, duration_s=2.0, fps=60.0)) == 120
    clip, truth = synthetic.make("hop", seed=1, n_cycles=4)
    assert len(clip) == round(4 * truth.period_frames)
    assert len(synthetic.make_clip("walk", seed=1, duration_s=1 / 120)) == 1
    assert len(synthetic.make_clip(SEQUENCE, seed=1, duration_s=7.0)) == 840


@pytest.mark.parametrize("kind", CLASSES)
@pytest.mark.parametrize("speed", [0.8, 1.0, 1.3])
def test_period_is_the_autocorrelation_of_the_angles(kind: str, speed: float) -> None:
    clip, truth = synthetic.make(kind, seed=7, n_cycles=4, speed=speed)
    angles = clip.channels[:, clip.skeleton.rotation_channels]
    longest = round(1.5 * truth.period_frames)
    assert best_lag(angles, longest) == pytest.approx(truth.period_frames, abs=1.0)


@given(seed=st.integers(0, 2**31), kind=st.sampled_from(CLASSES))
@settings(max_examples=12, deadline=None)
@example(seed=19110, kind="run")
def test_pose_is_a_function_of_phase(seed: int, kind: str) -> None:
    """Interpolating by phase, a wandering clip predicts a steady one."""
    skeleton = synthetic.subject(seed)
    steady, truth = synthetic.make(kind, seed=seed, skeleton=skeleton, n_cycles=2)
    uneven, uneven_truth = synthetic.make(
        kind, seed=seed, skeleton=skeleton, n_cycles=4, phase_noise=0.2, period_jitter=0.05
    )
    assert np.all(np.diff(uneven_truth.phase) > 0)
    turns = np.round((uneven_truth.phase.mean() - truth.phase.mean()) / (2 * np.pi))
    phase = truth.phase + 2 * np.pi * turns
    inside = (phase > uneven_truth.phase[0]) & (phase < uneven_truth.phase[-1])
    assert inside.any()
    for column in steady.skeleton.rotation_channels:
        of_phase = CubicSpline(uneven_truth.phase, uneven.channels[:, column])
        error = np.abs(of_phase(phase[inside]) - steady.channels[inside, column])
        assert np.quantile(error, 0.95) < 0.5, steady.skeleton.channel_names[column]
        assert error.max() < 4.0, steady.skeleton.channel_names[column]


def test_phase_advances_by_one_turn_a_period() -> None:
    _, truth = synthetic.make("walk", seed=3)
    steps = np.diff(truth.phase)
    np.testing.assert_allclose(steps, 2 * np.pi / truth.period_frames)


@pytest.mark.parametrize("kind", GAITS)
def test_left_foot_lands_at_whole_turns(kind: str) -> None:
    _, truth = synthetic.make(kind, seed=3)
    left = truth.contacts[:, 0]
    landings = np.flatnonzero(left[1:] & ~left[:-1]) + 1
    assert len(landings) >= 3
    turns = truth.phase[landings] / (2 * np.pi)
    assert np.all((turns % 1.0) * truth.period_frames < 1.0 + 1e-9)


def test_tempo_drift_is_the_change_of_tempo() -> None:
    _, truth = synthetic.make("walk", seed=3, tempo_drift=0.4)
    rate = np.diff(truth.phase)
    assert (rate[-1] - rate[0]) / rate.mean() == pytest.approx(0.4, abs=0.01)
    assert truth.period_s == pytest.approx(synthetic.make("walk", seed=3)[1].period_s, rel=0.01)


def test_period_jitter_makes_cycles_unequal() -> None:
    _, truth = synthetic.make("run", seed=3, n_cycles=60, period_jitter=0.05)
    whole = np.arange(np.ceil(truth.phase[0] / (2 * np.pi)), truth.phase[-1] // (2 * np.pi))
    landings = np.interp(2 * np.pi * whole, truth.phase, np.arange(len(truth.phase)))
    lengths = np.diff(landings)
    assert 0.02 < lengths.std() / lengths.mean() < 0.08


def test_sensor_noise_is_white_and_known() -> None:
    clip, truth = synthetic.make("squat", seed=3, sensor_noise_deg=0.5)
    noise = clip.channels - truth.clean.channels
    angles = clip.skeleton.rotation_channels
    assert noise[:, angles].std() == pytest.approx(0.5, rel=0.02)
    assert not np.delete(noise, angles, axis=1).any()
    assert truth.clean == synthetic.make_clip("squat", seed=3)


def test_heading_turns_the_whole_motion() -> None:
    straight = synthetic.make_clip("walk", seed=3)
    turned = synthetic.make_clip("walk", seed=3, heading_deg=120.0)
    before, after = positions_m(straight), positions_m(turned)
    angle = np.deg2rad(120.0)
    turn = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    np.testing.assert_allclose(after, before @ turn.T, atol=1e-9)
    assert np.abs(np.diff(turned.channels, axis=0)).max() < 20.0  # no jumps between Euler forms


@pytest.mark.parametrize(
    "bad",
    [
        {"kind": "swim"},
        {"duration_s": 0.0},
        {"duration_s": np.inf},
        {"n_cycles": -1},
        {"n_cycles": 2, "duration_s": 2.0},
        {"fps": 0.0},
        {"speed": -1.0},
        {"speed": np.nan},
        {"phase_noise": 30.0},
        {"tempo_drift": 3.0},
        {"kind": SEQUENCE, "n_cycles": 3},
    ],
)
def test_impossible_clips_are_refused(bad: dict[str, object]) -> None:
    options = {"kind": "walk", "seed": 1, **bad}
    with pytest.raises(ClipError, match="Expected"):
        synthetic.make_clip(**options)  # type: ignore[arg-type]


def test_other_skeletons_are_refused() -> None:
    with pytest.raises(SkeletonError, match="lfemur"):
        synthetic.make_clip("walk", seed=1, skeleton=bvh_clip().skeleton)
