"""Opening a library as its only writer: the lock is dropped when its holder dies."""

from __future__ import annotations

import json
import os
import socket
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from shlex import quote

from mocapdb.base.files import PARTIAL_SUFFIX, make_folder, partial_path
from mocapdb.errors import LibraryError, LibraryLockedError
from mocapdb.library.addresses import expect_local
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.index_pieces import stray_index_files
from mocapdb.library.layout import (
    CATALOGUE_FILE,
    CYCLES_FILE,
    FEATURES_FOLDER,
    LOCK_FILE,
    MODELS_FILE,
    OLD_SEARCH_FILE,
    OWNER_FILE,
    RECOVERING_FILE,
    RECOVERING_FOLDER,
    SEARCH_FOLDER,
    SET_ASIDE_FOLDER,
    SHARD_NAME,
    SHARDS_FOLDER,
    is_library,
)
from mocapdb.library.writing.catalogue_writer import CatalogueWriter, create_catalogue
from mocapdb.library.writing.pack_shards import complete_shards

__all__ = ["expect_no_links", "only_writer", "open_for_writing"]


@contextmanager
def open_for_writing(folder: Path, *, create: bool = False) -> Iterator[CatalogueWriter]:
    """Open a library as its only writer, cleared of what a writer that was stopped has left.

    Shards of earlier versions are made complete.

    Raises
    ------
    LibraryLockedError
        If another process writes to it; the message says which.
    LibraryError
        If the folder is no library and may not be made one, or cannot be written.
    """
    expect_local(folder)
    expect_no_links(folder)
    if not is_library(folder):
        if not create:
            Catalogue(folder)  # raises: no library is there
        _make_folder(folder)
    with only_writer(folder):
        if not is_library(folder):
            create_catalogue(folder)
        with CatalogueWriter(folder) as catalogue:
            _remove_strays(catalogue)
            complete_shards(catalogue)
            try:
                yield catalogue
            finally:
                _remove_strays(catalogue)


def expect_no_links(folder: Path) -> None:
    """Refuse a library part of which is elsewhere: writing would reach what is not its own.

    Nor may a part be a pipe or a device, on which a writer would wait for ever.
    """
    names = [CATALOGUE_FILE, SHARDS_FOLDER, FEATURES_FOLDER, SEARCH_FOLDER, LOCK_FILE, OWNER_FILE]
    names += [OLD_SEARCH_FILE, MODELS_FILE, CYCLES_FILE]
    names += [f"{SEARCH_FOLDER}/{path.name}" for path in Path(folder, SEARCH_FOLDER).glob("*")]
    names += [SET_ASIDE_FOLDER, RECOVERING_FOLDER, RECOVERING_FILE]
    for name in names:
        path = Path(folder, name)
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise LibraryError(f"{path}: expected a part of the library, but it is no file.")
        if path.is_symlink():
            raise LibraryError(
                f"{path}: expected a part of the library, but it is a link. Writing would "
                "change what it leads to: put the file or folder itself there."
            )


def _remove_strays(catalogue: Catalogue) -> None:
    """Remove the shards that no commit knows; what is no shard by its name is not ours."""
    for path in catalogue.stray_files():
        if SHARD_NAME.fullmatch(path.name.removesuffix(PARTIAL_SUFFIX)) and not path.is_dir():
            path.unlink()
    for path in stray_index_files(catalogue):
        path.unlink()


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
    shards = [path for path in folder.glob(f"{SHARDS_FOLDER}/*.h5") if path.is_file()]
    if shards:
        raise LibraryError(
            f"{folder}: its {CATALOGUE_FILE} is gone, but {len(shards)} file(s) of clips are "
            "there. Nothing was changed. Make the catalogue anew with: "
            f"mocapdb recover {quote(str(folder))}"
        )
    try:
        make_folder(folder / SHARDS_FOLDER)
    except OSError as problem:
        raise LibraryError(f"{folder}: cannot make the library ({problem.strerror}).") from None


@contextmanager
def only_writer(folder: Path, *, wait_s: float = 0.0) -> Iterator[None]:
    """Hold the library's only writer's place.

    An exclusive transaction on an empty SQLite file: portable, and gone with the process.

    Parameters
    ----------
    folder : Path
    wait_s : float, seconds
        How long to wait for another writer to be done.

    Raises
    ------
    LibraryLockedError
        If another process writes to it.
    LibraryError
        If the library cannot be written.
    """
    expect_local(folder)
    owner = folder / OWNER_FILE
    expect_no_links(folder)
    with closing(_lock(folder, wait_s)):
        me = {
            "pid": os.getpid(),
            "host": socket.gethostname(),
            "since": datetime.now(UTC).isoformat(timespec="seconds"),
        }
        try:
            owner.write_text(json.dumps(me), encoding="utf-8")
        except OSError as problem:
            raise LibraryError(
                f"{owner}: cannot write to the library ({problem.strerror})."
            ) from None
        try:
            yield
        finally:
            owner.unlink(missing_ok=True)


def _lock(folder: Path, wait_s: float) -> sqlite3.Connection:
    """Return the connection that holds the lock until it is closed."""
    connection = None
    try:
        connection = sqlite3.connect(folder / LOCK_FILE, timeout=wait_s, isolation_level=None)
        connection.execute("PRAGMA journal_mode = MEMORY")  # no journal file to leave behind
        connection.execute("BEGIN EXCLUSIVE")
    except sqlite3.OperationalError as problem:
        if connection is not None:
            connection.close()
        if "locked" in str(problem):
            raise LibraryLockedError(_locked_by(folder)) from None
        raise LibraryError(f"{folder}: cannot write to the library ({problem}).") from None
    return connection


def _locked_by(folder: Path) -> str:
    try:
        who = json.loads((folder / OWNER_FILE).read_text(encoding="utf-8"))
        holder = f"process {who['pid']} on {who['host']} since {who['since']}"
    except (OSError, ValueError, KeyError):  # it is being written at this moment
        holder = "another process"
    return f"{folder}: locked by {holder}. Wait until it is done, or stop it."
