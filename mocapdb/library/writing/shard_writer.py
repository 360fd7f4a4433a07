"""Shards are written once: whole or not at all, and nothing is ever appended to one.

A shard is made in memory, written under another name, flushed to the disk and only then given its
own. It belongs to the library from the commit that names it; before, it is a stray.
"""

from __future__ import annotations

import errno
import hashlib
import io
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from mocapdb.base.files import write_whole
from mocapdb.errors import LibraryError
from mocapdb.library.shards import SHARD_FORMAT

__all__ = [
    "WrittenShard",
    "next_shard_path",
    "remove_strays",
    "stray_files",
    "write_image",
    "write_shard",
]


@dataclass(frozen=True)
class WrittenShard:
    """A shard as it was written: name of the file, its size in bytes and its SHA-256."""

    file: str
    size: int
    sha256: str


def write_shard(folder: Path, payloads: Sequence[bytes], sources: Sequence[str]) -> WrittenShard:
    """Write payloads as a new shard and return what was written.

    Parameters
    ----------
    folder : Path
        The library's folder of shards.
    payloads : sequence of bytes
    sources : sequence of str
        SHA-256 of each clip's source, hexadecimal, so that a shard tells what it holds.

    Raises
    ------
    LibraryError
        If the disk is full or cannot be written; nothing is left behind.
    """
    return write_image(next_shard_path(folder), _shard_image(payloads, sources))


def next_shard_path(folder: Path) -> Path:
    """Return a path in the folder whose number no shard in it has had."""
    number = max((int(path.stem) for path in folder.glob("[0-9]*.h5")), default=0) + 1
    return folder / f"{number:06d}.h5"


def write_image(path: Path, image: bytes) -> WrittenShard:
    """Write a file that is there whole or not at all, also after a loss of power.

    Raises
    ------
    LibraryError
        If the disk is full or cannot be written; nothing is left behind.
    """
    write_whole(path, image, failed=partial(_writing_failed, len(image)), one_writer=True)
    return WrittenShard(path.name, len(image), hashlib.sha256(image).hexdigest())


def _writing_failed(size: int, path: Path, problem: OSError) -> LibraryError:
    """Return the error for a file that could not be written."""
    reason = problem.strerror or str(problem)
    if problem.errno in {errno.ENOSPC, errno.EFBIG, errno.EDQUOT}:
        advice = f"Free {size / 1e6:.1f} MB or more and build again: what is committed is safe."
    else:
        advice = "Nothing was committed by this step; what was committed before is safe."
    return LibraryError(f"{path}: cannot write ({reason}). {advice}")


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
