"""Cycles of classes: made from a library's clips, and kept in ``cycles.h5`` beside its shards.

The file is small and rewritten whole under another name, so that it is there as it was or as it is
to be.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.cycles.class_cycle import ClassCycle, average_cycles
from mocapdb.cycles.cycle import Cycle
from mocapdb.cycles.extract import Settings, extract_cycle
from mocapdb.cycles.tuning import DOUBTFUL
from mocapdb.errors import CycleError, LibraryError, NoPeriodError, SkeletonError
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from mocapdb.library.library import Library

__all__ = [
    "CYCLES_FORMAT",
    "CYCLES_NAME",
    "MadeCycle",
    "class_cycle",
    "list_cycles",
    "make_cycle",
    "read_cycle",
    "write_cycle",
]

CYCLES_NAME = "cycles.h5"
CYCLES_FORMAT = 1
Progress = Callable[[int, int, str], None]


class MadeCycle(NamedTuple):
    """The cycle of a class, and what its loops should be like.

    Attributes
    ----------
    mean : ClassCycle
    fps : float, frames per second
        The members' median.
    most_jerk : float
        The members' median, on the body of the cycle; see `loop.make_loop`.
    """

    mean: ClassCycle
    fps: float
    most_jerk: float


def make_cycle(
    library: Library,
    label: str,
    settings: Settings | None = None,
    *,
    most_clips: int | None = None,
    progress: Progress | None = None,
) -> MadeCycle:
    """Extract the cycles of a class's clips and average them.

    Clips in which nothing repeats, and those with a confidence under one half, are left out.

    Parameters
    ----------
    library : Library
    label : str
    settings : Settings, optional
    most_clips : int, optional
        Look at so many clips at most, spread evenly.
    progress : callable, optional
        Called with clips done, clips in all, and the clip's name.

    Raises
    ------
    LibraryError
        If there is no such class.
    NoPeriodError
        If nothing repeats in any of its clips.
    """
    records = library.records(label=label)
    if not records:
        known = ", ".join(sorted(library.classes())) or "none"
        raise LibraryError(f"{library.path}: expected a class out of {known}, but got {label!r}.")
    if most_clips is not None and most_clips < len(records):
        records = [records[i * len(records) // most_clips] for i in range(most_clips)]
    cycles: list[Cycle] = []
    jerks: list[float] = []
    rates: list[float] = []
    left_out: dict[str, str] = {}
    for done, record in enumerate(records, start=1):
        try:
            found = extract_cycle(library.clip(record.name), settings)
        except NoPeriodError as problem:
            left_out[record.name] = str(problem)
        else:
            if found.confidence < DOUBTFUL:
                left_out[record.name] = f"doubtful: confidence {found.confidence:.2f}"
            else:
                cycles.append(found.cycle)
                jerks.append(found.source_jerk / found.clip.skeleton.height)
                rates.append(record.fps)
        if progress is not None:
            progress(done, len(records), record.name)
    if not cycles:
        raise NoPeriodError(
            f"Expected clips of class {label!r} in which a motion repeats, but none of "
            f"{len(records)} does: {next(iter(left_out.values()))}"
        )
    mean = average_cycles(cycles, label)
    mean = replace(mean, left_out=left_out | (mean.left_out or {}))
    most_jerk = float(np.median(jerks)) * mean.cycle.skeleton.height
    return MadeCycle(mean, float(np.median(rates)), most_jerk)


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
    LibraryError
        If there is no such class.
    NoPeriodError
        If in none of the clips a motion repeats clearly.
    """
    if label in {row["class"] for row in list_cycles(library.path)}:
        return read_cycle(library.path, label)
    return make_cycle(library, label, most_clips=most_clips).mean


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
