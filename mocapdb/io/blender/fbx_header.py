"""What an FBX says of itself: its unit and its vertical axis; and which pictures it would open.

After Blender's notes on the format ("FBX binary file format specification", 2013): a file is a tree
of nodes, each with its end, its properties and its name. A file as text has the same names.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from typing import NamedTuple

__all__ = ["FbxHeader", "read_fbx_header", "without_pictures"]

MAGIC = b"Kaydara FBX Binary  \x00"
FIRST_NODE = 27  # magic, two bytes, the version
WIDE_SINCE = 7500  # versions from this one on count in 64 bits
INTO = {b"GlobalSettings", b"Properties70", b"Properties60", b"Objects", b"Version5", b"Settings"}
PICTURES = {b"Texture", b"Video", b"Cache"}
SIZES = {b"C": 1, b"Y": 2, b"I": 4, b"F": 4, b"D": 8, b"L": 8}
KINDS = {b"I": "<i", b"F": "<f", b"D": "<d", b"L": "<q", b"Y": "<h"}
TEXT_PROPERTY = r'^\s*P(?:roperty)?:\s*"%s"\s*,.*,\s*([-+.\deE]+)\s*$'
TEXT_PICTURES = re.compile(rb"^([ \t]*)(Texture|Video|Cache)(:)", re.MULTILINE)


class FbxHeader(NamedTuple):
    """What is said of all that is in a file.

    Attributes
    ----------
    unit_m : float, optional, metres
        Length of the unit.
    up : {"x", "y", "z"}, optional
    """

    unit_m: float | None = None
    up: str | None = None


class _Node(NamedTuple):
    name: bytes
    at: int  # where the name is
    properties: tuple[object, ...]  # those of plain kinds before the first that is none


def read_fbx_header(data: bytes) -> FbxHeader:
    """Return what a file says; of a broken file, what is found before it breaks."""
    found: dict[str, float] = {}
    if data.startswith(MAGIC):
        for node in _nodes(data):
            if node.name in {b"P", b"Property"} and len(node.properties) > 3:
                key, value = node.properties[0], node.properties[-1]
                if isinstance(key, bytes) and isinstance(value, int | float):
                    found.setdefault(key.decode("utf-8", "replace"), float(value))
    else:
        text = data.decode("utf-8", "replace")
        for key in ("UnitScaleFactor", "UpAxis"):
            match = re.search(TEXT_PROPERTY % key, text, re.MULTILINE)
            if match:
                found[key] = float(match[1])
    unit_cm, axis = found.get("UnitScaleFactor", 0.0), found.get("UpAxis")
    return FbxHeader(
        float(f"{unit_cm:.7g}") / 100 if 0 < unit_cm < float("inf") else None,  # often a float32
        "xyz"[int(axis)] if axis in {0.0, 1.0, 2.0} else None,
    )


def without_pictures(data: bytes) -> bytes | None:
    """Return a file that names no pictures or caches, which others would open; None if it has none.

    Their nodes get other names, which no reader knows.
    """
    if not data.startswith(MAGIC):
        changed, count = TEXT_PICTURES.subn(rb"\1Left\2\3", data)
        return changed if count else None
    places = [node.at for node in _nodes(data) if node.name in PICTURES]
    if not places:
        return None
    renamed = bytearray(data)
    for place in places:
        renamed[place] = ord("X")
    return bytes(renamed)


def _nodes(data: bytes) -> Iterator[_Node]:
    """Yield nodes, and below those that matter their children; ends where a file is broken."""
    try:
        (version,) = struct.unpack_from("<I", data, len(MAGIC) + 2)
        head = struct.Struct("<QQQB" if version >= WIDE_SINCE else "<IIIB")
        yield from _between(data, FIRST_NODE, len(data), head)
    except struct.error:
        return


def _between(data: bytes, at: int, end: int, head: struct.Struct) -> Iterator[_Node]:
    while at + head.size <= end:
        node_end, count, size, length = head.unpack_from(data, at)
        if node_end <= at or node_end > end:  # the empty node that ends a list, or a broken one
            return
        name_at = at + head.size
        name = data[name_at : name_at + length]
        yield _Node(name, name_at, tuple(_properties(data, name_at + length, count, name)))
        if name in INTO:
            yield from _between(data, name_at + length + size, node_end, head)
        at = node_end


def _properties(data: bytes, at: int, count: int, name: bytes) -> Iterator[object]:
    if name not in {b"P", b"Property"}:
        return
    for _ in range(min(count, 8)):
        kind = data[at : at + 1]
        if kind in SIZES:
            size = SIZES[kind]
            if kind in KINDS:
                yield struct.unpack_from(KINDS[kind], data, at + 1)[0]
            at += 1 + size
        elif kind in {b"S", b"R"}:
            (size,) = struct.unpack_from("<I", data, at + 1)
            yield data[at + 5 : at + 5 + size]
            at += 5 + size
        else:
            return
