"""How two stretches go as a whole: what frames that are compared one by one do not see.

A person who is tired or old holds every pose differently and still does the same. So once frames
are matched, what is compared is the course of the motion, whatever pose it goes around:

=========  =====================================================================================
course     how far the two do not rise and fall together: one less the correlation of matched
           frames, each from its stretch's mean
shares     how far they do not move in the same joints: the distance between the spreads of their
           features, each set of them as a unit vector
travel     how far they do not go the same way, as the body sees it: the difference of the mean
           velocities of the hips over the larger of them
direction  by how many radians they go elsewhere than where they face, which a walk to the side
           and one straight on differ by
=========  =====================================================================================

All are 0 for the same motion, and none depends on how large a movement is; the last two are not
looked at where travelling does not count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import Float32Array, FloatArray
from mocapdb.indexing.search.features import N_POSE, FeatureSpace
from mocapdb.indexing.tuning import (
    COURSE_COST,
    DIRECTION_COST,
    GOING_MS,
    MOST_DIRECTION_RAD,
    SHARES_COST,
    STILL_SPREAD_M,
    SWAY_RAD,
    TRAVEL_COST,
    UNSURE_TRAVEL_MS,
)

__all__ = ["Course", "course_cost"]

SIDEWAYS, FORWARD = 2 * N_POSE + 1, 2 * N_POSE + 3
"""Rows of the features, of the velocity of the hips as the body sees it."""


@dataclass(frozen=True, eq=False)
class Course:
    """A stretch as it is compared with others: see the module.

    Attributes
    ----------
    frames : (n, D) metres
        From their mean.
    size_m : float, metres
        Root of the sum of their squares.
    shares : (107,)
        Spread of each feature, as a unit vector; of parts of the body fewer.
    travel_ms : (2,) metres a second, optional
        Mean velocity of the hips to the left and forward; None where it does not count.
    """

    frames: FloatArray
    size_m: float
    shares: FloatArray
    travel_ms: FloatArray | None

    @classmethod
    def of(cls, frames: Float32Array, space: FeatureSpace) -> Course:
        """Return the course of frames (n, D) of a space."""
        middle = frames.mean(axis=0, dtype=np.float64)
        centred = frames - middle
        features = space.axes if space.directions is None else space.directions
        spread = np.sqrt(((centred @ features.T) ** 2).mean(axis=0)) + STILL_SPREAD_M / 10
        return cls(
            centred,
            math.sqrt(float((centred**2).sum())),
            spread / float(np.linalg.norm(spread)),
            _travel(middle, space),
        )


def _travel(middle: FloatArray, space: FeatureSpace) -> FloatArray | None:
    """Return the (2,) mean velocity of the hips, from the mean of a stretch's frames."""
    if space.weights.travel_s <= 0 or space.counted is not None:
        return None
    rows = [SIDEWAYS, FORWARD]
    return np.asarray((space.axes[rows] @ middle + space.mean[rows]) / space.weights.travel_s)


def course_cost(first: Course, second: Course) -> float:
    """Return what two matched stretches of n frames cost beside the warping; 0 for the same."""
    floor = len(first.frames) * STILL_SPREAD_M**2  # so that two poses held go together
    together = (float((first.frames * second.frames).sum()) + floor) / math.sqrt(
        (first.size_m**2 + floor) * (second.size_m**2 + floor)
    )
    elsewhere = float(np.linalg.norm(first.shares - second.shares))
    cost = COURSE_COST * (1.0 - together) + SHARES_COST * elsewhere
    if first.travel_ms is None or second.travel_ms is None:
        return cost
    return cost + _travel_cost(first.travel_ms, second.travel_ms)


def _travel_cost(first: FloatArray, second: FloatArray) -> float:
    """Return what it costs that two bodies go elsewhere, or at another speed."""
    speeds = [float(np.hypot(*each)) for each in (first, second)]
    apart = float(np.hypot(*(first - second)))
    cost = TRAVEL_COST * apart / (max(speeds) + UNSURE_TRAVEL_MS)
    if min(speeds) > GOING_MS:
        turned = abs(math.remainder(math.atan2(*first) - math.atan2(*second), math.tau))
        cost += DIRECTION_COST * min(max(turned - SWAY_RAD, 0.0), MOST_DIRECTION_RAD)
    return cost
