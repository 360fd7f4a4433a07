"""Motion files as text: loading them safely, walking their lines, writing them whole."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import RawIOBase
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import ByteArray, StrPath
from mocapdb.base.files import expect_file
from mocapdb.errors import FormatError

__all__ = ["Line", "Text", "load_text", "parse_number"]

CHUNK_BYTES = 16 << 20
LONGEST_LINE_BYTES = 1 << 20
END_OF_FILE = b"\x1a"
BEHIND_BYTES = 1024  # how many bytes after the end-of-file mark are looked at
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
PAIR_OF_HIGH_BYTES = re.compile(rb"[\x80-\xff]{2}")
LONE_RETURN = re.compile(rb"\r(?!\n)")
PRIVATE_USE = re.compile("[\ue000-\uf8ff]")
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
        Its content as UTF-8 without a byte order mark, with a line break after the last line.
    strict : bool
        Whether to refuse what would have to be mended.
    notes : list of str
        What was mended so far.
    """

    path: str
    data: bytes
    strict: bool = False
    notes: list[str] = field(default_factory=list)

    def mend(self, what: str, line: int | None = None) -> None:
        """Note, once, what is not as the format says and is read all the same.

        Raises
        ------
        FormatError
            If nothing is to be mended.
        """
        if self.strict:
            raise self.error(f"Expected a file with nothing to mend (strict), but {what}.", line)
        note = f"mended: {what}"
        if note not in self.notes:
            self.notes.append(note)

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

    def raw_lines(self, start: int = 0) -> Iterator[tuple[int, int, str]]:
        """Yield the lines from byte `start` on: first byte, number, content."""
        number = self.line_number(start)
        while start < len(self.data):
            stop = self.data.index(b"\n", start)
            yield start, number, self.data[start:stop].decode()
            start = stop + 1
            number += 1

    def lines(self, start: int = 0, comment: str | None = None) -> Iterator[tuple[int, Line]]:
        """Yield the lines from byte `start` on that have words, each after its first byte.

        What follows `comment` on a line is left out.
        """
        for at, number, content in self.raw_lines(start):
            words = (content.partition(comment)[0] if comment else content).split()
            if words:
                yield at, Line(number, words)


def load_text(path: StrPath, *, strict: bool = False) -> Text:
    """Read a text file, and refuse early what cannot be one.

    UTF-16, UTF-32, Shift-JIS and Latin-1 become UTF-8, lone carriage returns become line breaks,
    and an end-of-file mark of DOS goes.

    Parameters
    ----------
    path : path-like
        The file.
    strict : bool
        Whether to refuse what would have to be mended.

    Raises
    ------
    FormatError
        If the file cannot be opened, is empty, holds NUL bytes, or has a line over 1 MiB.
    """
    try:
        expect_file(path)
        with Path(path).open("rb", buffering=0) as file:
            data, is_cut = _read_checked(path, file)
    except IsADirectoryError:
        raise FormatError(path, "Expected a motion file, but got a folder.") from None
    except FileNotFoundError:
        raise FormatError(path, "Expected a motion file, but there is none.") from None
    except OSError as problem:
        raise FormatError(
            path, f"Expected a file that can be read, but got: {problem.strerror}."
        ) from None
    wide, guessed = _wide_encoding(data), ""
    if wide:
        try:
            data = data.decode(wide).encode()
        except UnicodeDecodeError:
            raise FormatError(path, "Expected a text file, but got binary data.") from None
    elif not data.isascii():
        data, guessed = _utf8_or_guessed(data)
    text = Text(str(path), _with_newlines(data.removeprefix(BYTE_ORDER_MARK)), strict)
    if wide:
        text.mend(f"the file is in {wide[:6].upper()}")
    if guessed:
        text.mend(f"what is not UTF-8 is taken as {guessed}")
    if is_cut:
        text.mend("what follows an end-of-file mark (Ctrl-Z) is left out")
    if text.data.isspace():
        raise FormatError(path, "Expected a motion file, but got an empty one.")
    return text


def parse_number(text: Text, word: str, what: str, line: int | None) -> float:
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


def _read_checked(path: StrPath, file: RawIOBase) -> tuple[bytes, bool]:
    """Read a file to its end, and see that its last line has one; stop at the first thing wrong.

    DOS ended texts with a mark: nothing behind it is read, and it tells whether there was anything.
    """
    chunks: list[bytes] = []
    line_start = chunk_start = 0
    wide = is_cut = is_over = False
    chunk_bytes = min(CHUNK_BYTES, os.fstat(file.fileno()).st_size + 1)
    while not is_over and (chunk := file.read(chunk_bytes)):
        wide = wide or (not chunks and _wide_encoding(chunk) is not None)
        if not wide and END_OF_FILE in chunk:
            chunk, _, behind = chunk.partition(END_OF_FILE)
            is_cut = bool((behind + file.read(BEHIND_BYTES)).strip(b"\0\x1a \t\r\n"))
            is_over = True
        if not wide and b"\0" in chunk:
            raise FormatError(path, "Expected a text file, but got binary data.")
        # Looking into windows of the longest length shows every line that is longer.
        for window in range(0, len(chunk), LONGEST_LINE_BYTES):
            window_stop = min(window + LONGEST_LINE_BYTES, len(chunk))
            line_break = _first_break(chunk, window, window_stop)
            stop = window_stop if line_break < 0 else line_break
            if chunk_start + stop - line_start > LONGEST_LINE_BYTES:
                raise FormatError(
                    path,
                    f"Expected lines of at most {LONGEST_LINE_BYTES} bytes, but got a longer one.",
                    b"".join((*chunks, chunk[:stop])).count(b"\n") + 1,
                )
            if line_break >= 0:
                breaks = (chunk.rfind(end, window, window_stop) for end in (b"\n", b"\r"))
                line_start = chunk_start + max(breaks) + 1
        chunks.append(chunk)
        chunk_start += len(chunk)
    if not wide and (not chunks or not chunks[-1].endswith(b"\n")):
        chunks.append(b"\n")
    return b"".join(chunks), is_cut  # without a copy if it is only one


def _first_break(chunk: bytes, start: int, stop: int) -> int:
    """Return where the first line of a window ends, or -1."""
    newline = chunk.find(b"\n", start, stop)
    return newline if newline >= 0 else chunk.find(b"\r", start, stop)


def _wide_encoding(data: bytes) -> str | None:
    """Return which UTF-16 or UTF-32 a file starts as, by its mark, or by the NULs of UTF-16."""
    if data.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        return "utf-32"
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    start = data[:64]
    for name, nul, letter in (("utf-16-le", 1, 0), ("utf-16-be", 0, 1)):
        if len(start) >= 8 and not any(start[nul::2]) and all(start[letter::2]):
            return name
    return None


def _utf8_or_guessed(data: bytes) -> tuple[bytes, str]:
    """Return text as UTF-8, and the encoding that lines of other bytes were taken for.

    They are Shift-JIS where two such bytes follow each other and all decode, as in Japanese words,
    and else Latin-1, as for single letters with accents.
    """
    try:
        data.decode()
    except UnicodeDecodeError:
        pass
    else:
        return data, ""
    lines = data.split(b"\n")
    odd = [i for i, line in enumerate(lines) if not _decodes(line, "utf-8")]
    together = b"\n".join(lines[i] for i in odd)
    japanese = (
        PAIR_OF_HIGH_BYTES.search(together) is not None
        and _decodes(together, "cp932")
        and not PRIVATE_USE.search(together.decode("cp932"))
    )
    encoding = "cp932" if japanese else "latin-1"
    for i in odd:
        lines[i] = lines[i].decode(encoding).encode()
    return b"\n".join(lines), "Shift-JIS" if japanese else "Latin-1"


def _decodes(data: bytes, encoding: str) -> bool:
    try:
        data.decode(encoding)
    except UnicodeDecodeError:
        return False
    return True


def _with_newlines(data: bytes) -> bytes:
    """Return text whose lines end with newlines, alone or after a return."""
    if b"\r" in data and LONE_RETURN.search(data):
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data if data.endswith(b"\n") else data + b"\n"
