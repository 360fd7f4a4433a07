"""How the catalogue's SQLite file is opened, and what its errors say."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mocapdb.errors import LibraryError

__all__ = ["APPLICATION_ID", "CATALOGUE_FORMAT", "SINCE_2", "connect", "sqlite_errors"]

CATALOGUE_FORMAT = 3
"""Version 2 brought `SINCE_2`, version 3 the table of revisions."""

SINCE_2 = {
    "unit_m": ("REAL", "json_extract(skeletons.json, '$.metres_per_unit')"),
    "unit_source": ("TEXT NOT NULL DEFAULT 'unknown'", "'unknown'"),
    "up": ("TEXT", "json_extract(skeletons.json, '$.up')"),
    "up_source": ("TEXT NOT NULL DEFAULT 'unknown'", "'unknown'"),
    "body": ("TEXT NOT NULL DEFAULT 'unknown'", "'unknown'"),
    "height_m": ("REAL", "NULL"),
    "subject": ("TEXT", "NULL"),
    "subject_source": ("TEXT NOT NULL DEFAULT 'unknown'", "'unknown'"),
    "columns": ("TEXT NOT NULL DEFAULT '{}'", "'{}'"),
}
"""Columns of clips that the first format lacks: how they are declared, and what stands for them."""

APPLICATION_ID = 0x6D6F6361  # "moca"
CANNOT_WRITE = {
    sqlite3.SQLITE_CANTOPEN,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_READONLY,
}


def connect(path: Path, writable: bool) -> sqlite3.Connection:
    """Open the file; where SQLite cannot keep its log beside it, as it stands."""
    uri = path.resolve().as_uri()
    # a reader opens it for writing too, if it may: otherwise SQLite leaves its log file behind
    connection = sqlite3.connect(f"{uri}?mode=rw", uri=True, timeout=10.0, isolation_level=None)
    try:
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if not writable:
            connection.execute("PRAGMA query_only = ON")
            connection.execute("PRAGMA trusted_schema = OFF")
        return connection
    except (sqlite3.Error, UnicodeDecodeError) as problem:
        connection.close()
        log = path.with_name(path.name + "-wal")
        complete = not log.exists() or log.stat().st_size == 0
        if writable or not complete or _primary_code(problem) not in CANNOT_WRITE:
            raise
    return sqlite3.connect(f"{uri}?immutable=1", uri=True, isolation_level=None)


def _primary_code(problem: Exception) -> int:
    """Return SQLite's own number for a kind of error; 0 where Python raised it."""
    return getattr(problem, "sqlite_errorcode", 0) & 0xFF


@contextmanager
def sqlite_errors(path: Path) -> Iterator[None]:
    """Raise what SQLite says of a file as a `LibraryError` that tells what to do."""
    try:
        yield
    except UnicodeDecodeError:  # damaged bytes in a table's name
        raise LibraryError(f"{path}: the file is damaged. Restore a copy of the library.") from None
    except sqlite3.Error as problem:
        advice = ""
        if _primary_code(problem) in {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR}:
            advice = " Check the disk, and free space if it is full: what is committed is safe."
        elif _primary_code(problem) in {sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT}:
            advice = " Restore a copy of the library, or build it anew in another folder."
        raise LibraryError(f"{path}: {problem}.{advice}") from None
