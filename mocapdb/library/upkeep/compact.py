"""Giving the space of replaced clips back to the disk, and making few files of many small ones."""

from __future__ import annotations

from pathlib import Path

from mocapdb.base.arrays import StrPath
from mocapdb.library.layout import FEATURES_FOLDER, disk_bytes
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.open_for_writing import open_for_writing
from mocapdb.library.writing.pack_shards import join_shards, rewrite_shards

__all__ = ["compact_library", "join_small_shards"]


def compact_library(path: StrPath) -> int:
    """Rewrite a library without what was replaced or taken back; return the bytes freed.

    Small shards are joined. Killed at any moment it leaves the library as it was, or as it will be.

    Raises
    ------
    LibraryError
        If the library is locked or damaged, or the disk is full.
    """
    folder = Path(path)
    with open_for_writing(folder) as catalogue:
        before, _ = disk_bytes(folder)
        _without_deleted(catalogue)
        join_small_shards(catalogue)
        with catalogue.transaction():
            catalogue.remove_unused_shards()
        catalogue.shrink()
        if catalogue.shards(FEATURES_FOLDER):
            from mocapdb.library.searching.refreshing import refresh_index

            refresh_index(catalogue)
    after, _ = disk_bytes(folder)
    return before - after


def join_small_shards(catalogue: CatalogueWriter, *, shortly: bool = False) -> int:
    """Join small files of clips, and of their features; return how many were joined.

    All of them, or `shortly` a few that take no time.

    Only the library's only writer may. See `join_shards` for what readers find meanwhile.

    Raises
    ------
    LibraryError
        If one of them is damaged, or the disk is full.
    """
    n_joined = join_shards(catalogue, shortly=shortly)
    if catalogue.shards(FEATURES_FOLDER):
        from mocapdb.library.searching.canonical_shards import join_features

        n_joined += join_features(catalogue, shortly=shortly)
    return n_joined


def _without_deleted(catalogue: CatalogueWriter) -> None:
    """Write what is live in shards that hold deleted payloads anew, and forget what is deleted."""
    with catalogue.transaction():
        rewrite_shards(catalogue, catalogue.shards_with_deleted())
        if catalogue.shards(FEATURES_FOLDER):
            from mocapdb.library.searching.canonical_shards import compact_features

            compact_features(catalogue)
        catalogue.remove_deleted()
