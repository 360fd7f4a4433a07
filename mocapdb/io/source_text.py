"""Writing a changed clip into the text of its source: what did not change stays, letter by letter.

Rows of frames that are as they were are copied, and so are the numbers of untouched channels within
the others. That takes a source whose rows are plain: one line a frame in a BVH, one line a joint in
an AMC, each number the channel that was read. Where it is not, nothing is written, and
`mocapdb.io.clip_files:write_clip` writes the clip in mocapdb's own spelling.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.files import replacing
from mocapdb.errors import FormatError
from mocapdb.io.clip_files import find_skeleton
from mocapdb.motion.clip import Clip

__all__ = ["write_like_source"]

FRAME_TIME = re.compile(rb"^[ \t]*frame[ \t]*time[^\n]*\n", re.IGNORECASE | re.MULTILINE)
ROW = re.compile(rb"[^\n]*[^\s][^\n]*")
FRAME_NUMBER = re.compile(rb"^[ \t]*\d+[ \t\r]*$", re.MULTILINE)
WORD = re.compile(rb"\S+")

Part = tuple[int, int, bytes]  # first byte, last byte, what stands there from now on


def write_like_source(
    before: Clip, after: Clip, path: StrPath, *, skeleton: StrPath | None = None
) -> bool:
    """Write a changed clip into the text of the file that it was read from.

    Parameters
    ----------
    before : Clip
        As it was read; its ``source`` names the file.
    after : Clip
        Of the same skeleton and length.
    path : path-like
        The file to write; of the source's format.
    skeleton : path-like, optional
        Of an AMC, the ASF it was read with; else it is found. Its text goes beside the file.

    Returns
    -------
    bool
        Whether it was written: not where the formats differ, or the source is not plain, is gone
        or has changed.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    target, source = Path(path), Path(before.source)
    suffix = target.suffix.lower()
    same = before.skeleton == after.skeleton and len(before) == len(after)
    if not same or suffix not in {".amc", ".bvh"} or source.suffix.lower() != suffix:
        return False
    try:
        text = source.read_bytes()
        asf = None if suffix == ".bvh" else Path(skeleton or find_skeleton(source)).read_bytes()
        parts = _bvh_parts if suffix == ".bvh" else _amc_parts
        changed = list(parts(text, before, after))
    except (OSError, FormatError, _NotPlainError):
        return False
    content = _with_parts(text, changed)
    if asf is None:
        with replacing(target) as (motion,):
            motion.write_bytes(content)
    else:
        with replacing(target, target.with_suffix(".asf")) as (motion, bones):
            motion.write_bytes(content)
            bones.write_bytes(asf)
    return True


class _NotPlainError(Exception):
    """The text of a source does not show where each channel of each frame stands."""


def _bvh_parts(text: bytes, before: Clip, after: Clip) -> Iterator[Part]:
    """Yield the numbers of a BVH that change."""
    header = FRAME_TIME.search(text)
    if header is None:
        raise _NotPlainError
    rows = list(ROW.finditer(text, header.end()))
    if len(rows) != len(before):
        raise _NotPlainError
    columns = range(before.skeleton.n_channels)
    for frame in _changed_frames(before, after):
        words = list(WORD.finditer(text, rows[frame].start(), rows[frame].end()))
        yield from _changed(words, columns, before.channels[frame], after.channels[frame])


def _amc_parts(text: bytes, before: Clip, after: Clip) -> Iterator[Part]:
    """Yield the numbers of an AMC that change."""
    starts = list(FRAME_NUMBER.finditer(text))
    if len(starts) != len(before):
        raise _NotPlainError
    skeleton = before.skeleton
    first = skeleton.channel_starts.tolist()
    columns = {
        name.encode(): range(first[joint], first[joint + 1])
        for joint, name in enumerate(skeleton.names)
    }
    ends = [*(start.start() for start in starts[1:]), len(text)]
    for frame in _changed_frames(before, after):
        found = 0
        for row in ROW.finditer(text, starts[frame].end(), ends[frame]):
            name, *words = WORD.finditer(text, row.start(), row.end())
            own = columns.get(name[0])
            if own is None:
                raise _NotPlainError
            found += len(own)
            yield from _changed(words, own, before.channels[frame], after.channels[frame])
        if found != skeleton.n_channels:
            raise _NotPlainError


def _changed_frames(before: Clip, after: Clip) -> list[int]:
    changed = (before.channels != after.channels).any(axis=1)
    return [int(frame) for frame in np.flatnonzero(changed)]


def _changed(
    words: Sequence[re.Match[bytes]], columns: range, before: FloatArray, after: FloatArray
) -> Iterator[Part]:
    """Yield the words of a row that change, once all are known to be what was read."""
    if len(words) != len(columns):
        raise _NotPlainError
    for word, column in zip(words, columns, strict=True):
        try:
            read = float(word[0])
        except ValueError:
            raise _NotPlainError from None
        if read != before[column]:
            raise _NotPlainError
        if before[column] != after[column]:
            yield word.start(), word.end(), _number(float(after[column]), word[0])


def _number(value: float, instead_of: bytes) -> bytes:
    """Return a number's text; a whole one is written without a point where the source has none."""
    if value.is_integer() and instead_of.lstrip(b"+-").isdigit():
        return str(int(value)).encode()
    return repr(value).encode()


def _with_parts(text: bytes, parts: Sequence[Part]) -> bytes:
    pieces = []
    at = 0
    for start, end, new in parts:
        pieces += [text[at:start], new]
        at = end
    return b"".join([*pieces, text[at:]])
