"""Checking a library: every checksum, every file, every clip."""

from __future__ import annotations

import hashlib
from typing import Any

from mocapdb.base.progress import Progress, silent
from mocapdb.errors import MocapdbError
from mocapdb.library.catalogue import SHARD_TABLES
from mocapdb.library.layout import SHARDS_FOLDER
from mocapdb.library.library import Library

__all__ = ["verify_library"]


def verify_library(library: Library, progress: Progress = silent) -> dict[str, Any]:
    """Check every checksum, look for strays, and decode every clip and every revision.

    Parameters
    ----------
    library : Library
    progress : callable, optional

    Returns
    -------
    dict
        ``clips``, the number checked; ``bad``, a list of ``{"clip", "reason"}``; ``shards``,
        the same for shards as ``{"shard", "reason"}``; ``stray``, files that belong to no
        commit: a build that is at work, or was killed, leaves them, and the next removes them.
    """
    bad_shards = _damaged_shards(library)
    bad = []
    records = library.records()
    revisions = library.catalogue.revisions()
    for done, record in enumerate(records, start=1):
        try:
            library.captured(record)
            revision = revisions.get(record.id)
            if revision is not None and revision.changes:
                library.decode_revision(record, revision)
        except MocapdbError as problem:
            bad.append({"clip": record.name, "reason": str(problem)})
        progress(done, len(records), record.name)
    stray = [_shown(path.parent.name, path.name) for path in library.catalogue.stray_files()]
    return {"clips": len(records), "bad": bad, "shards": bad_shards, "stray": stray}


def _damaged_shards(library: Library) -> list[dict[str, str]]:
    damaged = []
    problem = library.catalogue.check()
    if problem:
        damaged.append({"shard": library.catalogue.path.name, "reason": problem})
    for folder in SHARD_TABLES:
        for row in library.catalogue.shards(folder):
            reason = None
            try:
                with (library.path / folder / row["file"]).open("rb") as file:
                    if hashlib.file_digest(file, "sha256").hexdigest() != row["sha256"]:
                        reason = "fails its SHA-256"
            except OSError as missing:
                reason = f"cannot read: {missing.strerror}"
            if reason:
                damaged.append({"shard": _shown(folder, row["file"]), "reason": reason})
    return damaged


def _shown(folder: str, file: str) -> str:
    return file if folder == SHARDS_FOLDER else f"{folder}/{file}"
