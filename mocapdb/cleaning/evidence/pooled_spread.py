"""Pooled spread: how odd a joint is in a stretch, among what it and the opposite one do elsewhere.

In a short clip a fault is much of what a joint does, and so hardly odd in the joint's own spread.
The opposite joint does the same, mirrored, and is rarely wrong, too. So the spread is that of the
joint outside of the stretch and of the opposite joint anywhere: of rotations, and of *excursions*,
which are how far a joint is from the middle of the way between where it is a little earlier and a
little later (see `excursions`).
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.cleaning.evidence.exchanges import MIRRORS
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import (
    LEAST_ODD,
    MOST_POOLED,
    MOST_TESTED,
    SPREAD_FLOOR_DEG,
    SPREAD_QUANTILE,
)
from mocapdb.motion.body.joint_names import across_by_names
from mocapdb.motion.quaternions import angles_deg, conjugate, multiply, rotation_vectors_deg, slerp

__all__ = ["PooledSpread"]

LEAST_POOLED = 5
"""Of fewer vectors there is no spread to speak of."""


class PooledSpread:
    """The spread of each joint's rotations and excursions, and of the opposite joint's, mirrored.

    Parameters
    ----------
    texture : Texture
        As words are cut from it.
    """

    def __init__(self, texture: Texture) -> None:
        self.fps, self.n_frames = texture.fps, len(texture)
        self._quats = texture.quat_xyzw
        across = across_by_names(texture.skeleton.names)
        rows = {joint: row for row, joint in enumerate(texture.joints.tolist())}
        self._opposite = [rows.get(int(across[joint]), row) for joint, row in rows.items()]
        self._mirrored: dict[int, FloatArray | None] = {}
        self._poses: dict[int, tuple[FloatArray, FloatArray]] = {}
        self._moves: dict[tuple[int, int], tuple[FloatArray, FloatArray]] = {}

    def pose(self, row: int, start: int, end: int) -> float:
        """Return how odd a joint's rotations are in frames ``start:end`` of the texture.

        That is the logarithm of their median Mahalanobis distance from the others', against what
        most of the others have; 0 where too few are known.
        """
        if row not in self._poses:
            own, other = self._quats[:, row], self._other(row)
            back = conjugate(_mean(own))
            more = (
                np.zeros((0, 3))
                if other is None
                else rotation_vectors_deg(multiply(back, other[_evenly(len(other), MOST_POOLED)]))
            )
            self._poses[row] = rotation_vectors_deg(multiply(back, own)), more
        own_vectors, more = self._poses[row]
        at = _evenly(self.n_frames, MOST_POOLED)
        pool = np.concatenate([own_vectors[at[(at < start) | (at >= end)]], more])
        return _oddness(own_vectors[start:end], pool)

    def move(self, row: int, start: int, end: int) -> float:
        """Return how odd the excursion of a joint is that begins and ends as the frames do."""
        half = min(math.ceil((end - start) / 2) + 1, (self.n_frames - 1) // 2)
        if half < 1:
            return 0.0
        middles = np.arange(half, self.n_frames - half)
        at = middles[_evenly(len(middles), MOST_POOLED)]
        if (row, half) not in self._moves:
            other = self._other(row)
            more = np.zeros((0, 3)) if other is None else _excursions(other, at, half)
            self._moves[row, half] = _excursions(self._quats[:, row], at, half), more
        own_vectors, more = self._moves[row, half]
        pool = np.concatenate([own_vectors[(at + half < start) | (at - half >= end)], more])
        near = max(1, (end - start) // 4)
        middle = min(max((start + end) // 2, half), int(middles[-1]))
        inside = np.clip(np.arange(middle - near, middle + near + 1), half, middles[-1])
        return _oddness(_excursions(self._quats[:, row], inside, half), pool)

    def _other(self, row: int) -> FloatArray | None:
        """Return the opposite joint's rotations, mirrored the way that suits the joint's best."""
        if row not in self._mirrored:
            opposite = self._opposite[row]
            if opposite == row:
                self._mirrored[row] = None
            else:
                mean, other = _mean(self._quats[:, row]), self._quats[:, opposite]
                apart = [float(angles_deg(mean, _mean(other * signs))) for signs in MIRRORS]
                self._mirrored[row] = other * MIRRORS[int(np.argmin(apart))]
        return self._mirrored[row]


def _mean(quats: FloatArray) -> FloatArray:
    signs = np.where(quats @ quats[0] < 0, -1.0, 1.0)[:, None]
    mean = (quats * signs).mean(axis=0)
    return np.asarray(mean / max(float(np.linalg.norm(mean)), 1e-9))


def _excursions(quats: FloatArray, at: IntArray, half: int) -> FloatArray:
    """Return (n, 3) how a joint is turned against the middle of its way, in degrees."""
    middle = slerp(quats[at - half], quats[at + half], np.full(1, 0.5))
    return rotation_vectors_deg(multiply(conjugate(middle), quats[at]))


def _oddness(inside: FloatArray, pool: FloatArray) -> float:
    """Return the logarithm of a Mahalanobis distance, against the usual one."""
    if len(pool) < LEAST_POOLED or not len(inside):
        return 0.0
    middle = pool.mean(axis=0)
    away = pool - middle
    inverse = np.linalg.inv(away.T @ away / len(away) + SPREAD_FLOOR_DEG**2 * np.eye(3))
    usual = float(np.quantile(np.sqrt(np.sum((away @ inverse) * away, axis=1)), SPREAD_QUANTILE))
    here = inside[_evenly(len(inside), MOST_TESTED)] - middle
    odd = float(np.median(np.sqrt(np.sum((here @ inverse) * here, axis=1))))
    return math.log((odd + LEAST_ODD) / (usual + LEAST_ODD))


def _evenly(n: int, most: int) -> IntArray:
    """Return the places of up to `most` out of n, drawn evenly."""
    return np.arange(n) if n <= most else np.linspace(0, n - 1, most).astype(np.int64)
