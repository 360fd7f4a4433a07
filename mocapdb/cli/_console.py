"""What the commands share: JSON on stdout, progress on stderr, tables to read."""

from __future__ import annotations

import json
import os
import re
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import zip_longest
from typing import Any

import click

__all__ = [
    "counted",
    "emit_json",
    "instead_of_json",
    "megabytes",
    "print_table",
    "progress_bar",
    "shown",
]

SECONDS_A_LINE = 20.0  # between lines of progress where there is no terminal
PIPED_WIDTH = 200  # largest width in letters of a table that goes into a file
CONTROL = re.compile(  # all but tab and line feed; and what turns the order of letters round
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]"
)
CELL_END = "\0"  # no text has one: it would be spelt out
SMILE = re.compile(r":[^\0]*:")


def shown(text: str) -> str:
    """Return a text with its control characters spelt out: a file's name may hold any.

    Examples
    --------
    >>> print(shown("walk\x1b[2J"))
    walk\\x1b[2J
    """
    return CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def emit_json(data: Any) -> None:
    """Print one JSON object on stdout, or what `instead_of_json` makes of it."""
    _EMIT.get()(data)


def _print_json(data: Any) -> None:
    click.echo(json.dumps(data, indent=2))


_EMIT: ContextVar[Callable[[Any], None]] = ContextVar("emit", default=_print_json)


@contextmanager
def instead_of_json(emit: Callable[[Any], None]) -> Iterator[None]:
    """Give what commands print as JSON to a function while the block runs."""
    token = _EMIT.set(emit)
    try:
        yield
    finally:
        _EMIT.reset(token)


def counted(count: int, noun: str) -> str:
    """Return a number of things: ``1 clip``, ``2 clips``, ``1 class``, ``2 classes``."""
    return f"{count} {noun if count == 1 else noun + ('es' if noun[-1] == 's' else 's')}"


@contextmanager
def progress_bar(description: str) -> Iterator[Callable[[int, int, str], None]]:
    """Show a bar on stderr while the block runs; where that is no terminal, a line now and then.

    Yields
    ------
    callable
        To be called with items done, items in all, and the name of the last item.
    """
    if not sys.stderr.isatty():
        yield _lines_now_and_then(description)
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[name]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(description, total=None, name="")
        yield lambda done, total, name: progress.update(
            task, completed=done, total=total, name=name
        )


def _lines_now_and_then(description: str) -> Callable[[int, int, str], None]:
    """Return what writes a line of progress to stderr, at most one in `SECONDS_A_LINE`."""
    last = time.monotonic()

    def tell(done: int, total: int, name: str) -> None:
        nonlocal last
        if time.monotonic() - last >= SECONDS_A_LINE:
            last = time.monotonic()
            click.echo(f"{description} {done}/{total} {name}", err=True)

    return tell


def print_table(
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    left: int = 1,
    title: str | None = None,
) -> None:
    """Print a table on stdout, the first `left` columns aligned left and the others right."""
    lines = [tuple(columns), *map(tuple, rows)]
    every = "".join(map("".join, lines))
    if not (every.isascii() and every.isprintable()) and CONTROL.search(every):
        lines = [tuple(map(shown, line)) for line in lines]
    if title is None and _is_plain(lines):
        widths = _plain_widths(lines)
        if widths is not None:
            click.echo("\n".join(_plain_table(lines, widths, left)))
            return
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left")
    for i, name in enumerate(columns):
        table.add_column(name, justify="left" if i < left else "right", overflow="fold")
    for row in lines[1:]:
        table.add_row(*map(escape, row))
    # piped into a file, a table keeps the width that it needs
    console = Console() if sys.stdout.isatty() else Console(width=PIPED_WIDTH)
    console.print(table)


def _is_plain(lines: Sequence[Sequence[str]]) -> bool:
    """Return whether a table has neither colours nor symbols, which take rich."""
    stdout = sys.stdout
    if stdout.isatty() or not str(stdout.encoding).lower().startswith("utf"):
        return False
    if os.environ.keys() & {"FORCE_COLOR", "TTY_COMPATIBLE"}:
        return False
    every = CELL_END + CELL_END.join(map(CELL_END.join, lines)) + CELL_END
    if not every.isascii() or not every.replace(CELL_END, "").isprintable():
        return False
    # what rich takes for its own, ":smile:" too, and room that it takes away
    signs = "[", "\\", "  ", f" {CELL_END}", f"{CELL_END} "
    return not any(sign in every for sign in signs) and not SMILE.search(every)


def _plain_widths(lines: Sequence[Sequence[str]]) -> list[int] | None:
    """Return how wide rich makes each column; None if more than the widest has to give way."""
    columns = list(zip(*lines, strict=True))
    widths = [max(map(len, column)) for column in columns]
    excess = _total(widths) - PIPED_WIDTH
    if excess > 0:
        widest = widths.index(max(widths))
        widths[widest] -= excess
        longest_word = max(len(word) for text in columns[widest] for word in text.split())
        if widths[widest] < max(longest_word, *(w for i, w in enumerate(widths) if i != widest)):
            return None
    return widths


def _plain_table(lines: Sequence[Sequence[str]], widths: list[int], left: int) -> Iterator[str]:
    """Yield the lines of a table as rich draws it: a rule under the head, room round it."""
    blank, rule = " " * _total(widths), "─" * (_total(widths) - 2)
    yield blank
    aligned = (f"{{:{'<' if i < left else '>'}{width}}}" for i, width in enumerate(widths))
    in_one_line = f"  {'   '.join(aligned)}  ".format
    columns = zip(*lines, strict=True)
    fits = all(max(map(len, own)) <= width for own, width in zip(columns, widths, strict=True))
    for number, line in enumerate(lines):
        if fits:
            yield in_one_line(*line)
            if number == 0:
                yield f" {rule} "
            continue
        folded = [
            textwrap.wrap(text, width, break_on_hyphens=False) if len(text) > width else [text]
            for text, width in zip(line, widths, strict=True)
        ]
        for parts in list(zip_longest(*folded, fillvalue="")) or [("",) * len(widths)]:
            cells = (
                text.ljust(width) if i < left else text.rjust(width)
                for i, (text, width) in enumerate(zip(parts, widths, strict=True))
            )
            yield f"  {'   '.join(cells)}  "
        if number == 0:
            yield f" {rule} "
    yield blank


def _total(widths: list[int]) -> int:
    """Return how wide a table is, with the room between and round its columns."""
    return sum(widths) + 3 * len(widths) + 1


def megabytes(size: float) -> str:
    """Return a number of bytes for people, in kB, MB or GB of powers of ten.

    Examples
    --------
    >>> megabytes(12_345_678)
    '12.3 MB'
    """
    if size >= 1e9:
        return f"{size / 1e9:.2f} GB"
    if size >= 1e6:
        return f"{size / 1e6:.1f} MB"
    return f"{size / 1e3:.1f} kB"
