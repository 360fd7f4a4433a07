"""Queries that a library keeps: their examples as canonical motions, and how they are asked.

They are asked anew whenever their hits are wanted, so that later builds count at once.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.errors import LibraryError
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.library.searching.canonical_shards import PackedMotion, pack_motion
from mocapdb.library.writing.open_for_writing import open_for_writing

__all__ = ["SavedQuery", "forget_query", "save_query"]

NOTHING = type(None)
OPTIONS = {
    "k": (int,),
    "only": (dict,),
    "joints": (list,),
    "whole": (bool,),
    "mirror": (bool,),
    "expand": (int, NOTHING),
    "weights": (list, NOTHING),
    "max_distance": (int, float),
    "probability": (int, float),
    "exact": (bool, NOTHING),
}
"""What may be kept of the arguments of `Retrieval.query`, as JSON reads it."""

ONLY = {
    "label": (str, NOTHING),
    "subject": (str, NOTHING),
    "text": (str, NOTHING),
    "not_clips": (list,),
    "not_subjects": (list,),
    "where": (dict,),
    "facets": (dict,),
    "flagged": (bool, NOTHING),
}
"""Likewise of the fields of `Filter`."""

ENDS = (int, float, NOTHING)
"""Of a range of a facet."""


@dataclass(frozen=True, eq=False)
class SavedQuery:
    """A query as it is kept.

    Attributes
    ----------
    examples, unlike : tuple of CanonicalMotion
    options : mapping
        The other arguments of `Retrieval.query`, as JSON can hold them; ``only`` as a mapping of
        `Filter`'s fields.
    created : str
        When, ISO 8601 in UTC.
    """

    examples: tuple[CanonicalMotion, ...]
    unlike: tuple[CanonicalMotion, ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)
    created: str = ""

    def to_json(self) -> str:
        """Return it as text."""
        data = asdict(self) | {
            "examples": [_packed(motion) for motion in self.examples],
            "unlike": [_packed(motion) for motion in self.unlike],
            "created": self.created or datetime.now(UTC).isoformat(timespec="seconds"),
        }
        return json.dumps(data, sort_keys=True)

    @classmethod
    def of_json(cls, name: str, text: str) -> Self:
        """Read what `to_json` wrote.

        Raises
        ------
        LibraryError
            If it is damaged.
        """
        try:
            data = json.loads(text)
            examples, unlike = (
                tuple(_unpacked(motion) for motion in data[key]) for key in ("examples", "unlike")
            )
            options = dict(data["options"])
            _expect_options(options)
            return cls(examples, unlike, options, str(data["created"]))
        except (KeyError, OverflowError, RecursionError, TypeError, ValueError):
            raise LibraryError(
                f"The saved query {name!r} is damaged. Save it again with: mocapdb query --save"
            ) from None


def _expect_options(options: Mapping[str, Any]) -> None:
    """Raise a `TypeError` or `KeyError` where an option is none, or is of another kind."""
    only = options.get("only", {})
    for values, kinds in ((options, OPTIONS), (only, ONLY)):
        for name, value in values.items():
            _expect(value, kinds[name])
    for text in (
        *options.get("joints", ()),
        *only.get("not_clips", ()),
        *only.get("not_subjects", ()),
        *only.get("where", {}).values(),
    ):
        _expect(text, (str,))
    for number in options.get("weights") or ():
        _expect(number, (int, float))
    for low, high in only.get("facets", {}).values():
        _expect(low, ENDS)
        _expect(high, ENDS)


def _expect(value: Any, kinds: tuple[type, ...]) -> None:
    if not isinstance(value, kinds):
        raise TypeError(f"expected {kinds}, but got {value!r}")


def save_query(path: StrPath, name: str, query: SavedQuery) -> bool:
    """Keep a query in a library under a name; return whether one of that name was replaced.

    Raises
    ------
    LibraryError
        If the name is empty or has line breaks, or the library is locked or cannot be written.
    """
    if not name.strip():
        raise LibraryError("Expected a name for the query to be saved, but got an empty one.")
    if not name.isprintable():
        raise LibraryError(
            f"Expected a name of printable letters for the query, on one line, but got {name!r}."
        )
    with open_for_writing(Path(path)) as catalogue:
        known = name in catalogue.saved_queries()
        with catalogue.transaction():
            catalogue.keep_query(name, query.to_json())
    return known


def forget_query(path: StrPath, name: str) -> None:
    """Remove a saved query.

    Raises
    ------
    LibraryError
        If there is none of that name, or the library is locked or cannot be written.
    """
    with open_for_writing(Path(path)) as catalogue:
        catalogue.saved_query(name)
        with catalogue.transaction():
            catalogue.keep_query(name, None)


def _packed(motion: CanonicalMotion) -> dict[str, Any]:
    stored = pack_motion(motion)
    return {
        "frames": len(motion),
        "bones": base64.b64encode(stored.bones.tobytes()).decode("ascii"),
        "root": base64.b64encode(stored.root.astype("<i4").tobytes()).decode("ascii"),
    }


def _unpacked(data: Mapping[str, Any]) -> CanonicalMotion:
    n = int(data["frames"])
    arrays: Sequence[np.ndarray[Any, Any]] = [
        np.frombuffer(base64.b64decode(data[key], validate=True), dtype)
        for key, dtype in (("bones", "i1"), ("root", "<i4"))
    ]
    return PackedMotion(arrays[0].reshape(-1, n), arrays[1].reshape(4, n)).unpack()
