"""The HIERARCHY part of a BVH file."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from mocapdb.errors import SkeletonError
from mocapdb.io._text import Text, parse_number
from mocapdb.motion.skeleton import Skeleton

__all__ = ["read_hierarchy"]

MOTION = re.compile(rb"^[ \t\r]*motion(?=\s)[^\n]*\n", re.IGNORECASE | re.MULTILINE)
BRACES = re.compile(r"([{}])")
CHANNEL_DOFS = {
    f"{axis}{kind}": kind[0].replace("p", "t") + axis
    for kind in ("position", "rotation")
    for axis in "xyz"
}

MOST_REMEMBERED = 64
_remembered: dict[bytes, Skeleton] = {}


@dataclass
class _Joint:
    """One joint as it is met."""

    name: str
    parent: int
    line: int
    offset: tuple[float, ...] | None = None
    dofs: tuple[str, ...] | None = None


@dataclass
class _Hierarchy:
    """The joints so far, and the ones whose braces are open."""

    text: Text
    joints: list[_Joint] = field(default_factory=list)
    names: set[str] = field(default_factory=set)
    open_joints: list[int] = field(default_factory=list)
    awaits_brace: bool = False

    def read(self, number: int, words: list[str]) -> None:
        """Take in the words of a line: a brace alone, or words without braces."""
        key = words[0].upper()
        if self.awaits_brace and key != "{":
            raise self.text.error(
                f"Expected an opening brace after joint {self.joints[-1].name!r}, "
                f"but got {words[0]!r}.",
                number,
            )
        match key:
            case "ROOT" | "JOINT":
                self._open(key, " ".join(words[1:]), number)
            case "END" if len(words) == 2 and words[1].upper() == "SITE":
                self._open("END", "", number)
            case "{":
                if not self.awaits_brace:
                    raise self.text.error("Expected a joint before an opening brace.", number)
                self.awaits_brace = False
            case "}":
                self._close(number)
            case "OFFSET":
                self._read_offset(words[1:], number)
            case "CHANNELS":
                self._read_channels(words[1:], number)
            case _:
                raise self.text.error(
                    "Expected ROOT, JOINT, End Site, OFFSET, CHANNELS, a brace or MOTION, "
                    f"but got {words[0]!r}.",
                    number,
                )

    def _open(self, key: str, name: str, number: int) -> None:
        if (key == "ROOT") != (not self.joints):
            raise self.text.error("Expected one ROOT, before every JOINT and End Site.", number)
        if self.joints and not self.open_joints:
            raise self.text.error(
                f"Expected MOTION after the root's closing brace, but got {key}. "
                "Several bodies in one file are not supported.",
                number,
            )
        if key != "END" and not name:
            raise self.text.error("Expected the joint to have a name, but it has none.", number)
        parent = self.open_joints[-1] if self.open_joints else -1
        joint = _Joint(name, parent, number)
        if key == "END":
            joint.dofs = ()
        elif name in self.names:
            raise self.text.error(f"Expected each joint once, but got {name!r} twice.", number)
        else:
            self.names.add(name)
        self.open_joints.append(len(self.joints))
        self.joints.append(joint)
        self.awaits_brace = True

    def _close(self, number: int) -> None:
        if not self.open_joints:
            raise self.text.error("Expected as many closing as opening braces.", number)
        joint = self.joints[self.open_joints.pop()]
        if joint.offset is None:
            raise self.text.error(
                f"Expected joint {joint.name or 'End Site'!r} to have an OFFSET.", joint.line
            )

    def _current(self, key: str, number: int) -> _Joint:
        if not self.open_joints:
            raise self.text.error(f"Expected {key} within a joint's braces.", number)
        return self.joints[self.open_joints[-1]]

    def _read_offset(self, words: list[str], number: int) -> None:
        joint = self._current("OFFSET", number)
        if joint.offset is not None:
            raise self.text.error("Expected one OFFSET for each joint, but got two.", number)
        if len(words) != 3:
            raise self.text.error(f"Expected OFFSET with 3 numbers, but got {len(words)}.", number)
        joint.offset = tuple(parse_number(self.text, word, "OFFSET", number) for word in words)

    def _read_channels(self, words: list[str], number: int) -> None:
        joint = self._current("CHANNELS", number)
        if joint.dofs is not None:
            raise self.text.error("Expected one CHANNELS for each joint, but got two.", number)
        count, names = (words[0], words[1:]) if words else ("", [])
        if count != str(len(names)):
            raise self.text.error(
                f"Expected CHANNELS to start with the count of names, {len(names)}, "
                f"but got {count!r}.",
                number,
            )
        unknown = [name for name in names if name.lower() not in CHANNEL_DOFS]
        if unknown:
            raise self.text.error(
                f"Expected channels such as Xposition or Zrotation, but got {unknown[0]!r}.",
                number,
            )
        joint.dofs = tuple(CHANNEL_DOFS[name.lower()] for name in names)

    def skeleton(self) -> Skeleton:
        """Return the joints as a skeleton in metres, Y up."""
        joints = self.joints
        names = _with_end_sites(joints, set(self.names))
        try:
            return Skeleton(
                names=names,
                parents=[joint.parent for joint in joints],
                offsets=np.array([joint.offset for joint in joints], dtype=np.float64),
                dofs=[joint.dofs or () for joint in joints],
                rotation_orders=[
                    "".join(dof[1].upper() for dof in joint.dofs or () if dof[0] == "r")
                    for joint in joints
                ],
                convention="bvh",
            )
        except SkeletonError as problem:
            raise self.text.error(str(problem)) from None


def read_hierarchy(text: Text) -> tuple[Skeleton, int]:
    """Read the lines up to and including MOTION.

    The takes of one body share one hierarchy, so the last ones are remembered.

    Returns
    -------
    Skeleton
        Without a name, its unit and vertical axis still open.
    int
        The byte at which the line after MOTION starts.

    Raises
    ------
    FormatError
        If the hierarchy breaks the format.
    """
    found = MOTION.search(text.data)
    header = text.data[: found.end()] if found else b""
    if header not in _remembered:
        skeleton = _parse(text)  # raises where no MOTION was found
        if len(_remembered) == MOST_REMEMBERED:
            _remembered.pop(next(iter(_remembered)))
        _remembered[header] = skeleton
    return _remembered[header], len(header)


def _parse(text: Text) -> Skeleton:
    lines = text.lines()
    first = next(lines)[1]
    if first.words[0].upper() != "HIERARCHY":
        raise text.error(
            f"Expected HIERARCHY, but got {first.words[0][:40]!r}. This is no BVH file.",
            first.number,
        )
    hierarchy = _Hierarchy(text)
    for _, (number, words) in lines:
        if words[0].upper() == "MOTION":
            break
        for piece in _parted(words):
            hierarchy.read(number, piece)
    else:
        raise text.error("Expected MOTION after the hierarchy, but the file ends.")
    if hierarchy.open_joints or hierarchy.awaits_brace:
        raise text.error(
            f"Expected every brace to be closed before MOTION, but "
            f"{len(hierarchy.open_joints)} are open.",
            number,
        )
    if not hierarchy.joints:
        raise text.error("Expected a ROOT before MOTION, but got no joint.", number)
    return hierarchy.skeleton()


def _parted(words: list[str]) -> list[list[str]]:
    """Part the words of a line into braces and what is between them."""
    line = " ".join(words)
    if len(line) == 1 or ("{" not in line and "}" not in line):
        return [words]
    return [piece.split() for piece in BRACES.split(line) if piece.strip()]


def _with_end_sites(joints: list[_Joint], taken: set[str]) -> list[str]:
    """Return the joints' names, with a new one for each End Site."""
    names: list[str] = []
    for joint in joints:
        name = joint.name
        if not name:
            name = stem = f"{joints[joint.parent].name}_End"
            count = 1
            while name in taken:
                count += 1
                name = f"{stem}{count}"
            taken.add(name)
        names.append(name)
    return names
