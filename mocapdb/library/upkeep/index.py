"""Making a library ready for queries, and giving its clips classes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.library.library import Library
from mocapdb.library.searching.canonical_shards import (
    PackedMotion,
    commit_features,
    packed_features,
)
from mocapdb.library.searching.search_index import open_models, refresh_index
from mocapdb.library.tuning import COMMIT_CLIPS
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.open_for_writing import open_for_writing

__all__ = ["add_features", "apply_labels", "index_library"]


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


def add_features(
    library: Library, catalogue: CatalogueWriter, progress: Progress = silent
) -> dict[str, int]:
    """Compute what is missing for queries from the decoded clips; only the only writer may."""
    missing = catalogue.without_features()
    waiting: list[tuple[int, PackedMotion | None, str | None]] = []
    for done, record in enumerate(missing, start=1):
        with np.errstate(over="ignore", invalid="ignore"):  # refused, rather than warned of
            waiting.append((record.id, *packed_features(library.clip(record.name))))
        if len(waiting) == COMMIT_CLIPS or done == len(missing):
            with catalogue.transaction():
                commit_features(catalogue, waiting)
            waiting = []
        progress(done, len(missing), record.name)
    refresh_index(library.path, catalogue)
    places = catalogue.feature_places()
    return {
        "indexed": len(missing),
        "unmapped": len(catalogue.feature_problems()),
        "classes": len(open_models(library.path, catalogue).labels) if places else 0,
    }


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
