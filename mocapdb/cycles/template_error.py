"""How well a cycle matches the motion it came from (Raunio 2014, chapter 4)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray

__all__ = ["TemplateMatch", "match_template"]


class TemplateMatch(NamedTuple):
    """The best match of a motion and a repeated cycle.

    Attributes
    ----------
    error : float
        Root mean square over frames of the distance of two poses (eq. 4.5), in radians.
    offset : int
        Frame of the cycle that the first frame of the motion matches.
    """

    error: float
    offset: int


def match_template(values: FloatArray, cycle: FloatArray) -> TemplateMatch:
    """Slide a motion (F, D) over a cycle (N, D) that repeats, and return the best match.

    Notes
    -----
    The sum of ``|y|^2 + |z|^2 - 2 y.z`` is made of one product of all frames with all frames of
    the cycle, summed along its wrapped diagonals.
    """
    values = np.asarray(values, dtype=np.float64)
    centre = cycle.mean(axis=0)  # no digits are lost to what both have in common
    y, z = values - centre, cycle - centre
    squares = (y**2).sum(axis=1)[:, None] + (z**2).sum(axis=1) - 2.0 * y @ z.T
    frames = np.arange(len(y))
    totals = [squares[frames, (frames + shift) % len(z)].sum() for shift in range(len(z))]
    best = int(np.argmin(totals))
    return TemplateMatch(float(np.sqrt(max(totals[best], 0.0) / len(y))), best)
