"""Motion files as text: loading them safely, walking their lines, writing them whole."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from io import RawIOBase
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import ByteArray, StrPath
from mocapdb.errors import FormatError

__all__ = ["Line", "Text", "load_text", "parse_number"]

CHUNK_BYTES = 16 << 20
LONGEST_LINE_BYTES = 1 << 20
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


class Line(NamedTuple):
    """The words of a line and its 1-based number."""

    number: int
    words: list[str]


@dataclass(frozen=True, eq=False)
class Text:
    """The bytes of a file, which always end with a line break.

    Parameters
    ----------
    path : str
        The file.
    data : bytes
        Its content without a byte order mark, with a line break after the last line.
    """

    path: str
    data: bytes

    @property
    def array(self) -> ByteArray:
        """The bytes as an array, without a copy."""
        return np.frombuffer(self.data, dtype=np.uint8)

    def error(self, message: str, line: int | None = None) -> FormatError:
        """Return an error about this file, to be raised."""
        return FormatError(self.path, message, line)

    def line_number(self, position: int) -> int:
        """Return the 1-based line that holds a byte."""
        return self.data.count(b"\n", 0, position) + 1

    def lines(self, start: int = 0, comment: bytes | None = None) -> Iterator[tuple[int, Line]]:
        """Yield the lines from byte `start` on that have words, each after its first byte.

        What follows `comment` on a line is left out, and may hold any bytes.

        Raises
        ------
        FormatError
            If a line is not UTF-8.
        """
        number = self.line_number(start)
        while start < len(self.data):
            stop = self.data.index(b"\n", start)
            raw = self.data[start:stop]
            if comment is not None:
                raw = raw.partition(comment)[0]
            try:
                words = raw.decode().split()
            except UnicodeDecodeError:
                raise self.error("Expected UTF-8 text, but got other bytes.", number) from None
            if words:
                yield start, Line(number, words)
            start = stop + 1
            number += 1


def load_text(path: StrPath) -> Text:
    """Read a text file, and refuse early what cannot be one.

    Raises
    ------
    FormatError
        If the file cannot be opened, is empty, holds NUL bytes, or has a line over 1 MiB.
    """
    try:
        with Path(path).open("rb", buffering=0) as file:
            data = _read_checked(path, file)
    except IsADirectoryError:
        raise FormatError(path, "Expected a motion file, but got a folder.") from None
    except FileNotFoundError:
        raise FormatError(path, "Expected a motion file, but there is none.") from None
    except OSError as problem:
        raise FormatError(
            path, f"Expected a file that can be read, but got: {problem.strerror}."
        ) from None
    data = data.removeprefix(BYTE_ORDER_MARK)
    if data.isspace():
        raise FormatError(path, "Expected a motion file, but got an empty one.")
    return Text(str(path), data)


def parse_number(text: Text, word: str, what: str, line: int) -> float:
    """Return the number that a word spells.

    Raises
    ------
    FormatError
        If it is not a finite decimal number (``nan`` and ``inf`` are refused).
    """
    value = float(word) if NUMBER.fullmatch(word) else math.nan
    if not math.isfinite(value):
        raise text.error(f"Expected a finite number for {what}, but got {word!r:.60}.", line)
    return value


def _read_checked(path: StrPath, file: RawIOBase) -> bytes:
    """Read a file to its end, and see that its last line has one; stop at the first thing wrong."""
    chunks: list[bytes] = []
    line_start = chunk_start = 0
    chunk_bytes = min(CHUNK_BYTES, os.fstat(file.fileno()).st_size + 1)
    while chunk := file.read(chunk_bytes):
        if b"\0" in chunk:
            raise FormatError(path, "Expected a text file, but got binary data.")
        # Looking into windows of the longest length shows every line that is longer.
        for window in range(0, len(chunk), LONGEST_LINE_BYTES):
            line_break = chunk.find(b"\n", window, window + LONGEST_LINE_BYTES)
            stop = min(window + LONGEST_LINE_BYTES, len(chunk)) if line_break < 0 else line_break
            if chunk_start + stop - line_start > LONGEST_LINE_BYTES:
                raise FormatError(
                    path,
                    f"Expected lines of at most {LONGEST_LINE_BYTES} bytes, but got a longer one.",
                    b"".join((*chunks, chunk[:stop])).count(b"\n") + 1,
                )
            if line_break >= 0:
                last_break = chunk.rfind(b"\n", window, window + LONGEST_LINE_BYTES)
                line_start = chunk_start + last_break + 1
        chunks.append(chunk)
        chunk_start += len(chunk)
    if not chunks or not chunks[-1].endswith(b"\n"):
        chunks.append(b"\n")
    return b"".join(chunks)  # without a copy if it is only one
