"""Addresses of libraries in object storage, and where this machine has copies of them.

An address is ``s3://bucket/cmu.mocapdb`` or any other that fsspec knows. Whoever made a `Path` of
one has taken a slash from it; it is understood all the same.
"""

from __future__ import annotations

import hashlib
import os
import re
from pathlib import Path

from mocapdb.base.arrays import StrPath
from mocapdb.errors import LibraryError
from mocapdb.library.layout import SHARD_NAME

__all__ = [
    "ABOUT_FILE",
    "address_of",
    "cache_folder",
    "copy_folder",
    "expect_local",
    "is_copy",
    "is_shard_of_copy",
    "with_addresses",
]

ABOUT_FILE = "remote.json"
"""In a copy: where it is from, and which version of the catalogue it has."""

_ADDRESS = re.compile(r"([a-z][a-z0-9+.-]+):/{1,3}(?=[^/])")
_known: dict[str, str] = {}  # the copies that were opened, and their addresses


def address_of(path: StrPath) -> str | None:
    """Return the address that a path is, without a slash at its end; None for a local path.

    Examples
    --------
    >>> from pathlib import Path
    >>> address_of("s3://bucket/cmu.mocapdb/"), address_of(Path("s3://bucket/cmu.mocapdb"))
    ('s3://bucket/cmu.mocapdb', 's3://bucket/cmu.mocapdb')
    >>> address_of("cmu.mocapdb"), address_of("C:/cmu.mocapdb")
    (None, None)
    """
    text = os.fspath(path)
    if isinstance(path, Path):
        text = path.as_posix()
    found = _ADDRESS.match(text)
    if found is None:
        return None
    slashes = ":///" if found[1] in {"file", "local"} else "://"
    return found[1] + slashes + text[found.end() :].rstrip("/")


def expect_local(path: StrPath) -> None:
    """Refuse an address, or the copy of what is there, where something is to be written.

    Raises
    ------
    LibraryError
    """
    address = address_of(path)
    if address is not None:
        raise LibraryError(
            f"{address}: expected a folder of this machine, since libraries in object storage are "
            "only read. Copy it to a folder, and copy it back when it is done."
        )
    if is_copy(Path(path)):
        raise LibraryError(
            f"{path}: expected a library of its own, but it is a copy of one in object storage, "
            "which is only read."
        )


def cache_folder() -> Path:
    """Return where copies are kept: ``MOCAPDB_CACHE``, else a folder of the user's cache."""
    named = os.environ.get("MOCAPDB_CACHE")
    if named:
        return Path(named).absolute()
    usual = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(usual, "mocapdb").absolute()


def copy_folder(address: str) -> Path:
    """Return the folder for the copy of a library: its name is made of nothing that is remote."""
    folder = cache_folder() / hashlib.sha256(address.encode()).hexdigest()[:32]
    _known[str(folder)] = address
    return folder


def is_copy(folder: Path) -> bool:
    """Return whether a folder is a copy of a library in object storage."""
    return folder.absolute().parent == cache_folder() and (folder / ABOUT_FILE).is_file()


def is_shard_of_copy(path: Path) -> bool:
    """Return whether a file is a shard of a copy, which may have to be fetched."""
    return SHARD_NAME.fullmatch(path.name) is not None and is_copy(path.parent.parent)


def with_addresses(text: str) -> str:
    """Return a message with the addresses of libraries in place of the folders of their copies."""
    for folder, address in _known.items():
        text = text.replace(folder, address)
    return text
