"""The cycles of classes that a library keeps: ``cycles.h5``, beside its shards.

The file is small and rewritten whole under another name, so that it is there as it was or as it is
to be. `mocapdb.library.searching.class_cycles` makes what it holds.
"""

from __future__ import annotations

import io
import json
import zlib
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import write_whole
from mocapdb.errors import LibraryError
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.hdf5 import expect_format, opened
from mocapdb.library.layout import CYCLES_FILE, is_library
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.derived_files import replacing_derived
from mocapdb.library.writing.open_for_writing import only_writer
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.cycles.class_cycle import ClassCycle

__all__ = ["CYCLES_FORMAT", "list_cycles", "read_cycle", "write_cycle"]

CYCLES_FORMAT = 1
LOCK_WAIT_S = 10.0  # another cycle is written in a few milliseconds
UNREADABLE = ("not readable cycles", "Delete the file; make them anew.")
CYCLE_ARRAYS = {
    "columns": "columns",
    "sway": "sway",
    "advance": "advance",
    "shifts": "translations",
}
"""Datasets of a cycle, and what holds them in memory."""


def list_cycles(library: StrPath) -> list[dict[str, Any]]:
    """Return ``{"class", "members", "period_s"}`` of each cycle that a library keeps."""
    path = Path(library) / CYCLES_FILE
    if not path.is_file():
        return []
    _expect_as_written(path)
    with opened(path, *UNREADABLE) as file:
        _expect_format(file, path)
        every = {name: _about(group) for name, group in file.items()}
        return [
            {"class": name, "members": len(about["members"]), "period_s": about["period_s"]}
            for name, about in every.items()
        ]


def read_cycle(library: StrPath, name: str) -> ClassCycle:
    """Return the cycle of a class that a library keeps.

    Raises
    ------
    LibraryError
        If the library keeps none of that name, or the file is damaged.
    """
    from mocapdb.cycles.class_cycle import ClassCycle
    from mocapdb.cycles.cycle import Cycle

    path = Path(library) / CYCLES_FILE
    names = [row["class"] for row in list_cycles(library)]
    if name not in names:
        raise LibraryError(
            f"{path}: expected the cycle of a class out of {', '.join(names) or 'none'}, but got "
            f"{name!r}. Make it: mocapdb cycle {quote(str(library))} --class {quote(name)}"
        )
    with opened(path, *UNREADABLE) as file:
        group = file[name]
        about = _about(group)
        if "crc32" in group.attrs and group.attrs["crc32"] != _checksum(group):
            raise ValueError(f"the cycle of {name} is not what was written")
        arrays: dict[str, Any] = {own: group[kept][:] for kept, own in CYCLE_ARRAYS.items()}
        cycle = Cycle(
            skeleton=Skeleton.from_dict(about["skeleton"]),
            turn_rad=about["turn_rad"],
            period_s=about["period_s"],
            name=name,
            label=name,
            provenance=tuple(about["provenance"]),
            **arrays,
        )
        members, mirrored = tuple(about["members"]), tuple(about["mirrored"])
        return ClassCycle(cycle, group["spread_rad"][:], members, mirrored, about["left_out"])


def write_cycle(library: StrPath, found: ClassCycle) -> Path:
    """Keep the cycle of a class in a library, in place of an earlier one of that class.

    Raises
    ------
    LibraryError
        If the file is damaged, newer than this version, or cannot be written.
    LibraryLockedError
        If another process writes to the library for longer than ten seconds.
    """
    path = Path(library) / CYCLES_FILE
    with only_writer(path.parent, wait_s=LOCK_WAIT_S):  # others may write another class's
        there = path.is_file()
        if there:
            _expect_as_written(path)
        image = io.BytesIO(path.read_bytes() if there else b"")
        with opened(path, *UNREADABLE, image=image, mode="r+" if there else "w") as file:
            _expect_format(file, path)
            file.attrs["format"] = CYCLES_FORMAT
            name = found.cycle.name
            if name in file:
                del file[name]
            _fill(file.create_group(name, track_order=True), found)
        if not is_library(path.parent):
            write_whole(path, image.getvalue(), failed=_cannot_write)
            return path
        with (
            CatalogueWriter(path.parent) as catalogue,
            replacing_derived(catalogue, path, _cannot_write) as unfinished,
        ):
            unfinished.write_bytes(image.getvalue())
    return path


def _expect_as_written(path: Path) -> None:
    """Refuse cycles that are not what was written, by the library's catalogue."""
    if not is_library(path.parent):
        return
    with Catalogue(path.parent) as catalogue:
        if not catalogue.is_as_written(path):
            raise LibraryError(f"{path}: damaged. Run: mocapdb recover {quote(str(path.parent))}")


def _fill(group: Any, found: ClassCycle) -> None:
    cycle = found.cycle
    arrays = {kept: getattr(cycle, own) for kept, own in CYCLE_ARRAYS.items()}
    for key, values in (arrays | {"spread_rad": found.spread_rad}).items():
        group.create_dataset(key, data=np.asarray(values, dtype=np.float64))
    about = {
        "skeleton": cycle.skeleton.to_dict(),
        "turn_rad": cycle.turn_rad,
        "period_s": cycle.period_s,
        "provenance": cycle.provenance,
        "members": found.members,
        "mirrored": found.mirrored,
        "left_out": found.left_out or {},
    }
    # a dataset, because attributes end at 64 kB
    group.create_dataset("about", data=np.frombuffer(json.dumps(about).encode(), dtype=np.uint8))
    group.attrs["crc32"] = _checksum(group)  # so that it can be trusted without a catalogue


def _checksum(group: Any) -> int:
    """Return the CRC-32 of a cycle's datasets, one after another by name."""
    checksum = 0
    for name in sorted(group):
        checksum = zlib.crc32(group[name][:].tobytes(), checksum)
    return checksum


def _about(group: Any) -> dict[str, Any]:
    about: dict[str, Any] = json.loads(group["about"][:].tobytes())
    return about


def _expect_format(file: Any, path: Path) -> None:
    expect_format(path, "format", int(file.attrs.get("format", CYCLES_FORMAT)), CYCLES_FORMAT)


def _cannot_write(path: Path, problem: OSError) -> LibraryError:
    return LibraryError(f"{path}: cannot write ({problem.strerror}).")
