"""Bases: directions in which a body's channels move together, found by PCA in the skin's metric.

In a basis the motions of a class need a few directions, and of the others next to nothing. A clip
can bring its own basis, or refer to one that a library keeps for a whole class.

The channels of joint 0 stay as they are. Of the others, x = A z with ``A = R^-1 V``: the metric
``W = R.T R`` of the skin (see `skin_metric`), averaged, makes all directions of R x cost the same,
and V are the principal axes there. A is kept in bytes, so that every reader has the same, and a
writer projects on what is kept.
"""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.pose.skin_metric import error_points, metric_factors
from mocapdb.compression.pose.smooth_channels import ORDERS, SmoothChannels, three_angle_joints
from mocapdb.compression.tuning import (
    BASIS_METRIC_FRAMES,
    BASIS_MOST_CONDITION,
    BASIS_RIDGE,
)
from mocapdb.errors import CodecError
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton

__all__ = ["DIGEST_BYTES", "Basis", "fit_basis"]

DIGEST_BYTES = 8
_UNIT = 64  # the format: an entry of 64 is one
_LARGEST = 127
_SCALES_PER_OCTAVE = 3  # the format: rows differ in scale by thirds of an octave


@dataclass(frozen=True)
class Basis:
    """A basis of the channels of a skeleton.

    Attributes
    ----------
    orders : tuple of str
        The orders of axes of the joints with three angles, in the smooth channels.
    scales : (D,) int8
        Of each channel below joint 0: what an entry of one stands for, in thirds of an octave.
    entries : (D, D) int8
    """

    orders: tuple[str, ...]
    scales: NDArray[np.int8]
    entries: NDArray[np.int8]

    @cached_property
    def matrix(self) -> FloatArray:
        """A (D, D)."""
        return np.asarray(
            np.exp2(self.scales / _SCALES_PER_OCTAVE)[:, None] * (self.entries / _UNIT)
        )

    @cached_property
    def _inverse(self) -> FloatArray:
        return np.asarray(np.linalg.inv(self.matrix), dtype=np.float64)

    def coordinates(self, values: FloatArray) -> FloatArray:
        """Return smooth channels (F, C) in this basis."""
        n_root = values.shape[1] - len(self.scales)
        return np.hstack([values[:, :n_root], values[:, n_root:] @ self._inverse.T])

    def expand(self, coordinates: FloatArray) -> FloatArray:
        """Return the smooth channels (F, C) of coordinates: the inverse of `coordinates`."""
        n_root = coordinates.shape[1] - len(self.scales)
        # sums in one order, however many threads there are
        body = np.einsum("fk,ik->fi", coordinates[:, n_root:], self.matrix)
        return np.hstack([coordinates[:, :n_root], body])

    def transform_metric(self, factors: FloatArray) -> FloatArray:
        """Return the metric's factors (F, C, C) of smooth channels as those of coordinates."""
        n_root = factors.shape[-1] - len(self.scales)
        turned = factors.copy()
        turned[:, :, n_root:] = factors[:, :, n_root:] @ self.matrix
        upper = np.linalg.qr(turned, mode="r")
        signs = np.where(np.diagonal(upper, axis1=1, axis2=2) < 0, -1.0, 1.0)
        return np.ascontiguousarray(upper * signs[..., None])

    def to_bytes(self) -> bytes:
        """Return the basis as bytes (docs/format.md)."""
        orders = bytes(ORDERS.index(order) for order in self.orders)
        return zlib.compress(orders + self.scales.tobytes() + self.entries.tobytes(), 9)

    @classmethod
    def from_bytes(cls, data: bytes, skeleton: Skeleton) -> Basis:
        """Return the basis that `to_bytes` wrote.

        Raises
        ------
        CodecError
            If the bytes are no basis of such a skeleton.
        """
        n_orders = len(three_angle_joints(skeleton))
        n = skeleton.n_channels - len(skeleton.dofs[0])
        size = n_orders + n + n * n
        try:
            reader = zlib.decompressobj()
            content = reader.decompress(data, size + 1)
        except zlib.error as problem:
            raise CodecError(f"Expected a basis, but its bytes are damaged ({problem}).") from None
        if len(content) != size or not reader.eof or max(content[:n_orders], default=0) > 5:
            raise CodecError(f"Expected a basis of {n} channels, but got something else.")
        numbers = np.frombuffer(content, dtype=np.int8, offset=n_orders)
        orders = tuple(ORDERS[index] for index in content[:n_orders])
        return cls(orders, numbers[:n], numbers[n:].reshape(n, n))

    @cached_property
    def digest(self) -> bytes:
        """The first bytes of the SHA-256 of its bytes, by which clips refer to it."""
        return hashlib.sha256(self.to_bytes()).digest()[:DIGEST_BYTES]

    def fits(self, skeleton: Skeleton) -> bool:
        """Say whether a skeleton has the channels that this is a basis of."""
        n = skeleton.n_channels - len(skeleton.dofs[0])
        return len(self.scales) == n and len(self.orders) == len(three_angle_joints(skeleton))


def fit_basis(clips: Sequence[SmoothChannels]) -> Basis | None:
    """Return the basis of some clips whose skeletons have the same channels.

    Parameters
    ----------
    clips : sequence of SmoothChannels
        With the same orders of axes.

    Returns
    -------
    Basis, or None where there is nothing to find: no channel below joint 0, or directions so much
    alike that no matrix of bytes tells them apart.
    """
    skeleton = clips[0].skeleton
    n_root = len(skeleton.dofs[0])
    n = skeleton.n_channels - n_root
    if n == 0:
        return None
    metric = np.zeros((n, n))
    scatter = np.zeros((n, n))
    n_frames = 0
    for clip in clips:
        some = clip.values(slice(None, None, -(-len(clip) // BASIS_METRIC_FRAMES)))
        pose = forward_kinematics(clip.skeleton, some)
        factors = metric_factors(clip.skeleton, some, pose, error_points(clip.skeleton, "skin"))
        body = factors[:, :, n_root:]
        metric += np.einsum("fki,fkj->ij", body, body) / len(some)
        mean = sum(chunk.sum(axis=0) for chunk in clip.chunks()) / len(clip)
        for chunk in clip.chunks():
            centred = (chunk - mean)[:, n_root:]
            scatter += centred.T @ centred
        n_frames += len(clip)
    metric[np.diag_indices(n)] *= 1.0 + BASIS_RIDGE
    metric[np.diag_indices(n)] += 1e-9 * np.trace(metric) / n + 1e-30
    root = np.linalg.cholesky(metric / len(clips)).T
    _, axes = np.linalg.eigh(root @ (scatter / n_frames) @ root.T)
    matrix = np.linalg.solve(root, axes[:, ::-1])
    largest = np.abs(matrix).max(axis=1)
    scales = np.clip(np.ceil(_SCALES_PER_OCTAVE * np.log2(largest * _UNIT / _LARGEST)), -128, 127)
    entries = np.rint(matrix / np.exp2(scales / _SCALES_PER_OCTAVE)[:, None] * _UNIT)
    orders = tuple(skeleton.rotation_orders[joint] for joint in three_angle_joints(skeleton))
    basis = Basis(orders, scales.astype(np.int8), np.clip(entries, -127, 127).astype(np.int8))
    return basis if np.linalg.cond(basis.entries / _UNIT) < BASIS_MOST_CONDITION else None
