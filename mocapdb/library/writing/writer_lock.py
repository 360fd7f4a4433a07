"""One writer at a time: a lock that the operating system drops when its holder dies."""

from __future__ import annotations

import json
import os
import socket
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from mocapdb.errors import LibraryError, LibraryLockedError
from mocapdb.library.layout import LOCK_FILE, OWNER_FILE

__all__ = ["writer_lock"]


@contextmanager
def writer_lock(folder: Path) -> Iterator[None]:
    """Hold the library's only writer's place.

    An exclusive transaction on an empty SQLite file: portable, and gone with the process.

    Raises
    ------
    LibraryLockedError
        If another process holds it; the message says which.
    """
    owner = folder / OWNER_FILE
    try:
        connection = sqlite3.connect(folder / LOCK_FILE, timeout=0.0, isolation_level=None)
    except sqlite3.OperationalError as problem:
        raise LibraryError(f"{folder}: cannot write to the library ({problem}).") from None
    try:
        try:
            connection.execute("PRAGMA journal_mode = MEMORY")  # no file that a kill would leave
            connection.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError as problem:
            if "locked" in str(problem):
                raise LibraryLockedError(_locked_by(folder, owner)) from None
            raise LibraryError(f"{folder}: cannot write to the library ({problem}).") from None
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
    finally:
        connection.close()


def _locked_by(folder: Path, owner: Path) -> str:
    try:
        who = json.loads(owner.read_text(encoding="utf-8"))
        holder = f"process {who['pid']} on {who['host']} since {who['since']}"
    except (OSError, ValueError, KeyError):  # the holder is just writing it
        holder = "another process"
    return f"{folder}: locked by {holder}. Wait until it is done, or stop it."
