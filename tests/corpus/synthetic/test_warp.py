"""Warped clips show the frames that the curve says."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_channels import best_lag, channel

from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.7, 2.0])
def test_warp_by_a_factor(factor: float) -> None:
    clip, truth = synthetic.make("walk", seed=1)
    warped, frames = synthetic.warp(clip, factor)
    assert len(warped) == len(frames) == int((len(clip) - 1) / factor) + 1
    assert frames[1] - frames[0] == pytest.approx(factor)
    whole = frames == np.rint(frames)
    np.testing.assert_array_equal(warped.channels[whole], clip.channels[frames[whole].astype(int)])
    angles = warped.channels[:, warped.skeleton.rotation_channels]
    period = truth.period_frames / factor
    assert best_lag(angles, round(1.5 * period)) == pytest.approx(period, abs=1.0)


def test_warp_by_a_curve_carries_the_phase() -> None:
    clip, truth = synthetic.make("run", seed=1)
    curve = synthetic.tempo_curve(len(clip), seed=4, strength=0.4)
    assert curve[0] == 0
    assert curve[-1] == pytest.approx(len(clip) - 1)
    speeds = np.diff(curve)
    assert 0.4 < speeds.min() < 0.9
    assert 1.1 < speeds.max() < 1.8
    warped, frames = synthetic.warp(clip, curve)
    phase = np.interp(frames, np.arange(len(clip)), truth.phase)
    knee = np.interp(phase, truth.phase, channel(clip, "ltibia.rx"))
    np.testing.assert_allclose(channel(warped, "ltibia.rx"), knee, atol=0.3)


def test_curve_of_no_strength_is_straight() -> None:
    np.testing.assert_allclose(synthetic.tempo_curve(50, seed=1, strength=0.0), np.arange(50))
    assert len(synthetic.tempo_curve(1, seed=1)) == 1


def test_warp_of_one_frame() -> None:
    still = synthetic.make_clip("walk", seed=1)[:1]
    warped, frames = synthetic.warp(still, 2.0)
    assert len(warped) == 1
    assert frames.tolist() == [0.0]


@pytest.mark.parametrize(
    "speed", [0.0, -1.0, np.nan, [0.0, 2.0, 1.0], [0.0, 1e6], [-1.0, 2.0], [], [[0.0]]]
)
def test_impossible_warps_are_refused(speed: object) -> None:
    clip = synthetic.make_clip("walk", seed=1, duration_s=0.5)
    with pytest.raises(ClipError, match="Expected"):
        synthetic.warp(clip, speed)  # type: ignore[arg-type]


@pytest.mark.parametrize("strength", [-0.1, 1.0, np.nan])
def test_impossible_curves_are_refused(strength: float) -> None:
    with pytest.raises(ClipError, match="strength"):
        synthetic.tempo_curve(10, seed=0, strength=strength)
