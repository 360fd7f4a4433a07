"""How files look from outside, so that a build need not read those that look as they did.

As git and make do it: by size, times of the last change of content and of anything else, and the
number that the file system gives the file. A file that was changed within two seconds before we
looked is not trusted, since a later change might look the same: the next build reads it again.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.errors import MocapdbError
from mocapdb.io.find_files import GLTF_SUFFIXES
from mocapdb.io.gltf_reading import files_beside
from mocapdb.library.building.corpus_listing import path_in
from mocapdb.library.naming import suffix_of
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.base.arrays import StrPath

__all__ = ["FileStates"]

BY_ITSELF = frozenset({".bvh", ".npz"})
"""Suffixes of files that nothing beside them belongs to."""

SETTLED_NS = 2_000_000_000
"""The coarsest times that file systems in use keep are of two seconds."""


class FileStates:
    """How the files of a corpus look now.

    Parameters
    ----------
    root : Path
        The corpus folder.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._skeletons: dict[Path, list[Path]] = {}  # of folders
        self._told: dict[Path, tuple[str, int]] = {}  # of files that several may need

    def of(
        self, file: str, given: Skeleton | StrPath | None
    ) -> tuple[str, Skeleton | Path | None] | None:
        """Return how a file looks, with its skeleton or arrays beside it, and an AMC's skeleton.

        None where that says nothing: the file has just been changed, or cannot be looked at.

        Parameters
        ----------
        file : str
            Its path from the root.
        given : Skeleton or path-like, optional
            What is said of an AMC's skeleton; it is looked for by default.
        """
        now = time.time_ns()
        try:
            text, changed = _look(f"{self._root}/{file}")
            suffix = suffix_of(file)
            skeleton = self.skeleton(self._root / file, given) if suffix == ".amc" else None
            beside = files_beside(self._root / file) if suffix in GLTF_SUFFIXES else []
            if isinstance(skeleton, Skeleton):
                text = f"{text} {skeleton.digest}"
            elif skeleton is not None:
                beside = [skeleton]
            for path in beside:
                if path not in self._told:
                    self._told[path] = _look(path)
                text = f"{text} {self._told[path][0]}"
                changed = max(changed, self._told[path][1])
        except (OSError, MocapdbError):
            return None
        return (text, skeleton) if changed < now - SETTLED_NS else None

    def of_folder(
        self,
        folder: str,
        names: Sequence[str],
        skeleton_of: Callable[[str], Skeleton | StrPath | None],
    ) -> dict[str, str | None]:
        """Return how the files of a folder look, by name; None where that says nothing.

        Parameters
        ----------
        folder : str
            Its path from the root.
        names : sequence of str
        skeleton_of : callable
            What is said of an AMC's skeleton, by the file's path from the root.
        """
        before = time.time_ns() - SETTLED_NS
        found: dict[str, str | None] = {}
        for name in names:
            file = path_in(folder, name)
            if suffix_of(name) in BY_ITSELF:
                try:
                    text, changed = _look(f"{self._root}/{file}")
                except OSError:
                    found[name] = None
                else:
                    found[name] = text if changed < before else None
            else:
                own = self.of(file, skeleton_of(file))
                found[name] = None if own is None else own[0]
        return found

    def skeleton(self, path: Path, given: Skeleton | StrPath | None) -> Skeleton | Path:
        """Return the skeleton of an AMC: given, or found.

        Raises
        ------
        FormatError
            If there is none, or no single one.
        """
        from mocapdb.io.clip_files import find_skeleton

        if isinstance(given, Skeleton):
            return given
        return find_skeleton(path, self._skeletons) if given is None else Path(given)


def _look(path: StrPath) -> tuple[str, int]:
    """Return how a file looks, and when it was last changed, in nanoseconds."""
    found = os.stat(path)  # noqa: PTH116  a Path for each of 100,000 files takes a second
    text = f"{found.st_size}:{found.st_mtime_ns}:{found.st_ctime_ns}:{found.st_ino}"
    return text, max(found.st_mtime_ns, found.st_ctime_ns)
