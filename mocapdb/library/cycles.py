"""Cycles of classes that a library keeps: ``cycles.h5`` beside its shards.

The file is small and rewritten whole under another name, so that it is there as it was or as it is
to be.
"""

from __future__ import annotations

import io
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mocapdb._typing import StrPath
from mocapdb.cycles.classes import ClassCycle
from mocapdb.cycles.cycle import Cycle
from mocapdb.errors import CycleError, LibraryError, NoPeriodError, SkeletonError
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.library.library import Library

__all__ = [
    "CYCLES_FORMAT",
    "CYCLES_NAME",
    "class_cycle",
    "list_cycles",
    "read_cycle",
    "write_cycle",
]

CYCLES_NAME = "cycles.h5"
CYCLES_FORMAT = 1
LEAST_CONFIDENCE = 0.5


def write_cycle(library: StrPath, found: ClassCycle) -> Path:
    """Keep the cycle of a class in a library, in place of an earlier one of that class.

    Raises
    ------
    LibraryError
        If the file is damaged, newer than this version, or cannot be written.
    """
    import h5py

    path = Path(library) / CYCLES_NAME
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
    partial = path.with_name(f".{path.name}.partial")
    try:
        with partial.open("wb") as out:
            out.write(image.getvalue())
            out.flush()
            os.fsync(out.fileno())
        partial.replace(path)
    except OSError as problem:
        raise LibraryError(f"{path}: cannot write ({problem.strerror}).") from None
    finally:
        partial.unlink(missing_ok=True)
    return path


def read_cycle(library: StrPath, name: str) -> ClassCycle:
    """Return the cycle of a class that a library keeps.

    Raises
    ------
    LibraryError
        If the library keeps none of that name, or the file is damaged.
    """
    import h5py

    path = Path(library) / CYCLES_NAME
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
                shifts=group["shifts"][:],
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


def class_cycle(library: Library, label: str, *, most_clips: int = 8) -> ClassCycle:
    """Return the cycle of a class that a library keeps, or else the mean over some of its clips.

    Parameters
    ----------
    library : Library
    label : str
    most_clips : int
        Clips to look at, spread evenly, where none is kept. What is found is not kept either:
        ``mocapdb cycle LIB --class C`` does that, from all clips.

    Raises
    ------
    NoPeriodError
        If in none of the clips a motion repeats clearly.
    """
    from mocapdb.cycles.classes import average_cycles
    from mocapdb.cycles.extract import extract_cycle

    if label in {row["class"] for row in list_cycles(library.path)}:
        return read_cycle(library.path, label)
    records = library.records(label=label)
    stride = max(1, len(records) / most_clips)
    chosen = [records[int(i * stride)] for i in range(min(most_clips, len(records)))]
    cycles = []
    for record in chosen:
        try:
            found = extract_cycle(library.clip(record.name))
        except NoPeriodError:
            continue  # the others may repeat
        if found.confidence >= LEAST_CONFIDENCE:
            cycles.append(found.cycle)
    if not cycles:
        raise NoPeriodError(
            f"Expected clips of class {label!r} in which a motion repeats, but none of the "
            f"{len(chosen)} that were looked at does."
        )
    return average_cycles(cycles, label)


def list_cycles(library: StrPath) -> list[dict[str, Any]]:
    """Return ``{"class", "members", "period_s"}`` of each cycle that a library keeps."""
    import h5py

    path = Path(library) / CYCLES_NAME
    if not path.is_file():
        return []
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


def _fill(group: Any, found: ClassCycle) -> None:
    cycle = found.cycle
    arrays = {
        "columns": cycle.columns,
        "sway": cycle.sway,
        "advance": cycle.advance,
        "shifts": cycle.shifts,
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
