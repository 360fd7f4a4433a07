"""The add-on as Blender sees it, and the process beside it."""

import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
from in_blender import import_bvh

import mocapdb


def test_it_registers_and_goes_away(bpy, addon):
    from bpy.types import Scene

    addon.unregister()
    assert not hasattr(Scene, "mocapdb_loops")
    addon.register()
    assert hasattr(Scene, "mocapdb_loops")
    for each in addon.CLASSES:
        assert each.is_registered
    labels = {each.bl_label for each in addon.panel.CLASSES if hasattr(each, "bl_label")}
    assert {"Periodic Motion", "Motion Library", "Faults"} <= labels


def test_its_version_is_mocapdbs(addon):
    import tomllib

    with (addon.panel.Path(addon.__file__).parent / "blender_manifest.toml").open("rb") as file:
        manifest = tomllib.load(file)
    assert manifest["version"] == mocapdb.__version__
    assert "network" not in manifest["permissions"]


def test_defaults_are_mocapdbs_own(scene):
    from mocapdb.cycles import Settings

    loops, usual = scene.mocapdb_loops, Settings()
    assert (loops.model, loops.harmonics, loops.prime) == (
        usual.model, usual.n_harmonics, usual.prime,
    )  # fmt: skip
    assert loops.use_velocities and loops.use_accelerations and not loops.use_epsilon


def test_undo_takes_an_action_back(bpy, walking):
    name = walking.name
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.mocapdb.extract("EXEC_DEFAULT", True)
    assert "Periodic walk" in bpy.data.actions
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        if not bpy.ops.ed.undo.poll():
            pytest.skip("this Blender keeps no undo steps without a window")
        bpy.ops.ed.undo()
    assert "Periodic walk" not in bpy.data.actions
    assert bpy.data.objects[name].animation_data.action.name == "walk"


class Layout:
    """A layout that refuses properties and operators that are not there, and notes the others."""

    def __init__(self, drawn):
        self.drawn = drawn

    def row(self, **_):
        return Layout(self.drawn)

    column = row

    def label(self, text, icon="NONE"):
        self.drawn.append(text)

    def prop(self, data, name, **_):
        assert name in data.bl_rna.properties, name
        self.drawn.append(name)

    def operator(self, name, **_):
        import bpy

        group, _, own = name.partition(".")
        assert own in dir(getattr(bpy.ops, group)), name
        self.drawn.append(name)
        return SimpleNamespace()

    def template_list(self, kind, name, data, listed, active, index, rows):
        assert {listed, index} <= set(data.bl_rna.properties.keys())


@pytest.mark.parametrize(
    ("panel", "shown"),
    [
        ("ExtractionPanel", {"mocapdb.extract", "subsample", "n_loops", "way_z"}),
        ("AdvancedPanel", {"model", "prime", "harmonics", "use_pictures"}),
        ("DiagramPanel", {"mocapdb.find_loops"}),
        ("LibraryPanel", {"path", "words", "rate", "0 clips", "mocapdb.import_clip"}),
        ("QueryPanel", {"mocapdb.query", "n_hits"}),
        ("AddPanel", {"mocapdb.add_action", "new_label", "mean_mm"}),
        ("CleaningPanel", {"mocapdb.clean", "use_threshold", "use_context"}),
    ],
)
def test_a_panel_draws_what_there_is(bpy, addon, panel, shown):
    drawn = []
    bpy.context.window_manager.mocapdb_work = ""
    drawing = SimpleNamespace(layout=Layout(drawn))
    getattr(addon.panel, panel).draw(drawing, bpy.context)
    assert shown <= set(drawn)


# -- work that goes on beside ----------------------------------------------------------------------


class Running:
    """An operator as Blender runs it, with a window that events come from."""

    def __init__(self, addon, kind):
        self.bl_label = "At work"
        self.reports = []
        self.work = kind
        for name in ("invoke", "modal", "_look", "_go_on", "_refuse", "_end"):
            method = getattr(addon.job_operator.JobOperator, name)
            setattr(self, name, method.__get__(self))

    def report(self, kind, text):
        self.reports.append((*kind, text))


def made_context():
    manager = SimpleNamespace(
        progress_begin=lambda *_: None, progress_update=lambda *_: None, progress_end=lambda: None,
        event_timer_add=lambda *_, **__: "timer", event_timer_remove=lambda _: None,
        modal_handler_add=lambda _: None, windows=[], mocapdb_work="",
    )  # fmt: skip
    return SimpleNamespace(window_manager=manager, window=None)


TIMER = SimpleNamespace(type="TIMER")


def run(operator, context, event=TIMER):
    until = time.monotonic() + 60
    while (state := operator.modal(context, event)) == {"PASS_THROUGH"}:
        assert time.monotonic() < until
        time.sleep(0.01)
    return state


def test_the_window_lives_on_while_the_worker_works(addon):
    seen = []

    def work(context):
        answer = yield addon.job_operator.Task("get_ready", {})
        seen.append(answer)

    context, operator = made_context(), Running(addon, work)
    assert operator.invoke(context, None) == {"RUNNING_MODAL"}
    assert context.window_manager.mocapdb_work == "At work"
    assert operator.modal(context, SimpleNamespace(type="MOUSEMOVE")) == {"PASS_THROUGH"}
    other = Running(addon, work)
    assert other.invoke(context, None) == {"CANCELLED"}
    assert "at work on something else" in other.reports[0][1]
    assert run(operator, context) == {"FINISHED"}
    assert seen == [{"compiled": True}] and not context.window_manager.mocapdb_work


@pytest.mark.parametrize("how", ["escape", "button"])
def test_a_task_is_broken_off(addon, how):
    seen = []

    def work(context):
        seen.append((yield addon.job_operator.Task("get_ready", {})))

    context, operator = made_context(), Running(addon, work)
    addon.WORKER.stop()  # so that it has to start, which takes a while
    operator.invoke(context, None)
    process = addon.WORKER._process
    event = SimpleNamespace(type="ESC") if how == "escape" else TIMER
    if how == "button":
        context.window_manager.mocapdb_work = ""
    assert operator.modal(context, event) == {"CANCELLED"}
    assert process.poll() is not None and not seen
    assert addon.WORKER.do("get_ready")  # the next task starts anew


def test_a_refusal_ends_the_operator_with_its_words(addon, tmp_path):
    def work(context):
        yield addon.job_operator.Task(
            "decode", {"library": str(tmp_path / "none"), "clip": "a", "frames": None,
                       "original": False, "fps": None, "target": None, "output": ""},
        )  # fmt: skip

    context, operator = made_context(), Running(addon, work)
    operator.invoke(context, None)
    assert run(operator, context) == {"CANCELLED"}
    assert operator.reports[0][0] == "ERROR" and "none" in operator.reports[0][1]


def test_what_fails_in_blender_ends_the_work(addon):
    def work(context):
        yield addon.job_operator.Task("get_ready", {})
        raise ReferenceError("the armature has been removed")

    context, operator = made_context(), Running(addon, work)
    ended = []
    context.window_manager.event_timer_remove = ended.append
    operator.invoke(context, None)
    with pytest.raises(ReferenceError):
        run(operator, context)
    assert ended == ["timer"] and not context.window_manager.mocapdb_work
    assert not addon.WORKER.busy


def test_a_worker_that_dies_is_told_and_replaced(addon):
    addon.WORKER.do("get_ready")
    addon.WORKER.start("get_ready")
    addon.WORKER._process.kill()
    with pytest.raises(addon.background.TaskError, match="ended before it had a result"):
        addon.WORKER.wait()
    assert addon.WORKER.do("get_ready")


def test_what_is_missing_is_named(addon):
    said = addon.background._said({"error": "ripser.ripser", "kind": "missing"})
    assert "needs the Python package ripser" in said and "make blender" in said


def test_the_list_needs_numpy_and_h5py_alone(addon, library):
    import subprocess

    code = (
        "import sys\n"
        "class Block:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.split('.')[0] in {'numba', 'scipy', 'sklearn', 'ripser', 'matplotlib',\n"
        "                'joblib', 'click', 'httpx', 'rich', 'pywt', 'PIL', 'sqlite_utils'}:\n"
        "            raise ModuleNotFoundError(name)\n"
        "sys.meta_path.insert(0, Block())\n"
        "from mocapdb.library import Library\n"
        "with Library(sys.argv[1]) as library:\n"
        "    print(len(library.records(search='walk')), sorted(library.classes()))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(library)], capture_output=True, text=True, check=True
    )
    assert done.stdout == "2 ['run', 'walk', 'wave']\n"


# -- seen ------------------------------------------------------------------------------------------


def test_results_are_seen(bpy, files, library, tmp_path):
    """A frame of each result, rendered: a body stands there, and no two are alike."""
    from rendered_bodies import render

    pictures = {}
    import_bvh(bpy, files / "walk.bvh", global_scale=0.0564444)
    pictures["source"] = render(bpy, bpy.context.object, 20, tmp_path / "source.png")
    bpy.ops.mocapdb.extract()
    pictures["loop"] = render(bpy, bpy.context.object, 200, tmp_path / "loop.png")
    bpy.context.scene.mocapdb_library.path = str(library)
    bpy.ops.mocapdb.import_clip(clip="wave_1")
    pictures["clip"] = render(bpy, bpy.context.object, 20, tmp_path / "clip.png")
    for picture in pictures.values():
        covered = (picture[..., 3] > 0.5).mean()
        assert 0.01 < covered < 0.5
        rows = np.flatnonzero((picture[..., 3] > 0.5).any(axis=1))
        assert np.ptp(rows) > 0.5 * len(picture)  # from head to foot
    assert np.abs(pictures["source"] - pictures["loop"]).max() > 0.1
