"""``mocapdb index``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import counted, emit_json, progress_bar
from mocapdb.cli._options import json_option, library_argument


@click.command()
@library_argument
@json_option
def index(library: Path, as_json: bool) -> None:
    """Make a library that was built without features ready for query and classify.

    Later builds then keep it up to date.

    \b
    Example:
      mocapdb index cmu.mocapdb
    """
    from mocapdb.library import index_library

    with progress_bar("Indexing") as progress:
        report = index_library(library, progress)
    if as_json:
        emit_json({"library": str(library), **report})
        return
    click.echo(
        f"{library}: added {counted(report['indexed'], 'clip')} to the index and learned "
        f"{counted(report['classes'], 'class')}; not mapped to the canonical body: "
        f"{counted(report['unmapped'], 'clip')}."
    )
