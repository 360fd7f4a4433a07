"""Folders with files that hold several takes: each is a clip, and stays the one that it was.

`fake_blender` stands in for Blender.
"""

from __future__ import annotations

import sys

import pytest
from fake_blender import make_blender, scene
from small_library import QUICK, run_json
from small_library import run as run_command

from mocapdb import build_library
from mocapdb.corpus import synthetic
from mocapdb.errors import CorpusError
from mocapdb.io import ReadOptions, write_clip
from mocapdb.io.blender.process import shared_blender
from mocapdb.io.blender.program import find_blender
from mocapdb.library import Library
from mocapdb.library.naming import SourceFile, clip_names, file_and_take, source_of, stem_of

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the program is a script")


@pytest.fixture(scope="module")
def blender(tmp_path_factory):
    path = make_blender(tmp_path_factory.mktemp("bin"))
    yield path
    shared_blender(find_blender("x.fbx", path)).close()


@pytest.fixture
def folder(tmp_path):
    """A walk in one file, and two takes in another."""
    folder = tmp_path / "corpus"
    (folder / "Ann").mkdir(parents=True)
    scene(folder / "one.fbx")
    scene(folder / "Ann" / "day.FBX", "two")
    return folder


@pytest.fixture
def built(folder, blender, tmp_path):
    """What builds the folder's library again, and its clips by name."""

    def again(**options):
        library = tmp_path / "l.mocapdb"
        report = build_library(
            folder, library, options.pop("settings", QUICK), jobs=1, index=False,
            reading=ReadOptions(blender=blender), **options,
        )  # fmt: skip
        with Library(library) as opened:
            return report, {record.name: record for record in opened.records()}

    return again


def test_each_take_is_a_clip(built, folder):
    report, clips = built()
    assert (report.built, report.failed) == (3, [])
    assert set(clips) == {"one", "day_Walk", "day_Run_fast"}
    run = clips["day_Run_fast"]
    assert (run.source, run.stem, run.frames) == ("Ann/day.FBX#Run_fast", "day_Run_fast", 8)
    assert (run.label, run.columns["take"]) == ("Ann", "Run_fast")
    assert "take" not in clips["one"].columns
    sizes = [record.source_bytes for name, record in clips.items() if name != "one"]
    assert sum(sizes) == pytest.approx((folder / "Ann" / "day.FBX").stat().st_size, abs=1)


def test_what_is_there_is_skipped(built):
    _, before = built()
    report, after = built()
    assert (report.built, report.skipped) == (0, 3)
    assert after == before


def test_labels_may_name_a_take(built, folder):
    rows = ["clip,label", "day,walk", "day_Run_fast,run"]
    (folder / "LABELS.csv").write_text("\n".join(rows) + "\n")
    report, clips = built()
    assert [clips[name].label for name in ("day_Walk", "day_Run_fast")] == ["walk", "run"]
    assert not [line for line in report.assumed.warnings if "fit no file" in line]
    rows[2] = "day_Run_fast,dash"
    (folder / "LABELS.csv").write_text("\n".join(rows) + "\n")
    report, clips = built()
    assert report.built == 0
    assert [clips[name].label for name in ("day_Walk", "day_Run_fast")] == ["walk", "dash"]


def test_a_changed_file_replaces_its_takes(built, folder):
    _, before = built()
    scene(folder / "Ann" / "day.FBX", "two, of another day")
    report, after = built()
    assert (report.built, report.skipped, set(after)) == (2, 1, set(before))
    assert after["one"].id == before["one"].id
    assert after["day_Walk"].id != before["day_Walk"].id
    assert built()[0].skipped == 3


def test_a_take_that_is_gone_keeps_its_clip(built, folder):
    _, before = built()
    scene(folder / "Ann" / "day.FBX", "takes")  # Walk and Run, and no Run fast
    report, after = built()
    assert report.built == 2
    assert set(after) == {"one", "day_Walk", "day_Run", "day_Run_fast"}
    assert after["day_Run_fast"].id == before["day_Run_fast"].id
    assert built()[0].skipped == 3


def test_one_motion_becomes_several_and_the_other_way_round(built, folder):
    _, before = built()
    scene(folder / "one.fbx", "two of them now")
    report, after = built()
    assert report.built == 2
    assert set(after) == {"one_Walk", "one_Run_fast", "day_Walk", "day_Run_fast"}
    assert before["one"].id not in {record.id for record in after.values()}
    scene(folder / "one.fbx", "and now again a single one")
    report, after = built()
    assert report.built == 1
    assert set(after) == {"one", "one_Run_fast", "day_Walk", "day_Run_fast"}
    assert built()[0].skipped == 3


def test_other_settings_read_a_file_once_more(built):
    from mocapdb import BuildSettings, Target

    _, before = built()
    report, after = built(settings=BuildSettings(Target("max_mm", 9.0)))
    assert (report.built, set(after)) == (3, set(before))


def test_a_file_that_moved_keeps_its_takes(built, folder):
    _, before = built()
    (folder / "Ann" / "day.FBX").rename(folder / "night.fbx")
    report, after = built()
    assert (report.built, report.skipped) == (0, 3)
    assert after["night_Walk"].id == before["day_Walk"].id
    assert after["night_Run_fast"].source == "night.fbx#Run_fast"


def test_names_that_are_taken(built, folder):
    write_clip(synthetic.make_clip("walk", seed=1, duration_s=0.5), folder / "day_Walk.bvh")
    report, clips = built()
    assert (report.built, report.failed) == (4, [])
    assert len(clips) == 4
    assert built()[0].skipped == 4


def test_a_file_is_built_whole_or_not_at_all(built, folder):
    for word in ("crash", "refuse", "pose"):
        scene(folder / f"{word}.fbx", word)
    report, clips = built()
    assert set(clips) == {"one", "day_Walk", "day_Run_fast"}
    reasons = {failure.path.rsplit("/", 1)[1]: failure.reason for failure in report.failed}
    assert set(reasons) == {"crash.fbx", "refuse.fbx", "pose.fbx"}
    assert "stopped with exit code 7" in reasons["crash.fbx"]
    assert "only stands in its pose" in reasons["pose.fbx"]


def test_scenes_without_motion_are_left_alone(built, folder):
    (folder / "chair.fbx").write_text("; FBX 7.4.0 project file\n")
    report, clips = built()
    assert (len(clips), report.failed) == (3, [])
    assert report.assumed.left_alone == {".fbx without a skeleton that moves": 1}


class TestWithoutBlender:
    def test_other_files_are_built_and_a_line_says_why(self, folder, tmp_path):
        write_clip(synthetic.make_clip("walk", seed=1, duration_s=0.5), folder / "walk.bvh")
        report = build_library(folder, tmp_path / "l.mocapdb", QUICK, jobs=1, index=False)
        assert (report.built, report.failed) == (1, [])
        assert report.assumed.left_alone == {".fbx by way of Blender": 2}
        (warning,) = report.assumed.warnings
        assert warning.startswith("2 files are read by way of Blender, and were left alone")
        assert "Install Blender 4.5 or later" in warning

    def test_nothing_else_is_there(self, folder, tmp_path):
        with pytest.raises(CorpusError, match=r"expected Blender, by way of which files such as"):
            build_library(folder, tmp_path / "l.mocapdb", QUICK, jobs=1)


@pytest.mark.parametrize("command", [("clean", "--detect-only"), ("cycle",), ("gait",)])
def test_other_commands_take_a_folders_scenes_too(command, folder, blender):
    refused = run_command(*command, folder)
    assert refused.exit_code == 1
    assert "expected Blender, by way of which files such as" in refused.stderr
    write_clip(synthetic.make_clip("walk", seed=1, duration_s=2), folder / "walk.bvh")
    without = run_command(*command, folder)
    assert "2 files are read by way of Blender, and were left alone" in without.stderr
    read = run_command(*command, folder, "--blender", blender)
    assert "day.FBX: 'Walk' is read, and" in read.stderr  # of its takes the first
    assert "left alone" not in read.stderr


def test_the_command(folder, blender, tmp_path):
    library = tmp_path / "l.mocapdb"
    answer = run_json(
        "build", folder, "-o", library, "--jobs", 1, "--no-index", "--blender", blender
    )
    assert answer["built"] == 3
    told = run_json("info", library, "day_Walk")
    assert told["source"] == "Ann/day.FBX#Walk"
    answer = run_command("build", folder, "-o", library, "--take", "Walk")
    assert answer.exit_code == 2
    assert "every take of a file becomes a clip" in answer.stderr


def test_names_of_takes():
    assert file_and_take("a/b.usdz#Run") == ("a/b.usdz", "Run")
    assert file_and_take("a#b/c.bvh") == ("a#b/c.bvh", "")
    assert file_and_take("a.fbx#b.bvh") == ("a.fbx#b.bvh", "")
    assert source_of("a.fbx", "") == "a.fbx"
    assert stem_of(source_of("a/b.fbx", "Run")) == "b_Run"
    files = {key: SourceFile("/c", key) for key in ("a/b.fbx#Run", "a/b.fbx#Walk", "d/b.fbx#Run")}
    assert set(clip_names(files).values()) == {"a/b_Run", "b_Walk", "d/b_Run"}
