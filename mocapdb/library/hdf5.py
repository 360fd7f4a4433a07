"""What all HDF5 files of a library have in common: versions, described datasets, errors."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mocapdb.errors import CycleError, LibraryError, SkeletonError

__all__ = ["Described", "add_datasets", "expect_format", "opened"]

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
        with h5py.File(image or path, mode) as file:
            yield file
    except (OSError, KeyError, TypeError, ValueError, SkeletonError, CycleError) as problem:
        raise LibraryError(f"{path}: {unreadable} ({problem}). {advice}".rstrip()) from None


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
