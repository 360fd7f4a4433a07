"""Where each of several motions in one clip happens, by circular coordinates that move.

Vejdemo-Johansson et al. (2015), section 4.6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cycles.phase.cohomology import CircularCoordinates
from mocapdb.cycles.phase.laps import unwrapped
from mocapdb.cycles.tuning import EXCITED_LAPS, EXCITED_SPEED, LONGEST_REST
from mocapdb.errors import NoPeriodError
from mocapdb.motion.frame_range import FrameRange

__all__ = ["Excitation", "excitation_regions"]


@dataclass(frozen=True)
class Excitation(FrameRange):
    """Frames ``start:end`` in which one circular coordinate moves.

    Attributes
    ----------
    rank : int
        Of the class, 0 for the most persistent.
    laps : float
        How far the coordinate goes.
    """

    rank: int
    laps: float


def excitation_regions(
    cloud: FloatArray,
    *,
    n_classes: int = 3,
    stride: int = 1,
    longest_rest: int = LONGEST_REST,
    least_laps: float = EXCITED_LAPS,
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
        A coordinate may rest so long within a region: it stands still while the body does what
        this loop has no part in.
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
        speed = np.abs(np.diff(laps, append=laps[-1]))
        moving = speed > 1e-6
        mean = float(speed[moving].mean()) if moving.any() else 0.0
        for start, end in _joined_runs(speed > EXCITED_SPEED * max(mean, 1e-6), longest_rest):
            far = float(abs(laps[min(end, len(laps) - 1)] - laps[start]))
            if far >= least_laps:
                regions.append(Excitation(start, end, rank, far))
    return sorted(regions, key=lambda region: (region.start, region.end, region.rank))


def _joined_runs(flags: BoolArray, gap: int) -> list[tuple[int, int]]:
    """Return the runs of True as ``start:end``, runs less than `gap` apart as one."""
    frames = np.flatnonzero(flags)
    if len(frames) == 0:
        return []
    pieces = np.split(frames, np.flatnonzero(np.diff(frames) > gap) + 1)
    return [(int(piece[0]), int(piece[-1]) + 1) for piece in pieces]
