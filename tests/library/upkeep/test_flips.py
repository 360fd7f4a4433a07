"""A flipped bit is found or harmless, wherever it is: in full size ``python tests/flips.py``."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing, suppress

import flips
import pytest
from small_library import run, run_json

from mocapdb.errors import LibraryError
from mocapdb.library import Library, Retrieval, recover_library
from mocapdb.library.cycles_file import list_cycles
from mocapdb.library.index_pieces import PARTS
from mocapdb.library.row_checksums import KEYS, find_damage


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    return flips.make_library(tmp_path_factory.mktemp("flips"))


@pytest.fixture
def library(template, tmp_path):
    return shutil.copytree(template, tmp_path / "l.mocapdb")


def flip_middle(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 4
    path.write_bytes(data)


def test_a_bit_anywhere(library):
    found = [outcome for _, _, outcome in flips.flips(library, 42, seed=1)]
    assert set(found) == {"found", "harmless"}
    assert found.count("found") > len(found) / 2


def is_damaged(database):
    try:
        return bool(find_damage(database))
    except sqlite3.OperationalError:  # bytes that are no text
        return True


@pytest.mark.parametrize("table", KEYS)
def test_every_column_of_the_catalogue(template, table):
    with closing(sqlite3.connect(template / "catalogue.db")) as database:
        columns = [row[1] for row in database.execute(f"PRAGMA table_info({table})")]
        assert columns
        for column in columns:
            for value in ("'x'", f"{column} || 'x'", f"{column} + 1"):
                with closing(sqlite3.connect(":memory:")) as copy:
                    database.backup(copy)
                    with suppress(sqlite3.IntegrityError):  # then it cannot be so
                        sql = f"UPDATE {table} SET {column} = {value} WHERE {column} IS NOT {value}"
                        n_changed = copy.execute(sql).rowcount
                        copy.commit()
                        assert is_damaged(copy) == bool(n_changed), (column, value)


@pytest.mark.parametrize("file", [*(f"search/000001.{part}" for part in PARTS), "models.h5"])
def test_a_derived_file_is_told_not_used_and_made_anew(library, template, file):
    before = flips.answers(library)
    flip_middle(library / file)
    if file != "models.h5":  # classes that are learned again differ in the last digits
        assert flips.answers(library) == before
    report = run_json("verify", library, exit_code=1)
    (damaged,) = report["shards"]
    assert damaged["shard"] in (file, "search/000001, clips 1 to 4")
    assert damaged["reason"] == "fails its SHA-256"
    assert run("index", library).exit_code == 0
    assert run("verify", library).exit_code == 0


def test_features(library):
    flip_middle(next((library / "features").iterdir()))
    shutil.rmtree(library / "search")
    with Library(library) as opened, pytest.raises(LibraryError, match="damaged"):
        Retrieval(opened)
    assert recover_library(library).indexed == 4
    assert run("verify", library).exit_code == 0


def test_a_kept_cycle(library):
    flip_middle(library / "cycles.h5")
    with pytest.raises(LibraryError, match="damaged"):
        list_cycles(library)
    (library / "catalogue.db").unlink()  # they are told from sound ones without it, too
    answer = run("recover", library)
    assert f"mocapdb cycle {library} --class" in answer.stderr
    assert "cycles.h5" in answer.stdout
    assert run("verify", library).exit_code == 0
    assert list_cycles(library) == []
