"""How a build encodes its clips."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from mocapdb.compression.targets import Target

if TYPE_CHECKING:
    from mocapdb.io.reading import ReadOptions

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

    def to_json(self, reading: ReadOptions | None = None) -> str:
        """Return the settings as text; equal settings give equal text.

        Parameters
        ----------
        reading : ReadOptions, optional
            What is said of a file, which is noted with its settings.
        """
        said = reading.to_dict() if reading else {}
        return json.dumps(asdict(self) | ({"reading": said} if said else {}), sort_keys=True)
