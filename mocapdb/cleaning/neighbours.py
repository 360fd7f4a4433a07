"""Nearest words: K confirmed local minima of the warping distance (Aristidou 2018, section 3.3).

The search is exact. A lower bound of the distance to every target costs little; blocks of
neighbouring targets are evaluated in its order, until the bound of what is left exceeds the K-th
smallest minimum found. A target that was left out is then larger than any neighbour kept, so the
minima are those of the whole distance function.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocapdb._jit import jit
from mocapdb._typing import BoolArray, Float32Array, FloatArray, IntArray
from mocapdb.cleaning import _dtw
from mocapdb.cleaning.texture import Texture
from mocapdb.errors import ClipError, SkeletonError

__all__ = ["SOURCE_FRAMES", "STRIDE", "TARGET_FRAMES", "K", "Neighbours", "find_neighbours"]

SOURCE_FRAMES = 15
STRIDE = 5
TARGET_FRAMES = 20
K = 5
RECOUNT_BLOCKS = 8  # blocks evaluated between two looks at the minima


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The nearest words of every word of a texture.

    Attributes
    ----------
    starts : (W,)
        First frame of each source word, of `SOURCE_FRAMES` frames.
    targets : (W, K)
        First frame of each neighbour in the concatenated context, nearest first; -1 where the
        context has fewer minima.
    distances : (W, K) square radians
        Mean of eq. 1 over the matched frames; infinite where there is no neighbour.
    frames : (W, K, SOURCE_FRAMES)
        Context frame, whole or fractional, that each source frame is matched with.
    context_quats : (T, K', 4)
        The context, clip after clip.
    """

    starts: IntArray
    targets: IntArray
    distances: FloatArray
    frames: FloatArray
    context_quats: FloatArray


def find_neighbours(
    source: Texture,
    context: Sequence[Texture],
    *,
    rows: Sequence[int] | None = None,
    n_drop: int = 3,
    k: int = K,
    stride: int = STRIDE,
) -> Neighbours:
    """Find the K nearest words of every word, in a context that may hold the source itself.

    Parameters
    ----------
    source : Texture
    context : sequence of Texture
        Textures of the same joints and rate. Where one *is* the source, words whose middles are
        less than half a word apart are no neighbours.
    rows : sequence of int, optional
        Rows of the texture that count; all by default.
    n_drop : int
        How many of the largest joint distances are left out of each frame's, 0 to 3.
    k : int
        Neighbours wanted.
    stride : int
        Frames between the starts of source words; the last word ends with the texture.

    Raises
    ------
    ClipError
        If the source is shorter than a word, no context clip is as long as a target, rates
        differ, or a number makes no sense.
    SkeletonError
        If the joints differ.
    """
    _check(source, context, k, n_drop, stride)
    chosen = np.arange(len(source.joints)) if rows is None else np.asarray(rows, dtype=np.int64)
    n_drop = min(n_drop, len(chosen) - 1)
    starts = np.arange(0, len(source) - SOURCE_FRAMES + 1, stride)
    if starts[-1] + SOURCE_FRAMES < len(source):
        starts = np.append(starts, len(source) - SOURCE_FRAMES)
    lengths = [len(texture) for texture in context]
    quats = np.concatenate([texture.quat_xyzw for texture in context])
    ends = np.cumsum(lengths)
    valid = np.zeros(len(quats), dtype=np.bool_)  # whether a target starts here
    for end, length in zip(ends, lengths, strict=True):
        valid[end - length : max(end - length, end - TARGET_FRAMES + 1)] = True
    places = [end - n for end, n, t in zip(ends, lengths, context, strict=True) if t is source]
    own = int(places[0]) if places else -(10**9)
    shape = (len(starts), k)
    targets = np.full(shape, -1, dtype=np.int64)
    distances = np.full(shape, np.inf)
    frames = np.full((*shape, SOURCE_FRAMES), np.nan)
    padded = np.concatenate([quats, np.repeat(quats[-1:], _dtw.LANES + TARGET_FRAMES, axis=0)])
    _search(
        np.ascontiguousarray(np.moveaxis(padded, 0, 2).astype(np.float32)),
        source.quat_xyzw.astype(np.float32),
        chosen,
        n_drop,
        starts,
        np.append(valid, np.zeros(_dtw.LANES + TARGET_FRAMES, dtype=np.bool_)),
        own,
        targets,
        distances,
        frames,
    )
    last = ends[np.minimum(np.searchsorted(ends, targets, side="right"), len(ends) - 1)] - 1
    frames = np.minimum(frames, last[..., None])  # what goes on after the path stays in the clip
    return Neighbours(starts, targets, distances, frames, quats)


def _check(source: Texture, context: Sequence[Texture], k: int, n_drop: int, stride: int) -> None:
    if k < 1 or stride < 1 or not 0 <= n_drop <= _dtw.MOST_DROPPED:
        raise ClipError(
            f"Expected k and stride of at least 1 and n_drop from 0 to {_dtw.MOST_DROPPED}, "
            f"but got k {k}, stride {stride}, n_drop {n_drop}."
        )
    if len(source) < SOURCE_FRAMES:
        raise ClipError(
            f"Expected {source.name!r} to have a word of {SOURCE_FRAMES} frames at "
            f"{source.fps:g} Hz, but it has {len(source)}."
        )
    for texture in context:
        if texture.names != source.names:
            raise SkeletonError(
                f"Expected a context with the joints of {source.name!r}, but {texture.name!r} "
                "has others. Leave it out, or convert it."
            )
        if abs(texture.fps - source.fps) > 1e-6:
            raise ClipError(
                f"Expected a context at {source.fps:g} Hz, but {texture.name!r} has "
                f"{texture.fps:g} Hz. Make its texture at that rate."
            )
    if not any(len(texture) >= TARGET_FRAMES for texture in context):
        raise ClipError(
            f"Expected a context with a clip of {TARGET_FRAMES} frames at {source.fps:g} Hz, "
            "but it has none."
        )


@jit
def _search(
    quats: Float32Array,
    source: Float32Array,
    rows: IntArray,
    n_drop: int,
    starts: IntArray,
    valid: BoolArray,
    own: int,
    targets: IntArray,
    distances: FloatArray,
    frames: FloatArray,
) -> None:
    n_context = quats.shape[2]
    n_targets = n_context - _dtw.LANES - TARGET_FRAMES
    n_blocks = (n_targets + _dtw.LANES - 1) // _dtw.LANES
    ring = np.empty((SOURCE_FRAMES, n_context), dtype=np.int32)
    full = np.empty((SOURCE_FRAMES, n_context), dtype=np.int32)  # minima over whole targets
    held = np.full(SOURCE_FRAMES, -1, dtype=np.int64)
    word = np.empty((SOURCE_FRAMES, n_context), dtype=np.int32)
    minima = np.empty((SOURCE_FRAMES, n_context), dtype=np.int32)
    work = np.empty((4, n_context), dtype=np.float32)
    slide = np.empty(n_context, dtype=np.int32)
    bounds = np.empty(n_context, dtype=np.float32)
    block_bounds = np.empty(n_blocks, dtype=np.float32)
    values = np.empty(n_blocks * _dtw.LANES, dtype=np.float32)
    state = np.empty((2, 7, TARGET_FRAMES + 1, _dtw.LANES), dtype=np.int32)
    lanes = np.empty(_dtw.LANES, dtype=np.float32)
    at = np.empty(1, dtype=np.int64)
    pair = np.empty((SOURCE_FRAMES, TARGET_FRAMES), dtype=np.int32)
    cells = np.empty((SOURCE_FRAMES, TARGET_FRAMES, 7), dtype=np.int64)
    k = targets.shape[1]
    for w in range(len(starts)):
        for i in range(SOURCE_FRAMES):
            f = starts[w] + i
            slot = f % SOURCE_FRAMES
            if held[slot] != f:
                _dtw.frame_distances(quats, source[f], rows, n_drop, ring[slot], work)
                _dtw.window_minima(ring[slot], TARGET_FRAMES, full[slot], slide)
                held[slot] = f
            word[i] = ring[slot]
            reach = (_dtw.LONGEST_RUN + 1) * (i + 1)
            if reach < TARGET_FRAMES:  # the first rows reach only the first columns
                _dtw.window_minima(ring[slot], reach, minima[i], slide)
            else:
                minima[i] = full[slot]
        _dtw.bound_words(minima, TARGET_FRAMES, bounds)
        for block in range(n_blocks):
            least = np.float32(1e30)
            for t in range(block * _dtw.LANES, min(n_targets, (block + 1) * _dtw.LANES)):
                if valid[t] and bounds[t] < least:
                    least = bounds[t]
            block_bounds[block] = least
        order = np.argsort(block_bounds)
        values[:] = 1e30
        for done, block in enumerate(order):
            if block_bounds[block] >= 1e30:
                break
            if done % RECOUNT_BLOCKS == 0 and done > 0:
                _minima(values, valid, starts[w], own, n_targets, targets[w], distances[w])
                if targets[w, k - 1] >= 0 and distances[w, k - 1] < block_bounds[block]:
                    break
            at[0] = block * _dtw.LANES
            _dtw.align(word, at, TARGET_FRAMES, state, lanes)
            for lane in range(_dtw.LANES):
                if at[0] + lane < n_targets and valid[at[0] + lane]:
                    values[at[0] + lane] = lanes[lane]
        _minima(values, valid, starts[w], own, n_targets, targets[w], distances[w])
        for n in range(k):
            t = targets[w, n]
            if t < 0:
                break
            for i in range(SOURCE_FRAMES):
                for j in range(TARGET_FRAMES):
                    pair[i, j] = word[i, t + j]
            _dtw.backtrack(pair, SOURCE_FRAMES, TARGET_FRAMES, frames[w, n], cells)
            for i in range(SOURCE_FRAMES):
                frames[w, n, i] += t
            distances[w, n] *= _dtw.UNIT


@jit
def _minima(
    values: Float32Array,
    valid: BoolArray,
    start: int,
    own: int,
    n_targets: int,
    targets: IntArray,
    distances: FloatArray,
) -> None:
    """Insert the smallest local minima into `targets` and `distances`, in units.

    The first of equal ones counts. Words whose middles are less than half a word from the
    source's own are passed over.
    """
    k = len(targets)
    targets[:] = -1
    distances[:] = np.inf
    middle = own + start + SOURCE_FRAMES / 2 - TARGET_FRAMES / 2
    for t in range(n_targets):
        value = values[t]
        if value >= 1e30 or value >= distances[k - 1]:
            continue
        if t > 0 and valid[t - 1] and values[t - 1] <= value:
            continue
        if t + 1 < n_targets and valid[t + 1] and values[t + 1] < value:
            continue
        if abs(t - middle) < SOURCE_FRAMES / 2:
            continue
        n = k - 1
        while n > 0 and distances[n - 1] > value:
            distances[n] = distances[n - 1]
            targets[n] = targets[n - 1]
            n -= 1
        distances[n] = value
        targets[n] = t
