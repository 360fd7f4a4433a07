"""Making a library ready for queries, and giving its clips classes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.base.workers import on_workers
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.facets import Facets
from mocapdb.library.library import Library
from mocapdb.library.searching.canonical_shards import (
    PackedMotion,
    commit_features,
    packed_features,
)
from mocapdb.library.searching.learned_classes import count_classes
from mocapdb.library.searching.refreshing import refresh_index
from mocapdb.library.stored_clip import StoredClip
from mocapdb.library.tuning import COMMIT_CLIPS
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.open_for_writing import open_for_writing

__all__ = ["add_features", "apply_labels", "index_library", "take_labels_back"]

Answer = TypeVar("Answer")


def index_library(
    path: StrPath,
    progress: Progress = silent,
    *,
    jobs: int | None = 1,
    scheduler: str | None = None,
) -> dict[str, int]:
    """Make a library ready for queries: what a build that was told not to has left out.

    Parameters
    ----------
    path : path-like
        The library.
    progress : callable, optional
    jobs : int, optional
        Processes that do the work: this one by default; None for as many as there are processors.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do it instead and see the library's files.

    Returns
    -------
    dict
        ``indexed``, the clips that were added; ``unmapped``, the clips whose skeletons cannot
        be brought to the canonical body; ``classes`` that were learned; ``measured``, the clips
        of earlier versions that had no facets (see `mocapdb.library.facets`).

    Raises
    ------
    LibraryError, CodecError
        If the library is locked, damaged, or the disk is full.
    WorkerError
        If workers cannot do the work.
    """
    folder = Path(path)
    with open_for_writing(folder) as catalogue, Library(folder) as library:
        shared: dict[str, Any] = {"jobs": jobs, "scheduler": scheduler}
        report = add_features(library, catalogue, progress, anew=True, **shared)
        return report | {"measured": _add_facets(library, catalogue, progress, **shared)}


def _add_facets(
    library: Library, catalogue: CatalogueWriter, progress: Progress, **shared: Any
) -> int:
    """Measure the clips that an earlier version has made features of."""
    missing = catalogue.without_facets()
    found: dict[int, Facets] = {}
    n_found = 0
    answers = _of_each(_facets_of, library, missing, **shared)
    for done, (record, own) in enumerate(zip(missing, answers, strict=True), start=1):
        if own is not None:
            found[record.id] = own
        if len(found) == COMMIT_CLIPS or done == len(missing):
            with catalogue.transaction():
                catalogue.add_facets(found)
            n_found += len(found)
            found = {}
        progress(done, len(missing), record.name)
    return n_found


def add_features(
    library: Library,
    catalogue: CatalogueWriter,
    progress: Progress = silent,
    *,
    anew: bool = False,
    jobs: int | None = 1,
    scheduler: str | None = None,
) -> dict[str, int]:
    """Compute what is missing for queries from the decoded clips; only the only writer may.

    Classes that lack but a few clips stay as they are, unless they are to be learned `anew`.
    """
    missing = catalogue.without_features()
    waiting: list[tuple[int, PackedMotion | None, str | None]] = []
    answers = _of_each(_features_of, library, missing, jobs=jobs, scheduler=scheduler)
    for done, (record, answer) in enumerate(zip(missing, answers, strict=True), start=1):
        waiting.append((record.id, *answer))
        if len(waiting) == COMMIT_CLIPS or done == len(missing):
            with catalogue.transaction():
                commit_features(catalogue, waiting)
            waiting = []
        progress(done, len(missing), record.name)
    refresh_index(catalogue, anew=anew)
    return {
        "indexed": len(missing),
        "unmapped": len(catalogue.feature_problems()),
        "classes": count_classes(catalogue) if catalogue.has_searchable() else 0,
    }


def _of_each(
    work: Callable[[StoredClip], Answer],
    library: Library,
    records: Sequence[ClipRecord],
    *,
    jobs: int | None,
    scheduler: str | None,
) -> Iterator[Answer]:
    """Yield what some work makes of each clip."""
    stored = [library.stored(record) for record in records]
    seen = [each.shard for each in stored[:1]]
    orders = ([each] for each in stored)
    with closing(on_workers(work, orders, jobs=jobs, scheduler=scheduler, seen=seen)) as answers:
        yield from answers


def _features_of(stored: StoredClip) -> tuple[PackedMotion | None, str | None]:
    """Return what is stored of a clip for queries, or why nothing; runs in a worker."""
    with np.errstate(over="ignore", invalid="ignore"):  # refused, rather than warned of
        return packed_features(stored.decode())


def _facets_of(stored: StoredClip) -> Facets | None:
    """Return what is measured of a clip; runs in a worker."""
    from mocapdb.library.searching.clip_facets import measure_facets  # scipy is slow to import

    return measure_facets(stored.decode())


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
        refresh_index(catalogue, anew=True)


def take_labels_back(path: StrPath) -> list[str]:
    """Remove the classes that `apply_labels` gave, learn anew, and return the clips' names.

    Raises
    ------
    LibraryError
        If the library is locked or cannot be written.
    """
    folder = Path(path)
    with open_for_writing(folder) as catalogue:
        given = [record for record in catalogue.records() if record.label_source == "classify"]
        nothing = {"label": None, "label_source": "corpus"}
        with catalogue.transaction():
            catalogue.update_clips({record.id: nothing for record in given})
        refresh_index(catalogue, anew=True)
    return [record.name for record in given]
