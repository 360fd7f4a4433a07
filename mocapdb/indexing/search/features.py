"""What a frame is compared by: the pose, how it moves, and how the body travels and turns.

A frame has D = 107 numbers, all of them lengths in metres once weighted:

=====================  =====  ====================================================================
pose                   51     positions of 17 joints from the middle of the hips, facing taken out
velocity               51     their velocities, times `Weights.velocity_s`
height                 1      of the hips, times `Weights.height`
travel                 3      velocity of the hips as the body sees it, times `Weights.travel_s`
turn                   1      rate of turning, times `Weights.turn_ms`
=====================  =====  ====================================================================

Where the body is and which way it faces are left out, and so, by the canonical body, is its size.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from mocapdb.base.arrays import BoolArray, Float32Array, FloatArray
from mocapdb.errors import ClipError
from mocapdb.indexing.canonical.canonical_body import JOINTS
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion, turned
from mocapdb.indexing.tuning import (
    FURTHEST_ROOT_M,
    HEIGHT,
    N_AXES,
    OUTLYING,
    OUTLYING_M,
    TRAVEL_S,
    TURN_MS,
    VELOCITY_S,
)

__all__ = ["N_FEATURES", "FeatureSpace", "Weights", "frame_features", "outlying"]

N_POSE = 3 * (len(JOINTS) - 1)
N_FEATURES = 2 * N_POSE + 5


@dataclass(frozen=True)
class Weights:
    """What the parts of a frame count beside the pose, each as a length.

    Parameters
    ----------
    velocity_s : float, seconds
        A joint that is 1 m/s faster counts as one that is this many metres away.
    height : float
        Metres for a metre of difference in the height of the hips.
    travel_s : float, seconds
        As `velocity_s`, for the hips' way through the world.
    turn_ms : float, metres times seconds
        Metres for one radian a second.

    Raises
    ------
    ClipError
        If a weight is negative or not finite.
    """

    velocity_s: float = VELOCITY_S
    height: float = HEIGHT
    travel_s: float = TRAVEL_S
    turn_ms: float = TURN_MS

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (np.isfinite(value) and value >= 0):
                raise ClipError(f"Expected {field.name} to be 0 or more, but got {value}.")

    def scales(self) -> FloatArray:
        """Return the (107,) factor of each feature."""
        return np.concatenate(
            [
                np.ones(N_POSE),
                np.full(N_POSE, self.velocity_s),
                [self.height],
                np.full(3, self.travel_s),
                [self.turn_ms],
            ]
        )


def frame_features(motion: CanonicalMotion) -> FloatArray:
    """Return the (F, 107) features of a motion, not yet weighted.

    Metres, metres a second and radians a second. Velocities are central differences over two
    frames, one-sided at the ends; a motion of one frame has none.
    """
    pose = motion.pose[:, 1:].reshape(len(motion), -1)
    travel = turned(_rate(motion.root, motion.fps), -motion.yaw)
    turn = _rate(motion.yaw, motion.fps)
    return np.column_stack([pose, _rate(pose, motion.fps), motion.root[:, 1], travel, turn])


def _rate(values: FloatArray, fps: float) -> FloatArray:
    """Return the change of values a second."""
    frames = np.arange(len(values))
    before, after = np.maximum(frames - 1, 0), np.minimum(frames + 1, len(values) - 1)
    spans = np.maximum(after - before, 1) / fps
    return np.asarray(((values[after] - values[before]).T / spans).T)


@dataclass(frozen=True)
class FeatureSpace:
    """The space that frames are compared in: weighted features, their mean, their first axes.

    Attributes
    ----------
    weights : Weights
    mean : (107,), metres
        Of the weighted features.
    axes : (107, D)
        Orthonormal, by falling variance; signs fixed by the largest entry.
    deviations : (D,), metres
        Standard deviation along each axis.
    counted : (107, m), optional
        What of the features counts at all; everything by default. See `body_parts`.
    directions : (m, D), optional
        The axes among what counts, orthonormal.
    still : bool
        Whether nothing but the pose counts: not how it moves, alone or as a whole.
    """

    weights: Weights
    mean: FloatArray
    axes: FloatArray
    deviations: FloatArray
    counted: FloatArray | None = None
    directions: FloatArray | None = None
    still: bool = False

    @classmethod
    def fit(
        cls, motions: Iterable[CanonicalMotion], weights: Weights | None = None, dims: int = N_AXES
    ) -> FeatureSpace:
        """Find the mean and the axes of largest variance (PCA) over all frames of some motions.

        Motions with a frame that lies out of all proportion are left out: see `outlying`.
        """
        motions = motions if isinstance(motions, Sequence) else list(motions)
        weights = weights or Weights()
        scales = weights.scales()
        left_out = outlying(motions, weights)
        count, total = 0, np.zeros(N_FEATURES)
        products = np.zeros((N_FEATURES, N_FEATURES))
        for i, motion in enumerate(motions):
            if left_out[i]:
                continue
            values = frame_features(motion) * scales
            count += len(values)
            total += values.sum(axis=0)
            products += values.T @ values
        mean = total / max(count, 1)
        covariance = products / max(count, 1) - np.outer(mean, mean)
        variances, axes = (values[..., ::-1][..., :dims] for values in np.linalg.eigh(covariance))
        largest = axes[np.abs(axes).argmax(axis=0), np.arange(dims)]
        deviations = np.sqrt(np.maximum(variances, 0.0))
        return cls(weights, mean, axes * np.where(largest < 0, -1.0, 1.0), deviations)

    @property
    def n_dims(self) -> int:
        """Number of axes D."""
        return int(self.axes.shape[1])

    def frames(self, motion: CanonicalMotion) -> Float32Array:
        """Return the (F, D) frames of a motion, in metres."""
        values = frame_features(motion) * self.weights.scales() - self.mean
        return np.ascontiguousarray(values @ self.axes, dtype=np.float32)

    def all_features(self, motion: CanonicalMotion) -> tuple[Float32Array, Float32Array]:
        """Return the (F, D) frames of a motion, and what of them lies beside the axes.

        The second are the (F,) squares of how far they lie from the axes, in metres. With them
        distances are those of all that counts: from frames that lie on the axes, of a motion that
        need not.
        """
        values = frame_features(motion) * self.weights.scales() - self.mean
        if self.counted is not None:
            values = values @ self.counted
        frames = values @ (self.axes if self.directions is None else self.directions)
        squares = (values**2).sum(axis=1) - (frames**2).sum(axis=1)
        return (
            np.ascontiguousarray(frames, dtype=np.float32),
            np.asarray(np.maximum(squares, 0.0), dtype=np.float32),
        )

    def is_outlying(self, motion: CanonicalMotion) -> bool:
        """Return whether a motion has a frame that lies out of all proportion: see `outlying`."""
        values = frame_features(motion) * self.weights.scales()
        reach = max(OUTLYING * float(np.linalg.norm(self.deviations)), OUTLYING_M)
        furthest = np.linalg.norm(values - self.mean, axis=1).max()
        return bool(furthest > reach or _is_far(motion))


def outlying(motions: Sequence[CanonicalMotion], weights: Weights) -> BoolArray:
    """Return which motions have a frame that lies out of all proportion, (n,).

    The middle is the median over the motions of their median frames. The scale is what is usual:
    the root of the median square of the distances between medians and middle, and of frames from
    their own motion's median, each motion counting once. So neither a long motion nor a frame that
    is 10 km away moves them, unless half of the motions are such. A motion whose root is over a
    kilometre from the origin is one too.

    Parameters
    ----------
    motions : sequence of CanonicalMotion
    weights : Weights
    """
    scales = weights.scales()
    medians = np.zeros((len(motions), N_FEATURES))
    within = np.zeros(len(motions))
    furthest = np.zeros(len(motions))
    far = np.zeros(len(motions), dtype=np.bool_)
    for i, motion in enumerate(motions):
        values = frame_features(motion) * scales
        medians[i] = np.median(values, axis=0)
        squares = ((values - medians[i]) ** 2).sum(axis=1)
        within[i], furthest[i] = np.median(squares), squares.max()
        far[i] = _is_far(motion)
    if not len(motions):
        return far
    between = ((medians - np.median(medians, axis=0)) ** 2).sum(axis=1)
    scale = float(np.sqrt(np.median(within) + np.median(between)))
    reach = np.sqrt(furthest) + np.sqrt(between)
    far |= reach > max(OUTLYING * scale, OUTLYING_M)
    return far if not far.all() else np.zeros_like(far)


def _is_far(motion: CanonicalMotion) -> bool:
    return bool(np.abs(motion.root).max() > FURTHEST_ROOT_M)
