"""What a shard says of its payloads: all that the catalogue knows, so that it can be made anew.

A shard has an entry for each payload, and entries for the skeletons and bases that they refer to.
An entry is a JSON object, deflated by itself: what is damaged in one leaves the others readable.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from typing import Any

from mocapdb.errors import LibraryError
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "basis_entry",
    "clip_entry",
    "entry_bytes",
    "read_entry",
    "revision_entry",
    "skeleton_entry",
]

PLACES = frozenset({"id", "clip_id", "skeleton_id", "shard_id", "shard_row", "build_id", "deleted"})
"""Columns that say where something is in this catalogue, which a new one would not share."""

MOST_BYTES = 2**26
"""What an entry may unpack to: no skeleton or basis comes near."""


def clip_entry(
    columns: Mapping[str, Any],
    skeleton_digest: str,
    joint_errors: bytes | None,
    replaces: Mapping[str, Any] | None = None,
) -> bytes:
    """Return the entry of a clip.

    Parameters
    ----------
    columns : mapping
        Its row of the catalogue.
    skeleton_digest : str
    joint_errors : bytes, optional
        What its joints lost (see `joint_losses`), if that was measured.
    replaces : mapping, optional
        Of the clip that it takes the place of: its shard's ``file``, its ``shard_row`` there and
        its ``source_sha256``.
    """
    return _packed(
        {
            "kind": "clip",
            "row": _kept(columns),
            "skeleton": skeleton_digest,
            "joint_errors": None if joint_errors is None else _text(joint_errors),
            "replaces": dict(replaces) if replaces else None,
        }
    )


def revision_entry(columns: Mapping[str, Any], clip: Mapping[str, Any], digest: str) -> bytes:
    """Return the entry of a revision: its row, which clip it is of, and the skeleton's digest."""
    of = {name: clip[name] for name in ("name", "source", "source_sha256", "settings", "frames")}
    return _packed({"kind": "revision", "row": _kept(columns), "of": of, "skeleton": digest})


def skeleton_entry(skeleton: Skeleton) -> bytes:
    """Return the entry of a skeleton that payloads of the shard refer to."""
    return _packed({"kind": "skeleton", "skeleton": skeleton.to_dict()})


def basis_entry(digest: bytes, label: str, layout: str, data: bytes) -> bytes:
    """Return the entry of a basis of a class that payloads of the shard refer to."""
    about = {"digest": digest.hex(), "label": label, "layout": layout, "data": _text(data)}
    return _packed({"kind": "basis"} | about)


def read_entry(data: bytes) -> dict[str, Any]:
    """Return an entry.

    Raises
    ------
    LibraryError
        If it is damaged.
    """
    try:
        unpacker = zlib.decompressobj()
        text = unpacker.decompress(data, MOST_BYTES)
        if not unpacker.eof or unpacker.unused_data:
            raise ValueError("it is cut short or too long")
        entry = json.loads(text)
    except (zlib.error, ValueError, RecursionError) as problem:
        raise LibraryError(f"Expected what a shard says of a clip, but got: {problem}.") from None
    if not isinstance(entry, dict):
        raise LibraryError("Expected what a shard says of a clip, but got something else.")
    return entry


def entry_bytes(text: str) -> bytes:
    """Return bytes that an entry has as text, in Base64.

    Raises
    ------
    ValueError
        If it is damaged.
    """
    return base64.b64decode(text, validate=True)


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _kept(columns: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in columns.items() if name not in PLACES}


def _packed(entry: Mapping[str, Any]) -> bytes:
    return zlib.compress(json.dumps(entry, sort_keys=True).encode(), 9)
