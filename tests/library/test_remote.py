"""Libraries in object storage: what fsspec reaches is read as a folder is, and never written to."""

from __future__ import annotations

import shutil
import sqlite3
import sys
import threading
from contextlib import closing
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from small_library import NAMES, decoded, run, run_json

from mocapdb import Library
from mocapdb.errors import LibraryError, MissingExtraError
from mocapdb.library import addresses, remote, verify_library
from mocapdb.library.addresses import address_of, with_addresses

fsspec = pytest.importorskip("fsspec")
ADDRESS = "memory://bucket/small.mocapdb"


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("MOCAPDB_CACHE", str(folder))
    return folder


@pytest.fixture
def stored(small_library_template):
    """The small library in a store that lives in memory."""
    files = fsspec.filesystem("memory")
    put(files, small_library_template)
    yield files
    files.rm("/bucket", recursive=True)


def put(files, library):
    for path in sorted(library.rglob("*")):
        if path.is_file():
            name = path.relative_to(library).as_posix()
            files.pipe_file(f"/bucket/small.mocapdb/{name}", path.read_bytes())


def asked_for(files, monkeypatch):
    """The files of a store that are opened from now on."""
    names = []
    opens = type(files).open

    def noted(self, path, *args, **options):
        names.append(path.rpartition("small.mocapdb/")[2])
        return opens(self, path, *args, **options)

    monkeypatch.setattr(type(files), "open", noted)
    return names


@pytest.fixture
def served(small_library_template):
    """The small library on a web server of this machine."""

    class Silent(SimpleHTTPRequestHandler):
        def log_message(self, *args):
            pass

    handler = partial(Silent, directory=str(small_library_template.parent))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{server.server_address[1]}/{small_library_template.name}"
        server.shutdown()
        thread.join()


class TestReading:
    def test_every_clip_is_that_of_the_folder(self, stored, small_library_template):
        assert decoded(ADDRESS) == decoded(small_library_template)
        with Library(ADDRESS) as library, Library(small_library_template) as folder:
            ours, theirs = library.info(), folder.info()
            assert ours.pop("disk_bytes") == pytest.approx(theirs.pop("disk_bytes"), rel=0.2)
            assert ours == theirs
            assert ADDRESS in repr(library)
            assert verify_library(library)["bad"] == []

    def test_over_http(self, served, small_library_template):
        pytest.importorskip("aiohttp")
        assert decoded(served) == decoded(small_library_template)

    def test_from_a_folder_by_its_address(self, small_library):
        assert decoded(f"file://{small_library}") == decoded(small_library)
        assert decoded(Path(f"file://{small_library}")) == decoded(small_library)

    def test_a_list_takes_the_catalogue_alone(self, stored, monkeypatch):
        asked = asked_for(stored, monkeypatch)
        with Library(ADDRESS) as library:
            assert [record.name for record in library.records()] == list(NAMES)
        assert asked == ["catalogue.db"]
        with Library(ADDRESS) as library:
            library.clip("01_01")
        assert asked == ["catalogue.db", "shards/000001.h5"]
        with Library(ADDRESS) as library:
            library.clip("01_02")
        assert len(asked) == 2

    def test_a_catalogue_that_has_changed_is_copied_anew(self, stored, small_library):
        with Library(ADDRESS) as library:
            library.clip("01_01")
        shutil.copytree(small_library, small_library.parent / "other")
        with closing(sqlite3.connect(small_library / "catalogue.db")) as database:
            database.execute("UPDATE clips SET description = 'anew' WHERE stem = '01_01'")
            database.commit()
        put(stored, small_library)
        with Library(ADDRESS) as library:
            assert library.record("01_01").description == "anew"

    def test_the_cache_is_bounded(self, stored, cache, monkeypatch):
        with Library(ADDRESS) as library:
            library.clip("01_01")
        assert len(list(cache.rglob("000001.h5"))) == 1
        monkeypatch.setattr(remote, "MOST_CACHED", 1)
        remote._make_room(1)
        assert not list(cache.rglob("000001.h5"))
        with Library(ADDRESS) as library, pytest.raises(LibraryError, match="1 bytes at most"):
            (cache / "x").mkdir()
            remote._Store(ADDRESS).copy("catalogue.db", cache / "x" / "catalogue.db", most=1)
        assert not list((cache / "x").iterdir())

    def test_by_commands(self, stored, tmp_path):
        assert [row["clip"] for row in run_json("ls", ADDRESS)["clips"]] == list(NAMES)
        assert run_json("info", ADDRESS)["clips"] == len(NAMES)
        assert f"{ADDRESS}: 6 of 6 clips are sound." in run("verify", ADDRESS).output
        assert run("export", ADDRESS, "01_01", "-o", tmp_path / "a.bvh").exit_code == 0
        done = run("query", ADDRESS, "01_01")
        assert done.exit_code == 1
        assert f"{ADDRESS}: the library was built without features" in done.output


class TestRefused:
    @pytest.mark.parametrize(
        "command",
        [
            ["index", ADDRESS],
            ["compact", ADDRESS],
            ["recover", ADDRESS],
            ["clean", ADDRESS, "--apply"],
            ["clean", ADDRESS, "--undo"],
            ["build", "CORPUS", "-o", ADDRESS],
        ],
    )
    def test_writing(self, stored, small_corpus_template, command, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        arguments = [str(small_corpus_template) if each == "CORPUS" else each for each in command]
        done = run(*arguments)
        assert done.exit_code == 1
        assert f"{ADDRESS}: expected a folder of this machine" in done.output
        assert not (tmp_path / "memory:").exists()

    def test_writing_to_a_copy(self, stored):
        with Library(ADDRESS) as library:
            folder = library.path
        done = run("index", folder)
        assert "it is a copy of one in object storage" in done.output

    def test_a_library_that_is_not_there(self, stored):
        with pytest.raises(LibraryError, match="not a library"):
            Library("memory://bucket/other.mocapdb")

    @pytest.mark.parametrize("address", ["nonsense://a/b", "http://127.0.0.1:1/l.mocapdb"])
    def test_an_address_that_nobody_reads(self, address):
        with pytest.raises(LibraryError, match=address):
            Library(address)

    def test_without_fsspec(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "fsspec.core", None)
        with pytest.raises(MissingExtraError, match=r"pip install 'mocapdb\[remote\]'"):
            Library(ADDRESS)

    def test_a_catalogue_in_the_middle_of_a_change(self, stored):
        stored.pipe_file("/bucket/small.mocapdb/catalogue.db-wal", b"more")
        with pytest.raises(LibraryError, match="while somebody wrote"):
            Library(ADDRESS)

    def test_no_library_at_all(self, stored, cache):
        stored.pipe_file("/bucket/small.mocapdb/catalogue.db", b"no database" * 1000)
        with pytest.raises(LibraryError):
            Library(ADDRESS)
        assert not list(cache.rglob("remote.json"))

    @pytest.mark.parametrize("name", ["../../../evil.h5", "/etc/passwd", "000001.h5/../x"])
    def test_names_that_lead_elsewhere(self, stored, small_library, name):
        with closing(sqlite3.connect(small_library / "catalogue.db")) as database:
            database.execute("UPDATE shards SET file = ?", [name])
            database.commit()
        put(stored, small_library)
        with pytest.raises(LibraryError, match="it is damaged, or made to harm"):
            Library(ADDRESS)


class TestDamage:
    def test_a_shard_that_is_not_what_was_written(self, stored):
        name = "/bucket/small.mocapdb/shards/000001.h5"
        data = bytearray(stored.cat_file(name))
        data[-1] ^= 1
        stored.pipe_file(name, bytes(data))
        with Library(ADDRESS) as library:
            with pytest.raises(LibraryError, match="fails its SHA-256"):
                library.clip("01_01")
            report = verify_library(library)
            assert len(report["bad"]) == len(NAMES)
            assert report["shards"] == [
                {"shard": "000001.h5", "reason": f"{ADDRESS}/shards/000001.h5: fails its SHA-256."}
            ]

    @pytest.mark.parametrize("change", ["cut", "longer", "gone"])
    def test_a_shard_of_another_size(self, stored, change, cache):
        name = "/bucket/small.mocapdb/shards/000001.h5"
        data = stored.cat_file(name)
        stored.rm(name)
        if change != "gone":
            stored.pipe_file(name, data[:-9] if change == "cut" else data + b"more")
        what = {"cut": "cut short", "longer": "bytes at most", "gone": "the file is missing"}
        with Library(ADDRESS) as library, pytest.raises(LibraryError, match=what[change]):
            library.clip("01_01")
        assert not list(cache.rglob("*.h5*"))

    def test_a_copy_that_was_changed_is_copied_anew(self, stored):
        with Library(ADDRESS) as library:
            path = library.path / "catalogue.db"
        path.write_bytes(b"no database")
        with Library(ADDRESS) as library:
            assert len(library) == len(NAMES)


def test_what_is_an_address():
    assert address_of(Path("memory://a/b")) == "memory://a/b"
    assert address_of("file:///a/b/") == address_of(Path("file:///a/b")) == "file:///a/b"
    assert address_of("a/b:c/d") is None
    folder = addresses.copy_folder("s3://a/b")
    assert with_addresses(f"{folder}/catalogue.db: bad") == "s3://a/b/catalogue.db: bad"
