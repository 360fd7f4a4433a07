"""The cycle of a class: the kept one, or the mean over the cycles of the class's clips."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mocapdb.base.progress import Progress, silent
from mocapdb.cycles.class_cycle import ClassCycle, MirrorMembers, average_cycles
from mocapdb.cycles.cycle import Cycle
from mocapdb.cycles.extract import Settings, extract_cycle
from mocapdb.cycles.synthesis.loop import calmed
from mocapdb.cycles.tuning import DOUBTFUL
from mocapdb.errors import LibraryError, NoPeriodError
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.cycles_file import list_cycles, read_cycle
from mocapdb.library.library import Library
from mocapdb.library.searching.learned_classes import NOT_LEARNED
from mocapdb.library.tuning import CYCLE_CLIPS
from mocapdb.motion.body import Scene, part_from_scene
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton

__all__ = ["MadeCycle", "class_cycle", "class_scene", "make_cycle"]


class MadeCycle(NamedTuple):
    """The cycle of a class, and what its loops should be like.

    Attributes
    ----------
    mean : ClassCycle
    fps : float, frames per second
        The members' median.
    most_jerk : float
        The members' median, on the body of the cycle; see `loop.make_loop`.
    scene : Scene, optional
        What the body of the cycle was parted from, to be put back into its loops.
    clips : tuple of ClipRecord
        The members'.
    cleaned : dict of str to int
        Members that were repaired first, and how many spans of each.
    unsearched : tuple of str
        Members that nobody has searched for faults.
    """

    mean: ClassCycle
    fps: float
    most_jerk: float
    scene: Scene | None
    clips: tuple[ClipRecord, ...]
    cleaned: dict[str, int]
    unsearched: tuple[str, ...]


def make_cycle(
    library: Library,
    label: str,
    settings: Settings | None = None,
    *,
    most_clips: int | None = None,
    where: Mapping[str, str] | None = None,
    mirror_members: MirrorMembers = "never",
    clean: bool = False,
    progress: Progress = silent,
) -> MadeCycle:
    """Extract the cycles of a class's clips and average them.

    Each cycle is damped first until it jerks no more than its clip, as loops are. Clips in which
    nothing repeats, and those with a confidence under one half, are left out. So
    are clips in which a fault is flagged that was not repaired, or is not to be
    (`Library.original`).

    Parameters
    ----------
    library : Library
    label : str
    settings : Settings, optional
    most_clips : int, optional
        Look at so many clips at most, spread evenly.
    where : mapping of str to str, optional
        Only clips whose further columns of the labels have these values.
    mirror_members : {"never", "auto"}
        See `average_cycles`.
    clean : bool
        Whether clips that nobody has searched for faults are searched and repaired first.
    progress : callable, optional

    Raises
    ------
    LibraryError
        If there is no such class.
    NoPeriodError
        If nothing repeats in any of its clips, or they have nothing in common.
    """
    if label in NOT_LEARNED:
        raise NoPeriodError(
            f"Expected a class of clips that do the same, but {label!r} names clips of any kind."
        )
    records = library.records(label=label, where=where)
    if not records and label in library.classes():
        raise LibraryError(f"{library.path}: no clip of class {label!r} fits {dict(where or {})}.")
    if not records and not library.classes():
        raise LibraryError(
            f"{library.path}: expected the class {label!r}, but the library has no classes. Build "
            "it with --labels, or in folders named by class."
        )
    if not records:
        known = ", ".join(sorted(library.classes()))
        raise LibraryError(f"{library.path}: expected a class out of {known}, but got {label!r}.")
    if most_clips is not None and most_clips < len(records):
        records = [records[i * len(records) // most_clips] for i in range(most_clips)]
    cycles: list[Cycle] = []
    people: list[str] = []
    jerks: list[float] = []
    rates: list[float] = []
    scenes: dict[Skeleton, Scene | None] = {}
    left_out: dict[str, str] = {}
    cleaned: dict[str, int] = {}
    unsearched: list[str] = []
    for done, record in enumerate(records, start=1):
        try:
            source = _source(library, record, clean)
            if source.flagged:
                left_out[record.name] = source.flagged
                continue
            found = extract_cycle(source.clip, settings)
        except NoPeriodError as problem:
            left_out[record.name] = str(problem).removeprefix(f"{record.name}: ")
        else:
            if found.confidence < DOUBTFUL:
                left_out[record.name] = f"doubtful: confidence {found.confidence:.2f}"
            else:
                if source.repaired:
                    cleaned[record.name] = source.repaired
                if not source.is_searched:
                    unsearched.append(record.name)
                people.append(record.performer)
                cycles.append(calmed(found.cycle, found.clip.fps, found.source_jerk))
                jerks.append(found.source_jerk / found.clip.skeleton.height)
                rates.append(record.fps)
                scenes.setdefault(found.cycle.skeleton, found.scene)
        finally:
            progress(done, len(records), record.name)
    if not cycles:
        raise NoPeriodError(
            f"Expected clips of class {label!r} in which a motion repeats, but none of "
            f"{len(records)} is of use: {next(iter(left_out.values()))}"
        )
    mean = average_cycles(cycles, label, mirror_members=mirror_members, people=people)
    mean = replace(mean, left_out=left_out | (mean.left_out or {}))
    most_jerk = float(np.median(jerks)) * mean.cycle.skeleton.height
    members = set(mean.members)
    return MadeCycle(
        mean,
        float(np.median(rates)),
        most_jerk,
        scenes.get(mean.cycle.skeleton),
        tuple(record for record in records if record.name in members),
        {name: n for name, n in cleaned.items() if name in members},
        tuple(name for name in unsearched if name in members),
    )


class _Source(NamedTuple):
    """A clip that a cycle may be extracted from."""

    clip: Clip
    flagged: str  # why it may not, empty where it may
    repaired: int
    is_searched: bool


def _source(library: Library, record: ClipRecord, clean: bool) -> _Source:
    """Return a clip of a class, cleaned where that is known or asked for."""
    revision = library.revision(record)
    clip = library.decode(record)
    if revision is not None:
        left = len(revision.spans) if library.original else len(revision.left)
        return _Source(clip, _flagged(left), len(revision.spans) - left, True)
    if not clean:
        return _Source(clip, "", 0, False)
    from mocapdb.cleaning import clean_clip

    found = clean_clip(clip)
    n_repaired = sum(repair.repaired for repair in found.repairs)
    return _Source(found.clip, _flagged(len(found.repairs) - n_repaired), n_repaired, True)


def _flagged(n_spans: int) -> str:
    """Return why a clip is left out in which so many spans are wrong."""
    spans = "1 span is" if n_spans == 1 else f"{n_spans} spans are"
    return f"flagged: {spans} wrong and not repaired" if n_spans else ""


def class_cycle(library: Library, label: str, *, most_clips: int = CYCLE_CLIPS) -> ClassCycle:
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
    if not library.original and label in {row["class"] for row in list_cycles(library.path)}:
        return read_cycle(library.path, label)
    return make_cycle(library, label, most_clips=most_clips).mean


def class_scene(library: Library, mean: ClassCycle) -> Scene | None:
    """Return what the body of a class's cycle was parted from: that of the member it is of."""
    for name in mean.members:
        try:
            record = library.record(name)
        except LibraryError:
            continue  # it has left the library since
        body, scene = part_from_scene(library.decode(record))
        if body.skeleton == mean.cycle.skeleton:
            return scene
    return None
