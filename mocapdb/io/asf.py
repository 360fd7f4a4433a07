"""Acclaim skeletons (ASF)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import replacing
from mocapdb.errors import SkeletonError
from mocapdb.io._asf_text import AXES, METRES_PER_INCH, ROOT, asf_text
from mocapdb.io._text import Line, Text, load_text, parse_number
from mocapdb.motion.skeleton import Skeleton

__all__ = ["AcclaimSkeleton", "read_asf", "read_asf_file", "write_asf"]

SKIPPED_SECTIONS = {":version", ":name", ":documentation", ":skin", ":namespace"}
RATE_SECTION = ":samples-per-second"
SECTIONS = {":units", ":root", ":bonedata", ":hierarchy", RATE_SECTION}
SKIPPED_BONE_FIELDS = {"id", "bodymass", "cofmass", "limits"}


@dataclass
class _Bone:
    """One bone as an ASF describes it; degrees."""

    line: int
    name: str = ""
    direction: tuple[float, ...] | None = None
    length: float | None = None
    axis: tuple[float, ...] = (0.0, 0.0, 0.0)
    dofs: tuple[str, ...] = ()
    rotation_order: str = ""
    offset: tuple[float, ...] = (0.0, 0.0, 0.0)


@dataclass
class _Units:
    length: float = 1.0
    states_length: bool = False
    degrees_per_angle: float = 1.0


@dataclass
class _Sections:
    """The lines of an ASF by section, comments and blank lines left out."""

    text: Text
    lines: dict[str, list[Line]] = field(default_factory=dict)
    starts: dict[str, int] = field(default_factory=dict)

    def get(self, name: str) -> list[Line]:
        if name not in self.lines:
            raise self.text.error(f"Expected a {name} section, but there is none.")
        return self.lines[name]


class AcclaimSkeleton(NamedTuple):
    """What an ASF holds.

    Attributes
    ----------
    skeleton : Skeleton
    fps : float or None
        Of ``:samples-per-second``, which few files have.
    states_unit : bool
        Whether the file names its unit of length: an inch is taken otherwise.
    notes : tuple of str
        What was mended.
    """

    skeleton: Skeleton
    fps: float | None
    states_unit: bool
    notes: tuple[str, ...]


def read_asf(path: StrPath, *, strict: bool = False) -> Skeleton:
    """Read an Acclaim skeleton; see `read_asf_file` for all that the file says.

    Raises
    ------
    FormatError
        If the file breaks the format, with the line to blame.
    """
    return read_asf_file(path, strict=strict).skeleton


def read_asf_file(path: StrPath, *, strict: bool = False) -> AcclaimSkeleton:
    """Read an Acclaim skeleton.

    Joints come depth-first in the order of the ``:hierarchy`` section. Angles are converted to
    degrees, offsets stay in the file's unit (``length 0.45`` means units of 1 / 0.45 inches).

    Parameters
    ----------
    path : path-like
        The file.
    strict : bool
        Whether to refuse what would have to be mended: names in other letter case, an axis without
        an order.

    Raises
    ------
    FormatError
        If the file breaks the format beyond mending, with the line to blame.
    """
    text = load_text(path, strict=strict)
    sections = _split(text)
    units = _read_units(text, sections.lines.get(":units", []))
    root = _read_root(text, sections.get(":root"), sections.starts[":root"], units)
    bones = {ROOT: root}
    for bone in _read_bones(text, sections.get(":bonedata"), units):
        if bone.name in bones:
            raise text.error(f"Expected each bone once, but got {bone.name!r} twice.", bone.line)
        bones[bone.name] = bone
    children = _read_hierarchy(text, sections.get(":hierarchy"), bones)
    order = _depth_first(children)
    if len(order) < len(bones):
        lost = next(bone for name, bone in bones.items() if name not in order)
        raise text.error(
            f"Expected every bone to hang from the root, but {lost.name!r} does not: the "
            ":hierarchy section leaves it out, or runs in a cycle.",
            lost.line,
        )
    joints = [bones[name] for name in order]
    fps = _read_rate(text, sections.lines.get(RATE_SECTION, []))
    try:
        skeleton = Skeleton(
            names=list(order),
            parents=list(order.values()),
            offsets=[bone.offset for bone in joints],
            dofs=[bone.dofs for bone in joints],
            rotation_orders=[bone.rotation_order for bone in joints],
            axis_deg=[bone.axis for bone in joints],
            convention="acclaim",
            metres_per_unit=METRES_PER_INCH / units.length,
            up="y",
            name=Path(path).stem,
        )
    except SkeletonError as problem:
        raise text.error(str(problem)) from None
    return AcclaimSkeleton(skeleton, fps, units.states_length, tuple(text.notes))


def _split(text: Text) -> _Sections:
    """Part the lines of an ASF by section."""
    sections = _Sections(text)
    name = ""
    # Documentation may hold any bytes; its lines are never decoded strictly.
    for number, raw in enumerate(text.data.split(b"\n"), start=1):
        words = raw.partition(b"#")[0].decode(errors="surrogateescape").split()
        if not words:
            continue
        if words[0].startswith(":"):
            name = words[0].lower()
            if name not in SECTIONS | SKIPPED_SECTIONS:
                raise text.error(f"Expected a section of an ASF, but got {words[0]!r}.", number)
            if name in sections.lines:
                raise text.error(f"Expected each section once, but got {name} twice.", number)
            sections.lines[name] = []
            sections.starts[name] = number
            words = words[1:]
        elif not name:
            raise text.error(f"Expected a section such as :version, but got {words[0]!r}.", number)
        if name in SKIPPED_SECTIONS or not words:
            continue
        if not all(word.isprintable() for word in words):  # a lone surrogate is not printable
            raise text.error("Expected UTF-8 text, but got other bytes.", number)
        sections.lines[name].append(Line(number, words))
    return sections


def _read_rate(text: Text, lines: Sequence[Line]) -> float | None:
    """Read the ``:samples-per-second`` section, if there is one."""
    if not lines:
        return None
    number, words = lines[0]
    fps = _numbers(text, words, 1, "samples per second", number)[0]
    if fps <= 0:
        raise text.error(f"Expected positive samples per second, but got {words[0]}.", number)
    return fps


def _read_units(text: Text, lines: Sequence[Line]) -> _Units:
    """Read the ``:units`` section."""
    units = _Units()
    for number, (key, *values) in lines:
        match key.lower():
            case "length":
                units.length = _numbers(text, values, 1, "length", number)[0]
                units.states_length = True
                if units.length <= 0:
                    raise text.error(
                        f"Expected a positive unit of length, but got {values[0]}.", number
                    )
            case "angle":
                angles = {"deg": 1.0, "rad": float(np.rad2deg(1.0))}
                unit = " ".join(values).lower()[:3]
                if unit not in angles:
                    raise text.error(f"Expected angle deg or rad, but got {values}.", number)
                units.degrees_per_angle = angles[unit]
            case "mass":
                pass
            case _:
                raise text.error(f"Expected mass, length or angle, but got {key!r}.", number)
    return units


def _read_root(text: Text, lines: Sequence[Line], start: int, units: _Units) -> _Bone:
    """Read the ``:root`` section."""
    root = _Bone(start, name=ROOT)
    order = AXES
    for number, (key, *values) in lines:
        match key.lower():
            case "order":
                root.dofs = tuple(value.lower() for value in values)
            case "axis":
                order = _axis_order(text, values, number)
            case "position":
                root.offset = _numbers(text, values, 3, "position", number)
            case "orientation":
                root.axis = _degrees(_numbers(text, values, 3, "orientation", number), units)
            case _:
                raise text.error(
                    f"Expected order, axis, position or orientation, but got {key!r}.", number
                )
    turning = {dof[1:].upper() for dof in root.dofs if dof[0] == "r"}
    root.rotation_order = "".join(axis for axis in reversed(order) if axis in turning)
    return root


def _read_bones(text: Text, lines: Sequence[Line], units: _Units) -> Iterator[_Bone]:
    """Yield the bones of the ``:bonedata`` section."""
    bone: _Bone | None = None
    for number, (key, *values) in lines:
        match key.lower():
            case "begin" if bone is None:
                bone = _Bone(number)
            case "end" if bone is not None:
                yield _finished(text, bone)
                bone = None
            case "begin" | "end":
                raise text.error("Expected begin and end in turn, but one is missing.", number)
            case _ if bone is None:
                raise text.error(f"Expected begin, but got {key!r}.", number)
            case _:
                _read_bone_field(text, bone, key.lower(), values, number, units)
    if bone is not None:
        raise text.error("Expected end after the last bone, but the section stops.", bone.line)


def _read_bone_field(
    text: Text, bone: _Bone, key: str, values: list[str], number: int, units: _Units
) -> None:
    """Read one line of a bone."""
    match key:
        case "name":
            if len(values) != 1:
                raise text.error(f"Expected a name of one word, but got {values}.", number)
            bone.name = values[0]
        case "direction":
            bone.direction = _numbers(text, values, 3, "direction", number)
        case "length":
            bone.length = _numbers(text, values, 1, "length", number)[0]
            if bone.length < 0:
                raise text.error(f"Expected a length of 0 or more, but got {values[0]}.", number)
        case "axis":
            order = _axis_order(text, values[3:], number) if values[3:] else AXES
            if not values[3:]:
                text.mend("an axis without an order is taken as XYZ", number)
            angles = _degrees(_numbers(text, values[:3], 3, "axis", number), units)
            bone.axis = _xyz_angles(angles, order)
        case "dof":
            bone.dofs = tuple(value.lower() for value in values)
            if not set(bone.dofs) <= {"rx", "ry", "rz"} or len(set(bone.dofs)) < len(bone.dofs):
                raise text.error(
                    f"Expected dof to be different ones out of rx ry rz, but got "
                    f"{' '.join(values)}. Bones that stretch or move are not supported.",
                    number,
                )
            bone.rotation_order = "".join(dof[1].upper() for dof in reversed(bone.dofs))
        case _ if key not in SKIPPED_BONE_FIELDS and not key.startswith("("):
            raise text.error(f"Expected a field of a bone, but got {key!r}.", number)


def _finished(text: Text, bone: _Bone) -> _Bone:
    """Return the bone with its offset, once all of its fields are read."""
    if not bone.name:
        raise text.error("Expected the bone to have a name, but it has none.", bone.line)
    if bone.direction is None or bone.length is None:
        raise text.error(
            f"Expected bone {bone.name!r} to have a direction and a length.", bone.line
        )
    bone.offset = tuple(bone.length * part for part in bone.direction)
    return bone


def _read_hierarchy(
    text: Text, lines: Sequence[Line], bones: dict[str, _Bone]
) -> dict[str, list[str]]:
    """Return the children of each bone that has some, from the ``:hierarchy`` section."""
    if not lines or lines[0].words != ["begin"] or lines[-1].words != ["end"]:
        raise text.error("Expected the :hierarchy section to run from begin to end.")
    children: dict[str, list[str]] = {}
    placed: set[str] = {ROOT}
    for number, words in lines[1:-1]:
        parent, *names = (_spelt_as(text, name, bones, number) for name in words)
        for name in names:
            if name in placed:
                raise text.error(
                    f"Expected a tree, but {name!r} has several parents or is the root.", number
                )
            placed.add(name)
        children.setdefault(parent, []).extend(names)
    return children


def _spelt_as(text: Text, name: str, bones: dict[str, _Bone], line: int) -> str:
    """Return the name of a bone as ``:bonedata`` spells it."""
    if name in bones:
        return name
    alike = [bone for bone in bones if bone.lower() == name.lower()]
    if len(alike) != 1:
        raise text.error(f"Expected a bone of :bonedata, but got {name!r}.", line)
    text.mend(f"{name!r} is spelt {alike[0]!r}", line)
    return alike[0]


def _depth_first(children: dict[str, list[str]]) -> dict[str, int]:
    """Return the bones that hang from the root, depth-first, with the index of each parent."""
    parents: dict[str, int] = {}
    waiting = [(ROOT, -1)]
    while waiting:
        name, parent = waiting.pop()
        index = len(parents)
        parents[name] = parent
        waiting.extend((child, index) for child in reversed(children.get(name, [])))
    return parents


def _numbers(
    text: Text, words: Sequence[str], count: int, what: str, line: int
) -> tuple[float, ...]:
    """Return `count` numbers."""
    if len(words) != count:
        raise text.error(f"Expected {count} numbers for {what}, but got {len(words)}.", line)
    return tuple(parse_number(text, word, what, line) for word in words)


def _degrees(angles: Sequence[float], units: _Units) -> tuple[float, ...]:
    return tuple(angle * units.degrees_per_angle for angle in angles)


def _axis_order(text: Text, words: Sequence[str], line: int) -> str:
    """Return the order of an ``axis``, such as ``"XYZ"``."""
    order = "".join(words).upper()
    if sorted(order) != list(AXES):
        raise text.error(f"Expected an order of axes such as XYZ, but got {order!r}.", line)
    return order


def _xyz_angles(angles: tuple[float, ...], order: str) -> tuple[float, ...]:
    """Return the angles about x, y and z in order XYZ that give the rotation of another order.

    The angles belong to x, y and z whatever the order; the first letter is applied first.
    """
    if order == AXES:
        return angles
    from scipy.spatial.transform import Rotation

    in_order = [angles[AXES.index(axis)] for axis in order]
    rotation = Rotation.from_euler(order.lower(), in_order, degrees=True)
    return tuple(float(angle) for angle in rotation.as_euler("xyz", degrees=True))


def write_asf(skeleton: Skeleton, path: StrPath) -> None:
    """Write a skeleton in Acclaim's convention; reading it gives the same doubles.

    Raises
    ------
    SkeletonError
        If the skeleton is in another convention, is not y up, has joints other than the root that
        move, or names that an ASF cannot spell.
    FormatError
        If the file cannot be written.
    """
    with replacing(path) as (temporary,):
        temporary.write_text(asf_text(skeleton), encoding="utf-8", newline="\n")
