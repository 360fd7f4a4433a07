"""A build tells what it took for granted, and a library keeps it."""

from __future__ import annotations

import json
import sqlite3
import struct

import made_bodies as made
import numpy as np
import pytest
from small_library import CLIPS, NAMES, OPTIONS, build, decoded, made_older, rows, run, run_json

from mocapdb.corpus import synthetic
from mocapdb.errors import FormatError, LibraryError
from mocapdb.io import find_motion_files, read_clip, write_clip
from mocapdb.library import Library
from mocapdb.motion.clip import Clip
from mocapdb.scenes.gltf import write_glb

HAND = """\
HIERARCHY
ROOT wrist
{
  OFFSET 0 0 0
  CHANNELS 3 Zrotation Xrotation Yrotation
  JOINT finger
  {
    OFFSET 0 4 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 3 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
0 0 0 0 0 0
0 0 0 0 0 10
"""


@pytest.fixture
def odd_corpus(small_corpus):
    """The small corpus with a hand, a file to be mended, a giant, an NPZ and files of others."""
    (small_corpus / "hand.bvh").write_text(HAND)
    text = (small_corpus / "bvh" / "both.bvh").read_text()
    (small_corpus / "short.bvh").write_text(text.replace("Frames: 120", "Frames: 121"))
    clip = synthetic.make_clip("walk", seed=3, skeleton=synthetic.make_skeleton(3.1), duration_s=1)
    write_clip(clip, small_corpus / "giant.npz")
    for name in ("a.fbx", "b.FBX", "c.c3d", ".hidden"):
        (small_corpus / name).write_text("no scene")
    return small_corpus


class TestOfABuild:
    def test_the_report_counts_by_value_and_source(self, odd_corpus, tmp_path):
        report = build(odd_corpus, tmp_path / "l.mocapdb", index=True)
        assumed = report.assumed
        assert report.built == len(CLIPS) + 3
        rates = {(row["value"], row["source"]): row["clips"] for row in assumed.fps}
        assert rates[60.0, "labels"] == 1
        for counted in (assumed.unit_m, assumed.up, assumed.fps, assumed.body, assumed.subject):
            assert sum(row["clips"] for row in counted) == len(CLIPS) + 3
        bodies = {row["value"]: row["clips"] for row in assumed.body}
        assert bodies == {"human": len(CLIPS) + 2, "no whole human": 1}
        assert list(assumed.mended) == ["short"]
        assert "Frames" in assumed.mended["short"][0]
        assert list(assumed.unsearchable) == ["hand"]
        assert assumed.left_alone == {".fbx without a skeleton that moves": 2, ".c3d": 1}
        (warning,) = assumed.warnings
        assert warning.startswith("giant: a stature of 3.")

    def test_the_command_says_it(self, odd_corpus, tmp_path):
        result = run("build", odd_corpus, "-o", tmp_path / "l.mocapdb", *OPTIONS)
        assert result.exit_code == 0
        for words in (
            "rate          120 frames/s",
            "60 frames/s (1), from the labels",
            "mended        1 clip:",
            "cannot search 1 clip; mocapdb ls --unsearchable",
            "hand: no whole human body",
            "left alone    2 .fbx without a skeleton that moves, 1 .c3d",
        ):
            assert words in result.stdout
        assert "warning: giant: a stature of 3." in result.stderr
        again = run("build", odd_corpus, "-o", tmp_path / "l.mocapdb", *OPTIONS)
        first, *assumed = again.stdout.splitlines()
        assert first.endswith("up to date, nothing to do (9 clips).")
        assert "cannot search 1 clip; mocapdb ls --unsearchable" in assumed
        assert not any("hand" in line or "left alone" in line for line in assumed)

    def test_why_no_clip_is_searched_is_known_also_after_coding_anew(self, tmp_path):
        folder, library = tmp_path / "hands", tmp_path / "l.mocapdb"
        folder.mkdir()
        (folder / "hand.bvh").write_text(HAND)
        for mean_mm in (1, 2):
            result = run("build", folder, "-o", library, "--jobs", 1, "--mean-mm", mean_mm)
            assert "built 1 clip" in result.stdout
            assert "hand: no whole human body" in result.stdout
        (folder / "other.bvh").write_text(HAND)
        without = run("build", folder, "-o", library, "--jobs", 1, "--mean-mm", 2, "--no-index")
        assert "not in the index yet" in without.stdout

    def test_scenes_are_clips_where_they_move(self, tmp_path):
        folder, library = tmp_path / "takes", tmp_path / "l.mocapdb"
        folder.mkdir()
        write_glb(synthetic.make_clip("walk", seed=1, duration_s=0.5), folder / "walk.glb")
        data = (folder / "walk.glb").read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        document, arrays = json.loads(data[20 : 20 + length]), data[28 + length :]
        document["buffers"][0]["uri"] = "run.bin"
        (folder / "run.gltf").write_text(json.dumps(document))
        (folder / "run.bin").write_bytes(arrays)
        (folder / "chair.glb").write_bytes(data.replace(b'"animations"', b'"nothing___"'))
        report = build(folder, library)
        assert (report.built, report.failed) == (2, [])
        assert report.assumed.left_alone == {".glb without a skin that moves": 1}
        (folder / "run.bin").write_bytes(bytes(4) + arrays[4:])
        again = build(folder, library)
        assert (again.built, again.skipped) == (1, 1)  # arrays beside a file are part of it

    def test_as_json(self, odd_corpus, tmp_path):
        told = run_json("build", odd_corpus, "-o", tmp_path / "l.mocapdb", *OPTIONS)
        assert (told["mended"], told["unsearchable"]) == (1, 1)
        assert told["assumed"]["left_alone"] == {".fbx without a skeleton that moves": 2, ".c3d": 1}

    def test_a_pattern_that_fits_no_file_is_named(self, small_corpus, tmp_path):
        settings = '["*.amc"]\nfps = 60\n["takes/*.bvh"]\nfps = 30\n'
        (small_corpus / "mocapdb.toml").write_text(settings)
        (small_corpus.parent / "mocapdb.toml").write_text('["not here/*"]\nfps = 30\n')
        result = run("build", small_corpus, "-o", tmp_path / "l.mocapdb", *OPTIONS)
        warnings = [line for line in result.stderr.splitlines() if "fits" in line]
        path = small_corpus / "mocapdb.toml"
        assert warnings == [f'warning: {path}: no file fits ["takes/*.bvh"]']

    def test_what_reading_warns_of_is_told(self, tmp_path):
        (tmp_path / "takes").mkdir()
        body = made.under_scene(made.make_walk(20))
        channels = body.channels.copy()
        channels[:, list(body.skeleton.channel_names).index("scene.rx")] = 180
        write_clip(Clip(body.skeleton, channels, 30.0), tmp_path / "takes" / "down.bvh")
        result = run("build", tmp_path / "takes", "-o", tmp_path / "l.mocapdb", *OPTIONS)
        assert "assumed, for nothing tells" in result.stdout
        assert "warning: down: up axis" in result.stderr
        assert "say so: --up -y" in result.stderr

    def test_outlying_clips_are_named(self, small_corpus, tmp_path):
        clip = read_clip(small_corpus / "bvh" / "both.bvh")
        channels = clip.channels.copy()
        channels[:, 0] += 10_000 / clip.skeleton.metres_per_unit
        write_clip(clip.replace(channels=channels, name="far"), small_corpus / "far.bvh")
        result = run("build", small_corpus, "-o", tmp_path / "l.mocapdb", *OPTIONS)
        assert "outlying      far: too far off to count in the axes of the search" in result.stdout
        told = run_json("info", tmp_path / "l.mocapdb")
        assert told["outlying"] == ["far"]
        assert "outlying        far" in run("info", tmp_path / "l.mocapdb").stdout

    def test_bones_that_only_coding_moves_are_exported_to_an_amc(self, tmp_path):
        body = made.with_positions(made.make_walk(), "places")
        rng = np.random.default_rng(3)
        channels = body.channels + rng.normal(0, 1e-12, body.channels.shape)
        (tmp_path / "corpus").mkdir()
        write_clip(Clip(body.skeleton, channels, 30.0), tmp_path / "corpus" / "a.npz")
        build(tmp_path / "corpus", tmp_path / "l.mocapdb")
        with Library(tmp_path / "l.mocapdb") as library:
            library.export("a", tmp_path / "a.amc")
        assert len(read_clip(tmp_path / "a.amc")) == len(channels)

    def test_one_clip_is_no_clips(self, tmp_path):
        (tmp_path / "corpus").mkdir()
        write_clip(synthetic.make_clip("walk", seed=3, duration_s=1), tmp_path / "corpus" / "a.npz")
        library = tmp_path / "l.mocapdb"
        assert "built 1 clip (" in run("build", tmp_path / "corpus", "-o", library).stdout
        assert "(1 clip)" in run("build", tmp_path / "corpus", "-o", library).stdout
        assert run("verify", library).stdout == f"{library}: 1 of 1 clip is sound.\n"
        assert run("ls", library).stdout.splitlines()[-1] == "1 clip"

    def test_strict_mends_nothing_and_stops(self, odd_corpus, tmp_path):
        with pytest.raises(FormatError, match=r"short\.bvh"):
            build(odd_corpus, tmp_path / "l.mocapdb", strict=True)


class TestLinkedFolders:
    def test_each_folder_is_read_once(self, small_corpus, tmp_path):
        alone = find_motion_files(small_corpus)
        elsewhere = tmp_path / "elsewhere"
        elsewhere.mkdir()
        (elsewhere / "far.bvh").write_bytes((small_corpus / "bvh" / "both.bvh").read_bytes())
        (small_corpus / "linked").symlink_to(elsewhere)
        (small_corpus / "linked_too").symlink_to(elsewhere)
        (small_corpus / "aloop").symlink_to(small_corpus)
        (small_corpus / "abefore").symlink_to(small_corpus / "bvh")
        (elsewhere / "back").symlink_to(small_corpus)
        found = find_motion_files(small_corpus)
        assert found == sorted([*alone, small_corpus / "linked" / "far.bvh"])


class TestOfAClip:
    def test_info_and_ls(self, odd_corpus, tmp_path):
        library = tmp_path / "l.mocapdb"
        build(odd_corpus, library, index=True)
        for name, source in (("02_02", "bvh/02_02.bvh"), ("01_01", "01/01_01.amc")):
            clip = read_clip(odd_corpus / source)
            told = run_json("info", library, name)
            assert told["unit_m"] == clip.skeleton.metres_per_unit
            assert told["unit_m_source"] == clip.unit_source
            assert (told["up"], told["up_source"]) == (clip.skeleton.up, clip.up_source)
            assert told["fps"] == clip.fps
            assert told["fps_source"] in {"file", "default"}
            with Library(library) as opened:
                again = opened.clip(name)
            assert (again.unit_source, again.up_source) == (clip.unit_source, clip.up_source)
        assert run_json("info", library, "02_02")["height_m"] == pytest.approx(1.85, abs=0.1)
        assert run_json("info", library)["unsearchable"] == 1
        told = run_json("ls", library, "--unsearchable")["clips"]
        assert [row["clip"] for row in told] == ["hand"]
        assert "no whole human body" in told[0]["unsearchable"]
        listed = run("ls", library, "--unsearchable")
        assert "hand" in listed.stdout
        assert "02_02" not in listed.stdout
        shown = run("info", library, "short").stdout
        assert "mended" in shown
        assert "inferred from the motion" in shown

    def test_query_and_classify_tell_what_they_could_not_look_at(self, odd_corpus, tmp_path):
        library = tmp_path / "l.mocapdb"
        build(odd_corpus, library, index=True)
        for command in ("query", "classify"):
            result = run(command, library, "01_01")
            assert result.exit_code == 0
            assert "1 clip was not looked at" in result.stderr
            assert run_json(command, library, "01_01")["unsearchable"] == 1


class TestFurtherColumns:
    @pytest.fixture
    def styled(self, small_library):
        """A library in which two clips have a style."""
        connection = sqlite3.connect(small_library / "catalogue.db")
        for name, columns in (
            ("01_01", '{"style": "old", "take": "1"}'), ("02_01", '{"style": "new\\u00e9"}')
        ):  # fmt: skip
            connection.execute("UPDATE clips SET columns = ? WHERE name = ?", (columns, name))
        connection.commit()
        connection.close()
        return small_library

    def test_are_shown_and_filtered_by(self, styled):
        listed = run_json("ls", styled, "--where", "style=old")["clips"]
        assert [(row["clip"], row["columns"]) for row in listed] == [
            ("01_01", {"style": "old", "take": "1"})
        ]
        assert [r["clip"] for r in run_json("ls", styled, "--where", "style=newé")["clips"]] == [
            "02_01"
        ]
        assert not run_json("ls", styled, "--where", "style=old", "--where", "take=2")["clips"]
        shown = run("ls", styled, "--columns", "style,take").stdout
        assert "style" in shown
        assert "old" in shown
        who = run_json("ls", styled, "--where", "subject=02")["clips"]
        assert {row["clip"] for row in who} == {"02_01", "02_02"}

    def test_a_column_that_no_clip_has_is_told_with_those_there_are(self, styled):
        for args in (("--where", "mood=old"), ("--columns", "mood")):
            result = run("ls", styled, *args)
            assert result.exit_code == 1
            assert "out of subject, style, take, but got 'mood'" in result.stderr
        assert run("ls", styled, "--where", "style").exit_code == 2
        assert run("ls", styled, "--where", "style=a", "--where", "style=b").exit_code == 2

    def test_queries_look_only_there(self, styled, small_corpus_template):
        run("index", styled)
        clip = small_corpus_template / "01/01_01.amc"
        hits = run_json("query", styled, clip, "--where", "style=old")["hits"]
        assert {hit["clip"] for hit in hits} == {"01_01"}
        told = run_json("classify", styled, "--where", "style=old")
        assert told["clips"] == []


class TestSubjectsAndColumnsOfLabels:
    def test_from_the_label_file_to_the_filter(self, small_corpus, tmp_path):
        lines = (small_corpus / "LABELS.csv").read_text().splitlines()
        more = ["subject,style", "Ann,old", "Ben,old", ",young", "Ann,", ",", ","]
        text = "\n".join(f"{a},{b}" for a, b in zip(lines, more, strict=True)) + "\n"
        (small_corpus / "LABELS.csv").write_text(text)
        library = tmp_path / "l.mocapdb"
        build(small_corpus, library, index=True)
        listed = run_json("ls", library, "--where", "style=old", "--where", "subject=Ann")["clips"]
        assert [(row["clip"], row["columns"]) for row in listed] == [("01_01", {"style": "old"})]
        told = run_json("info", library, "01_01")
        assert (told["subject"], told["subject_source"]) == ("Ann", "labels")
        assert run_json("info", library, "02_02")["subject_source"] == "name"
        hits = run_json("query", library, small_corpus / "01/01_01.amc", "--subject", "Ben")["hits"]
        assert {hit["clip"] for hit in hits} == {"01_02"}

        (small_corpus / "LABELS.csv").write_text(text.replace("old", "odd"))
        kept = rows(library)
        assert build(small_corpus, library).built == 0
        assert rows(library) == kept
        assert len(run_json("ls", library, "--where", "style=odd")["clips"]) == 2


class TestCataloguesOfEarlierVersions:
    def test_are_read(self, small_library):
        before = run_json("info", small_library, "02_02")
        made_older(small_library, 1)
        told = run_json("info", small_library, "02_02")
        assert (told["unit_m"], told["up"]) == (before["unit_m"], before["up"])
        assert told["unit_m_source"] == told["up_source"] == "unknown"
        assert told["height_m"] is None
        assert tuple(row["clip"] for row in run_json("ls", small_library)["clips"]) == NAMES
        assert "not kept by an earlier version" in run("info", small_library, "02_02").stdout
        with Library(small_library) as library, pytest.raises(LibraryError, match="style"):
            library.records(where={"style": "old"})

    def test_the_next_build_brings_them_up_to_date(self, small_library, small_corpus_template):
        before, kept = run_json("info", small_library, "02_02"), decoded(small_library)
        made_older(small_library, 1)
        assert build(small_corpus_template, small_library).built == 0
        assert decoded(small_library) == kept
        told = run_json("info", small_library, "02_02")
        assert (told["unit_m"], told["up"]) == (before["unit_m"], before["up"])
        assert (told["subject"], told["subject_source"]) == ("02", "name")
        assert told["unit_m_source"] == "unknown"


ASSUMED = ("unit_m", "unit_m_source", "up", "up_source", "fps", "fps_source")


class TestEveryJson:
    """Whatever reads one clip tells its unit, axis and rate, and who stated them."""

    def test_of_a_file(self, small_library, small_corpus_template, tmp_path):
        run("index", small_library)
        path = small_corpus_template / "bvh/02_02.bvh"
        clip = read_clip(path)
        expected = dict(
            zip(
                ASSUMED,
                (
                    clip.skeleton.metres_per_unit,
                    clip.unit_source,
                    clip.skeleton.up,
                    clip.up_source,
                    clip.fps,
                    clip.fps_source,
                ),
                strict=True,
            )
        )
        for told in (
            run_json("convert", path, tmp_path / "a.npz"),
            run_json("query", small_library, path),
            run_json("query", small_library, path)["examples"][0],
            run_json("classify", small_library, path),
            run_json("clean", path),
            run_json("export", small_library, "02_02", "-o", tmp_path / "b.bvh"),
            run_json("ls", small_library, "--search", "02_02")["clips"][0],
        ):
            assert {key: told[key] for key in ASSUMED} == expected
