"""Acclaim motion (AMC)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.files import replacing
from mocapdb.io._asf_text import acclaim_names
from mocapdb.io._file_order import file_channels
from mocapdb.io._frame_text import Pattern, read_frames
from mocapdb.io._text import Text, load_text, parse_number
from mocapdb.motion.clip import CODED, Clip
from mocapdb.motion.skeleton import Skeleton

__all__ = ["DEFAULT_FPS", "amc_text", "read_amc", "read_amc_rate", "write_amc"]

CODED_COMMENT = b"# decoded: a codec drew some of the curves"  # see `Clip.was_coded`
RATE_COMMENT = re.compile(rb"^# frame rate: (\d+\.?\d*)\s*$", re.MULTILINE)  # see `amc_text`
MOST_NUMBER = 2**62  # of a first frame, which the quick reader counts on from
DEFAULT_FPS = 120.0  # rate of CMU and HDM05: the format has no place for it


def read_amc(
    path: StrPath,
    skeleton: Skeleton,
    *,
    fps: float | None = None,
    default_fps: float = DEFAULT_FPS,
    strict: bool = False,
) -> Clip:
    """Read an Acclaim motion for its skeleton.

    Parameters
    ----------
    path : path-like
        The AMC.
    skeleton : Skeleton
        What `read_asf` gave for the ASF that belongs to it.
    fps : float, optional, frames per second
        The format does not state it: taken from ``:samples-per-second`` or from mocapdb's own
        comment where there is one, else `default_fps`, with ``fps_source`` ``"default"``.
    default_fps : float, frames per second
        What to take where nothing else tells.
    strict : bool
        Whether to refuse what would have to be mended: gaps in the count of frames, names in other
        letter case.

    Raises
    ------
    FormatError
        If the file breaks the format or does not belong to the skeleton, with the line to blame.
    """
    text = load_text(path, strict=strict)
    start, degrees_per_angle, stated_fps = _read_header(text)
    columns = _columns(skeleton)
    pattern = _first_pattern(text, start, columns)
    channels = None
    if pattern is not None:
        most_frames = text.data.count(b"\n", start) // (len(pattern.words) + 1)
        channels = read_frames(text, start, pattern, skeleton.n_channels, most_frames)
    if channels is None:
        channels = _read_carefully(text, start, columns, skeleton)
    provenance = [f"read {Path(path).name}", *text.notes]
    if CODED_COMMENT in text.data[:start]:
        provenance.append(f"{CODED} a codec before it was written: the file says so")
    if degrees_per_angle is None:
        provenance.append("angles taken as degrees: the file does not say")
    elif degrees_per_angle != 1.0:
        channels[:, skeleton.rotation_channels] *= degrees_per_angle
    channels.flags.writeable = False
    return Clip(
        skeleton,
        channels,
        fps or stated_fps or default_fps,
        name=Path(path).stem,
        source=str(path),
        fps_source="caller" if fps else "file" if stated_fps else "default",
        unit_source="file",
        up_source="default",  # the format does not state it
        provenance=tuple(provenance),
    )


def read_amc_rate(path: StrPath) -> float | None:
    """Return the frame rate that an AMC states, which few do.

    Raises
    ------
    FormatError
        If the file is no AMC.
    """
    return _read_header(load_text(path))[2]


def _read_header(text: Text) -> tuple[int, float | None, float | None]:
    """Return where the first frame starts, the degrees in a unit of angle, and the rate."""
    degrees_per_angle = fps = None
    for start, (number, words) in text.lines(comment="#"):
        if _is_frame_number(words):
            noted = RATE_COMMENT.search(text.data, 0, start)
            if fps is None and noted:
                fps = float(noted[1])
            return start, degrees_per_angle, fps
        match words[0].upper():
            case ":DEGREES":
                degrees_per_angle = 1.0
            case ":RADIANS":
                degrees_per_angle = float(np.rad2deg(1.0))
            case ":SAMPLES-PER-SECOND" if len(words) == 2:
                fps = parse_number(text, words[1], "samples per second", number)
                if fps <= 0:
                    raise text.error(f"Expected a positive rate, but got {words[1]}.", number)
            case ":FULLY-SPECIFIED":
                pass
            case _:
                raise text.error(
                    f"Expected :FULLY-SPECIFIED, :DEGREES, :RADIANS or the number of the first "
                    f"frame, but got {words[0]!r}.",
                    number,
                )
    raise text.error("Expected at least one frame, but got none.")


def _is_frame_number(words: list[str]) -> bool:
    return len(words) == 1 and words[0].isascii() and words[0].isdigit()


def _columns(skeleton: Skeleton) -> dict[str, range]:
    """Return the columns of each joint that has any."""
    starts = skeleton.channel_starts.tolist()
    return {
        name: range(first, last)
        for name, first, last in zip(skeleton.names, starts, starts[1:], strict=False)
        if last > first
    }


def _first_pattern(text: Text, start: int, columns: dict[str, range]) -> Pattern | None:
    """Return the pattern of the first frame, or None if it is not a plain one."""
    lines = text.lines(start)
    first_number = int(next(lines)[1].words[0])
    if first_number > MOST_NUMBER:  # the careful reader takes it
        return None
    found: dict[str, range] = {}
    for _, (_, words) in lines:
        if _is_frame_number(words):
            break
        if words[0] not in columns or words[0] in found:
            return None
        found[words[0]] = columns[words[0]]
    if len(found) < len(columns):
        return None
    return Pattern([name.encode() for name in found], list(found.values()), first_number)


def _read_carefully(
    text: Text, start: int, columns: dict[str, range], skeleton: Skeleton
) -> FloatArray:
    """Read what has comments or changes the order of its joints, or say what is wrong."""
    frames: list[FloatArray] = []
    missing: set[str] = set()
    frame_number = frame_line = 0
    for _, (number, words) in text.lines(start, comment="#"):
        if _is_frame_number(words):
            if frames:
                _check_complete(text, missing, frame_number, number)
                if int(words[0]) <= frame_number:
                    raise text.error(
                        f"Expected frame {frame_number + 1}, but got frame {words[0]}.", number
                    )
                if int(words[0]) > frame_number + 1:
                    text.mend(f"frame {words[0]} follows frame {frame_number} directly", number)
            frame_number, frame_line = int(words[0]), number
            frames.append(np.full(skeleton.n_channels, np.nan))
            missing = set(columns)
            continue
        joint, *values = words
        if joint not in columns:
            joint = _spelt_as(text, joint, columns, number)
        if joint not in missing:
            raise text.error(_unexpected(joint, values, frame_number, columns, skeleton), number)
        missing.remove(joint)
        if len(values) != len(columns[joint]):
            raise text.error(
                f"Expected {len(columns[joint])} values for joint {joint!r} in frame "
                f"{frame_number}, but got {len(values)}.",
                number,
            )
        what = f"joint {joint!r} in frame {frame_number}"
        for column, word in zip(columns[joint], values, strict=True):
            frames[-1][column] = parse_number(text, word, what, number)
    if missing:
        first = next(name for name in columns if name in missing)
        raise text.error(
            f"Expected frame {frame_number} to have {len(columns)} joints, but the file ends with "
            f"{len(missing)} of them missing, such as {first!r}. It may be cut off.",
            frame_line,
        )
    return np.stack(frames)


def _spelt_as(text: Text, joint: str, columns: dict[str, range], line: int) -> str:
    """Return the name of a joint as its skeleton spells it, if only the letter case differs."""
    alike = [name for name in columns if name.lower() == joint.lower()]
    if len(alike) != 1:
        return joint
    text.mend(f"{joint!r} is spelt {alike[0]!r}", line)
    return alike[0]


def _check_complete(text: Text, missing: set[str], frame_number: int, line: int) -> None:
    """Raise if a frame ended without all of its joints."""
    if missing:
        raise text.error(
            f"Expected frame {frame_number} to have every joint of the skeleton, but got a "
            f"missing joint: {', '.join(sorted(missing))}.",
            line,
        )


def _unexpected(
    joint: str, values: list[str], frame: int, columns: dict[str, range], skeleton: Skeleton
) -> str:
    """Say why a line cannot start with that word."""
    if joint in columns:
        return f"Expected each joint once in frame {frame}, but got {joint!r} twice."
    if joint in skeleton.names:
        return f"Expected no values for joint {joint!r}, but got {len(values)}."
    return (
        f"Expected a joint of skeleton {skeleton.name!r}, but got {joint!r}. "
        "Pass the skeleton that belongs to this motion."
    )


def write_amc(clip: Clip, path: StrPath, *, decimals: int | None = None) -> None:
    """Write a clip in Acclaim's convention; `mocapdb.io.asf.write_asf` writes its skeleton.

    Parameters
    ----------
    clip : Clip
        `mocapdb.io.conventions.to_acclaim_convention` makes one of most clips.
    path : path-like
        The file.
    decimals : int, optional
        Decimals of the channels; as many as it takes to read the same doubles by default.

    Raises
    ------
    SkeletonError
        If the clip is in another convention, or its skeleton cannot be written as an ASF.
    FormatError
        If the file cannot be written.
    """
    with replacing(path) as (temporary,):
        temporary.write_text(amc_text(clip, decimals), encoding="utf-8", newline="\n")


def amc_text(clip: Clip, decimals: int | None = None) -> str:
    """Return a clip as the text of an AMC file; see `write_amc`."""
    skeleton = clip.skeleton
    names = acclaim_names(skeleton)
    moving = [joint for joint, dofs in enumerate(skeleton.dofs) if dofs]
    channels = file_channels(skeleton, moving, clip.channels, decimals)
    joint_lines = (
        " ".join([names[joint], *["%r"] * len(skeleton.dofs[joint])]) for joint in moving
    )
    frame = "\n".join(["%d", *joint_lines, ""])
    coded = f"{CODED_COMMENT.decode()}\n" if clip.was_coded else ""
    header = f"# frame rate: {_rate_text(clip.fps)}\n{coded}:FULLY-SPECIFIED\n:DEGREES\n"
    return header + "".join(
        frame % (number, *row) for number, row in enumerate(channels.tolist(), start=1)
    )


def _rate_text(fps: float) -> str:
    """Return a rate in as few digits as give it again."""
    short = f"{fps:g}"
    return short if float(short) == fps else repr(fps)
