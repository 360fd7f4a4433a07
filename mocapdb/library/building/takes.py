"""The clips of a file that holds several takes: what each is called, and what it replaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from mocapdb.io.conventions import unique
from mocapdb.library.building.encode_files import Encoded
from mocapdb.library.building.known_files import KnownFiles
from mocapdb.library.building.plan import subject_columns
from mocapdb.library.naming import source_of

__all__ = ["placed"]


def placed(clips: Sequence[Encoded], known: KnownFiles, names: set[str]) -> Iterator[Encoded]:
    """Yield the clips of one file as they come into the library.

    Parameters
    ----------
    clips : sequence of Encoded
        With the take of each, where there are several.
    known : KnownFiles
    names : set of str
        Names of clips that are there or to be; new ones are added.

    Notes
    -----
    A take keeps its row and its name. Where a file held one motion before, its first take takes the
    place of that, and the other way round. A take that is gone keeps its clip, as a file does.
    """
    for number, clip in enumerate(clips):
        task = clip.task
        row, name = task.takes.get(task.take, (None, ""))
        if row is None and number == 0:
            row = task.replaces
            if row is None and len(clips) == 1 and task.takes:
                row, _ = next(iter(task.takes.values()))
        if len(clips) == 1:
            yield replace(clip, task=replace(task, take="", replaces=row))
            continue
        fact = known.of(source_of(task.relative, task.take))
        if not name:
            name = unique(f"{task.name}_{task.take}", names)
            names.add(name)
        own = replace(
            task,
            name=name,
            label=fact.label,
            description=fact.description,
            columns=fact.columns,
            replaces=row,
            **subject_columns(task.relative, fact),
        )
        yield replace(clip, task=own)
