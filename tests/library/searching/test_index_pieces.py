"""The search index grows by pieces: what it has is left alone, and equals an index made at once."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from small_library import build, made_older, sound, write_clips

from mocapdb.errors import LibraryError
from mocapdb.library import Library, Retrieval, compact_library, verify_library
from mocapdb.library.index_pieces import PARTS, StoredIndex, stored_index
from mocapdb.library.searching import search_index
from mocapdb.library.searching.search_index import open_index
from mocapdb.library.writing import index_writer

KINDS = ("walk", "hop", "run", "squat")


def files(first, end):
    return {f"{KINDS[n % 4]}/{n:02d}.bvh": (KINDS[n % 4], n) for n in range(first, end)}


@pytest.fixture(scope="module")
def grown_template(tmp_path_factory):
    """A library of 8 clips, of which the last three came one at a time, and its corpus."""
    folder = tmp_path_factory.mktemp("grown")
    for n_clips in (5, 6, 7, 8):
        write_clips(folder / "corpus", files(0, n_clips))
        build(folder / "corpus", folder / "l.mocapdb", index=True)
    return folder


@pytest.fixture
def grown(grown_template, tmp_path):
    shutil.copytree(grown_template, tmp_path / "grown")
    return tmp_path / "grown"


@pytest.fixture
def coded(monkeypatch):
    """The clips that are coded from now on."""
    seen = []
    code = search_index._coded
    monkeypatch.setattr(search_index, "_coded", lambda *a: seen.append(a[1]) or code(*a))
    return seen


def answers(library):
    with Library(library) as opened:
        retrieval = Retrieval(opened)
        index = retrieval.index
        hits = [
            [(hit.record.name, hit.start, hit.end, hit.distance) for hit in found]
            for found in (retrieval.query("00", k=9), retrieval.query("01", k=9, whole=True))
        ]
        return hits, [
            np.array(part)
            for part in (index.frames.codes, index.sketch.codes, index.turns, index.signatures,
                         index.frames.starts, index.sketch.starts, index.usual, retrieval._rows)
        ]  # fmt: skip


def equals_one_made_at_once(library, monkeypatch):
    """Whether queries of an index give what they give of one in memory, in the same space."""
    hits, arrays = answers(library)
    with Library(library) as opened:
        space = open_index(opened.catalogue)[0].space
    with monkeypatch.context() as patch:
        patch.setattr(search_index, "stored_index", lambda catalogue: None)
        patch.setattr(search_index, "_space_of", lambda motions, weights=None: space)
        others, other_arrays = answers(library)
    assert hits == others
    for own, other in zip(arrays, other_arrays, strict=True):
        np.testing.assert_array_equal(own, other)
    return True


def pieces(library):
    with Library(library) as opened:
        return stored_index(opened.catalogue).pieces


def test_it_equals_an_index_that_is_made_at_once(grown, monkeypatch):
    assert equals_one_made_at_once(grown / "l.mocapdb", monkeypatch)
    assert sound(grown / "l.mocapdb")


def test_a_new_clip_is_appended_and_no_other_is_touched(grown, coded, monkeypatch):
    library = grown / "l.mocapdb"
    before = {part: (library / "search" / f"000001.{part}").read_bytes() for part in PARTS}
    write_clips(grown / "corpus", files(8, 9))
    build(grown / "corpus", library, index=True)
    assert coded == [9]
    for part, content in before.items():
        assert (library / "search" / f"000001.{part}").read_bytes().startswith(content)
    assert equals_one_made_at_once(library, monkeypatch)


@pytest.mark.parametrize(("size", "n_pieces"), [(1, 4), (2**22, 1)])
def test_small_pieces_are_filled(tmp_path, monkeypatch, size, n_pieces):
    monkeypatch.setattr(index_writer, "PIECE_BYTES", size)
    for n_clips in (2, 3, 4):
        write_clips(tmp_path / "corpus", files(0, n_clips))
        build(tmp_path / "corpus", tmp_path / "l.mocapdb", index=True)
    found = pieces(tmp_path / "l.mocapdb")
    assert len(found) == n_pieces
    assert found[-1].clips == 4
    assert sound(tmp_path / "l.mocapdb")


def test_where_a_clip_has_changed_the_others_are_copied(grown, coded, monkeypatch):
    library = grown / "l.mocapdb"
    write_clips(grown / "corpus", {"walk/04.bvh": ("walk", 99)})
    build(grown / "corpus", library, index=True)
    assert coded == [9]
    assert {path.name for path in (library / "search").iterdir()} == {
        f"000002.{part}" for part in PARTS
    }
    assert equals_one_made_at_once(library, monkeypatch)
    compact_library(library)
    assert equals_one_made_at_once(library, monkeypatch)
    assert sound(library)


def test_nothing_is_coded_where_nothing_is_new(grown, coded):
    build(grown / "corpus", grown / "l.mocapdb", index=True)
    assert coded == []


def test_what_somebody_was_writing_who_was_stopped_is_written_over(grown, monkeypatch):
    library, index = grown / "l.mocapdb", grown / "l.mocapdb" / "search"
    expected, _ = answers(library)
    for part in PARTS:
        with (index / f"000001.{part}").open("ab") as file:
            file.write(b"what never was committed")
        (index / f"000002.{part}").write_bytes(b"nor this")
    assert answers(library)[0] == expected
    with Library(library) as opened:
        report = verify_library(opened)
    assert report["shards"] == []
    assert report["stray"] == sorted(f"search/000002.{part}" for part in PARTS)
    write_clips(grown / "corpus", files(8, 9))
    build(grown / "corpus", library, index=True)
    assert sound(library)
    assert equals_one_made_at_once(library, monkeypatch)


def test_stopped_before_the_commit_it_is_what_it_was(grown, monkeypatch):
    library = grown / "l.mocapdb"
    write_clips(grown / "corpus", files(8, 9))
    with monkeypatch.context() as patch:

        def stop(*_):
            raise KeyboardInterrupt

        patch.setattr(index_writer.CatalogueWriter, "keep_index", stop)
        with pytest.raises(KeyboardInterrupt):
            build(grown / "corpus", library, index=True)
    assert pieces(library)[-1].clips == 8
    assert sound(library)
    _, arrays = answers(library)  # the new clip is looked at all the same
    assert arrays[-1].tolist() == [*range(1, 10)]
    build(grown / "corpus", library, index=True)
    assert pieces(library)[-1].clips == 9
    assert equals_one_made_at_once(library, monkeypatch)


def test_a_full_disk_says_what_to_do(grown, monkeypatch):
    def full(path):
        raise OSError(28, "No space left on device", str(path))

    write_clips(grown / "corpus", files(8, 9))
    monkeypatch.setattr(index_writer, "sync", full)
    with pytest.raises(LibraryError, match=r"No space left on device.*mocapdb index"):
        build(grown / "corpus", grown / "l.mocapdb", index=True)
    assert pieces(grown / "l.mocapdb")[-1].clips == 8


def test_a_piece_is_full_from_4_mib_on(tmp_path):
    space = np.zeros(1), np.zeros((1, 32)), np.zeros(32)
    writing = index_writer._Appending(StoredIndex(tmp_path, 1, (1.0,), *space, 1))
    (tmp_path / "search").mkdir()
    mebibyte = {"frames": np.zeros((2**15, 32), np.int8)}
    empty = {part: np.zeros((0, 1), np.int8) for part in PARTS}
    with writing:
        for _ in range(9):
            writing.add(empty | mebibyte)
        writing.end_piece()
    assert [piece.frames // 2**15 for piece in writing.pieces] == [4, 8, 9]


@pytest.mark.parametrize(("size", "thorough"), [(2**26, True), (2**26 + 1, False)])
def test_of_a_large_index_only_the_list_of_clips_is_compared_at_once(
    grown, monkeypatch, size, thorough
):
    library = grown / "l.mocapdb"
    monkeypatch.setattr(StoredIndex, "size", size)
    with Library(library) as opened:
        for part in PARTS:
            path = library / "search" / f"000001.{part}"
            content = path.read_bytes()
            path.write_bytes(bytes([content[0] ^ 1]) + content[1:])
            index = stored_index(opened.catalogue)
            assert index.is_sound() == (not thorough and part != "clips")
            assert not index.is_sound(thorough=True)
            path.write_bytes(content)


@pytest.mark.parametrize("version", [3, 4])
def test_a_library_of_an_earlier_version(grown, monkeypatch, version):
    library = grown / "l.mocapdb"
    expected, _ = answers(library)
    made_older(library, version)
    shutil.rmtree(library / "search")
    (library / "search.h5").write_bytes(b"its index")
    with Library(library) as opened:
        assert Retrieval(opened).query("00", k=3)
        assert opened.catalogue.version == version
        assert not verify_library(opened)["bad"]
    report = build(grown / "corpus", library, index=True)
    assert (report.built, report.skipped) == (0, 8)
    assert not (library / "search.h5").exists()
    assert sound(library)
    assert equals_one_made_at_once(library, monkeypatch)
    assert [name for name, *_ in answers(library)[0][0]] == [name for name, *_ in expected[0]]
