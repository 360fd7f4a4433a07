"""Pose spread: how odd a joint's rotations in a stretch are among those of the rest of the clip.

`joint_limits` asks for the nearest rotation that was seen; this asks how a joint's rotations spread
about their mean. A knee bends about one axis: turned about another one it is far outside, however
little it is turned.
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import MOST_TESTED, SPREAD_FLOOR_DEG, SPREAD_QUANTILE
from mocapdb.motion.quaternions import conjugate, multiply, rotation_vectors_deg

__all__ = ["PoseSpread"]


class PoseSpread:
    """The spread of each joint's rotations over a clip.

    Parameters
    ----------
    texture : Texture
    """

    def __init__(self, texture: Texture) -> None:
        quats = texture.quat_xyzw
        mean = quats.mean(axis=0)
        mean /= np.maximum(np.linalg.norm(mean, axis=-1, keepdims=True), 1e-9)
        self._vectors = rotation_vectors_deg(multiply(conjugate(mean), quats))
        first = np.cumsum(self._vectors, axis=0)
        second = np.cumsum(self._vectors[..., :, None] * self._vectors[..., None, :], axis=0)
        self._first = np.concatenate([np.zeros((1, *first.shape[1:])), first])
        self._second = np.concatenate([np.zeros((1, *second.shape[1:])), second])
        self._usual: dict[int, float] = {}

    def oddness(self, row: int, start: int, end: int) -> float:
        """Return the logarithm of how odd a joint is in frames ``start:end`` of the texture.

        That is the median Mahalanobis distance of its rotations there from those of the other
        frames, against what most frames of the clip have.
        """
        if end <= start:
            return 0.0
        n_frames = len(self._vectors)
        n = n_frames - (end - start)
        if n < 5:
            return 0.0
        first = self._first[-1, row] - self._first[end, row] + self._first[start, row]
        second = self._second[-1, row] - self._second[end, row] + self._second[start, row]
        middle = first / n
        spread = second / n - np.outer(middle, middle) + SPREAD_FLOOR_DEG**2 * np.eye(3)
        inverse = np.linalg.inv(spread)
        at = np.unique(np.linspace(start, end - 1, min(end - start, MOST_TESTED)).astype(np.int64))
        away = self._vectors[at, row] - middle
        inside = float(np.median(np.sqrt(np.einsum("ij,jk,ik->i", away, inverse, away))))
        return math.log((inside + 0.5) / (self._usual_of(row) + 0.5))

    def _usual_of(self, row: int) -> float:
        if row not in self._usual:
            away = self._vectors[:, row] - self._vectors[:, row].mean(axis=0)
            spread = away.T @ away / len(away) + SPREAD_FLOOR_DEG**2 * np.eye(3)
            sizes = np.sqrt(np.einsum("ij,jk,ik->i", away, np.linalg.inv(spread), away))
            self._usual[row] = float(np.quantile(sizes, SPREAD_QUANTILE))
        return self._usual[row]
