import numpy as np
import pytest
from hypothesis import given
from strategies import clips

from mocapdb.errors import SkeletonError
from mocapdb.io import read_clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.representations import (
    REPRESENTATIONS,
    Representation,
    represent,
    representation_dims,
    restore_channels,
    restore_pose,
)


def rotation_distance_deg(a, b):
    """Largest angle between two stacks of rotations, exact for small angles too."""
    relative = np.swapaxes(a, -1, -2) @ b
    sine = np.linalg.norm(relative - np.swapaxes(relative, -1, -2), axis=(-2, -1)) / np.sqrt(8)
    cosine = (np.trace(relative, axis1=-2, axis2=-1) - 1) / 2
    return np.rad2deg(np.arctan2(sine, cosine)).max()


def assert_round_trip(clip, name):
    skeleton = clip.skeleton
    before = forward_kinematics(skeleton, clip.channels)
    channels = restore_channels(skeleton, represent(clip, name))
    after = forward_kinematics(skeleton, channels)
    distance_m = np.abs(after.positions - before.positions).max() * skeleton.metres_per_unit
    assert distance_m < 1e-9
    assert rotation_distance_deg(before.rotations, after.rotations) < 1e-6


@pytest.mark.parametrize("name", REPRESENTATIONS)
@given(clips())
def test_every_representation_has_an_exact_inverse(name, clip):
    if name == "scaled" and clip.skeleton.height < 1e-6:
        return
    assert_round_trip(clip, name)


@pytest.mark.parametrize("name", REPRESENTATIONS)
@pytest.mark.parametrize(
    "path",
    [
        "cmu/asfamc/05/05_11.amc",
        "cmu/asfamc/13/13_29.amc",
        "cmu/bvh/02_03.bvh",
        "cmu/bvh_daz/60_07.bvh",
        "hdm05/cut/HDM_bk_squat1Reps_013_120.amc",
    ],
)
def test_round_trips_of_real_clips(corpus, path, name):
    assert_round_trip(read_clip(corpus / path)[:600], name)


def test_cmu_has_the_dims_of_the_thesis(corpus):
    clip = read_clip(corpus / "cmu/asfamc/02/02_03.amc")
    dims = {name: represent(clip, name).values.shape[1] for name in REPRESENTATIONS}
    assert dims == {
        "channels": 62, "positions": 183, "aligned": 183, "scaled": 183, "normalised": 183
    }  # fmt: skip


@given(clips())
def test_dims_are_told_beforehand(clip):
    for name in REPRESENTATIONS:
        if name == "scaled" and clip.skeleton.height < 1e-6:
            continue
        values = represent(clip, name).values
        assert values.shape == (len(clip), representation_dims(clip.skeleton, name))


@pytest.mark.parametrize("name", ["aligned", "scaled", "normalised"])
def test_aligned_motion_forgets_where_it_was_and_where_it_went(synthetic_walk, name):
    clip = synthetic_walk
    start = clip.skeleton.channel_starts[0]
    moved = clip.channels.copy()
    moved[:, start : start + 3] += [100.0, 0.0, -50.0]
    a = represent(clip, name)
    b = represent(clip.replace(channels=moved), name)
    np.testing.assert_allclose(a.values, b.values, atol=1e-9)
    np.testing.assert_allclose(b.root - a.root, np.tile([100.0, 0.0, -50.0, 0.0], (len(clip), 1)))


def test_normalised_bones_have_one_length_for_every_body(synthetic_walk, synthetic_tall_walk):
    lengths = []
    for clip in (synthetic_walk, synthetic_tall_walk):
        skeleton = clip.skeleton
        values = represent(clip, "normalised").values[:, : 3 * skeleton.n_joints]
        positions = values.reshape(len(clip), -1, 3) * skeleton.metres_per_unit
        bones = positions[:, 1:] - positions[:, skeleton.parents[1:]]
        lengths.append(np.linalg.norm(bones, axis=2))
        assert np.ptp(lengths[-1], axis=0).max() < 1e-9
    np.testing.assert_allclose(lengths[0][0], lengths[1][0], rtol=1e-9)


def test_scaled_bodies_have_height_one(synthetic_walk):
    aligned, scaled = (represent(synthetic_walk, name).values for name in ("aligned", "scaled"))
    np.testing.assert_allclose(scaled * synthetic_walk.skeleton.height, aligned)


def test_values_of_nothing_but_zeros_still_make_a_pose(synthetic_walk):
    skeleton = synthetic_walk.skeleton
    values = np.zeros((3, representation_dims(skeleton, "aligned")))
    pose = restore_pose(skeleton, Representation("aligned", values, np.zeros((3, 4)), skeleton))
    identity = np.swapaxes(pose.rotations, -1, -2) @ pose.rotations
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-12)


def test_an_unknown_representation_is_told(synthetic_walk):
    with pytest.raises(SkeletonError, match=r"channels, positions, aligned.*got 'quaternions'"):
        represent(synthetic_walk, "quaternions")


def test_channels_are_a_copy_of_the_clips():
    from mocapdb.corpus import synthetic

    clip = synthetic.make_clip("walk", seed=1, duration_s=1)
    before = clip.channels.copy()
    clip.represent("channels").values[:] = 0.0
    np.testing.assert_array_equal(clip.channels, before)
