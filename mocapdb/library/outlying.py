"""Clips that lie so far off that the search does not let them stretch its axes."""

from __future__ import annotations

from pathlib import Path

from mocapdb.errors import LibraryError
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.hdf5 import opened
from mocapdb.library.layout import SEARCH_FILE

__all__ = ["outlying_clips"]


def outlying_clips(library: Path, catalogue: Catalogue) -> list[str]:
    """Return the names of clips that an index was made without regard to.

    They can be searched all the same. None where there is no index, or one that cannot be read.
    """
    path = library / SEARCH_FILE
    if not path.is_file():
        return []
    try:
        with opened(path, "not a readable index") as file:
            far = set(file["clips"][:][file["usual"][:] == 0].tolist()) if "usual" in file else ()
    except LibraryError:
        return []
    if not far:
        return []
    return [record.name for record in catalogue.records() if record.id in far]
