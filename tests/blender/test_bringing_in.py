"""Clips of a library as armatures: where mocapdb says that joints are, bones are."""

from dataclasses import replace

import numpy as np
import pytest
from in_blender import heads

from mocapdb import BuildSettings, Library, Target, build_library
from mocapdb.corpus import synthetic
from mocapdb.io import read_clip, write_clip

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "foot": 0.3048, "cmu": 0.0564444}
NAMES = [f"{kind}_{up}_{unit}" for kind in ("amc", "bvh") for up in "yz" for unit in UNITS]
WITHIN_MM = 1.0


@pytest.fixture(scope="module")
def bodies(tmp_path_factory):
    """A library of a walk in every unit and both ways up, of both conventions."""
    folder = tmp_path_factory.mktemp("bodies")
    acclaim = synthetic.make_clip("walk", seed=1, duration_s=1.0).resample(30)
    write_clip(acclaim, folder / "walk.bvh")
    clips = {"amc": acclaim, "bvh": read_clip(folder / "walk.bvh")}
    (folder / "walk.bvh").unlink()
    for name in NAMES:
        kind, up, unit = name.split("_")
        skeleton = replace(clips[kind].skeleton, metres_per_unit=UNITS[unit], up=up)
        write_clip(clips[kind].replace(skeleton=skeleton, name=name), folder / f"{name}.npz")
    path = tmp_path_factory.mktemp("library") / "bodies.mocapdb"
    settings = BuildSettings(Target("mean_mm", 1.0), {"codec": "raw"})
    assert not build_library(folder, path, settings, jobs=1, index=False).failed
    return path


def expected(clip):
    """Where the bones of a clip begin and end, by mocapdb, in Blender's world: (F, J, 3) each."""
    ends = clip.positions("m", "z")
    if clip.skeleton.convention == "bvh":
        return ends, None
    return ends[:, np.maximum(clip.skeleton.parents, 0)], ends


def apart_mm(a, b):
    return 1000 * np.linalg.norm(a - b, axis=-1).max()


def assert_follows(bpy, owner, clip, times):
    begins, ends = heads(bpy, owner, times)
    starts, stops = expected(clip)
    rows = [clip.skeleton.names.index(bone.name) for bone in owner.data.bones]
    assert apart_mm(begins, starts[:, rows]) < WITHIN_MM
    if stops is not None:  # of the root, which has no length, Blender shows a stub
        assert apart_mm(ends[:, 1:], stops[:, rows[1:]]) < WITHIN_MM


@pytest.mark.parametrize("name", NAMES)
def test_bones_are_where_mocapdb_has_the_joints(bpy, bodies, name):
    scene = bpy.context.scene
    scene.mocapdb_library.rate = "SCENE"
    scene.mocapdb_library.path = str(bodies)
    assert bpy.ops.mocapdb.import_clip(clip=name) == {"FINISHED"}
    with Library(bodies) as library:
        clip = library.clip(name)
    assert scene.render.fps == 30
    assert_follows(bpy, bpy.context.object, clip, 1 + np.arange(len(clip)))


@pytest.mark.parametrize("rate", ["RESAMPLE", "KEYS"])
def test_a_clip_keeps_its_tempo_in_a_scene_of_another_rate(bpy, bodies, rate):
    scene = bpy.context.scene
    scene.render.fps = 24
    scene.mocapdb_library.rate = rate
    scene.mocapdb_library.path = str(bodies)
    bpy.ops.mocapdb.import_clip(clip="amc_y_m")
    with Library(bodies) as library:
        clip = library.clip("amc_y_m")
    assert scene.render.fps == 24
    shown = clip.resample(24) if rate == "RESAMPLE" else clip
    step = 1.0 if rate == "RESAMPLE" else 24 / 30
    assert_follows(bpy, bpy.context.object, shown, 1 + step * np.arange(len(shown)))


def test_a_scene_in_centimetres_has_a_body_of_its_size(bpy, bodies):
    scene = bpy.context.scene
    scene.unit_settings.scale_length = 0.01
    scene.mocapdb_library.rate = "SCENE"
    scene.mocapdb_library.path = str(bodies)
    bpy.ops.mocapdb.import_clip(clip="bvh_y_cmu")
    with Library(bodies) as library:
        clip = library.clip("bvh_y_cmu")
    assert_follows(bpy, bpy.context.object, clip, 1 + np.arange(len(clip)))
    assert max(bpy.context.object.dimensions) > 100


def test_a_motion_comes_onto_the_armature_that_has_its_bones(bpy, library):
    scene = bpy.context.scene
    settings = scene.mocapdb_library
    settings.rate, settings.path = "SCENE", str(library)
    bpy.ops.mocapdb.import_clip(clip="walk_1")
    owner = bpy.context.object
    settings.onto_selected = True
    assert bpy.ops.mocapdb.import_clip(clip="run_1") == {"FINISHED"}
    assert bpy.context.object == owner and len(bpy.data.armatures) == 1
    assert owner.animation_data.action.name == "run_1"
    with Library(library) as opened:
        clip = opened.clip("run_1")
    begins, _ = heads(bpy, owner, 1 + np.arange(len(clip)))
    rows = [clip.skeleton.names.index(bone.name) for bone in owner.data.bones]
    # another body, so bones point alike and places are nearly the same
    assert apart_mm(begins, expected(clip)[0][:, rows]) < 150


def test_other_names_and_another_rest_pose_take_the_same_directions(bpy, addon, library):
    settings = bpy.context.scene.mocapdb_library
    settings.rate, settings.path = "SCENE", str(library)
    bpy.ops.mocapdb.import_clip(clip="walk_1")
    first = bpy.context.object
    bpy.ops.mocapdb.import_clip(clip="walk_1")
    second = bpy.context.object
    for bone in second.data.bones:
        bone.name = f"rig:{bone.name.upper()}"
    second.rotation_mode = "XYZ"
    second.rotation_euler = (0.0, 0.0, 0.5)
    bpy.ops.object.transform_apply()
    settings.onto_selected = True
    bpy.ops.mocapdb.import_clip(clip="walk_1")
    times = np.arange(1, 90, 10)
    (a_heads, a_tails), (b_heads, b_tails) = heads(bpy, first, times), heads(bpy, second, times)
    assert apart_mm(b_tails - b_heads, a_tails - a_heads) < WITHIN_MM


def test_an_armature_of_another_body_is_refused(bpy, library):
    settings = bpy.context.scene.mocapdb_library
    settings.path = str(library)
    settings.onto_selected = True
    bpy.ops.object.armature_add()
    with pytest.raises(RuntimeError, match=r"Expected an armature with the bones of 'walk_1'"):
        bpy.ops.mocapdb.import_clip(clip="walk_1")
    bpy.ops.mesh.primitive_cube_add()
    with pytest.raises(RuntimeError, match="Expected an active armature"):
        bpy.ops.mocapdb.import_clip(clip="walk_1")
