"""Libraries made by someone who means harm: refused in plain words, and nothing waits for ever."""

from __future__ import annotations

import os
import sqlite3
import zlib
from contextlib import closing

import h5py
import numpy as np
import pytest
from small_library import decoded, leftovers, run, run_json

from mocapdb.errors import LibraryError
from mocapdb.library import Library, SavedQuery
from mocapdb.library.row_checksums import fill_checksums

ENDLESS = "WITH RECURSIVE r(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM r) SELECT x FROM r"
posix = pytest.mark.skipif(os.name != "posix", reason="pipes and devices are POSIX's")


def change(library, *statements):
    """Change a catalogue as whoever knows of its checksums can."""
    with closing(sqlite3.connect(library / "catalogue.db", isolation_level=None)) as database:
        for statement in statements:
            database.execute(*statement)
        fill_checksums(database)


@pytest.mark.parametrize(
    "statements",
    [
        ["DROP VIEW classes", f"CREATE VIEW classes AS {ENDLESS}"],
        [f"CREATE VIEW other AS {ENDLESS}"],
        [f"CREATE TRIGGER t AFTER UPDATE ON clips BEGIN SELECT count(*) FROM ({ENDLESS}); END"],
        ["CREATE TRIGGER t AFTER INSERT ON clips BEGIN DELETE FROM shards; END"],
        ["CREATE VIRTUAL TABLE t USING fts5(words)"],
    ],
)
def test_views_and_triggers_of_others(small_library, statements):
    before = decoded(small_library)
    change(small_library, *([each] for each in statements))
    for command in (["ls"], ["info"], ["verify"], ["compact"], ["classify", "--undo"]):
        answer = run(command[0], small_library, *command[1:])
        assert answer.exit_code == 1
        assert "expected the tables of a library, but it also has the" in answer.stderr
    assert run("recover", small_library).exit_code == 0
    assert decoded(small_library) == before


@posix
@pytest.mark.parametrize("part", ["writer.json", "shards/000001.h5"])
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_pipes_and_devices(small_library, part, kind):
    (small_library / part).unlink(missing_ok=True)
    os.mkfifo(small_library / part) if kind == "pipe" else (small_library / part).symlink_to(
        "/dev/zero"
    )
    codes = [run(command, small_library).exit_code for command in ("verify", "compact")]
    assert codes == ([0, 1] if part == "writer.json" else [1, 0])
    (small_library / part).unlink()
    assert not leftovers(small_library)


@pytest.mark.parametrize(
    ("table", "column"),
    [("clips", "provenance"), ("clips", "columns"), ("clips", "settings"), ("skeletons", "json")],
)
def test_what_is_nested_without_end(small_library, table, column):
    change(small_library, [f"UPDATE {table} SET {column} = ?", ["[" * 100_000]])
    run("info", small_library)  # which sees that no fault is reported
    run("export", small_library, "01_01", "-o", small_library / "a.bvh")
    with pytest.raises(LibraryError, match="damaged"):
        SavedQuery.of_json("mine", "[" * 100_000)


def test_what_is_nested_in_a_shard(small_library):
    with h5py.File(small_library / "shards/000001.h5", "r+") as shard:
        offsets, entries = shard["entry_offsets"][:], shard["entries"][:].tobytes()
        deep = zlib.compress(b"[" * 100_000)
        del shard["entries"], shard["entry_offsets"]
        shard["entries"] = np.frombuffer(deep + entries[offsets[1] :], np.uint8)
        shard["entry_offsets"] = np.r_[0, offsets[1:] - offsets[1] + len(deep)]
    (small_library / "catalogue.db").unlink()
    (dropped,) = run_json("recover", small_library)["dropped"]
    assert dropped["what"] == "row 0 of 000001.h5"


@pytest.mark.parametrize(
    "options",
    [
        '"k": "2"',
        '"shell": 1',
        '"only": []',
        '"only": {"where": {"style": 1}}',
        '"only": {"facets": {"turn": 1}}',
        '"joints": [1]',
        '"weights": ["1"]',
    ],
)
def test_saved_queries_of_another_kind(options):
    text = f'{{"examples": [], "unlike": [], "created": "", "options": {{{options}}}}}'
    with pytest.raises(LibraryError, match="saved query 'mine' is damaged"):
        SavedQuery.of_json("mine", text)


def test_names_are_shown_escaped(small_library):
    change(small_library, ["UPDATE clips SET label = ?", ["\x1b[2J\u202egnp.bvh"]])
    shown = run("ls", small_library).stdout
    assert "\\x1b[2J\\u202egnp" in shown
    with Library(small_library) as library:
        assert "\u202e" in str(library.records()[0].label)


@pytest.mark.parametrize("how", ["huge", "elsewhere", "link", "virtual"])
def test_datasets_that_are_not_in_the_file(small_library, tmp_path, how):
    elsewhere = tmp_path / "elsewhere.h5"
    with h5py.File(elsewhere, "w") as other:
        other["data"] = np.zeros(100_000, np.uint8)
    with h5py.File(small_library / "shards/000001.h5", "r+") as shard:
        shape = shard["payload"].shape
        del shard["payload"]
        if how == "huge":
            shard.create_dataset("payload", (10**12,), np.uint8, chunks=(2**20,))
        elif how == "elsewhere":
            shard.create_dataset(
                "payload", shape, np.uint8, external=[(elsewhere, 0, h5py.h5f.UNLIMITED)]
            )
        elif how == "link":
            shard["payload"] = h5py.ExternalLink(elsewhere, "data")
        else:
            layout = h5py.VirtualLayout(shape, np.uint8)
            layout[:] = h5py.VirtualSource(elsewhere, "data", shape=(100_000,))[: shape[0]]
            shard.create_virtual_dataset("payload", layout)
    said = run("export", small_library, "01_01", "-o", tmp_path / "a.bvh").stderr
    assert "000001.h5: not a whole shard (payload" in said
