"""The state of a body, frame by frame: channels that a smooth motion moves smoothly.

The channels of a file jump where an angle passes 180 degrees, and race where three Euler angles
near gimbal lock. The state has the same degrees of freedom without the jumps; and where another
order of the three axes makes a joint's angles calmer, it has that order. A body that turns about
the vertical gets its heading as the outermost angle that way, without being asked to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from mocapdb._typing import FloatArray, IntArray
from mocapdb.motion.clip import Clip
from mocapdb.motion.rotations import (
    change_orders,
    continuous_angles,
    elementary,
    extract_angles,
)
from mocapdb.motion.skeleton import Skeleton

__all__ = ["ORDERS", "State", "channels_of", "order_changes", "state_of", "turning_joints"]

ORDERS = tuple("".join(axes) for axes in permutations("XYZ"))
"""The orders of three axes; the format refers to them by index."""

_CALMER = 0.9  # another order has to earn its place


@dataclass(frozen=True)
class State:
    """The states of a clip.

    Attributes
    ----------
    skeleton : Skeleton
        The clip's, with other orders of axes: the states are channels of this one.
    values : (F, C) degrees and skeleton units
    """

    skeleton: Skeleton
    values: FloatArray


def state_of(clip: Clip, orders: Sequence[str] | None = None) -> State:
    """Return the states of a clip.

    Parameters
    ----------
    clip : Clip
    orders : sequence of str, optional
        The orders of axes of the joints with three angles; the calmest for each by default.
    """
    skeleton = clip.skeleton
    turning = turning_joints(skeleton)
    allowed = {joint: ORDERS if orders is None else (orders[i],) for i, joint in enumerate(turning)}
    values = clip.channels.copy()
    chosen = list(skeleton.rotation_orders)
    for joint, order in enumerate(skeleton.rotation_orders):
        if not order:
            continue
        angles = np.deg2rad(clip.channels[:, _columns(skeleton, joint, order)])
        calmest, least = continuous_angles(order, angles), np.inf
        if order in allowed.get(joint, (order,)):
            least = _CALMER * _unrest(calmest)
        rotations = _product(order, angles) if joint in allowed else None
        for other in allowed.get(joint, ()):
            if other == order or rotations is None:
                continue
            candidate = continuous_angles(other, extract_angles(other, rotations))
            if _unrest(candidate) < least:
                least, calmest, chosen[joint] = _unrest(candidate), candidate, other
        values[:, _columns(skeleton, joint, chosen[joint])] = np.rad2deg(calmest)
    return State(replace(skeleton, rotation_orders=tuple(chosen)), values)


def order_changes(skeleton: Skeleton, orders: Sequence[str]) -> IntArray:
    """Return what `channels_of` has to do to states of a clip.

    Parameters
    ----------
    skeleton : Skeleton
        The clip's own.
    orders : (J,) sequence of str
        The orders of axes that the states have.

    Returns
    -------
    (n, 4, 3), see `mocapdb.motion.rotations.change_orders`.
    """
    changes = [
        [
            _columns(skeleton, joint, orders[joint]),
            ["XYZ".index(axis) for axis in orders[joint]],
            _columns(skeleton, joint, order),
            ["XYZ".index(axis) for axis in order],
        ]
        for joint, order in enumerate(skeleton.rotation_orders)
        if order != orders[joint]
    ]
    return np.array(changes, dtype=np.int64).reshape(-1, 4, 3)


def channels_of(changes: IntArray, values: FloatArray) -> FloatArray:
    """Return channels (F, C) that bring a skeleton into the poses of states (F, C).

    The inverse of `state_of` up to full turns and to equivalent angles. Every frame stands for
    itself, so that any of them can be had alone.
    """
    channels = values.copy()
    change_orders(changes, values, channels)
    return channels


def turning_joints(skeleton: Skeleton) -> list[int]:
    """Return the joints with three angles, whose order is free to choose."""
    return [joint for joint, order in enumerate(skeleton.rotation_orders) if len(order) == 3]


def _columns(skeleton: Skeleton, joint: int, order: str) -> list[int]:
    first = int(skeleton.channel_starts[joint])
    return [first + skeleton.dofs[joint].index(f"r{axis.lower()}") for axis in order]


def _product(order: str, angles_rad: FloatArray) -> FloatArray:
    first, second, third = (elementary(axis, angles_rad[:, i]) for i, axis in enumerate(order))
    return first @ second @ third


def _unrest(angles_rad: FloatArray) -> float:
    """Return how much angles change their speed."""
    return float(np.abs(np.diff(angles_rad, 2, axis=0)).sum())
