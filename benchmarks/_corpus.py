"""Where the benchmarks find real clips."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from mocapdb.io import find_motion_files


def corpus_folder() -> Path:
    """Return where real clips are, if there are some."""
    named = os.environ.get("MOCAPDB_CORPUS")
    return Path(named) if named else Path(__file__).parents[2] / "shared" / "corpus"


def corpus_or_exit() -> Path:
    """Return the folder of real clips; where there is none, say so and end without an error."""
    folder = corpus_folder()
    if not folder.is_dir():
        print(f"no real clips in {folder}: set MOCAPDB_CORPUS to a folder of them")
        sys.exit(0)
    return folder


def motion_files(folder: Path) -> list[Path]:
    """Return every AMC and BVH below a folder, sorted."""
    return find_motion_files(folder, [".amc", ".bvh"])
