"""From one convention to the other: every joint stays where it was."""

from __future__ import annotations

import re
from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest
from motion_files import AMC, ASF, BVH
from naive import naive_forward_kinematics

from mocapdb.errors import SkeletonError
from mocapdb.io import read_clip, write_clip
from mocapdb.io.acclaim import read_amc, read_asf
from mocapdb.io.bvh import read_bvh
from mocapdb.io.conventions import TURNS, to_acclaim_convention, to_bvh_convention, to_y_up
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics

ODD_TREE = """\
HIERARCHY
ROOT root
{
  OFFSET 1 2 3
  CHANNELS 4 Zrotation Xrotation Yrotation Yposition
  JOINT far one
  {
    OFFSET 4 5 6
    CHANNELS 2 Zrotation Yrotation
    JOINT near
    {
      OFFSET 0 0 0
      CHANNELS 3 Yrotation Xrotation Zrotation
      JOINT stiff
      {
        OFFSET 0 3 0
        CHANNELS 0
        JOINT twin
        {
          OFFSET 1 1 0
          CHANNELS 1 Xrotation
        }
        JOINT far#one
        {
          OFFSET 1 1 0
          CHANNELS 1 Yrotation
          End Site
          {
            OFFSET 0 2 0
          }
        }
      }
    }
    JOINT tail
    {
      OFFSET 0 -2 1
      CHANNELS 3 Xrotation Yrotation Zrotation
      End Site
      {
        OFFSET 0 0 -3
      }
      End Site
      {
        OFFSET 1 0 -3
      }
    }
  }
  End Site
  {
    OFFSET 0 0 9
  }
}
MOTION
Frames: 5
Frame Time: 0.01
"""


@pytest.fixture
def acclaim_clip(tmp_path):
    (tmp_path / "body.asf").write_text(ASF)
    (tmp_path / "clip.amc").write_text(AMC)
    skeleton = read_asf(tmp_path / "body.asf")
    return read_amc(tmp_path / "clip.amc", skeleton)


@pytest.fixture
def odd_clip(tmp_path):
    rng = np.random.default_rng(5)
    rows = [" ".join(map(repr, row)) for row in rng.uniform(-170, 170, (5, 14)).tolist()]
    (tmp_path / "odd.bvh").write_text(ODD_TREE + "\n".join(rows))
    return read_bvh(tmp_path / "odd.bvh", up="y", metres_per_unit=1)


def places(clip):
    return dict(
        zip(clip.skeleton.names, naive_forward_kinematics(clip)[0].swapaxes(0, 1), strict=True)
    )


def turns(clip):
    rotations = naive_forward_kinematics(clip)[1].swapaxes(0, 1)
    return dict(zip(clip.skeleton.names, rotations, strict=True))


def test_acclaim_to_bvh(acclaim_clip):
    converted = to_bvh_convention(acclaim_clip)
    assert converted.skeleton.convention == "bvh"
    before, after = places(acclaim_clip), places(converted)
    parents = dict(zip(acclaim_clip.skeleton.names, acclaim_clip.skeleton.parents, strict=True))
    for name in acclaim_clip.skeleton.names:
        start = acclaim_clip.skeleton.names[max(parents[name], 0)]
        assert np.allclose(after[name], before[start], atol=1e-12)
        assert np.allclose(turns(converted)[name], turns(acclaim_clip)[name], atol=1e-12)
    for leaf in ("foot", "spine"):
        assert np.allclose(after[f"{leaf}_End"], before[leaf], atol=1e-12)


def test_acclaim_to_bvh_and_back(acclaim_clip):
    again = to_acclaim_convention(to_bvh_convention(acclaim_clip))
    assert again.skeleton.names == acclaim_clip.skeleton.names
    assert again.skeleton.parents.tolist() == acclaim_clip.skeleton.parents.tolist()
    assert np.array_equal(again.skeleton.offsets, acclaim_clip.skeleton.offsets)
    assert np.allclose(
        naive_forward_kinematics(again)[0], naive_forward_kinematics(acclaim_clip)[0], atol=1e-12
    )


def test_angles_are_continuous_through_a_whole_turn(acclaim_clip):
    frames = 200
    channels = np.repeat(acclaim_clip.channels[:1], frames, axis=0)
    channels[:, 3:6] = np.linspace(0, 720, frames)[:, None] * (1.0, 0.3, -0.5)
    converted = to_bvh_convention(replace(acclaim_clip, channels=channels))
    assert np.abs(np.diff(converted.channels, axis=0)).max() < 20


def test_root_with_an_orientation_and_a_position(acclaim_clip):
    skeleton = acclaim_clip.skeleton
    offsets, axes = skeleton.offsets.copy(), skeleton.axis_deg.copy()
    offsets[0], axes[0] = (1, 2, 3), (10, 20, 30)
    other = replace(acclaim_clip, skeleton=replace(skeleton, offsets=offsets, axis_deg=axes))
    assert np.allclose(places(to_bvh_convention(other))["foot_End"], places(other)["foot"])


def test_single_joint():
    from mocapdb.motion.skeleton import Skeleton

    lone = Skeleton(["root"], [-1], np.zeros((1, 3)), [["ry"]], ["Y"], convention="acclaim")
    converted = to_bvh_convention(Clip(lone, [[90.0]], 30))
    assert np.allclose(converted.channels, [[0, 0, 0, 0, 90, 0]])
    assert to_acclaim_convention(converted).skeleton.n_joints == 1


def test_bvh_to_acclaim(tmp_path):
    (tmp_path / "clip.bvh").write_text(BVH)
    clip = read_bvh(tmp_path / "clip.bvh")
    converted = to_acclaim_convention(clip)
    assert converted.skeleton.names == (("root", "Left_Leg_base", "Head_base", "Left_Leg", "Head"))
    assert converted.skeleton.dofs[3] == ("ry", "rx", "rz")
    assert np.array_equal(np.sort(converted.channels), np.sort(clip.channels))
    assert np.allclose(places(converted)["Head"], places(clip)["Head_End"], atol=1e-12)
    assert np.allclose(places(converted)["Head_base"], places(clip)["Head"], atol=1e-12)


def test_every_joint_of_an_odd_tree_is_the_end_of_a_bone(odd_clip):
    converted = to_acclaim_convention(odd_clip)
    ends = np.stack(list(places(converted).values()))
    for place in places(odd_clip).values():
        assert np.abs(ends - place).max(axis=(1, 2)).min() < 1e-12
    names = converted.skeleton.names
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[\w.\-]+", name) for name in names)
    assert names[0] == "root"


def test_odd_tree_there_and_back(odd_clip):
    again = to_bvh_convention(to_acclaim_convention(odd_clip))
    found = np.stack(list(places(again).values()))
    for place in places(odd_clip).values():
        assert np.abs(found - place).max(axis=(1, 2)).min() < 1e-12


def test_joints_that_move_cannot_be_bones(tmp_path):
    text = BVH.replace("3 Yrotation Zrotation Xrotation", "3 Xposition Yposition Zposition")
    (tmp_path / "clip.bvh").write_text(text)
    with pytest.raises(SkeletonError, match="'Head'"):
        to_acclaim_convention(read_bvh(tmp_path / "clip.bvh"))


@pytest.mark.parametrize("fixture", ["acclaim_clip", "odd_clip"])
def test_y_up(fixture, request):
    clip = request.getfixturevalue(fixture)
    lying = replace(clip, skeleton=replace(clip.skeleton, up="z"))
    turned = to_y_up(lying)
    x, y, z = np.moveaxis(naive_forward_kinematics(lying)[0], -1, 0)
    assert np.allclose(naive_forward_kinematics(turned)[0], np.stack([x, z, -y], -1), atol=1e-12)
    assert turned.skeleton.up == "y"
    assert not np.signbit(turned.channels[turned.channels == 0]).any()


def test_nothing_to_do(acclaim_clip, odd_clip):
    assert to_acclaim_convention(acclaim_clip) is acclaim_clip
    assert to_bvh_convention(odd_clip) is odd_clip
    assert to_y_up(odd_clip) is odd_clip


def test_provenance(odd_clip):
    lying = replace(odd_clip, skeleton=replace(odd_clip.skeleton, up="z"))
    steps = to_acclaim_convention(lying).provenance[-2:]
    assert steps == ("turned from z up to y up", "converted to acclaim convention")


@pytest.mark.parametrize("up", ["x", "-x", "-y", "-z", "z"])
def test_a_file_is_read_whatever_direction_is_up(up, tmp_path):
    plain = made.make_walk()
    turn = np.zeros((3, 3))  # from y up to the file's directions
    for own, (axis, sign) in enumerate(TURNS[up]):
        turn[own, axis] = sign
    assert np.linalg.det(turn) == pytest.approx(1.0)
    skeleton = replace(plain.skeleton, offsets=plain.skeleton.offsets @ turn.T)
    pose = Pose(plain.pose.positions @ turn.T, turn @ plain.pose.rotations @ turn.T)
    write_clip(Clip(skeleton, channels_from_pose(skeleton, pose), 30.0), tmp_path / "walk.bvh")
    clip = read_clip(tmp_path / "walk.bvh", up=up)
    assert clip.up_source == "caller"
    clip = to_y_up(clip)
    assert clip.skeleton.up == "y"
    found = forward_kinematics(clip.skeleton, clip.channels)
    order = [clip.skeleton.names.index(role) for role in plain.roles if "end" not in role]
    same = [joint for joint, role in enumerate(plain.roles) if "end" not in role]
    for mine, theirs in zip(found, plain.pose, strict=True):
        np.testing.assert_allclose(mine[:, order], theirs[:, same], atol=1e-9)
    alone = read_clip(tmp_path / "walk.bvh")
    warnings = [step for step in alone.provenance if step.startswith("warning: up axis")]
    assert len(warnings) == (up != "z")
    assert all(f"say so: --up {up}" in warning for warning in warnings)
    assert alone.up_source == ("inferred" if up == "z" else "default")


def on_disk(clip, tmp_path):
    """Return a clip as it is read from the AMC that is written of it."""
    write_clip(clip, tmp_path / "written.amc")
    return read_clip(tmp_path / "written.amc", fps=clip.fps)


@pytest.mark.parametrize("meaning", ["places", "replacing", "displacements"])
def test_positions_that_stay_the_same_become_bones(meaning, tmp_path):
    plain = made.make_walk()
    body = made.with_positions(plain, meaning)
    skeleton = replace(body.skeleton, displaces=meaning == "displacements")
    clip = Clip(skeleton, body.channels, 30.0, name="made")
    again = to_bvh_convention(on_disk(clip, tmp_path))
    wanted = dict(zip(plain.roles, plain.pose.positions.swapaxes(0, 1), strict=True))
    found = forward_kinematics(again.skeleton, again.channels).positions
    for joint in ("left_knee", "right_wrist", "head", "left_toe"):
        at = found[:, again.skeleton.names.index(joint)]
        np.testing.assert_allclose(at, wanted[joint], atol=1e-6)


def test_a_body_that_moves_against_its_scene_is_written_without_it(tmp_path):
    plain = made.make_walk()
    whole = made.with_positions(made.under_scene(plain), "places")
    again = on_disk(Clip(whole.skeleton, whole.channels, 30.0, name="made"), tmp_path)
    assert "scene" not in again.skeleton.names
    found = forward_kinematics(again.skeleton, again.channels).positions
    wanted = plain.pose.positions[:, plain.roles.index("left_toe")]
    assert np.abs(found - wanted[:, None]).sum(axis=2).min(axis=1).max() < 1e-6


def test_a_joint_that_moves_on_its_bone_is_refused_with_how_far():
    body = made.with_positions(made.make_walk(), "places")
    channels = body.channels.copy()
    column = body.skeleton.channel_names.index("left_wrist.tx")
    channels[:, column] += np.linspace(0, 5e-5, len(channels))
    clip = Clip(body.skeleton, channels, 30.0)
    to_acclaim_convention(clip)  # less than what a marker wobbles by
    channels = channels.copy()
    channels[:, column] += np.linspace(0, 0.012, len(channels))
    with pytest.raises(SkeletonError, match=r"'left_wrist' moves by 12.1 mm\. Acclaim's"):
        to_acclaim_convention(clip.replace(channels=channels))
    channels[:, body.skeleton.channel_names.index("head.ty")] += np.linspace(0, 1, len(channels))
    with pytest.raises(SkeletonError, match="'head' moves by 1e\\+03 mm, and 1 more"):
        to_acclaim_convention(clip.replace(channels=channels))
