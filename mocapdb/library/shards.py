"""Shards: immutable HDF5 files that hold the payloads of many clips, one after another.

Thousands of small datasets are slow to open; the same bytes end to end with offsets are not. A
shard is made in memory, written under another name, flushed to the disk and only then given its
own: it is there whole or not at all, and nothing is ever appended to it.
"""

from __future__ import annotations

import errno
import hashlib
import io
import os
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mocapdb.errors import LibraryError

__all__ = [
    "SHARD_FORMAT",
    "ShardBytes",
    "ShardReader",
    "WrittenShard",
    "next_shard_number",
    "remove_strays",
    "stray_files",
    "write_image",
    "write_shard",
]

SHARD_FORMAT = 1
PARTIAL_SUFFIX = ".partial"


@dataclass(frozen=True)
class WrittenShard:
    """A shard as it was written: name of the file, its size in bytes and its SHA-256."""

    file: str
    size: int
    sha256: str


def write_shard(
    folder: Path, number: int, payloads: Sequence[bytes], sources: Sequence[str]
) -> WrittenShard:
    """Write payloads as a new shard and return what was written.

    Parameters
    ----------
    folder : Path
        The library's folder of shards.
    number : int
        The shard's number, never used before.
    payloads : sequence of bytes
    sources : sequence of str
        SHA-256 of each clip's source, hexadecimal, so that a shard tells what it holds.

    Raises
    ------
    LibraryError
        If the disk is full or cannot be written; nothing is left behind.
    """
    return write_image(folder / f"{number:06d}.h5", _shard_image(payloads, sources))


def write_image(path: Path, image: bytes) -> WrittenShard:
    """Write a file that is there whole or not at all, also after a loss of power.

    Raises
    ------
    LibraryError
        If the disk is full or cannot be written; nothing is left behind.
    """
    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    try:
        with partial.open("wb") as file:
            file.write(image)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
        _sync_folder(path.parent)
    except OSError as problem:
        partial.unlink(missing_ok=True)
        raise _writing_failed(path, problem, len(image)) from None
    return WrittenShard(path.name, len(image), hashlib.sha256(image).hexdigest())


def _writing_failed(path: Path, problem: OSError, size: int) -> LibraryError:
    """Return the error for a file that could not be written."""
    reason = problem.strerror or str(problem)
    if problem.errno in {errno.ENOSPC, errno.EFBIG, errno.EDQUOT}:
        advice = f"Free {size / 1e6:.1f} MB or more and build again: what is committed is safe."
    else:
        advice = "Nothing was committed by this step; what was committed before is safe."
    return LibraryError(f"{path}: cannot write ({reason}). {advice}")


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
            self._file = h5py.File(path, "r")
        except FileNotFoundError:
            raise LibraryError(f"{path}: the shard is missing.") from None
        except OSError as problem:
            raise LibraryError(f"{path}: not a readable shard ({problem}).") from None
        try:
            version = int(self._file.attrs["format"])
            if version > SHARD_FORMAT:
                raise LibraryError(
                    f"{path}: expected shard format {SHARD_FORMAT} or older, but got {version}. "
                    "Install a newer mocapdb."
                )
            self._payload = self._file["payload"]
            self._offsets = self._file["offsets"][:]
            self._checksums = self._file["crc32"][:]
        except (KeyError, OSError, ValueError) as problem:
            self._file.close()
            raise LibraryError(f"{path}: not a whole shard ({problem}).") from None

    def __len__(self) -> int:
        return len(self._checksums)

    def payload(self, row: int) -> bytes:
        """Return the bytes of one clip, checked against their CRC-32.

        Raises
        ------
        LibraryError
            If the row does not exist or its bytes are damaged.
        """
        if not 0 <= row < len(self):
            raise LibraryError(f"{self.path}: expected a row below {len(self)}, but got {row}.")
        try:
            data = self._payload[self._offsets[row] : self._offsets[row + 1]].tobytes()
        except (OSError, ValueError) as problem:
            raise LibraryError(f"{self.path}: cannot read row {row} ({problem}).") from None
        if zlib.crc32(data) != self._checksums[row]:
            raise LibraryError(f"{self.path}: the payload in row {row} fails its checksum.")
        return bytes(data)

    def source(self, row: int) -> ShardBytes:
        """Return the bytes of one clip, read where they are asked for and not checked.

        Raises
        ------
        LibraryError
            If the row does not exist or the file is shorter than it says.
        """
        if not 0 <= row < len(self):
            raise LibraryError(f"{self.path}: expected a row below {len(self)}, but got {row}.")
        if self._mapped is None:
            self._mapped = self._map()
        return ShardBytes(self._mapped, int(self._offsets[row]), int(self._offsets[row + 1]))

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

    def __enter__(self) -> ShardReader:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def next_shard_number(folder: Path) -> int:
    """Return a number that no shard in the folder has had."""
    return max((int(path.stem) for path in folder.glob("[0-9]*.h5")), default=0) + 1


def stray_files(folder: Path, known: set[str]) -> list[Path]:
    """Return the files among the shards that no commit knows of."""
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if path.name not in known)


def remove_strays(folder: Path, known: set[str]) -> None:
    """Remove what a killed writer left; only the library's only writer may."""
    for path in stray_files(folder, known):
        path.unlink()


def _shard_image(payloads: Sequence[bytes], sources: Sequence[str]) -> bytes:
    import h5py

    offsets = np.zeros(len(payloads) + 1, dtype=np.int64)
    np.cumsum([len(payload) for payload in payloads], out=offsets[1:])
    digests = np.frombuffer(b"".join(map(bytes.fromhex, sources)), dtype=np.uint8)
    buffer = io.BytesIO()
    # the oldest layout that has all we need: any HDF5 reader opens it
    with h5py.File(buffer, "w", libver=("earliest", "v108")) as file:
        file.attrs["format"] = SHARD_FORMAT
        for name, values, units, dims in (
            ("payload", np.frombuffer(b"".join(payloads), dtype=np.uint8), "byte", "byte"),
            ("offsets", offsets, "byte", "clip+1"),
            ("crc32", np.array([zlib.crc32(p) for p in payloads], np.uint32), "1", "clip"),
            ("source_sha256", digests.reshape(-1, 32), "1", "clip,byte"),
        ):
            dataset = file.create_dataset(name, data=values)
            dataset.attrs["units"] = units
            dataset.attrs["dims"] = dims
    return buffer.getvalue()


def _sync_folder(folder: Path) -> None:
    """Make a rename durable; Windows has no such call and needs none."""
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
