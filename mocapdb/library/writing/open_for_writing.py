"""Opening a library as its only writer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mocapdb.base.files import partial_path
from mocapdb.errors import LibraryError
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.layout import (
    CATALOGUE_FILE,
    FEATURES_FOLDER,
    LOCK_FILE,
    OWNER_FILE,
    SHARDS_FOLDER,
    is_library,
)
from mocapdb.library.writing.catalogue_writer import CatalogueWriter, create_catalogue
from mocapdb.library.writing.shard_writer import remove_strays
from mocapdb.library.writing.writer_lock import writer_lock

__all__ = ["open_for_writing"]


@contextmanager
def open_for_writing(folder: Path, *, create: bool = False) -> Iterator[CatalogueWriter]:
    """Open a library as its only writer, cleared of what a writer that was stopped has left.

    Raises
    ------
    LibraryError
        If the folder is no library and may not be made one, or another process writes to it.
    """
    if not is_library(folder):
        if not create:
            Catalogue(folder)  # says what is wrong
        _make_folder(folder)
    with writer_lock(folder):
        if not is_library(folder):
            create_catalogue(folder)
        with CatalogueWriter(folder) as catalogue:
            _remove_strays(folder, catalogue)
            try:
                yield catalogue
            finally:
                _remove_strays(folder, catalogue)


def _remove_strays(folder: Path, catalogue: Catalogue) -> None:
    remove_strays(folder / SHARDS_FOLDER, catalogue.shard_files())
    remove_strays(folder / FEATURES_FOLDER, catalogue.feature_files())


def _make_folder(folder: Path) -> None:
    """Make a library's folder, unless something else is in its place."""
    if folder.exists() and not folder.is_dir():
        raise LibraryError(f"{folder}: expected a folder for the library, but it is a file.")
    unfinished = partial_path(folder / CATALOGUE_FILE).name
    ours = {SHARDS_FOLDER, LOCK_FILE, OWNER_FILE, unfinished}
    if folder.is_dir() and {entry.name for entry in folder.iterdir()} - ours:
        raise LibraryError(
            f"{folder}: expected a library or an empty folder, but other files are in it. "
            "Name a new folder."
        )
    try:
        (folder / SHARDS_FOLDER).mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise LibraryError(f"{folder}: cannot make the library ({problem.strerror}).") from None
