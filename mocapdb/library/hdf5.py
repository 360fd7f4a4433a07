"""What all HDF5 files of a library have in common: versions, described datasets, errors."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mocapdb.base.files import expect_no_pipe
from mocapdb.errors import CycleError, LibraryError, SkeletonError

__all__ = [
    "DAMAGED",
    "Described",
    "add_datasets",
    "expect_format",
    "expect_own_data",
    "file_sha256",
    "no_file",
    "opened",
]

DAMAGED = (OSError, KeyError, RuntimeError, TypeError, ValueError)
"""What is raised where an HDF5 file is damaged, or is not what is looked for."""

MOST_GROWTH = 100
"""How many times the bytes that are stored a dataset may unpack to; features take a third."""

MOST_UNASKED = 100_000_000
"""Bytes that a packed one may unpack to besides: of a body at rest hardly anything is stored."""

Described = tuple[str, Any, str, str]
"""A dataset: name, values, units, dims."""


@contextmanager
def opened(
    path: Path,
    unreadable: str,
    advice: str = "",
    *,
    image: io.BytesIO | None = None,
    mode: str = "r",
) -> Iterator[Any]:
    """Open a file, or its image in memory; a `LibraryError` of these words says what is wrong."""
    import h5py

    try:
        if image is None:
            expect_no_pipe(path)
        with h5py.File(image or path, mode) as file:
            expect_own_data(file)
            yield file
    except (*DAMAGED, SkeletonError, CycleError) as problem:
        raise LibraryError(f"{path}: {unreadable} ({problem}). {advice}".rstrip()) from None


def expect_own_data(group: Any) -> None:
    """Refuse datasets that are elsewhere, or say they are far larger than what is stored of them.

    Whoever reads one gets what is written in this file, and memory for no more.

    Raises
    ------
    ValueError
    """
    import h5py

    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise ValueError(f"{name} is a link")
        item = group[name]
        if isinstance(item, h5py.Group):
            expect_own_data(item)
        elif item.is_virtual or item.external:
            raise ValueError(f"{name} is in another file")
        elif item.nbytes > MOST_GROWTH * item.id.get_storage_size() + (
            MOST_UNASKED if item.compression else 0
        ):
            raise ValueError(f"{name} says it has {item.nbytes} bytes, which are not there")


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal.

    Raises
    ------
    OSError
        If it cannot be read, or is no file but a pipe or a device.
    """
    expect_no_pipe(path)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def no_file(name: str) -> str:
    """Return what stands in place of a checksum where a file need not be there yet."""
    return f"no {name}"


def expect_format(path: Path, what: str, version: int, newest: int) -> None:
    """Refuse a file whose format is newer than this version's."""
    if version > newest:
        raise LibraryError(
            f"{path}: expected {what} {newest} or older, but got {version}. "
            "Install a newer mocapdb."
        )


def add_datasets(file: Any, datasets: Iterable[Described], **packing: Any) -> None:
    """Write datasets that say their units and what their axes are."""
    for name, values, units, dims in datasets:
        file.create_dataset(name, data=values, **packing).attrs.update(units=units, dims=dims)
