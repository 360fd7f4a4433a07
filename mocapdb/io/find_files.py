"""The motion files of a folder."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.errors import CorpusError

if TYPE_CHECKING:
    from mocapdb.base.arrays import StrPath

__all__ = ["CLIP_SUFFIXES", "TEXT_SUFFIXES", "find_motion_files", "walk_files"]

TEXT_SUFFIXES = (".amc", ".bvh")
"""Of the motion files that others write."""

CLIP_SUFFIXES = (*TEXT_SUFFIXES, ".npz")
"""Of the files that `mocapdb.io.read_clip` reads."""


def find_motion_files(
    folder: StrPath,
    suffixes: Collection[str] = CLIP_SUFFIXES,
    *,
    pass_over: str | None = None,
) -> list[Path]:
    """Return the motion files in a folder, at any depth, sorted.

    Links to folders are followed, each folder once.

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

    return sorted(path for path in walk_files(root, pass_over=pass_over) if _has(path, suffixes))


def _has(path: Path, suffixes: Collection[str]) -> bool:
    return path.suffix.lower() in suffixes


def walk_files(root: Path, *, pass_over: str | None = None) -> Iterator[Path]:
    """Yield all files below a folder, each folder once, whatever links lead to it.

    A folder that is there itself is not looked at through a link, so links change no path of what
    can be found without them.

    Raises
    ------
    CorpusError
        If a folder cannot be listed.
    """

    def unreadable(problem: OSError) -> None:
        raise CorpusError(f"{problem.filename}: cannot list the folder ({problem.strerror}).")

    visited: set[tuple[int, int]] = set()
    waiting = [root]
    while waiting:
        links: list[Path] = []
        for top in waiting:
            for here, folders, names in os.walk(top, onerror=unreadable):
                state = Path(here).stat()
                if pass_over in names or (state.st_dev, state.st_ino) in visited:
                    folders.clear()
                    continue
                visited.add((state.st_dev, state.st_ino))
                folders.sort()
                links += [Path(here, name) for name in folders if Path(here, name).is_symlink()]
                yield from (Path(here, name) for name in sorted(names))
        waiting = links
