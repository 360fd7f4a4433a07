"""The motion files of a folder."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.errors import CorpusError

if TYPE_CHECKING:
    from mocapdb.base.arrays import StrPath

__all__ = ["CLIP_SUFFIXES", "TEXT_SUFFIXES", "find_motion_files"]

TEXT_SUFFIXES = (".amc", ".bvh")
"""Of the motion files that others write: what a library is built from."""

CLIP_SUFFIXES = (*TEXT_SUFFIXES, ".npz")
"""Of the files that `mocapdb.io.read_clip` reads."""


def find_motion_files(
    folder: StrPath,
    suffixes: Collection[str] = CLIP_SUFFIXES,
    *,
    pass_over: str | None = None,
) -> list[Path]:
    """Return the motion files in a folder, at any depth, sorted.

    Parameters
    ----------
    folder : path-like
    suffixes : collection of str
        In lower case; files may have them in either.
    pass_over : str, optional
        Name of a file; folders that have one are passed over, with all below them.

    Raises
    ------
    CorpusError
        If the folder is missing or cannot be listed.
    """
    root = Path(folder)
    if not root.exists():
        raise CorpusError(f"{root}: no such folder.")
    if not root.is_dir():
        raise CorpusError(f"{root}: expected a folder of motion files, but got a file.")

    def unreadable(problem: OSError) -> None:
        raise CorpusError(f"{problem.filename}: cannot list the folder ({problem.strerror}).")

    found: list[Path] = []
    for here, folders, names in os.walk(root, onerror=unreadable):
        if pass_over in names:
            folders.clear()
            continue
        found += [Path(here, name) for name in names if Path(name).suffix.lower() in suffixes]
    return sorted(found)
