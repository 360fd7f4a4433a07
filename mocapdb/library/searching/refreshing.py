"""Bringing what is made from the feature shards up to date with the catalogue."""

from __future__ import annotations

from mocapdb.library.searching.learned_classes import refresh_classes
from mocapdb.library.searching.search_index import refresh_search
from mocapdb.library.writing.catalogue_writer import CatalogueWriter

__all__ = ["refresh_index"]


def refresh_index(catalogue: CatalogueWriter, *, anew: bool = False) -> None:
    """Bring index and classes up to date. Only the library's only writer may.

    Classes stay as they are while they lack but a few of the labelled clips.

    Parameters
    ----------
    catalogue : CatalogueWriter
    anew : bool
        Whether classes are to be learned anew if they lack any clip, and all of the index compared
        with its checksums.
    """
    refresh_search(catalogue, thorough=anew)
    refresh_classes(catalogue, anew=anew)
