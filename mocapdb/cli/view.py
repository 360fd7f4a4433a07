"""``mocapdb view``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import emit_json
from mocapdb.cli._options import json_option, library_argument, original_option


@click.command()
@library_argument
@click.option("--clip", help="The clip to open first.")
@click.option(
    "--host", default="127.0.0.1", show_default=True,
    help="Address to listen at; 0.0.0.0 lets other machines in, with the token of the address.",
)  # fmt: skip
@click.option(
    "--port", default=8080, show_default=True, type=click.IntRange(0, 65535),
    help="Port to listen at, or the next free one.",
)  # fmt: skip
@click.option("--browser/--no-browser", default=False, help="Open a browser at once.")
@original_option
@json_option
def view(
    library: Path,
    clip: str | None,
    host: str,
    port: int,
    browser: bool,
    original: bool,
    as_json: bool,
) -> None:
    """Look at a library in a browser: play, compare, find faults, query, blend cycles.

    It needs viser (pip install 'mocapdb[viewer]'), and no network. Ctrl-C ends it.

    \b
    Example:
      mocapdb view cmu.mocapdb
    """
    from mocapdb.viewer import Viewer

    local = host in {"127.0.0.1", "localhost", "::1"}
    who = "only this machine" if local else "every machine that reaches this one"
    try:  # Ctrl-C is how a viewer ends, at whatever moment it comes
        with Viewer(library, host=host, port=port, clip=clip, original=original) as viewer:
            if as_json:
                about = {"url": viewer.url, "host": host, "local": local}
                emit_json({"library": str(library), **about})
            else:
                click.echo(f"{library} at {viewer.url} ({who} can see it; Ctrl-C ends it)")
            if browser:
                import webbrowser

                webbrowser.open(viewer.url)
            viewer.wait()
    except KeyboardInterrupt:
        click.echo("closed", err=True)
