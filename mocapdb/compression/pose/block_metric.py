"""The metric of a block: one for each stretch of frames in which the body moves little.

Weights change from round to round of a search, mostly in a few frames: only the metrics that change
are computed anew.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.compression import tuning
from mocapdb.compression.pose.class_basis import Basis
from mocapdb.compression.pose.own_motion import Posed
from mocapdb.compression.pose.skin_metric import Points, metric_factors
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.skeleton import Skeleton

__all__ = ["BlockMetric"]


class BlockMetric:
    """The metric's factors of a block, for weights that change.

    Parameters
    ----------
    skeleton : Skeleton
        With the orders of axes in which the channels are coded.
    source : Posed
        The block's smooth channels and poses.
    most_frames : int
        Of a stretch.
    basis : Basis, optional
        What is coded in place of the channels.
    feedback : bool
        Whether each channel makes up for the errors of those coded before it.

    Attributes
    ----------
    factors : (N, C, C)
        R (see `skin_metric`) of each stretch.
    rows : (F,)
        The stretch of each frame.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        source: Posed,
        most_frames: int,
        basis: Basis | None = None,
        feedback: bool = True,
    ) -> None:
        values, pose = source
        self._skeleton, self._basis, self._feedback = skeleton, basis, feedback
        most = tuning.METRIC_BYTES // (8 * max(values.shape[1], 1) ** 2)
        self._starts = _stretches(pose, most_frames, most)
        self._ends = ends = np.append(self._starts[1:], len(values))
        middles = (self._starts + ends) // 2
        self._values = values[middles]
        self._pose = Pose(pose.positions[middles], pose.rotations[middles])
        self._weights: tuple[Points, list[FloatArray | None]] | None = None
        self.rows = np.repeat(np.arange(len(self._starts)), ends - self._starts)
        self.factors = np.zeros((len(middles), values.shape[1], values.shape[1]))

    def update(
        self, points: Points, emphasis: FloatArray | None = None, own: FloatArray | None = None
    ) -> None:
        """Weigh points by an emphasis (F, P), and joints' own errors by weights (2, F, J)."""
        weights = [
            None if emphasis is None else self._largest(emphasis, 0),
            None if own is None else self._largest(own, 1),
        ]
        is_new = np.ones(len(self._starts), dtype=np.bool_)
        if self._weights is not None and self._weights[0] is points:
            is_new = np.zeros_like(is_new)
            for before, now in zip(self._weights[1], weights, strict=True):
                is_new |= _differ(before, now, len(is_new))
        self._weights = points, weights
        if not is_new.any():
            return
        emphasis, own = weights
        factors = metric_factors(
            self._skeleton,
            self._values[is_new],
            Pose(self._pose.positions[is_new], self._pose.rotations[is_new]),
            points,
            None if emphasis is None else emphasis[is_new],
            None if own is None else own[:, is_new],
        )
        if self._basis is not None:
            factors = self._basis.transform_metric(factors)
        if not self._feedback:  # each channel as if the others were exact
            lengths = np.sqrt((factors**2).sum(axis=1))
            factors = lengths[:, :, None] * np.eye(factors.shape[1])
        if is_new.all():
            self.factors = factors
        else:
            self.factors[is_new] = factors

    def _largest(self, weights: FloatArray, axis: int) -> FloatArray:
        """Return the largest weights of each stretch: `np.maximum.reduceat`, but faster."""
        largest: FloatArray = np.take(weights, self._starts, axis)
        for i in range(1, int((self._ends - self._starts).max(initial=1))):
            others = np.take(weights, np.minimum(self._starts + i, self._ends - 1), axis)
            np.maximum(largest, others, out=largest)
        return largest


def _differ(before: FloatArray | None, now: FloatArray | None, n: int) -> BoolArray:
    """Say for each stretch whether weights (N, ...) or (2, N, J) have changed."""
    if before is None and now is None:
        return np.zeros(n, dtype=np.bool_)
    if before is None or now is None:
        return np.ones(n, dtype=np.bool_)
    changed = before != now
    where: BoolArray = changed.any(axis=1) if changed.ndim == 2 else changed.any(axis=(0, 2))
    return where


def _stretches(pose: Pose, most_frames: int, most: int) -> IntArray:
    """Return the first frames of stretches in which the body moves little: one metric will do.

    Parameters
    ----------
    pose : Pose
    most_frames : int
        Of a stretch.
    most : int
        How many stretches there is memory for.
    """
    n_frames = len(pose.rotations)
    moved = np.abs(np.diff(pose.rotations, axis=0)).max(axis=(1, 2, 3), initial=0.0)
    way = np.concatenate([[0.0], np.cumsum(moved)]) / tuning.METRIC_TURN
    number = way.astype(np.int64) + np.arange(n_frames) // most_frames
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    return starts[:: -(-len(starts) // max(most, 1))]
