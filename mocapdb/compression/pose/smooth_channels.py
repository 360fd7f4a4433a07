"""Channels made smooth: the same poses, without the jumps of a file's angles.

The channels of a file jump where an angle passes 180 degrees, and race where three Euler angles
come near gimbal lock. Smooth channels have the same degrees of freedom, with angles unwrapped over
time; and where another order of the three axes makes a joint's angles smoother, they have that
order. A body that turns about the vertical so gets its heading as the outermost angle.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise, permutations

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.base.kernels import jit
from mocapdb.compression.tuning import OWN_ORDER_ADVANTAGE
from mocapdb.motion.clip import Clip
from mocapdb.motion.rotations import change_orders, make_continuous
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "ORDERS",
    "SmoothChannels",
    "channels_from_smooth",
    "chunks_of",
    "order_changes",
    "three_angle_joints",
]

ORDERS = tuple("".join(axes) for axes in permutations("XYZ"))
"""The orders of three axes; the format refers to them by index."""

CHUNK_FRAMES = 4096  # computed at a time: it bounds memory and changes no result
_HALF_TURN = 180.0


class SmoothChannels:
    """The smooth channels of a clip, computed a chunk at a time when they are asked for.

    Parameters
    ----------
    clip : Clip
    orders : sequence of str, optional
        The orders of axes of the joints with three angles; the smoothest for each by default.

    Attributes
    ----------
    skeleton : Skeleton
        The clip's, with these orders of axes: the smooth channels are channels of this one.
    """

    def __init__(self, clip: Clip, orders: Sequence[str] | None = None) -> None:
        self._clip = clip
        skeleton = clip.skeleton
        free_joints = three_angle_joints(skeleton)
        chosen = list(skeleton.rotation_orders)
        self._columns: list[list[int]] = []  # of the angles of each joint
        self._before: list[FloatArray] = []  # the angles before each chunk
        for joint, own_order in enumerate(skeleton.rotation_orders):
            if not own_order:
                continue
            candidates = [own_order]
            if joint in free_joints:
                candidates = [own_order, *ORDERS]
                if orders is not None:
                    candidates = [orders[free_joints.index(joint)]]
            tried = {}
            for order in candidates:
                tried[order] = self._try_order(joint, order)
                if tried[order][0] == 0.0:  # none is smoother
                    break
            roughness = {order: found[0] for order, found in tried.items()}
            if own_order in roughness:
                roughness[own_order] *= OWN_ORDER_ADVANTAGE
            order = chosen[joint] = min(roughness, key=roughness.__getitem__)
            self._columns.append(_columns(skeleton, joint, order))
            self._before.append(tried[order][1])
        self.skeleton = replace(skeleton, rotation_orders=tuple(chosen))
        self._changes = order_changes(self.skeleton, skeleton.rotation_orders)
        self._last: tuple[int, FloatArray] | None = None

    def __len__(self) -> int:
        return len(self._clip)

    def values(self, frames: slice = slice(None)) -> FloatArray:
        """Return the smooth channels (F, C) of some frames, in degrees and skeleton units."""
        values = np.empty((len(range(*frames.indices(len(self)))), self.skeleton.n_channels))
        for i, own, here in chunks_of(frames, len(self), CHUNK_FRAMES):
            values[here] = self._chunk(i)[own]
        return values

    def chunks(self) -> Iterator[FloatArray]:
        """Yield the smooth channels (F, C) of all frames, a chunk at a time."""
        yield from map(self._chunk, range(self._n_chunks()))

    def _n_chunks(self) -> int:
        return -(-len(self) // CHUNK_FRAMES)

    def _chunk(self, i: int) -> FloatArray:
        """Return the smooth channels of one chunk; the last one computed is kept."""
        if self._last is None or self._last[0] != i:
            values = channels_from_smooth(self._changes, self._original(i))
            for columns, before in zip(self._columns, self._before, strict=True):
                angles = np.take(values, columns, axis=1)
                make_continuous(angles, before[i].copy(), _HALF_TURN)
                values[:, columns] = angles
            self._last = (i, values)
        return self._last[1]

    def _try_order(self, joint: int, order: str) -> tuple[float, FloatArray]:
        """Return how rough a joint's angles are in an order of axes, and where chunks start.

        The second is (chunks, n): the angles of the frame before each chunk.
        """
        skeleton = self._clip.skeleton
        own_order = skeleton.rotation_orders[joint]
        columns = _columns(skeleton, joint, own_order)
        roughness, starts = 0.0, []
        tail = np.empty((0, len(own_order)))
        for i in range(self._n_chunks()):
            angles = np.take(self._original(i), columns, axis=1)
            if order != own_order:
                change_orders(_change_between(own_order, order), angles.copy(), angles)
            starts.append(tail[-1] if len(tail) else angles[0])
            make_continuous(angles, starts[-1].copy(), _HALF_TURN)
            angles = np.concatenate([tail, angles])
            roughness += _roughness(angles)
            tail = angles[-2:]
        return roughness, np.array(starts)

    def _original(self, i: int) -> FloatArray:
        return self._clip.channels[i * CHUNK_FRAMES : (i + 1) * CHUNK_FRAMES]


def chunks_of(
    frames: slice, n_frames: int, chunk_frames: int
) -> Iterator[tuple[int, IntArray, slice]]:
    """Yield the chunks of a clip that hold some of its frames.

    Parameters
    ----------
    frames : slice
        The frames that are asked for.
    n_frames, chunk_frames : int
        Of the clip, and of each of its chunks but the last.

    Yields
    ------
    int, (F,) and slice
        The number of a chunk; which of its own frames are asked for; where they come among all
        that are.

    Examples
    --------
    >>> [(i, own.tolist(), here) for i, own, here in chunks_of(slice(3, 6), 9, 4)]
    [(0, [3], slice(0, 1, None)), (1, [0, 1], slice(1, 3, None))]
    """
    rows = np.arange(*frames.indices(n_frames))
    numbers = rows // chunk_frames
    edges = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(rows)]
    for first, last in pairwise(edges):
        if first < last:
            i = int(numbers[first])
            yield i, rows[first:last] - i * chunk_frames, slice(first, last)


def order_changes(skeleton: Skeleton, orders: Sequence[str]) -> IntArray:
    """Return the changes of orders that `channels_from_smooth` has to make.

    Parameters
    ----------
    skeleton : Skeleton
        The clip's own.
    orders : (J,) sequence of str
        The orders of axes that the smooth channels have.

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


def channels_from_smooth(changes: IntArray, values: FloatArray) -> FloatArray:
    """Return channels (F, C) in a skeleton's own orders of axes from smooth channels (F, C).

    The inverse of `SmoothChannels` up to full turns and to equivalent angles. Every frame is
    converted by itself, so that any of them can be had alone.
    """
    channels = values.copy()
    change_orders(changes, values.copy(), channels)
    return channels


def three_angle_joints(skeleton: Skeleton) -> list[int]:
    """Return the joints with three angles, whose order of axes is free."""
    return [joint for joint, order in enumerate(skeleton.rotation_orders) if len(order) == 3]


def _columns(skeleton: Skeleton, joint: int, order: str) -> list[int]:
    first = int(skeleton.channel_starts[joint])
    return [first + skeleton.dofs[joint].index(f"r{axis.lower()}") for axis in order]


@lru_cache(maxsize=64)
def _change_between(order: str, other: str) -> IntArray:
    """Return the change from an order of three axes to another, in the same columns."""
    places = range(len(order))
    return np.array([[places, _axes(order), places, _axes(other)]])


def _axes(order: str) -> list[int]:
    return ["XYZ".index(axis) for axis in order]


@jit
def _roughness(angles: FloatArray) -> float:
    """Return the sum of the second differences of angles (F, n), without sign."""
    roughness = 0.0
    for f in range(2, len(angles)):
        for i in range(angles.shape[1]):
            roughness += abs(angles[f, i] - 2.0 * angles[f - 1, i] + angles[f - 2, i])
    return roughness
