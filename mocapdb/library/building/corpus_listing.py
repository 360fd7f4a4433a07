"""The files of a corpus folder: folder by folder, or all, and what else is there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.errors import CorpusError
from mocapdb.io.blender.program import NEEDED, blender_is_there
from mocapdb.io.find_files import (
    CLIP_SUFFIXES,
    GLTF_SUFFIXES,
    SCENE_SUFFIXES,
    expect_folder,
    is_motion_file,
    walk_folders,
)
from mocapdb.library.layout import CATALOGUE_FILE
from mocapdb.library.naming import suffix_of

if TYPE_CHECKING:
    from mocapdb.base.arrays import StrPath

__all__ = ["CorpusListing", "path_in"]

READ_BESIDE = (".asf", ".bin", ".csv", ".toml")
"""Of files that are read with the clips: skeletons, arrays of glTF, labels and settings."""

PLAIN_SUFFIXES = frozenset(CLIP_SUFFIXES) - frozenset(GLTF_SUFFIXES)
"""Of files that are clips whatever is in them."""


class CorpusListing:
    """What is in a corpus folder. Libraries in it are passed over.

    Files that are read by way of Blender are among its files where there is one: see
    `mocapdb.io.blender.program`.

    Parameters
    ----------
    root : Path
    only : callable, optional
        Tells of a motion file, by its path, whether it counts.
    blender : path-like, optional

    Attributes
    ----------
    is_whole : bool
        Whether all motion files count.

    Raises
    ------
    CorpusError
        If the folder is missing; and when it is listed, if it cannot be or holds no motion file.
    """

    def __init__(
        self,
        root: Path,
        only: Callable[[str], bool] | None = None,
        blender: StrPath | None = None,
    ) -> None:
        expect_folder(root)
        self.is_whole = only is None
        self._root = root
        self._only = only
        self._has_blender = blender_is_there(blender)
        self._scenes: list[str] = []  # that nothing reads
        self._others: Counter[str] = Counter()

    def folders(self) -> Iterator[tuple[str, list[str]]]:
        """Yield each folder with motion files: its path from the root, and their names, sorted."""
        self._scenes = []
        self._others = Counter()
        found = False
        for path, names in walk_folders(self._root, pass_over=CATALOGUE_FILE):
            place = Path(path)
            folder = place.relative_to(self._root).as_posix()
            folder = "" if folder == "." else folder
            here = [name for name in names if self._is_clip(place, name)]
            found = found or bool(here)
            if self._only is not None:
                here = [name for name in here if self._only(path_in(folder, name))]
            if here:
                yield folder, here
        if not found and self._scenes:
            raise CorpusError(
                f"{self._root}: expected Blender, by way of which files such as "
                f"{min(self._scenes)} are read. {NEEDED}"
            )
        if not found:
            raise CorpusError(
                f"{self._root}: expected motion files ({', '.join(CLIP_SUFFIXES)}), but found none."
            )

    def _is_clip(self, place: Path, name: str) -> bool:
        """Tell whether a file is taken for a clip; count it where it is left alone."""
        suffix = suffix_of(name)
        if suffix in PLAIN_SUFFIXES:
            return True
        if suffix in SCENE_SUFFIXES or suffix in GLTF_SUFFIXES:
            moves = is_motion_file(place / name, (suffix,))
            if moves and (self._has_blender or suffix in GLTF_SUFFIXES):
                return True
            if moves:
                self._scenes.append(name)
            kind = suffix + _why(suffix, moves=moves)
        else:
            kind = "" if suffix in READ_BESIDE else suffix or "without a suffix"
        if kind and not name.startswith("."):
            self._others[kind] += 1
        return False

    @cached_property
    def files(self) -> list[str]:
        """The motion files, sorted, by their paths from the folder with ``/``."""
        return sorted(path_in(folder, name) for folder, names in self.folders() for name in names)

    @property
    def left_alone(self) -> dict[str, int]:
        """How many files there are that no clip can be read from, by suffix, the most first.

        Of the last time that it was listed to the end, as `warnings` are.
        """
        return dict(self._others.most_common())

    @property
    def warnings(self) -> list[str]:
        """That files were left alone which could be read."""
        n_scenes = len(self._scenes)
        told = f"{n_scenes} files are read by way of Blender, and were left alone. {NEEDED}"
        return [told] if n_scenes else []


def path_in(folder: str, name: str) -> str:
    """Return the path of a file in a folder of a corpus; the corpus itself is ``""``."""
    return f"{folder}/{name}" if folder else name


def _why(suffix: str, *, moves: bool) -> str:
    """Return why a scene is none of the clips."""
    if moves:
        return " by way of Blender"
    part = "skin" if suffix in GLTF_SUFFIXES else "skeleton"
    return f" without a {part} that moves"
