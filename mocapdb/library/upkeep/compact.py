"""Giving the space of replaced clips back to the disk."""

from __future__ import annotations

from pathlib import Path

from mocapdb.base.arrays import StrPath
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.layout import FEATURES_FOLDER, SHARDS_FOLDER, disk_bytes
from mocapdb.library.library import Library, payload_digest
from mocapdb.library.revision import Revision
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.open_for_writing import open_for_writing
from mocapdb.library.writing.shard_writer import shard_image

__all__ = ["compact_library"]


def compact_library(path: StrPath) -> int:
    """Rewrite a library without what was replaced or taken back; return the bytes freed.

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
    """Write what is live in shards that hold deleted payloads anew, and point the rows there."""
    wasteful = catalogue.shards_with_deleted()
    by_shard: dict[int, list[ClipRecord | Revision]] = {}
    every: list[ClipRecord | Revision] = [*library.records(), *catalogue.revisions().values()]
    for row in every:
        if row.shard_id is not None and row.shard_id in wasteful:
            by_shard.setdefault(row.shard_id, []).append(row)
    with catalogue.transaction():
        for rows in by_shard.values():
            payloads = [library.stored_payload(row) for row in rows]
            image = shard_image(payloads, [payload_digest(row) for row in rows])
            shard_id = catalogue.add_shard(SHARDS_FOLDER, image)
            moved = [(row, (shard_id, number)) for number, row in enumerate(rows)]
            catalogue.update_clips(
                {
                    row.id: {"shard_id": place[0], "shard_row": place[1]}
                    for row, place in moved
                    if isinstance(row, ClipRecord)
                }
            )
            catalogue.move_revisions(
                {row.id: place for row, place in moved if isinstance(row, Revision)}
            )
        if catalogue.shards(FEATURES_FOLDER):
            from mocapdb.library.searching.canonical_shards import compact_features

            compact_features(catalogue)
        catalogue.remove_deleted()
