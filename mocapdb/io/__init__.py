"""Motion files: Acclaim (ASF and AMC), BVH and NPZ, read and written.

``read_clip``       read a clip, by suffix
``write_clip``      write a clip, by suffix, converted if need be
``find_skeleton``   find the ASF that belongs to an AMC
``find_motion_files``  find the motion files of a folder

Each format has a module: `acclaim`, `bvh`, `npz`; `convert` turns one convention into the other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.io.clip_files import find_skeleton as find_skeleton
    from mocapdb.io.clip_files import read_clip as read_clip
    from mocapdb.io.clip_files import write_clip as write_clip
    from mocapdb.io.find_files import find_motion_files as find_motion_files

__getattr__, __dir__, __all__ = attach(__name__)
