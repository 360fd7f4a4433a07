"""``mocapdb index``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import emit_json, progress_bar
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
        f"{library}: added {report['indexed']} clips to the index and learned "
        f"{report['classes']} classes; {report['unmapped']} clips have a skeleton that cannot be "
        "mapped to the canonical body."
    )
