"""The MOTION part of a BVH file: how many frames, how fast, and the rows of numbers."""

from __future__ import annotations

import re
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.io._bvh_hierarchy import Hierarchy
from mocapdb.io._frame_text import Pattern, read_frames
from mocapdb.io._text import Text, parse_number
from mocapdb.io.frame_rates import rate_instead_of_time, rate_of_frame_time

__all__ = ["MotionHeader", "read_motion_header", "read_rows"]

FRAMES = re.compile(rb"\s*frames\s*(:?)[ \t]*([^\s:]+)([^\n]*)", re.IGNORECASE)
FRAME_TIME = re.compile(rb"\s*frame[ \t]*time\s*(:?)[ \t]*([^\s:]+)[ \t]*([a-z.]*)", re.IGNORECASE)
MOST_DIGITS = 15  # of a count of frames: more are wrong, and Python refuses thousands of digits
SHORTEST_S = 1e-6  # a shorter frame time is refused: no capture is so fast
WHOLE = re.compile(r"(\d+)(\.0*)?", re.ASCII)
COMMENT = re.compile(rb"\s*(#|//)[^\n]*\n")
WORD = re.compile(rb"\S")
WORDS = re.compile(rb"\S[^\n]*")
SECONDS = {b"s", b"sec", b"secs", b"second", b"seconds", b"s."}
FUSED = re.compile(r"(?<=[\d.])(?=[+-]\d)(?<![eE])")


class MotionHeader(NamedTuple):
    """What stands in front of the rows.

    Attributes
    ----------
    n_frames : int
    fps : float
    frame_time_text : str
        As spelt; empty where it was a rate.
    start : int
        The byte where the rows start.
    """

    n_frames: int
    fps: float
    frame_time_text: str
    start: int


def read_motion_header(text: Text, at: int) -> MotionHeader:
    """Read ``Frames:`` and ``Frame Time:`` from a byte on.

    Raises
    ------
    FormatError
        If one is missing or senseless, with its line.
    """
    at = _skip_comments(text, at)
    found = FRAMES.match(text.data, at)
    line = _line_at(text, at)
    if found is None:
        raise text.error(f"Expected 'Frames:' and a value, but got {_words_at(text, at)}.", line)
    count = found[2].decode()
    whole = WHOLE.fullmatch(count)
    if whole is None or len(whole[1]) > MOST_DIGITS:
        raise text.error(f"Expected a count of frames, but got {count!r:.60}.", line)
    n_frames = int(whole[1])
    if n_frames == 0:
        raise text.error("Expected at least one frame, but got Frames: 0.", line)
    if not found[1] or whole[2]:
        text.mend("the count of frames is spelt oddly", line)

    at = _skip_comments(text, found.start(3) if b"ime" in found[3].lower() else found.end())
    found = FRAME_TIME.match(text.data, at)
    line = _line_at(text, at)
    if found is None or b"\n" in found[0].lstrip():
        raise text.error(
            f"Expected 'Frame Time:' and a value, but got {_words_at(text, at)}.", line
        )
    spelt = found[2].decode()
    frame_time_s = parse_number(text, spelt, "Frame Time", line)
    if frame_time_s <= 0:
        raise text.error(f"Expected a positive frame time, but got {spelt}.", line)
    if not SHORTEST_S <= frame_time_s <= 1 / SHORTEST_S:
        raise text.error(f"Expected a frame time in seconds, but got {spelt:.60}.", line)
    if not found[1] or found[3]:
        text.mend("the frame time is spelt oddly", line)
    stop = found.end() if found[3].lower() in SECONDS else found.end(2)
    rate = rate_instead_of_time(spelt)
    if rate is not None:
        text.mend(f"Frame Time: {spelt} is taken as a rate of {rate:g} frames per second", line)
        return MotionHeader(n_frames, rate, "", stop)
    return MotionHeader(n_frames, rate_of_frame_time(spelt), spelt, stop)


def read_rows(text: Text, header: MotionHeader, hierarchy: Hierarchy) -> FloatArray:
    """Return the numbers of the rows as the skeleton's channels, (F, C).

    Raises
    ------
    FormatError
        If numbers are missing, are none, or cannot be assigned to frames.
    """
    width = len(hierarchy.columns)
    rows = None
    if width:
        most_frames = min(header.n_frames + 1, len(text.data) // (2 * width) + 1)
        pattern = Pattern([b""], [range(width)])
        rows = read_frames(text, header.start, pattern, width, most_frames)
    if rows is None or abs(len(rows) - header.n_frames) > 1 or len(rows) == 0:
        rows = _read_words(text, header, width)
    if len(rows) != header.n_frames:
        text.mend(f"Frames: says {header.n_frames}, but there are {len(rows)}")
    return rows if hierarchy.is_plain else _channels(text, rows, hierarchy)


def _read_words(text: Text, header: MotionHeader, width: int) -> FloatArray:
    """Read rows that are wrapped, parted by commas or with comments, or say what is wrong."""
    rows: list[list[str]] = []
    numbers: list[int] = []
    for _, (line, words) in text.lines(header.start, comment="#"):
        rows.append(_split(text, words, width, line))
        numbers.append(line)
    lengths = [len(row) for row in rows]
    if _is_wrapped(lengths, width, header.n_frames):
        text.mend("rows are wrapped over several lines", numbers[0])
    elif _has_extra_zeros(rows, lengths, width):
        text.mend(f"{lengths[0] - width} zeros too many in each row are left out", numbers[0])
        rows = [row[:width] for row in rows]
    else:
        for frame, (row, line) in enumerate(zip(rows, numbers, strict=True)):
            if len(row) != width:
                raise text.error(
                    f"Expected {width} values in frame {frame}, but got {len(row)}.", line
                )
    frames = (f"frame {i // max(width, 1)}" for i in range(sum(lengths)))
    values = [
        parse_number(text, word, next(frames), line)
        for row, line in zip(rows, numbers, strict=True)
        for word in row
    ]
    found = np.array(values).reshape(-1, max(width, 1))
    if abs(len(found) - header.n_frames) > 1 or len(found) == 0:
        raise text.error(f"Expected {header.n_frames} frames (Frames:), but got {len(found)} rows.")
    return found


def _split(text: Text, words: list[str], width: int, line: int) -> list[str]:
    """Return the words of a row: parted at commas, or where a minus begins the next number."""
    if len(words) == width:
        plain = [word.replace(",", ".") for word in words]
        if plain != words:
            text.mend("decimal commas are taken as points", line)
        return plain
    if any("," in word for word in words):
        parted = " ".join(words).replace(",", " ").split()
        if len(parted) == width:
            text.mend("commas between the numbers of a row are taken as blanks", line)
            return parted
    parted = [part for word in words for part in FUSED.split(word)]
    if len(parted) == width:
        text.mend("numbers with no blank before their minus are parted there", line)
        return parted
    return words


def _is_wrapped(lengths: list[int], width: int, n_frames: int) -> bool:
    """Tell whether lines that are no rows hold whole frames, about as many as announced."""
    total = sum(lengths)
    if width == 0 or total % width or abs(total // width - n_frames) > 1:
        return False
    if all(length == width for length in lengths):
        return False
    ends = set(accumulate(lengths))
    one_frame_a_start = all(end in ends for end in range(width, total + 1, width))
    return one_frame_a_start or (total // width == n_frames and len(set(lengths[:-1])) <= 1)


def _has_extra_zeros(rows: list[list[str]], lengths: list[int], width: int) -> bool:
    extra = {word for row in rows for word in row[width:]}
    return (
        bool(rows) and set(lengths) == {lengths[0]} and lengths[0] > width and extra <= {"0", "0.0"}
    )


def _channels(text: Text, rows: FloatArray, hierarchy: Hierarchy) -> FloatArray:
    """Return rows that hold more, or other, than the skeleton's channels as those."""
    skeleton, columns = hierarchy.skeleton, hierarchy.columns
    places = {
        (joint, dof): int(skeleton.channel_starts[joint]) + i
        for joint, dofs in enumerate(skeleton.dofs)
        for i, dof in enumerate(dofs)
    }
    channels = np.zeros((len(rows), skeleton.n_channels))
    repeated = hierarchy.repeated
    for i, (joint, dof) in enumerate(columns):
        name = skeleton.names[joint]
        if dof[0] == "s":
            if not np.allclose(rows[:, i], 1.0, rtol=0.0, atol=1e-6):
                frame = int(np.argmax(np.abs(rows[:, i] - 1.0)))
                raise text.error(
                    f"Expected joint {name!r} to keep its size, but its scale in frame {frame} is "
                    f"{rows[frame, i]:g}. Bake the scales into the bones before exporting."
                )
            text.mend("scales, all 1, are left out")
        elif joint in hierarchy.end_sites and dof[0] == "r":
            text.mend("rotations of End Sites, which turn nothing, are left out")
        elif joint not in repeated or dof[0] == "t":
            channels[:, places[joint, dof]] = rows[:, i]
    for joint, order in repeated.items():
        if joint in hierarchy.end_sites:
            continue
        at = [i for i, (j, dof) in enumerate(columns) if j == joint and dof[0] == "r"]
        angles = _in_other_order(order, skeleton.rotation_orders[joint], rows[:, at])
        channels[:, skeleton.rotation_columns(joint)] = angles
        text.mend(f"rotations {order} of {skeleton.names[joint]!r} are turned into others")
    return channels


def _in_other_order(before: str, after: str, angles_deg: FloatArray) -> FloatArray:
    """Return the angles about other axes that make the same rotations, without jumps."""
    from scipy.spatial.transform import Rotation

    from mocapdb.motion.rotations import continuous_angles

    turned = Rotation.from_euler(before, angles_deg, degrees=True).as_euler(after)
    return np.rad2deg(continuous_angles(after, turned))


def _skip_comments(text: Text, at: int) -> int:
    """Return where the next word is that is no comment."""
    while (found := COMMENT.match(text.data, at)) is not None:
        text.mend("comments are left out", _line_at(text, at))
        at = found.end()
    return at


def _line_at(text: Text, at: int) -> int | None:
    """Return the line of the next word, None at the end of the file."""
    found = WORD.search(text.data, at)
    return text.line_number(found.start()) if found else None


def _words_at(text: Text, at: int) -> str:
    """Return the next words of the file, to show in an error."""
    found = WORDS.search(text.data, at)
    if found is None:
        return "the end of the file"
    return repr(" ".join(found[0].decode(errors="replace").split()))[:62]
