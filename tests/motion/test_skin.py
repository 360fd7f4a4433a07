import numpy as np
import pytest
from hypothesis import given
from strategies import clips

from mocapdb.errors import ClipError
from mocapdb.motion import skin
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import (
    BELT_RADIUS_M,
    motion_error,
    shell_error,
    skin_vertices,
    skinned_error,
)


def shifted(clip, by):
    channels = clip.channels.copy()
    channels[:, :3] += by
    return clip.replace(channels=channels)


@given(clips())
def test_the_error_equals_the_distance_of_the_vertices(clip):
    skeleton = clip.skeleton
    rng = np.random.default_rng(0)
    other = clip.replace(channels=clip.channels + rng.normal(size=clip.channels.shape))
    a, b = (
        skin_vertices(skeleton, forward_kinematics(skeleton, c.channels)) for c in (clip, other)
    )
    distances = np.linalg.norm(a - b, axis=2)
    error = motion_error(clip, other)
    assert error.skinned == pytest.approx(np.linalg.norm(distances, axis=1).mean(), abs=1e-9)
    if distances.size:
        millimetres = distances * skeleton.metres_per_unit * 1000
        assert error.vertices.mean == pytest.approx(millimetres.mean(), abs=1e-6)
        assert error.vertices.p95 == pytest.approx(np.percentile(millimetres, 95), abs=1e-6)
        assert error.vertices.max == pytest.approx(millimetres.max(), abs=1e-6)


def test_cmu_has_540_values_a_frame(synthetic_walk):
    skeleton = synthetic_walk.skeleton
    pose = forward_kinematics(skeleton, synthetic_walk.channels)
    assert skin_vertices(skeleton, pose)[0].size == 540


def test_a_shift_moves_every_vertex_alike(synthetic_walk):
    shift = np.array([3.0, 4.0, 0.0])
    error = motion_error(synthetic_walk, shifted(synthetic_walk, shift))
    assert error.skinned == pytest.approx(np.sqrt(180) * 5.0)
    millimetres = 5.0 * synthetic_walk.skeleton.metres_per_unit * 1000
    for figure in (error.vertices.mean, error.vertices.p95, error.vertices.max):
        assert figure == pytest.approx(millimetres)
    assert shell_error(synthetic_walk, shifted(synthetic_walk, shift)).max == pytest.approx(
        millimetres
    )


def test_a_twist_of_a_bone_moves_its_belt_only():
    skeleton = Skeleton(
        ["root", "bone"], [-1, 0], [[0, 0, 0], [0, 1, 0]], [(), ("ry",)], ["", "Y"],
        convention="acclaim", metres_per_unit=1.0,
    )  # fmt: skip
    still = Clip(skeleton, np.zeros((4, 1)), 30.0)
    twisted = still.replace(channels=np.full((4, 1), 180.0))
    error = motion_error(still, twisted)
    # four of six vertices go to the other side of the belt
    assert error.vertices.max == pytest.approx(2000 * BELT_RADIUS_M)
    assert error.vertices.mean == pytest.approx(2000 * BELT_RADIUS_M * 4 / 6)
    assert error.skinned == pytest.approx(np.sqrt(4) * 2 * BELT_RADIUS_M)
    # the shell sees it 3 cm from the joint, on two axes of three
    assert shell_error(still, twisted).max == pytest.approx(60.0)


@given(clips())
def test_no_change_is_no_error(clip):
    assert skinned_error(clip, clip) == 0.0
    assert shell_error(clip, clip).max == 0.0


def test_clips_that_do_not_fit_are_told(synthetic_walk, synthetic_tall_walk):
    with pytest.raises(ClipError, match=r"one length.*600 frames and .* has 5"):
        motion_error(synthetic_walk, synthetic_walk[:5])
    with pytest.raises(ClipError, match="one skeleton"):
        shell_error(synthetic_walk, synthetic_tall_walk)


def test_a_long_motion_is_measured_in_parts(synthetic_walk, monkeypatch):
    other = synthetic_walk.replace(channels=synthetic_walk.channels + 0.5)
    whole = motion_error(synthetic_walk, other)
    monkeypatch.setattr(skin, "CHUNK_FRAMES", 37)
    parts = motion_error(synthetic_walk, other)
    assert parts.skinned == pytest.approx(whole.skinned)
    assert parts.vertices.mean == pytest.approx(whole.vertices.mean)
    assert parts.vertices.max == whole.vertices.max
    assert parts.vertices.p95 == pytest.approx(whole.vertices.p95, rel=0.1)


@pytest.mark.parametrize(("n_frames", "sees_odd_frames"), [(4000, True), (4001, False)])
def test_the_percentile_of_more_than_4000_frames_is_of_every_second(n_frames, sees_odd_frames):
    stick = Skeleton(
        names=("root", "end"),
        parents=np.array([-1, 0]),
        offsets=np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        dofs=(("tx", "ty", "tz"), ()),
        rotation_orders=("", ""),
        axis_deg=np.zeros((2, 3)),
        convention="acclaim",
        metres_per_unit=1.0,
        up="y",
    )
    still = np.zeros((n_frames, 3))
    moved = still.copy()
    moved[1::2, 0] = 1.0
    error = skin.channels_error(stick, still, moved).vertices
    assert error.mean > 0
    assert (error.p95 > 0) == sees_odd_frames


def test_channels_may_be_computed_when_they_are_asked_for(synthetic_walk, monkeypatch):
    asked = []

    class Source:
        def __getitem__(self, frames):
            asked.append(len(range(*frames.indices(len(synthetic_walk)))))
            return synthetic_walk.channels[frames] + 0.5

    monkeypatch.setattr(skin, "CHUNK_FRAMES", 37)
    skeleton, channels = synthetic_walk.skeleton, synthetic_walk.channels
    expected = skin.channels_error(skeleton, channels, channels + 0.5)
    assert skin.channels_error(skeleton, channels, Source()) == expected
    assert max(asked) <= 37
