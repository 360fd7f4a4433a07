"""Which stretches of a take are the same motion: those whose poses and velocities spread alike."""

from __future__ import annotations

import string
from collections.abc import Sequence

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.motion.frame_range import FrameRange
from mocapdb.segmentation.partition import log_determinants
from mocapdb.segmentation.tuning import SAME_MOTION

__all__ = ["differences", "letter", "motions_of"]


def differences(rows: FloatArray, ranges: Sequence[FrameRange], floor: float) -> FloatArray:
    """Return (S, S) how much stretches differ, in nats a dimension; 0 where they are the same.

    Parameters
    ----------
    rows : (F, D)
        Poses and velocities.
    ranges : sequence of FrameRange
    floor : float
        Standard deviation below which no direction of a Gaussian falls.

    Notes
    -----
    What one Gaussian for both loses against one for each, as if they were equally long: the test by
    which speakers are told apart (Chen and Gopalakrishnan, "Speaker, environment and channel change
    detection and clustering via the Bayesian information criterion", 1998).
    """
    means = np.array([rows[part.frames].mean(axis=0) for part in ranges])
    spreads = np.array([np.cov(rows[part.frames].T, bias=True) for part in ranges])
    own = log_determinants(spreads, floor)
    found = np.zeros((len(ranges), len(ranges)))
    for i, (mean, spread) in enumerate(zip(means, spreads, strict=True)):
        apart = means - mean
        both = (spreads + spread) / 2 + apart[:, :, None] * apart[:, None, :] / 4
        found[i] = (log_determinants(both, floor) - (own + own[i]) / 2) / rows.shape[1]
    return np.maximum((found + found.T) / 2 * (1.0 - np.eye(len(ranges))), 0.0)


def motions_of(apart: FloatArray) -> IntArray:
    """Return (S,) which motion each stretch is, numbered in the order in which they come.

    Parameters
    ----------
    apart : (S, S)
        As `differences` returns it.
    """
    from sklearn.cluster import AgglomerativeClustering

    if len(apart) < 2:
        return np.zeros(len(apart), dtype=np.int64)
    groups = AgglomerativeClustering(
        n_clusters=None, metric="precomputed", linkage="average", distance_threshold=SAME_MOTION
    ).fit_predict(apart)
    order = list(dict.fromkeys(groups.tolist()))
    return np.array([order.index(group) for group in groups.tolist()])


def letter(number: int) -> str:
    """Return a name of a motion: A to Z, then AA, AB and so on.

    Examples
    --------
    >>> [letter(number) for number in (0, 25, 26, 53)]
    ['A', 'Z', 'AA', 'BB']
    """
    letters = string.ascii_uppercase
    before = letters[number // len(letters) - 1] if number >= len(letters) else ""
    return before + letters[number % len(letters)]
