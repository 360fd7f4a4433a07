"""A revision: a clip as it was cleaned, beside the clip as it was captured."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

__all__ = ["Revision", "revision_digest"]


@dataclass(frozen=True)
class Revision:
    """One row of the catalogue's revisions.

    Attributes
    ----------
    id, clip_id : int
        Its own row, and the clip's.
    kind : str
        ``"cleaned"``.
    created : str
        When, ISO 8601 in UTC.
    version : str
        Of the mocapdb that made it.
    settings : mapping
        How the clip was searched: ``threshold``, ``hold_feet``, ``context`` (paths); ``made_of`` is
        ``"source"``, the clip's file, or ``"decoded"`` where that was gone or had changed.
    spans : tuple of dict
        What was flagged: ``joint``, ``frames`` (start, end), ``confidence``, ``kind``, ``method``,
        ``repaired``, ``moved_deg``, ``expected_deg``.
    sha256 : str
        What its payload's row of the shard carries, so that it is no other's.
    codec : str
        What the codec chose; empty where there is no payload.
    payload_bytes : int
    skinned_error : float, skeleton units
    error_mean_mm, error_p95_mm, error_max_mm : float
        To what it was made of.
    shard_id, shard_row : int or None
        Where the payload is; None where nothing was repaired, so that the clip is as it was.
    """

    id: int
    clip_id: int
    kind: str
    created: str
    version: str
    settings: Mapping[str, Any] = field(hash=False)
    spans: tuple[Mapping[str, Any], ...] = field(hash=False)
    sha256: str
    codec: str
    payload_bytes: int
    skinned_error: float
    error_mean_mm: float
    error_p95_mm: float
    error_max_mm: float
    shard_id: int | None
    shard_row: int | None

    @property
    def changes(self) -> bool:
        """Whether anything was repaired."""
        return self.shard_id is not None

    @property
    def n_repaired(self) -> int:
        """How many spans were repaired."""
        return sum(bool(span["repaired"]) for span in self.spans)

    @property
    def left(self) -> tuple[Mapping[str, Any], ...]:
        """The spans that were flagged and are as they were: nothing was good enough."""
        return tuple(span for span in self.spans if not span["repaired"])

    def to_dict(self) -> dict[str, Any]:
        """Return what a user is told of it, as the JSON contract names it."""
        return {
            "kind": self.kind,
            "created": self.created,
            "version": self.version,
            "settings": dict(self.settings),
            "repaired": self.n_repaired,
            "left": len(self.left),
            "payload_bytes": self.payload_bytes,
            "error_mm": {
                "mean": self.error_mean_mm,
                "p95": self.error_p95_mm,
                "max": self.error_max_mm,
            },
            "spans": [dict(span) for span in self.spans],
        }


def revision_digest(source_sha256: str, kind: str, spans: Sequence[Mapping[str, Any]]) -> str:
    """Return what tells the payload of a revision from that of any clip or other revision.

    SHA-256 of the source's hash, the kind and the spans as JSON, a line each; hexadecimal.
    """
    content = "\n".join([source_sha256, kind, json.dumps(list(spans), sort_keys=True)])
    return hashlib.sha256(content.encode()).hexdigest()
