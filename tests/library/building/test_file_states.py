"""A build reads only files that look otherwise than when they were hashed."""

from __future__ import annotations

import os
import shutil
import time

import pytest
from small_library import build, decoded, made_older, rows, run, run_json, write_clips

from mocapdb.library import Library, compact_library
from mocapdb.library.building import file_states, folder_bodies

LONG_AGO = 1_600_000_000


@pytest.fixture
def settled(monkeypatch):
    """Files that were changed a moment ago are trusted, too."""
    monkeypatch.setattr(file_states, "SETTLED_NS", 0)


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    folder = tmp_path_factory.mktemp("states")
    write_clips(folder / "corpus", {f"walk/{n}.bvh": ("walk", n) for n in range(3)})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(file_states, "SETTLED_NS", 0)
        build(folder / "corpus", folder / "l.mocapdb")
    return folder


@pytest.fixture
def corpus(template, tmp_path, settled):
    """A corpus whose library knows how its files look; they are copied with their times."""
    corpus, library = tmp_path / "corpus", tmp_path / "l.mocapdb"
    shutil.copytree(template / "corpus", corpus)
    shutil.copytree(template / "l.mocapdb", library)
    build(corpus, library)  # it has moved
    return corpus


def library_of(corpus):
    return corpus.parent / "l.mocapdb"


def again(corpus, **options):
    report = build(corpus, library_of(corpus), **options)
    return report.built, report.skipped, report.hashed


def same_length(path, number):
    """Change a digit of a clip and nothing else of its file."""
    data = path.read_bytes()
    place = data.rindex(b".") + 1
    path.write_bytes(data[:place] + str(number).encode() + data[place + 1 :])


def test_nothing_is_read_where_nothing_looks_otherwise(corpus):
    assert again(corpus) == (0, 3, 0)
    assert again(corpus, rehash=True) == (0, 3, 3)
    assert run_json("build", corpus, "-o", library_of(corpus), "--jobs", 1)["hashed"] == 0


def test_only_what_is_new_or_changed_is_read(corpus):
    write_clips(corpus, {"walk/new.bvh": ("walk", 9), "walk/1.bvh": ("walk", 8)})
    assert again(corpus) == (2, 2, 2)
    assert again(corpus) == (0, 4, 0)


def test_a_change_of_the_same_size_with_its_old_time_is_found(corpus):
    """Its second time cannot be set, as that of its content can."""
    path = corpus / "walk/1.bvh"
    before = path.stat()
    same_length(path, (int(path.read_bytes()[-3:-2] or b"0") + 1) % 10)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert (path.stat().st_size, path.stat().st_mtime_ns) == (before.st_size, before.st_mtime_ns)
    assert again(corpus)[2] == 1


def test_a_file_that_looks_the_same_is_read_when_told_to(corpus, monkeypatch):
    """Where a file system keeps no second time, only --rehash finds it."""
    path = corpus / "walk/1.bvh"
    look = file_states._look
    monkeypatch.setattr(file_states, "_look", lambda path: (str(look(path)[0].split(":")[0]), 0))
    assert again(corpus) == (0, 3, 3)  # they look otherwise, now that less is looked at
    changed = path.read_bytes().replace(b"0.", b"1.", 1)
    path.write_bytes(changed)
    assert again(corpus) == (0, 3, 0)
    assert again(corpus, rehash=True) == (1, 2, 3)
    answer = run("build", "--help")
    assert "--rehash" in answer.stdout


def test_files_that_were_just_changed_are_not_trusted(tmp_path, monkeypatch):
    """A later change within the same tick of the clock would look the same."""
    (tmp_path / "a.bvh").write_text("a motion")
    found = (tmp_path / "a.bvh").stat()
    changed = max(found.st_mtime_ns, found.st_ctime_ns)
    states = file_states.FileStates(tmp_path)
    for seconds, is_trusted in ((-100, False), (1.9, False), (2.1, True)):
        now = changed + int(seconds * 1e9)  # the first: the file's time is ahead of the clock
        monkeypatch.setattr(time, "time_ns", lambda now=now: now)
        assert (states.of("a.bvh", None) is not None) == is_trusted
    assert states.of("none.bvh", None) is None


def test_a_corpus_that_has_moved_is_read_once(corpus):
    before = rows(library_of(corpus))
    moved = corpus.with_name("moved")
    corpus.rename(moved)
    assert again(moved) == (0, 3, 3)
    assert again(moved) == (0, 3, 0)
    assert rows(library_of(corpus)) == before


def test_an_amc_is_read_again_when_its_skeleton_looks_otherwise(
    small_corpus, small_library, settled
):
    report = build(small_corpus, small_library)
    assert build(small_corpus, small_library).hashed == 0
    os.utime(small_corpus / "01/01.asf", (LONG_AGO, LONG_AGO))
    report = build(small_corpus, small_library)
    assert (report.built, report.hashed) == (0, 3)
    with (small_corpus / "01/01.asf").open("a") as file:
        file.write("# another line\n")
    assert build(small_corpus, small_library).built == 3


def test_bones_are_looked_at_once(corpus, monkeypatch):
    looked = []
    read = folder_bodies.read_bvh_skeleton
    monkeypatch.setattr(
        folder_bodies, "read_bvh_skeleton", lambda path: looked.append(path.name) or read(path)
    )
    write_clips(corpus, {"walk/new.bvh": ("walk", 9)})
    assert again(corpus)[0] == 1
    assert looked == ["new.bvh"]


def test_what_is_known_of_replaced_clips_goes_with_them(corpus):
    write_clips(corpus, {"walk/1.bvh": ("walk", 8)})
    assert again(corpus)[0] == 1
    compact_library(library_of(corpus))
    with Library(library_of(corpus)) as library:
        count = "SELECT count(*) FROM source_files"
        assert next(library.catalogue._rows(count))[0] == 3
    assert again(corpus) == (0, 3, 0)


def test_labels_count_for_files_that_are_not_read(corpus):
    (corpus / "LABELS.csv").write_text("path,label\nwalk/0.bvh,stroll\n")
    assert again(corpus) == (0, 3, 0)
    with Library(library_of(corpus)) as library:
        assert library.record("0").label == "stroll"


@pytest.mark.parametrize("version", [4, 5])
def test_a_library_of_an_earlier_version_is_read_once(corpus, version):
    before = decoded(library_of(corpus))
    made_older(library_of(corpus), version)
    assert again(corpus) == (0, 3, 3 if version == 4 else 0)
    assert again(corpus) == (0, 3, 0)
    assert decoded(library_of(corpus)) == before


def test_two_seconds_are_the_coarsest_times_of_a_file_system():
    assert file_states.SETTLED_NS == 2 * 10**9
