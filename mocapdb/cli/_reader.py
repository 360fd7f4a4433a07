"""Reading the files that a command is given, as its options and ``mocapdb.toml`` say."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._options import PATH, Command

if TYPE_CHECKING:
    from mocapdb.io.folder_settings import FolderSettings
    from mocapdb.io.reading import ReadOptions
    from mocapdb.motion.clip import Clip

__all__ = ["Reader", "out_fps_option", "reading_options"]

OPTIONS = (
    click.option("--unit-m", type=float, help="Length of one unit of the file, in metres."),
    click.option(
        "--up", type=click.Choice(["y", "z", "x", "-x", "-y", "-z"]),
        help="Direction that is up in the file.",
    ),
    click.option("--fps", type=float, help="Frame rate of the file."),
    click.option("--skeleton", type=PATH, help="ASF of an AMC (else found)."),
    click.option(
        "--joint-map", type=PATH, metavar="FILE.toml",
        help="Which joints the body's are, such as left_knee = \"LeftLeg\".",
    ),
    click.option("--strict", is_flag=True, help="Mend nothing: refuse files that need it."),
)  # fmt: skip


class Reader:
    """Reads files as the user says, else as the ``mocapdb.toml`` above them says.

    Parameters
    ----------
    said : ReadOptions
        What the command line says of every file that is read.
    """

    def __init__(self, said: ReadOptions) -> None:
        self.said = said

    @cached_property
    def _folders(self) -> FolderSettings:
        from mocapdb.io.folder_settings import FolderSettings

        return FolderSettings()

    def read(self, path: Path, *, drop_tpose: bool = False) -> Clip:
        """Read a clip; what it warns of is printed on stderr."""
        from mocapdb.io import read_with_settings

        clip = read_with_settings(path, self.said, drop_tpose=drop_tpose, folders=self._folders)
        for step in clip.provenance:
            if step.startswith("warning: "):
                click.echo(f"warning: {path}: {step.removeprefix('warning: ')}", err=True)
        return clip

    def read_one_of_many(self, path: Path) -> Clip:
        """Read a clip of a folder: a skeleton is for those that need one."""
        from dataclasses import replace

        own = self if path.suffix.lower() == ".amc" else Reader(replace(self.said, skeleton=None))
        return own.read(path)

    def expect_files(self, what: str) -> None:
        """Refuse options of files where none is read.

        Raises
        ------
        UsageError
        """
        if not self.said.says_nothing:
            hint = " The rate of the result is --out-fps." if _has_out_fps() else ""
            raise click.UsageError(
                "Expected --unit-m, --up, --fps, --skeleton, --joint-map and --strict with a "
                f"file that is read, but {what}.{hint}"
            )

    def note_out_fps(self, out_fps: float | None) -> None:
        """Say on stderr what ``--fps`` means, in commands in which it meant something else once."""
        if self.said.fps is not None and out_fps is None:
            click.echo(
                "note: --fps is the rate of the file that is read; of the result it is --out-fps.",
                err=True,
            )


def reading_options(command: Command) -> Command:
    """Add what may be said of files that are read; the command gets it as ``reader``."""

    @wraps(command)
    def reading(
        *args: Any,
        unit_m: float | None,
        up: Any,
        fps: float | None,
        skeleton: Path | None,
        joint_map: Path | None,
        strict: bool,
        **rest: Any,
    ) -> Any:
        from mocapdb.io.reading import ReadOptions, read_joint_map

        joints = None if joint_map is None else read_joint_map(joint_map)
        said = ReadOptions(unit_m, up, fps, skeleton, joints, strict)
        return command(*args, reader=Reader(said), **rest)

    for option in reversed(OPTIONS):
        reading = option(reading)
    return reading  # type: ignore[return-value] # click calls it by the names of its options


def out_fps_option(help_text: str, kind: Any = float) -> Callable[[Command], Command]:
    """Return the option of a rate that is written."""
    return click.option("--out-fps", type=kind, help=help_text)


def _has_out_fps() -> bool:
    context = click.get_current_context()
    return any(parameter.name == "out_fps" for parameter in context.command.params)
