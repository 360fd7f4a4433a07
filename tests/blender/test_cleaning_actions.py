"""Faults of an action: marked, repaired in a second one, each as the user decides."""

from importlib import import_module

import numpy as np
import pytest
from in_blender import import_bvh

from mocapdb.corpus import synthetic
from mocapdb.io import write_clip


def curves(action):
    return {
        (curve.data_path, curve.array_index): np.array([p.co[:] for p in curve.keyframe_points])
        for layer in action.layers for strip in layer.strips for bag in strip.channelbags
        for curve in bag.fcurves
    }  # fmt: skip


def changed(before, after):
    """The bones that have other keys, and the frames."""
    bones = {}
    a, b = curves(before), curves(after)
    assert a.keys() == b.keys()
    for path, keys in a.items():
        others = b[path][b[path][:, 0] % 1 < 0.5]  # without keys between frames
        assert (keys[:, 0] == others[:, 0]).all()
        frames = keys[keys[:, 1] != others[:, 1], 0]
        if len(frames):
            bones.setdefault(path[0].split('"')[1], set()).update(frames.tolist())
    return bones


def turns(bpy, owner, bone, times):
    """How a bone is turned against its parent, at times that may lie between frames."""
    shown = []
    for time in times:
        bpy.context.scene.frame_set(int(time), subframe=float(time % 1))
        posed = owner.evaluated_get(bpy.context.evaluated_depsgraph_get())
        shown.append(posed.pose.bones[bone].matrix_basis.to_quaternion())
    return shown


def apart(a, b):
    angle = a.rotation_difference(b).angle
    return min(angle, 2 * np.pi - angle)


@pytest.fixture
def faulty(bpy, files):
    return import_bvh(bpy, files / "faulty.bvh", global_scale=0.0564444)


def markers(action):
    return [marker.name for marker in action.pose_markers]


def test_faults_are_marked_and_repaired_in_a_second_action(bpy, faulty):
    settings = bpy.context.scene.mocapdb_clean
    source = faulty.animation_data.action
    assert bpy.ops.mocapdb.clean() == {"FINISHED"}
    repaired = faulty.animation_data.action
    assert (source.name, repaired.name) == ("faulty", "Cleaned faulty")
    assert len(settings.faults) >= 1
    assert len(markers(source)) == len(settings.faults) and not markers(repaired)
    row = settings.faults[0]
    assert markers(source)[0] == f"fault {row.kind} {row.name} {row.confidence:.2f}"
    assert source.pose_markers[0].frame == round(row.start)
    mended = [row for row in settings.faults if row.method != "left"]
    touched = changed(source, repaired)
    assert mended and {row.name for row in mended} <= set(touched)
    for row in mended:  # nothing but the span, and a leg that is held, has other keys
        assert any(row.start <= frame <= row.end for frame in touched[row.name])
    frames = set().union(*touched.values())
    spans = [(row.start, row.end) for row in mended]
    assert all(any(first <= f <= last for first, last in spans) for f in frames)


@pytest.mark.parametrize("seed", [3, 4, 5])
@pytest.mark.parametrize("mode", ["NATIVE", "QUATERNION"])
def test_a_repaired_bone_does_not_swing_between_keys(bpy, tmp_path, mode, seed):
    walk = synthetic.make_clip("walk", seed=1, duration_s=4.0).resample(30)
    write_clip(synthetic.inject_faults(walk, seed=seed, n=2).clip, tmp_path / "faulty.bvh")
    owner = import_bvh(bpy, tmp_path / "faulty.bvh", global_scale=0.0564444, rotate_mode=mode)
    bpy.ops.mocapdb.clean()
    for row in bpy.context.scene.mocapdb_clean.faults:
        times = np.arange(row.start - 2, row.end + 3)
        at, between = (turns(bpy, owner, row.name, times + half) for half in (0.0, 0.5))
        for i, halfway in enumerate(between[:-1]):
            detour = apart(at[i], halfway) + apart(halfway, at[i + 1])
            if row.method != "left":
                assert detour < apart(at[i], at[i + 1]) + np.deg2rad(5)


def test_a_refused_span_stays_as_it_was(bpy, faulty):
    settings = bpy.context.scene.mocapdb_clean
    source = faulty.animation_data.action
    bpy.ops.mocapdb.clean()
    all_touched = changed(source, faulty.animation_data.action)
    for row in settings.faults:
        row.accepted = False
    assert bpy.ops.mocapdb.repair_accepted() == {"FINISHED"}
    assert changed(source, faulty.animation_data.action) == {}
    assert {row.method for row in settings.faults} == {"refused"}
    for row in settings.faults:
        row.accepted = True
    bpy.ops.mocapdb.repair_accepted()
    assert changed(source, faulty.animation_data.action) == all_touched
    assert [a.name for a in bpy.data.actions] == ["Cleaned faulty", "faulty"]


def test_searching_again_looks_at_the_source(bpy, faulty):
    settings = bpy.context.scene.mocapdb_clean
    bpy.ops.mocapdb.clean()
    n_faults = len(settings.faults)
    bpy.ops.mocapdb.clean()
    assert (settings.action, len(settings.faults)) == ("faulty", n_faults)


def test_a_fault_is_gone_to_and_markers_go_away(bpy, addon, faulty):
    settings = bpy.context.scene.mocapdb_clean
    with pytest.raises(RuntimeError, match="find them first"):
        bpy.ops.mocapdb.go_to_fault()
    bpy.ops.mocapdb.clean()
    settings.fault = len(settings.faults) - 1
    bpy.ops.mocapdb.go_to_fault()
    row = settings.faults[settings.fault]
    assert bpy.context.scene.frame_current == int(row.start)
    assert faulty.data.bones.active.name == row.name
    bpy.ops.mocapdb.remove_markers()
    assert not markers(bpy.data.actions["faulty"])


def test_a_threshold_of_certainty_flags_less(bpy, faulty):
    settings = bpy.context.scene.mocapdb_clean
    settings.use_threshold, settings.threshold = True, 1.0
    bpy.ops.mocapdb.clean()
    assert not settings.faults
    assert changed(bpy.data.actions["faulty"], faulty.animation_data.action) == {}


def test_similar_motion_is_looked_for_in_the_library(bpy, faulty, library):
    scene = bpy.context.scene
    scene.mocapdb_clean.use_context = True
    with pytest.raises(RuntimeError, match="Expected a library"):
        bpy.ops.mocapdb.clean()
    scene.mocapdb_library.path = str(library)
    assert bpy.ops.mocapdb.clean() == {"FINISHED"}


def test_without_faults_nothing_changes(bpy, faulty):
    settings = bpy.context.scene.mocapdb_clean
    settings.use_threshold, settings.threshold = True, 1.0
    assert bpy.ops.mocapdb.clean() == {"FINISHED"}
    assert faulty.animation_data.action.name == "faulty"
    assert [action.name for action in bpy.data.actions] == ["faulty"]
    assert not settings.repaired and not markers(faulty.animation_data.action)


def test_keys_that_replace_muted_ones_play(bpy, addon, faulty):
    compat, keying = (
        import_module(f"{addon.__name__}.{name}") for name in ("compat", "keying")
    )  # fmt: skip
    action, slot = compat.assigned(faulty)
    bone = faulty.pose.bones["lfemur"]
    path = f"{bone.path_from_id()}.rotation_euler"
    bag = compat.curves_of(action, slot)
    own = [curve for curve in bag.fcurves if curve.data_path == path]
    for curve in own:
        curve.mute = True
    count, times = len(bag.fcurves), 1.0 + np.arange(20)
    turned = np.tile([np.cos(0.2), np.sin(0.2), 0.0, 0.0], (20, 1))
    keys = keying.BoneKeys(turned, None)
    keying.replace_keys(action, slot, bone, keys, times, [10, 11], moves=False)
    assert len(own) == 3 and len(bag.fcurves) == count
    bpy.context.scene.frame_set(11)
    posed = faulty.evaluated_get(bpy.context.evaluated_depsgraph_get()).pose.bones["lfemur"]
    assert np.allclose(posed.matrix_basis.to_quaternion(), turned[0], atol=1e-5)
