"""What the neighbours say of every joint and frame: their median, mean and spread.

Every frame lies in up to three words, so up to three times K neighbours show it. All that is said
of a joint here is said at the texture's rate.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import BoolArray, Float32Array, FloatArray, IntArray
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.neighbours.body_halves import body_groups
from mocapdb.cleaning.neighbours.nearest_words import Neighbours, Vocabulary, find_neighbours
from mocapdb.cleaning.tuning import (
    DISTINCT_RATIO,
    DROPPED_JOINTS,
    DROPPED_JOINTS_OF_GROUP,
    LEAST_SPREAD_DEG,
    N_CANDIDATES,
    SOURCE_FRAMES,
)
from mocapdb.motion.quaternions import angles_deg

__all__ = [
    "Consensus",
    "consensus_with_others",
    "find_consensus",
    "mean_texture",
    "neighbour_samples",
    "two_stage_consensus",
]

FRAMES_AT_ONCE = 1024  # no result depends on it


@dataclass(frozen=True, eq=False)
class Consensus:
    """The middle of the neighbours and how far they and the clip are from it.

    Attributes
    ----------
    median_quats : (F, K, 4)
        Median of the neighbours' rotations.
    residual_deg : (F, K)
        Angle between the clip and the median. Zero where there is no neighbour.
    spread_deg : (F, K)
        Median angle between the neighbours and their median.
    known : (F,) of bool
        Whether the frame has neighbours.
    neighbours : Neighbours
        Whose they are.
    """

    median_quats: FloatArray
    residual_deg: FloatArray
    spread_deg: FloatArray
    known: BoolArray
    neighbours: Neighbours


def neighbour_samples(
    texture: Texture, neighbours: Neighbours
) -> Iterator[tuple[IntArray, FloatArray]]:
    """Yield frames and the (F', S, K, 4) rotations that the neighbours show there.

    Frames with the same number of samples are yielded together, some at a time; those without any
    are left out.
    Quaternions are in the hemisphere of the clip's own rotation.
    """
    n_frames = len(texture)
    found = np.argwhere(neighbours.targets >= 0)
    word, i = np.repeat(found[:, 0], SOURCE_FRAMES), np.tile(np.arange(SOURCE_FRAMES), len(found))
    frame = neighbours.starts[word] + i
    shown = neighbours.words[found[:, 0], found[:, 1]].reshape(-1, *texture.quat_xyzw.shape[1:])
    order = np.argsort(frame, kind="stable")
    counts = np.bincount(frame, minlength=n_frames)
    ends = np.cumsum(counts)
    for count in np.unique(counts[counts > 0]).tolist():
        all_frames = np.flatnonzero(counts == count)
        for part in range(0, len(all_frames), FRAMES_AT_ONCE):
            frames = all_frames[part : part + FRAMES_AT_ONCE]
            yield frames, _shown(texture, shown, order, (ends - count)[frames], count, frames)


def _shown(
    texture: Texture,
    shown: Float32Array,
    order: IntArray,
    firsts: IntArray,
    count: int,
    frames: IntArray,
) -> FloatArray:
    """Return (F', S, K, 4) the samples of some frames in the hemisphere of the clip's rotations."""
    samples = shown[order[firsts[:, None] + np.arange(count)]].astype(np.float64)
    behind = np.sum(samples * texture.quat_xyzw[frames, None], axis=-1) < 0
    return np.asarray(np.where(behind[..., None], -samples, samples))


def find_consensus(texture: Texture, neighbours: Neighbours) -> Consensus:
    """Return the median of the neighbours and the residuals of a texture."""
    median = texture.quat_xyzw.copy()
    spread = np.zeros(texture.quat_xyzw.shape[:2])
    known = np.zeros(len(texture), dtype=np.bool_)
    for frames, shown in neighbour_samples(texture, neighbours):
        middle = np.median(shown, axis=1)
        middle /= np.linalg.norm(middle, axis=-1, keepdims=True)
        median[frames] = middle
        spread[frames] = np.median(angles_deg(middle[:, None], shown), axis=1)
        known[frames] = True
    residual = angles_deg(median, texture.quat_xyzw)
    return Consensus(median, residual, spread, known, neighbours)


def consensus_with_others(
    texture: Texture, neighbours: Neighbours | None, others: Sequence[tuple[IntArray, Neighbours]]
) -> Consensus:
    """Return the consensus where some neighbours are of other bodies and show only some joints.

    Parameters
    ----------
    texture : Texture
    neighbours : Neighbours, optional
        Those that show every joint; none where the clip is too short.
    others : sequence of (rows, Neighbours)
        At least one. Their distances count as if the joints that they do not show were as far
        apart as the others.

    Returns
    -------
    Consensus
        Of each joint by those that show it. Where nobody does the clip counts as its own median.
    """
    n_rows = len(texture.joints)
    if neighbours is None:
        nowhere = np.zeros((len(texture), n_rows))
        known = np.zeros(len(texture), dtype=np.bool_)
        consensus = Consensus(texture.quat_xyzw, nowhere, nowhere, known, others[0][1])
    else:
        consensus = find_consensus(texture, neighbours)
    shows = np.array([np.isin(np.arange(n_rows), rows) for rows, _ in others])
    for kind in np.unique(shows.T[shows.any(axis=0)], axis=0):
        rows = np.flatnonzero((kind == shows.T).all(axis=1))
        merged = None if neighbours is None else _of_rows(neighbours, rows)
        for n, (own_rows, found) in enumerate(others):
            if not kind[n]:
                continue
            share = (n_rows - DROPPED_JOINTS) / max(len(own_rows) - DROPPED_JOINTS, 1)
            part = replace(_of_rows(found, rows), distances=found.distances * share)
            merged = part if merged is None else merged.merged(part, len(texture))
        assert merged is not None
        own = replace(
            texture, joints=texture.joints[rows], quat_xyzw=texture.quat_xyzw[:, rows], roles=()
        )
        consensus = _with_rows(consensus, find_consensus(own, merged), rows)
    return consensus


def _of_rows(neighbours: Neighbours, rows: IntArray) -> Neighbours:
    """Return neighbours that show only some joints."""
    return replace(neighbours, words=neighbours.words[:, :, :, rows])


def _with_rows(first: Consensus, second: Consensus, rows: IntArray) -> Consensus:
    """Return a consensus with what a second one says of some joints."""
    median, residual = first.median_quats.copy(), first.residual_deg.copy()
    spread = first.spread_deg.copy()
    median[:, rows], residual[:, rows] = second.median_quats, second.residual_deg
    spread[:, rows] = second.spread_deg
    return Consensus(median, residual, spread, first.known | second.known, first.neighbours)


def two_stage_consensus(texture: Texture, vocabulary: Vocabulary) -> Consensus:
    """Return the consensus of the paper's two-stage search (section 5, "Implementation").

    First the words of all joints search in the clip alone. Those with a joint that is distinct
    search again in the whole vocabulary, by groups of joints: a smaller group finds its match
    more easily, and most words of a clip need no second search.

    Parameters
    ----------
    texture : Texture
    vocabulary : Vocabulary
        Of the same joints and rate, without the clip itself.
    """
    own = find_neighbours(texture, [texture])
    consensus = find_consensus(texture, own)
    ratio = consensus.residual_deg / (consensus.spread_deg + LEAST_SPREAD_DEG)
    distinct = (ratio > DISTINCT_RATIO).any(axis=1) | ~consensus.known
    cover = own.starts[:, None] + np.arange(SOURCE_FRAMES)
    starts = own.starts[distinct[cover].any(axis=1)]
    groups = body_groups(texture.skeleton, texture.joints)
    for rows in groups.values() if len(starts) else ():
        found = find_neighbours(
            texture, vocabulary, rows=rows.tolist(), n_drop=DROPPED_JOINTS_OF_GROUP, starts=starts,
            n_candidates=N_CANDIDATES,
        )  # fmt: skip
        consensus = _closer(consensus, find_consensus(texture, found), rows)
    return consensus


def _closer(first: Consensus, second: Consensus, rows: IntArray) -> Consensus:
    """Take a group's rows from the second consensus where its neighbours agree more."""
    better = np.zeros(first.residual_deg.shape, dtype=np.bool_)
    better[:, rows] = (
        second.known[:, None]
        & ((second.spread_deg < first.spread_deg) | ~first.known[:, None])[:, rows]
    )
    return Consensus(
        np.where(better[..., None], second.median_quats, first.median_quats),
        np.where(better, second.residual_deg, first.residual_deg),
        np.where(better, second.spread_deg, first.spread_deg),
        first.known | second.known,
        first.neighbours,
    )


def mean_texture(texture: Texture, neighbours: Neighbours) -> FloatArray:
    """Return (F, K, 4) the mean of all neighbours' words that cover a frame (section 3.4)."""
    mean = texture.quat_xyzw.copy()
    for frames, shown in neighbour_samples(texture, neighbours):
        total = shown.mean(axis=1)
        mean[frames] = total / np.linalg.norm(total, axis=-1, keepdims=True)
    return mean
