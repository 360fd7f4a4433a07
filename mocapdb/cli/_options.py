"""Arguments and options that several commands have."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from mocapdb.motion.clip import Clip

__all__ = [
    "EVENTS",
    "FRAMES",
    "LIBRARY",
    "PATH",
    "SIZE",
    "Command",
    "as_option",
    "check_representation_file",
    "check_table_and_picture_files",
    "closing_options",
    "facet_options",
    "frames_of",
    "json_option",
    "library_argument",
    "loop_options",
    "original_option",
    "scheduler_option",
    "where_option",
]

Command = TypeVar("Command", bound=Callable[..., Any])

PATH: click.Path = click.Path(path_type=Path)


class _Numbers(click.ParamType):  # type: ignore[type-arg,unused-ignore] # generic since click 8.3
    """Two numbers with something between them."""

    def __init__(
        self, name: str, pattern: str, expected: str, make: Callable[[str, str], object]
    ) -> None:
        self.name = name
        self._pattern = pattern
        self._expected = expected
        self._make = make

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> object:
        if not isinstance(value, str):
            return value
        parts = re.fullmatch(self._pattern, value)
        if not parts:
            self.fail(f"expected {self._expected}, but got {value!r}", param, ctx)
        return self._make(*parts.groups())


def _slice(start: str, end: str) -> slice:
    return slice(int(start) if start else None, int(end) if end else None)


FRAMES = _Numbers("A:B", r"(\d*):(\d*)", "frames such as 100:400", _slice)
"""``A:B``, ``A:`` or ``:B`` as a slice, end-exclusive."""

SIZE = _Numbers("WxH", r"(\d+)x(\d+)", "a size such as 640x480", lambda w, h: (int(w), int(h)))
"""``640x480`` as two numbers."""


def _columns(
    context: click.Context, option: click.Parameter, given: tuple[str, ...]
) -> dict[str, str]:
    """Return what ``--where name=value`` says, each column once."""
    columns: dict[str, str] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise click.BadParameter(f"expected a column and a value, style=old, but got {text!r}")
        if name in columns:
            raise click.BadParameter(f"expected each column once, but got {name!r} twice")
        columns[name] = value
    return columns


where_option = click.option(
    "--where", multiple=True, metavar="COLUMN=VALUE", callback=_columns,
    help="Only clips whose further column of the labels has this value; more conditions after "
    "commas (style=old,take=1), or repeat it.",
)  # fmt: skip


def _range(context: click.Context, option: click.Parameter, given: str | None) -> Any:
    """Return the range that a facet's option says."""
    from mocapdb.errors import LibraryError
    from mocapdb.library.facets import FacetRange, checked_facets

    if given is None:
        return None
    name = str(option.name)
    try:
        return checked_facets({name: FacetRange.of_text(given)})[name]
    except LibraryError as problem:
        raise click.BadParameter(str(problem)) from None


def facet_options(command: Command) -> Command:
    """Add ``--root-speed A:B`` and its like, and ``--flagged``.

    The command gets one ``facets``, a mapping to ranges, and ``flagged``, a bool or None.
    """

    @wraps(command)
    def gathered(*arguments: Any, flagged: str | None, **options: Any) -> Any:
        facets = {name: options.pop(name) for name in FACET_HELP}
        given = {name: ends for name, ends in facets.items() if ends is not None}
        is_flagged = None if flagged is None else flagged == "yes"
        return command(*arguments, facets=given, flagged=is_flagged, **options)

    for option in (
        click.option(
            "--flagged", type=click.Choice(["yes", "no"]),
            help="Only clips that mocapdb clean left flagged faults in, or searched and left none.",
        ),
        *(
            click.option(
                f"--{name.replace('_', '-')}", name, metavar="A:B", callback=_range,
                help=f"Only clips within a range, A: or :B where an end is open: {what}.",
            )
            for name, what in reversed(FACET_HELP.items())
        ),
    ):  # fmt: skip
        gathered = option(gathered)
    return gathered  # type: ignore[return-value]


FACET_HELP = {
    "root_speed": "m/s, mean speed of the hips over the ground",
    "turn": "degrees, change of facing, to the left positive",
    "height": "m, stature of who performs it",
    "duration": "seconds",
    "contacts": "how often a foot is set down",
}
"""What is said of `mocapdb.library.FACETS`, without importing it for every ``--help``."""

as_option = click.option(
    "--as", "representation",
    type=click.Choice(
        [
            "channels", "positions", "aligned", "scaled", "normalised", "smpl", "smplh", "smplx",
            "events",
        ]
    ),
    help="Write the frames in one of O'Kane's representations instead, as .npz or .csv: names, "
    "units and the root's track inside. Or on a SMPL body as AMASS does, as .npz; or events, the "
    "foot strikes and toe-offs, as .csv.",
)  # fmt: skip
original_option = click.option(
    "--original", is_flag=True,
    help="Take the clips of the library as they were captured, also where they were cleaned since.",
)  # fmt: skip
json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")


class _Library(click.ParamType):  # type: ignore[type-arg,unused-ignore] # as above
    """A library's folder, or its address as a text: a path would lose one of its slashes."""

    name = "library"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> object:
        return value if not isinstance(value, str) or "://" in value else Path(value)


LIBRARY = _Library()

scheduler_option = click.option(
    "--scheduler", metavar="ADDRESS",
    help="Dask scheduler to work on instead, such as tcp://10.0.0.1:8786; its workers must see the "
    "same files.",
)  # fmt: skip
library_argument = click.argument("library", type=LIBRARY)


def check_table_and_picture_files(
    tables: Mapping[str, Path | None], pictures: Mapping[str, Path | None]
) -> None:
    """Refuse files that are no tables or pictures by their suffix, or the same, as wrong usage.

    Each is named by its option.
    """
    taken: dict[Path, str] = {}
    for files, suffix in ((tables, ".csv"), (pictures, ".png")):
        for option, path in files.items():
            if path is None:
                continue
            if path.suffix.lower() != suffix:
                raise click.UsageError(f"Expected a {suffix} with {option}, but got {path.name!r}.")
            other = taken.setdefault(path.resolve(), option)
            if other != option:
                raise click.UsageError(
                    f"Expected a file for {other} and another one for {option}, but both are "
                    f"{str(path)!r}."
                )


def frames_of(clip: Clip, frames: slice | None) -> Clip:
    """Return a range of a clip's frames; one that the clip does not have is an error.

    Raises
    ------
    ClipError
        If the range is empty, or ends after the clip.
    """
    if frames is None:
        return clip
    start, end = frames.start or 0, len(clip) if frames.stop is None else frames.stop
    if not 0 <= start < end <= len(clip):
        from mocapdb.errors import ClipError

        raise ClipError(
            f"Expected a range within the {len(clip)} frames of {clip.name or 'the clip'!r}, but "
            f"got {start}:{end}."
        )
    return clip[start:end]


EVENTS = "events"
"""With ``--as``: no representation of the frames, but a table of foot strikes and toe-offs."""


def check_representation_file(path: Path, representation: str) -> None:
    """Refuse a file that holds no representation, as wrong usage."""
    from mocapdb.io.representation_files import REPRESENTATION_SUFFIXES

    if representation == EVENTS and path.suffix.lower() != ".csv":
        raise click.UsageError(f"Expected a .csv with --as events, but got {path.name!r}.")
    if path.suffix.lower() not in REPRESENTATION_SUFFIXES:
        raise click.UsageError(f"Expected a .npz or a .csv with --as, but got {path.name!r}.")


def closing_options(command: Command) -> Command:
    """Add what is said of the frames of a loop: ``--length`` and ``--closed``."""
    for option in (
        click.option(
            "--closed",
            is_flag=True,
            help="Add a frame that closes the loop: the first again, with the root carried on.",
        ),
        click.option(
            "--length",
            type=int,
            metavar="FRAMES",
            help="So many frames a lap, ten or more; how far that is off the tempo is told.",
        ),
    ):
        command = option(command)
    return command


def loop_options(command: Command) -> Command:
    """Add what is said of a loop that is made of a cycle: ``--laps``, the root and the feet."""
    for option in (
        click.option("--loose-feet", is_flag=True, help="Do not hold feet where they rest."),
        click.option("--in-place", is_flag=True, help="Leave out the steady advance of the root."),
        click.option(
            "--laps",
            type=click.IntRange(1),
            default=1,
            show_default=True,
            help="How many laps of the cycle to write.",
        ),
    ):
        command = option(command)
    return command
