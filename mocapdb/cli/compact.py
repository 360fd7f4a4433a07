"""``mocapdb compact``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import counted, emit_json, megabytes
from mocapdb.cli._options import json_option, library_argument


@click.command()
@library_argument
@json_option
def compact(library: Path, as_json: bool) -> None:
    """Give the space of replaced clips back, and join small files.

    \b
    Example:
      mocapdb compact cmu.mocapdb
    """
    from mocapdb.library import compact_library

    before = _n_shards(library)
    freed = compact_library(library)
    after = _n_shards(library)
    if as_json:
        emit_json({"library": str(library), "freed_bytes": freed, "shards": after})
        return
    click.echo(f"{library}: freed {megabytes(freed)}.")
    if after < before:
        click.echo(f"{counted(before, 'file')} of clips are now {after}.")


def _n_shards(library: Path) -> int:
    from mocapdb.library import Library
    from mocapdb.library.layout import SHARDS_FOLDER

    with Library(library) as opened:
        return len(opened.catalogue.shards(SHARDS_FOLDER))
