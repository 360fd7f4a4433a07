"""Actions as mocapdb sees them: the same motion that Blender shows."""

import numpy as np
import pytest
from in_blender import heads, import_bvh

from mocapdb.io import read_clip


def read(addon, owner, **limits):
    """The clip that the add-on hands to mocapdb, and the frames that it is of."""
    from importlib import import_module

    armatures = import_module(f"{addon.__name__}.armatures")
    clips = import_module(f"{addon.__name__}.clips")
    compat = import_module(f"{addon.__name__}.compat")
    import bpy

    told = []
    span = armatures.span_of_action(*compat.assigned(owner), **limits)
    motion = armatures.read_action(bpy.context.scene, owner, span, told.append)
    return clips.clip_of(motion), span, told


def assert_same(bpy, owner, clip, span, within_mm=0.1):
    begins, _ = heads(bpy, owner, span.times)
    seen = clip.positions("m", "z")
    rows = [clip.skeleton.names.index(bone.name) for bone in owner.data.bones]
    assert 1000 * np.linalg.norm(begins - seen[:, rows], axis=-1).max() < within_mm


@pytest.mark.parametrize("mode", ["QUATERNION", "XYZ", "ZXY", "AXIS_ANGLE"])
def test_every_rotation_mode_is_understood(bpy, addon, library, mode):
    scene = bpy.context.scene
    scene.mocapdb_library.path, scene.mocapdb_library.rate = str(library), "SCENE"
    bpy.ops.mocapdb.import_clip(clip="walk_1")
    for bone in bpy.context.object.pose.bones:
        bone.rotation_mode = mode
    scene.mocapdb_library.onto_selected = True
    bpy.ops.mocapdb.import_clip(clip="walk_1")
    owner = bpy.context.object
    clip, span, told = read(addon, owner)
    assert (len(clip), clip.fps, told) == (90, 30.0, [])
    assert_same(bpy, owner, clip, span)
    from mocapdb import Library

    with Library(library) as opened:
        original = opened.clip("walk_1").positions("m", "z")
    seen = clip.positions("m", "z")[:, : original.shape[1]]
    assert 1000 * np.linalg.norm(np.ptp(seen[:, 0], axis=0) - np.ptp(original[:, 0], axis=0)) < 1


@pytest.mark.parametrize("rotate_mode", ["NATIVE", "QUATERNION", "XYZ"])
def test_blenders_own_import_is_understood(bpy, addon, files, rotate_mode):
    owner = import_bvh(bpy, files / "walk.bvh", rotate_mode=rotate_mode, global_scale=0.0564444)
    clip, span, _ = read(addon, owner)
    assert_same(bpy, owner, clip, span)
    original = read_clip(files / "walk.bvh")
    assert len(clip) == len(original)
    own, theirs = clip.positions("m", "z"), original.positions("m", "z")
    for name in ("root", "lfoot", "rhand", "head"):
        a = own[:, clip.skeleton.names.index(name)]
        b = theirs[:, original.skeleton.names.index(name)]
        assert 1000 * np.linalg.norm(a - b, axis=-1).max() < 1.0


def test_an_object_that_is_scaled_and_turned_counts(bpy, addon, walking):
    walking.scale = (0.0564444,) * 3
    walking.rotation_euler = (0.2, 0.1, 1.0)
    walking.location = (1.0, 2.0, 3.0)
    bpy.context.view_layer.update()
    clip, span, _ = read(addon, walking)
    assert_same(bpy, walking, clip, span)
    assert 1.4 < clip.skeleton.height < 2.2


def test_constraints_and_an_object_that_moves_are_evaluated(bpy, addon, walking):
    constraint = walking.pose.bones["lfemur"].constraints.new("LIMIT_ROTATION")
    constraint.use_limit_x = True
    constraint.owner_space = "LOCAL"
    clip, span, told = read(addon, walking)
    assert told and "'lfemur' has constraints" in told[0]
    assert_same(bpy, walking, clip, span)
    constraint.mute = True
    walking.keyframe_insert("location", frame=1)
    walking.location.x = 50
    walking.keyframe_insert("location", frame=100)
    clip, span, told = read(addon, walking)
    assert "moves as an object" in told[0]
    assert_same(bpy, walking, clip, span)


def test_keys_between_frames_are_all_looked_at(bpy, addon, files):
    bpy.context.scene.render.fps = 24
    owner = import_bvh(bpy, files / "walk.bvh", update_scene_fps=False, use_fps_scale=True)
    clip, span, _ = read(addon, owner)
    assert len(clip) == 150 and abs(clip.fps - 30) < 0.01
    assert_same(bpy, owner, clip, span)


def test_a_range_of_frames(bpy, addon, walking):
    clip, span, _ = read(addon, walking, first=31, most=60)
    assert (len(clip), span.start) == (60, 31.0)
    assert_same(bpy, walking, clip, span)


def test_several_bones_without_a_parent_are_one_body(bpy, addon, walking):
    bpy.ops.object.mode_set(mode="EDIT")
    bone = walking.data.edit_bones.new("prop")
    bone.head, bone.tail = (1, 0, 0), (1, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    clip, span, _ = read(addon, walking)
    assert clip.skeleton.names[0] == "armature"
    assert_same(bpy, walking, clip, span)


def all_curves(owner):
    return [curve for layer in owner.animation_data.action.layers for strip in layer.strips
            for bag in strip.channelbags for curve in bag.fcurves]  # fmt: skip


def test_muted_curves_do_not_play(bpy, addon, walking):
    muted = [curve for curve in all_curves(walking) if "femur" in curve.data_path]
    for curve in muted:
        curve.mute = True
    clip, span, told = read(addon, walking)
    assert muted and told == []
    assert_same(bpy, walking, clip, span)
    for curve in all_curves(walking):
        curve.mute = True
    with pytest.raises(Exception, match="keys, but 'walk' has only muted ones"):
        read(addon, walking)


@pytest.mark.parametrize("way", ["REPLACE", "ADD"])
def test_tracks_beside_the_action_are_evaluated(bpy, addon, walking, way):
    data = walking.animation_data
    strip = data.nla_tracks.new().strips.new("below", 1, data.action)
    data.action_blend_type = way
    clip, span, told = read(addon, walking)
    assert "plays tracks of the nonlinear animation" in told[0]
    assert_same(bpy, walking, clip, span)
    strip.mute = True
    _, _, told = read(addon, walking)
    assert ("is blended" in told[0]) if way == "ADD" else told == []


@pytest.mark.parametrize("is_keyed", [False, True])
def test_a_scaled_bone_is_evaluated(bpy, addon, walking, is_keyed):
    bone = walking.pose.bones[1]
    bone.scale = (2, 1.5, 1)
    if is_keyed:
        bone.keyframe_insert("scale", frame=50)
        bone.scale = (1, 1, 1)
    clip, span, told = read(addon, walking)
    assert f"bone {bone.name!r} is scaled" in told[0]
    assert_same(bpy, walking, clip, span)
