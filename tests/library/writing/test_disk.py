"""Disks that are full or cannot be written."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from small_library import CLIPS, QUICK, build, decoded, rows, run, sound, write_clips

import mocapdb.library.building.commit_clips as committing
from mocapdb.errors import LibraryError
from mocapdb.library import BuildSettings, Library, verify_library

resource = pytest.importorskip("resource", reason="limits are POSIX's")
LARGE = BuildSettings(QUICK.target, {"codec": "raw"})  # 60 kB a clip


@contextmanager
def file_size_limit(size: int) -> Iterator[None]:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@contextmanager
def small_disk(folder: Path, size_kib: int, options: str = "") -> Iterator[Path]:
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size_kib}k{options}", "tmpfs", str(folder)]
    try:
        mounted = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        mounted = False
    if not mounted:
        pytest.skip("may not mount a small disk here")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.parametrize("size_kib", [1, 20, 60, 100])
def test_a_limit_of_the_file_size(small_corpus, tmp_path, monkeypatch, size_kib):
    library = tmp_path / "l.mocapdb"
    monkeypatch.setattr(committing, "COMMIT_SECONDS", 0.0)
    with file_size_limit(1024 * size_kib), pytest.raises(LibraryError, match=r"[Ff]ree "):
        build(small_corpus, library, LARGE)
    assert not list(library.rglob("*.partial*"))
    done = len(rows(library)) if (library / "catalogue.db").exists() else 0
    if done:
        assert sound(library)
    report = build(small_corpus, library, LARGE)
    assert (report.built, report.skipped) == (len(CLIPS) - done, done)
    assert sound(library)


@pytest.mark.parametrize("size_kib", [64, 200, 400])
def test_a_small_disk(small_corpus, tmp_path, monkeypatch, size_kib):
    monkeypatch.setattr(committing, "COMMIT_SECONDS", 0.0)
    with small_disk(tmp_path / "disk", size_kib) as disk:
        library = disk / "l.mocapdb"
        answer = run("build", small_corpus, "-o", library, "--mean-mm", "1e-9", "--jobs", 1)
        assert answer.exit_code == 1
        assert "free " in answer.stderr.lower()
        assert len(answer.stderr.splitlines()) <= 2
        assert not list(library.rglob("*.partial*"))
        done = len(rows(library)) if (library / "catalogue.db").exists() else 0
        assert done < len(CLIPS)
        if done:
            assert sound(library)
        shutil.copytree(library, tmp_path / "larger.mocapdb")
    larger = tmp_path / "larger.mocapdb"
    assert run("build", small_corpus, "-o", larger, "--mean-mm", "1e-9").exit_code == 0
    assert len(rows(larger)) == len(CLIPS)
    assert sound(larger)


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_shard_that_cannot_be_written(small_corpus, small_library, monkeypatch, call):
    before = decoded(small_library)
    write_clips(small_corpus, {"new.bvh": ("hop", 1)})

    def full(*arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(*((os, call) if call == "fsync" else (Path, call)), full)
    with pytest.raises(LibraryError, match=r"No space left on device\)\. Free 0\.0 MB or more"):
        build(small_corpus, small_library)
    monkeypatch.undo()
    assert sound(small_library)
    assert decoded(small_library) == before
    assert build(small_corpus, small_library).built == 1


def test_exporting_to_a_full_disk_leaves_what_was_there(small_library, tmp_path):
    target = tmp_path / "out.bvh"
    target.write_text("precious")
    with file_size_limit(2000):
        answer = run("export", small_library, "01_01", "-o", target)
    assert answer.exit_code == 1
    assert "File too large" in answer.stderr
    assert target.read_text() == "precious"
    assert [path.name for path in tmp_path.glob("*out*")] == ["out.bvh"]


class TestReadOnly:
    """As a user who may read and not write; root is made one for the time."""

    @pytest.fixture
    def readable(self, small_library) -> Iterator[Path]:
        if os.name != "posix":
            pytest.skip("permissions are POSIX's")
        with tempfile.TemporaryDirectory() as folder:
            library = Path(shutil.copytree(small_library, Path(folder) / "l.mocapdb"))
            Library(library).close()
            for path in (library, *library.rglob("*"), Path(folder)):
                path.chmod(0o555 if path.is_dir() else 0o444)
            root = os.geteuid() == 0
            if root:
                os.seteuid(65534)
            try:
                yield library
            finally:
                if root:
                    os.seteuid(0)
                for path in (Path(folder), library, *library.rglob("*")):
                    path.chmod(0o755 if path.is_dir() else 0o644)

    def test_it_opens(self, readable):
        with Library(readable) as library:
            assert len(library.clip("01_01")) == 120
            assert verify_library(library)["bad"] == []

    def test_it_cannot_be_written(self, readable):
        answer = run("compact", readable)
        assert answer.exit_code == 1
        assert "cannot write to the library" in answer.stderr

    def test_an_export_beside_it(self, readable):
        answer = run("export", readable, "01_01", "-o", readable / "out.bvh")
        assert answer.exit_code == 1
        assert "Permission denied" in answer.stderr

    def test_a_disk_that_is_read_only(self, small_library, tmp_path):
        expected = decoded(small_library)
        with small_disk(tmp_path / "disk", 1024) as disk:
            library = Path(shutil.copytree(small_library, disk / "l.mocapdb"))
            subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
            assert decoded(library) == expected
            assert run("verify", library).exit_code == 0
            answer = run("compact", library)
            assert answer.exit_code == 1
            assert len(answer.stderr.splitlines()) == 1

    def test_commits_that_are_only_in_the_log_are_not_passed_over(
        self, small_corpus, tmp_path, monkeypatch
    ):
        monkeypatch.setattr(committing, "COMMIT_SECONDS", 0.0)
        library, copy = tmp_path / "l.mocapdb", tmp_path / "copy.mocapdb"

        def copying(done: int, total: int, name: str) -> None:
            if done == 3:
                shutil.copytree(library, copy)

        build(small_corpus, library, progress=copying)
        (copy / "catalogue.db-shm").unlink()
        with small_disk(tmp_path / "disk", 1024) as disk:
            shutil.copytree(copy, disk / "l.mocapdb")
            subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
            with pytest.raises(LibraryError, match=r"catalogue\.db: "):
                Library(disk / "l.mocapdb")
        assert len(rows(copy)) == 3


def test_unreadable_folders_and_files_of_a_corpus(small_corpus_template, tmp_path):
    if os.name != "posix":
        pytest.skip("permissions are POSIX's")
    with tempfile.TemporaryDirectory() as folder:
        corpus = Path(shutil.copytree(small_corpus_template, Path(folder) / "corpus"))
        # what is loaded and compiled now need not be by a user who may not read it
        assert run("build", corpus, "-o", tmp_path / "warm-up.mocapdb", "--jobs", 1).exit_code == 0
        Path(folder).chmod(0o777)
        (corpus / "02/02_01.amc").chmod(0)
        (corpus / "bvh").chmod(0)
        root = os.geteuid() == 0
        try:
            if root:
                os.seteuid(65534)
            answer = run("build", corpus, "-o", Path(folder) / "l.mocapdb", "--jobs", 1)
            assert answer.exit_code == 1
            assert "bvh: cannot list the folder (Permission denied)" in answer.stderr
            if root:
                os.seteuid(0)
            (corpus / "bvh").chmod(0o755)
            if root:
                os.seteuid(65534)
            answer = run("build", corpus, "-o", Path(folder) / "l.mocapdb", "--jobs", 1)
            assert answer.exit_code == 1
            assert "02_01.amc: cannot read (Permission denied)" in answer.stderr
            assert len(rows(Path(folder) / "l.mocapdb")) == len(CLIPS) - 1
        finally:
            if root:
                os.seteuid(0)
