"""Clips that lie so far off that the search does not let them stretch its axes."""

from __future__ import annotations

from mocapdb.library.catalogue import Catalogue
from mocapdb.library.index_pieces import HASHED_APART, stored_index

__all__ = ["outlying_clips"]


def outlying_clips(catalogue: Catalogue, corpus: str | None = None) -> list[str]:
    """Return the names of clips, of a corpus or of all, that an index was made without regard to.

    They can be searched all the same. None where there is no index, or one that cannot be read.
    """
    index = stored_index(catalogue)
    if index is None or not index.is_there() or any(index.damaged([HASHED_APART])):
        return []
    entries = index.entries()
    far = entries["clip"][entries["usual"] == 0].tolist()
    return catalogue.names(far, corpus) if far else []
