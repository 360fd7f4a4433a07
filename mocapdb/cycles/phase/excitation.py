"""Where each of several motions in one clip happens, by circular coordinates that move.

Vejdemo-Johansson et al. (2015), section 4.6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cycles.phase.cohomology import CircularCoordinates
from mocapdb.cycles.phase.laps import unwrapped
from mocapdb.errors import NoPeriodError

__all__ = ["Excitation", "excitation_regions"]


class Excitation(NamedTuple):
    """A range in which one circular coordinate moves.

    Attributes
    ----------
    start, stop : int
        Frames, end-exclusive.
    rank : int
        Of the class, 0 for the most persistent.
    laps : float
        How far the coordinate goes.
    """

    start: int
    stop: int
    rank: int
    laps: float


def excitation_regions(
    cloud: FloatArray,
    *,
    n_classes: int = 3,
    stride: int = 1,
    longest_rest: int = 60,
    least_laps: float = 1.5,
) -> list[Excitation]:
    """Return where each of the most persistent circular coordinates moves.

    Parameters
    ----------
    cloud : (F, D)
        Of a clip with several motions after each other.
    n_classes : int
        How many classes are looked at.
    stride : int
        Only every so many frames are put into the complex.
    longest_rest : int, frames
        A coordinate may rest so long within a lap: it stands while the motion does what it is
        not about.
    least_laps : float
        A coordinate that goes less far is not moving, but noise.

    Raises
    ------
    NoPeriodError
        If there is no loop at all.
    """
    regions = []
    for rank in range(n_classes):
        try:
            found = CircularCoordinates(rank=rank, stride=stride).fit(cloud)
        except NoPeriodError:
            if rank == 0:
                raise
            break
        laps = unwrapped(found.coordinates_)
        way = np.abs(np.diff(laps, append=laps[-1]))
        busy = way > 0.25 * max(float(way[way > 1e-6].mean()) if np.any(way > 1e-6) else 0.0, 1e-6)
        for start, stop in _bridged(busy, longest_rest):
            far = float(abs(laps[min(stop, len(laps) - 1)] - laps[start]))
            if far >= least_laps:
                regions.append(Excitation(start, stop, rank, far))
    return sorted(regions)


def _bridged(flags: BoolArray, gap: int) -> list[tuple[int, int]]:
    """Return the runs of True as ``start:stop``, runs less than `gap` apart as one."""
    frames = np.flatnonzero(flags)
    if len(frames) == 0:
        return []
    pieces = np.split(frames, np.flatnonzero(np.diff(frames) > gap) + 1)
    return [(int(piece[0]), int(piece[-1]) + 1) for piece in pieces]
