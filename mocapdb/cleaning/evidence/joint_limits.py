"""Joint limits, learnt from clean data: the rotations that a joint has been seen in.

No ranges of angles: those depend on the skeleton's axes, and the box that they make around the
rotations of a shoulder is mostly empty. A joint's limits are the set of its rotations in the rest
of the clip and in the context, and what counts is the angle to the nearest of them.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from mocapdb.base.arrays import BoolArray, Float32Array, FloatArray, IntArray
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary
from mocapdb.cleaning.tuning import (
    LEAST_APART_DEG,
    LIMIT_QUANTILE,
    MOST_SEEN,
    MOST_TESTED,
    MOST_TESTED_OF_CLIP,
    OTHER_TIME_S,
)
from mocapdb.errors import SkeletonError

__all__ = ["RotationLimits"]


class RotationLimits:
    """The rotations that the joints of a clip have in it and in its context.

    Parameters
    ----------
    texture : Texture
        Of the clip.
    context : Vocabulary, optional
        Of the same joints.

    Raises
    ------
    SkeletonError
        If the context has other joints.
    """

    def __init__(self, texture: Texture, context: Vocabulary | None = None) -> None:
        self._quats = texture.quat_xyzw.astype(np.float32)
        self._fps = texture.fps
        self._frames = _evenly(len(texture))
        self._own = np.ascontiguousarray(np.moveaxis(self._quats[self._frames], 0, 2))
        self._context: Float32Array | None = None
        if context is not None:
            if context.names != texture.names:
                raise SkeletonError(
                    f"Expected a context with the joints of {texture.name!r}, but "
                    f"{context.clips[0]!r} has others. Leave it out, or convert it."
                )
            shown = np.flatnonzero(context.shown_frames)
            if len(shown):
                self._context = context.quats[:, :, shown[_evenly(len(shown))]]

    def beyond(self, row: int, start: int, end: int, most_deg: float) -> float:
        """Return how far a joint is beyond its limits in a stretch, against how far it usually is.

        A clip of one movement after another is beyond the limits that the rest of it sets all the
        time.

        Parameters
        ----------
        row : int
            Of the texture.
        start, end : int
            Frames ``start:end`` of the texture.
        most_deg : float, degrees
            By how much the joint may be wrong there. What is further beyond the limits than that is
            no sign of the fault: the joint would be beyond them without it, too.

        Returns
        -------
        float
            Logarithm of the ratio between the median angle to the nearest rotation seen at another
            time, outside of the stretch, and what such angles are below in four frames of five;
            0 where there is none.
        """
        if end <= start:
            return 0.0
        inside = start + _evenly(end - start, MOST_TESTED)
        outside = (self._frames < start) | (self._frames >= end)
        here = self._angles_deg(row, inside, outside)
        if here is None:
            return 0.0
        apart = min(float(np.median(here)), most_deg)
        return math.log((apart + LEAST_APART_DEG) / (self._usual_deg[row] + LEAST_APART_DEG))

    @cached_property
    def _usual_deg(self) -> FloatArray:
        """(K,) what most frames of a joint stay below."""
        tested = _evenly(len(self._quats), MOST_TESTED_OF_CLIP)
        everywhere = np.ones(len(self._frames), dtype=np.bool_)
        usual = np.zeros(self._quats.shape[1])
        for row in range(len(usual)):
            angles = self._angles_deg(row, tested, everywhere)
            usual[row] = 0.0 if angles is None else np.quantile(angles, LIMIT_QUANTILE)
        return usual

    def _angles_deg(self, row: int, tested: IntArray, counted: BoolArray) -> FloatArray | None:
        """Return the angles to the nearest rotation of another time; None where there is none."""
        cosine = np.abs(self._quats[tested, row] @ self._own[row])
        same = np.abs(tested[:, None] - self._frames) <= round(OTHER_TIME_S * self._fps)
        cosine[same | ~counted] = -1.0
        nearest = cosine.max(axis=1)
        if self._context is not None:
            others = np.abs(self._quats[tested, row] @ self._context[row])
            nearest = np.maximum(nearest, others.max(axis=1))
        known = nearest >= 0.0
        if not known.any():
            return None
        return np.asarray(2.0 * np.rad2deg(np.arccos(np.minimum(nearest[known], 1.0))))


def _evenly(n: int, most: int = MOST_SEEN) -> IntArray:
    """Return the places of up to `most` out of n, drawn evenly."""
    return np.arange(n) if n <= most else np.linspace(0, n - 1, most).astype(np.int64)
