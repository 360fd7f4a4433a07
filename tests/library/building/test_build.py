"""From a folder to a library, and again after something has changed."""

from __future__ import annotations

import shutil
import sqlite3

import numpy as np
import pytest
from small_library import (
    CLIPS,
    NAMES,
    OPTIONS,
    QUICK,
    build,
    decoded,
    leftovers,
    rows,
    run,
    run_json,
    sound,
    write_clips,
)

from mocapdb.compression import Target
from mocapdb.corpus.manifest import MANIFEST_COLUMNS
from mocapdb.errors import CorpusError, LibraryError
from mocapdb.io import read_clip
from mocapdb.library import BuildSettings, Library
from mocapdb.motion.skin import motion_error


class TestRoundTrip:
    def test_names_labels_and_rates(self, small_library):
        with Library(small_library) as library:
            records = {record.name: record for record in library.records()}
        assert tuple(records) == NAMES
        assert [records[name].label for name in NAMES] == [
            "box", "walk", "run", "walk", "wave", "squat"
        ]  # fmt: skip
        assert records["02_01"].description == "walks up a ladder"
        assert records["02_01"].source == "02/02_01.amc"
        rates = {name: (record.fps, record.fps_source) for name, record in records.items()}
        assert rates["01_02"] == (60.0, "labels")
        assert rates["01_01"] == (120.0, "file")
        assert rates["02_02"] == (120.0, "file")

    @pytest.mark.parametrize(
        "target", [Target("skinned", 0.5), Target("mean_mm", 1.0), Target("max_mm", 4.0)], ids=str
    )
    def test_every_clip_holds_the_target(self, small_corpus_template, tmp_path, target):
        build(small_corpus_template, tmp_path / "l.mocapdb", BuildSettings(target, QUICK.codec))
        with Library(tmp_path / "l.mocapdb") as library:
            assert len(library) == len(CLIPS)
            for record in library.records():
                source = read_clip(small_corpus_template / record.source)
                clip = library.clip(record.name)
                assert clip.skeleton == source.skeleton
                error = motion_error(source, clip)
                assert 0 < target.measure(error) <= target.value
                assert error.skinned == pytest.approx(record.skinned_error)
                assert error.vertices.mean == pytest.approx(record.error_mean_mm)
                assert error.vertices.p95 == pytest.approx(record.error_p95_mm)
                assert error.vertices.max == pytest.approx(record.error_max_mm)

    def test_a_range_of_frames(self, small_library):
        with Library(small_library) as library:
            whole = library.clip("bvh/both")
            part = library.clip("bvh/both", slice(30, 40))
            assert np.array_equal(part.channels, whole.channels[30:40])
            assert (part.fps, part.label) == (whole.fps, "squat")

    def test_a_clip_says_what_happened_to_it(self, small_library):
        with Library(small_library) as library:
            assert library.clip("01_01").provenance[-1] == "coded by okane channels dct"

    def test_two_processes_give_the_same_bytes(self, small_corpus, small_library, tmp_path):
        build(small_corpus, tmp_path / "two.mocapdb", jobs=2)
        assert decoded(tmp_path / "two.mocapdb") == decoded(small_library)
        assert sound(tmp_path / "two.mocapdb")

    def test_progress_names_every_clip_once(self, small_corpus, tmp_path):
        seen = []
        build(small_corpus, tmp_path / "l.mocapdb", progress=lambda *step: seen.append(step))
        assert [done for done, _, _ in seen] == list(range(1, len(CLIPS) + 1))
        assert {total for _, total, _ in seen} == {len(CLIPS)}
        assert sorted(name for _, _, name in seen) == sorted(NAMES)

    def test_the_folder_is_tidy(self, small_library):
        assert not leftovers(small_library)
        assert [path.name for path in (small_library / "shards").iterdir()] == ["000001.h5"]

    def test_libraries_inside_a_corpus_are_passed_over(self, small_corpus):
        write_clips(small_corpus / "old.mocapdb", {"x.amc": ("hop", 1)})
        (small_corpus / "old.mocapdb" / "catalogue.db").touch()
        assert build(small_corpus, small_corpus / "new.mocapdb").built == len(CLIPS)


class TestLabels:
    def test_folders_are_the_classes_without_labels(self, small_corpus, tmp_path):
        (small_corpus / "LABELS.csv").unlink()
        build(small_corpus, tmp_path / "l.mocapdb")
        with Library(tmp_path / "l.mocapdb") as library:
            assert library.classes() == {"01": 3, "02": 1, "bvh": 2}

    def test_a_file_that_is_named_comes_before_the_corpus_own(self, small_corpus, tmp_path):
        labels = tmp_path / "mine.csv"
        labels.write_text("clip,label\n01_01,mine\n")
        build(small_corpus, tmp_path / "l.mocapdb", labels=labels)
        with Library(tmp_path / "l.mocapdb") as library:
            assert library.classes() == {"mine": 1}
        manifest = tmp_path / "manifest.csv"
        row = "02_01,02,01,theirs,,60,http://host/02.asf,http://host/02_01.amc,,"
        manifest.write_text(f"{','.join(MANIFEST_COLUMNS)}\n{row}\n")
        build(small_corpus, tmp_path / "l.mocapdb", manifest=manifest)
        with Library(tmp_path / "l.mocapdb") as library:
            assert library.classes() == {"theirs": 1}
            assert library.record("02_01").fps_source == "manifest"


class TestAgain:
    """A second build does what has changed, and nothing else."""

    def test_nothing_to_do(self, small_corpus_template, small_library):
        files = {path: path.stat().st_mtime_ns for path in (small_library / "shards").iterdir()}
        for jobs in (1, 2):
            report = build(small_corpus_template, small_library, jobs=jobs)
            assert (report.built, report.skipped, report.failed) == (0, len(CLIPS), [])
        assert files == {path: path.stat().st_mtime_ns for path in files}
        answer = run("build", small_corpus_template, "-o", small_library, *OPTIONS)
        assert answer.exit_code == 0
        first, *assumed = answer.stdout.splitlines()
        assert first == f"{small_library}: up to date, nothing to do (6 clips)."
        assert assumed[0].startswith("unit          0.0564444 m (4), stated by the file")

    def test_a_new_file(self, small_corpus, tmp_path):
        build(small_corpus, tmp_path / "l.mocapdb")
        before = rows(tmp_path / "l.mocapdb")
        write_clips(small_corpus, {"03/03_01.amc": ("hop", 7)})
        report = build(small_corpus, tmp_path / "l.mocapdb")
        assert (report.built, report.skipped) == (1, len(CLIPS))
        after = rows(tmp_path / "l.mocapdb")
        assert set(after) - set(before) == {"03_01"}
        assert before.items() <= after.items()

    def test_a_changed_file_replaces_its_clip_and_compact_drops_the_old_bytes(
        self, small_corpus, tmp_path
    ):
        library = tmp_path / "l.mocapdb"
        build(small_corpus, library)
        old = decoded(library)
        with Library(library) as opened:
            old_bytes = opened.payload(opened.record("02_02"))
        write_clips(small_corpus, {"bvh/02_02.bvh": ("run", 99)}, 1.85)
        report = build(small_corpus, library)
        assert (report.built, report.skipped) == (1, len(CLIPS) - 1)
        assert tuple(rows(library)) == NAMES
        new = decoded(library)
        assert {name for name in NAMES if new[name] != old[name]} == {"02_02"}
        assert old_bytes in (library / "shards" / "000001.h5").read_bytes()

        freed = run_json("compact", library)["freed_bytes"]
        assert freed > 0
        assert decoded(library) == new
        assert sound(library)
        shards = list((library / "shards").iterdir())
        assert not any(old_bytes in path.read_bytes() for path in shards)
        assert (build(small_corpus, library).built, len(rows(library))) == (0, len(CLIPS))

    def test_compacting_what_is_compact_changes_nothing(self, small_library):
        shard = small_library / "shards/000001.h5"
        before = shard.stat()
        assert run_json("compact", small_library)["freed_bytes"] >= 0
        assert shard.stat().st_ino == before.st_ino

    def test_a_moved_file_is_the_same_clip(self, small_corpus, tmp_path):
        library = tmp_path / "l.mocapdb"
        build(small_corpus, library)
        before = rows(library)
        (small_corpus / "moved").mkdir()
        (small_corpus / "bvh/02_02.bvh").rename(small_corpus / "moved/waving.bvh")
        report = build(small_corpus, library)
        assert (report.built, report.skipped) == (0, len(CLIPS))
        after = rows(library)
        assert after.pop("waving") == before.pop("02_02")
        assert after == before
        with Library(library) as opened:
            record = opened.record("waving")
        assert (record.source, record.stem) == ("moved/waving.bvh", "waving")
        assert record.label is None  # the labels speak of the old path

    @pytest.mark.parametrize("twins", [False, True])
    def test_a_moved_corpus_is_the_same_clips(self, small_corpus, tmp_path, twins):
        library = tmp_path / "l.mocapdb"
        if twins:  # two files of one content
            shutil.copy(small_corpus / "bvh/02_02.bvh", small_corpus / "bvh/twin.bvh")
        build(small_corpus, library)
        before = rows(library)
        moved = small_corpus.rename(tmp_path / "elsewhere")
        report = build(moved, library)
        assert (report.built, report.skipped) == (0, len(before))
        assert rows(library) == before
        with Library(library) as opened:
            assert {record.corpus for record in opened.records()} == {str(moved)}

    def test_a_corpus_that_moved_and_changed(self, small_corpus, tmp_path):
        library = tmp_path / "l.mocapdb"
        build(small_corpus, library)
        before = rows(library)
        (tmp_path / "deeper").mkdir()
        moved = small_corpus.rename(tmp_path / "deeper" / "corpus")
        write_clips(moved, {"bvh/both.bvh": ("hop", 8)}, 1.85)
        report = build(moved, library)
        assert (report.built, report.skipped) == (1, len(CLIPS) - 1)
        after = rows(library)
        assert tuple(after) == NAMES
        assert {name for name in NAMES if after[name] != before[name]} == {"bvh/both"}

    def test_a_moved_corpus_with_other_settings(self, small_corpus, tmp_path):
        library = tmp_path / "l.mocapdb"
        build(small_corpus, library)
        (tmp_path / "deeper").mkdir()
        moved = small_corpus.rename(tmp_path / "deeper" / "corpus")
        report = build(moved, library, BuildSettings(Target("mean_mm", 1.0), QUICK.codec))
        assert report.built == len(CLIPS)
        assert tuple(rows(library)) == NAMES

    def test_changed_labels_are_taken_without_encoding(self, small_corpus, tmp_path):
        library = tmp_path / "l.mocapdb"
        build(small_corpus, library)
        before = rows(library)
        (small_corpus / "LABELS.csv").write_text(
            "clip,label,fps,description\n01_01,stroll,30,no hurry\n02_01,walk,,\n"
        )
        report = build(small_corpus, library)
        assert (report.built, report.skipped) == (0, len(CLIPS))
        assert rows(library) == before
        with Library(library) as opened:
            assert opened.classes() == {"stroll": 1, "walk": 1}
            assert [r.name for r in opened.records(search="hurry")] == ["01_01"]
            assert opened.records(search="ladder") == []
            assert (opened.record("01_01").fps, opened.clip("01_01").fps) == (30.0, 30.0)
            # what the labels no longer state is what a fresh build would take
            record = opened.record("01_02")
            assert (record.fps, record.fps_source) == (120.0, "file")

    def test_a_file_that_makes_a_stem_ambiguous_renames(self, small_corpus, tmp_path):
        library = tmp_path / "l.mocapdb"
        build(small_corpus, library)
        before = rows(library)
        write_clips(small_corpus, {"new/02_01.bvh": ("hop", 3)})
        assert build(small_corpus, library).built == 1
        after = rows(library)
        assert after["02/02_01"] == before["02_01"]
        assert "new/02_01" in after
        assert "02_01" not in after

    def test_a_bad_file_that_makes_a_stem_ambiguous_does_too(self, small_corpus, tmp_path):
        library = tmp_path / "l.mocapdb"
        build(small_corpus, library)
        (small_corpus / "02/02_01.amc").write_text("no motion\n")  # and its own is bad now
        write_clips(small_corpus, {"new/02_01.bvh": ("hop", 3)})
        report = build(small_corpus, library)
        assert (report.built, len(report.failed)) == (1, 1)
        assert {"02/02_01", "new/02_01"} <= set(rows(library))
        assert sound(library)

    def test_a_file_that_is_gone_keeps_its_clip(self, small_corpus, tmp_path):
        library = tmp_path / "l.mocapdb"
        build(small_corpus, library)
        before = rows(library)
        (small_corpus / "bvh/02_02.bvh").unlink()
        report = build(small_corpus, library)
        assert (report.built, report.skipped) == (0, len(CLIPS) - 1)
        assert rows(library) == before

    def test_other_settings_encode_everything_again(self, small_corpus_template, small_library):
        before = rows(small_library)
        finer = BuildSettings(Target("mean_mm", 0.5), QUICK.codec)
        report = build(small_corpus_template, small_library, finer)
        assert (report.built, report.skipped) == (len(CLIPS), 0)
        after = rows(small_library)
        assert set(after) == set(before)
        assert not set(after.values()) & set(before.values())
        assert build(small_corpus_template, small_library, finer).built == 0

    def test_a_changed_skeleton_encodes_its_clips_again(self, small_corpus, tmp_path):
        build(small_corpus, tmp_path / "l.mocapdb")
        asf = small_corpus / "02/02.asf"
        asf.write_text("# touched\n" + asf.read_text())
        assert build(small_corpus, tmp_path / "l.mocapdb").built == 1

    def test_two_corpora_in_one_library(self, small_corpus, tmp_path):
        library = tmp_path / "l.mocapdb"
        build(small_corpus, library)
        other = tmp_path / "other"
        write_clips(other, {"02/02_01.amc": ("hop", 5), "09_01.bvh": ("run", 6)})
        report = build(other, library)
        assert (report.built, report.skipped) == (2, 0)
        assert set(rows(library)) == {
            *NAMES, "09_01", "corpus/02/02_01.amc", "other/02/02_01.amc"
        } - {"02_01"}  # fmt: skip
        assert build(small_corpus, library).built == 0


class TestBuilds:
    def test_builds_are_noted(self, small_library):
        with sqlite3.connect(small_library / "catalogue.db") as database:
            noted = database.execute("SELECT settings, started, finished FROM builds").fetchall()
        database.close()
        ((settings, started, finished),) = noted
        assert settings == QUICK.to_json()
        assert started <= finished

    def test_strict_ends_with_the_first_bad_file_and_keeps_what_is_done(
        self, small_corpus, tmp_path
    ):
        (small_corpus / "02/02_01.amc").write_text("1\nroot 1 2\n")
        for jobs in (1, 2):
            library = tmp_path / f"{jobs}.mocapdb"
            answer = run("build", small_corpus, "-o", library, *OPTIONS, "--strict", "--jobs", jobs)
            assert answer.exit_code == 1
            assert "02_01.amc:2: Expected" in answer.stderr
            assert sound(library)
            assert "01_01" in rows(library)
            assert "02_01" not in rows(library)
            assert run("build", small_corpus, "-o", library, *OPTIONS).exit_code == 1
            assert len(rows(library)) == len(CLIPS) - 1

    def test_a_corpus_cannot_become_its_own_library(self, small_corpus):
        with pytest.raises(LibraryError, match="other files are in it"):
            build(small_corpus, small_corpus)

    def test_a_missing_corpus_makes_no_library(self, tmp_path):
        with pytest.raises(CorpusError):
            build(tmp_path / "none", tmp_path / "l.mocapdb")
        assert list(tmp_path.iterdir()) == []
