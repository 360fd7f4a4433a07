"""A cache of the clips that were searched for faults, with their repairs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from mocapdb.motion.clip import Clip

if TYPE_CHECKING:
    from mocapdb.cleaning import Cleaned

__all__ = ["CleanedClips"]

MOST_KEPT = 8  # clips; each is kept decoded, some MB a minute


class CleanedClips:
    """The last few clips that were searched for faults.

    Attributes
    ----------
    flags : dict of str to int
        Flagged spans of every clip that was searched, by its name.
    """

    def __init__(self) -> None:
        self._kept: dict[str, Cleaned] = {}
        self.flags: dict[str, int] = {}

    def get(self, name: str) -> Cleaned | None:
        """Return what was found in a clip, if it is kept."""
        return self._kept.get(name)

    def keep(self, name: str, found: Cleaned) -> None:
        """Keep what was found in a clip, in place of the oldest."""
        if len(self._kept) >= MOST_KEPT:
            self._kept.pop(next(iter(self._kept)))
        self._kept[name] = found
        self.flags[name] = len(found.digression_map.spans)

    def find(self, name: str, decode: Callable[[str], Clip]) -> Cleaned:
        """Return what is found in a clip, kept or found now."""
        from mocapdb.cleaning import clean_clip

        if name not in self._kept:
            self.keep(name, clean_clip(decode(name)))
        return self._kept[name]
