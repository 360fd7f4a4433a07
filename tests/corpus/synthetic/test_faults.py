"""Faults are where and as large as they say, and nothing else is touched."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_channels import bvh_clip

from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.motion.clip import Clip


def rotation_angle_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """By the chord, which keeps its digits where the angle is small."""
    chord = np.linalg.norm(a - b, axis=(1, 2)) / np.sqrt(8)
    return np.rad2deg(2 * np.arcsin(np.clip(chord, 0, 1)))


FAULT_KINDS = ("offset", "flip", "noise", "freeze", "drift")


def faulty_clips() -> list[Clip]:
    return [synthetic.make_clip("walk", seed=1), bvh_clip()]


@pytest.mark.parametrize("clip", faulty_clips(), ids=["acclaim", "bvh"])
@pytest.mark.parametrize("kind", FAULT_KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_fault_is_as_large_as_it_says(clip: Clip, kind: str, seed: int) -> None:
    faulty, _, faults = synthetic.inject_faults(clip, seed=seed, kinds=[kind], n=6)  # type: ignore[list-item]
    assert len(faults) == 6
    for fault in faults:
        span = slice(fault.start, fault.end)
        wrong, right = (synthetic.joint_rotations(c, fault.joint)[span] for c in (faulty, clip))
        angles = rotation_angle_deg(wrong, right)
        assert angles.max() == pytest.approx(fault.size_deg, abs=1e-5)
        if kind in ("offset", "flip"):
            np.testing.assert_allclose(angles, fault.size_deg, atol=1e-5)
        elif kind == "drift":
            share = np.arange(1, len(angles) + 1) / len(angles)
            np.testing.assert_allclose(angles, fault.size_deg * share, atol=1e-5)
        elif kind == "noise":
            assert angles.min() > 0
        else:
            assert np.ptp(wrong, axis=0).max() < 1e-12


@given(seed=st.integers(0, 2**31), n=st.integers(0, 25))
@settings(max_examples=20, deadline=None)
def test_nothing_else_is_touched(seed: int, n: int) -> None:
    for clip in faulty_clips():
        faulty, mask, faults = synthetic.inject_faults(clip, seed=seed, n=min(n, 8))
        assert mask.shape == (len(clip), clip.skeleton.n_joints)
        rebuilt = np.zeros_like(mask)
        allowed = np.zeros(clip.channels.shape, dtype=bool)
        starts = clip.skeleton.channel_starts
        for joint, start, end, _, _ in faults:
            assert not rebuilt[start - 1 : end + 1, joint].any()
            rebuilt[start:end, joint] = True
            allowed[start:end, starts[joint] : starts[joint + 1]] = True
        np.testing.assert_array_equal(mask, rebuilt)
        changed = faulty.channels != clip.channels
        assert not changed[~allowed].any()
        translations = np.ones(clip.skeleton.n_channels, dtype=bool)
        translations[clip.skeleton.rotation_channels] = False
        assert not changed[:, translations].any()
        assert [fault.start for fault in faults] == sorted(fault.start for fault in faults)


def test_faults_are_repeatable() -> None:
    clip = faulty_clips()[0]
    first, again, other = (
        synthetic.inject_faults(clip, seed=seed, n=7).clip.channels for seed in (1, 1, 2)
    )
    assert first.tobytes() == again.tobytes()
    assert first.tobytes() != other.tobytes()


def test_fault_options() -> None:
    clip = faulty_clips()[0]
    knee = clip.skeleton.joint("ltibia")
    _, mask, faults = synthetic.inject_faults(
        clip, seed=1, kinds=("offset", "drift"), size_deg=30.0, length_s=0.25, n=4, joints=[knee]
    )
    assert {fault.joint for fault in faults} == {knee}
    assert {fault.size_deg for fault in faults} == {30.0}
    assert {fault.end - fault.start for fault in faults} == {30}
    assert sorted(fault.kind for fault in faults) == ["drift", "drift", "offset", "offset"]
    assert mask.sum() == 120


def test_root_is_left_alone_unless_asked_for() -> None:
    clip = faulty_clips()[0]
    _, mask, _ = synthetic.inject_faults(clip, seed=1, n=30, length_s=0.1)
    assert not mask[:, 0].any()
    _, mask, _ = synthetic.inject_faults(clip, seed=1, n=1, joints=[0])
    assert mask[:, 0].any()


def test_frozen_joints_would_have_moved() -> None:
    clip = faulty_clips()[0]
    _, _, faults = synthetic.inject_faults(clip, seed=1, kinds=["freeze"], n=6, length_s=0.3)
    assert all(fault.size_deg > 3.0 for fault in faults)


@pytest.mark.parametrize(
    "bad",
    [
        {"kinds": ["wobble"]},
        {"kinds": []},
        {"size_deg": 0.0},
        {"size_deg": 200.0},
        {"size_deg": (40.0, 20.0)},
        {"size_deg": np.nan},
        {"length_s": -1.0},
        {"length_s": np.inf},
        {"length_s": 60.0},
        {"n": 200, "joints": [3], "length_s": 1.0},
    ],
)
def test_impossible_faults_are_refused(bad: dict[str, object]) -> None:
    with pytest.raises(ClipError, match="Expected"):
        synthetic.inject_faults(faulty_clips()[0], seed=1, **bad)  # type: ignore[arg-type]


@pytest.mark.parametrize("joints", [[], [1]])
def test_joints_that_cannot_turn_are_refused(joints: list[int]) -> None:
    with pytest.raises(SkeletonError, match="rotation channels"):
        synthetic.inject_faults(faulty_clips()[0], seed=1, joints=joints)
