import json
from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest
from hypothesis import given
from strategies import clips, skeletons

from mocapdb.errors import ClipError, SkeletonError
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton

GOOD = {
    "names": ["root", "bone"],
    "parents": [-1, 0],
    "offsets": [[0, 0, 0], [0, 1, 0]],
    "dofs": [("tx", "ty", "tz"), ("rx", "rz")],
    "rotation_orders": ["", "ZX"],
    "convention": "acclaim",
}


@pytest.fixture
def skeleton():
    return Skeleton(**GOOD)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"names": [], "parents": [], "offsets": [], "dofs": [], "rotation_orders": []},
            "one joint",
        ),
        ({"names": ["root", "root"]}, "'root' twice"),
        ({"parents": [-1, 1]}, "parent of 'bone' to come before it"),
        ({"parents": [-1, -1]}, "joint 0, and no other"),
        ({"parents": [0, 0]}, "joint 0, and no other"),
        ({"parents": [-1]}, r"parents to have shape \(2,\)"),
        ({"offsets": [[0, 0, 0]]}, r"offsets to have shape \(2, 3\)"),
        ({"offsets": [[0, 0, 0], [0, np.nan, 0]]}, "finite offsets"),
        ({"dofs": [("tx",)]}, "dofs and rotation_orders for 2 joints"),
        ({"dofs": [("tx",), ("rx", "rx")]}, "freedom of 'bone' to be different"),
        ({"dofs": [("tx",), ("rx", "qq")]}, "rx qq"),
        ({"rotation_orders": ["", "XY"]}, "order of 'bone'.*'XY'"),
        ({"convention": "fbx"}, "'acclaim' or 'bvh'.*'fbx'"),
        ({"up": "x"}, "'y' or 'z'.*'x'"),
        ({"metres_per_unit": 0}, "metres_per_unit to be positive"),
        ({"metres_per_unit": np.inf}, "metres_per_unit to be positive"),
    ],
)
def test_a_skeleton_that_does_not_fit_together_is_told(change, message):
    with pytest.raises(SkeletonError, match=message):
        Skeleton(**(GOOD | change))


@given(skeletons())
def test_a_skeleton_goes_through_json(skeleton):
    again = Skeleton.from_dict(json.loads(json.dumps(skeleton.to_dict())))
    assert again == skeleton
    assert hash(again) == hash(skeleton)


def test_broken_json_is_told(skeleton):
    fields = skeleton.to_dict()
    del fields["parents"]
    with pytest.raises(SkeletonError, match="parents"):
        Skeleton.from_dict(fields)


def test_skeletons_are_equal_by_value_whatever_their_name(skeleton):
    assert skeleton.renamed("other") == skeleton
    assert Skeleton(**(GOOD | {"metres_per_unit": 2.0})) != skeleton


def test_a_skeleton_knows_its_channels(skeleton):
    assert skeleton.n_channels == 5
    assert skeleton.channel_names == ("root.tx", "root.ty", "root.tz", "bone.rx", "bone.rz")
    assert skeleton.rotation_channels.tolist() == [3, 4]
    assert skeleton.children == ((1,), ())
    with pytest.raises(SkeletonError, match=r"got 'tail'. It has: root, bone"):
        skeleton.joint("tail")


def test_a_skeleton_cannot_be_changed(skeleton):
    with pytest.raises(AttributeError):
        skeleton.up = "z"
    with pytest.raises(ValueError, match="read-only"):
        skeleton.offsets[0, 0] = 1.0


@pytest.mark.parametrize(
    ("channels", "fps", "message"),
    [
        (np.zeros((3, 4)), 30, r"shape \(frames, 5\)"),
        (np.zeros(5), 30, r"shape \(frames, 5\)"),
        (np.zeros((0, 5)), 30, "at least one frame"),
        (np.zeros((3, 5)), 0, "positive frame rate"),
        (np.zeros((3, 5)), np.nan, "positive frame rate"),
        (np.zeros((3, 5)), "30", "positive frame rate, but got '30'"),
        (np.where(np.arange(15).reshape(3, 5) == 8, np.nan, 0.0), 30, "frame 1.*nan in bone.rx"),
    ],
)
def test_a_clip_that_does_not_fit_its_skeleton_is_told(skeleton, channels, fps, message):
    with pytest.raises(ClipError, match=message):
        Clip(skeleton, channels, fps)


@given(clips())
def test_slices_are_clips_of_their_own(clip):
    half = clip[: (len(clip) + 1) // 2]
    assert np.array_equal(half.channels, clip.channels[: len(half)])
    assert half.duration_s == pytest.approx(len(half) / clip.fps)
    assert clip[:] == clip


@pytest.mark.parametrize("frames", [slice(5, 5), slice(9, 2), slice(0, 6, 2), slice(100, 200), 3])
def test_empty_and_stepped_ranges_are_told(skeleton, frames):
    clip = Clip(skeleton, np.zeros((6, 5)), 30)
    with pytest.raises(ClipError, match="Expected a range"):
        clip[frames]


def test_a_clip_keeps_its_own_copy(skeleton):
    channels = np.zeros((6, 5))
    clip = Clip(skeleton, channels, 30)
    channels[0, 0] = 9.0
    assert clip.channels[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        clip.channels[0, 0] = 1.0


def test_replacing_notes_the_step(skeleton):
    clip = Clip(skeleton, np.zeros((6, 5)), 30, frame_time_text="0.0333")
    slower = clip.replace(fps=15, step="slowed")
    assert slower.provenance == ("slowed",)
    assert (slower.fps_source, slower.frame_time_text) == ("caller", "")
    assert clip != slower
    assert "6 frames x 5 channels" in repr(clip)


def test_a_body_is_about_as_high_in_either_convention(synthetic_walk):
    from mocapdb.io.conventions import to_bvh_convention

    skeleton = synthetic_walk.skeleton
    other = to_bvh_convention(synthetic_walk).skeleton
    assert skeleton.height * skeleton.metres_per_unit == pytest.approx(1.75, abs=0.01)
    assert other.height * other.metres_per_unit == pytest.approx(1.75, abs=0.15)


def test_a_rest_pose_that_does_not_stand_tells_the_height_by_its_bones():
    plain = made.make_walk()
    standing = plain.skeleton.height
    assert standing == pytest.approx(np.ptp(plain.skeleton.rest_positions[:, 1]))
    for body in (made.along_x(plain), made.under_scene(made.along_x(plain))):
        assert body.skeleton.height == pytest.approx(standing, rel=0.05)
    lying = replace(plain.skeleton, up="z")
    assert lying.height == pytest.approx(standing, rel=0.05)
