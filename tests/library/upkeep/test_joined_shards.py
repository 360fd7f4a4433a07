"""Small shards, such as builds of single clips leave, are joined: nothing is lost on the way."""

from __future__ import annotations

import shutil

import pytest
from small_library import build, decoded, run, sound, write_clips

from mocapdb.errors import LibraryError
from mocapdb.library import Library, compact_library, recover_library
from mocapdb.library.searching import canonical_shards
from mocapdb.library.tuning import COMMIT_BYTES
from mocapdb.library.writing import pack_shards
from mocapdb.library.writing.catalogue_writer import CatalogueWriter


@pytest.fixture
def three(monkeypatch):
    """Three shards of a size are joined, which is tried sooner than eight."""
    monkeypatch.setattr(pack_shards, "JOINED_SHARDS", 3)
    monkeypatch.setattr(pack_shards, "_level", lambda size: 0)


def of_one_clip_each(folder, n_clips, **options):
    """Build a library clip by clip."""
    corpus, library = folder / "corpus", folder / "l.mocapdb"
    for number in range(n_clips):
        write_clips(corpus, {f"walk/{number}.bvh": ("walk", number)})
        report = build(corpus, library, **options)
    return corpus, library, report


def shards(library, folder="shards"):
    return sorted(path.name for path in (library / folder).iterdir())


def test_are_joined_when_there_are_many_of_a_size():
    def groups(*sizes):
        return pack_shards.alike_shards({"id": i, "size": s} for i, s in enumerate(sizes))

    assert groups(*[9000] * 7) == []
    assert groups(*[9000] * 8) == [[*range(8)]]
    assert groups(*[9000] * 7, 90_000) == []
    assert groups(*[9000] * 8, *[90_000] * 8) == [[*range(8)], [*range(8, 16)]]
    assert groups(*[COMMIT_BYTES // 8 + 1] * 9) == []
    assert [len(group) for group in groups(*[COMMIT_BYTES // 8] * 20)] == [8, 8]
    assert groups(*[0] * 8) == [[*range(8)]]


def test_a_build_joins_a_few_small_ones():
    def groups(*sizes):
        shards = [{"id": i, "size": size} for i, size in enumerate(sizes)]
        return pack_shards.alike_shards(shards, shortly=True)

    assert groups(*[9000] * 8, *[40_000] * 8) == [[*range(8)]]
    assert groups(*[2**17 + 1] * 8) == []
    assert [len(group) for group in groups(*[2**17] * 20)] == [8]


def test_clips_stay_and_who_reads_meanwhile_finds_them(tmp_path, three):
    corpus, library, report = of_one_clip_each(tmp_path, 2)
    before = decoded(library)
    with Library(library) as reader:
        records = reader.records()
        write_clips(corpus, {"walk/2.bvh": ("walk", 2)})
        report = build(corpus, library)
        assert (report.joined, report.not_joined) == (3, "")
        assert len(shards(library)) == 4  # those that were joined are there for the reader
        assert {r.name: reader.decode(r).channels.tobytes() for r in records} == before
    assert before.items() <= decoded(library).items()
    assert sound(library)
    assert build(corpus, library).joined == 0
    write_clips(corpus, {"walk/3.bvh": ("walk", 3)})
    build(corpus, library)
    assert shards(library) == ["000004.h5", "000005.h5"]
    assert set(decoded(library)) == {"0", "1", "2", "3"}
    assert sound(library)


def test_compact_joins_at_once(tmp_path, monkeypatch):
    _, library, _ = of_one_clip_each(tmp_path, 3)
    before = decoded(library)
    monkeypatch.setattr(pack_shards, "JOINED_SHARDS", 3)
    monkeypatch.setattr(pack_shards, "_level", lambda size: 0)
    assert "3 files of clips are now 1" in run("compact", library).stdout
    assert (len(shards(library)), decoded(library)) == (1, before)
    assert sound(library)


def test_shards_with_replaced_clips_wait_for_compact(tmp_path, three):
    corpus, library, _ = of_one_clip_each(tmp_path, 2)
    write_clips(corpus, {"walk/0.bvh": ("walk", 7)})
    assert build(corpus, library).joined == 0
    compact_library(library)
    assert len(shards(library)) == 2


def test_features_are_joined_and_the_index_stays(tmp_path, three):
    corpus, library, _ = of_one_clip_each(tmp_path, 2, index=True)
    before = features(library)
    write_clips(corpus, {"walk/2.bvh": ("walk", 2)})
    assert build(corpus, library, index=True).joined == 6
    with Library(library) as opened:
        assert opened.catalogue.unsearched() == []
        assert len({file for _, file, _ in opened.catalogue.feature_places()}) == 1
    assert len(before) == 2
    assert before.items() <= features(library).items()
    compact_library(library)
    assert len(shards(library, "features")) == 1
    assert sound(library)


def features(library):
    """Return the features of clips, by their rows."""
    with Library(library) as opened:
        places = opened.catalogue.feature_places()
    read = canonical_shards.FeatureReader
    return {
        clip: read(library / "features" / file).packed(row).bones.tobytes()
        for clip, file, row in places
    }


@pytest.mark.parametrize("step", ["update_clips", "move_revisions"])
def test_stopped_on_the_way_nothing_has_happened(tmp_path, three, monkeypatch, step):
    corpus, library, _ = of_one_clip_each(tmp_path, 2)
    write_clips(corpus, {"walk/2.bvh": ("walk", 2)})
    with monkeypatch.context() as patch:
        patch.setattr(CatalogueWriter, step, stopped_at_shards(step))
        with pytest.raises(KeyboardInterrupt):
            build(corpus, library)
    assert shards(library) == ["000001.h5", "000002.h5", "000003.h5"]
    assert set(decoded(library)) == {"0", "1", "2"}
    assert sound(library)
    compact_library(library)
    assert len(shards(library)) == 1


def stopped_at_shards(step):
    """Return what stops where rows are pointed to a new shard."""
    original = getattr(CatalogueWriter, step)

    def stop(self, updates):
        if step == "move_revisions" or any("shard_id" in own for own in updates.values()):
            raise KeyboardInterrupt
        original(self, updates)

    return stop


def test_a_lost_catalogue_is_made_of_joined_shards_and_those_before(tmp_path, three):
    corpus, library, _ = of_one_clip_each(tmp_path, 3)
    write_clips(corpus, {"walk/1.bvh": ("walk", 11)})
    build(corpus, library)
    before = decoded(library)
    (library / "catalogue.db").unlink()
    recover_library(library)
    assert decoded(library) == before


def test_what_a_clip_has_replaced_is_still_said(tmp_path, three):
    """Its file has moved, so that a lost catalogue could not know it otherwise."""
    corpus, library, _ = of_one_clip_each(tmp_path, 2)
    moved = tmp_path / "moved"
    shutil.move(corpus, moved)
    write_clips(moved, {"walk/0.bvh": ("walk", 20)})
    build(moved, library)
    write_clips(moved, {"walk/2.bvh": ("walk", 2)})
    assert build(moved, library).joined == 3
    before = decoded(library)
    (library / "catalogue.db").unlink()
    recover_library(library)
    assert decoded(library) == before


def test_damage_is_told_and_keeps_no_clip_from_being_built(tmp_path, three):
    corpus, library, _ = of_one_clip_each(tmp_path, 2)
    path = library / "shards/000001.h5"
    path.write_bytes(path.read_bytes()[:-9000])
    write_clips(corpus, {"walk/2.bvh": ("walk", 2)})
    report = build(corpus, library)
    assert (report.built, report.joined) == (1, 0)
    assert "000001.h5" in report.not_joined
    with Library(library) as opened:
        assert len(opened.clip("2"))
    with pytest.raises(LibraryError):
        compact_library(library)
