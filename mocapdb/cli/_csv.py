"""``--csv``: the table of a command for spreadsheets, made of what it prints as JSON."""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import wraps
from typing import Any

import click

from mocapdb.cli._console import instead_of_json, shown
from mocapdb.cli._options import Command

__all__ = ["csv_option", "each_of"]

Row = Mapping[str, Any]


def each_of(*names: str, without: Collection[str] = ()) -> Callable[[Any], Iterable[Row]]:
    """Return what takes the rows of one of these names out of a command's JSON.

    Without any of them the whole is one row. Rows within rows of another of the names are rows.
    What is too much for a table is left out of it.
    """

    def rows(data: Any) -> Iterable[Row]:
        for name in names:
            if isinstance(data.get(name), list):
                return [row for each in data[name] for row in rows(each)]
        return [{name: value for name, value in data.items() if name not in without}]

    return rows


def csv_option(rows: Callable[[Any], Iterable[Row]]) -> Callable[[Command], Command]:
    """Add ``--csv`` to a command that has ``--json``.

    Parameters
    ----------
    rows : callable
        Takes what the command prints as JSON, and returns a row for each line. Objects in a row
        become columns such as ``error_mm.mean``, lists of values one value with semicolons; lists
        of objects are left out.
    """

    def add(command: Command) -> Command:
        @wraps(command)
        def printing(*args: Any, as_json: bool, as_csv: bool, **rest: Any) -> Any:
            if as_csv and as_json:
                raise click.UsageError("--csv and --json both say what to print: give one of them.")
            if not as_csv:
                return command(*args, as_json=as_json, **rest)
            with instead_of_json(lambda data: _print(rows(data))):
                return command(*args, as_json=True, **rest)

        option = click.option(
            "--csv", "as_csv", is_flag=True, help="Print a table as CSV, for spreadsheets."
        )
        return option(printing)  # type: ignore[return-value] # click calls it by its options

    return add


def _print(rows: Iterable[Row]) -> None:
    flat = [_flat(row) for row in rows]
    columns = dict.fromkeys(name for row in flat for name in row)
    if columns:
        table = csv.DictWriter(sys.stdout, list(columns), restval="", lineterminator="\n")
        table.writerow({name: shown(name) for name in columns})
        table.writerows({name: _cell(value) for name, value in row.items()} for row in flat)


def _cell(value: Any) -> Any:
    """Return a text with its control characters spelt out, as tables have it: JSON has it as it is.

    A file's name may hold any, and a CSV is looked at in a terminal, too.
    """
    return shown(value) if isinstance(value, str) else value


def _flat(row: Row, above: str = "") -> dict[str, Any]:
    """Return a row whose values are all numbers and texts."""
    found: dict[str, Any] = {}
    for name, value in row.items():
        column = f"{above}{name}"
        if isinstance(value, Mapping):
            found |= _flat(value, f"{column}.")
        elif isinstance(value, list | tuple):
            if not any(isinstance(each, Mapping | list | tuple) for each in value):
                found[column] = ";".join(str(each) for each in value)
        else:
            found[column] = "" if value is None else value
    return found
