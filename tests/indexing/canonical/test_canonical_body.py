"""The canonical body: what maps to it, and that conversions of a clip agree on it."""

from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest

from mocapdb import read_clip
from mocapdb.corpus import synthetic
from mocapdb.errors import SkeletonError
from mocapdb.indexing.canonical.canonical_body import (
    JOINTS,
    LENGTHS_M,
    MIRRORED,
    PARENTS,
    find_bones,
)
from mocapdb.indexing.canonical.canonical_motion import FPS, canonical_motion
from mocapdb.io.conventions import to_acclaim_convention, to_bvh_convention
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton


def anonymous(clip):
    names = [f"joint{i}" for i in range(clip.skeleton.n_joints)]
    return Clip(replace(clip.skeleton, names=names), clip.channels, clip.fps)


def mean_distance_m(a, b):
    n = min(len(a), len(b))
    return float(np.linalg.norm(a.pose[:n] - b.pose[:n], axis=2).mean())


def test_the_body_is_a_tree_with_two_sides():
    assert (np.arange(len(JOINTS)) > PARENTS).all()
    assert (MIRRORED[MIRRORED] == np.arange(len(JOINTS))).all()
    assert JOINTS[MIRRORED[JOINTS.index("left_knee")]] == "right_knee"
    assert MIRRORED[JOINTS.index("head")] == JOINTS.index("head")
    np.testing.assert_allclose(LENGTHS_M, LENGTHS_M[MIRRORED])


def test_poses_have_the_body_s_bones_and_look_ahead(synthetic_walk):
    motion = canonical_motion(synthetic_walk)
    bones = np.linalg.norm(motion.pose - motion.pose[:, PARENTS], axis=2)[:, 1:]
    np.testing.assert_allclose(bones, np.tile(LENGTHS_M[1:], (len(motion), 1)), atol=2e-3)
    left, right = (motion.pose[:, JOINTS.index(f"{side}_hip")] for side in ("left", "right"))
    assert np.abs((left - right)[:, 2]).max() < 0.01
    assert (left[:, 0] > right[:, 0]).all()
    ankle, toe = (JOINTS.index(f"left_{joint}") for joint in ("ankle", "toe"))
    assert np.median(motion.pose[:, toe, 2] - motion.pose[:, ankle, 2]) > 0.05
    assert motion.fps == FPS
    assert len(motion) == pytest.approx(synthetic_walk.duration_s * FPS, abs=1)


def test_size_place_and_heading_do_not_count():
    clip = synthetic.make_clip("walk", seed=3)
    turned = canonical_motion(synthetic.make_clip("walk", seed=3, heading_deg=130.0))
    bigger = replace(clip.skeleton, offsets=1.3 * clip.skeleton.offsets)
    channels = clip.channels.copy()
    channels[:, :3] *= 1.3
    grown = canonical_motion(Clip(bigger, channels, clip.fps))
    expected = canonical_motion(clip)
    assert mean_distance_m(expected, turned) < 1e-6
    assert mean_distance_m(expected, grown) < 1e-6
    np.testing.assert_allclose(grown.root, expected.root, atol=1e-6)
    turn_deg = np.rad2deg(turned.yaw - expected.yaw)
    np.testing.assert_allclose(np.cos(np.deg2rad(turn_deg - 130)), 1, atol=1e-6)


def test_both_conventions_agree(synthetic_walk):
    expected = canonical_motion(synthetic_walk)
    as_bvh = to_bvh_convention(synthetic_walk)
    assert find_bones(as_bvh.skeleton).evidence == "joints by names"
    for clip in (as_bvh, to_acclaim_convention(as_bvh)):
        found = canonical_motion(clip)
        assert mean_distance_m(expected, found) < 1e-6
        np.testing.assert_allclose(found.root, expected.root, atol=1e-6)
        np.testing.assert_allclose(found.yaw, expected.yaw, atol=1e-6)


def test_unknown_names_are_mapped_by_shape(synthetic_walk):
    for clip in (synthetic_walk, to_bvh_convention(synthetic_walk)):
        unknown = anonymous(clip)
        assert find_bones(unknown.skeleton, clip.channels).evidence == "joints by shape"
        assert mean_distance_m(canonical_motion(clip), canonical_motion(unknown)) < 0.05


@pytest.mark.parametrize("convention", ["bones along x", "under a scene", "displacements"])
def test_conventions_of_exporters_give_the_same_motion(convention):
    plain = made.make_walk()
    body = {
        "bones along x": made.along_x,
        "under a scene": made.under_scene,
        "displacements": lambda body: made.with_positions(body, "displacements"),
    }[convention](plain)
    skeleton = replace(body.skeleton, displaces=convention == "displacements")
    expected, found = (
        canonical_motion(Clip(each, channels, 30.0), None)
        for each, channels in ((plain.skeleton, plain.channels), (skeleton, body.channels))
    )
    np.testing.assert_allclose(found.pose, expected.pose, atol=1e-9)
    np.testing.assert_allclose(found.root, expected.root, atol=1e-9)


def test_a_foot_without_an_end_ends_in_its_ankle():
    body = made.without(made.make_walk(), "left_toe", "right_toe")
    ends = [j for j, role in enumerate(body.roles) if role.endswith("_toe")]
    offsets = body.skeleton.offsets.copy()
    offsets[ends] = 0.0
    clip = Clip(replace(body.skeleton, offsets=offsets), body.channels, 30.0)
    pose = canonical_motion(clip, None).pose
    ankle, toe = (JOINTS.index(f"left_{joint}") for joint in ("ankle", "toe"))
    np.testing.assert_allclose(pose[:, toe], pose[:, ankle], atol=1e-6)


def test_mirroring_twice_is_nothing(synthetic_walk):
    motion = canonical_motion(synthetic_walk)
    mirrored = motion.mirrored()
    assert mean_distance_m(motion, mirrored) > 0.01
    again = mirrored.mirrored()
    np.testing.assert_allclose(again.pose, motion.pose)
    np.testing.assert_allclose(again.yaw, motion.yaw)


def test_resampling_keeps_time_and_changes_speed(synthetic_walk):
    motion = canonical_motion(synthetic_walk, None)
    assert len(motion) == len(synthetic_walk)
    fast = motion.resampled(motion.fps, 2.0)
    np.testing.assert_allclose(fast.pose, motion.pose[::2][: len(fast)], atol=1e-9)
    assert len(canonical_motion(synthetic_walk[:1])) == 1


STICK = {
    "convention": "bvh",
    "name": "thing",
}


@pytest.mark.parametrize(
    ("parents", "offsets", "reason"),
    [
        ([-1], [[0, 0, 0]], "0 pair"),
        ([-1, 0, 1, 2], [[0, 0, 0], [0, 1, 0], [0, 1, 0], [0, 1, 0]], "0 pair"),
        ([-1, 0, 0], [[0, 0, 0], [1, -1, 0], [-1, -1, 0]], "0 pair"),
        (
            [-1, 0, 1, 2, 0, 4, 5],
            [[0, 0, 0], [0.1, 0, 0], [0, -0.4, 0], [0, -0.4, 0], [-0.1, 0, 0], [0, -0.4, 0],
             [0, -0.4, 0]],
            "1 pair",
        ),
    ],
)  # fmt: skip
def test_what_is_no_body_is_told_so(parents, offsets, reason):
    n = len(parents)
    dofs = [("tx", "ty", "tz", "rz", "ry", "rx"), *[("rz", "ry", "rx")] * (n - 1)]
    skeleton = Skeleton([f"j{i}" for i in range(n)], parents, offsets, dofs, ["ZYX"] * n, **STICK)
    with pytest.raises(SkeletonError, match=rf"Cannot map skeleton 'thing'.*{reason}"):
        find_bones(skeleton)


class TestRealClips:
    @pytest.mark.parametrize("name", ["02_01", "07_04", "05_11", "49_08"])
    def test_the_motionbuilder_conversion_agrees_with_the_original(self, corpus, name):
        original = read_clip(corpus / "cmu" / "asfamc" / name[:2] / f"{name}.amc")
        converted = read_clip(corpus / "cmu" / "bvh" / f"{name}.bvh", drop_tpose=True)
        for clip in (original, converted):
            assert find_bones(clip.skeleton, clip.channels).evidence == "joints by names"
        a, b = canonical_motion(original, None), canonical_motion(converted, None)
        assert len(a) == len(b)
        assert np.linalg.norm(a.pose - b.pose, axis=2).max() < 1e-4
        np.testing.assert_allclose(a.root, b.root, atol=1e-4)

    def test_the_daz_conversion_is_near_the_original(self, corpus):
        original = read_clip(corpus / "cmu" / "asfamc" / "13" / "13_30.amc")
        converted = read_clip(corpus / "cmu" / "bvh_daz" / "13_30.bvh", drop_tpose=True)
        assert mean_distance_m(*map(canonical_motion, (original, converted))) < 0.08

    @pytest.mark.parametrize(
        "pattern", ["hdm05/cut/HDM_bk_sq*", "cmu/bvh/02_*", "cmu/bvh_daz/13_*"]
    )
    def test_hierarchy_and_names_agree(self, corpus, pattern):
        path = sorted(corpus.glob(pattern))[0]
        skeleton = corpus / "hdm05" / "HDM_bk.asf" if path.suffix == ".amc" else None
        clip = read_clip(path, skeleton=skeleton, drop_tpose=True)
        known, guessed = canonical_motion(clip), canonical_motion(anonymous(clip))
        assert mean_distance_m(known, guessed) < 0.03
