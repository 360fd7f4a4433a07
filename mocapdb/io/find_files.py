"""The motion files of a folder."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.errors import CorpusError

if TYPE_CHECKING:
    from mocapdb.base.arrays import StrPath

__all__ = [
    "CLIP_SUFFIXES",
    "DRAWN_SUFFIXES",
    "GLTF_SUFFIXES",
    "READ_SUFFIXES",
    "SCENE_SUFFIXES",
    "TEXT_SUFFIXES",
    "WRITE_SUFFIXES",
    "expect_folder",
    "find_motion_files",
    "is_motion_file",
    "walk_files",
    "walk_folders",
]

TEXT_SUFFIXES = (".amc", ".bvh")
"""Of the motion files that others write."""

GLTF_SUFFIXES = (".glb", ".gltf")
"""Of scenes, with or without motion: in a folder those are taken that say that they have some."""

CLIP_SUFFIXES = (*TEXT_SUFFIXES, ".npz", *GLTF_SUFFIXES)
"""Of the files that are taken for clips in a folder."""

SCENE_SUFFIXES = (".fbx", ".dae", ".usd", ".usda", ".usdc", ".usdz")
"""Of files that Blender reads for mocapdb: they are clips where there is one."""

READ_SUFFIXES = (*CLIP_SUFFIXES, *SCENE_SUFFIXES)
"""Of the files that `mocapdb.io.read_clip` reads."""

WRITE_SUFFIXES = (*TEXT_SUFFIXES, ".npz", ".csv", ".fbx")
"""Of the files that `mocapdb.io.write_clip` writes."""

DRAWN_SUFFIXES = (".glb", ".gif", ".mp4", ".html")
"""Of the files that `mocapdb.write_clip` writes besides, by `mocapdb.scenes`."""


def find_motion_files(
    folder: StrPath,
    suffixes: Collection[str] = CLIP_SUFFIXES,
    *,
    pass_over: str | None = None,
) -> list[Path]:
    """Return the motion files in a folder, at any depth, sorted; see `is_motion_file`.

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
    expect_folder(root)
    return sorted(
        path for path in walk_files(root, pass_over=pass_over) if is_motion_file(path, suffixes)
    )


def expect_folder(root: Path) -> None:
    """Raise a `CorpusError` if there is no folder."""
    if not root.exists():
        raise CorpusError(f"{root}: no such folder.")
    if not root.is_dir():
        raise CorpusError(f"{root}: expected a folder of motion files, but got a file.")


def is_motion_file(path: Path, suffixes: Collection[str] = CLIP_SUFFIXES) -> bool:
    """Tell whether a file of a folder is taken for a clip.

    Its suffix says so; of a scene what it holds, too: most are props, rooms and bodies that stand
    still.
    """
    suffix = path.suffix.lower()
    if suffix not in suffixes:
        return False
    if suffix in SCENE_SUFFIXES:
        from mocapdb.io.blender.scenes import may_move

        return may_move(path)
    if suffix not in GLTF_SUFFIXES:
        return True
    from mocapdb.io.gltf_reading import says_it_moves

    return says_it_moves(path)


def walk_files(root: Path, *, pass_over: str | None = None) -> Iterator[Path]:
    """Yield all files below a folder; see `walk_folders`."""
    for here, names in walk_folders(root, pass_over=pass_over):
        yield from (Path(here, name) for name in names)


def walk_folders(root: Path, *, pass_over: str | None = None) -> Iterator[tuple[str, list[str]]]:
    """Yield a folder and all below it, whatever links lead there once, and their files' names.

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
                yield here, sorted(names)
        waiting = links
