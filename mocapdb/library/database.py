"""How the catalogue's SQLite file is opened, and what its errors say."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from shlex import quote

from mocapdb.errors import LibraryError

__all__ = [
    "APPLICATION_ID",
    "CATALOGUE_FORMAT",
    "CLASSES_VIEW",
    "SINCE_2",
    "connect",
    "expect_our_tables",
    "sqlite_errors",
]

CATALOGUE_FORMAT = 6
"""Version 2 brought `SINCE_2`, 3 the revisions, 4 the checksums of rows and of derived files, 5 the
search index in pieces and how files looked when they were read, 6 what the last build planned and
checksums of saved queries."""

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

CLASSES_VIEW = """
CREATE VIEW classes AS
    SELECT label AS name, count(*) AS clips, sum(frames) AS frames
    FROM clips WHERE deleted IS NULL AND label IS NOT NULL GROUP BY label
"""
WORDS_TABLE = re.compile(r"CREATE VIRTUAL TABLE \W?clips_fts\W? USING FTS[45]", re.IGNORECASE)
WORDS_TRIGGER = re.compile(
    r"CREATE TRIGGER \W?clips_a[idu]\W? AFTER \w+ ON \W?clips\W? BEGIN"
    r"(\s*INSERT INTO \W?clips_fts\W? ?\([^();]*\) ?VALUES ?\([^();]*\);)+\s*END",
    re.IGNORECASE,
)
"""How the words of clips are kept up to date: nothing in it can run for long."""

LONGEST = 2**28
"""Bytes of a text or blob: of a basis there are a few thousand."""

APPLICATION_ID = 0x6D6F6361  # "moca"
CANNOT_WRITE = {
    sqlite3.SQLITE_CANTOPEN,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_READONLY,
}


def connect(path: Path, writable: bool, *, unchanging: bool = False) -> sqlite3.Connection:
    """Open the file; where SQLite cannot keep its log beside it, as it stands.

    So it is where it is `unchanging`: another may take its place, but nobody writes to it.
    """
    uri = path.resolve().as_uri()
    # a reader opens it for writing too, if it may: otherwise SQLite leaves its log file behind
    # any thread may be the one in which Python finds that nobody uses the connection any more
    opened = partial(sqlite3.connect, uri=True, isolation_level=None, check_same_thread=False)
    if unchanging:
        return _only_read(opened(f"{uri}?immutable=1"))
    connection = opened(f"{uri}?mode=rw", timeout=10.0)
    try:
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LONGEST)
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        return connection if writable else _only_read(connection)
    except (sqlite3.Error, UnicodeDecodeError) as problem:
        connection.close()
        log = path.with_name(path.name + "-wal")
        complete = not log.exists() or log.stat().st_size == 0
        if writable or not complete or _primary_code(problem) not in CANNOT_WRITE:
            raise
    return opened(f"{uri}?immutable=1")


def _only_read(connection: sqlite3.Connection) -> sqlite3.Connection:
    connection.execute("PRAGMA query_only = ON")
    connection.execute("PRAGMA trusted_schema = OFF")
    return connection


def expect_our_tables(path: Path, connection: sqlite3.Connection) -> None:
    """Refuse views, triggers and virtual tables that are not ours: they may run for ever.

    Raises
    ------
    LibraryError
    """
    for kind, name, sql in connection.execute(
        "SELECT type, name, sql FROM sqlite_master "
        "WHERE type IN ('view', 'trigger') OR sql LIKE 'CREATE VIRTUAL%'"
    ):
        text = str(sql)
        ours = (
            text.split() == CLASSES_VIEW.split()
            if kind == "view"
            else (WORDS_TRIGGER if kind == "trigger" else WORDS_TABLE).match(text)
        )
        if not ours:
            raise LibraryError(
                f"{path}: expected the tables of a library, but it also has the {kind} {name!r}. "
                f"Make the catalogue anew with: mocapdb recover {quote(str(path.parent))}"
            )


def _primary_code(problem: Exception) -> int:
    """Return SQLite's own number for a kind of error; 0 where Python raised it."""
    return getattr(problem, "sqlite_errorcode", 0) & 0xFF


@contextmanager
def sqlite_errors(path: Path) -> Iterator[None]:
    """Raise what SQLite says of a file as a `LibraryError` that tells what to do."""
    try:
        yield
    except UnicodeDecodeError:  # damaged bytes in a table's name
        raise LibraryError(
            f"{path}: the file is damaged. Run: mocapdb recover {quote(str(path.parent))}"
        ) from None
    except sqlite3.Error as problem:
        advice = ""
        if _primary_code(problem) in {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR}:
            advice = " Check the disk, and free space if it is full: what is committed is safe."
        elif _primary_code(problem) in {sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT}:
            advice = f" Run: mocapdb recover {quote(str(path.parent))}"
        raise LibraryError(f"{path}: {problem}.{advice}") from None
