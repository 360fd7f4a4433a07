"""``mocapdb compact``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import emit_json, megabytes
from mocapdb.cli._options import json_option, library_argument


@click.command()
@library_argument
@json_option
def compact(library: Path, as_json: bool) -> None:
    """Give the space of replaced clips back to the disk.

    \b
    Example:
      mocapdb compact cmu.mocapdb
    """
    from mocapdb.library import compact_library

    freed = compact_library(library)
    if as_json:
        emit_json({"library": str(library), "freed_bytes": freed})
    else:
        click.echo(f"{library}: freed {megabytes(freed)}.")
