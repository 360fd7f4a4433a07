"""Reading a library in object storage: its catalogue is copied first, shards when they are needed.

Whatever fsspec reaches (``s3://``, ``https://``, ``memory://`` and so on) is read. A copy is a
folder of the user's cache that is laid out as a library, so that nothing else has to know of it.
Every file has to have the size and the SHA-256 that the catalogue says; the catalogue is copied
anew when its ETag, size or time has changed. Names of files are taken from our own patterns, never
from the other side. Shards that were not used for the longest make room for others.

`local_copy`    the folder that has the catalogue of a library in object storage, up to date
`copy_derived`  what queries and cycles read, beside it
`present`       a shard, copied if it is not there yet
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from mocapdb.base.files import replacing, write_whole
from mocapdb.errors import LibraryError, MissingExtraError
from mocapdb.library.addresses import (
    ABOUT_FILE,
    cache_folder,
    copy_folder,
    is_copy,
    is_shard_of_copy,
)
from mocapdb.library.catalogue import SHARD_TABLES, Catalogue
from mocapdb.library.hdf5 import file_sha256
from mocapdb.library.index_pieces import PARTS, StoredIndex, stored_index, stray_index_files
from mocapdb.library.layout import (
    CATALOGUE_FILE,
    CYCLES_FILE,
    MODELS_FILE,
    SEARCH_FOLDER,
    SHARD_NAME,
)
from mocapdb.library.tuning import MOST_CACHED

__all__ = ["copy_derived", "library_bytes", "local_copy", "present"]

BLOCK_BYTES = 2**22
STAMPS = ("etag", "lastmodified", "last-modified", "mtime", "created", "updated", "content-md5")
"""By which a store tells that a file is another one than before, in lower case."""

DERIVED = (MODELS_FILE, CYCLES_FILE)


def local_copy(address: str) -> Path:
    """Return a folder with the catalogue of a library in object storage, as it is now.

    Raises
    ------
    LibraryError
        If there is no library, it cannot be reached, or somebody writes to it.
    MissingExtraError
        If fsspec is not installed.
    """
    store = _Store(address)
    about = store.info(CATALOGUE_FILE)
    if about is None:
        raise LibraryError(f"{address}: not a library (no {CATALOGUE_FILE} in it).")
    if (store.info(f"{CATALOGUE_FILE}-wal") or {}).get("size"):
        raise LibraryError(
            f"{address}: its catalogue was copied while somebody wrote to the library. Copy it "
            "there again when nobody does."
        )
    folder, stamp = copy_folder(address), _stamp(about)
    known = _about(folder)
    path = folder / CATALOGUE_FILE
    is_known = stamp is not None and known.get("stamp") == stamp and path.is_file()
    if is_known and file_sha256(path) == known.get("sha256"):
        return folder
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    (folder / ABOUT_FILE).unlink(missing_ok=True)
    sha256 = store.copy(CATALOGUE_FILE, path, most=_most_cached())
    about_text = json.dumps({"address": address, "stamp": stamp, "sha256": sha256})
    write_whole(folder / ABOUT_FILE, about_text.encode(), failed=_cannot_keep)
    try:
        _expect_our_names(folder, address)
    except LibraryError:
        (folder / ABOUT_FILE).unlink(missing_ok=True)
        raise
    _drop_stale(folder)
    return folder


def present(path: Path) -> Path:
    """Return the path of a shard; of a copy it is fetched if it is not there.

    Raises
    ------
    LibraryError
        If it cannot be fetched, or is not what the catalogue says.
    """
    if not is_shard_of_copy(path):
        return path
    if path.is_file():
        with suppress(OSError):
            os.utime(path)  # the least recently used go first
        return path
    folder = path.parent.parent
    with Catalogue(folder) as catalogue:
        rows = catalogue.shards(path.parent.name) if path.parent.name in SHARD_TABLES else []
        row = next((row for row in rows if row["file"] == path.name), None)
    address = _about(folder).get("address")
    if row is None or address is None:
        return path  # whoever opens it says that it is missing
    path.parent.mkdir(exist_ok=True)
    _make_room(int(row["size"]))
    name = f"{path.parent.name}/{path.name}"
    _Store(address).copy(name, path, size=int(row["size"]), sha256={row["sha256"]})
    return path


def copy_derived(folder: Path, catalogue: Catalogue) -> dict[str, str]:
    """Copy what is made from others, as far as it is not there; return what is wrong, by file.

    Of a folder that is no copy nothing is done.
    """
    if not is_copy(folder):
        return {}
    wrong: dict[str, str] = {}
    store: _Store | None = None
    kept = catalogue.derived_files()
    for name in DERIVED:
        if name not in kept or catalogue.is_as_written(folder / name):
            continue
        store = store or _Store(str(_about(folder).get("address")))
        if store.info(name) is None:
            continue
        try:
            store.copy(name, folder / name, sha256=kept[name], most=_most_cached())
        except LibraryError as problem:
            (folder / name).unlink(missing_ok=True)
            wrong[name] = str(problem)
    index = stored_index(catalogue)
    if index is not None and not index.is_sound():
        store = store or _Store(str(_about(folder).get("address")))
        wrong |= _copy_index(store, index)
    return wrong


def _copy_index(store: _Store, index: StoredIndex) -> dict[str, str]:
    """Copy the search index, whole and checked or not at all; return what is wrong, by its name."""
    files = {f"{SEARCH_FOLDER}/{index.path(part).name}": index.path(part) for part in PARTS}
    if any(store.info(name) is None for name in files):
        return {}  # it is made in memory, then
    (index.folder / SEARCH_FOLDER).mkdir(exist_ok=True)
    try:
        for name, path in files.items():
            store.copy(name, path, most=_most_cached())
        if not index.is_sound(thorough=True):
            raise LibraryError(f"{store.address}/{SEARCH_FOLDER}: fails its SHA-256.")
    except LibraryError as problem:
        for path in files.values():
            path.unlink(missing_ok=True)
        return {f"{SEARCH_FOLDER}/{index.number:06d}": str(problem)}
    return {}


def library_bytes(folder: Path) -> tuple[int, int]:
    """Return the bytes of a library of which this is a copy, and of those only for queries."""
    with Catalogue(folder) as catalogue:
        shards = {kind: sum(row["size"] for row in catalogue.shards(kind)) for kind in SHARD_TABLES}
        index = stored_index(catalogue)
        of_index = 0 if index is None else index.size
    own = {name: folder / name for name in (CATALOGUE_FILE, *DERIVED)}
    sizes = {name: path.stat().st_size for name, path in own.items() if path.is_file()}
    for_queries = shards["features"] + of_index + sizes.get(MODELS_FILE, 0)
    return sum(sizes.values()) + of_index + sum(shards.values()), for_queries


class _Store:
    """The files of a library at an address.

    Parameters
    ----------
    address : str

    Raises
    ------
    LibraryError
        If nothing reads such addresses.
    MissingExtraError
        If fsspec is not installed.
    """

    def __init__(self, address: str) -> None:
        try:
            from fsspec.core import url_to_fs
        except ImportError:
            raise MissingExtraError("fsspec", "remote") from None
        self.address = address
        self._files, self._root = self._asked("", url_to_fs, address)
        self._files.invalidate_cache()  # it may know names and sizes of an earlier time

    def info(self, name: str) -> Mapping[str, Any] | None:
        """Return what the store says of a file, or None where there is none."""
        try:
            found: Mapping[str, Any] = self._asked(name, self._files.info, self._path(name))
        except FileNotFoundError:
            return None
        return found if found.get("type", "file") == "file" else None

    def copy(
        self,
        name: str,
        target: Path,
        *,
        size: int | None = None,
        sha256: set[str] | None = None,
        most: int | None = None,
    ) -> str:
        """Copy a file, whole and checked or not at all, and return its SHA-256.

        Raises
        ------
        LibraryError
            If it cannot be read or written, is larger than it may be, or not what it should be.
        """
        limit = size if size is not None else most
        digest, n_bytes = hashlib.sha256(), 0
        with replacing(target, failed=_cannot_keep) as (unfinished,), unfinished.open("wb") as own:
            for block in self._blocks(name):
                n_bytes += len(block)
                if limit is not None and n_bytes > limit:
                    raise LibraryError(
                        f"{self.address}/{name}: expected {limit} bytes at most, but got more. "
                        "Where a catalogue is that large, set MOCAPDB_CACHE_MB."
                    )
                digest.update(block)
                own.write(block)
            if size is not None and n_bytes != size:
                raise LibraryError(
                    f"{self.address}/{name}: expected {size} bytes, but got {n_bytes}: it is cut "
                    "short."
                )
            if sha256 is not None and digest.hexdigest() not in sha256:
                raise LibraryError(f"{self.address}/{name}: fails its SHA-256.")
        return digest.hexdigest()

    def _blocks(self, name: str) -> Any:
        try:
            file = self._asked(name, self._files.open, self._path(name), "rb")
        except FileNotFoundError:
            raise LibraryError(f"{self.address}/{name}: the file is missing.") from None
        with file:
            while block := self._asked(name, file.read, BLOCK_BYTES):
                yield block

    def _path(self, name: str) -> str:
        return f"{self._root.rstrip('/')}/{name}"

    def _asked(self, name: str, ask: Callable[..., Any], *arguments: Any) -> Any:
        """Ask the store; each has errors of its own, which are told in one way."""
        try:
            return ask(*arguments)
        except FileNotFoundError:
            raise
        except ImportError as problem:  # of what reads one kind of address
            raise LibraryError(f"{self.address}: {problem}.") from None
        except Exception as problem:
            where = f"{self.address}/{name}".rstrip("/")
            why = str(problem).partition("\n")[0][:300] or type(problem).__name__
            raise LibraryError(
                f"{where}: cannot be read ({why}). Check the address, the connection, and whether "
                "you may read it."
            ) from None


def _stamp(about: Mapping[str, Any]) -> dict[str, str] | None:
    """Return by what a later version of a file is told, or None where the store tells nothing."""
    said = {str(key).lower(): str(value) for key, value in about.items() if value is not None}
    stamp = {key: said[key] for key in STAMPS if key in said}
    return stamp | {"size": said.get("size", "")} if stamp else None


def _about(folder: Path) -> dict[str, Any]:
    try:
        about = json.loads((folder / ABOUT_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return about if isinstance(about, dict) else {}


def _expect_our_names(folder: Path, address: str) -> None:
    """Refuse a catalogue whose shards have names that may lead elsewhere."""
    with Catalogue(folder) as catalogue:
        for kind in SHARD_TABLES:
            for row in catalogue.shards(kind):
                if not SHARD_NAME.fullmatch(str(row["file"])):
                    raise LibraryError(
                        f"{address}: expected a shard with a name such as 000001.h5, but its "
                        f"catalogue has {row['file']!r}: it is damaged, or made to harm."
                    )


def _drop_stale(folder: Path) -> None:
    """Remove the shards and indexes of a copy that its catalogue does not know any more."""
    with Catalogue(folder) as catalogue:
        for kind in SHARD_TABLES:
            hashes = catalogue.shard_hashes(kind)
            for path in sorted((folder / kind).glob("*")):
                if path.is_file() and hashes.get(path.name) != file_sha256(path):
                    path.unlink(missing_ok=True)
        for path in stray_index_files(catalogue):
            path.unlink(missing_ok=True)


def _make_room(n_bytes: int) -> None:
    """Remove the shards that were not used for the longest, so that others fit into the cache."""
    found = []
    for path in cache_folder().glob("*/*/*"):
        if SHARD_NAME.fullmatch(path.name) and is_shard_of_copy(path):
            with suppress(OSError):  # another process makes room as well
                about = path.stat()
                found.append((about.st_mtime, about.st_size, path))
    total = sum(size for _, size, _ in found) + n_bytes
    for _, size, path in sorted(found):
        if total <= _most_cached():
            return
        path.unlink(missing_ok=True)
        total -= size


def _most_cached() -> int:
    named = os.environ.get("MOCAPDB_CACHE_MB", "")
    return int(named) * 2**20 if named.isdecimal() else MOST_CACHED


def _cannot_keep(path: Path, problem: OSError) -> LibraryError:
    reason = problem.strerror or problem
    return LibraryError(
        f"{path}: cannot keep a copy of the library ({reason}). Name another folder for copies in "
        "MOCAPDB_CACHE."
    )
