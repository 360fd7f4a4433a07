"""The HIERARCHY part of a BVH file, read word by word: where lines break does not matter."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from operator import eq
from typing import NamedTuple

import numpy as np

from mocapdb.errors import SkeletonError
from mocapdb.io._text import Text, parse_number
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import MOST_JOINTS

__all__ = ["Column", "Hierarchy", "read_hierarchy"]

MOTION = re.compile(rb"(?<=[\s}])motion(?=\s+frames\b)", re.IGNORECASE)
COMMENT = re.compile(r"(?<!\S)(#|//)")
WORD = re.compile(r"[{}]|[^\s{}]+")
KEYS = {"ROOT", "JOINT", "END", "ENDSITE", "OFFSET", "CHANNELS", "{", "}", "MOTION"}
CHANNEL_DOFS = {
    f"{axis}{kind}": kind[0].replace("p", "t") + axis
    for kind in ("position", "rotation", "scale")
    for axis in "xyz"
}

MOST_REMEMBERED = 64
MOST_NAMED = 3  # new names of joints that a note tells
_remembered: dict[tuple[bytes, bool], Hierarchy] = {}


class Column(NamedTuple):
    """A number of a row, as the file names it.

    Attributes
    ----------
    joint : int
    dof : str
        ``"tx"``, ``"rx"``, or ``"sx"`` for a scale.
    """

    joint: int
    dof: str


@dataclass(frozen=True)
class Hierarchy:
    """What the first part of a file says.

    Attributes
    ----------
    skeleton : Skeleton
        Without a name, its unit and vertical axis still open.
    columns : tuple of Column
        The numbers of a row, in the file's order: those of the skeleton, and others.
    end_sites : frozenset of int
        The joints that are End Sites.
    stop : int
        The byte behind the word MOTION.
    notes : tuple of str
        What was mended.
    """

    skeleton: Skeleton
    columns: tuple[Column, ...]
    end_sites: frozenset[int]
    stop: int
    notes: tuple[str, ...]

    @cached_property
    def is_plain(self) -> bool:
        """Whether a row's numbers are the skeleton's channels."""
        return len(self.columns) == self.skeleton.n_channels and not self.repeated

    @cached_property
    def repeated(self) -> dict[int, str]:
        """The rotations of joints that turn twice about an axis: ``{2: "ZXZ"}``."""
        orders: dict[int, str] = {}
        for joint, dof in self.columns:
            if dof[0] == "r":
                orders[joint] = orders.get(joint, "") + dof[1].upper()
        return {j: order for j, order in orders.items() if len(set(order)) < len(order)}


class _Word(NamedTuple):
    text: str
    line: int
    ends_line: bool
    start: int


@dataclass
class _Joint:
    """One joint as it is met."""

    name: str
    parent: int
    line: int
    is_end: bool
    offset: tuple[float, ...] | None = None
    dofs: tuple[str, ...] | None = None


@dataclass
class _Words:
    """The words of a file's first part, one after another."""

    text: Text
    words: list[_Word]
    at: int = 0

    def next(self) -> _Word:
        word = self.peek()
        if word is None:
            raise self.text.error("Expected MOTION after the hierarchy, but the file ends.")
        self.at += 1
        return word

    def peek(self) -> _Word | None:
        return self.words[self.at] if self.at < len(self.words) else None

    def values(self) -> list[str]:
        """Return the words up to the next that begins something else."""
        found = []
        while (word := self.peek()) is not None and word.text.upper() not in KEYS:
            found.append(self.next().text)
        return found

    def rest_of_line(self, line: int) -> str:
        """Return what follows on a line up to a brace, as one name."""
        found = []
        while (word := self.peek()) is not None and word.line == line and word.text not in "{}":
            found.append(self.next().text)
        return " ".join(found)


@dataclass
class _Parser:
    """The joints so far, and the ones whose braces are open."""

    text: Text
    words: _Words
    joints: list[_Joint] = field(default_factory=list)
    open_joints: list[int] = field(default_factory=list)
    awaits_brace: bool = False

    def read(self, word: _Word) -> None:
        """Take in a word and what belongs to it."""
        key, line = word.text.upper(), word.line
        if self.awaits_brace and key != "{":
            raise self.text.error(
                f"Expected an opening brace after joint {self.joints[-1].name!r}, "
                f"but got {word.text!r}.",
                line,
            )
        match key:
            case "ROOT" | "JOINT":
                self._open(key, self.words.rest_of_line(line), line)
            case "END" | "ENDSITE":
                self._open_end(key, line)
            case "{":
                if not self.awaits_brace:
                    raise self.text.error("Expected a joint before an opening brace.", line)
                self.awaits_brace = False
            case "}":
                self._close(line)
            case "OFFSET":
                self._read_offset(self.words.values(), line)
            case "CHANNELS":
                self._read_channels(self.words.values(), line)
            case _:
                raise self.text.error(
                    "Expected ROOT, JOINT, End Site, OFFSET, CHANNELS, a brace or MOTION, "
                    f"but got {word.text!r}.",
                    line,
                )

    def _open_end(self, key: str, line: int) -> None:
        name = self.words.rest_of_line(line)
        if key == "ENDSITE":
            self.text.mend("an End Site is spelt in one word", line)
        else:
            site, _, name = name.partition(" ")
            if site.upper() != "SITE":
                raise self.text.error(f"Expected End Site, but got End {site}.", line)
        if name:
            self.text.mend(f"the End Site {name!r} has a name", line)
        self._open("END", name, line)

    def _open(self, key: str, name: str, line: int) -> None:
        if key != "ROOT" and not self.joints:
            raise self.text.error("Expected one ROOT or more, each before its joints.", line)
        if key == "ROOT" and self.open_joints:
            raise self.text.error(
                "Expected a ROOT outside of all braces, but one is within another's.", line
            )
        if key != "ROOT" and not self.open_joints:
            raise self.text.error(
                f"Expected MOTION or another ROOT after a root's closing brace, but got {key}.",
                line,
            )
        if key != "END" and not name:
            raise self.text.error("Expected the joint to have a name, but it has none.", line)
        if len(self.joints) == MOST_JOINTS:
            raise self.text.error(f"Expected at most {MOST_JOINTS} joints, but got more.", line)
        parent = self.open_joints[-1] if self.open_joints else -1
        self.open_joints.append(len(self.joints))
        self.joints.append(_Joint(name, parent, line, key == "END"))
        self.awaits_brace = True

    def _close(self, line: int) -> None:
        if not self.open_joints:
            raise self.text.error("Expected as many closing as opening braces.", line)
        joint = self.joints[self.open_joints.pop()]
        if joint.offset is None:
            raise self.text.error(
                f"Expected joint {joint.name or 'End Site'!r} to have an OFFSET.", joint.line
            )

    def _current(self, key: str, line: int) -> _Joint:
        if not self.open_joints:
            raise self.text.error(f"Expected {key} within a joint's braces.", line)
        return self.joints[self.open_joints[-1]]

    def _read_offset(self, words: list[str], line: int) -> None:
        joint = self._current("OFFSET", line)
        if joint.offset is not None:
            raise self.text.error("Expected one OFFSET for each joint, but got two.", line)
        if len(words) != 3:
            raise self.text.error(f"Expected OFFSET with 3 numbers, but got {len(words)}.", line)
        joint.offset = tuple(parse_number(self.text, word, "OFFSET", line) for word in words)

    def _read_channels(self, words: list[str], line: int) -> None:
        joint = self._current("CHANNELS", line)
        if joint.dofs is not None:
            raise self.text.error("Expected one CHANNELS for each joint, but got two.", line)
        count, names = (words[0], words[1:]) if words else ("", [])
        if count != str(len(names)):
            raise self.text.error(
                f"Expected CHANNELS to start with the count of names, {len(names)}, "
                f"but got {count!r}.",
                line,
            )
        unknown = [name for name in names if name.lower() not in CHANNEL_DOFS]
        if unknown:
            raise self.text.error(
                f"Expected channels such as Xposition or Zrotation, but got {unknown[0]!r}.", line
            )
        dofs = tuple(CHANNEL_DOFS[name.lower()] for name in names)
        moves = [dof for dof in dofs if dof[0] != "r"]
        if len(set(moves)) < len(moves) or any(map(eq, dofs, dofs[1:])):
            raise self.text.error("Expected the channels of a joint to be different ones.", line)
        joint.dofs = dofs

    def result(self, stop: int) -> Hierarchy:
        """Return the joints as a skeleton in metres, Y up."""
        joints = self.joints
        if sum(joint.parent < 0 for joint in joints) > 1:
            joints = self._under_one_root()
        columns = tuple(
            Column(i, dof) for i, joint in enumerate(joints) for dof in joint.dofs or ()
        )
        ends = frozenset(i for i, joint in enumerate(joints) if joint.is_end)
        kept = [_kept_dofs(joint) for joint in joints]
        try:
            skeleton = Skeleton(
                names=self._unique_names(joints),
                parents=[joint.parent for joint in joints],
                offsets=np.array([joint.offset for joint in joints], dtype=np.float64),
                dofs=kept,
                rotation_orders=[
                    "".join(d[1].upper() for d in dofs if d[0] == "r") for dofs in kept
                ],
                convention="bvh",
            )
        except SkeletonError as problem:
            raise self.text.error(str(problem)) from None
        return Hierarchy(skeleton, columns, ends, stop, tuple(self.text.notes))

    def _under_one_root(self) -> list[_Joint]:
        roots = [joint.name for joint in self.joints if joint.parent < 0]
        self.text.mend(f"its roots {', '.join(roots)} hang from a root 'scene' that was added")
        scene = _Joint("scene", -1, 0, is_end=False, offset=(0.0, 0.0, 0.0), dofs=())
        for joint in self.joints:
            joint.parent += 1
        return [scene, *self.joints]

    def _unique_names(self, joints: list[_Joint]) -> list[str]:
        """Return the joints' names: new ones for End Sites, a number behind what comes twice."""
        taken = {joint.name for joint in joints if joint.name}
        names: list[str] = []
        so_far: set[str] = set()
        counts: dict[str, int] = {}
        numbered: list[str] = []
        first_line = None
        for joint in joints:
            name = joint.name
            if not name:
                name = _first_free(f"{names[joint.parent]}_End", taken, "", counts)
            elif name in so_far:
                name = _first_free(name, taken, "_", counts)
                numbered.append(name)
                first_line = first_line or joint.line
            taken.add(name)
            so_far.add(name)
            names.append(name)
        if numbered:
            more = f" and {len(numbered) - MOST_NAMED} more" if len(numbered) > MOST_NAMED else ""
            new = ", ".join(numbered[:MOST_NAMED])
            self.text.mend(f"joints whose names come twice have a number: {new}{more}", first_line)
        return names


def _kept_dofs(joint: _Joint) -> tuple[str, ...]:
    """Return the channels that a skeleton has of a joint: no scales, no axis twice.

    An End Site turns nothing. ZXZ and the like become three different axes.
    """
    dofs = tuple(dof for dof in joint.dofs or () if dof[0] != "s")
    if joint.is_end:
        return tuple(dof for dof in dofs if dof[0] != "r")
    turns = [dof for dof in dofs if dof[0] == "r"]
    if len(set(turns)) == len(turns):
        return dofs
    third = next(f"r{axis}" for axis in "xyz" if f"r{axis}" not in turns)
    return (*(dof for dof in dofs if dof[0] != "r"), turns[0], turns[1], third)


def _first_free(stem: str, taken: set[str], between: str, counts: dict[str, int]) -> str:
    """Return a name that is not taken: the stem itself, or with a number behind it.

    What was counted up to for a stem is kept: names that are taken stay so.
    """
    name, count = stem, counts.get(stem, 1)
    while name in taken:
        count += 1
        name = f"{stem}{between}{count}"
    counts[stem] = max(count - 1, 1)
    return name


def read_hierarchy(text: Text) -> Hierarchy:
    """Read the words up to and including MOTION.

    The takes of one body share one hierarchy, so the last ones are remembered.

    Raises
    ------
    FormatError
        If the hierarchy breaks the format.
    """
    found = MOTION.search(text.data)
    key = (text.data[: found.end()] if found else b"", text.strict)
    if found is None or key not in _remembered:
        before = list(text.notes)
        text.notes.clear()
        hierarchy = _parse(text)
        text.notes[:0] = before
        if found is None or hierarchy.stop != found.end():
            return hierarchy  # oddly laid out: not worth remembering
        if len(_remembered) == MOST_REMEMBERED:
            _remembered.pop(next(iter(_remembered)))
        _remembered[key] = hierarchy
    else:
        text.notes.extend(_remembered[key].notes)
    return _remembered[key]


def _words(text: Text) -> Iterator[_Word]:
    """Yield the words of a file up to MOTION, comments left out, braces apart."""
    for start, line, content in text.raw_lines():
        comment = COMMENT.search(content)
        if comment:
            text.mend("comments are left out", line)
        found = list(WORD.finditer(content, 0, comment.start() if comment else len(content)))
        for i, word in enumerate(found):
            at = start + len(content[: word.start()].encode())
            yield _Word(word[0], line, i == len(found) - 1, at)
            if word[0].upper() == "MOTION" and (i == 0 or found[i - 1][0] == "}"):
                return


def _parse(text: Text) -> Hierarchy:
    words = _Words(text, list(_words(text)))
    first = words.next()
    if first.text.upper() != "HIERARCHY":
        raise text.error(
            f"Expected HIERARCHY, but got {first.text[:40]!r}. This is no BVH file.", first.line
        )
    parser = _Parser(text, words)
    while (word := words.next()).text.upper() != "MOTION":
        parser.read(word)
    if parser.open_joints or parser.awaits_brace:
        raise text.error(
            f"Expected every brace to be closed before MOTION, but "
            f"{len(parser.open_joints)} are open.",
            word.line,
        )
    if not parser.joints:
        raise text.error("Expected a ROOT before MOTION, but got no joint.", word.line)
    return parser.result(word.start + len("MOTION"))
