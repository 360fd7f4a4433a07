"""``mocapdb recover``."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

from mocapdb.cli._console import counted, emit_json, progress_bar
from mocapdb.cli._options import PATH, json_option, library_argument

if TYPE_CHECKING:
    from mocapdb.library.upkeep.recover import RecoveryReport


@click.command()
@library_argument
@click.option(
    "--corpus", type=PATH,
    help="Folder to take lost clips from again; by default where they were built from.",
)  # fmt: skip
@click.option("--jobs", type=click.IntRange(min=1), help="Worker processes.")
@json_option
def recover(library: Path, corpus: Path | None, jobs: int | None, as_json: bool) -> None:
    """Bring a damaged library back from its shards; exit 1 if anything is lost.

    The catalogue is made anew if it is gone or damaged. Clips that are damaged are built again
    from their files where these are there, and index, classes and features are made anew. Files
    that are of no use any more are put into the folder "set-aside".

    \b
    Example:
      mocapdb recover cmu.mocapdb
      mocapdb recover cmu.mocapdb --corpus /data/cmu
    """
    from mocapdb.library import recover_library

    with progress_bar("Recovering") as progress:
        report = recover_library(library, corpus=corpus, jobs=jobs, progress=progress)
    if as_json:
        emit_json(report.to_dict())
    else:
        _tell(library, report)
    if report.lost:
        raise click.exceptions.Exit(1)


def _tell(library: Path, report: RecoveryReport) -> None:
    if report.catalogue:
        click.echo(f"catalogue made anew: {report.catalogue}")
        click.echo(
            "Names and classes are those that the clips were built with: build again to take what "
            "the labels say now, and run classify --apply again if you did before."
        )
        if report.revisions:
            click.echo(
                f"{counted(report.revisions, 'clip')} as cleaned, also where that had been undone "
                f"(mocapdb clean {quote(str(library))} --undo)."
            )
    for each in report.dropped:
        click.echo(f"dropped {each['what']}: {each['reason']}", err=True)
    if report.retaken:
        click.echo(f"built again from their files: {', '.join(report.retaken)}")
    for name in report.lost:
        click.echo(f"lost {name}: its file is not there. Say where: --corpus FOLDER", err=True)
    for name in report.cycles:
        which = (
            f"--class {quote(name)}" if name else "--class NAME for each class that you kept one of"
        )
        click.echo(
            f"kept cycle is damaged. Make it anew: mocapdb cycle {quote(str(library))} {which}",
            err=True,
        )
    if report.set_aside:
        click.echo(f"set aside, to be deleted by you: {', '.join(report.set_aside)}")
    click.echo(f"{library}: {counted(report.clips, 'clip')}.")
