"""Writing the search index: clips are appended to its files, piece by piece (`index_pieces`).

The files come first, flushed to the disk. One transaction of the catalogue then makes what was
appended part of the index; until it does, nobody reads beyond the end of the piece before.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import astuple
from pathlib import Path
from shlex import quote
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.files import advice_to_write, sync
from mocapdb.errors import LibraryError
from mocapdb.library.index_pieces import PARTS, Piece, StoredIndex, stray_index_files
from mocapdb.library.layout import SEARCH_FOLDER
from mocapdb.library.tuning import PIECE_BYTES
from mocapdb.library.writing.catalogue_writer import CatalogueWriter

__all__ = ["append_clips", "next_number", "remove_index"]

Clips = Mapping[str, NDArray[Any]]
"""Rows of every part of some clips, one after another."""


def append_clips(catalogue: CatalogueWriter, index: StoredIndex, clips: Iterable[Clips]) -> None:
    """Append clips to an index, and make it the index of the library.

    Parameters
    ----------
    catalogue : CatalogueWriter
    index : StoredIndex
        Without pieces it is a new one, that takes the place of any other.
    clips : iterable of mapping of str to array
        Rows of each of `PARTS`.

    Raises
    ------
    LibraryError
        If the disk is full or cannot be written; the index stays what it was.
    """
    kept = len(index.pieces)
    try:
        (index.folder / SEARCH_FOLDER).mkdir(exist_ok=True)
        sync(index.folder)
        with _Appending(index) as appending:
            kept -= appending.is_filling
            for each in clips:
                appending.add(each)
            appending.end_piece()
        sync(index.folder / SEARCH_FOLDER)
    except OSError as problem:
        path = Path(problem.filename or index.folder / SEARCH_FOLDER)
        raise LibraryError(
            f"{path}: cannot write ({problem.strerror or problem}). "
            f"{advice_to_write(problem)} and run: mocapdb index {quote(str(index.folder))}"
        ) from None
    space = np.concatenate(
        [index.weights, index.mean, index.axes.ravel(), index.deviations]
    ).astype("<f8")
    row = {
        "id": index.number,
        "fitted": index.fitted,
        "weights": len(index.weights),
        "features": len(index.mean),
        "dims": index.axes.shape[1],
        "space": space.tobytes(),
    }
    with catalogue.transaction():
        catalogue.keep_index(row, map(astuple, appending.pieces), kept)
    _remove_files(catalogue)


def remove_index(catalogue: CatalogueWriter) -> None:
    """Say that there is no index any more, and remove it."""
    with catalogue.transaction():
        catalogue.keep_index(None, [])
    _remove_files(catalogue)


def next_number(catalogue: CatalogueWriter) -> int:
    """Return a number that no index in the folder has."""
    row = catalogue.search_index()
    strays = (int(path.name.partition(".")[0]) for path in stray_index_files(catalogue))
    return max([0 if row is None else int(row["id"]), *strays]) + 1


def _remove_files(catalogue: CatalogueWriter) -> None:
    """Remove the files of indexes that are no longer in use."""
    for path in stray_index_files(catalogue):
        path.unlink(missing_ok=True)


class _Appending:
    """The files of an index, open behind what it has, and the pieces that were written.

    Attributes
    ----------
    pieces : list of Piece
    is_filling : bool
        Whether the last piece that there was takes more: the first of `pieces` stands for it then.
    """

    def __init__(self, index: StoredIndex) -> None:
        self.pieces: list[Piece] = []
        self._index, self._end = index, index.end
        self._stack = ExitStack()
        self._files: dict[str, IO[bytes]] = {}
        before = index.pieces[-2] if len(index.pieces) > 1 else Piece()
        sizes = {part: index.row_bytes(part) for part in PARTS}
        last = sum((self._end.rows(part) - before.rows(part)) * sizes[part] for part in PARTS)
        self.is_filling = bool(index.pieces) and last < PIECE_BYTES
        self._begin_piece()
        if self.is_filling:
            self._size = last
            self._hashes = {part: index.part_hash(part, before, self._end) for part in PARTS}

    def _begin_piece(self) -> None:
        self._size = 0
        self._hashes = {part: hashlib.sha256() for part in PARTS}

    def __enter__(self) -> _Appending:
        with ExitStack() as stack:
            for part in PARTS:
                path = self._index.path(part)
                file = stack.enter_context(path.open("r+b" if self._index.pieces else "wb"))
                end = self._end.rows(part) * self._index.row_bytes(part)
                file.truncate(end)  # what somebody was writing who was stopped
                file.seek(end)
                self._files[part] = file
            self._stack = stack.pop_all()
        return self

    def add(self, clips: Clips) -> None:
        """Append some clips."""
        rows = {part: len(clips[part]) for part in PARTS}
        self._end = Piece(
            self._end.clips + rows["clips"],
            self._end.frames + rows["frames"],
            self._end.sketch + rows["sketch"],
        )
        for part in PARTS:
            data = np.ascontiguousarray(clips[part]).reshape(-1).view(np.uint8).data
            self._files[part].write(data)
            self._hashes[part].update(data)
            self._size += data.nbytes
        if self._size >= PIECE_BYTES:
            self.end_piece()

    def end_piece(self) -> None:
        """Note what was appended as a piece, if it was anything."""
        if not self._size:
            return
        first, *others = (self._hashes[part] for part in PARTS)
        digest = hashlib.sha256(b"".join(each.digest() for each in others))
        end = self._end
        self.pieces.append(
            Piece(end.clips, end.frames, end.sketch, first.hexdigest(), digest.hexdigest())
        )
        self._begin_piece()

    def __exit__(self, error: type[BaseException] | None, *_: object) -> None:
        with self._stack:
            for file in self._files.values() if error is None else ():
                file.flush()
                os.fsync(file.fileno())
