"""Bases: when a clip gets axes of its own, and which bases are of no use."""

import numpy as np
import pytest

from mocapdb.compression import Target, fit_basis
from mocapdb.compression.pose import class_basis, pose_codec
from mocapdb.compression.pose.smooth_channels import SmoothChannels
from mocapdb.corpus import synthetic

WALK = synthetic.make_clip("walk", seed=1, duration_s=1.0)


@pytest.mark.parametrize(("n_frames", "tried"), [(5_900, [False]), (6_100, [False, True])])
def test_only_long_clips_try_axes_of_their_own(monkeypatch, n_frames, tried):
    """The axes take 2 to 3 kB: `auto` does not try them below 6,000 frames."""
    had_basis = []

    class Search:
        def __init__(self, clip, target, modes, *, basis, feedback, motion):
            had_basis.append(basis is not None)

        def run(self, *, basis_is_shared):
            return None

    monkeypatch.setattr(pose_codec, "TargetSearch", Search)
    channels = np.tile(WALK.channels, (-(-n_frames // len(WALK)), 1))[:n_frames]
    clip = WALK.replace(channels=channels)
    pose_codec.compress(clip, Target("mean_mm", 1.0), b"", decorrelation="auto")
    assert had_basis == tried


@pytest.mark.parametrize(("condition", "is_used"), [(0.9e7, True), (1.2e7, False)])
def test_a_basis_whose_axes_are_nearly_alike_is_not_used(monkeypatch, condition, is_used):
    monkeypatch.setattr(class_basis.np.linalg, "cond", lambda matrix: condition)
    assert (fit_basis([SmoothChannels(WALK)]) is not None) is is_used


def test_the_metric_of_a_basis_is_averaged_over_some_frames_of_each_clip(monkeypatch):
    """64 at the most, evenly spread."""
    asked = []
    find = class_basis.metric_factors

    def noting(skeleton, values, pose, points):
        asked.append(len(values))
        return find(skeleton, values, pose, points)

    monkeypatch.setattr(class_basis, "metric_factors", noting)
    assert fit_basis([SmoothChannels(WALK[:n]) for n in (64, 65, 120)]) is not None
    assert asked == [64, 33, 60]
