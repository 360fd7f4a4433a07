"""Giving the space of replaced clips back to the disk."""

from __future__ import annotations

from pathlib import Path

from mocapdb.base.arrays import StrPath
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.layout import FEATURES_FOLDER, SHARDS_FOLDER, disk_bytes
from mocapdb.library.library import Library
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.open_for_writing import open_for_writing
from mocapdb.library.writing.shard_writer import shard_image

__all__ = ["compact_library"]


def compact_library(path: StrPath) -> int:
    """Rewrite a library without the clips that were replaced; return the bytes freed.

    Killed at any moment it leaves the library as it was, or as it will be.

    Raises
    ------
    LibraryError
        If the library is locked or damaged, or the disk is full.
    """
    folder = Path(path)
    before, _ = disk_bytes(folder)
    with open_for_writing(folder) as catalogue, Library(folder) as library:
        _rewrite_shards(library, catalogue)
        catalogue.shrink()
        if catalogue.shards(FEATURES_FOLDER):
            from mocapdb.library.searching.search_index import refresh_index

            refresh_index(folder, catalogue)
    after, _ = disk_bytes(folder)
    return before - after


def _rewrite_shards(library: Library, catalogue: CatalogueWriter) -> None:
    """Write the live clips of shards that hold deleted ones anew, and point the rows there."""
    wasteful = catalogue.shards_with_deleted()
    by_shard: dict[int, list[ClipRecord]] = {}
    for record in library.records():
        if record.shard_id in wasteful:
            by_shard.setdefault(record.shard_id, []).append(record)
    with catalogue.transaction():
        for records in by_shard.values():
            payloads = [library.payload(record) for record in records]
            image = shard_image(payloads, [record.source_sha256 for record in records])
            shard_id = catalogue.add_shard(SHARDS_FOLDER, image)
            catalogue.update_clips(
                {r.id: {"shard_id": shard_id, "shard_row": row} for row, r in enumerate(records)}
            )
        if catalogue.feature_files_with_deleted():
            from mocapdb.library.searching.canonical_shards import compact_features

            compact_features(catalogue)
        catalogue.remove_deleted()
