"""The ``mocapdb`` command: one module for each subcommand, loaded when it is called.

================  =================================================
`demo`            a small synthetic corpus, and every job on it
`fetch`           CMU's clips from the net
`build`           a library from a folder of clips
`index`           what queries and classes need, added to a library
`info`, `ls`      what a library holds
`verify`          every checksum and every clip of a library
`recover`         a damaged library brought back
`compact`         the space of replaced clips, given back
`query`           motion like that of a clip
`classify`        what a clip is
`clean`           faults found and repaired
`fill`            a whole body from a few joints
`cycle`, `blend`  cycles, and what lies between them
`segment`         a long take cut into motions
`gait`            strides, events and joint angles
`edit`            a clip cut, joined, mirrored, placed, resampled
`export`          a clip of a library as a file
`convert`         a clip in another format
`render`          clips in motion
`view`, `report`  a library in a browser, and on one page
`reproduce`       the papers' tables
================  =================================================

What they share:

==================  =======================================================
`_options`          arguments and options that several commands have
`_reader`           reading files as options and ``mocapdb.toml`` say
`_csv`              ``--csv``: their JSON as a table for spreadsheets
`_console`          JSON and tables on stdout, progress on stderr
`_named_clip`       a clip as an argument: a file, or a name in the library
`_assumed`          what a build took for granted
`_context`          what ``clean --context`` names, read once
`_cleaned_library`  revisions made and taken back, and what is said of them
`_cycle_clips`      the cycles of one clip, of its ranges, or of many clips
`_cycle_classes`    the cycle of a class
`_cycle_options`    how ``cycle`` searches
`_cycle_output`     loops as files
`_cycle_report`     the pictures of ``cycle --report``
`_kernels`          compiling ahead, for ``demo``
==================  =======================================================
"""

from __future__ import annotations

import signal
import sys
from importlib import import_module
from typing import Any

import click

from mocapdb import __version__
from mocapdb.base.files import keeping_inputs
from mocapdb.base.interrupts import no_interrupt_lost
from mocapdb.base.kernels import before_compiling
from mocapdb.cli._console import shown
from mocapdb.errors import MocapdbError

__all__ = ["cli", "main"]

COMMANDS = {
    "demo": "Make a small synthetic corpus and do every job on it.",
    "fetch": "Download clips of the CMU database.",
    "build": "Build a compressed library from a folder of clips.",
    "info": "Show what a library, or one clip of it, holds and costs.",
    "ls": "List the clips of a library.",
    "verify": "Check every checksum of a library and decode every clip.",
    "recover": "Bring a damaged library back from its shards and its corpus.",
    "compact": "Give the space of replaced clips back, and join small files.",
    "clean": "Find the faults of a capture and repair only those.",
    "fill": "Make a whole body from a few joints, by similar motion.",
    "cycle": "Find the cycle of clips, or of a class of a library.",
    "blend": "Blend cycles, or go from one over into another.",
    "segment": "Cut a long take into motions, with no labels.",
    "gait": "Measure strides, foot events and joint angles.",
    "query": "Find the motion of a clip in a library.",
    "classify": "Say what a clip is, by the classes of a library.",
    "index": "Make a library that was built without features ready for queries.",
    "export": "Decode a clip of a library into a file, or draw it in motion.",
    "edit": "Cut, join, mirror, place and resample a clip.",
    "convert": "Convert a clip to another format, or draw it in motion.",
    "render": "Draw clips in motion: GIF, MP4 or a page that plays them.",
    "view": "Look at a library in a browser.",
    "report": "Show a library on one page that can be mailed.",
    "reproduce": "Compute the papers' tables beside their figures.",
}


class _Group(click.Group):
    """Loads a subcommand's module when it is called, and prints errors as errors."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = getattr(import_module(f"mocapdb.cli.{cmd_name}"), cmd_name)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with no_interrupt_lost(), keeping_inputs():
                return super().invoke(ctx)
        except click.NoSuchOption as problem:
            if problem.option_name.startswith("--"):
                raise
            raise click.UsageError(
                f"{problem.format_message()} What begins with a dash and is no option goes after "
                "'--'.", problem.ctx,
            ) from None  # fmt: skip
        except (click.ClickException, click.Abort, click.exceptions.Exit, BrokenPipeError):
            raise  # click knows what to do with them
        except KeyboardInterrupt:
            click.echo("Interrupted: nothing is left half written.", err=True)
            ctx.exit(130)
        except Exception as problem:
            if ctx.params.get("debug"):
                raise
            if isinstance(problem, MocapdbError):
                raise _Failed(str(problem)) from None
            if isinstance(problem, OSError):
                where = f"{problem.filename}: " if problem.filename else ""
                raise _Failed(f"{where}{problem.strerror or problem}") from None
            kind = type(problem).__name__
            raise _Failed(
                f"a fault of mocapdb's own ({kind}: {problem}). "
                "Run 'mocapdb --debug ...' and report what it prints."
            ) from None


class _Failed(click.ClickException):
    """An error in what the command was given or met: exit 1, one line on stderr."""

    exit_code = 1

    def show(self, file: Any = None) -> None:
        click.echo(f"mocapdb: {shown(_with_addresses(self.format_message()))}", err=True)


def _with_addresses(message: str) -> str:
    """Return a message in which libraries in object storage are called by their addresses."""
    addresses = sys.modules.get("mocapdb.library.addresses")
    return message if addresses is None else str(addresses.with_addresses(message))


def _say_version(context: click.Context, option: click.Parameter, given: bool) -> None:
    """Print the version, and the formats of libraries that it writes, when asked."""
    if not given:
        return
    from mocapdb.library.database import CATALOGUE_FORMAT
    from mocapdb.library.shards import SHARD_FORMAT

    click.echo(f"mocapdb, version {__version__}")
    click.echo(f"libraries: catalogue format {CATALOGUE_FORMAT}, shard format {SHARD_FORMAT}")
    context.exit()


@click.group(
    cls=_Group,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="'mocapdb COMMAND --help' shows a command's options and an example.",
)
@click.option("--debug", is_flag=True, help="Show the traceback of an error.")
@click.option(
    "--version", is_flag=True, is_eager=True, expose_value=False, callback=_say_version,
    help="Show the version, and the format of the libraries that it writes.",
)  # fmt: skip
def cli(debug: bool) -> None:
    """Turn folders of motion-capture files into compressed, searchable libraries."""


def _say_that_it_takes_a_while() -> None:
    click.echo("mocapdb: compiling, once after an installation: 5 to 30 seconds.", err=True)


def main() -> None:
    """Run the command line."""
    before_compiling(_say_that_it_takes_a_while)
    try:
        cli(prog_name="mocapdb")
    finally:
        # what was to be done is done and said; now Ctrl-C could only hit Python while it ends
        signal.signal(signal.SIGINT, signal.SIG_IGN)
