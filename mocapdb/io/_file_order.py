"""Laying out a skeleton's joints and channels the way a file wants them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.motion.skeleton import Skeleton

__all__ = ["depth_first", "file_channels", "file_dofs"]


def depth_first(skeleton: Skeleton) -> list[tuple[int, int]]:
    """Return every joint and its depth below the root, children right after their parents."""
    found: list[tuple[int, int]] = []
    waiting = [(0, 0)]
    while waiting:
        joint, depth = waiting.pop()
        found.append((joint, depth))
        waiting.extend((child, depth + 1) for child in reversed(skeleton.children[joint]))
    return found


def file_dofs(skeleton: Skeleton, joint: int) -> tuple[str, ...]:
    """Return a joint's channels with its rotations in the order that the format gives a meaning.

    BVH lists them outermost first, Acclaim innermost first.
    """
    order = skeleton.rotation_orders[joint].lower()
    axes = iter(order if skeleton.convention == "bvh" else reversed(order))
    return tuple(dof if dof[0] == "t" else f"r{next(axes)}" for dof in skeleton.dofs[joint])


def file_channels(
    skeleton: Skeleton, joints: Sequence[int], channels: FloatArray, decimals: int | None
) -> FloatArray:
    """Return the channels of some joints, each in the order of `file_dofs`, rounded if asked."""
    starts = skeleton.channel_starts
    columns = [
        int(starts[joint]) + skeleton.dofs[joint].index(dof)
        for joint in joints
        for dof in file_dofs(skeleton, joint)
    ]
    chosen = channels[:, np.array(columns, dtype=np.int64)]
    return chosen if decimals is None else np.round(chosen, decimals) + 0.0
