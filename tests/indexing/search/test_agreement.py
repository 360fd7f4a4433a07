"""Which joints and which moments of a hit are like the query."""

from dataclasses import replace

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.indexing import FeatureSpace, canonical_motion
from mocapdb.indexing.canonical.canonical_body import JOINTS
from mocapdb.indexing.search.agreement import agreement_of, whole_path

WALK, HOP = (
    canonical_motion(synthetic.make_clip(kind, seed=3, duration_s=3)) for kind in ("walk", "hop")
)
SPACE = FeatureSpace.fit([WALK, HOP])
WRIST = JOINTS.index("left_wrist")


def raised(motion, frames, metres=0.5):
    """The motion with its left wrist higher for some frames."""
    pose = motion.pose.copy()
    pose[frames, WRIST, 1] += metres
    return replace(motion, pose=pose)


def test_the_joint_and_the_moment_that_differ_are_told():
    path = np.arange(10, 58)
    query = replace(WALK, pose=WALK.pose[10:58])
    found = agreement_of(query, raised(WALK, slice(34, 46)), path, SPACE)
    joints, moments = found.of_joints(), found.of_moments()
    assert max(joints, key=joints.get) == "left_wrist"
    assert joints["left_wrist"][1] == pytest.approx(0.5 * 12 / 48)
    assert sum(apart for _, apart in joints.values()) == pytest.approx(joints["left_wrist"][1])
    np.testing.assert_array_equal(np.flatnonzero(moments > 1e-9), np.arange(24, 36))
    assert list(found.of_parts())[-1] == "left-arm"
    assert found.query_s[-1] == pytest.approx(47 / 24)
    assert found.clip_s[0] == pytest.approx(10 / 24)


def test_only_joints_that_counted_are_told():
    path = np.arange(len(WALK))
    arm = ("left_shoulder", "left_elbow", "left_wrist")
    moved = WALK.pose.copy()
    moved[:, 1:] += [0.3, 0.0, 0.0]  # all of the upper body leans, the chest too
    found = agreement_of(WALK, replace(WALK, pose=moved), path, SPACE, joints=arm)
    assert found.joints == arm
    assert list(found.of_parts()) == ["left-arm"]
    assert found.apart_m.max() < 1e-9
    assert agreement_of(WALK, replace(WALK, pose=moved), path, SPACE).apart_m.min() > 0.29


def test_motion_taken_at_random_is_one_apart():
    both = np.concatenate([WALK.pose, HOP.pose])
    rng = np.random.default_rng(0)
    first, second = (replace(WALK, pose=both[rng.permutation(len(both))]) for _ in range(2))
    shares = agreement_of(first, second, np.arange(len(both)), SPACE).of_joints().values()
    assert 0.6 < np.mean([share for share, _ in shares]) <= 1.05


def test_whole_clips_are_matched_from_end_to_end():
    slow = WALK.resampled(24, 0.75)
    path = whole_path(WALK, slow)
    assert (path[0], path[-1]) == (0, len(slow) - 1)
    assert np.all(np.diff(path) >= 0)
    apart = agreement_of(WALK, slow, path, SPACE).apart_m
    assert apart.mean() < 0.03
