"""The loops of a clip of several motions, and where each of them is gone round.

Vejdemo-Johansson et al. (2015), section 4.6. How many loops there are they choose by hand; here
it is decided by how far each bar stands out of those that noise makes: the ratio of death and birth
has, whatever the cloud, one distribution where there is no loop (Bobrowski and Skraba, "A universal
null-distribution for topological data analysis", Scientific Reports 13, 2023).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.cycles.phase.cohomology import CircularCoordinates, landmarks
from mocapdb.cycles.phase.laps import unwrapped
from mocapdb.cycles.phase.pose_cloud import delay_embedding
from mocapdb.cycles.tuning import (
    ANALYSIS_HZ,
    EXCITED_DELAY_S,
    EXCITED_LAPS,
    EXCITED_TRAVEL,
    EXCITED_WINDOW_S,
    FALSE_LOOPS,
    LANDMARKS,
    LEAST_LAPS_OF_RANGE,
    LONGEST_REST_S,
    MOST_LOOPS,
)
from mocapdb.errors import NoPeriodError
from mocapdb.motion.frame_range import FrameRange

__all__ = ["Excitation", "LoopsOfClip", "excitation_regions", "find_loops", "loop_chances"]


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

    @property
    def period_frames(self) -> float:
        """Mean frames of a lap."""
        return len(self) / self.laps

    @property
    def repeats(self) -> bool:
        """Whether it goes round often enough to make a cycle."""
        return self.laps >= LEAST_LAPS_OF_RANGE


@dataclass(frozen=True)
class LoopsOfClip:
    """The loops of a clip.

    Attributes
    ----------
    bars : (B, 2)
        Birth and death of all classes, the most persistent first.
    chances : (B,)
        How likely noise alone would make a bar as long, each seen by itself.
    n_loops : int
        How many classes are loops: the first so many.
    coordinates : (L, F)
        Unwrapped, in laps, of those loops that are ones of integers; NaN for the others.
    regions : tuple of Excitation
        Where they are gone round, in order of time.
    """

    bars: FloatArray
    chances: FloatArray
    n_loops: int
    coordinates: FloatArray
    regions: tuple[Excitation, ...]


def find_loops(cloud: FloatArray, fps: float, *, n_loops: int | None = None) -> LoopsOfClip:
    """Return the loops of a clip of several motions, and where each is gone round.

    Parameters
    ----------
    cloud : (F, D)
        Poses, such as joint positions seen from the root.
    fps : float, frames per second
    n_loops : int, optional
        How many are looked at; by default as many as stand out of noise, with one in ten of them
        false.

    Raises
    ------
    NoPeriodError
        If there is no loop at all.

    Notes
    -----
    Poses are put beside those a little later and again later, so that there and back are two
    ways; of these so many are taken that lie farthest apart (landmarks, de Silva and Carlsson,
    "Topological estimation using witness complexes", 2004), which keeps slow parts from counting
    more than quick ones.
    """
    stride = max(1, round(fps / ANALYSIS_HZ))
    rate = fps / stride
    lag = max(1, round(EXCITED_DELAY_S * rate))
    thinned = cloud[::stride]
    points = delay_embedding(thinned, 2, lag) if len(thinned) > 4 * lag else thinned
    chosen = points[landmarks(points, LANDMARKS)]
    found = CircularCoordinates().fit(chosen)
    bars = found.persistence_
    chances = loop_chances(bars)
    count = _count(chances) if n_loops is None else min(n_loops, len(bars))
    coordinates = np.full((count, len(cloud)), np.nan)
    regions: list[Excitation] = []
    frames = np.arange(len(cloud))
    for rank in range(count):
        try:
            laps = unwrapped(found.of_rank(rank).transform(points))
        except NoPeriodError:
            continue  # no integers fit: it is a loop, but has no coordinate
        # at the middle of the delays
        at = (np.arange(len(points)) + (len(thinned) - len(points)) / 2) * stride
        coordinates[rank] = np.interp(frames, at, laps)
        regions += _regions(coordinates[rank], fps, rank)
    return LoopsOfClip(bars, chances, count, coordinates, tuple(_first_of_each(regions)))


def excitation_regions(
    cloud: FloatArray, fps: float = 120.0, *, n_classes: int | None = None
) -> list[Excitation]:
    """Return where each of the most persistent circular coordinates moves.

    Parameters
    ----------
    cloud : (F, D)
        Of a clip with several motions after each other.
    fps : float, frames per second
    n_classes : int, optional
        How many classes are looked at; by default those that stand out of noise.

    Raises
    ------
    NoPeriodError
        If there is no loop at all.
    """
    return list(find_loops(cloud, fps, n_loops=n_classes).regions)


def loop_chances(bars: FloatArray) -> FloatArray:
    """Return (B,) how likely noise alone would make bars (B, 2) as long, each seen by itself.

    Notes
    -----
    Of noise ``log log (death / birth)``, moved to the mean of a left-skewed Gumbel distribution, is
    distributed like one, whatever the cloud (Bobrowski and Skraba 2023, equation 3 and conjecture
    2.3). The mean is that of all bars, of which few are loops.
    """
    ratios = bars[:, 1] / np.maximum(bars[:, 0], 1e-12)
    values = np.log(np.log(np.maximum(ratios, 1.0 + 1e-9)))
    return np.asarray(np.exp(-np.exp(values - values.mean() - np.euler_gamma)))


def _count(chances: FloatArray) -> int:
    """Return how many bars are loops, if `FALSE_LOOPS` of them may be none (Benjamini-Hochberg)."""
    ordered = np.sort(chances) * len(chances)
    passed = np.flatnonzero(ordered <= FALSE_LOOPS * np.arange(1, len(chances) + 1))
    return min(int(passed[-1]) + 1, MOST_LOOPS) if len(passed) else 0


def _regions(laps: FloatArray, fps: float, rank: int) -> list[Excitation]:
    """Return where a coordinate goes on, one way, for `EXCITED_LAPS` at least."""
    window = min(round(EXCITED_WINDOW_S * fps), len(laps) - 1)
    travel = laps[window:] - laps[: len(laps) - window]
    found = []
    for way in (1.0, -1.0):
        going = np.flatnonzero(way * travel > EXCITED_TRAVEL)
        for run in _runs(going, window + round(LONGEST_REST_S * fps)):
            start, end = int(run[0]), int(run[-1]) + window
            far = abs(float(laps[end] - laps[start]))
            if far >= EXCITED_LAPS:
                found.append(Excitation(start, end, rank, far))
    return found


def _runs(frames: IntArray, gap: int) -> list[IntArray]:
    """Return sorted frames in pieces, those less than `gap` apart in one."""
    if len(frames) == 0:
        return []
    return np.split(frames, np.flatnonzero(np.diff(frames) > gap) + 1)


def _first_of_each(regions: list[Excitation]) -> list[Excitation]:
    """Return regions in order; of those that mostly overlap, one.

    That of the most persistent loop, but what repeats goes before what is gone round once.
    """
    kept: list[Excitation] = []
    for region in sorted(regions, key=lambda each: (not each.repeats, each.rank, each.start)):
        if all(region.overlap(other) <= min(len(region), len(other)) / 2 for other in kept):
            kept.append(region)
    return sorted(kept, key=lambda each: each.start)
