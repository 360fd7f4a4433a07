"""Sketches: which stretches of a long vocabulary are worth comparing with a word.

The sketch of a word is a few of its frames, each as a point. A joint's part of it are the products
of its quaternion's numbers, so that the dot product of two such parts is the squared cosine of half
the angle between two rotations; the points of all joints are turned to the axes along which the
vocabulary spreads most. Words are compared at several tempos, by one product of matrices.
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import BoolArray, Float32Array, IntArray
from mocapdb.cleaning.tuning import SKETCH_AXES, SKETCH_FRAMES, SKETCH_TEMPOS, SOURCE_FRAMES

__all__ = ["promising_blocks"]

FAR = np.float32(1e30)
MOST_FOR_AXES = 2000  # frames that the axes are found by
# no result depends on these
FRAMES_AT_ONCE, WORDS_AT_ONCE, BLOCKS_AT_ONCE = 4096, 256, 512


def promising_blocks(
    quats: Float32Array,
    source: Float32Array,
    starts: IntArray,
    valid: BoolArray,
    middles: IntArray | None,
    lanes: int,
    n_blocks: int,
) -> IntArray:
    """Return (W, n) which blocks of targets look most like each word; -1 where there are fewer.

    Parameters
    ----------
    quats : (K, 4, T) of float32
        The vocabulary, time last.
    source : (F, K, 4) of float32
    starts : (W,)
        First frame of each word.
    valid : (N,) of bool
        Whether a target starts at a frame of the vocabulary.
    middles : (W,), optional
        Targets that show the word itself; those within half a word of it are passed over.
    lanes : int
        Targets in a block.
    n_blocks : int
        How many blocks are wanted.
    """
    every = max(1, quats.shape[2] // MOST_FOR_AXES)
    some = _products(quats[:, :, ::every])
    mean = some.mean(axis=0)
    axes = np.linalg.eigh((some - mean).T @ (some - mean))[1][:, -SKETCH_AXES:].astype(np.float32)
    context = _points(quats, mean, axes)
    own = _points(np.moveaxis(source, 0, 2), mean, axes)
    words = own[starts[:, None] + np.array(SKETCH_FRAMES)].reshape(len(starts), -1)
    n_targets = len(valid)
    total, half = -(-n_targets // lanes), (SOURCE_FRAMES - 1) // 2
    wanted = min(n_blocks, total)
    chosen = np.empty((len(starts), wanted), dtype=np.int64)
    shifts = [np.rint(np.array(SKETCH_FRAMES) * tempo).astype(int) for tempo in SKETCH_TEMPOS]
    for first in range(0, len(starts), WORDS_AT_ONCE):
        asked = slice(first, first + WORDS_AT_ONCE)
        promise = np.empty((len(words[asked]), total), dtype=np.float32)
        for block in range(0, total, BLOCKS_AT_ONCE):
            targets = np.arange(block * lanes, min((block + BLOCKS_AT_ONCE) * lanes, n_targets))
            apart = _apart(words[asked], context, targets, shifts, ~valid[targets] * FAR)
            for row, middle in enumerate(middles[asked] if middles is not None else ()):
                own = middle - targets[0] + np.array([-half, half + 1])
                apart[row, slice(*np.maximum(own, 0))] = FAR
            n_here = math.ceil(len(targets) / lanes)
            promise[:, block : block + n_here] = _by_block(apart, lanes, n_here)
        best = np.argpartition(promise, wanted - 1, axis=1)[:, :wanted]
        known = np.take_along_axis(promise, best, axis=1) < FAR
        chosen[asked] = np.where(known, best, -1)
    return chosen


def _products(quats: Float32Array) -> Float32Array:
    """Return (T, 10 K) the products of each joint's quaternion's numbers, of (K, 4, T)."""
    parts = [
        quats[:, i] * quats[:, j] * np.float32(1.0 if i == j else math.sqrt(2.0))
        for i in range(4)
        for j in range(i, 4)
    ]
    return np.concatenate(parts).T


def _points(quats: Float32Array, mean: Float32Array, axes: Float32Array) -> Float32Array:
    """Return (T, SKETCH_AXES) the points of frames (K, 4, T)."""
    n_frames = quats.shape[2]
    points = np.empty((n_frames, axes.shape[1]), dtype=np.float32)
    for first in range(0, n_frames, FRAMES_AT_ONCE):
        some = slice(first, first + FRAMES_AT_ONCE)
        points[some] = (_products(quats[:, :, some]) - mean) @ axes
    return points


def _apart(
    words: Float32Array,
    context: Float32Array,
    targets: IntArray,
    shifts: list[IntArray],
    more: Float32Array,
) -> Float32Array:
    """Return (W, T) the squared distances of words to targets, less what is the same for all.

    `more` (T,) is added.
    """
    least: Float32Array | None = None
    for frames in shifts:
        shown = context[targets[:, None] + frames].reshape(len(targets), -1)
        apart = words @ (np.float32(-2.0) * shown.T)
        apart += np.einsum("ij,ij->i", shown, shown) + more
        least = apart if least is None else np.minimum(least, apart, out=least)
    assert least is not None
    return least


def _by_block(apart: Float32Array, lanes: int, n_blocks: int) -> Float32Array:
    """Return (W, n_blocks) the least of each block of distances (W, T)."""
    whole = np.full((len(apart), n_blocks * lanes), FAR)
    whole[:, : apart.shape[1]] = apart
    return np.asarray(whole.reshape(len(apart), n_blocks, lanes).min(axis=2))
