"""A binary FBX as text: the other form of the format, for tests."""

from __future__ import annotations

import struct
import zlib

ARRAYS = {"f": "f", "d": "d", "l": "q", "i": "i", "b": "b"}
PLAIN = {"Y": "<h", "C": "<b", "I": "<i", "F": "<f", "D": "<d", "L": "<q"}


def ascii_of(data: bytes) -> str:
    """Return the nodes of a file of version 7.4 and below as text."""
    lines = ["; FBX 7.4.0 project file"]
    _nodes(data, 27, len(data), 0, lines)
    return "\n".join(lines) + "\n"


def _nodes(data, at, end, depth, lines):
    while at + 13 <= end:
        node_end, count, size, length = struct.unpack_from("<IIIB", data, at)
        if node_end == 0:
            return
        name = data[at + 13 : at + 13 + length].decode()
        start = at + 13 + length
        words = _properties(data, start, count)
        tabs = "\t" * depth
        inside: list[str] = []
        _nodes(data, start + size, node_end, depth + 1, inside)
        line = f"{tabs}{name}: {','.join(words)}"
        if start + size < node_end:
            lines += [line + " {", *inside, tabs + "}"]
        else:
            lines.append(line)
        at = node_end


def _properties(data, at, count):
    words = []
    for _ in range(count):
        kind = chr(data[at])
        at += 1
        if kind in PLAIN:
            (value,) = struct.unpack_from(PLAIN[kind], data, at)
            at += struct.calcsize(PLAIN[kind])
            words.append(repr(value))
        elif kind in "SR":
            (size,) = struct.unpack_from("<I", data, at)
            text = data[at + 4 : at + 4 + size]
            at += 4 + size
            name, _, group = text.partition(b"\0\x01")
            spelt = (group + b"::" + name if group else text).decode("utf-8", "replace")
            words.append('"' + spelt.replace('"', "&quot;") + '"')
        else:
            number, packed, size = struct.unpack_from("<III", data, at)
            body = data[at + 12 : at + 12 + size]
            body = zlib.decompress(body) if packed else body
            at += 12 + size
            values = struct.unpack(f"<{number}{ARRAYS[kind]}", body)
            words.append(f"*{number} {{\n\ta: {','.join(map(repr, values))}\n}}")
    return words
