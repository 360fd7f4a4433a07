"""Reading the files that a command is given, as its options and ``mocapdb.toml`` say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._options import PATH, Command

if TYPE_CHECKING:
    from mocapdb.io.folder_settings import FolderSettings
    from mocapdb.io.reading import ReadOptions
    from mocapdb.motion.clip import Clip

__all__ = ["Reader", "out_fps_option", "reading_options", "warnings_of"]

OPTIONS = (
    click.option("--unit-m", type=float, help="Length of one unit of the file, in metres."),
    click.option(
        "--up", type=click.Choice(["y", "z", "x", "-x", "-y", "-z"]),
        help="Direction that is up in the file.",
    ),
    click.option("--fps", type=float, help="Frame rate of the file."),
    click.option(
        "--skeleton", type=PATH, help="ASF of an AMC (else found); body model (.npz) of AMASS."
    ),
    click.option(
        "--joint-map", type=PATH, metavar="FILE.toml",
        help="Which joints the body's are, such as left_knee = \"LeftLeg\".",
    ),
    click.option("--take", metavar="NAME", help="Which motion of a file that holds several."),
    click.option(
        "--blender", type=PATH,
        help="The Blender (or a Python with bpy) that reads and writes FBX, and reads Collada and "
        "USD; else $MOCAPDB_BLENDER, 'blender' or bpy.",
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
        clip = self.read_silently(path, drop_tpose=drop_tpose)
        for warning in warnings_of(clip, path):
            click.echo(warning, err=True)
        return clip

    def read_silently(self, path: Path, *, drop_tpose: bool = False) -> Clip:
        """Read a clip; see `warnings_of`."""
        from mocapdb.io import read_with_settings

        return read_with_settings(path, self.said, drop_tpose=drop_tpose, folders=self._folders)

    def read_one_of_many(self, path: Path, *, silently: bool = False) -> Clip:
        """Read a clip of a folder: a skeleton is for those that need one."""
        from dataclasses import replace

        own = self if path.suffix.lower() == ".amc" else Reader(replace(self.said, skeleton=None))
        return own.read_silently(path) if silently else own.read(path)

    def clips_in(self, folder: Path) -> list[Path]:
        """Return the motion files of a folder; say on stderr what is left out for want of Blender.

        Raises
        ------
        CorpusError
            If the folder has none.
        """
        from mocapdb.library.building.corpus_listing import CorpusListing

        listing = CorpusListing(folder, blender=self.said.blender)
        paths = [folder / file for file in listing.files]
        for left_out in listing.warnings:
            click.echo(f"warning: {folder}: {left_out}", err=True)
        return paths

    def expect_files(self, what: str) -> None:
        """Refuse options of files where none is read.

        Raises
        ------
        UsageError
        """
        if not replace(self.said, blender=None).says_nothing:  # it also writes
            hint = " The rate of the result is --out-fps." if _has_out_fps() else ""
            raise click.UsageError(
                "Expected --unit-m, --up, --fps, --skeleton, --joint-map, --take and --strict with "
                f"a file that is read, but {what}.{hint}"
            )

    def note_out_fps(self, out_fps: float | None) -> None:
        """Say on stderr what ``--fps`` means, in commands in which it meant something else once."""
        if self.said.fps is not None and out_fps is None:
            click.echo(
                "note: --fps is the rate of the file that is read; of the result it is --out-fps.",
                err=True,
            )


def warnings_of(clip: Clip, path: Path | str) -> list[str]:
    """Return what reading a file has warned of, a line each."""
    return [
        f"warning: {path}: {step.removeprefix('warning: ')}"
        for step in clip.provenance
        if step.startswith("warning: ")
    ]


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
        take: str | None,
        blender: Path | None,
        strict: bool,
        **rest: Any,
    ) -> Any:
        from mocapdb.io.reading import ReadOptions, read_joint_map

        joints = None if joint_map is None else read_joint_map(joint_map)
        said = ReadOptions(unit_m, up, fps, skeleton, joints, strict, take, blender)
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
