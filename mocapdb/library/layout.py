"""What a library's folder holds: the names of its files and folders (docs/format.md)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mocapdb.base.arrays import StrPath

__all__ = [
    "CATALOGUE_FILE",
    "CYCLES_FILE",
    "FEATURES_FOLDER",
    "LOCK_FILE",
    "MODELS_FILE",
    "OLD_SEARCH_FILE",
    "OWNER_FILE",
    "RECOVERING_FILE",
    "RECOVERING_FOLDER",
    "SEARCH_FOLDER",
    "SET_ASIDE_FOLDER",
    "SHARDS_FOLDER",
    "SHARD_NAME",
    "disk_bytes",
    "is_library",
]

CATALOGUE_FILE = "catalogue.db"
SHARDS_FOLDER = "shards"
SET_ASIDE_FOLDER = "set-aside"
FEATURES_FOLDER = "features"
SEARCH_FOLDER = "search"
OLD_SEARCH_FILE = "search.h5"  # the index of versions up to 4 of the catalogue
MODELS_FILE = "models.h5"
CYCLES_FILE = "cycles.h5"
RECOVERING_FILE, RECOVERING_FOLDER = "recovering.json", "recovering"
LOCK_FILE, OWNER_FILE = "writer.lock", "writer.json"
SHARD_NAME = re.compile(r"\d{6,}\.h5")


def is_library(folder: StrPath) -> bool:
    """Return whether a folder is a library."""
    return Path(folder, CATALOGUE_FILE).is_file()


def disk_bytes(folder: Path) -> tuple[int, int]:
    """Return the bytes of all files of a library, and of those that only queries need."""
    sizes = {path: path.stat().st_size for path in folder.rglob("*") if path.is_file()}
    for_queries = [
        size
        for path, size in sizes.items()
        if path.parent.name in (FEATURES_FOLDER, SEARCH_FOLDER)
        or path.name in (OLD_SEARCH_FILE, MODELS_FILE)
    ]
    return sum(sizes.values()), sum(for_queries)
