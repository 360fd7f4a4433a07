"""Files by way of Blender: what comes of its answers, and what is said where it has none.

`fake_blender` stands in for it; tests/blender asks the real one.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from fake_blender import make_blender, scene
from small_library import run, run_json

from mocapdb.corpus import synthetic
from mocapdb.errors import FormatError
from mocapdb.io import ReadOptions, read_clip, write_clip
from mocapdb.io.blender import process as process_module
from mocapdb.io.blender import scenes
from mocapdb.io.blender.fbx_header import FbxHeader
from mocapdb.io.blender.process import BlenderError, BlenderProcess, shared_blender
from mocapdb.io.blender.program import VARIABLE, blender_is_there, find_blender

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the program is a script")


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    path = make_blender(tmp_path_factory.mktemp("bin"))
    yield path
    shared_blender(find_blender("x.fbx", path)).close()


@pytest.fixture
def blender(program, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(program))
    return program


class TestReading:
    def test_a_clip_has_the_files_unit_axis_and_rate(self, blender, tmp_path):
        clip = read_clip(scene(tmp_path / "walk.fbx", unit_cm=1.0))
        assert clip.skeleton.names == ("hips", "spine", "spine_End")
        assert (clip.skeleton.metres_per_unit, clip.skeleton.up) == (0.01, "y")
        assert (clip.unit_source, clip.up_source, clip.fps_source) == ("file", "file", "file")
        assert clip.fps == pytest.approx(30000 / 1001, rel=1e-12)
        assert np.allclose(clip.skeleton.offsets[1:], [[0, 10, 0], [0, 10, 0]], atol=1e-4)
        assert clip.skeleton.dofs[2] == ()  # it only ends the spine
        positions = clip.positions("file", "file")
        assert np.allclose(positions[:, 0, 0], np.arange(12), atol=1e-4)  # centimetres along x
        assert np.allclose(positions[:, :, 1], [100, 110, 120], atol=1e-4)
        turns = clip.rotations("global", "matrix")
        angle = np.arange(12) / 10
        assert np.allclose(turns[:, 0, 0, 2], np.sin(angle), atol=1e-6)  # about y, now

    def test_z_may_be_up(self, blender, tmp_path):
        clip = read_clip(scene(tmp_path / "walk.fbx", up=2))
        assert clip.skeleton.up == "z"
        assert np.allclose(clip.positions("file", "file")[:, :, 2], [1.0, 1.1, 1.2], atol=1e-6)
        metres = clip.positions()
        assert np.allclose(metres[:, :, 1], [1.0, 1.1, 1.2], atol=1e-6)

    def test_what_the_caller_says_wins(self, blender, tmp_path):
        clip = read_clip(scene(tmp_path / "walk.fbx"), ReadOptions(unit_m=0.01, fps=10))
        assert (clip.skeleton.metres_per_unit, clip.unit_source) == (0.01, "caller")
        assert (clip.fps, clip.fps_source) == (10, "caller")

    def test_takes_and_actors(self, blender, tmp_path):
        two = scene(tmp_path / "two.fbx", "two")
        assert [key for key, _ in scenes.read_scene(two)] == ["Walk", "Run fast"]
        assert len(read_clip(two)) == 12
        assert "warning: 'Walk' is read, and 'Run fast' left out" in read_clip(two).provenance
        run_fast = read_clip(two, ReadOptions(take="run FAST"))
        assert len(run_fast) == 8 and not run_fast.provenance
        with pytest.raises(FormatError, match="a take out of 'Walk', 'Run fast', but got 'Jog'"):
            read_clip(two, ReadOptions(take="Jog"))
        actors = scene(tmp_path / "actors.fbx", "actors")
        assert [key for key, _ in scenes.read_scene(actors)] == ["Ann", "Bob"]

    def test_roots_hang_on_the_object(self, blender, tmp_path):
        clip = read_clip(scene(tmp_path / "roots.fbx", "roots"))
        assert clip.skeleton.names == ("Ann", "hips", "spine", "spine_End")
        assert clip.skeleton.parents.tolist() == [-1, 0, 1, 0]
        assert np.allclose(clip.positions()[:, 3, 1], 1.2, atol=1e-6)

    @pytest.mark.parametrize(("off_m", "channels"), [(0.85e-4, 9), (1.15e-4, 12)])
    def test_single_precision_moves_no_joint(self, off_m, channels):
        worlds = np.tile(np.eye(4)[:3], (20, 2, 1, 1))
        worlds[:, :, 0, 3] = 100.0  # metres away
        worlds[:, 1, 2, 3] = 0.5
        worlds[7, 1, 2, 3] += off_m
        rest = np.tile(np.eye(4), (2, 1, 1))
        rest[1, 2, 3] = 0.5
        told = {"names": ["hips", "head"], "parents": [-1, 0], "fps": 30.0, "keyed": True}
        arrays = {"rest_0": rest, "worlds_0": worlds}
        clip = scenes._clip("far.fbx", told, arrays, 0, FbxHeader(), None, True)
        assert clip.skeleton.n_channels == channels

    def test_the_command_converts(self, blender, tmp_path):
        two = scene(tmp_path / "two.fbx", "two")
        answer = run_json("convert", two, tmp_path / "run.bvh", "--take", "run fast")
        assert (answer["frames"], answer["unit_m_source"]) == (8, "file")
        assert "End Site" in (tmp_path / "run.bvh").read_text()

    def test_other_formats_have_no_takes(self, tmp_path):
        write_clip(synthetic.make_clip("walk", seed=1, duration_s=0.2), tmp_path / "walk.bvh")
        with pytest.raises(FormatError, match="Expected no take"):
            read_clip(tmp_path / "walk.bvh", ReadOptions(take="Walk"))


class TestTrouble:
    def test_without_blender_a_line_says_what_is_needed(self, tmp_path, monkeypatch):
        monkeypatch.delenv(VARIABLE, raising=False)
        monkeypatch.setenv("PATH", str(tmp_path))
        monkeypatch.setattr("mocapdb.io.blender.program.find_spec", lambda _: None)
        assert not blender_is_there()
        walk = scene(tmp_path / "walk.fbx")
        answer = run("convert", walk, tmp_path / "walk.bvh")
        assert answer.exit_code == 1
        assert len(answer.stderr.splitlines()) == 1
        assert "Install Blender 4.5 or later, or its module (pip install bpy)" in answer.stderr
        answer = run("convert", walk, tmp_path / "walk.bvh", "--blender", tmp_path / "none")
        assert "none', but there is no such program" in answer.stderr

    def test_bpy_is_run_by_this_python(self, tmp_path, monkeypatch):
        monkeypatch.delenv(VARIABLE, raising=False)
        monkeypatch.setenv("PATH", str(tmp_path))
        monkeypatch.setattr("mocapdb.io.blender.program.find_spec", lambda name: name == "bpy")
        assert find_blender("x.fbx").command[0] == sys.executable

    @pytest.mark.parametrize(
        ("word", "message"),
        [
            ("refuse", "Blender says: not an FBX"),
            ("mesh", "Expected a skeleton, but the file holds 2 mesh"),
            ("pose", "Expected an animation, but the skeleton 'Ann' only stands in its pose"),
            ("crash", "it stopped with exit code 7: .*out of its depth"),
        ],
    )
    def test_the_next_file_is_read(self, blender, tmp_path, word, message):
        bad, good = scene(tmp_path / "bad.fbx", word), scene(tmp_path / "good.fbx", "noise")
        with pytest.raises(FormatError, match=message) as told:
            read_clip(bad)
        assert told.value.path == str(bad)
        assert len(read_clip(good)) == 12

    def test_it_is_ended_when_it_does_not_answer(self, blender, tmp_path, monkeypatch):
        monkeypatch.setattr(scenes, "BLENDER_S", 0.5)
        with pytest.raises(FormatError, match=r"an answer of Blender within 0\.5.* s, but"):
            read_clip(scene(tmp_path / "bad.fbx", "hang"))
        monkeypatch.undo()
        monkeypatch.setenv(VARIABLE, str(blender))
        assert len(read_clip(scene(tmp_path / "good.fbx"))) == 12

    def test_there_is_no_file(self, blender, tmp_path):
        with pytest.raises(FormatError, match="Expected a motion file, but there is none"):
            read_clip(tmp_path / "none.fbx")

    def test_an_old_one_is_told(self, tmp_path):
        old = make_blender(tmp_path, usable=False)
        with pytest.raises(FormatError, match=r"Expected Blender 4\.5 or later, but got 9\.9"):
            read_clip(scene(tmp_path / "walk.fbx"), ReadOptions(blender=old))

    def test_a_program_that_cannot_be_started(self, tmp_path):
        path = tmp_path / "blender"
        path.write_text("#!/nowhere/at/all\n")
        path.chmod(0o755)
        with pytest.raises(FormatError, match="Expected to start Blender, but cannot"):
            read_clip(scene(tmp_path / "walk.fbx"), ReadOptions(blender=path))

    @pytest.mark.parametrize(
        ("prints", "patience_s", "message"),
        [
            (
                """while :; do echo noise; sleep 0.1; done""",
                1.0,
                "Blender within 1 s, but it gave none",
            ),
            (
                """while :; do echo '{"a": 1}'; sleep 0.1; done""",
                1.0,
                "try again, or allow more seconds",
            ),
            (
                """echo '{"version": "9.9"}'; sleep 600""",
                300.0,
                r"Expected Blender 4\.5 or later, but got 9",
            ),
        ],
    )
    def test_what_is_no_blender_is_given_up(
        self, tmp_path, monkeypatch, prints, patience_s, message
    ):
        monkeypatch.setattr(process_module, "START_S", patience_s)
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        path = tmp_path / "blender"
        path.write_text(f"#!/bin/sh\n{prints}\n")
        path.chmod(0o755)
        began = time.monotonic()
        with pytest.raises(FormatError, match=message):
            read_clip(scene(tmp_path / "walk.fbx"), ReadOptions(blender=path))
        assert time.monotonic() - began < 120
        assert not list(tmp_path.glob("mocapdb-blender-*"))

    def test_more_seconds_may_be_allowed(self, tmp_path, monkeypatch):
        path = make_blender(tmp_path)
        monkeypatch.setattr(process_module, "START_S", 0.0)
        monkeypatch.setenv(process_module.PATIENCE, "60")
        assert len(read_clip(scene(tmp_path / "walk.fbx"), ReadOptions(blender=path))) == 12
        process = shared_blender(find_blender("x.fbx", path))
        for is_running in (True, False):
            monkeypatch.setenv(process_module.PATIENCE, "long")
            with pytest.raises(FormatError, match="to be a number of seconds, but got 'long'"):
                read_clip(tmp_path / "walk.fbx", ReadOptions(blender=path))
            assert (process._process is not None) == is_running
            monkeypatch.setenv(process_module.PATIENCE, "60")
            if is_running:  # and the next answer is that of the next file
                two = scene(tmp_path / "two.fbx", "two")
                clip = read_clip(two, ReadOptions(take="Run fast", blender=path))
                assert len(clip) == 8
            process.close()

    def test_a_python_without_bpy_is_told(self, tmp_path):
        path = tmp_path / "python3"
        error = "ModuleNotFoundError: No module named 'bpy'"
        path.write_text(f'#!/bin/sh\necho "{error}" >&2\nexit 1\n')
        path.chmod(0o755)
        with pytest.raises(FormatError, match=r"has no module bpy\. Install Blender") as told:
            read_clip(scene(tmp_path / "walk.fbx"), ReadOptions(blender=path))
        assert "ModuleNotFoundError" not in str(told.value)

    def test_the_time_grows_with_the_file(self, tmp_path):
        path = tmp_path / "large.fbx"
        path.write_bytes(bytes(3_000_000))
        assert scenes.time_limit(path) == pytest.approx(126.0)


class TestProcess:
    def test_one_reads_many_files_without_anybodys_settings(self, program, tmp_path, monkeypatch):
        log = tmp_path / "log"
        monkeypatch.setenv("FAKE_BLENDER_LOG", str(log))
        own = BlenderProcess(find_blender("x.fbx", program))
        for name in ("a.fbx", "b.fbx"):
            answer = own.ask(
                {"do": "read", "path": str(scene(tmp_path / name)), "out": str(tmp_path / "o")}, 20
            )
            assert len(answer["clips"]) == 1
        (settings,) = log.read_text().split()
        folder = Path(settings).parent
        assert folder == own.folder and not Path(settings).exists()
        own.close()
        assert not folder.exists()
        own.close()  # nothing is left to do

    def test_it_is_shared(self, program):
        found = find_blender("x.fbx", program)
        assert shared_blender(found) is shared_blender(found)

    def test_it_starts_anew_after_a_crash(self, program, tmp_path):
        own = BlenderProcess(find_blender("x.fbx", program))
        request = {"do": "read", "out": str(tmp_path / "o")}
        with pytest.raises(BlenderError, match="exit code 7"):
            own.ask(request | {"path": str(scene(tmp_path / "bad.fbx", "crash"))}, 20)
        assert own.ask(request | {"path": str(scene(tmp_path / "good.fbx"))}, 20)["clips"]
        own.close()

    def test_a_start_takes_no_longer_than_it_may(self, tmp_path, monkeypatch):
        path = tmp_path / "blender"
        path.write_text("#!/bin/sh\nexec sleep 60\n")
        path.chmod(0o755)
        monkeypatch.setattr(process_module, "START_S", 0.2)
        with pytest.raises(BlenderError, match=r"within 0\.2 s"):
            BlenderProcess(find_blender("x.fbx", path)).ask({"do": "read"}, 1)


class TestWriting:
    def test_what_blender_is_told(self, blender, tmp_path):
        clip = synthetic.make_clip("walk", seed=1, duration_s=0.5)
        written = write_clip(clip, tmp_path / "walk.fbx")
        told = json.loads((tmp_path / "walk.fbx").read_text())
        assert written.skeleton.convention == "bvh"
        assert told["names"] == list(written.skeleton.names)
        assert told["parents"] == written.skeleton.parents.tolist()
        assert told["unit_m"] == clip.skeleton.metres_per_unit
        assert (told["up"], told["fps"], told["shifting"]) == ("y", 120, [0])
        joints = len(told["names"])
        assert told["shapes"] == {
            "heads": [joints, 3],
            "tails": [joints, 3],
            "quat_wxyz": [60, joints, 4],
            "shifts": [60, 1, 3],
        }
        assert "is called" in written.provenance[-1]  # names of over ten letters

    def test_the_command_exports(self, program, small_library_template, tmp_path):
        answer = run_json(
            "export", small_library_template, "01_01", "-o", tmp_path / "walk.fbx",
            "--blender", program,
        )  # fmt: skip
        told = json.loads((tmp_path / "walk.fbx").read_text())
        assert told["shapes"]["quat_wxyz"][0] == answer["frames"]

    def test_without_blender_nothing_is_written(self, tmp_path, monkeypatch):
        monkeypatch.setenv(VARIABLE, str(tmp_path / "none"))
        with pytest.raises(FormatError, match="no such program"):
            write_clip(synthetic.make_clip("walk", seed=1, duration_s=0.2), tmp_path / "walk.fbx")
        assert not list(tmp_path.iterdir())

    def test_bones_have_a_length(self):
        from mocapdb.io.blender.fbx_writing import _bones
        from mocapdb.motion.skeleton import Skeleton

        skeleton = Skeleton(
            ["root", "same", "tip"], [-1, 0, 1], np.zeros((3, 3)), [(), (), ()], ["", "", ""],
            convention="bvh", metres_per_unit=0.01,
        )  # fmt: skip
        heads, tails = _bones(skeleton, skeleton.rest_positions)
        assert np.allclose(np.linalg.norm(tails - heads, axis=1), 1.0)  # a centimetre


def test_folders_take_scenes_that_may_move(tmp_path):
    assert scenes.may_move(scene(tmp_path / "walk.fbx"))
    (tmp_path / "chair.fbx").write_text("; FBX 7.4.0 project file\n")
    assert not scenes.may_move(tmp_path / "chair.fbx")
    (tmp_path / "chair.dae").write_text("<COLLADA/>")
    assert not scenes.may_move(tmp_path / "chair.dae")
    (tmp_path / "empty.fbx").write_bytes(b"")
    assert scenes.may_move(tmp_path / "empty.fbx")  # whoever reads it learns what is wrong
    assert scenes.may_move(tmp_path / "any.usda")
