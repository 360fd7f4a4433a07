"""Checking a library: every checksum, every file, every clip."""

from __future__ import annotations

import hashlib
from typing import Any

from mocapdb.base.progress import Progress, silent
from mocapdb.errors import LibraryError, MocapdbError
from mocapdb.library.layout import FEATURES_FOLDER, SHARDS_FOLDER
from mocapdb.library.library import Library
from mocapdb.library.writing.shard_writer import stray_files

__all__ = ["verify_library"]


def verify_library(library: Library, progress: Progress = silent) -> dict[str, Any]:
    """Check every checksum, look for strays, and decode every clip.

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
    for done, record in enumerate(records, start=1):
        try:
            clip = library.decode(record)
            if len(clip) != record.frames:
                raise LibraryError(f"expected {record.frames} frames, but decoded {len(clip)}")
        except MocapdbError as problem:
            bad.append({"clip": record.name, "reason": str(problem)})
        progress(done, len(records), record.name)
    catalogue, folder = library.catalogue, library.path
    strays = stray_files(folder / SHARDS_FOLDER, catalogue.shard_files())
    stray = [path.name for path in strays]
    strays = stray_files(folder / FEATURES_FOLDER, catalogue.feature_files())
    stray += [f"{FEATURES_FOLDER}/{path.name}" for path in strays]
    return {"clips": len(records), "bad": bad, "shards": bad_shards, "stray": stray}


def _damaged_shards(library: Library) -> list[dict[str, str]]:
    damaged = []
    problem = library.catalogue.check()
    if problem:
        damaged.append({"shard": library.catalogue.path.name, "reason": problem})
    shards = [(SHARDS_FOLDER, row) for row in library.catalogue.shards()]
    shards += [(FEATURES_FOLDER, row) for row in library.catalogue.feature_shards()]
    for place, row in shards:
        path = library.path / place / row["file"]
        name = row["file"] if place == SHARDS_FOLDER else f"{place}/{row['file']}"
        try:
            with path.open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as missing:
            damaged.append({"shard": name, "reason": f"cannot read: {missing.strerror}"})
            continue
        if digest != row["sha256"]:
            damaged.append({"shard": name, "reason": "fails its SHA-256"})
    return damaged
