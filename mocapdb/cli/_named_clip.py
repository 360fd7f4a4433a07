"""A clip as an argument: a motion file, or the name of a clip of the library."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from mocapdb.cli._reader import Reader
    from mocapdb.library import Library
    from mocapdb.motion.clip import Clip

__all__ = [
    "find_clip",
    "say_not_looked_at",
    "say_unknown_subjects",
    "say_unmeasured",
    "say_unsearchable",
]


def find_clip(library: Library, name: str, reader: Reader) -> tuple[Clip, str | None]:
    """Return a clip from a file, or of the library and then its name there."""
    from mocapdb.errors import ClipError, UnknownClipError

    if Path(name).is_file():
        return reader.read(Path(name)), None
    try:
        record = library.record(name)
    except UnknownClipError as problem:
        if problem.candidates:
            raise
        raise ClipError(
            f"Expected a motion file or a clip of {library.place}, but {name!r} is neither. Its "
            f"clips: mocapdb ls {quote(str(library.place))}"
        ) from None
    return library.clip(record.name), record.name


def say_unsearchable(library: Library) -> int:
    """Say on stderr how many clips a search did not look at, and return their number."""
    count = len(library.catalogue.unsearchable())
    say_not_looked_at(library.place, count)
    return count


def say_not_looked_at(place: str, count: int) -> None:
    """Say on stderr how many clips of a library at a place a search did not look at."""
    if count:
        clips = "1 clip was" if count == 1 else f"{count} clips were"
        click.echo(
            f"{clips} not looked at, see: mocapdb ls {quote(str(place))} --unsearchable", err=True
        )


def say_unmeasured(library: Library, facets: Collection[str], flagged: bool | None) -> None:
    """Say on stderr how many clips are left out because nobody knows whether they fit."""
    from mocapdb.library import FACETS

    catalogue = library.catalogue
    place = quote(str(library.place))
    if any(FACETS[name].measured for name in facets):
        not_yet, never = catalogue.unmeasured()
        if never:
            why = "too short, or no body with two feet"
            click.echo(f"{_are(never)} left out, cannot be measured: {why}", err=True)
        _say_left_out(not_yet, "measured", f"index {place}")
    if flagged is not None:
        unsearched = catalogue.n_clips() - len(catalogue.revisions())
        _say_left_out(unsearched, "searched for faults", f"clean {place} --apply")


def _say_left_out(count: int, what: str, command: str) -> None:
    if count:
        click.echo(f"{_are(count)} left out, not {what} yet: mocapdb {command}", err=True)


def _are(count: int) -> str:
    return "1 clip is" if count == 1 else f"{count} clips are"


def say_unknown_subjects(library: Library, subjects: Sequence[str]) -> None:
    """Say on stderr which of the subjects to leave out nobody is."""
    for subject in subjects:
        missing = library.catalogue.missing_value({"subject": subject})
        if missing is not None:
            click.echo(f"note: --not-subject leaves nobody out: {missing}", err=True)
