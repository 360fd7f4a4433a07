"""How a build encodes its clips."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import Any

from mocapdb.compression.targets import Target

__all__ = ["BuildSettings"]


@dataclass(frozen=True)
class BuildSettings:
    """How clips are encoded.

    Parameters
    ----------
    target : Target
        The error that no clip may exceed.
    codec : dict
        Keyword arguments of `mocapdb.compression.encode`.
    drop_tpose : bool
        Whether to leave out a T-pose in front of the motion.
    """

    target: Target
    codec: dict[str, Any] = field(default_factory=dict)
    drop_tpose: bool = False

    def to_json(self) -> str:
        """Return the settings as text; equal settings give equal text."""
        return json.dumps(asdict(self), sort_keys=True)
