"""Libraries that are damaged, of a newer version, or none at all."""

from __future__ import annotations

import gc
import random
import re
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

import h5py
import pytest
from small_library import CLIPS, NAMES, run, run_json

from mocapdb.base.files import write_whole
from mocapdb.errors import LibraryError, MocapdbError
from mocapdb.library import Library, verify_library

SHARD = "shards/000001.h5"


def flip(path: Path, position: int, bits: int = 0xFF) -> None:
    data = bytearray(path.read_bytes())
    data[position] ^= bits
    path.write_bytes(data)


def verify(library: Path) -> dict:
    with Library(library) as opened:
        return verify_library(opened)


class TestShards:
    def test_a_flipped_byte_names_the_clip(self, small_library):
        with Library(small_library) as library:
            payload = library.payload(library.record("02_01"))
        shard = small_library / SHARD
        flip(shard, shard.read_bytes().index(payload) + len(payload) // 2)
        report = run_json("verify", small_library, exit_code=1)
        assert [clip["clip"] for clip in report["bad"]] == ["02_01"]
        assert "fails its checksum" in report["bad"][0]["reason"]
        assert report["shards"] == [{"shard": "000001.h5", "reason": "fails its SHA-256"}]
        answer = run("verify", small_library)
        assert answer.stdout == f"{small_library}: 5 of 6 clips are sound.\n"
        assert "bad clip 02_01: " in answer.stderr
        with Library(small_library) as library:
            assert len(library.clip("01_01")) == 120  # the others are there
            with pytest.raises(LibraryError, match="fails its checksum"):
                library.clip("02_01")

    @pytest.mark.parametrize("size", [0, 1, 100, 2000, -1])
    def test_a_truncated_shard(self, small_library, size):
        shard = small_library / SHARD
        shard.write_bytes(shard.read_bytes()[:size])
        report = verify(small_library)
        assert [clip["clip"] for clip in report["bad"]] == list(NAMES)
        assert len(report["shards"]) == 1

    def test_a_missing_shard(self, small_library):
        (small_library / SHARD).unlink()
        report = verify(small_library)
        assert len(report["bad"]) == len(CLIPS)
        assert "the shard is missing" in report["bad"][0]["reason"]
        assert "No such file" in report["shards"][0]["reason"]

    def test_a_missing_folder_of_shards(self, small_library):
        (small_library / SHARD).unlink()
        (small_library / "shards").rmdir()
        assert len(verify(small_library)["bad"]) == len(CLIPS)

    def test_a_shard_of_a_newer_format(self, small_library):
        with h5py.File(small_library / SHARD, "r+") as file:
            file.attrs["format"] = 2
        reason = verify(small_library)["bad"][0]["reason"]
        assert "expected shard format 1 or older, but got 2. Install a newer mocapdb" in reason

    @pytest.mark.parametrize("content", ["text", "other hdf5"])
    def test_something_else_in_its_place(self, small_library, content):
        shard = small_library / SHARD
        shard.unlink()
        if content == "text":
            shard.write_text("no shard")
        else:
            with h5py.File(shard, "w") as file:
                file["x"] = [1, 2, 3]
        assert len(verify(small_library)["bad"]) == len(CLIPS)

    def test_another_clips_bytes_are_told_by_their_skeleton(self, small_library):
        with closing(sqlite3.connect(small_library / "catalogue.db")) as database:
            database.execute("UPDATE clips SET skeleton_id = 3 - skeleton_id WHERE skeleton_id < 3")
            database.commit()
        bad = verify(small_library)["bad"]
        assert bad
        assert "Expected the skeleton with digest" in bad[0]["reason"]

    def test_any_flipped_byte_is_found_and_none_is_a_fault(self, small_library):
        shard = small_library / SHARD
        whole = shard.read_bytes()
        chance = random.Random(0)
        # HDF5's own structures are few bytes: all of them, and some of the payloads
        with Library(small_library) as library:
            payloads = [library.payload(record) for record in library.records()]
        start = min(whole.index(payload) for payload in payloads)
        structure = [*range(start), *range(start + sum(map(len, payloads)), len(whole))]
        for position in [*chance.sample(structure, 150), *chance.sample(range(len(whole)), 30)]:
            shard.write_bytes(whole)
            flip(shard, position, 1 << chance.randrange(8))
            report = verify(small_library)
            assert len(report["shards"]) == 1


class TestCatalogue:
    @pytest.mark.parametrize("command", ["info", "ls", "verify", "compact"])
    def test_no_library(self, tmp_path, command):
        (tmp_path / "empty").mkdir()
        (tmp_path / "file").write_text("x")
        for name in ("missing", "empty", "file"):
            answer = run(command, tmp_path / name)
            assert answer.exit_code == 1
            assert answer.stdout == ""
            assert "not a library (no catalogue.db in it)" in answer.stderr
        assert sorted(path.name for path in tmp_path.iterdir()) == ["empty", "file"]

    def test_a_newer_format(self, small_library):
        with closing(sqlite3.connect(small_library / "catalogue.db")) as database:
            database.execute("PRAGMA user_version = 7")
        for command in ("info", "compact"):
            answer = run(command, small_library)
            assert answer.exit_code == 1
            assert "expected library format 6 or older, but got 7" in answer.stderr

    @pytest.mark.parametrize("content", [b"", b"no database, but long enough" * 40])
    def test_a_file_that_is_no_database(self, small_library, content):
        (small_library / "catalogue.db").write_bytes(content)
        with pytest.raises(LibraryError, match=r"catalogue\.db: "):
            Library(small_library)

    def test_another_database(self, small_library):
        (small_library / "catalogue.db").unlink()
        with closing(sqlite3.connect(small_library / "catalogue.db")) as database:
            database.execute("CREATE TABLE clips (name TEXT)")
        with pytest.raises(LibraryError, match="SQLite file, but not a library's catalogue"):
            Library(small_library)

    def test_a_name_that_is_no_text(self, small_library):
        catalogue = small_library / "catalogue.db"
        data = catalogue.read_bytes()
        n_found = 0
        for found in re.finditer(b"clips_stem", data):
            catalogue.write_bytes(data)
            flip(catalogue, found.start(), 0x80)
            try:
                with Library(small_library) as library:  # a copy that SQLite no longer reads
                    assert library.catalogue.check() is None
            except LibraryError as problem:
                assert "catalogue.db: " in str(problem)
                n_found += 1
        assert n_found
        gc.collect()  # a connection that was left open would be told by now

    @pytest.mark.parametrize("table", ["skeletons", "shards", "builds"])
    def test_rows_that_are_missing(self, small_library, table):
        with closing(sqlite3.connect(small_library / "catalogue.db")) as database:
            database.execute(f"DELETE FROM {table}")
            database.commit()
        (problem,) = verify(small_library)["shards"]
        assert problem["shard"] == "catalogue.db"
        assert problem["reason"].endswith(f"refers to a row that is missing from {table}")

    @pytest.mark.parametrize("table", ["clips", "skeletons", "shards"])
    def test_a_table_that_is_missing(self, small_library, table):
        with closing(sqlite3.connect(small_library / "catalogue.db")) as database:
            database.execute(f"DROP TABLE {table}")
        with pytest.raises(LibraryError, match="no such table"):
            verify(small_library)

    @pytest.mark.parametrize("text", ["{", "[]", '{"names": 3}', "null"])
    def test_a_damaged_skeleton(self, small_library, text):
        with closing(sqlite3.connect(small_library / "catalogue.db")) as database:
            database.execute("UPDATE skeletons SET json = ?", [text])
            database.commit()
        reason = verify(small_library)["bad"][0]["reason"]
        assert "is damaged" in reason

    def test_any_flipped_bit_ends_in_an_answer_or_an_error(self, small_library):
        catalogue = small_library / "catalogue.db"
        whole = catalogue.read_bytes()
        chance = random.Random(0)
        for position in [*range(0, 100, 3), *chance.sample(range(len(whole)), 100)]:
            catalogue.write_bytes(whole)
            flip(catalogue, position, 1 << chance.randrange(8))
            for path in small_library.glob("catalogue.db-*"):
                path.unlink()
            try:
                with Library(small_library) as library:
                    library.info()
                    verify_library(library)
            except MocapdbError:
                continue


class TestWhoseBytesTheseAre:
    def test_two_rows_that_changed_places(self, small_library):
        with closing(sqlite3.connect(small_library / "catalogue.db")) as catalogue, catalogue:
            rows = dict(catalogue.execute("SELECT name, shard_row FROM clips"))
            one, other = "01_01", "02_01"
            for name, row in ((one, rows[other]), (other, rows[one])):
                catalogue.execute("UPDATE clips SET shard_row = ? WHERE name = ?", (row, name))
        report = run_json("verify", small_library, exit_code=1)
        assert [clip["clip"] for clip in report["bad"]] == [one, other]
        assert "holds another clip than the catalogue says" in report["bad"][0]["reason"]
        answer = run("export", small_library, one, "-o", small_library.parent / "x.bvh")
        assert "holds another clip" in answer.stderr
        with Library(small_library) as library, pytest.raises(LibraryError, match="another clip"):
            library.clip(other, frames=slice(0, 3))

    def test_fewer_frames_than_the_catalogue_says(self, small_library):
        with closing(sqlite3.connect(small_library / "catalogue.db")) as catalogue, catalogue:
            catalogue.execute("UPDATE clips SET frames = frames + 1 WHERE name = '01_01'")
        report = run_json("verify", small_library, exit_code=1)
        assert [clip["clip"] for clip in report["bad"]] == ["01_01"]

    @pytest.mark.parametrize("bit", [1, 2, 4])
    def test_a_flipped_bit_in_an_index(self, small_library, bit):
        path = small_library / "catalogue.db"
        with closing(sqlite3.connect(path)) as catalogue:
            catalogue.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            (root,) = catalogue.execute(
                "SELECT rootpage FROM sqlite_master WHERE name = 'clips_live_name'"
            ).fetchone()
            (size,) = catalogue.execute("PRAGMA page_size").fetchone()
            ids = dict(catalogue.execute("SELECT name, id FROM clips"))
        page = path.read_bytes()[(root - 1) * size : root * size]
        name = b"02_01"
        flip(path, (root - 1) * size + page.index(name) + len(name) - 1, bit)
        assert len(ids) == len(CLIPS)
        with Library(small_library) as library:
            for asked in NAMES:
                with suppress(MocapdbError):  # that it is damaged, or not there, is said
                    assert library.clip(asked).name == asked
        assert run_json("verify", small_library, exit_code=1)["shards"]


class TestNothingIsLostThatIsNotOurs:
    def test_a_catalogue_that_is_gone(self, small_library, small_corpus):
        (small_library / "catalogue.db").unlink()
        shards = {path: path.read_bytes() for path in (small_library / "shards").iterdir()}
        answer = run("build", small_corpus, "-o", small_library)
        assert "catalogue.db is gone, but 1 file(s) of clips are there" in answer.stderr
        assert {path: path.read_bytes() for path in (small_library / "shards").iterdir()} == shards

    @pytest.mark.parametrize("part", ["shards", "features", "catalogue.db", "writer.json"])
    def test_a_part_that_is_a_link(self, small_library, small_corpus, tmp_path, part):
        elsewhere = tmp_path / "elsewhere"
        if (small_library / part).exists():
            (small_library / part).rename(elsewhere)
        else:
            elsewhere.write_text("precious")
        if elsewhere.is_dir():
            (elsewhere / "diary.txt").write_text("precious")
        (small_library / part).symlink_to(elsewhere)
        before = (elsewhere / "diary.txt") if elsewhere.is_dir() else elsewhere
        content = before.read_bytes()
        for command in (("compact",), ("index",)):
            answer = run(*command, small_library)
            assert "but it is a link" in answer.stderr
        assert before.read_bytes() == content

    def test_what_is_no_shard_stays(self, small_library):
        notes = [small_library / "shards" / name for name in ("notes.txt", "7.h5", "000001.h5.bak")]
        for note in notes:
            note.write_text("mine")
        stray = small_library / "shards" / "000099.h5.partial"
        stray.write_text("left by a killed writer")
        run("compact", small_library)
        assert all(note.read_text() == "mine" for note in notes)
        assert not stray.exists()

    def test_a_link_in_place_of_an_unfinished_file(self, tmp_path):
        precious = tmp_path / "precious"
        precious.write_text("mine")
        (tmp_path / "new.h5.partial").symlink_to(precious)
        write_whole(tmp_path / "new.h5", b"content", one_writer=True)
        assert precious.read_text() == "mine"
        assert (tmp_path / "new.h5").read_bytes() == b"content"

    @pytest.mark.parametrize("name", ["../evil", "/evil", "a/../../evil", "C:\\evil", "..\\evil"])
    def test_a_name_is_no_path_out_of_the_folder(self, small_library, tmp_path, name):
        with closing(sqlite3.connect(small_library / "catalogue.db")) as catalogue, catalogue:
            catalogue.execute("UPDATE clips SET name = ? WHERE name = '01_01'", (name,))
        out = tmp_path / "out" / "deep"
        answer = run("clean", small_library, "-o", out)
        assert "leads out of the folder" in answer.stderr
        assert not list(tmp_path.rglob("*evil*"))
