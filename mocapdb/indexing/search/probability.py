"""How likely a hit is the same motion, calibrated on labelled clips.

Two things tell. The *distance* of a hit: what is near is likelier, as a logistic of its logarithm.
And the *labels* of the nearest hits: where walks and walks that turn are as near, the query is one
of the two, and the distance cannot say which. So what the distance says is multiplied by the share
of a hit's label among the nearest hits. It never gets more by that, only less: a library that
tells near motions apart says itself how sure a distance can be.

`probability`    of a hit, by its distance and the share of its label
`label_shares`   the share of each hit's label among the nearest
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from typing import NamedTuple

from mocapdb.errors import ClipError
from mocapdb.indexing.tuning import (
    EVEN_ODDS,
    NEAR_BY,
    NEAR_HITS,
    NEAR_POWER,
    ODDS_POWER,
    UNTOLD_SHARE,
)

__all__ = ["LabelledHit", "distance_of_probability", "label_shares", "probability"]


class LabelledHit(NamedTuple):
    """What counts of a hit among the nearest.

    Attributes
    ----------
    place
        What tells it from other hits.
    distance : float
    label : str, optional
    """

    place: Hashable
    distance: float
    label: str | None


def probability(distance: float, label_share: float = 1.0) -> float:
    """Return how likely a hit is of the query's class, 0 to 1.

    Parameters
    ----------
    distance : float
        Of a hit: 0 is the same motion, 1 any motion.
    label_share : float
        Share of its label among the nearest hits, of `label_shares`.

    Examples
    --------
    >>> [round(probability(distance), 2) for distance in (0.0, 0.3, 0.6, 1.0)]
    [1.0, 0.94, 0.5, 0.11]
    >>> round(probability(0.3, label_share=0.5), 2)
    0.47
    """
    return float(label_share / (1.0 + (max(distance, 0.0) / EVEN_ODDS) ** ODDS_POWER))


def label_shares(hits: Sequence[LabelledHit], nearest: Sequence[LabelledHit]) -> list[float]:
    """Return the share of each hit's label among the nearest hits and itself.

    The nearer one is, the more it counts. Those without a label may be the same or not; a hit
    without one has the share that is left where motions are told apart most finely.

    Parameters
    ----------
    hits : sequence of LabelledHit
    nearest : sequence of LabelledHit
        The nearest first; of all labels. So many count as `NEAR_HITS` says.

    Examples
    --------
    >>> walk, turn = LabelledHit(0, 0.2, "walk"), LabelledHit(1, 0.2, "turn")
    >>> label_shares([walk, turn], [walk, turn])
    [0.5, 0.5]
    """
    known = nearest[:NEAR_HITS]
    shares = []
    for hit in hits:
        if hit.label is None:
            shares.append(UNTOLD_SHARE)
            continue
        others = [each for each in known if each.place != hit.place]
        own = _weight(hit)
        every = own + sum(map(_weight, others))
        told = sum(_weight(each) for each in others if each.label == hit.label)
        untold = sum(_weight(each) for each in others if each.label is None)
        shares.append((own + told + UNTOLD_SHARE * untold) / every)
    return shares


def _weight(hit: LabelledHit) -> float:
    return float((max(hit.distance, 0.0) + NEAR_BY) ** -NEAR_POWER)


def distance_of_probability(likely: float) -> float:
    """Return the distance beyond which no hit is so likely, whatever the labels say.

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
