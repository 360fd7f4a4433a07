"""The state of a body, frame by frame: channels that a smooth motion moves smoothly.

The channels of a file jump where an angle passes 180 degrees, and race where three Euler angles
near gimbal lock. The state has the same degrees of freedom without the jumps; and where another
order of the three axes makes a joint's angles calmer, it has that order. A body that turns about
the vertical gets its heading as the outermost angle that way, without being asked to.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.base.kernels import jit
from mocapdb.motion.clip import Clip
from mocapdb.motion.rotations import change_orders, make_continuous
from mocapdb.motion.skeleton import Skeleton

__all__ = ["ORDERS", "State", "channels_of", "order_changes", "pieces", "turning_joints"]

ORDERS = tuple("".join(axes) for axes in permutations("XYZ"))
"""The orders of three axes; the format refers to them by index."""

_CALMER = 0.9  # another order has to earn its place
_PART_FRAMES = 4096  # states are computed so many at a time
_HALF_TURN = 180.0


class State:
    """The states of a clip, of any length in little memory: computed when they are asked for.

    Parameters
    ----------
    clip : Clip
    orders : sequence of str, optional
        The orders of axes of the joints with three angles; the calmest for each by default.

    Attributes
    ----------
    skeleton : Skeleton
        The clip's, with other orders of axes: the states are channels of this one.
    """

    def __init__(self, clip: Clip, orders: Sequence[str] | None = None) -> None:
        self._clip = clip
        skeleton = clip.skeleton
        turning = turning_joints(skeleton)
        chosen = list(skeleton.rotation_orders)
        self._columns: list[list[int]] = []  # of the angles of each joint
        self._before: list[FloatArray] = []  # what they are before each part
        for joint, order in enumerate(skeleton.rotation_orders):
            if not order:
                continue
            candidates = [order]
            if joint in turning:
                candidates = [order, *ORDERS] if orders is None else [orders[turning.index(joint)]]
            courses = {other: self._course(joint, other) for other in candidates}
            unrest = {other: course[0] for other, course in courses.items()}
            if order in unrest:
                unrest[order] *= _CALMER
            chosen[joint] = min(unrest, key=unrest.__getitem__)
            self._columns.append(_columns(skeleton, joint, chosen[joint]))
            self._before.append(courses[chosen[joint]][1])
        self.skeleton = replace(skeleton, rotation_orders=tuple(chosen))
        self._changes = order_changes(self.skeleton, skeleton.rotation_orders)
        self._last: tuple[int, FloatArray] | None = None

    def __len__(self) -> int:
        return len(self._clip)

    def values(self, frames: slice = slice(None)) -> FloatArray:
        """Return the states (F, C) of some frames, in degrees and skeleton units."""
        values = np.empty((len(range(*frames.indices(len(self)))), self.skeleton.n_channels))
        for i, own, here in pieces(frames, len(self), _PART_FRAMES):
            values[here] = self._part(i)[own]
        return values

    def parts(self) -> Iterator[FloatArray]:
        """Yield the states (F, C) of all frames, some thousand at a time."""
        yield from map(self._part, range(self._n_parts()))

    def _n_parts(self) -> int:
        return -(-len(self) // _PART_FRAMES)

    def _part(self, i: int) -> FloatArray:
        """Return one of the parts; the last one is at hand."""
        if self._last is None or self._last[0] != i:
            values = channels_of(self._changes, self._channels(i))
            for columns, before in zip(self._columns, self._before, strict=True):
                angles = values[:, columns]
                make_continuous(angles, before[i].copy(), _HALF_TURN)
                values[:, columns] = angles
            self._last = (i, values)
        return self._last[1]

    def _course(self, joint: int, other: str) -> tuple[float, FloatArray]:
        """Return how much a joint's angles change speed in an order, and where each part starts.

        The second is (parts, n): the angles of the frame before each part.
        """
        skeleton = self._clip.skeleton
        order = skeleton.rotation_orders[joint]
        columns = _columns(skeleton, joint, order)
        change = np.array([[columns, _axes(order), range(len(order)), _axes(other)]])
        unrest, starts = 0.0, []
        tail = np.empty((0, len(order)))
        for i in range(self._n_parts()):
            channels = self._channels(i)
            angles = channels[:, columns]
            if other != order:
                change_orders(change, channels, angles)
            starts.append(tail[-1] if len(tail) else angles[0])
            make_continuous(angles, starts[-1].copy(), _HALF_TURN)
            angles = np.concatenate([tail, angles])
            unrest += _unrest(angles)
            tail = angles[-2:]
        return unrest, np.array(starts)

    def _channels(self, i: int) -> FloatArray:
        return self._clip.channels[i * _PART_FRAMES : (i + 1) * _PART_FRAMES]


def pieces(
    frames: slice, n_frames: int, piece_frames: int
) -> Iterator[tuple[int, IntArray, slice]]:
    """Yield the pieces of a clip that have some of its frames.

    Parameters
    ----------
    frames : slice
    n_frames, piece_frames : int
        Of the clip, and of each of its pieces but the last.

    Yields
    ------
    int, (F,) and slice
        The number of a piece, those of its frames, and where they come among all.
    """
    rows = np.arange(*frames.indices(n_frames))
    numbers = rows // piece_frames
    edges = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(rows)]
    for first, last in pairwise(edges):
        if first < last:
            i = int(numbers[first])
            yield i, rows[first:last] - i * piece_frames, slice(first, last)


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
            _axes(orders[joint]),
            _columns(skeleton, joint, order),
            _axes(order),
        ]
        for joint, order in enumerate(skeleton.rotation_orders)
        if order != orders[joint]
    ]
    return np.array(changes, dtype=np.int64).reshape(-1, 4, 3)


def channels_of(changes: IntArray, values: FloatArray) -> FloatArray:
    """Return channels (F, C) that bring a skeleton into the poses of states (F, C).

    The inverse of `State` up to full turns and to equivalent angles. Every frame stands for
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


def _axes(order: str) -> list[int]:
    return ["XYZ".index(axis) for axis in order]


@jit
def _unrest(angles: FloatArray) -> float:
    """Return how much angles (F, n) change their speed."""
    unrest = 0.0
    for f in range(2, len(angles)):
        for i in range(angles.shape[1]):
            unrest += abs(angles[f, i] - 2.0 * angles[f - 1, i] + angles[f - 2, i])
    return unrest
