"""Shards: immutable HDF5 files that hold the payloads of many clips, one after another.

Thousands of small datasets are slow to open; the same bytes end to end with offsets are not.
`mocapdb.library.writing.shard_writer` writes them.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

from mocapdb.base.files import expect_no_pipe
from mocapdb.errors import LibraryError
from mocapdb.library.hdf5 import DAMAGED, expect_format, expect_own_data
from mocapdb.library.remote import present
from mocapdb.library.shard_entries import read_entry

__all__ = ["SHARD_FORMAT", "ShardBytes", "ShardReader"]

SHARD_FORMAT = 1


class ShardBytes:
    """The bytes of one clip within a shard; those of a slice are read when it is asked for."""

    def __init__(self, mapped: memoryview, first: int, last: int) -> None:
        self._mapped = mapped
        self._first = first
        self._last = last

    def __len__(self) -> int:
        return self._last - self._first

    def __getitem__(self, part: slice) -> bytes:
        first, last, _ = part.indices(len(self))
        return bytes(self._mapped[self._first + first : self._first + max(first, last)])


class ShardReader:
    """An open shard.

    Parameters
    ----------
    path : Path

    Raises
    ------
    LibraryError
        If the file is missing, is no shard, or has a newer format.
    """

    def __init__(self, path: Path) -> None:
        import h5py

        self.path = path
        self._mapped: memoryview | None = None
        try:
            here = present(path)
            expect_no_pipe(here)
            self._file = h5py.File(here, "r")
        except FileNotFoundError:
            raise LibraryError(f"{path}: the shard is missing.") from None
        except DAMAGED as problem:
            raise LibraryError(f"{path}: not a readable shard ({problem}).") from None
        try:
            expect_own_data(self._file)
            version = int(self._file.attrs["format"])
            expect_format(path, "shard format", version, SHARD_FORMAT)
            self._payload = self._file["payload"]
            self._offsets = self._file["offsets"][:]
            self._checksums = self._file["crc32"][:]
            self._sources = self._file["source_sha256"][:]
            self._entries = self._file.get("entries")
            self._entry_offsets = self._file["entry_offsets"][:] if self.is_complete else None
        except DAMAGED as problem:
            self._file.close()
            raise LibraryError(f"{path}: not a whole shard ({problem}).") from None
        except LibraryError:
            self._file.close()
            raise

    def __len__(self) -> int:
        return len(self._checksums)

    @property
    def is_complete(self) -> bool:
        """Whether it says of its payloads what the catalogue does; those of before do not."""
        return self._entries is not None

    def entry(self, row: int) -> dict[str, Any]:
        """Return what the shard says of a payload (see `shard_entries`).

        Raises
        ------
        LibraryError
            If it is damaged, or of another payload.
        """
        entry = self._entry(row)
        key = "source_sha256" if entry.get("kind") == "clip" else "sha256"
        if entry.get("row", {}).get(key) != self.digest(row):
            raise LibraryError(f"{self.path}: what is said of row {row} is of another clip.")
        return entry

    def shared_entries(self) -> Iterator[dict[str, Any]]:
        """Yield the skeletons and bases that the payloads refer to; damaged ones are left out."""
        n_entries = 0 if self._entry_offsets is None else len(self._entry_offsets) - 1
        for i in range(len(self), n_entries):
            with suppress(LibraryError):
                yield self._entry(i)

    def digest(self, row: int) -> str:
        """Return what is said of the source of a payload: its SHA-256, hexadecimal."""
        return bytes(self._sources[row].tobytes()).hex()

    def _entry(self, i: int) -> dict[str, Any]:
        try:
            return read_entry(self.entry_data(i))
        except LibraryError as problem:
            raise LibraryError(f"{self.path}: entry {i}: {problem}") from None

    def entry_data(self, i: int) -> bytes:
        """Return an entry as it is stored.

        Raises
        ------
        LibraryError
            If there are none, or it cannot be read.
        """
        if self._entries is None or self._entry_offsets is None:
            raise LibraryError(
                f"{self.path}: it does not say what is in it, since an earlier version wrote it."
            )
        try:
            first, end = (int(place) for place in self._entry_offsets[i : i + 2])
            return bytes(self._entries[max(first, 0) : max(end, 0)].tobytes())
        except DAMAGED as problem:
            raise LibraryError(f"{self.path}: cannot read entry {i} ({problem}).") from None

    def payload(self, row: int, source_sha256: str) -> bytes:
        """Return the bytes of one clip, checked against their CRC-32 and the clip's source.

        Parameters
        ----------
        row : int
        source_sha256 : str
            SHA-256 of the source of the clip that is looked for, hexadecimal.

        Raises
        ------
        LibraryError
            If the row does not exist, its bytes are damaged, or they are another clip's.
        """
        first, end = self._range(row, source_sha256)
        try:
            data = self._payload[first:end].tobytes()
        except DAMAGED as problem:
            raise LibraryError(f"{self.path}: cannot read row {row} ({problem}).") from None
        if zlib.crc32(data) != self._checksums[row]:
            raise LibraryError(f"{self.path}: the payload in row {row} fails its checksum.")
        return bytes(data)

    def source(self, row: int, source_sha256: str) -> ShardBytes:
        """Return the bytes of one clip, read where they are asked for and not checked.

        Raises
        ------
        LibraryError
            If the row does not exist, is another clip's, or the file is shorter than it says.
        """
        first, end = self._range(row, source_sha256)
        if self._mapped is None:
            self._mapped = self._map()
        return ShardBytes(self._mapped, first, end)

    def _range(self, row: int, source_sha256: str) -> tuple[int, int]:
        """Return where the bytes of a clip lie, once they are known to be that clip's."""
        if not 0 <= row < len(self):
            raise LibraryError(f"{self.path}: expected a row below {len(self)}, but got {row}.")
        if self.digest(row) != source_sha256:
            raise LibraryError(
                f"{self.path}: row {row} holds another clip than the catalogue says. Run: "
                f"mocapdb recover {quote(str(self.path.parent.parent))}"
            )
        return int(self._offsets[row]), int(self._offsets[row + 1])

    def _map(self) -> memoryview:
        """Return all payloads, mapped into memory: shards never change."""
        start, size = self._payload.id.get_offset(), self._payload.size
        if start is None or self.path.stat().st_size < start + size:
            raise LibraryError(f"{self.path}: the shard is cut short, or not stored in one piece.")
        mapped = np.memmap(self.path, np.uint8, "r", start, (size,))
        return mapped.data

    def close(self) -> None:
        """Close the file."""
        self._mapped = None
        self._file.close()
