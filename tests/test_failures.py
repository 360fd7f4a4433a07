"""Everything that can be wrong with what a command is given, and what it says about it.

`small_library.run` checks that none of it ends in a traceback.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from motion_files import AMC, ASF, BVH
from small_library import (  # noqa: F401 - fixtures too
    run,
    run_json,
    small_corpus_template,
    small_library,
    small_library_template,
    sound,
)

from mocapdb.library import Library


@pytest.fixture
def tiny(tmp_path: Path) -> Path:
    """A corpus of three good clips, to which bad ones are added."""
    corpus = tmp_path / "corpus"
    for path, text in {"a/a.asf": ASF, "a/a_1.amc": AMC, "b.bvh": BVH, "c.bvh": BVH}.items():
        (corpus / path).parent.mkdir(parents=True, exist_ok=True)
        (corpus / path).write_text(text)
    return corpus


def failing(*arguments: object) -> str:
    """Run a command that fails; return its error, of one or two lines, on stderr alone."""
    answer = run(*arguments)
    assert answer.exit_code == 1
    assert answer.stdout == ""
    assert 1 <= len(answer.stderr.splitlines()) <= 2
    assert answer.stderr.startswith("mocapdb: ")
    return answer.stderr


class TestCorpusFolder:
    @pytest.mark.parametrize(
        ("name", "reason"),
        [
            ("empty", "expected motion files (.amc, .bvh, .npz, .glb, .gltf), but found none"),
            ("missing", "no such folder"),
            ("file.bvh", "expected a folder of motion files, but got a file"),
            ("skeletons", "found none"),
        ],
    )
    def test_no_corpus(self, tmp_path, name, reason):
        (tmp_path / "empty").mkdir()
        (tmp_path / "skeletons").mkdir()
        (tmp_path / "skeletons" / "a.asf").write_text(ASF)
        (tmp_path / "file.bvh").write_text(BVH)
        error = failing("build", tmp_path / name, "-o", tmp_path / "l.mocapdb")
        assert reason in error
        assert str(tmp_path / name) in error
        assert not (tmp_path / "l.mocapdb").exists()

    @pytest.mark.parametrize("kind", ["file", "other files", "file as parent"])
    def test_no_place_for_a_library(self, tiny, tmp_path, kind):
        place = tmp_path / "place"
        if kind == "other files":
            place.mkdir()
            (place / "thesis.txt").write_text("precious")
        else:
            place.write_text("precious")
        target = place / "l.mocapdb" if kind == "file as parent" else place
        error = failing("build", tiny, "-o", target)
        assert "file" in error or "Not a directory" in error
        kept = place / "thesis.txt" if kind == "other files" else place
        assert kept.read_text() == "precious"


BVH_LINES = BVH.count("\n")
THIGH_LINE = ASF[: ASF.index("length 7.5")].count("\n") + 1
SHIN_LINE = AMC[: AMC.index("shin 41")].count("\n") + 1
BAD_FILES = {  # content of a file of that name, and where and what is told about it
    "empty.bvh": (b"", ": ", "empty"),
    "binary.amc": (b"\x00\x01\x02\xff" * 50, ": ", "binary"),
    "cut.bvh": (BVH[: BVH.index("MOTION")].encode(), ": ", "MOTION"),
    "short.bvh": (BVH.replace("11.5\n", "\n").encode(), f":{BVH_LINES}: ", "12"),
    "word.bvh": (BVH.replace("4 5 6 7 8 9 10 11", "4 5 six 7 8 9 10 11").encode(), ":", "six"),
    "nan.bvh": (BVH.replace("11.5", "nan").encode(), f":{BVH_LINES}: ", "nan"),
    "count.bvh": (BVH.replace("Frames: 3", "Frames: 9").encode(), ":", "9"),
    "none.bvh": (BVH[: BVH.index("0 90 0 1 2")].replace("s: 3", "s: 0").encode(), ":", "frame"),
    "rate.bvh": (BVH.replace(".0083333", "0").encode(), f":{BVH_LINES - 3}: ", "positive"),
    "a/joint.amc": (AMC.replace("shin 41", "chin 41").encode(), f":{SHIN_LINE}: ", "chin"),
    "a/extra.amc": (AMC.replace("shin 41", "shin 41 42").encode(), f":{SHIN_LINE}: ", "shin"),
    "a/number.amc": (AMC.replace("shin 41", "shin x").encode(), f":{SHIN_LINE}: ", "x"),
    "a/missing.amc": (AMC.replace("shin 41\n", "").encode(), ":", "shin"),
    "a/inf.amc": (AMC.replace("shin 41", "shin inf").encode(), f":{SHIN_LINE}: ", "inf"),
    "alone/clip.amc": (AMC.encode(), ": ", "Expected one .asf in the folders beside"),
}


class TestBadFiles:
    @pytest.mark.parametrize("name", BAD_FILES)
    def test_it_is_reported_and_skipped_and_the_rest_is_built(self, tiny, tmp_path, name):
        content, where, what = BAD_FILES[name]
        (tiny / name).parent.mkdir(exist_ok=True)
        (tiny / name).write_bytes(content)
        library = tmp_path / "l.mocapdb"
        answer = run("build", tiny, "-o", library, "--jobs", 1)
        assert answer.exit_code == 1
        # a slow machine also says how far it is
        (said,) = [line for line in answer.stderr.splitlines() if "Building" not in line]
        assert said.startswith(f"skipped {tiny / name}{where}")
        assert what in said
        assert "built 3 clips" in answer.stdout
        assert sound(library)

        error = failing("build", tiny, "-o", tmp_path / "s.mocapdb", "--jobs", 1, "--strict")
        assert f"{tiny / name}{where}" in error
        assert sound(tmp_path / "s.mocapdb")

    def test_a_bad_skeleton_fails_all_its_clips(self, tiny, tmp_path):
        (tiny / "a/a.asf").write_text(ASF.replace("length 7.5", "length -7.5"))
        (tiny / "a/a_2.amc").write_text(AMC)
        answer = run_json("build", tiny, "-o", tmp_path / "l", "--jobs", 1, exit_code=1)
        assert answer["built"] == 2
        assert [failure["path"] for failure in answer["failed"]] == [str(tiny / "a/a.asf")] * 2
        assert {failure["line"] for failure in answer["failed"]} == {THIGH_LINE}

    def test_a_file_that_cannot_be_fetched(self, tiny, tmp_path):
        (tiny / "gone.bvh").symlink_to(tiny / "nowhere.bvh")
        (tiny / "folder.bvh").mkdir()
        answer = run("build", tiny, "-o", tmp_path / "l.mocapdb", "--jobs", 1)
        assert answer.exit_code == 1
        assert "gone.bvh: cannot read (No such file or directory)" in answer.stderr
        assert "built 3 clips" in answer.stdout

    @pytest.mark.skipif(os.name != "posix", reason="names are bytes on POSIX only")
    def test_a_name_that_is_no_text(self, tiny, tmp_path):
        (tiny / os.fsdecode(b"\xff.bvh")).write_text(BVH)
        for name in ("two\nlines.bvh", "ünï 'quoted' \"name\".bvh", "-o.bvh"):
            (tiny / name).write_text(BVH)
        answer = run_json("build", tiny, "-o", tmp_path / "l.mocapdb", "--jobs", 1, exit_code=1)
        (failure,) = answer["failed"]
        assert "Expected a file name in UTF-8" in failure["reason"]
        assert answer["built"] == 6
        for command in (["ls"], ["info"], ["verify"]):
            assert run(*command, tmp_path / "l.mocapdb").exit_code == 0
        name = "ünï 'quoted' \"name\""
        assert run("export", tmp_path / "l.mocapdb", name, "-o", tmp_path / "o.bvh").exit_code == 0


class TestLabels:
    @pytest.mark.parametrize(
        ("content", "where", "what"),
        [
            ("clip,class\na_1,walk\n", ":1: ", "label"),
            ("label\nwalk\n", "", "clip"),
            ("", "", "label"),
            ("clip,label,fps\na_1,walk,fast\n", ":2: ", "fast"),
            ("path,label\na/a_1.amc,x\na/a_1.amc,y\n", ":3: ", "line 2"),
        ],
    )
    def test_bad_labels(self, tiny, tmp_path, content, where, what):
        labels = tmp_path / "mine.csv"
        labels.write_text(content)
        error = failing("build", tiny, "-o", tmp_path / "l.mocapdb", "--labels", labels)
        assert f"{labels}{where}" in error
        assert what in error
        (tiny / "LABELS.csv").write_text(content)
        assert what in failing("build", tiny, "-o", tmp_path / "l.mocapdb")

    @pytest.mark.parametrize("option", ["--labels", "--manifest"])
    def test_a_table_that_is_missing(self, tiny, tmp_path, option):
        error = failing("build", tiny, "-o", tmp_path / "l.mocapdb", option, tmp_path / "no.csv")
        assert "no.csv" in error
        assert not (tmp_path / "l.mocapdb").exists()

    def test_a_manifest_without_a_column(self, tiny, tmp_path):
        manifest = tmp_path / "manifest.csv"
        manifest.write_text("clip,subject\n02_01,02\n")
        error = failing("build", tiny, "-o", tmp_path / "l.mocapdb", "--manifest", manifest)
        assert f"{manifest}:1: " in error
        assert "class" in error


class TestClips:
    def test_an_unknown_clip(self, small_library, tmp_path):  # noqa: F811
        for command in (["info", small_library, "01_0"],
                        ["export", small_library, "01_0", "-o", tmp_path / "o.bvh"]):  # fmt: skip
            assert "no clip is named '01_0'. Did you mean: 01_0" in failing(*command)

    def test_an_ambiguous_stem(self, small_library, tmp_path):  # noqa: F811
        for command in (["info", small_library, "both"],
                        ["export", small_library, "both", "-o", tmp_path / "o.npz"]):  # fmt: skip
            assert "'both' is ambiguous. Use one of: 01/both, bvh/both." in failing(*command)

    def test_a_class_that_does_not_exist(self, small_library):  # noqa: F811
        error = failing("ls", small_library, "--class", "salsa")
        assert "no clip has class 'salsa'. It has: box, run, squat, walk, wave." in error

    @pytest.mark.parametrize(
        ("target", "what"),
        [
            ("missing/o.bvh", "No such file or directory"),
            (
                "o.xyz",
                ".npz, .csv, .fbx, .glb, .gif, .mp4, .html, but got '.xyz'",
            ),
            ("o.fbx", "Expected Blender in '/no/blender/for/tests', but there is no such program"),
            ("o", "but got ''"),
        ],
    )
    def test_a_target_that_cannot_be(self, small_library, tmp_path, target, what):  # noqa: F811
        out = tmp_path / "out"
        out.mkdir()
        source = tmp_path / "in.bvh"
        source.write_text(BVH)
        assert what in failing("export", small_library, "01_01", "-o", out / target)
        assert what in failing("convert", source, out / target)
        assert list(out.iterdir()) == []

    def test_a_clip_of_one_joint_and_of_one_frame(self, tiny, tmp_path):
        one_frame = BVH.replace("Frames: 3", "Frames: 1").splitlines()[:-2]
        (tiny / "frame.bvh").write_text("\n".join(one_frame) + "\n")
        library = tmp_path / "l.mocapdb"
        assert run("build", tiny, "-o", library, "--jobs", 1).exit_code == 0
        with Library(library) as opened:
            assert len(opened.clip("frame")) == 1


class TestScheduler:
    @pytest.mark.parametrize(
        "address",
        [pytest.param("tcp://127.0.0.1:1", marks=pytest.mark.slow), "nonsense", "tcp://"],
    )
    @pytest.mark.filterwarnings("ignore")  # a client that fails leaves its loop open
    def test_an_address_where_nobody_is(self, tiny, tmp_path, address):
        pytest.importorskip("distributed")
        error = failing("build", tiny, "-o", tmp_path / "l.mocapdb", "--scheduler", address)
        assert f"{address}: no Dask scheduler answers" in error

    def test_without_distributed(self, tiny, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "distributed", None)
        error = failing("build", tiny, "-o", tmp_path / "l.mocapdb", "--scheduler", "tcp://x:1")
        assert "pip install 'mocapdb[distributed]'" in error
