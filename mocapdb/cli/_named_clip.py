"""A clip as an argument: a motion file, or the name of a clip of the library."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from mocapdb.cli._reader import Reader
    from mocapdb.library import Library
    from mocapdb.motion.clip import Clip

__all__ = ["find_clip", "say_unsearchable"]


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
            f"Expected a motion file or a clip of {library.path}, but {name!r} is neither."
        ) from None
    return library.clip(record.name), record.name


def say_unsearchable(library: Library) -> int:
    """Say on stderr how many clips a search did not look at, and return their number."""
    count = len(library.catalogue.unsearchable())
    if count:
        clips = "1 clip was" if count == 1 else f"{count} clips were"
        click.echo(
            f"{clips} not looked at, see: mocapdb ls {library.path} --unsearchable", err=True
        )
    return count
