"""Reading the small CSV tables of a corpus, with errors that name the line."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from mocapdb.errors import CorpusError

__all__ = ["Row", "read_rows"]

_MAX_LINE_BYTES = 1 << 20


class Row:
    """One row of a table: its cells by column, and where it stands."""

    def __init__(self, path: Path, line: int, cells: dict[str, str]) -> None:
        self.path = path
        self.line = line
        self.cells = cells

    def __getitem__(self, column: str) -> str:
        """The text of a cell, without the white space around it; empty where there is no column."""
        return self.cells.get(column, "")

    def error(self, message: str) -> CorpusError:
        """Return the error that this row is to blame for."""
        return CorpusError(f"{self.path}:{self.line}: {message}")

    def fps(self) -> float:
        """The frame rate in column ``fps``, in frames per second."""
        text = self["fps"]
        try:
            fps = float(text)
        except ValueError:
            fps = math.nan
        if not (math.isfinite(fps) and fps > 0):
            raise self.error(f"Expected fps to be a positive number, but got {text!r}.")
        return fps


def read_rows(path: Path, required: Sequence[str]) -> Iterator[Row]:
    """Yield the rows of a CSV file whose header has the `required` columns.

    The file is comma separated UTF-8, with or without a byte order mark. Empty lines are passed
    over.

    Raises
    ------
    CorpusError
        If the file cannot be read, is not UTF-8 or not CSV, lacks a column, or has a row with
        more or fewer cells than the header.
    """
    try:
        with path.open("rb") as file:
            yield from _parse(path, file, required)
    except OSError as error:
        raise CorpusError(
            f"{path}: Expected a readable CSV file, but got: {error.strerror}."
        ) from None


def _parse(path: Path, file: BinaryIO, required: Sequence[str]) -> Iterator[Row]:
    reader = csv.reader(_lines(path, file), strict=True)
    header: list[str] | None = None
    while True:
        line = reader.line_num + 1  # where the next record starts: it may span several lines
        try:
            cells = next(reader)
        except StopIteration:
            break
        except csv.Error as error:
            raise CorpusError(f"{path}:{line}: Expected CSV, but got: {error}.") from None
        if not cells:
            continue
        cells = [cell.strip() for cell in cells]
        if header is None:
            header = _check_header(path, line, cells, required)
        elif len(cells) != len(header):
            raise CorpusError(
                f"{path}:{line}: Expected {len(header)} cells, one for each column of the header, "
                f"but got {len(cells)}. Quote the cells that have a comma."
            )
        else:
            yield Row(path, line, dict(zip(header, cells, strict=True)))
    if header is None:
        raise CorpusError(f"{path}: Expected a CSV file with a header, but the file is empty.")


def _lines(path: Path, file: BinaryIO) -> Iterator[str]:
    """Yield decoded lines, one at a time so that an error can name its line."""
    line = 0
    while raw := file.readline(_MAX_LINE_BYTES + 1):
        line += 1
        if len(raw) > _MAX_LINE_BYTES:
            raise CorpusError(f"{path}:{line}: Expected CSV, but got a line of over 1 MiB.")
        try:
            text = raw.decode("utf-8-sig" if line == 1 else "utf-8")
        except UnicodeDecodeError as error:
            raise CorpusError(
                f"{path}:{line}: Expected UTF-8 text, but got byte 0x{raw[error.start]:02x} in "
                f"column {error.start + 1}. Save the file as UTF-8."
            ) from None
        if "\0" in text:
            raise CorpusError(f"{path}:{line}: Expected CSV, but got a NUL byte: a binary file?")
        yield text


def _check_header(path: Path, line: int, header: list[str], required: Sequence[str]) -> list[str]:
    missing = [column for column in required if column not in header]
    if missing:
        found = ", ".join(header)
        raise CorpusError(
            f"{path}:{line}: Expected the columns {', '.join(required)}, but {', '.join(missing)} "
            f"{'is' if len(missing) == 1 else 'are'} missing. Found: "
            f"{found if len(found) <= 200 else found[:200] + ' ...'}."
        )
    repeated = {column for column in header if header.count(column) > 1}
    if repeated:
        raise CorpusError(
            f"{path}:{line}: Expected every column once, but got "
            f"{', '.join(sorted(repeated))} more than once."
        )
    return header
