"""A library in the panel: listed, filtered, searched, added to."""

import shutil
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from in_blender import heads

from mocapdb import Library


@pytest.fixture
def settings(bpy, library):
    bpy.ops.mocapdb.open_library(path=str(library))
    return bpy.context.scene.mocapdb_library


def names(settings):
    return [row.name for row in settings.clips]


def test_the_clips_are_listed(settings):
    assert names(settings) == ["run_1", "run_2", "walk_1", "walk_2", "wave_1", "wave_2"]
    row = settings.clips[0]
    assert (row.label, round(row.seconds, 2), row.fps) == ("run", 3.0, 30.0)
    assert [row.name for row in settings.classes] == ["run", "walk", "wave"]


def test_filters_leave_what_they_say(settings, bpy):
    settings.label = "walk"
    assert names(settings) == ["walk_1", "walk_2"]
    settings.label = "All classes"
    settings.words = "waving"
    assert names(settings) == ["wave_1", "wave_2"]
    settings.words = ""
    bpy.ops.mocapdb.change_facets()
    settings.facets[0].facet, settings.facets[0].least = "root_speed", 2.0
    assert names(settings) == ["run_1", "run_2"]
    settings.facets[0].use_most, settings.facets[0].most = True, 1.0
    assert "Expected" in settings.problem
    bpy.ops.mocapdb.change_facets(remove=True)
    assert len(settings.clips) == 6 and not settings.problem


def test_what_is_no_library_is_said(bpy, tmp_path):
    with pytest.raises(RuntimeError, match="nothing_here"):
        bpy.ops.mocapdb.open_library(path=str(tmp_path / "nothing_here"))
    settings = bpy.context.scene.mocapdb_library
    settings.path = ""
    with pytest.raises(RuntimeError, match="Expected a library"):
        bpy.ops.mocapdb.import_clip()


def test_the_active_action_finds_its_like(bpy, settings, walking):
    settings.n_hits = 3
    assert bpy.ops.mocapdb.query() == {"FINISHED"}
    assert settings.hits[0].label == "walk" and settings.hits[0].distance < 0.2
    settings.hit = 0
    settings.rate = "SCENE"
    assert bpy.ops.mocapdb.import_clip(what="HIT") == {"FINISHED"}
    hit = settings.hits[0]
    assert np.ptp(bpy.context.object.animation_data.action.frame_range) == hit.end - hit.start - 1


def test_a_range_and_selected_bones_are_asked_for(bpy, addon, settings, walking):
    loops = bpy.context.scene.mocapdb_loops
    loops.use_range, loops.first_frame, loops.n_frames = True, 40, 30
    select = import_module(f"{addon.__name__}.compat").select_bone
    bpy.ops.object.mode_set(mode="POSE")
    for bone in walking.pose.bones:
        select(bone, bone.name in {"rfemur", "rtibia", "rfoot"})
    settings.label = "walk"
    bpy.ops.mocapdb.query()
    by_leg = [hit.distance for hit in settings.hits]
    assert {hit.label for hit in settings.hits} == {"walk"}
    assert all(abs(hit.end_s - hit.start_s - 1.0) < 0.8 for hit in settings.hits)
    for bone in walking.pose.bones:
        select(bone, True)
    bpy.ops.mocapdb.query()
    assert [hit.distance for hit in settings.hits] != by_leg


def test_the_cycle_of_a_class_comes_as_a_loop(bpy, settings):
    settings.label = "walk"
    assert bpy.ops.mocapdb.import_clip(what="CYCLE") == {"FINISHED"}
    owner = bpy.context.object
    action = owner.animation_data.action
    assert action.name == "Periodic walk"
    period = np.ptp(action.frame_range)
    times = 1 + np.linspace(0, period, 7)
    a, b = (heads(bpy, owner, times + lap * period)[0] for lap in (0, 3))
    assert np.abs((a - a[:, :1]) - (b - b[:, :1])).max() < 2e-3
    assert np.linalg.norm(b[0, 0] - a[0, 0]) > 1.0


def test_an_action_is_added_and_comes_back(bpy, library, walking, tmp_path):
    copy = tmp_path / "moves.mocapdb"
    shutil.copytree(library, copy)
    settings = bpy.context.scene.mocapdb_library
    settings.path = str(copy)
    settings.new_label = "walk"
    walking.scale = (0.0564444,) * 3
    bpy.context.view_layer.update()
    assert bpy.ops.mocapdb.add_action() == {"FINISHED"}
    assert "walk" in names(settings) and len(settings.clips) == 7
    with Library(copy) as opened:
        record = opened.record("walk")
        assert (record.label, record.frames, record.fps) == ("walk", 150, 30.0)
        assert 1.4 < record.height_m < 2.1
    before = heads(bpy, walking, [1, 50, 100])[0]
    settings.rate = "SCENE"
    bpy.ops.mocapdb.import_clip(clip="walk")
    after = heads(bpy, bpy.context.object, [1, 50, 100])[0]
    order = [bone.name for bone in bpy.context.object.data.bones]
    rows = [order.index(bone.name) for bone in walking.data.bones]
    assert 1000 * np.linalg.norm(after[:, rows] - before, axis=-1).mean() < 2
    bpy.context.view_layer.objects.active = walking
    bpy.ops.object.select_all(action="DESELECT")
    walking.select_set(True)
    with pytest.raises(RuntimeError, match="a clip 'walk' is there"):
        bpy.ops.mocapdb.add_action()


@pytest.mark.parametrize("label", ["walk/fast", "..", "/tmp/evil", "", '=1,"a"'])
def test_a_class_is_a_word_and_no_folder(addon, walking, tmp_path, monkeypatch, label):
    armatures, compat, motions, tasks = (
        import_module(f"{addon.__name__}.{name}")
        for name in ("armatures", "compat", "motions", "tasks")
    )
    import bpy

    inner = tmp_path / "inner"
    inner.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(inner))
    span = armatures.span_of_action(*compat.assigned(walking), most=20)
    source = tmp_path / "motion.npz"
    motions.write_motion_file(armatures.read_action(bpy.context.scene, walking, span), source)
    path = tmp_path / "new.mocapdb"
    tasks.add(str(path), str(source), "a", label, 1.0, lambda *_: None)
    with Library(path) as opened:
        assert (opened.record("a").label or "") == label
    assert sorted(file.name for file in tmp_path.iterdir()) == ["inner", "motion.npz", path.name]
    assert not list(inner.iterdir()) and not Path("/tmp/evil").exists()
