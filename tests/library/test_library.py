"""An open library: finding clips, exporting them, its figures."""

from __future__ import annotations

import gc
import sqlite3

import numpy as np
import pytest
from small_library import CLIPS, NAMES, build, leftovers, write_clips

from mocapdb.errors import ClipError, FormatError, UnknownClipError
from mocapdb.io import read_clip
from mocapdb.library import Library, verify_library


@pytest.fixture(scope="module")
def library(small_library_template):
    with Library(small_library_template) as opened:
        yield opened


class TestFinding:
    def test_by_name_and_by_stem(self, library):
        assert library.record("01_01").name == "01_01"
        assert library.record("bvh/both").source == "bvh/both.bvh"

    def test_an_ambiguous_stem_lists_the_candidates(self, library):
        with pytest.raises(UnknownClipError, match="Use one of: 01/both, bvh/both") as caught:
            library.clip("both")
        assert caught.value.candidates == ("01/both", "bvh/both")

    @pytest.mark.parametrize(
        ("name", "close"),
        [
            ("01_1", "01_01"),
            ("2_02", "02_02"),
            ("booth", "01/both, bvh/both"),  # close to a stem
            ("bvh/bth", "bvh/both"),
        ],
    )
    def test_unknown_names_get_close_ones(self, library, name, close):
        with pytest.raises(UnknownClipError, match=r"Did you mean: .*" + close):
            library.record(name)

    @pytest.mark.parametrize("name", ["", "nothing like it", "x'; DROP TABLE clips", "%", "\0"])
    def test_unknown_names_with_nothing_close(self, library, name):
        with pytest.raises(UnknownClipError, match="See: mocapdb ls"):
            library.record(name)
        assert len(library) == len(CLIPS)

    def test_iterating_decodes_in_the_order_of_names(self, library):
        assert tuple(clip.name for clip in library) == NAMES

    def test_reading_leaves_nothing_behind(self, small_library):
        with Library(small_library) as opened:
            opened.clip("01_01")
        assert not leftovers(small_library)

    def test_what_nobody_closes_is_closed_when_nobody_uses_it(self, small_library):
        connection = Library(small_library).catalogue._connection
        gc.collect()
        with pytest.raises(sqlite3.ProgrammingError, match="closed"):
            connection.execute("SELECT 1")

    def test_repr(self, library):
        assert repr(library).endswith("small.mocapdb': 6 clips)")


class TestSearching:
    @pytest.mark.parametrize(
        ("words", "names"),
        [
            ("ladder", ["02_01"]),
            ("walk", ["01_01", "02_01"]),
            ("walk ahead", ["01_01"]),
            ("lad", ["02_01"]),  # beginnings of words
            ("WALKS Up", ["02_01"]),
            ("02_01", ["02_01"]),
            ("bvh/both", ["bvh/both"]),
            ("runs, fast", ["01_02"]),
            ("nothing", []),
        ],
    )
    def test_words(self, library, words, names):
        assert [record.name for record in library.records(search=words)] == names

    @pytest.mark.parametrize(
        "words",
        ['"', '"""', "'", "walk*", "NEAR(", "-walk", "a AND", "label:walk", "^", "{}", "ü", "\0"],
    )
    def test_odd_characters_are_text(self, library, words):
        for record in library.records(search=words):
            assert record.name in NAMES

    @pytest.mark.parametrize("words", ["", "  "])
    def test_no_words_are_no_condition(self, library, words):
        assert len(library.records(search=words)) == len(CLIPS)

    def test_class_and_words(self, library):
        found = library.records(label="walk", search="up")
        assert [record.name for record in found] == ["02_01"]


class TestFrames:
    @pytest.mark.parametrize("frames", [slice(500, 600), slice(5, 5), slice(9, 3)])
    def test_an_empty_range(self, library, frames):
        with pytest.raises(ClipError, match="frame"):
            library.clip("01_01", frames)


class TestExport:
    @pytest.mark.parametrize("suffix", [".amc", ".bvh", ".npz", ".BVH"])
    def test_what_is_exported_is_what_is_decoded(self, library, tmp_path, suffix):
        path = tmp_path / f"out{suffix}"
        library.export("02_01", path)
        clip, again = library.clip("02_01"), read_clip(path)
        assert len(again) == len(clip)
        if suffix not in {".BVH", ".bvh"}:  # a BVH has its own channels
            assert np.allclose(again.channels, clip.channels, atol=1e-9)
        assert not list(tmp_path.glob(".*"))

    def test_a_drawing_is_exported_as_well(self, library, tmp_path):
        library.export("02_01", tmp_path / "out.glb")
        assert len(read_clip(tmp_path / "out.glb")) == len(library.clip("02_01"))

    def test_an_ambiguous_stem_is_the_clip_that_was_read_from_such_a_file(self, library, tmp_path):
        assert library.export("both", tmp_path / "a.amc").name == "01/both"
        assert library.export("both", tmp_path / "b.bvh").name == "bvh/both"
        with pytest.raises(UnknownClipError, match="ambiguous"):
            library.export("both", tmp_path / "c.npz")

    @pytest.mark.parametrize("target", ["missing/out.bvh", "out.glbx", "out", "."])
    def test_bad_targets_leave_nothing(self, library, tmp_path, target):
        with pytest.raises(FormatError, match="Expected"):
            library.export("01_01", tmp_path / target)
        assert list(tmp_path.iterdir()) == []


class TestFigures:
    def test_they_add_up(self, library):
        figures = library.info()
        records = library.records()
        assert figures["clips"] == len(CLIPS)
        assert figures["frames"] == sum(record.frames for record in records)
        assert figures["payload_bytes"] == sum(len(library.payload(r)) for r in records)
        floats = sum(4 * library.clip(r.name).channels.size for r in records)
        assert figures["ratio_float32"] == pytest.approx(floats / figures["payload_bytes"])
        assert figures["error_mm"]["max"] == max(record.error_max_mm for record in records)
        assert sum(figures["classes"].values()) == len(CLIPS)

    def test_an_empty_library(self, tmp_path):
        write_clips(tmp_path / "corpus", {"a.bvh": ("walk", 1)})
        (tmp_path / "corpus/a.bvh").write_text("bad\n")
        report = build(tmp_path / "corpus", tmp_path / "l.mocapdb")
        assert (report.built, len(report.failed)) == (0, 1)
        with Library(tmp_path / "l.mocapdb") as empty:
            assert len(empty) == 0
            assert empty.info()["clips"] == 0
            assert verify_library(empty) == {"clips": 0, "bad": [], "shards": [], "stray": []}
