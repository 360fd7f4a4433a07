"""The clips that classes were learned from, and how far a clip is from each of them.

Two things are looked at, each over what is usual for the same motion by somebody else:

=======  ========================================================================================
frames   mean and deviation of the frames, in spreads by which people who do the same differ: what
         varies among them tells little, what does not tells much
course   whether both rise and fall together from beginning to end, each from its own mean, and
         whether the same joints move: the order in time, which neither a mean nor a density of
         frames sees (see `mocapdb.indexing.search.course`)
=======  ========================================================================================
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mocapdb.base.arrays import BoolArray, Float32Array, FloatArray, IntArray
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.search.features import N_FEATURES, FeatureSpace
from mocapdb.indexing.search.signature import clip_signature, signature_distances
from mocapdb.indexing.search.warping import frame_distances, warp_whole
from mocapdb.indexing.tuning import (
    COURSE_COST,
    EXAMPLE_AXES,
    EXAMPLE_COURSE,
    EXAMPLE_FRAMES,
    LEFT_OUT_PARTS,
    OWN_SPREAD,
    SHARES_COST,
    STILL_SPREAD_M,
)

__all__ = ["ClipShapes", "Examples", "people_share"]


@dataclass(frozen=True, eq=False)
class ClipShapes:
    """Some clips as they are compared.

    Attributes
    ----------
    signatures : (n, 2 D) metres
        Mean and deviation of the frames: see `clip_signature`.
    frames : (n, 24, A) metres
        Even samples from the first frame to the last, from the clip's mean, along the first axes.
    shares : (n, 107)
        Spread of each feature over the clip, as a unit vector.
    """

    signatures: Float32Array
    frames: np.ndarray[Any, Any]
    shares: np.ndarray[Any, Any]

    @classmethod
    def of(cls, motions: Sequence[CanonicalMotion], space: FeatureSpace) -> ClipShapes:
        """Return the shapes of some motions."""
        n, n_axes = len(motions), min(EXAMPLE_AXES, space.n_dims)
        found = cls(
            np.zeros((n, 2 * space.n_dims), np.float32),
            np.zeros((n, EXAMPLE_FRAMES, n_axes), np.float16),
            np.zeros((n, N_FEATURES), np.float16),
        )
        for i, motion in enumerate(motions):
            frames = space.frames(motion)
            found.signatures[i] = clip_signature(frames)
            centred = frames - frames.mean(axis=0)
            found.frames[i] = _sampled(centred[:, :n_axes])
            spread = np.sqrt(((centred @ space.axes.T) ** 2).mean(axis=0)) + STILL_SPREAD_M / 10
            found.shares[i] = spread / np.linalg.norm(spread)
        return found

    def __len__(self) -> int:
        return len(self.signatures)

    def __getitem__(self, rows: IntArray) -> ClipShapes:
        return ClipShapes(self.signatures[rows], self.frames[rows], self.shares[rows])

    def courses(self) -> Float32Array:
        """Return a unit vector of each clip, whose products say how far two go together.

        The last number keeps two poses held together, whatever they sway by.
        """
        flat = self.frames.reshape(len(self), -1).astype(np.float32)
        held = np.full((len(self), 1), np.sqrt(EXAMPLE_FRAMES) * STILL_SPREAD_M, np.float32)
        vectors = np.hstack([flat, held])
        return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


@dataclass(frozen=True, eq=False)
class Examples:
    """Clips of known classes.

    Attributes
    ----------
    shapes : ClipShapes
    whitening : (2 D, 2 D)
        Brings signatures to spreads in which people differ who do the same.
    usual : (2,)
        The median distance from a clip to the nearest of its class by somebody else, by frames and
        by course.
    """

    shapes: ClipShapes
    whitening: FloatArray
    usual: FloatArray

    @classmethod
    def fit(
        cls, shapes: ClipShapes, classes: IntArray, people: np.ndarray[Any, Any], rows: IntArray
    ) -> Examples:
        """Learn what is usual from clips (n,) of classes by people, asked of some of them."""
        whitening = _whitening(shapes.signatures, classes, people)
        plain = cls(shapes, whitening, np.ones(2))
        same = (classes[rows, None] == classes) & (people[rows, None] != people)
        usual = [_nearest(each, same) for each in plain.parts(shapes[rows])]
        return cls(shapes, whitening, np.array(usual))

    @staticmethod
    def left_out_distances(
        shapes: ClipShapes, classes: IntArray, people: np.ndarray[Any, Any], rows: IntArray
    ) -> Float32Array:
        """Return how far some clips are from those by others (m, n), infinite by the same.

        As of clips that nothing was learned from: what is usual is learned without their people,
        a tenth of all people at a time; with them where no two of the others share a class.
        """
        _, person = np.unique(people, return_inverse=True)
        fold = person % LEFT_OUT_PARTS
        found = np.full((len(rows), len(shapes)), np.inf, np.float32)
        for part in range(int(fold.max(initial=0)) + 1):
            others, asked = np.flatnonzero(fold != part), np.flatnonzero(fold[rows] == part)
            if not len(others) or not len(asked):
                continue
            learned = others
            if not people_share(classes[others], people[others]):
                learned = np.arange(len(shapes))
            some = np.flatnonzero(np.isin(learned, rows))
            fitted = Examples.fit(shapes[learned], classes[learned], people[learned], some)
            known = Examples(shapes[others], fitted.whitening, fitted.usual)
            found[np.ix_(asked, others)] = known.distances(shapes[rows[asked]])
        return found

    def distances(self, others: ClipShapes) -> Float32Array:
        """Return how far m other clips are from each of the n, (m, n).

        Matched evenly from beginning to end.
        """
        frames, course = self.parts(others)
        frames += np.float32(EXAMPLE_COURSE) * course
        return frames

    def warped_distances(self, other: ClipShapes, rows: IntArray) -> FloatArray:
        """Return how far one other clip is from some of the n, (m,), each warped to it."""
        frames, _ = self[rows].parts(other)
        course = np.array([_warped_course(other, self.shapes, row) for row in rows])
        return np.asarray(frames[0] + EXAMPLE_COURSE * course / self.usual[1])

    def __getitem__(self, rows: IntArray) -> Examples:
        return Examples(self.shapes[rows], self.whitening, self.usual)

    def parts(self, others: ClipShapes) -> tuple[Float32Array, Float32Array]:
        """Return the distances by frames and by course, (m, n) each, over what is usual."""
        whitening = self.whitening.astype(np.float32)
        frames = signature_distances(
            others.signatures @ whitening, self.shapes.signatures @ whitening
        )
        course = np.float32(COURSE_COST) * (1 - others.courses() @ self.shapes.courses().T)
        ours, theirs = (each.shares.astype(np.float32) for each in (others, self.shapes))
        course += np.float32(SHARES_COST) * signature_distances(ours, theirs)
        return frames / np.float32(self.usual[0]), course / np.float32(self.usual[1])


def people_share(classes: IntArray, people: IntArray) -> bool:
    """Return whether two people perform one of the classes."""
    return len(np.unique(np.column_stack([classes, people]), axis=0)) > len(np.unique(classes))


def _sampled(frames: Float32Array) -> Float32Array:
    """Return 24 frames at even steps from the first to the last, interpolated linearly."""
    times = np.linspace(0, len(frames) - 1, EXAMPLE_FRAMES)
    before = np.minimum(times.astype(np.int64), len(frames) - 1)
    after = np.minimum(before + 1, len(frames) - 1)
    share = (times - before)[:, None]
    return np.asarray(frames[before] * (1 - share) + frames[after] * share, dtype=np.float32)


def _warped_course(other: ClipShapes, shapes: ClipShapes, row: int) -> float:
    """Return how far the course of one clip is from that of a row of others, once warped to it."""
    means = [each.signatures[i, : each.frames.shape[2]] for each, i in ((other, 0), (shapes, row))]
    centred = [each.frames[i].astype(np.float32) for each, i in ((other, 0), (shapes, row))]
    ours, theirs = (frames + mean for frames, mean in zip(centred, means, strict=True))
    path, _ = warp_whole(frame_distances(ours, theirs))
    ours, theirs = (frames[at] for frames, at in zip(centred, path.T, strict=True))
    floor = len(path) * STILL_SPREAD_M**2
    together = ((ours * theirs).sum() + floor) / np.sqrt(
        ((ours**2).sum() + floor) * ((theirs**2).sum() + floor)
    )
    shares = other.shares[0].astype(np.float32) - shapes.shares[row].astype(np.float32)
    return float(COURSE_COST * (1 - together) + SHARES_COST * np.linalg.norm(shares))


def _whitening(
    signatures: Float32Array, classes: IntArray, people: np.ndarray[Any, Any]
) -> FloatArray:
    """Return (2 D, 2 D) what brings signatures to spreads within classes, between people.

    The covariance of the people's means, every class counting the same, half of it the same in all
    directions: of few people it is known roughly.
    """
    n = signatures.shape[1]
    spreads: list[Any] = []
    for row in np.unique(classes):
        own, who = signatures[classes == row].astype(np.float64), people[classes == row]
        names, rows = np.unique(who, return_inverse=True)
        if len(names) < 2:
            continue
        means = np.zeros((len(names), n))
        np.add.at(means, rows, own)
        means /= np.bincount(rows)[:, None]
        spreads.append(np.cov(means, rowvar=False))
    spread = np.mean(spreads, axis=0) if spreads else np.eye(n)
    even = max(float(np.trace(spread)) / n, 1e-12)
    variances, axes = np.linalg.eigh(OWN_SPREAD * spread + (1 - OWN_SPREAD) * even * np.eye(n))
    return np.asarray(axes / np.sqrt(variances))


def _nearest(distances: Float32Array, same: BoolArray) -> float:
    """Return the median of the distances to the nearest of the same class; 1 if there is none."""
    nearest = np.where(same, distances, np.inf).min(axis=1, initial=np.inf)
    known = nearest[np.isfinite(nearest)]
    return max(float(np.median(known)), 1e-6) if len(known) else 1.0
