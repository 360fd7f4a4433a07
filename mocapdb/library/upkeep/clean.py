"""Cleaned revisions of a library's clips, made and taken back."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from mocapdb.base.arrays import StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.errors import LibraryError
from mocapdb.library.building.revise_clips import (
    CleaningReport,
    CleaningSettings,
    kept_cycles,
    revise_clips,
)
from mocapdb.library.layout import FEATURES_FOLDER
from mocapdb.library.library import Library
from mocapdb.library.writing.open_for_writing import open_for_writing

if TYPE_CHECKING:
    from mocapdb.library.building.revise_clips import Context
    from mocapdb.library.clip_record import ClipRecord
    from mocapdb.library.revision import Revision

__all__ = ["clean_library", "undo_cleaning"]


def clean_library(
    path: StrPath,
    settings: CleaningSettings | None = None,
    *,
    names: Sequence[str] | None = None,
    context: Context | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> CleaningReport:
    """Search a library's clips for faults and keep what is repaired beside them.

    The clips as they were captured stay; whatever decodes a clip takes the cleaned one from then
    on, unless the library is opened with ``original=True``. Queries find the cleaned motion.

    Parameters
    ----------
    path : path-like
        The library.
    settings : CleaningSettings, optional
    names : sequence of str, optional
        Only these clips; all by default.
    context : callable, optional
        Returns, for a clip, vocabularies of what it is compared with besides itself, or none.
    jobs : int, optional
        Worker processes.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do the work and see the same files.
    progress : callable, optional

    Raises
    ------
    UnknownClipError
        If there is no clip of a name.
    LibraryError
        If the library is locked or cannot be written.
    WorkerError
        If workers cannot do the work.
    """
    folder = Path(path)
    with open_for_writing(folder) as catalogue, Library(folder) as library:
        report = revise_clips(
            library, catalogue, settings, names=names, context=context, jobs=jobs,
            scheduler=scheduler, progress=progress,
        )  # fmt: skip
        if catalogue.shards(FEATURES_FOLDER):
            from mocapdb.library.searching.refreshing import refresh_index

            refresh_index(catalogue)
    return report


def undo_cleaning(
    path: StrPath, names: Sequence[str] | None = None, progress: Progress = silent
) -> tuple[list[str], list[str]]:
    """Take back the cleaned revisions of clips, of all by default.

    The clips are again as they were captured, for queries too; `compact_library` gives the space
    back.

    Returns
    -------
    names : list of str
        Clips whose revision was taken back.
    stale_cycles : list of str
        Classes whose kept cycle was made of clips as they were before.

    Raises
    ------
    UnknownClipError
        If there is no clip of a name.
    LibraryError
        If there is nothing to take back, or the library is locked or cannot be written.
    """
    folder = Path(path)
    with open_for_writing(folder) as catalogue, Library(folder) as library:
        chosen = library.records() if names is None else [library.record(name) for name in names]
        revisions = catalogue.revisions()
        undone = [record for record in chosen if record.id in revisions]
        if not undone:
            which = "no clip of it" if names is None else ", ".join(names) + " never"
            raise LibraryError(
                f"{folder}: nothing to undo: {which} was cleaned. "
                f"Clean with: mocapdb clean {quote(str(folder))} --apply"
            )
        changed = [record for record in undone if revisions[record.id].changes]
        with catalogue.transaction():
            now = datetime.now(UTC).isoformat(timespec="seconds")
            catalogue.drop_revisions([record.id for record in undone], now)
            if catalogue.is_indexed():
                catalogue.remove_features([record.id for record in changed])
        if catalogue.is_indexed() or catalogue.shards(FEATURES_FOLDER):
            from mocapdb.library.upkeep.index import add_features

            add_features(library, catalogue, progress)
        stale = _stale(undone, revisions, kept_cycles(catalogue))
    return [record.name for record in undone], stale


def _stale(
    undone: Sequence[ClipRecord], revisions: dict[int, Revision], kept: set[str]
) -> list[str]:
    """Return the classes with a kept cycle that has members which are other than before."""
    return sorted(
        {
            str(record.label)
            for record in undone
            if record.label in kept and revisions[record.id].spans
        }
    )
