"""The cycles of classes that a library keeps: ``cycles.h5``, beside its shards.

The file is small and rewritten whole under another name, so that it is there as it was or as it is
to be. `mocapdb.library.searching.class_cycles` makes what it holds.
"""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import write_whole
from mocapdb.errors import CycleError, LibraryError, SkeletonError
from mocapdb.library.layout import CYCLES_FILE
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.cycles.class_cycle import ClassCycle

__all__ = ["CYCLES_FORMAT", "list_cycles", "read_cycle", "write_cycle"]

CYCLES_FORMAT = 1


def list_cycles(library: StrPath) -> list[dict[str, Any]]:
    """Return ``{"class", "members", "period_s"}`` of each cycle that a library keeps."""
    path = Path(library) / CYCLES_FILE
    if not path.is_file():
        return []
    import h5py

    rows = []
    try:
        with h5py.File(path, "r") as file:
            _expect_format(file, path)
            for name in file:
                about = _about(file[name])
                members = len(about["members"])
                rows.append({"class": name, "members": members, "period_s": about["period_s"]})
    except (OSError, KeyError, TypeError, ValueError) as problem:
        raise _unreadable(path, problem) from None
    return rows


def read_cycle(library: StrPath, name: str) -> ClassCycle:
    """Return the cycle of a class that a library keeps.

    Raises
    ------
    LibraryError
        If the library keeps none of that name, or the file is damaged.
    """
    import h5py

    from mocapdb.cycles.class_cycle import ClassCycle
    from mocapdb.cycles.cycle import Cycle

    path = Path(library) / CYCLES_FILE
    names = [row["class"] for row in list_cycles(library)]
    if name not in names:
        raise LibraryError(
            f"{path}: expected the cycle of a class out of {', '.join(names) or 'none'}, but got "
            f"{name!r}. Make it: mocapdb cycle {library} --class {name}"
        )
    try:
        with h5py.File(path, "r") as file:
            group = file[name]
            about = _about(group)
            cycle = Cycle(
                skeleton=Skeleton.from_dict(about["skeleton"]),
                columns=group["columns"][:],
                sway=group["sway"][:],
                advance=group["advance"][:],
                turn_rad=about["turn_rad"],
                translations=group["shifts"][:],
                period_s=about["period_s"],
                name=name,
                label=name,
                provenance=tuple(about["provenance"]),
            )
            return ClassCycle(
                cycle,
                group["spread_rad"][:],
                tuple(about["members"]),
                tuple(about["mirrored"]),
                about["left_out"],
            )
    except (OSError, KeyError, TypeError, ValueError, SkeletonError, CycleError) as problem:
        raise _unreadable(path, problem) from None


def write_cycle(library: StrPath, found: ClassCycle) -> Path:
    """Keep the cycle of a class in a library, in place of an earlier one of that class.

    Raises
    ------
    LibraryError
        If the file is damaged, newer than this version, or cannot be written.
    """
    import h5py

    path = Path(library) / CYCLES_FILE
    image = io.BytesIO(path.read_bytes() if path.is_file() else b"")
    image.seek(0)
    try:
        with h5py.File(image, "r+" if path.is_file() else "w") as file:
            _expect_format(file, path)
            file.attrs["format"] = CYCLES_FORMAT
            name = found.cycle.name
            if name in file:
                del file[name]
            _fill(file.create_group(name, track_order=True), found)
    except OSError as problem:
        raise _unreadable(path, problem) from None
    write_whole(path, image.getvalue(), failed=_cannot_write)
    return path


def _fill(group: Any, found: ClassCycle) -> None:
    cycle = found.cycle
    arrays = {
        "columns": cycle.columns,
        "sway": cycle.sway,
        "advance": cycle.advance,
        "shifts": cycle.translations,
        "spread_rad": found.spread_rad,
    }
    for key, values in arrays.items():
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


def _about(group: Any) -> dict[str, Any]:
    about: dict[str, Any] = json.loads(group["about"][:].tobytes())
    return about


def _expect_format(file: Any, path: Path) -> None:
    version = int(file.attrs.get("format", CYCLES_FORMAT))
    if version > CYCLES_FORMAT:
        raise LibraryError(
            f"{path}: expected format {CYCLES_FORMAT} or older, but got {version}. "
            "Install a newer mocapdb."
        )


def _unreadable(path: Path, problem: Exception) -> LibraryError:
    return LibraryError(
        f"{path}: not readable cycles ({problem}). Delete the file; make them anew."
    )


def _cannot_write(path: Path, problem: OSError) -> LibraryError:
    return LibraryError(f"{path}: cannot write ({problem.strerror}).")
