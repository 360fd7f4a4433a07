"""Motion files: Acclaim (ASF and AMC), BVH and NPZ, read and written.

``read_clip``       read a clip, by suffix
``write_clip``      write a clip, by suffix, converted if need be
``find_skeleton``   find the ASF that belongs to an AMC

Each format has a module: `acclaim`, `bvh`, `npz`; `convert` turns one convention into the other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.io.clips import find_skeleton, read_clip, write_clip

__all__ = ["find_skeleton", "read_clip", "write_clip"]


def __getattr__(name: str) -> Any:
    """Load the readers and writers on first use."""
    if name in __all__:
        from mocapdb.io import clips

        return getattr(clips, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
