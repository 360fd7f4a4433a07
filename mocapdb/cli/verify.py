"""``mocapdb verify``."""

from __future__ import annotations

import click

from mocapdb.base.arrays import StrPath
from mocapdb.cli._console import counted, emit_json, progress_bar
from mocapdb.cli._options import json_option, library_argument, scheduler_option


@click.command()
@library_argument
@scheduler_option
@json_option
def verify(library: StrPath, scheduler: str | None, as_json: bool) -> None:
    """Check every checksum of a library and decode every clip; exit 1 if anything is bad.

    \b
    Example:
      mocapdb verify cmu.mocapdb
    """
    from mocapdb.library import Library, verify_library

    with Library(library) as opened, progress_bar("Verifying") as progress:
        report = verify_library(opened, progress, scheduler=scheduler)
    if as_json:
        emit_json(report)
    else:
        for stray in report["stray"]:
            click.echo(f"stray file {stray}: belongs to no clip, the next build removes it")
        for shard in report["shards"]:
            click.echo(f"bad shard {shard['shard']}: {shard['reason']}", err=True)
        for clip in report["bad"]:
            click.echo(f"bad clip {clip['clip']}: {clip['reason']}", err=True)
        sound = report["clips"] - len(report["bad"])
        clips = counted(report["clips"], "clip")
        click.echo(
            f"{library}: {sound} of {clips} {'is' if report['clips'] == 1 else 'are'} sound."
        )
    if report["bad"] or report["shards"]:
        raise click.exceptions.Exit(1)
