"""BVH files: a skeleton and its motion in one file.

Every joint's own CHANNELS order is honoured, position channels on any joint too, and End Sites
are kept as joints named ``<parent>_End``. The format states neither its unit of length nor its
vertical axis nor what position channels mean: `mocapdb.motion.body` finds out from the motion, and
the caller can override unit and axis.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import replacing
from mocapdb.errors import SkeletonError
from mocapdb.io._bvh_hierarchy import read_hierarchy
from mocapdb.io._bvh_motion import read_motion_header, read_rows
from mocapdb.io._file_order import depth_first, file_channels, file_dofs
from mocapdb.io._text import load_text
from mocapdb.motion.body import Given, understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton, UpAxis

__all__ = ["bvh_text", "read_bvh", "read_bvh_skeleton", "write_bvh"]

SOURCES = {"given": "caller", "found": "inferred", "assumed": "default"}
"""What `Clip.unit_source` calls the source of a finding."""


def read_bvh(
    path: StrPath,
    *,
    fps: float | None = None,
    metres_per_unit: float | None = None,
    up: UpAxis | None = None,
    joint_map: Mapping[str, str] | None = None,
    strict: bool = False,
) -> Clip:
    """Read a BVH, word by word: where its lines break does not matter.

    Parameters
    ----------
    path : path-like
        The file.
    fps : float, optional, frames per second
        Overrides the file's frame time, which `rate_of_frame_time` understands and
        ``frame_time_text`` keeps as it is spelt.
    metres_per_unit : float, optional
        Length of the file's unit; by default inferred from the lengths of the body's limbs.
    up : {"y", "z"}, optional
        The file's vertical axis; by default the one along which the head is above the feet.
    joint_map : mapping of str to str, optional
        Joints of the skeleton by the names of canonical joints, some of them or all.
    strict : bool
        Whether to refuse what would have to be mended.

    Raises
    ------
    FormatError
        If the file breaks the format beyond mending, with the line to blame.
    SkeletonError
        If the joint map does not fit.

    Notes
    -----
    The clip's provenance tells what was mended, what was inferred, and from what. Mended are the
    usual slips of exporters that lose nothing: other encodings, comments, End Sites with names or
    channels, several roots, names that come twice, rows that are wrapped or parted by commas, one
    row more or less than announced, scales of 1, a rate in place of the frame time.
    """
    text = load_text(path, strict=strict)
    hierarchy = read_hierarchy(text)
    skeleton = replace(hierarchy.skeleton, name=Path(path).stem, joint_map=joint_map or {})
    header = read_motion_header(text, hierarchy.stop)
    channels = read_rows(text, header, hierarchy)
    channels.flags.writeable = False

    steps = [f"read {Path(path).name}", *text.notes]
    body = understand(skeleton, channels, Given(unit_m=metres_per_unit, up=up))
    steps.extend(each.evidence for each in (body.up, body.unit_m) if each.source != "given")
    if body.adds_positions.value:
        steps.append(body.adds_positions.evidence)
    if body.odd_stature and body.unit_m.source == "found":
        steps.append(f"warning: {body.odd_stature}")
    if body.is_mirrored:
        steps.append(
            "warning: feet and knees point as if left were right, as in mirrored exports: the "
            "body's left is what is named right"
        )
    return Clip(
        replace(
            skeleton,
            metres_per_unit=body.unit_m.value,
            up=body.up.value,
            displaces=body.adds_positions.value,
            body_root=body.root.value,
        ),
        channels,
        header.fps if fps is None else fps,
        name=Path(path).stem,
        source=str(path),
        fps_source="file" if fps is None else "caller",
        unit_source=SOURCES[body.unit_m.source],
        up_source=SOURCES[body.up.source],
        frame_time_text=header.frame_time_text if fps is None else "",
        provenance=tuple(steps),
    )


def read_bvh_skeleton(path: StrPath) -> Skeleton:
    """Read the skeleton of a BVH without its motion, which alone tells unit and axis.

    Raises
    ------
    FormatError
        If the file breaks the format before the motion.
    """
    return read_hierarchy(load_text(path)).skeleton


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
        is_end_site = _is_end_site(skeleton, joint)
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


def _is_end_site(skeleton: Skeleton, joint: int) -> bool:
    """Tell a leaf that was an End Site, called by its parent, from a JOINT without channels."""
    if joint == 0 or skeleton.dofs[joint] or skeleton.children[joint]:
        return False
    parent = skeleton.names[skeleton.parents[joint]]
    return re.fullmatch(re.escape(parent) + r"_End\d*", skeleton.names[joint]) is not None


def _channel_name(dof: str) -> str:
    return dof[1].upper() + ("position" if dof[0] == "t" else "rotation")
