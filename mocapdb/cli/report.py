"""``mocapdb report``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import counted, emit_json, megabytes, progress_bar
from mocapdb.cli._options import PATH, json_option, library_argument, original_option
from mocapdb.report.tuning import FAULT_SECONDS


@click.command()
@library_argument
@click.option(
    "-o", "--output", default="report.html", show_default=True, type=PATH,
    help="Page to write: one file that can be mailed and asks for nothing from outside.",
)  # fmt: skip
@click.option(
    "--seconds", default=FAULT_SECONDS, show_default=True, type=click.FloatRange(0),
    help="How much motion to search for faults.",
)  # fmt: skip
@original_option
@json_option
def report(library: Path, output: Path, seconds: float, original: bool, as_json: bool) -> None:
    """Show a library on one page: contents, size and error, classes, flagged joints, cycles.

    \b
    Example:
      mocapdb report cmu.mocapdb -o report.html
    """
    from mocapdb.library import Library
    from mocapdb.report import Effort, write_report

    with Library(library, original=original) as opened, progress_bar("Reporting") as progress:
        figures = write_report(
            opened, output, effort=Effort(fault_seconds=seconds), progress=progress
        )
    if as_json:
        emit_json({"library": str(library), **figures})
        return
    click.echo(f"{output}: {counted(figures['clips'], 'clip')}, {megabytes(figures['bytes'])}")
