"""Telling a T-pose that was put in front of a motion from a motion that starts in one."""

from __future__ import annotations

import numpy as np
import pytest
from motion_files import BVH

from mocapdb.io.bvh import read_bvh
from mocapdb.io.tpose import count_tpose_frames, without_tpose


@pytest.fixture
def moving(tmp_path):
    (tmp_path / "clip.bvh").write_text(BVH)
    clip = read_bvh(tmp_path / "clip.bvh")
    time = np.arange(60)[:, None] / 120
    phases = np.arange(12)
    channels = 20 * np.sin(2 * np.pi * time + phases) + phases
    return clip.replace(channels=channels)


def with_frames(clip, *poses):
    return clip.replace(channels=np.concatenate([*poses, clip.channels]))


def tpose(clip):
    pose = np.zeros((1, 12))
    pose[:, :3] = clip.channels[0, :3]
    return pose


def test_inserted_pose(moving):
    clip = with_frames(moving, tpose(moving))
    assert count_tpose_frames(clip) == 1
    found = without_tpose(clip)
    assert np.array_equal(found.channels, moving.channels)
    assert "T-pose" in found.provenance[-1]


def test_repeated_pose(moving):
    clip = with_frames(moving, *[tpose(moving)] * 3)
    assert count_tpose_frames(clip) == 3


def test_full_turns_are_no_jump(moving):
    channels = moving.channels.copy()
    channels[0, 3:6] = 0.0
    channels[1:, 6:] += 360.0
    assert count_tpose_frames(moving.replace(channels=channels)) == 1
    channels[:, 3:] = moving.channels[:, 3:] * 0.001  # hardly moves, so nothing jumps
    channels[0, 3:6] = 0.0
    channels[1:, 6:] += 360.0
    assert count_tpose_frames(moving.replace(channels=channels)) == 0


def test_no_pose(moving):
    assert count_tpose_frames(moving) == 0
    assert without_tpose(moving) is moving


def test_motion_that_starts_at_rest(moving):
    """Moving out of a T-pose is motion: no jump."""
    channels = moving.channels * np.linspace(0, 1, 60)[:, None] ** 2
    assert count_tpose_frames(moving.replace(channels=channels)) == 0


def test_root_that_never_turns(moving):
    channels = np.concatenate([tpose(moving), moving.channels])
    channels[:, 3:6] = 0.0
    assert count_tpose_frames(moving.replace(channels=channels)) == 0


@pytest.mark.parametrize("frames", [1, 2])
def test_too_few_frames_to_tell(moving, frames):
    assert count_tpose_frames(with_frames(moving, tpose(moving))[:frames]) == 0


def test_still_clip(moving):
    assert count_tpose_frames(moving.replace(channels=np.zeros((5, 12)))) == 0
