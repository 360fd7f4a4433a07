"""Periodic motions through the operator, with every option that it has."""

import numpy as np
import pytest
from in_blender import heads, import_bvh

LAP = 1.0926  # seconds: the walk's


def played(owner):
    return owner.animation_data.action


def curves(action):
    return [curve for layer in action.layers for strip in layer.strips for bag in strip.channelbags
            for curve in bag.fcurves]  # fmt: skip


def keyed_bones(action):
    return {curve.data_path.split('"')[1] for curve in curves(action)}


def around_root(bpy, owner, times):
    begins, _ = heads(bpy, owner, times)
    return begins - begins[:, :1]


def way(bpy, owner, times):
    return heads(bpy, owner, times)[0][:, 0]


def settings_of(bpy):
    return bpy.context.scene.mocapdb_loops


def test_a_walk_becomes_an_action_that_repeats_for_ever(bpy, walking):
    source = played(walking)
    assert bpy.ops.mocapdb.extract() == {"FINISHED"}
    action = played(walking)
    assert action.name == "Periodic walk" and source.name == "walk" and source.users
    assert action["mocapdb_confidence"] > 0.8
    period = 30 * action["mocapdb_period_s"]
    assert abs(period / 30 - LAP) < 0.03
    assert abs(np.ptp(action.frame_range) - period) < 1e-3
    assert all(len(curve.modifiers) == 1 for curve in curves(action))
    assert keyed_bones(action) == {bone.name for bone in walking.data.bones}
    times = action.frame_range[0] + np.linspace(0, period, 9)
    first, third = around_root(bpy, walking, times), around_root(bpy, walking, times + 2 * period)
    assert np.abs(first - third).max() < 1e-3 * np.ptp(first)
    a, b = way(bpy, walking, times), way(bpy, walking, times + 2 * period)
    per_lap = (b - a) / 2
    assert np.abs(per_lap - per_lap[0]).max() < 1e-3
    assert np.linalg.norm(per_lap[0]) > 10  # file units: it goes on


def test_the_seam_is_a_step_like_others(bpy, walking):
    bpy.ops.mocapdb.extract()
    action = played(walking)
    end = action.frame_range[1]
    times = end + np.arange(-6, 7) * 0.5
    steps = np.linalg.norm(np.diff(around_root(bpy, walking, times), axis=0), axis=(1, 2))
    assert steps[5:7].max() < 1.5 * np.median(steps)


def test_exact_frames_have_whole_laps(bpy, walking):
    settings = settings_of(bpy)
    settings.loop_by, settings.laps = "FRAMES", 3
    bpy.ops.mocapdb.extract()
    action = played(walking)
    lap = round(30 * action["mocapdb_period_s"])
    curve = curves(action)[0]
    assert len(curve.keyframe_points) == 3 * lap and not curve.modifiers
    times = action.frame_range[0] + np.arange(3 * lap)
    assert [point.co[0] for point in curve.keyframe_points] == times.tolist()
    shown = around_root(bpy, walking, times)
    assert np.abs(shown[:lap] - shown[2 * lap :]).max() < 1e-3 * np.ptp(shown)


def test_a_second_extraction_looks_at_the_source_again(bpy, walking):
    bpy.ops.mocapdb.extract()
    bpy.ops.mocapdb.extract()
    assert played(walking).name == "Periodic walk.001"
    assert played(walking)["mocapdb_made_of"] == "walk"


def test_in_pose_mode_only_the_selected_bones_are_animated(bpy, addon, walking):
    from importlib import import_module

    select = import_module(f"{addon.__name__}.compat").select_bone
    bpy.ops.object.mode_set(mode="POSE")
    arm = {"rhumerus", "rradius", "rwrist", "lhumerus", "lradius"}
    for bone in walking.pose.bones:
        select(bone, bone.name in arm)
    assert bpy.ops.mocapdb.extract() == {"FINISHED"}
    assert keyed_bones(played(walking)) == arm
    assert not any(curve.data_path.endswith("location") for curve in curves(played(walking)))
    resting = [bone for bone in walking.pose.bones if bone.name not in arm]
    for frame in (5, 20):
        bpy.context.scene.frame_set(frame)
        turned = [np.abs(np.array(bone.matrix_basis) - np.eye(4)).max() for bone in resting]
        assert max(turned) < 1e-6
    moving = around_root(bpy, walking, [5, 20])
    assert np.abs(moving[0] - moving[1]).max() > 0.5
    for bone in walking.pose.bones:
        select(bone, False)
    with pytest.raises(RuntimeError, match="Expected selected bones in pose mode"):
        bpy.ops.mocapdb.extract()


def test_several_armatures_get_a_motion_each(bpy, files):
    owners = [import_bvh(bpy, files / "walk.bvh") for _ in range(2)]
    for owner in owners:
        owner.select_set(True)
    bpy.ops.mocapdb.extract()
    assert [played(owner).name for owner in owners] == ["Periodic walk", "Periodic walk.001"]


def test_several_loops_become_a_motion_each(bpy, walking):
    settings_of(bpy).n_loops = 2
    settings_of(bpy).loop_by = "FRAMES"
    bpy.ops.mocapdb.extract()
    made = [action.name for action in bpy.data.actions if action.name.startswith("Periodic")]
    assert played(walking).name == made[0] == "Periodic walk, loop 0"
    assert len(made) <= 2  # a loop that is no cycle is told instead


def test_loops_are_chosen_from_the_diagram(bpy, walking):
    settings = settings_of(bpy)
    assert bpy.ops.mocapdb.find_loops() == {"FINISHED"}
    lengths = [loop.death - loop.birth for loop in settings.found]
    assert lengths and lengths == sorted(lengths, reverse=True)
    picture = bpy.data.images.load(settings.diagram)
    assert min(picture.size) > 300
    settings.found[0].chosen = True
    bpy.ops.mocapdb.extract()
    assert played(walking).name == "Periodic walk, loop 0"
    assert "cohomology" in played(walking)["mocapdb_method"]
    bpy.ops.mocapdb.forget_loops()
    assert not settings.found


def shift_of(action, axis):
    """How far the keys of the root's location go in a lap."""
    path = next(curve for curve in curves(action) if curve.data_path.endswith("location")).data_path
    own = [curve for curve in curves(action) if curve.data_path == path]
    points = own[axis].keyframe_points
    return points[len(points) - 1].co[1] - points[0].co[1]


def test_each_axis_moves_as_it_is_told(bpy, walking):
    settings = settings_of(bpy)

    def went(**values):
        for name, value in values.items():
            setattr(settings, name, value)
        bpy.ops.mocapdb.extract()
        first, last = played(walking).frame_range
        shown = way(bpy, walking, np.linspace(first, last, 13))
        return np.abs(shown[-1] - shown[0]), np.ptp(shown, axis=0)

    net, _ = went()
    ahead = int(np.argmax(net))
    aside = {0: 1, 1: 0}[ahead]
    name = "xyz"[ahead]
    assert net[ahead] > 10
    net, extent = went(**{f"way_{name}": "SWAY"})
    assert net[ahead] < 0.1 and extent[2] > 0.1
    net, extent = went(**{f"use_{'xyz'[aside]}": False, "use_z": False})
    assert extent[2] < 1e-3
    net, extent = went(use_translation=False)
    assert extent.max() < 1e-3


OPTIONS = {
    "epsilon": {},
    "subsample": {"subsample": 2},
    "delays": {"use_delays": True, "delays": 3, "lag": 2},
    "prime": {"prime": 11},
    "typical": {"model": "typical"},
    "m1": {"model": "m1"},
    "m2": {"model": "m2", "harmonics": 8},
    "no velocities": {"model": "m3", "use_velocities": False},
    "no accelerations": {"model": "m1", "use_accelerations": False},
    "few harmonics": {"harmonics": 1},
    "harmonics of the root": {"use_root_harmonics": True, "root_harmonics": 1},
    "range": {"use_range": True, "first_frame": 31, "n_frames": 90},
}
BY_COHOMOLOGY = ("epsilon", "delays", "prime")


@pytest.mark.parametrize("option", OPTIONS)
def test_every_option_reaches_the_method(bpy, walking, option):
    settings = settings_of(bpy)
    bpy.ops.mocapdb.extract()
    usual = played(walking)
    for name, value in OPTIONS[option].items():
        setattr(settings, name, value)
    if option in BY_COHOMOLOGY:
        bpy.ops.mocapdb.find_loops()
        born, dies = settings.found[0].birth, settings.found[0].death
        settings.use_epsilon, settings.epsilon = True, (born + dies) / 2
        bpy.ops.mocapdb.forget_loops()
    assert bpy.ops.mocapdb.extract() == {"FINISHED"}
    made = played(walking)
    assert abs(made["mocapdb_period_s"] - LAP) < 0.05

    def values(action):
        return np.array([curve.evaluate(at) for curve in curves(action) for at in (3, 9, 15)])

    assert ("cohomology" in made["mocapdb_method"]) == (option in BY_COHOMOLOGY)
    if option not in ("epsilon", "prime"):  # any distance and prime see the same loop here
        assert np.abs(values(made) - values(usual)).max() > 1e-6
    if option == "range":
        assert made.frame_range[0] == 31
    if option == "few harmonics":
        wobble = [np.array([point.co[1] for point in curve.keyframe_points]) for curve in
                  curves(made) if curve.data_path.endswith("euler")]  # fmt: skip
        spectrum = np.abs(np.fft.rfft(np.array(wobble)[:, :-1], axis=1))
        assert spectrum[:, 6:].max() < 0.1 * spectrum[:, 1].max()


def test_an_impossible_number_is_refused_in_words(bpy, walking):
    settings_of(bpy).prime = 12
    with pytest.raises(RuntimeError, match="prime"):
        bpy.ops.mocapdb.extract()


def test_pictures_go_into_the_folder(bpy, walking, tmp_path):
    settings = settings_of(bpy)
    settings.use_pictures, settings.pictures = True, str(tmp_path / "pictures")
    bpy.ops.mocapdb.extract()
    names = sorted(path.name for path in (tmp_path / "pictures").iterdir())
    assert names == ["walk pca.png", "walk persistence.png"]
    for name in names:
        assert min(bpy.data.images.load(str(tmp_path / "pictures" / name)).size) > 300


# -- what cannot be extracted from -----------------------------------------------------------------


def test_nothing_selected_is_refused(bpy):
    with pytest.raises(RuntimeError, match="Expected a selected armature, but nothing"):
        bpy.ops.mocapdb.extract()


def test_a_mesh_is_refused(bpy):
    bpy.ops.mesh.primitive_cube_add()
    with pytest.raises(RuntimeError, match="but mesh 'Cube' is selected"):
        bpy.ops.mocapdb.extract()


def test_an_armature_without_an_action_is_refused(bpy):
    bpy.ops.object.armature_add()
    with pytest.raises(RuntimeError, match="plays an action, but 'Armature' has none"):
        bpy.ops.mocapdb.extract()


def test_two_frames_are_refused(bpy, walking):
    settings = settings_of(bpy)
    settings.use_range, settings.first_frame = True, 149
    with pytest.raises(RuntimeError, match="of 4 frames or more, but 'walk' has 2"):
        bpy.ops.mocapdb.extract()
    assert played(walking).name == "walk"


def test_what_does_not_repeat_is_refused(bpy, walking):
    settings = settings_of(bpy)
    settings.use_range, settings.n_frames = True, 20
    with pytest.raises(RuntimeError, match="Expected a motion that repeats"):
        bpy.ops.mocapdb.extract()


def test_a_stretched_armature_is_refused(bpy, walking):
    walking.scale = (1, 1, 2)
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="Expected an armature of even scale"):
        bpy.ops.mocapdb.extract()


# -- real files ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["dataset-1_walk_normal_001.bvh", "dataset-2_run_normal_001.bvh"])
def test_a_walk_of_another_exporter_repeats(bpy, zoo, name):
    owner = import_bvh(bpy, zoo / "bandai" / name, global_scale=0.01)
    assert bpy.ops.mocapdb.extract() == {"FINISHED"}
    assert played(owner)["mocapdb_confidence"] > 0.5


def test_a_walk_of_the_corpus_repeats(bpy, corpus):
    (path,) = (corpus / "cmu" / "bvh").rglob("07_01.bvh")
    owner = import_bvh(bpy, path, global_scale=0.0564444)
    assert bpy.ops.mocapdb.extract() == {"FINISHED"}
    assert 0.8 < played(owner)["mocapdb_period_s"] < 1.5


# -- all or nothing --------------------------------------------------------------------------------


def standing(bpy):
    """An armature that plays an action in which nothing moves."""
    bpy.ops.object.armature_add()
    owner = bpy.context.object
    for frame in range(1, 80):
        owner.pose.bones[0].keyframe_insert("rotation_quaternion", frame=frame)
    return owner


def test_where_one_armature_is_refused_none_is_keyed(bpy, walking):
    other = standing(bpy)
    walking.select_set(True)
    other.select_set(True)
    names = {action.name for action in bpy.data.actions}
    with pytest.raises(RuntimeError, match="every frame has the same pose"):
        bpy.ops.mocapdb.extract()
    assert {action.name for action in bpy.data.actions} == names
    assert played(walking).name == "walk"


def test_a_refused_extraction_leaves_the_loop_that_plays(bpy, walking):
    bpy.ops.mocapdb.extract()
    settings = settings_of(bpy)
    settings.prime = 12
    with pytest.raises(RuntimeError, match="prime"):
        bpy.ops.mocapdb.extract()
    assert played(walking).name == "Periodic walk"
    settings.prime = 47
    bpy.ops.mocapdb.find_loops()
    assert played(walking).name == "Periodic walk"


def test_chosen_loops_are_those_of_their_action(bpy, walking):
    settings = settings_of(bpy)
    bpy.ops.mocapdb.find_loops()
    settings.found[0].chosen = True
    settings.use_range, settings.n_frames = True, 120
    bpy.ops.mocapdb.extract()
    assert played(walking).name == "Periodic walk"  # and not of loop 0
    assert not settings.found and not settings.found_for


def test_pictures_of_an_unsaved_file_need_a_folder(bpy, walking):
    settings = settings_of(bpy)
    settings.use_pictures = True
    with pytest.raises(RuntimeError, match="Save the file, or choose a folder"):
        bpy.ops.mocapdb.extract()
    settings.pictures = ""
    with pytest.raises(RuntimeError, match="Expected a folder for the pictures"):
        bpy.ops.mocapdb.extract()
    assert played(walking).name == "walk"
