"""The search index on the disk: plain files that only grow, and what the catalogue says of them.

``search/000001.clips``        which clips there are: a record of `ENTRY` each
``search/000001.frames``       their frames as codes, (N, D) int8
``search/000001.sketch``       the sketch of them, (M, 16) int8
``search/000001.turns``        by how much each frame turns, (N,) int8
``search/000001.signatures``   mean and deviation of each clip's frames, (n, 2 D) float32

Clips are appended in *pieces*; the catalogue has a row for each with checksums and where it ends.
What lies beyond the last piece was written by somebody who was stopped, and is written over.
An index that is made anew gets the next number. `mocapdb.library.writing.index_writer` writes.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import FloatArray
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.layout import SEARCH_FOLDER
from mocapdb.library.tuning import MOST_HASHED

__all__ = [
    "ENTRY",
    "HASHED_APART",
    "PARTS",
    "SKETCH_BYTES",
    "Piece",
    "StoredIndex",
    "damaged_pieces",
    "stored_index",
    "stray_index_files",
]

ENTRY = np.dtype([("clip", "<i8"), ("frames", "<u4"), ("usual", "<u4")])
"""The clip's row, its frames, and whether it lies where clips do: 1, or 0."""

PARTS = ("clips", "frames", "sketch", "turns", "signatures")
HASHED_APART = "clips"
"""The part that is always compared with its checksum, since it says whose the others are."""

SKETCH_BYTES = 16
INDEX_NAME = re.compile(rf"(\d{{6,}})\.({'|'.join(PARTS)})")


@dataclass(frozen=True)
class Piece:
    """Some clips of an index, which were written together.

    Attributes
    ----------
    clips, frames, sketch : int
        How many of each there are up to the end of the piece.
    clips_sha256 : str
        SHA-256 of its part of ``clips``.
    sha256 : str
        SHA-256 of the SHA-256 of its other parts, one after another.
    """

    clips: int = 0
    frames: int = 0
    sketch: int = 0
    clips_sha256: str = ""
    sha256: str = ""

    def rows(self, part: str) -> int:
        """Return how many rows a part has up to the end of the piece."""
        return {"frames": self.frames, "turns": self.frames, "sketch": self.sketch}.get(
            part, self.clips
        )


@dataclass(frozen=True, eq=False)
class StoredIndex:
    """An index as it is stored.

    Attributes
    ----------
    folder : Path
        The library's.
    number : int
        Its files begin with it.
    weights : tuple of float
    mean, axes, deviations : (107,), (107, D), (D,)
        Its space: see `mocapdb.indexing.search.features.FeatureSpace`.
    fitted : int
        How many clips there were when the space was found.
    pieces : tuple of Piece
    """

    folder: Path
    number: int
    weights: tuple[float, ...]
    mean: FloatArray
    axes: FloatArray
    deviations: FloatArray
    fitted: int
    pieces: tuple[Piece, ...] = ()

    @property
    def end(self) -> Piece:
        """The last piece, whose numbers are those of all."""
        return self.pieces[-1] if self.pieces else Piece()

    def path(self, part: str) -> Path:
        """Return the file of a part."""
        return self.folder / SEARCH_FOLDER / f"{self.number:06d}.{part}"

    def row_bytes(self, part: str) -> int:
        """Return the size of a row of a part."""
        n_dims: int = self.axes.shape[1]
        sizes = {"clips": ENTRY.itemsize, "sketch": SKETCH_BYTES, "turns": 1}
        return (sizes | {"frames": n_dims, "signatures": 8 * n_dims})[part]

    @property
    def size(self) -> int:
        """Bytes of all parts."""
        return sum(self.end.rows(part) * self.row_bytes(part) for part in PARTS)

    def entries(self) -> NDArray[np.void]:
        """Return (n,) records of `ENTRY`, one a clip.

        Raises
        ------
        OSError, ValueError
            If the file is missing or too short.
        """
        size = self.end.clips * ENTRY.itemsize
        with self.path("clips").open("rb") as file:
            return np.frombuffer(file.read(size), ENTRY, count=self.end.clips)

    def mapped(self, part: str) -> NDArray[np.int8]:
        """Return (rows, bytes) of a part, which are read when they are touched.

        Raises
        ------
        OSError, ValueError
            If the file is missing or too short.
        """
        shape = self.end.rows(part), self.row_bytes(part)
        if not shape[0]:
            return np.zeros(shape, np.int8)
        return np.memmap(self.path(part), np.int8, "r", shape=shape)

    def is_sound(self, *, thorough: bool = False) -> bool:
        """Return whether it is there, and is as it was written.

        Of an index of over `MOST_HASHED` bytes only the list of the clips is compared with its
        checksum, unless it is to be `thorough`: `verify` compares all of it.
        """
        parts = PARTS if thorough or self.size <= MOST_HASHED else (HASHED_APART,)
        return self.is_there() and next(self.damaged(parts), None) is None

    def is_there(self) -> bool:
        """Return whether no file is missing, or shorter than the catalogue says."""
        return all(
            path.is_file() and path.stat().st_size >= self.end.rows(part) * self.row_bytes(part)
            for part in PARTS
            for path in [self.path(part)]
        )

    def damaged(self, parts: Sequence[str] = PARTS) -> Iterator[str]:
        """Yield the files that are not as they were written."""
        before = Piece()
        for piece in self.pieces:
            if self.clips_digest(before, piece) != piece.clips_sha256:
                yield self.path("clips").name
            others = [part for part in parts if part != HASHED_APART]
            if others and self.others_digest(before, piece) != piece.sha256:
                yield f"{self.number:06d}, clips {before.clips + 1} to {piece.clips}"
            before = piece

    def clips_digest(self, before: Piece, piece: Piece) -> str:
        """Return the SHA-256 of the list of a piece's clips."""
        return self.part_hash("clips", before, piece).hexdigest()

    def others_digest(self, before: Piece, piece: Piece) -> str:
        """Return the SHA-256 of the SHA-256 of a piece's other parts, one after another."""
        digests = (self.part_hash(part, before, piece).digest() for part in PARTS[1:])
        return hashlib.sha256(b"".join(digests)).hexdigest()

    def part_hash(self, part: str, before: Piece, piece: Piece) -> hashlib._Hash:
        """Return the SHA-256 of the part of a piece as its file has it."""
        first, end = (each.rows(part) * self.row_bytes(part) for each in (before, piece))
        digest = hashlib.sha256()
        with self.path(part).open("rb") as file:
            file.seek(first)
            while first < end and (block := file.read(min(end - first, 2**20))):
                digest.update(block)
                first += len(block)
        return digest


def stored_index(catalogue: Catalogue) -> StoredIndex | None:
    """Return the index that a catalogue knows of; None where there is none."""
    row = catalogue.search_index()
    if row is None:
        return None
    numbers = np.frombuffer(row["space"], "<f8")
    n_features, n_dims = row["features"], row["dims"]
    ends = np.cumsum([row["weights"], n_features, n_features * n_dims, n_dims])
    if len(numbers) != ends[-1]:
        return None  # the row is damaged: `verify` tells
    weights, mean, axes, deviations = np.split(numbers, ends[:-1])
    return StoredIndex(
        catalogue.path.parent,
        row["id"],
        tuple(weights.tolist()),
        mean,
        axes.reshape(n_features, n_dims),
        deviations,
        row["fitted"],
        tuple(Piece(*each) for each in catalogue.search_pieces()),
    )


def damaged_pieces(catalogue: Catalogue) -> list[str]:
    """Return what of the search index is not as it was written, by its names.

    An index of which a file is missing or too short is of no use and made again, not damaged.
    """
    index = stored_index(catalogue)
    return [] if index is None or not index.is_there() else list(index.damaged())


def stray_index_files(catalogue: Catalogue) -> list[Path]:
    """Return the files of indexes that are not, or no longer, in use."""
    row = catalogue.search_index()
    folder = catalogue.path.parent / SEARCH_FOLDER
    files = sorted(folder.iterdir()) if folder.is_dir() else []
    named = ((path, INDEX_NAME.fullmatch(path.name)) for path in files)
    return [path for path, found in named if found and (row is None or int(found[1]) != row["id"])]
