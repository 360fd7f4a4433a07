"""How likely a hit is the same motion: distances as probabilities, calibrated on labelled clips."""

from __future__ import annotations

import math

from mocapdb.errors import ClipError
from mocapdb.indexing.tuning import EVEN_ODDS, ODDS_POWER

__all__ = ["distance_of_probability", "probability"]


def probability(distance: float) -> float:
    """Return how likely a hit at a distance is of the query's class, 0 to 1.

    Parameters
    ----------
    distance : float
        Of a hit: 0 is the same motion, 1 any motion.

    Examples
    --------
    >>> [round(probability(distance), 2) for distance in (0.0, 0.3, 0.51, 1.0)]
    [1.0, 0.91, 0.5, 0.05]
    """
    return float(1.0 / (1.0 + (max(distance, 0.0) / EVEN_ODDS) ** ODDS_POWER))


def distance_of_probability(likely: float) -> float:
    """Return the distance up to which hits are at least so likely.

    Raises
    ------
    ClipError
        If it is no probability from 0 to 1.
    """
    if not 0.0 <= likely <= 1.0:
        raise ClipError(f"Expected a probability from 0 to 1, but got {likely}.")
    if likely == 0.0:
        return math.inf
    return float(EVEN_ODDS * (1.0 / likely - 1.0) ** (1.0 / ODDS_POWER))
