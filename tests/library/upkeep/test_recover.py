"""A way back: the catalogue made anew, what is damaged dropped, taken again, or named."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing

import h5py
import pytest
from small_library import (
    CLIPS,
    NAMES,
    build,
    decoded,
    leftovers,
    made_older,
    run,
    run_json,
    sound,
    write_clips,
)

from mocapdb.library import Library, index_library, recover_library
from mocapdb.library.upkeep import recover as recovering

SHARD = "shards/000001.h5"
PLACES = {"id", "skeleton_id", "shard_id", "shard_row", "build_id", "corpus"}


def told(library):
    """All that the catalogue says of the clips, but for where they are."""
    with Library(library) as opened:
        return {
            record.name: {k: v for k, v in vars(record).items() if k not in PLACES}
            for record in opened.records()
        }


def losses(library):
    with Library(library) as opened:
        return opened.info("02_01")["joints"]


def damage(library, name):
    """Flip a byte of a clip's payload; return the row of the shard."""
    with Library(library) as opened:
        record = opened.record(name)
    with h5py.File(library / SHARD, "r+") as shard:
        place = int(shard["offsets"][record.shard_row]) + record.payload_bytes // 2
        shard["payload"][place] ^= 1
    return record.shard_row


def stopped(*_):
    raise KeyboardInterrupt


@pytest.fixture
def without(small_library):
    (small_library / "catalogue.db").unlink()
    return small_library


class TestACatalogueThatIsGone:
    def test_everything_is_as_it_was(self, small_library, small_corpus_template):
        before = told(small_library), decoded(small_library), losses(small_library)
        (small_library / "catalogue.db").unlink()
        answer = run("recover", small_library)
        assert answer.exit_code == 0
        assert "catalogue made anew: it was missing" in answer.stdout
        assert answer.stdout.endswith(": 6 clips.\n")
        assert (told(small_library), decoded(small_library), losses(small_library)) == before
        assert sound(small_library)
        assert not leftovers(small_library)
        assert not (small_library / "set-aside").exists()
        assert build(small_corpus_template, small_library).skipped == len(CLIPS)

    def test_a_log_of_the_old_one_is_not_taken_for_its_own(self, without):
        log = without / "catalogue.db-wal"
        log.write_bytes(b"of another catalogue" * 100)
        assert recover_library(without).clips == len(CLIPS)
        assert sound(without)
        assert (without / "set-aside/catalogue.db-wal").exists()

    @pytest.mark.parametrize("sql", ["UPDATE clips SET label = 'wolk'", "DELETE FROM builds"])
    def test_one_that_is_damaged_is_set_aside(self, small_library, sql):
        before = told(small_library)
        with closing(sqlite3.connect(small_library / "catalogue.db")) as database, database:
            database.execute(sql)
        report = run_json("recover", small_library)
        assert report["catalogue"]
        assert report["set_aside"] == ["catalogue.db"]
        assert told(small_library) == before
        assert sound(small_library)

    def test_killed_on_the_way_it_starts_again(self, without, small_corpus, monkeypatch):
        before = sorted(path.name for path in (without / "shards").iterdir())

        for step in ("sync", "_add_clips", "_set_aside"):
            monkeypatch.setattr(recovering, step, stopped)
            with pytest.raises(KeyboardInterrupt):
                recover_library(without)
            monkeypatch.undo()
            assert sorted(path.name for path in (without / "shards").iterdir()) == before
            answer = run("build", small_corpus, "-o", without)
            assert answer.exit_code == 1  # nothing may take it for a new library
        assert recover_library(without).clips == len(CLIPS)
        assert sound(without)

    def test_names_that_changed_and_clips_that_were_replaced(self, small_library, small_corpus):
        write_clips(small_corpus, {"new/01_01.bvh": ("hop", 1)})
        write_clips(small_corpus, {"bvh/02_02.bvh": ("hop", 2)}, 1.85)
        assert build(small_corpus, small_library).built == 2
        before = told(small_library), decoded(small_library)
        assert {"01/01_01", "new/01_01"} <= set(before[0])
        (small_library / "catalogue.db").unlink()
        assert recover_library(small_library).lost == []
        assert (told(small_library), decoded(small_library)) == before
        assert sound(small_library)

    def test_a_file_like_one_that_was_replaced_keeps_its_clip(self, small_library, small_corpus):
        (small_corpus / "new").mkdir()
        shutil.copy(small_corpus / "bvh/02_02.bvh", small_corpus / "new/02_02.bvh")
        assert build(small_corpus, small_library).built == 1
        write_clips(small_corpus, {"bvh/02_02.bvh": ("hop", 2)}, 1.85)
        assert build(small_corpus, small_library).built == 1
        assert run("compact", small_library).exit_code == 0
        before = told(small_library), decoded(small_library)
        assert {"bvh/02_02", "new/02_02"} <= set(before[0])
        (small_library / "catalogue.db").unlink()
        assert recover_library(small_library).lost == []
        assert (told(small_library), decoded(small_library)) == before

    def test_a_shard_that_is_there_twice(self, without):
        shutil.copy(without / SHARD, without / "shards/000007.h5")
        (without / "shards/000008.h5.partial").write_bytes(b"half")
        report = recover_library(without)
        assert (report.clips, report.dropped) == (len(CLIPS), [])
        assert sound(without)

    def test_a_clip_that_was_replaced_is_not_known_from_a_copy_either(
        self, small_library, small_corpus
    ):
        copy = small_library.parent / "copy.h5"
        shutil.copy(small_library / SHARD, copy)
        moved = small_corpus.rename(small_corpus.with_name("moved"))
        write_clips(moved, {"bvh/02_02.bvh": ("hop", 2)}, 1.85)
        assert build(moved, small_library).built == 1
        before = told(small_library), decoded(small_library)
        shutil.copy(copy, small_library / "shards/000007.h5")
        (small_library / "catalogue.db").unlink()
        assert recover_library(small_library).lost == []
        assert (told(small_library), decoded(small_library)) == before

    @pytest.mark.parametrize("catalogue", ["kept", "gone"])
    def test_stopped_before_clips_were_taken_again(
        self, small_library, small_corpus, monkeypatch, catalogue
    ):
        index_library(small_library)
        before = told(small_library)
        damage(small_library, "02_01")
        if catalogue == "gone":
            (small_library / "catalogue.db").unlink()
        monkeypatch.setattr(recovering, "_retake", stopped)
        with pytest.raises(KeyboardInterrupt):
            recover_library(small_library)
        monkeypatch.undo()
        report = recover_library(small_library, corpus=small_corpus)
        assert (report.retaken, report.lost) == (["02_01"], [])
        assert told(small_library).keys() == before.keys()
        with Library(small_library) as opened:
            assert not opened.catalogue.unsearchable()
        assert not (small_library / "recovering.json").exists()

    @pytest.mark.parametrize("text", ["{", "[]", '{"dropped": [{"what": 1}]}'])
    def test_what_was_left_to_do_cannot_be_read(self, small_library, text):
        (small_library / "recovering.json").write_text(text)
        assert (
            "recovering.json: expected what a recovery has left"
            in run("recover", small_library).stderr
        )

    def test_neither_links_nor_other_folders(self, without, tmp_path):
        assert "not a library" in run("recover", tmp_path).stderr
        (without / "shards").rename(tmp_path / "elsewhere")
        (without / "shards").symlink_to(tmp_path / "elsewhere")
        assert "but it is a link" in run("recover", without).stderr

    @pytest.mark.parametrize("name", ["set-aside", "recovering"])
    def test_folders_of_its_own_are_no_links(self, without, small_library_template, name):
        (without / name).symlink_to(small_library_template)
        assert "but it is a link" in run("recover", without).stderr
        assert (small_library_template / "catalogue.db").is_file()


class TestDamagedShards:
    @pytest.mark.parametrize("catalogue", ["kept", "gone"])
    def test_a_clip_is_taken_from_the_corpus_again(self, small_library, catalogue):
        before = told(small_library), decoded(small_library)
        damage(small_library, "02_01")
        if catalogue == "gone":
            (small_library / "catalogue.db").unlink()
        answer = run_json("recover", small_library)
        assert [each["what"] for each in answer["dropped"]] == ["02_01"]
        assert "fails its checksum" in answer["dropped"][0]["reason"]
        assert (answer["retaken"], answer["lost"]) == (["02_01"], [])
        assert answer["set_aside"] == ["shards-000001.h5"]
        assert (told(small_library), decoded(small_library)) == before
        assert sound(small_library)

    def test_it_is_lost_where_the_corpus_is_not_there(self, small_library, tmp_path):
        with closing(sqlite3.connect(small_library / "catalogue.db")) as database, database:
            database.execute("UPDATE clips SET corpus = '/nowhere'")
        (small_library / "catalogue.db").unlink()
        damage_row = 3
        with h5py.File(small_library / SHARD, "r+") as shard:
            shard["payload"][int(shard["offsets"][damage_row])] ^= 1
        moved = tmp_path / "nowhere"
        answer = run("recover", small_library, "--corpus", moved)
        assert answer.exit_code == 1
        (lost,) = [line for line in answer.stderr.splitlines() if line.startswith("lost ")]
        assert "Say where: --corpus FOLDER" in lost
        assert answer.stdout.endswith(": 5 clips.\n")
        assert sound(small_library)

    @pytest.mark.parametrize("size", [0, 3000])
    def test_a_shard_that_is_cut_short(self, small_library, size):
        before = decoded(small_library)
        shard = small_library / SHARD
        shard.write_bytes(shard.read_bytes()[:size])
        report = recover_library(small_library)
        assert sorted(report.retaken) == list(NAMES)
        assert decoded(small_library) == before
        assert sound(small_library)

    def test_and_the_catalogue_gone_too(self, small_corpus, small_library):
        write_clips(small_corpus, {"new.bvh": ("hop", 1)})
        build(small_corpus, small_library)
        before = decoded(small_library)
        shard = small_library / SHARD
        shard.write_bytes(shard.read_bytes()[:3000])
        (small_library / "catalogue.db").unlink()
        report = recover_library(small_library)
        assert sorted(report.retaken) == list(NAMES)
        assert decoded(small_library) == before

    def test_damage_in_what_a_shard_says_of_its_clips(self, small_library):
        before = decoded(small_library)
        (small_library / "catalogue.db").unlink()
        with h5py.File(small_library / SHARD, "r+") as shard:
            offsets = shard["entry_offsets"][:]
            shard["entries"][int(offsets[2] + offsets[3]) // 2] ^= 1  # of a clip
        report = recover_library(small_library)
        assert [each["what"] for each in report.dropped] == ["row 2 of 000001.h5"]
        found = decoded(small_library)
        assert len(found) == len(CLIPS) - 1
        assert set(found.values()) < set(before.values())
        assert sound(small_library)


class TestShardsOfEarlierVersions:
    def test_the_next_writer_makes_them_complete(self, small_library, small_corpus_template):
        before = told(small_library), decoded(small_library)
        made_older(small_library, 3)
        assert decoded(small_library) == before[1]
        assert sound(small_library)
        assert build(small_corpus_template, small_library).skipped == len(CLIPS)
        (small_library / "catalogue.db").unlink()
        assert recover_library(small_library).clips == len(CLIPS)
        assert (told(small_library), decoded(small_library)) == before

    def test_without_a_catalogue_they_are_taken_from_the_corpus(self, small_library, small_corpus):
        write_clips(small_corpus, {"new.bvh": ("hop", 1)})
        made_older(small_library, 3)
        shutil.copy(small_library / SHARD, small_corpus / "old.h5")
        build(small_corpus, small_library)
        before = decoded(small_library)
        for path in (small_library / "shards").iterdir():
            with h5py.File(path, "r") as shard:
                if len(shard["crc32"]) == len(CLIPS):
                    shutil.copy(small_corpus / "old.h5", path)
        (small_library / "catalogue.db").unlink()
        report = recover_library(small_library, corpus=small_corpus)
        assert "an earlier version wrote it" in report.dropped[0]["reason"]
        assert decoded(small_library) == before


def test_what_a_stopped_recovery_left_is_removed_though_the_catalogue_is_sound(small_library):
    left = small_library / "recovering"
    left.mkdir()
    (left / "catalogue.db-wal").write_bytes(b"")  # power was lost once the catalogue was in place
    run_json("recover", small_library)
    assert not left.exists()
    assert sound(small_library)
