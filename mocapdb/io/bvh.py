"""BVH files: a skeleton and its motion in one file.

Every joint's own CHANNELS order is honoured, position channels on any joint too, and End Sites
are kept as joints named ``<parent>_End``. The format states neither its unit of length nor its
vertical axis nor what position channels mean: `mocapdb.motion.body` finds out from the motion, and
the caller can override unit and axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from mocapdb.base.arrays import FloatArray, StrPath
from mocapdb.base.files import replacing
from mocapdb.errors import SkeletonError
from mocapdb.io._bvh_hierarchy import read_hierarchy
from mocapdb.io._frame_text import Pattern, read_frames
from mocapdb.io._layout import depth_first, file_channels, file_dofs
from mocapdb.io._text import Line, Text, load_text, parse_number
from mocapdb.motion.body import Given, understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton, UpAxis

__all__ = ["bvh_text", "read_bvh", "write_bvh"]

COMMON_RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0)
RATE_TOLERANCE = 0.002


def read_bvh(
    path: StrPath,
    *,
    fps: float | None = None,
    metres_per_unit: float | None = None,
    up: UpAxis | None = None,
) -> Clip:
    """Read a BVH.

    Parameters
    ----------
    path : path-like
        The file.
    fps : float, optional, frames per second
        Overrides the file's frame time. That one is taken as 1/24, 1/25, 1/30, 1/48, 1/50, 1/60,
        1/100 or 1/120 s when within 0.2 % of it; ``frame_time_text`` keeps its spelling.
    metres_per_unit : float, optional
        Length of the file's unit; by default inferred from the lengths of the body's limbs.
    up : {"y", "z"}, optional
        The file's vertical axis; by default the one along which the head is above the feet.

    Raises
    ------
    FormatError
        If the file breaks the format, with the line to blame.

    Notes
    -----
    The clip's provenance tells what was inferred, and from what.
    """
    text = load_text(path)
    skeleton, motion = read_hierarchy(text)
    n_frames, frame_time_text, start = _read_motion_header(text, text.lines(motion))
    pattern = Pattern([b""], [range(skeleton.n_channels)])
    most_frames = min(n_frames, len(text.data) // (2 * skeleton.n_channels + 1))
    channels = read_frames(text, start, pattern, skeleton.n_channels, most_frames)
    if channels is None or len(channels) != n_frames:
        channels = _read_carefully(text, start, n_frames, skeleton)
    channels.flags.writeable = False

    steps = [f"read {Path(path).name}"]
    body = understand(skeleton, channels, Given(unit_m=metres_per_unit, up=up))
    steps.extend(each.evidence for each in (body.up, body.unit_m) if each.source != "given")
    if body.adds_positions.value:
        steps.append(body.adds_positions.evidence)
    return Clip(
        replace(
            skeleton,
            name=Path(path).stem,
            metres_per_unit=body.unit_m.value,
            up=body.up.value,
            displaces=body.adds_positions.value,
        ),
        channels,
        _snapped_rate(float(frame_time_text)) if fps is None else fps,
        name=Path(path).stem,
        source=str(path),
        fps_source="file" if fps is None else "caller",
        frame_time_text=frame_time_text if fps is None else "",
        provenance=tuple(steps),
    )


def _read_motion_header(text: Text, lines: Iterator[tuple[int, Line]]) -> tuple[int, str, int]:
    """Return the count of frames, the frame time as spelt, and where the first frame starts."""
    _, count, number = _read_field(text, lines, "Frames:")
    if not (count.isascii() and count.isdigit()):
        raise text.error(f"Expected a count of frames, but got {count!r}.", number)
    if int(count) == 0:
        raise text.error("Expected at least one frame, but got Frames: 0.", number)
    at, frame_time, number = _read_field(text, lines, "Frame Time:")
    if parse_number(text, frame_time, "Frame Time", number) <= 0:
        raise text.error(f"Expected a positive frame time, but got {frame_time}.", number)
    return int(count), frame_time, text.data.index(b"\n", at) + 1


def _read_field(text: Text, lines: Iterator[tuple[int, Line]], key: str) -> tuple[int, str, int]:
    """Return where the next line starts, the value after its key, and its number."""
    for at, (number, words) in lines:
        found, colon, value = " ".join(words).partition(":")
        if (found.strip() + colon).lower() != key.lower() or not value.strip():
            raise text.error(
                f"Expected {key!r} and a value, but got {' '.join(words)!r:.60}.", number
            )
        return at, value.strip(), number
    raise text.error(f"Expected {key!r}, but the file ends.")


def _read_carefully(text: Text, start: int, n_frames: int, skeleton: Skeleton) -> FloatArray:
    """Read the rows one by one, to say what is wrong."""
    rows: list[list[float]] = []
    for _, (number, words) in text.lines(start):
        if len(words) != skeleton.n_channels:
            raise text.error(
                f"Expected {skeleton.n_channels} values in frame {len(rows)}, "
                f"but got {len(words)}.",
                number,
            )
        what = f"frame {len(rows)}"
        rows.append([parse_number(text, word, what, number) for word in words])
    if len(rows) != n_frames:
        raise text.error(f"Expected {n_frames} frames (Frames:), but got {len(rows)} rows.")
    return np.array(rows)


def _snapped_rate(frame_time_s: float) -> float:
    """Return the common rate that a frame time stands for, or else its inverse."""
    nearest = min(COMMON_RATES, key=lambda rate: abs(rate * frame_time_s - 1))
    if abs(nearest * frame_time_s - 1) <= RATE_TOLERANCE:
        return nearest
    return round(1 / frame_time_s, 9)  # so that a frame time written in full gives its rate again


def write_bvh(clip: Clip, path: StrPath, *, decimals: int | None = None) -> None:
    """Write a clip in BVH's convention.

    Parameters
    ----------
    clip : Clip
        `mocapdb.io.conventions.to_bvh_convention` makes one of any clip.
    path : path-like
        The file.
    decimals : int, optional
        Decimals of the channels; as many as it takes to read the same doubles by default.

    Raises
    ------
    SkeletonError
        If the clip is in another convention, or a name cannot be spelt in a BVH.
    FormatError
        If the file cannot be written.
    """
    with replacing(path) as (temporary,):
        temporary.write_text(bvh_text(clip, decimals), encoding="utf-8", newline="\n")


def bvh_text(clip: Clip, decimals: int | None = None) -> str:
    """Return a clip as the text of a BVH file; see `write_bvh`."""
    skeleton = clip.skeleton
    if skeleton.convention != "bvh":
        raise SkeletonError(
            f"Expected a clip in BVH's convention, but {clip.name!r} is in "
            f"{skeleton.convention}'s. Use to_bvh_convention."
        )
    joints = [joint for joint, _ in depth_first(skeleton)]
    channels = file_channels(skeleton, joints, clip.channels, decimals)
    frame_time = clip.frame_time_text or repr(1 / clip.fps)
    lines = [*_hierarchy_lines(skeleton), "MOTION", f"Frames: {len(clip)}"]
    lines.append(f"Frame Time: {frame_time}")
    lines.extend(" ".join(map(repr, row)) for row in channels.tolist())
    return "\n".join(lines) + "\n"


def _hierarchy_lines(skeleton: Skeleton) -> Iterator[str]:
    """Yield the lines of the HIERARCHY part."""
    yield "HIERARCHY"
    n_open = 0
    for joint, depth in depth_first(skeleton):
        while n_open > depth:
            n_open -= 1
            yield "\t" * n_open + "}"
        indent = "\t" * depth
        name = skeleton.names[joint]
        if (
            not name
            or not name.isprintable()
            or name != " ".join(name.split())
            or set(name) & set("{}")
        ):
            raise SkeletonError(f"Expected a name that a BVH can spell, but got {name!r}.")
        dofs = file_dofs(skeleton, joint)
        is_end_site = joint > 0 and not dofs and not skeleton.children[joint]
        if is_end_site:
            yield f"{indent}End Site"
        else:
            yield f"{indent}{'JOINT' if joint else 'ROOT'} {name}"
        yield indent + "{"
        yield f"{indent}\tOFFSET {' '.join(map(repr, skeleton.offsets[joint].tolist()))}"
        if not is_end_site:
            yield f"{indent}\tCHANNELS {' '.join([str(len(dofs)), *map(_channel_name, dofs)])}"
        n_open = depth + 1
    while n_open:
        n_open -= 1
        yield "\t" * n_open + "}"


def _channel_name(dof: str) -> str:
    return dof[1].upper() + ("position" if dof[0] == "t" else "rotation")
