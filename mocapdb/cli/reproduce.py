"""``mocapdb reproduce``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from mocapdb.cli._console import emit_json, json_option, print_table, progress_bar


@click.group()
def reproduce() -> None:
    """Compute the papers' tables beside their figures."""


@reproduce.command()
@click.option(
    "--corpus", required=True, type=click.Path(path_type=Path),
    help="Folder with CMU's AMC files, at any depth.",
)  # fmt: skip
@click.option(
    "--table", "tables", multiple=True, type=click.Choice(["4.1", "4.2", "4.3", "4.4"]),
    help="Only this table; may be given several times.",
)  # fmt: skip
@json_option
def okane(corpus: Path, tables: tuple[str, ...], as_json: bool) -> None:
    """Compute O'Kane's (2008) compression tables on the clips at hand.

    The thesis does not name its clips: where those at hand have other frames, a row is computed
    on a stand-in and says so, or says why it cannot be computed.

    \b
    Example:
      mocapdb reproduce okane --corpus cmu/ --table 4.1
    """
    from mocapdb.reproduce import okane as thesis

    with progress_bar("Compressing") as progress:
        rows = thesis.reproduce(corpus, tables=tables or thesis.TABLES, progress=progress)
    if as_json:
        emit_json({"paper": thesis.PAPER, "rows": rows})
        return
    for table in sorted({row["table"] for row in rows}):
        unit = "ratio to 62 doubles a frame" if table == "4.4" else "bytes a frame"
        print_table(
            ("row", "column", "paper", "ours", "difference"),
            [_line(row) for row in rows if row["table"] == table],
            left=2,
            title=f"Table {table}, {unit}",
        )
    click.echo("* on a stand-in: not his clips, but of their kind, number and length\n\nClips")
    for name, note in _notes(rows).items():
        click.echo(f"  {name}: {note}")
    click.echo("\nConventions")
    for convention in thesis.CONVENTIONS:
        click.echo(f"  - {convention}")


def _line(row: dict[str, Any]) -> tuple[str, str, str, str, str]:
    paper, ours = row["paper"], row["ours"]
    if ours is None:
        return row["row"], row["column"], f"{paper:.2f}", "-", "-"
    stand_in = " *" if row["note"].startswith("stand-in") else ""
    difference = f"{100 * (ours / paper - 1):+.1f} %{stand_in}"
    return row["row"], row["column"], f"{paper:.2f}", f"{ours:.2f}", difference


def _notes(rows: list[dict[str, Any]]) -> dict[str, str]:
    """Return what is to be said about each row's clips, once."""
    return {row["row"]: row["note"].split(";")[0] for row in reversed(rows)}
