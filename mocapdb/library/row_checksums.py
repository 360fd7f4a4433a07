"""Checksums of the catalogue's rows: SQLite checks how its pages hang together, not what they say.

Every row of the tables of `KEYS` has a CRC-32 in the table ``checksums``. Whoever writes keeps them
by triggers of its own connection (`keep_checksums`), so that no change goes without.
"""

from __future__ import annotations

import sqlite3
import struct
import zlib
from collections.abc import Iterator
from contextlib import closing

from mocapdb.base.interrupts import interrupt_later

__all__ = ["CHECKSUMS_TABLE", "KEYS", "fill_checksums", "find_damage", "keep_checksums"]

CHECKSUMS_TABLE = """
CREATE TABLE IF NOT EXISTS checksums (
    of TEXT NOT NULL,
    row NOT NULL,
    crc32 INTEGER NOT NULL,
    PRIMARY KEY (of, row)
) WITHOUT ROWID
"""
KEYS = {
    "skeletons": "id",
    "builds": "id",
    "shards": "id",
    "feature_shards": "id",
    "clips": "id",
    "features": "clip_id",
    "revisions": "id",
    "joint_errors": "clip_id",
    "bases": "digest",
    "derived_files": "sha256",
    "facets": "clip_id",
    "source_files": "clip_id",
    "search_index": "id",
    "search_pieces": "id",
    "unsearched": "clip_id",
    "unlearned": "clip_id",
    "plans": "corpus",
    "planned_folders": "id",
    "unplanned": "clip_id",
    "saved_queries": "name",
}
"""The tables whose rows have checksums, and the column that names a row."""

SINCE_6 = {"saved_queries"}
"""Those of them that there were without checksums before version 6."""

SCHEMA_OF = "sqlite_schema"
"""What the checksum of the declarations is kept under; its row is the format's version."""

SEARCHED = "clips_fts"

Value = None | int | float | str | bytes


def row_checksum(*values: Value) -> int:
    """Return the CRC-32 of a row's values, in the order of the columns.

    Each is a letter for its type, its length in bytes, and its bytes (docs/format.md).
    """
    checksum = 0
    for value in values:
        if value is None:
            kind, content = b"N", b""
        elif isinstance(value, int):
            kind, content = b"I", b"%d" % value
        elif isinstance(value, float):
            kind, content = b"F", struct.pack("<d", value)
        elif isinstance(value, str):
            kind, content = b"T", value.encode()
        else:
            kind, content = b"B", bytes(value)
        checksum = zlib.crc32(b"%s%d:" % (kind, len(content)) + content, checksum)
    return checksum


def _register(connection: sqlite3.Connection) -> None:
    connection.create_function("row_checksum", -1, _undisturbed_checksum, deterministic=True)


def _undisturbed_checksum(*values: Value) -> int:
    """Return a row's checksum; SQLite would take Ctrl-C in it for an error of the statement."""
    try:
        return row_checksum(*values)
    except KeyboardInterrupt:
        interrupt_later()
        return row_checksum(*values)


def keep_checksums(connection: sqlite3.Connection) -> None:
    """Have every change that this connection makes to a row change the row's checksum."""
    _register(connection)
    for table, key in _tables(connection).items():
        kept = (
            "INSERT OR REPLACE INTO checksums "
            f"VALUES ('{table}', NEW.{key}, row_checksum({_values(connection, table, 'NEW.')}))"
        )
        # the sign takes the key's type away: without it SQLite looks at every checksum of the table
        gone = f"DELETE FROM checksums WHERE of = '{table}' AND row = +OLD.{key}"
        for event, statement in (
            ("INSERT", kept),
            ("UPDATE", f"{gone}; {kept}"),
            ("DELETE", gone),
        ):
            connection.execute(
                f"CREATE TEMP TRIGGER IF NOT EXISTS checksum_{table}_{event.lower()} "
                f"AFTER {event} ON main.{table} BEGIN {statement}; END"
            )


def fill_checksums(connection: sqlite3.Connection) -> None:
    """Note the checksums of all rows, and of how the tables are declared."""
    _register(connection)
    connection.execute("DELETE FROM checksums")
    for table, key in _tables(connection).items():
        connection.execute(
            f"INSERT INTO checksums SELECT '{table}', {key}, "
            f"row_checksum({_values(connection, table)}) FROM {table}"
        )
    version, checksum = _declared(connection)
    connection.execute("INSERT INTO checksums VALUES (?, ?, ?)", (SCHEMA_OF, version, checksum))


def find_damage(connection: sqlite3.Connection) -> str | None:
    """Return what in a catalogue is not as it was written, or None."""
    kept = connection.execute("SELECT row, crc32 FROM checksums WHERE of = ?", (SCHEMA_OF,))
    if [tuple(row) for row in kept] != [_declared(connection)]:
        return "its tables are not declared as they were"
    for table, key in _tables(connection).items():
        for row in _unlike(connection, table, key):
            return f"row {row!r} of {table} is not as it was written"
    return _searched_otherwise(connection)


def _unlike(connection: sqlite3.Connection, table: str, key: str) -> Iterator[Value]:
    """Yield the rows whose checksum is another, or missing; and checksums without a row."""
    for *values, row, checksum in connection.execute(
        f"SELECT {table}.*, {table}.{key}, checksums.crc32 FROM {table} "
        f"LEFT JOIN checksums ON of = '{table}' AND row = +{table}.{key}"
    ):
        if row_checksum(*values) != checksum:
            yield row
    for (row,) in connection.execute(
        f"SELECT row FROM checksums WHERE of = '{table}' AND row NOT IN (SELECT {key} FROM {table})"
    ):
        yield row


def _searched_otherwise(connection: sqlite3.Connection) -> str | None:
    """Return whether the words that clips are found by are not those of the clips.

    FTS5 tells only a connection that may write: a copy in memory.
    """
    with closing(sqlite3.connect(":memory:")) as copy:
        connection.backup(copy)
        try:
            copy.execute(f"INSERT INTO {SEARCHED}({SEARCHED}, rank) VALUES ('integrity-check', 1)")
        except sqlite3.DatabaseError:
            return "the index of words is not that of the clips"
    return None


def _declared(connection: sqlite3.Connection) -> tuple[int, int]:
    """Return the version of the format, and the checksum of how our tables are declared."""
    version = _version(connection)
    ours = [*_keys(version), "checksums", "classes", SEARCHED]
    declared = connection.execute(
        f"SELECT type, name, tbl_name, sql FROM main.sqlite_master "
        f"WHERE tbl_name IN ({', '.join('?' * len(ours))}) ORDER BY type, name",
        ours,
    )
    return version, row_checksum(*(value for row in declared for value in row))


def _tables(connection: sqlite3.Connection) -> dict[str, str]:
    """Return those of `KEYS` that there are."""
    there = {name for (name,) in connection.execute("SELECT name FROM main.sqlite_master")}
    keys = _keys(_version(connection))
    return {table: key for table, key in keys.items() if table in there}


def _keys(version: int) -> dict[str, str]:
    """Return those of `KEYS` whose rows have checksums in a version of the format."""
    return {table: key for table, key in KEYS.items() if version >= 6 or table not in SINCE_6}


def _version(connection: sqlite3.Connection) -> int:
    return int(connection.execute("PRAGMA user_version").fetchone()[0])


def _values(connection: sqlite3.Connection, table: str, of: str = "") -> str:
    columns = connection.execute(f"PRAGMA main.table_info({table})")
    return ", ".join(f'{of}"{column[1]}"' for column in columns)
