"""What a clip offers to those who program: read in any units, edited, as a table, as a picture."""

from __future__ import annotations

import builtins

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation
from strategies import clips

from mocapdb.corpus import synthetic
from mocapdb.errors import ClipError, MissingExtraError, MocapdbError, SkeletonError
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.body.joint_names import across_by_names
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics, to_metres


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=1, duration_s=1.0)


@pytest.fixture(scope="module")
def bvh_walk(walk):
    return to_bvh_convention(walk)


# -- reading ---------------------------------------------------------------------------------------


@given(clips())
def test_positions_are_those_of_kinematics(clip):
    positions = forward_kinematics(clip.skeleton, clip.channels).positions
    assert np.allclose(clip.positions(), to_metres(clip.skeleton, positions))
    assert np.array_equal(clip.positions("file", "file"), positions)
    assert np.allclose(clip.positions("cm"), 100 * clip.positions())
    y, z = clip.positions(up="y"), clip.positions(up="z")
    assert np.allclose(y, np.stack([z[..., 0], z[..., 2], -z[..., 1]], axis=-1))


@given(clips())
def test_rotations_are_those_of_kinematics(clip):
    world = forward_kinematics(clip.skeleton, clip.channels).rotations
    assert np.allclose(clip.rotations("global", "matrix", "file"), world, atol=1e-9)
    local = clip.rotations("local", "matrix", "file")
    for joint, parent in enumerate(clip.skeleton.parents):
        above = world[:, parent] if parent >= 0 else np.eye(3)
        assert np.allclose(above @ local[:, joint], world[:, joint], atol=1e-9)


def test_rotations_turn_the_bones_also_where_another_axis_is_up(bvh_walk):
    for up in ("y", "z"):
        offsets = bvh_walk.skeleton.offsets * bvh_walk.skeleton.metres_per_unit
        if up == "z":
            offsets = np.stack([offsets[:, 0], -offsets[:, 2], offsets[:, 1]], axis=-1)
        world, at = bvh_walk.rotations("global", "matrix", up), bvh_walk.positions(up=up)
        for joint, parent in enumerate(bvh_walk.skeleton.parents[1:], start=1):
            assert np.allclose(at[:, parent] + world[:, parent] @ offsets[joint], at[:, joint])


def test_rotations_come_in_every_form(walk):
    quats = walk.rotations()
    flat = Rotation.from_quat(quats.reshape(-1, 4))
    assert (walk.rotations(form="scipy").inv() * flat).magnitude().max() < 1e-7
    assert np.allclose(walk.rotations(form="quat_wxyz"), quats[..., [3, 0, 1, 2]])
    matrices = walk.rotations(form="matrix")
    assert np.allclose(matrices.reshape(-1, 3, 3), flat.as_matrix())
    six = walk.rotations(form="6d")
    assert np.allclose(six[..., :3], matrices[..., 0])
    assert np.allclose(six[..., 3:], matrices[..., 1])
    again = Rotation.from_rotvec(walk.rotations(form="rotvec").reshape(-1, 3))
    assert (again.inv() * flat).magnitude().max() < 1e-7
    assert (np.sum(quats[1:] * quats[:-1], axis=-1) > 0).all()


def test_what_cannot_be_asked_for_is_told(walk):
    with pytest.raises(SkeletonError, match="units out of m, cm"):
        walk.positions("yard")
    with pytest.raises(SkeletonError, match="up 'y', 'z' or 'file', but got 'x'"):
        walk.positions(up="x")
    with pytest.raises(SkeletonError, match="space 'local' or 'global'"):
        walk.rotations("world")
    with pytest.raises(SkeletonError, match="quat_xyzw"):
        walk.rotations(form="euler")
    with pytest.raises(ClipError, match="two frames"):
        walk[:1].velocities()


def test_velocities_are_metres_a_second(walk):
    speeds = walk.velocities()
    assert np.allclose(speeds[1:-1], (walk.positions()[2:] - walk.positions()[:-2]) * walk.fps / 2)
    assert np.allclose(speeds[0], (walk.positions()[1] - walk.positions()[0]) * walk.fps)
    assert np.allclose(walk.velocities("mm"), 1000 * speeds)


def test_contacts_are_left_and_right(walk):
    contacts = walk.contacts()
    assert contacts.dtype == np.bool_
    assert contacts.shape == (len(walk), 2)
    names = list(walk.skeleton.names)
    assert np.array_equal(walk.mirror().contacts(), contacts[:, ::-1])
    slow = np.linalg.norm(walk.velocities()[:, names.index("ltoes")], axis=-1)
    assert slow[contacts[:, 0]].mean() < 0.5 * slow[~contacts[:, 0]].mean()
    assert Clip(*_stick()).contacts().shape[0] == 2


def _stick():
    from mocapdb.motion.skeleton import Skeleton

    skeleton = Skeleton(
        ["root", "bone"], [-1, 0], [[0, 0, 0], [0, 1, 0]], [("tx", "ty", "tz"), ("rx",)],
        ["", "X"], convention="bvh",
    )  # fmt: skip
    return skeleton, np.zeros((2, 4)), 30


# -- frames ----------------------------------------------------------------------------------------


def test_a_lower_rate_that_divides_keeps_frames_as_they_are(walk):
    assert np.array_equal(walk.resample(30).channels, walk.channels[::4])
    assert walk.resample(120) is walk
    assert walk.resample(30).fps_source == "caller"


@given(clips())
def test_rotations_go_along_the_sphere(clip):
    once = clip.resample(2 * clip.fps)
    assert np.array_equal(once.channels[::2], clip.channels)
    if len(clip) == 1:
        return
    shape = (*once.channels.shape[:1], clip.skeleton.n_joints, 4)
    quats = once.rotations(up="file").reshape(shape)
    for joint in clip.skeleton.rotating_joints:
        if len(clip.skeleton.rotation_orders[joint]) == 2:
            continue
        turns = Rotation.from_quat(quats[:, joint])
        whole = (turns[:-2:2].inv() * turns[2::2]).magnitude()
        first = (turns[:-2:2].inv() * turns[1::2]).magnitude()
        sure = whole < np.pi - 1e-3  # half a turn has two shortest arcs
        assert np.allclose(first[sure], whole[sure] / 2, atol=1e-6)


def test_angles_stay_near_those_of_the_frame_before(bvh_walk):
    steps = np.abs(np.diff(bvh_walk.resample(100).channels, axis=0))
    assert steps.max() < 1.5 * np.abs(np.diff(bvh_walk.channels, axis=0)).max()


@pytest.mark.parametrize("fps", [0, -30, np.nan, np.inf])
def test_a_rate_that_is_none_is_told(walk, fps):
    with pytest.raises(ClipError, match="a frame rate above 0"):
        walk.resample(fps)


def test_retiming_keeps_the_rate(walk):
    fast = walk.retime(2.0)
    assert (len(fast), fast.fps) == (60, 120)
    assert np.array_equal(fast.channels, walk.channels[::2])
    slow = walk.retime(duration_s=2.0)
    assert len(slow) == 240
    assert np.allclose(slow.channels[[0, -1]], walk.channels[[0, -1]])
    for bad in ({}, {"speed": 1.0, "duration_s": 1.0}, {"speed": 0.0}, {"duration_s": -1.0}):
        with pytest.raises(ClipError, match=r"speed|duration"):
            walk.retime(**bad)


def test_cutting_counts_seconds(walk):
    assert walk.cut(0.25, 0.75) == walk[30:90]
    assert walk.cut(0.5) == walk[60:]
    assert walk.cut() is walk
    for bad in ((0.5, 0.5), (-0.1, 0.5), (0.5, 2.0), (2.0, None), (0.9, 0.1), (np.nan, 1.0)):
        with pytest.raises(ClipError, match="within the 1 s of 'walk_1'"):
            walk.cut(*bad)


def test_clips_follow_each_other(walk):
    both = walk[:50].concat(walk[50:])
    assert np.array_equal(both.channels, walk.channels)
    assert walk.concat() is walk
    turned = walk.place((3.0, -2.0), facing_deg=100.0)
    led_on = walk[:60].concat(turned[60:], align=True)
    assert np.allclose(led_on.positions(), walk.positions(), atol=2e-3)
    with pytest.raises(ClipError, match=r"Resample it: clip.resample\(120\)"):
        walk.concat(walk.resample(60))
    with pytest.raises(ClipError, match="one skeleton"):
        walk.concat(to_bvh_convention(walk))


# -- left and right --------------------------------------------------------------------------------


@pytest.mark.parametrize("convention", ["acclaim", "bvh"])
def test_a_mirror_shows_every_joint_on_the_other_side(walk, bvh_walk, convention):
    clip = walk if convention == "acclaim" else bvh_walk
    across = across_by_names(clip.skeleton.names)
    image = clip.mirror()
    assert np.allclose(image.positions(), clip.positions()[:, across] * [-1, 1, 1], atol=1e-6)
    assert np.allclose(image.mirror().positions(), clip.positions(), atol=1e-6)
    assert image.provenance[-1] == "mirrored"


def test_a_mirror_needs_no_names_and_no_symmetric_rest_pose(bvh_walk):
    plain = bvh_walk.rename_joints({n: f"j{i}" for i, n in enumerate(bvh_walk.skeleton.names)})
    assert np.allclose(plain.mirror().positions(), bvh_walk.mirror().positions(), atol=1e-6)
    # the same motion on a body whose bones all lie along x at rest, each frame turned for that
    from dataclasses import replace

    from mocapdb.motion.kinematics import Pose, channels_from_pose
    from mocapdb.motion.rotations import basis_along

    skeleton, pose = bvh_walk.skeleton, forward_kinematics(bvh_walk.skeleton, bvh_walk.channels)
    offsets, rotations = skeleton.offsets.copy(), pose.rotations.copy()
    for joint, children in enumerate(skeleton.children):
        moving = [child for child in children if np.linalg.norm(skeleton.offsets[child]) > 0]
        if len(moving) == 1 and len(children) == 1:
            way = skeleton.offsets[moving[0]]
            offsets[moving[0]] = [np.linalg.norm(way), 0, 0]
            rotations[:, joint] = rotations[:, joint] @ basis_along(way)
    odd = replace(skeleton, offsets=offsets)
    clip = Clip(odd, channels_from_pose(odd, Pose(pose.positions, rotations)), bvh_walk.fps)
    assert np.allclose(clip.positions(), bvh_walk.positions(), atol=1e-6)
    assert np.allclose(clip.mirror().positions(), bvh_walk.mirror().positions(), atol=1e-5)


def test_what_has_no_sides_is_told():
    with pytest.raises(ClipError, match="a left and a right side"):
        Clip(*_stick()).mirror()


# -- joints and places -----------------------------------------------------------------------------


@pytest.mark.parametrize("convention", ["acclaim", "bvh"])
def test_joints_that_stay_are_where_they_were(walk, bvh_walk, convention):
    clip = walk if convention == "acclaim" else bvh_walk
    for changed in (clip.drop_joints("lhand", "*toes*"), clip.with_root("thorax")):
        assert 0 < changed.skeleton.n_joints < clip.skeleton.n_joints
        kept = [clip.skeleton.joint(name) for name in changed.skeleton.names]
        assert np.allclose(changed.positions(), clip.positions()[:, kept], atol=1e-9)
    assert "lfingers" not in clip.drop_joints("lhand").skeleton.names
    assert clip.with_root("root") is clip
    assert clip.drop_joints() is clip


def test_names_that_are_none_are_told_with_the_nearest(walk):
    with pytest.raises(SkeletonError, match=r"got 'LFemur'. Did you mean 'lfemur'"):
        walk.drop_joints("LFemur")
    with pytest.raises(SkeletonError, match="It has: root"):
        walk.with_root("wheel")
    with pytest.raises(SkeletonError, match=r"'lfemu'.*'lfemur'"):
        walk.rename_joints({"lfemu": "LeftUpLeg"})
    with pytest.raises(SkeletonError, match="unique joint names"):
        walk.rename_joints({"lfemur": "rfemur"})
    with pytest.raises(SkeletonError, match="'root' carries all others"):
        walk.drop_joints("root")


def test_a_motion_begins_where_it_is_put(walk):
    moved = walk.place((1.5, -0.5), facing_deg=90.0)
    assert np.allclose(moved.positions()[0, 0, [0, 2]], [1.5, -0.5])
    assert np.allclose(moved.positions()[..., 1], walk.positions()[..., 1])
    left, right = (walk.skeleton.joint(name) for name in ("lhipjoint", "rhipjoint"))
    ahead = np.cross(moved.positions()[0, left] - moved.positions()[0, right], [0, 1, 0])
    assert ahead[0] > 5 * abs(ahead[2])
    still = walk.in_place()
    assert np.ptp(still.positions()[:, 0, [0, 2]], axis=0).max() < 1e-9
    assert np.allclose(still.positions()[..., 1], walk.positions()[..., 1])
    with pytest.raises(ClipError, match="three positions and three angles"):
        Clip(*_stick()).in_place()


def test_a_gap_in_height_is_told(walk):
    raised = walk.channels.copy()
    raised[:, walk.skeleton.channel_names.index("root.ty")] += 0.05 / walk.skeleton.metres_per_unit
    said = walk.concat(walk.replace(channels=raised, name="high"), align=True).provenance[-1]
    assert "aligned in place and heading; 'high' begins " in said
    assert "higher" in said
    assert "cm" not in walk[:60].concat(walk[60:], align=True).provenance[-1]


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (lambda clip: clip.retime(1e-12), "a speed that makes up to 100000000 frames"),
        (lambda clip: clip.retime(duration_s=1e12), "a duration that makes up to"),
        (lambda clip: clip.resample("30"), "a frame rate above 0"),
        (lambda clip: clip.resample(True), "a frame rate above 0"),
        (lambda clip: clip.cut("1", "2"), "two times in seconds"),
        (lambda clip: clip.cut((1, 2)), "two times in seconds"),
        (lambda clip: clip.concat([clip, clip]), "got a list"),
        (lambda clip: clip.with_root(3), "name of a joint, but got 3"),
        (lambda clip: clip.with_root("l*"), "'l\\*' fits lhipjoint, lfemur"),
        (lambda clip: clip.rename_joints({"root": ""}), "a name of one line"),
        (lambda clip: clip.rename_joints({"root": "a b\n"}), "a name of one line"),
        (lambda clip: clip.rename_joints({"root": 3}), "a name of one line"),
        (lambda clip: clip.place((1, 2, 3)), "a place as two numbers"),
        (lambda clip: clip.place(facing_deg=np.inf), "a direction in degrees"),
        (lambda clip: clip.plot(n_poses=0), "one pose or more"),
    ],
)
def test_what_is_no_edit_is_refused(walk, edit, said):
    with pytest.raises(MocapdbError, match=said):
        edit(walk)


def test_joints_to_drop_may_be_a_list(walk):
    assert walk.drop_joints(["lfemur", "head"]) == walk.drop_joints("lfemur", "head")


# -- tables, pictures, words -----------------------------------------------------------------------


def test_tables_are_tidy_or_wide(walk):
    tidy = walk[:3].to_dataframe()
    assert list(tidy) == ["frame", "time_s", "joint", "x", "y", "z", "qx", "qy", "qz", "qw"]
    assert len(tidy) == 3 * 31
    head = tidy[tidy.joint == "head"]
    assert np.allclose(head[["x", "y", "z"]], walk.positions()[:3, walk.skeleton.joint("head")])
    wide = walk[:3].to_dataframe("wide", ["velocities", "channels", "contacts"], units="cm")
    assert len(wide) == 3
    assert np.allclose(wide["head.vx"], walk[:3].velocities("cm")[:, 16, 0])
    assert np.array_equal(wide["root.tx"], walk.channels[:3, 0])
    assert np.array_equal(wide["left.contact"], walk[:3].contacts()[:, 0])
    with pytest.raises(ClipError, match="'tidy' or 'wide', but got 'long'"):
        walk.to_dataframe("long")
    with pytest.raises(ClipError, match=r"a tidy table out of positions, .* but got 'contacts'"):
        walk.to_dataframe(columns=["contacts"])


def test_without_pandas_the_extra_is_named(walk, monkeypatch):
    real = builtins.__import__

    def missing(name, *rest):
        if name == "pandas":
            raise ImportError
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(MissingExtraError, match=r"mocapdb\[pandas\]"):
        walk.to_dataframe()


def test_a_clip_draws_itself(walk):
    ax = walk.plot(n_poses=3)
    assert len(ax.get_xticks()) == 3


def test_a_clip_says_what_it_has_and_can(walk):
    said = repr(walk)
    assert "120 frames x 62 channels, 1.00 s at 120 Hz" in said
    assert "31: root, lhipjoint" in said
    assert "root.tx " in said
    for line in said.splitlines():
        assert len(line) < 120
    for word in said.split():
        if word.endswith("()"):
            assert callable(getattr(Clip, word[:-2]))
