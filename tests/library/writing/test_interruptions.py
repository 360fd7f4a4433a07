"""Builds that are killed, interrupted, or run at the same time as something else."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import small_library
from small_library import (
    CLIPS,
    NAMES,
    OPTIONS,
    build,
    decoded,
    rows,
    run,
    run_json,
    sound,
    write_clips,
)

import mocapdb.library.building.commit_clips as committing
from mocapdb.errors import LibraryLockedError, WorkerError
from mocapdb.library import Library, compact_library, verify_library
from mocapdb.library.building import encode_files
from mocapdb.library.writing import open_for_writing
from mocapdb.library.writing.catalogue_writer import CatalogueWriter

TESTS = Path(small_library.__file__).parent
posix = pytest.mark.skipif(os.name != "posix", reason="signals and forks")


def start(script: str, *arguments: object) -> subprocess.Popen[str]:
    paths = os.pathsep.join([str(TESTS), str(TESTS.parent)])
    return subprocess.Popen(
        [sys.executable, TESTS / script, *map(str, arguments)],
        env=os.environ | {"PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,  # a group of its own, to be signalled as a terminal would
    )


def start_building(corpus: Path, library: Path, jobs: int) -> subprocess.Popen[str]:
    """Start a build and return when it has committed at least one clip and writes another."""
    builds = start("slow_command.py", "build", corpus, "-o", library, *OPTIONS, "--jobs", jobs)
    deadline = time.monotonic() + 300
    while not (library / "shards/000002.h5").exists():
        assert builds.poll() is None, builds.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return builds


def running_in_group(group: int) -> list[str]:
    listed = subprocess.run(
        ["ps", "-eo", "pgid=,stat=,args="], capture_output=True, text=True, check=True
    )
    lines = [line.split(maxsplit=2) for line in listed.stdout.splitlines()]
    return [line[-1] for line in lines if line[0] == str(group) and not line[1].startswith("Z")]


@posix
def test_killed_at_any_moment_a_library_is_sound_and_the_next_build_goes_on(tmp_path):
    corpus = tmp_path / "corpus"
    write_clips(corpus, {"a.bvh": ("walk", 1), "b/a.amc": ("run", 2)})
    with start("crashing_builds.py", corpus, tmp_path, 10) as crashing:
        out, errors = crashing.communicate(timeout=900)
    assert errors == ""
    assert int(out) > 20
    whole = decoded(tmp_path / "warm-up.mocapdb")
    found = set()
    for library in sorted(tmp_path.glob("*-0*.mocapdb")):
        committed = {}
        if (library / "catalogue.db").exists():
            with Library(library) as opened:
                assert verify_library(opened)["bad"] == []
            committed = rows(library)
        elif library.exists():
            answer = run("info", library)
            assert (answer.exit_code, "not a library" in answer.stderr) == (1, True)
        found.add(len(committed))
        report = build(corpus, library)
        assert (report.built, report.skipped) == (2 - len(committed), len(committed))
        assert committed.items() <= rows(library).items()  # neither lost nor done again
        assert sound(library)
        assert decoded(library) == whole
    assert found == {0, 1, 2}


@posix
@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c(small_corpus, tmp_path, jobs):
    library = tmp_path / "l.mocapdb"
    with start_building(small_corpus, library, jobs) as builds:
        os.killpg(builds.pid, signal.SIGINT)
        out, errors = builds.communicate(timeout=900)
    assert (builds.returncode, out) == (130, "")
    assert errors.splitlines()[-1] == "Interrupted: nothing is left half written."
    deadline = time.monotonic() + 120
    while running_in_group(builds.pid):
        assert time.monotonic() < deadline, running_in_group(builds.pid)
        time.sleep(0.05)
    assert sound(library)
    committed = rows(library)
    assert 1 <= len(committed) < len(CLIPS)
    assert not (library / "writer.json").exists()
    answer = run_json("build", small_corpus, "-o", library, *OPTIONS)
    assert (answer["built"], answer["skipped"]) == (len(CLIPS) - len(committed), len(committed))
    assert committed.items() <= rows(library).items()


@posix
def test_a_worker_that_is_killed_ends_the_build_with_an_error(small_corpus, tmp_path, monkeypatch):
    parent = os.getpid()

    def dies(*_):
        assert os.getpid() != parent
        os.kill(os.getpid(), signal.SIGKILL)

    monkeypatch.setattr(encode_files, "_encode_file", dies)
    with pytest.raises(WorkerError, match=r"worker process was killed.*fewer --jobs"):
        build(small_corpus, tmp_path / "l.mocapdb", jobs=2)
    monkeypatch.undo()
    assert build(small_corpus, tmp_path / "l.mocapdb").built == len(CLIPS)


def test_a_shard_without_its_commit_is_removed_by_the_next_build(
    small_corpus, small_library, monkeypatch
):
    before = decoded(small_library)
    write_clips(small_corpus, {"new.bvh": ("hop", 1)})

    def fails(self, table, fields):
        assert (table, fields["file"]) == ("shards", "000002.h5")
        raise RuntimeError("between the rename and the commit")

    monkeypatch.setattr(CatalogueWriter, "insert", fails)
    monkeypatch.setattr(open_for_writing, "_remove_strays", lambda catalogue: None)
    with pytest.raises(RuntimeError):
        build(small_corpus, small_library)
    monkeypatch.undo()
    (small_library / "shards/000003.h5.partial").write_bytes(b"half")
    with Library(small_library) as library:
        report = verify_library(library)
    assert report == {
        "clips": 6, "bad": [], "shards": [], "stray": ["000002.h5", "000003.h5.partial"]
    }  # fmt: skip
    assert decoded(small_library) == before
    answer = run("verify", small_library)
    assert answer.exit_code == 0
    assert "stray file 000002.h5" in answer.stdout
    assert build(small_corpus, small_library).built == 1
    assert sound(small_library)


def test_compacting_that_fails_leaves_the_library_as_it_was(
    small_corpus, small_library, monkeypatch
):
    write_clips(small_corpus, {"bvh/02_02.bvh": ("hop", 1)}, 1.85)
    build(small_corpus, small_library)
    before, places = decoded(small_library), rows(small_library)
    monkeypatch.setattr(CatalogueWriter, "remove_deleted", lambda self: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        compact_library(small_library)
    monkeypatch.undo()
    assert (decoded(small_library), rows(small_library)) == (before, places)
    assert compact_library(small_library) > 0
    assert decoded(small_library) == before
    assert sound(small_library)


def test_one_writer_at_a_time_and_any_number_of_readers(small_corpus, tmp_path, monkeypatch):
    library = tmp_path / "l.mocapdb"
    monkeypatch.setattr(committing, "COMMIT_SECONDS", 0.0)
    seen = []

    def meanwhile(done: int, total: int, name: str) -> None:
        with Library(library) as opened:
            assert len(opened) == done
            assert len(opened.clip(name)) == 120
            assert verify_library(opened)["bad"] == []
        if done == 3:
            with pytest.raises(LibraryLockedError, match=f"by process {os.getpid()} on "):
                build(small_corpus, library)
            with pytest.raises(LibraryLockedError, match="Wait until it is done, or stop it"):
                compact_library(library)
            with start("slow_command.py", "build", small_corpus, "-o", library) as other:
                out, errors = other.communicate(timeout=900)
            assert (other.returncode, out) == (1, "")
            assert f"locked by process {os.getpid()} on " in errors
        seen.append(name)

    build(small_corpus, library, progress=meanwhile)
    assert sorted(seen) == list(NAMES)
    assert sound(library)


def test_a_lock_does_not_outlive_its_holder(small_corpus, small_library):
    (small_library / "writer.json").write_text('{"pid": 1, "host": "gone", "since": "2001"}')
    assert build(small_corpus, small_library).skipped == len(CLIPS)
    assert not (small_library / "writer.json").exists()


@posix
@pytest.mark.parametrize("options", [[], ["--json"]])
def test_a_reader_that_goes_away_is_no_error(small_library, options):
    with start("slow_command.py", "ls", small_library, *options) as listing:
        listing.stdout.close()
        errors = listing.stderr.read()
    assert errors == ""
