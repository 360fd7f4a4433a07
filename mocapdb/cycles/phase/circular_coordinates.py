"""The loop of a motion by cohomology: circular coordinates of every frame, and how clear it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.phase.cohomology import CircularCoordinates
from mocapdb.cycles.phase.laps import fit_laps, forwards, unwrapped
from mocapdb.cycles.phase.pose_cloud import delay_embedding
from mocapdb.cycles.tuning import (
    ANALYSIS_HZ,
    COMPLEX_POINTS,
    DELAY_LAPS,
    LAPS_FOR_TWO_DELAYS,
    LEAST_LAPS,
    PRIME,
)

__all__ = ["Topology", "find_coordinates"]


@dataclass(frozen=True)
class Topology:
    """What cohomology found.

    Attributes
    ----------
    coordinates : (F,)
        In laps, in [0, 1), for every frame but the last few of the embedding.
    period_frames : float
    persistence_ratio : float
        Of the chosen bar to the longest other one.
    backtracking : float
        Share of the steps that go backwards.
    bars : (B, 2)
        Births and deaths, longest first.
    rank : int
        Which bar was chosen.
    """

    coordinates: FloatArray
    period_frames: float
    persistence_ratio: float
    backtracking: float
    bars: FloatArray
    rank: int = 0

    def phase(self, n_frames: int) -> FloatArray:
        """Return coordinates (n_frames,), at the mean speed where the embedding had ended."""
        laps = unwrapped(self.coordinates)
        slope, _ = fit_laps(laps)
        more = laps[-1] + slope * np.arange(1, n_frames - len(laps) + 1)
        return np.concatenate([laps, more]) % 1.0


def find_coordinates(
    cloud: FloatArray,
    period_frames: float,
    fps: float,
    *,
    delays: int | None = None,
    lag: int | None = None,
    prime: int = PRIME,
    rank: int = 0,
    max_epsilon: float | None = None,
    join_neighbours: bool = False,
) -> Topology:
    """Return circular coordinates of a motion whose period is roughly known.

    Parameters
    ----------
    cloud : (F, D)
        Poses, such as joint positions seen from the root.
    period_frames : float
    fps : float, frames per second
        The loop is looked for at 30 Hz or less, with 320 points at most.
    delays, lag : int, optional
        How many later poses are added to each, and how many frames apart: two by default, fewer
        where the clip is short, an eighth of the period apart.
    prime, rank, max_epsilon, join_neighbours
        See `CircularCoordinates`.

    Raises
    ------
    NoPeriodError
        If there is no loop.
    CycleError
        If the delays are longer than the clip.
    """
    if delays is None:
        # with fewer laps the delays would leave no whole one
        delays = int(np.searchsorted((LEAST_LAPS, LAPS_FOR_TWO_DELAYS), len(cloud) / period_frames))
    lag = max(1, round(period_frames * DELAY_LAPS)) if lag is None else lag
    points = delay_embedding(cloud, delays, lag)
    stride = max(1, round(fps / ANALYSIS_HZ))
    few = len(points) / stride <= COMPLEX_POINTS
    found = CircularCoordinates(
        max_epsilon=max_epsilon,
        prime=prime,
        rank=rank,
        stride=stride if few else 1,
        join_neighbours=join_neighbours,
    )
    if few:
        coordinates = found.fit_transform(points)
    else:
        rng = np.random.default_rng(0)  # an even stride could meet the same few phases
        chosen = np.sort(rng.choice(len(points), COMPLEX_POINTS, replace=False))
        coordinates = found.fit(points[chosen]).transform(points)
    coordinates = forwards(coordinates)
    laps = unwrapped(coordinates)
    slope, _ = fit_laps(laps)
    lengths = found.persistence_[:, 1] - found.persistence_[:, 0]
    others = np.delete(lengths, rank)
    steps = np.diff(laps[::stride])
    return Topology(
        coordinates=coordinates,
        period_frames=1.0 / max(slope, 1e-9),
        persistence_ratio=float(lengths[rank] / others.max()) if len(others) else np.inf,
        backtracking=float((steps < 0).mean()) if len(steps) else 1.0,
        bars=found.persistence_,
        rank=rank,
    )
