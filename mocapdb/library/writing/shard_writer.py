"""Shards are written once: whole or not at all, and nothing is ever appended to one.

A shard is made in memory, written under another name, flushed to the disk and only then given its
own. It belongs to the library from the commit that names it; before, it is a stray.
"""

from __future__ import annotations

import errno
import hashlib
import io
import zlib
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.files import make_folder, write_whole
from mocapdb.errors import LibraryError
from mocapdb.library.hdf5 import add_datasets
from mocapdb.library.shards import SHARD_FORMAT

__all__ = ["shard_image", "write_shard"]


def write_shard(folder: Path, image: bytes) -> dict[str, Any]:
    """Write a shard that is there whole or not at all, also after a loss of power.

    Parameters
    ----------
    folder : Path
        A folder of shards; the new one gets a number that none in it has had.
    image : bytes
        The file's content.

    Returns
    -------
    dict
        ``file``, its name; ``size`` in bytes; ``sha256``: its row of the catalogue.

    Raises
    ------
    LibraryError
        If the disk is full or cannot be written; nothing is left behind.
    """
    make_folder(folder)
    number = max((int(path.stem) for path in folder.glob("[0-9]*.h5")), default=0) + 1
    path = folder / f"{number:06d}.h5"
    write_whole(path, image, failed=partial(_writing_failed, len(image)), one_writer=True)
    sha256 = hashlib.sha256(image).hexdigest()
    return {"file": path.name, "size": len(image), "sha256": sha256}


def _writing_failed(size: int, path: Path, problem: OSError) -> LibraryError:
    """Return the error for a file that could not be written."""
    reason = problem.strerror or str(problem)
    if problem.errno in {errno.ENOSPC, errno.EFBIG, errno.EDQUOT}:
        advice = f"Free {size / 1e6:.1f} MB or more and build again: what is committed is safe."
    else:
        advice = "Nothing was committed by this step; what was committed before is safe."
    return LibraryError(f"{path}: cannot write ({reason}). {advice}")


def shard_image(
    payloads: Sequence[bytes],
    sources: Sequence[str],
    entries: Sequence[bytes],
    shared: Iterable[bytes] = (),
) -> bytes:
    """Return the content of a shard.

    Parameters
    ----------
    payloads : sequence of bytes
    sources : sequence of str
        SHA-256 of each clip's source, hexadecimal, so that a shard tells what it holds.
    entries : sequence of bytes
        What there is to know of each payload; see `shard_entries`.
    shared : iterable of bytes
        Entries of the skeletons and bases that the payloads refer to.
    """
    import h5py

    every = [*entries, *shared]
    digests = np.frombuffer(b"".join(map(bytes.fromhex, sources)), dtype=np.uint8)
    checksums = np.array([zlib.crc32(payload) for payload in payloads], np.uint32)
    buffer = io.BytesIO()
    # the oldest layout that has all we need: any HDF5 reader opens it
    with h5py.File(buffer, "w", libver=("earliest", "v108")) as file:
        file.attrs["format"] = SHARD_FORMAT
        add_datasets(
            file,
            [
                ("payload", _joined(payloads), "byte", "byte"),
                ("offsets", _offsets(payloads), "byte", "clip+1"),
                ("crc32", checksums, "1", "clip"),
                ("source_sha256", digests.reshape(-1, 32), "1", "clip,byte"),
                ("entries", _joined(every), "byte", "byte"),
                ("entry_offsets", _offsets(every), "byte", "clip+shared+1"),
            ],
        )
    return buffer.getvalue()


def _joined(parts: Sequence[bytes]) -> NDArray[np.uint8]:
    return np.frombuffer(b"".join(parts), dtype=np.uint8)


def _offsets(parts: Sequence[bytes]) -> NDArray[np.int64]:
    return np.cumsum([0, *map(len, parts)], dtype=np.int64)
