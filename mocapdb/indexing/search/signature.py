"""A clip as a few numbers: candidates are found by them and then verified."""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import Float32Array

__all__ = ["clip_signature", "signature_distances"]


def clip_signature(frames: Float32Array) -> Float32Array:
    """Return the (2 D,) mean and standard deviation of a clip's frames (F, D)."""
    return np.concatenate([frames.mean(axis=0), frames.std(axis=0)])


def signature_distances(a: Float32Array, b: Float32Array) -> Float32Array:
    """Return the (n, m) Euclidean distances between two sets of signatures."""
    products = a @ b.T
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * products
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))
