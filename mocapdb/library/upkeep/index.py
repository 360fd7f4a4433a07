"""Making a library ready for queries, and giving its clips classes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from mocapdb.base.arrays import StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.library.library import Library
from mocapdb.library.searching.add_features import add_features
from mocapdb.library.searching.search_index import refresh_index
from mocapdb.library.writing.open_for_writing import open_for_writing

__all__ = ["apply_labels", "index_library"]


def index_library(path: StrPath, progress: Progress = silent) -> dict[str, int]:
    """Make a library ready for queries: what a build that was told not to has left out.

    Returns
    -------
    dict
        ``indexed``, the clips that were added; ``unmapped``, the clips whose skeletons cannot
        be brought to the canonical body; ``classes`` that were learned.

    Raises
    ------
    LibraryError, CodecError
        If the library is locked, damaged, or the disk is full.
    """
    folder = Path(path)
    with open_for_writing(folder) as catalogue, Library(folder) as library:
        return add_features(library, catalogue, progress)


def apply_labels(path: StrPath, labels: Mapping[str, str]) -> None:
    """Give clips classes that no label file has given, and learn the classes anew.

    They stay through later builds, until the corpus itself says what such a clip is.

    Parameters
    ----------
    path : path-like
        The library.
    labels : mapping of str to str
        Class by name of the clip.

    Raises
    ------
    UnknownClipError
        If there is no such clip.
    LibraryError
        If the library is locked or cannot be written.
    """
    folder = Path(path)
    with open_for_writing(folder) as catalogue:
        updates = {
            catalogue.resolve(name).id: {"label": label, "label_source": "classify"}
            for name, label in labels.items()
        }
        with catalogue.transaction():
            catalogue.update_clips(updates)
        refresh_index(folder, catalogue)
