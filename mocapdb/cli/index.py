"""``mocapdb index``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import counted, emit_json, progress_bar
from mocapdb.cli._options import json_option, library_argument, scheduler_option


@click.command()
@library_argument
@scheduler_option
@json_option
def index(library: Path, scheduler: str | None, as_json: bool) -> None:
    """Make a library that was built without features ready for query and classify.

    Later builds then keep it up to date. Of a library of an earlier version it measures what
    --root-speed, --turn and --contacts ask for.

    \b
    Example:
      mocapdb index cmu.mocapdb
    """
    from mocapdb.library import index_library

    with progress_bar("Indexing") as progress:
        report = index_library(library, progress, scheduler=scheduler)
    if as_json:
        emit_json({"library": str(library), **report})
        return
    click.echo(
        f"{library}: added {counted(report['indexed'], 'clip')} to the index and learned "
        f"{counted(report['classes'], 'class')}; not mapped to the canonical body: "
        f"{counted(report['unmapped'], 'clip')}."
    )
    if report["measured"]:
        click.echo(f"measured speed, turn and contacts of {counted(report['measured'], 'clip')}")
