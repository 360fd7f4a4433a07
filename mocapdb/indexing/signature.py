"""A clip, or a stretch of one, as a few numbers: candidates are found by them and then verified."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mocapdb._typing import Float32Array, IntArray

__all__ = ["clip_signatures", "signature_distances"]


def clip_signatures(frames: Float32Array, starts: IntArray) -> Float32Array:
    """Return the (n, 2 D) mean and standard deviation of each clip's frames.

    Parameters
    ----------
    frames : (N, D)
    starts : (n + 1,)
        First frame of each clip, and N at the end.
    """
    found = np.zeros((len(starts) - 1, 2 * frames.shape[1]), dtype=np.float32)
    for row, (first, end) in enumerate(pairwise(starts)):
        if first < end:
            own = frames[first:end]
            found[row] = np.concatenate([own.mean(axis=0), own.std(axis=0)])
    return found


def signature_distances(a: Float32Array, b: Float32Array) -> Float32Array:
    """Return the (n, m) Euclidean distances between two sets of signatures."""
    products = a @ b.T
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * products
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))
