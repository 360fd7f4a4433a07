"""Motion as plain arrays: what the add-on and its worker hand to each other.

An armature in Blender's world, metres and Z up, whatever file or library it comes from.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["BoolArray", "FloatArray", "Motion", "read_motion_file", "write_motion_file"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
ARRAYS = ("parents", "heads", "tails", "positions", "rotations")


@dataclass(frozen=True, eq=False)
class Motion:
    """How the bones of an armature move.

    Attributes
    ----------
    names : tuple of str
        Of the B bones, a parent before its children.
    parents : (B,) int
        Index of each one's parent; -1 where it has none.
    heads, tails : (B, 3), metres
        Of the bones at rest.
    positions : (F, B, 3), metres
        Of the heads, frame by frame.
    rotations : (F, B, 3, 3)
        By how much each bone is turned against its rest, in the world.
    fps : float, frames per second
    name : str
    """

    names: tuple[str, ...]
    parents: NDArray[np.int64]
    heads: FloatArray
    tails: FloatArray
    positions: FloatArray
    rotations: FloatArray
    fps: float
    name: str = ""

    def __len__(self) -> int:
        return len(self.positions)


def write_motion_file(motion: Motion, path: str | Path) -> None:
    """Write a motion for the other process."""
    about = {"names": motion.names, "fps": motion.fps, "name": motion.name}
    arrays = {name: getattr(motion, name) for name in ARRAYS}
    np.savez(path, about=np.array(json.dumps(about)), **arrays)


def read_motion_file(path: str | Path) -> Motion:
    """Read what `write_motion_file` wrote."""
    with np.load(path, allow_pickle=False) as archive:
        about = json.loads(str(archive["about"]))
        arrays = {name: archive[name] for name in ARRAYS}
    return Motion(tuple(about["names"]), fps=about["fps"], name=about["name"], **arrays)
