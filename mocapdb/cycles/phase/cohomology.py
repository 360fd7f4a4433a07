"""Circular coordinates by persistent cohomology.

A cloud of poses that repeat is a loop; persistent cohomology finds the loop and gives every pose a
coordinate on the circle: de Silva, Morozov and Vejdemo-Johansson, "Persistent cohomology and
circular coordinates" (2011), as used by Vejdemo-Johansson et al. (2015, section 4.2) and by
Raunio (2014, section 2.2).
"""

from __future__ import annotations

import math
from copy import copy
from itertools import pairwise

import numpy as np

from mocapdb.base.arrays import BoolArray, Float32Array, FloatArray, IntArray
from mocapdb.cycles.tuning import LANDMARKS, LARGEST_CLOUD, LIFT_THRESHOLDS, NEAREST_POINTS, PRIME
from mocapdb.errors import CycleError, NoPeriodError

__all__ = ["CircularCoordinates", "expect_odd_prime", "landmarks", "lift_cocycle"]

LEAST_POINTS = 4  # any three that are joined bound a triangle, and are no loop


class CircularCoordinates:
    """Coordinates on the circle for a cloud of points with a loop in it.

    Parameters
    ----------
    max_epsilon : float, optional
        Largest distance at which points are joined; bars alive there die there. By default the
        enclosing radius of the cloud, beyond which it has no loop.
    prime : int
        Coefficients are integers modulo this odd prime.
    rank : int
        Which class: 0 for the most persistent, 1 for the next.
    stride : int
        Only every so many points are put into the complex; the others get a coordinate between
        their neighbours in the order of the rows, which must be time.
    join_neighbours : bool
        Whether points next to each other in time are at distance 0 (Vejdemo-Johansson et al.
        2015, section 3.2, "modified metric").

    Attributes
    ----------
    persistence_ : (B, 2)
        Birth and death of every bar of the first cohomology, the longest first.
    cocycle_ : (E, 3) of int
        The chosen cocycle with integer coefficients: edges (i, j) of the points in the complex
        and the value of going from i to j.
    threshold_ : float
        The complex has the edges shorter than this: the death of the class, or less where the
        integers only fit a smaller complex.
    coordinates_ : (N,)
        In laps, in [0, 1).

    Examples
    --------
    >>> angle = np.linspace(0, 4 * np.pi, 100, endpoint=False)
    >>> circle = np.column_stack([np.cos(angle), np.sin(angle)])
    >>> x = CircularCoordinates().fit_transform(circle)
    >>> steps = np.abs((np.diff(x) + 0.5) % 1 - 0.5)
    >>> bool(np.allclose(steps, 0.02, atol=1e-6))
    True
    """

    persistence_: FloatArray
    cocycle_: IntArray
    threshold_: float
    coordinates_: FloatArray

    def __init__(
        self,
        *,
        max_epsilon: float | None = None,
        prime: int = PRIME,
        rank: int = 0,
        stride: int = 1,
        join_neighbours: bool = False,
    ) -> None:
        if max_epsilon is not None and not (math.isfinite(max_epsilon) and max_epsilon > 0):
            raise CycleError(f"Expected a positive max_epsilon, but got {max_epsilon}.")
        expect_odd_prime(prime)
        if rank < 0 or stride < 1:
            raise CycleError(
                f"Expected a rank of 0 or more and a stride of 1 or more, but got {rank} and "
                f"{stride}."
            )
        self.max_epsilon = max_epsilon
        self.prime = prime
        self.rank = rank
        self.stride = stride
        self.join_neighbours = join_neighbours

    def fit(self, X: FloatArray) -> CircularCoordinates:
        """Find the loop of a cloud (N, D), its rows in the order of time.

        Raises
        ------
        NoPeriodError
            If there are too few points, no loop, or no integer cocycle.

        Notes
        -----
        Of more points than `LARGEST_CLOUD`, `LANDMARKS` are put into the complex that lie far from
        each other (see `landmarks`); the others get coordinates from the nearest of these.
        """
        points = np.asarray(X, dtype=np.float64)[:: self.stride]
        if len(points) < LEAST_POINTS:
            raise NoPeriodError(
                f"Expected {LEAST_POINTS} points at least, but got {len(points)}. "
                "Take a longer range or a smaller stride."
            )
        if len(points) > LARGEST_CLOUD:
            points = points[landmarks(points, LANDMARKS)]
        distances = _distances(points)
        if self.join_neighbours:
            steps = np.arange(len(points) - 1)
            distances[steps, steps + 1] = distances[steps + 1, steps] = 0.0
        limit = self._limit(distances)
        self.persistence_, self._cocycles = _persistent_cocycles(distances, limit, self.prime)
        self._points, self._distances, self._limit_used = points, distances, limit
        self._choose(self.rank)
        whole = len(points) == len(range(0, len(X), self.stride))
        self.coordinates_ = (
            _spread(self._coordinates, self.stride, len(X)) if whole else self.transform(X)
        )
        return self

    def of_rank(self, rank: int) -> CircularCoordinates:
        """Return the coordinates of another class of the same cloud, to transform points by.

        Raises
        ------
        NoPeriodError
            If there is no such class, or no integer cocycle.
        """
        other = copy(self)
        other.rank = rank
        other._choose(rank)
        other.coordinates_ = other.transform(self._points)
        return other

    def _choose(self, rank: int) -> None:
        bars = self.persistence_
        if rank >= len(bars):
            raise NoPeriodError(
                f"Expected a loop of rank {rank} among the points, but found {len(bars)} "
                f"up to a distance of {self._limit_used:.4g}. Take a lower rank or "
                "another distance (--epsilon)."
            )
        birth, death = bars[rank]
        self.cocycle_, self.threshold_ = lift_cocycle(
            self._cocycles[rank], self._distances, birth, death, self.prime
        )
        joined = self._distances < np.float32(self.threshold_)
        self._coordinates = _smoothed(self.cocycle_, joined)

    def transform(self, X: FloatArray) -> FloatArray:
        """Return (M,) coordinates of other points (M, D), from the nearest of the cloud."""
        from scipy.spatial import cKDTree

        distances, nearest = cKDTree(self._points).query(X, k=NEAREST_POINTS)
        weights = 1.0 / np.maximum(distances, 1e-9)
        turns = np.exp(2j * np.pi * self._coordinates[nearest])
        return np.asarray(np.angle((weights * turns).sum(axis=1)) / (2 * np.pi) % 1.0)

    def fit_transform(self, X: FloatArray) -> FloatArray:
        """Return (N,) the coordinates of a cloud (N, D) in laps, in [0, 1)."""
        return self.fit(X).coordinates_

    def _limit(self, distances: Float32Array) -> float:
        farthest = float(distances.max())
        if farthest == 0.0:
            raise NoPeriodError("Expected points that move, but they are all the same.")
        if self.max_epsilon is not None:
            return self.max_epsilon
        return float(distances.max(axis=1).min())


def landmarks(points: FloatArray, count: int) -> IntArray:
    """Return the indices, in order, of so many of (N, D) points that lie far from each other.

    Each is the point farthest from those before it; the first is the first one.

    Examples
    --------
    >>> landmarks(np.array([[0.0], [0.1], [5.0], [5.2], [9.0]]), 3).tolist()
    [0, 2, 4]
    """
    chosen = [0]
    apart = ((points - points[0]) ** 2).sum(axis=1)
    while len(chosen) < min(count, len(points)) and apart.max() > 0:
        chosen.append(int(np.argmax(apart)))
        apart = np.minimum(apart, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
    return np.sort(np.array(chosen))


def lift_cocycle(
    cocycle: IntArray, distances: Float32Array, birth: float, death: float, prime: int
) -> tuple[IntArray, float]:
    """Return a cocycle modulo a prime as one of integers, and the distance up to which it is one.

    Parameters
    ----------
    cocycle : (E, 3) of int
        Edges (i, j) and values modulo the prime.
    distances : (N, N) float32
        As the persistent cohomology saw them.
    birth, death : float
        Of the class.
    prime : int

    Raises
    ------
    NoPeriodError
        If no multiple of the cocycle is one of integers, at no threshold from death to birth.

    Notes
    -----
    Values are taken nearest to 0. Of the cocycle's multiples the smallest is tried first: the
    class may be half the generator. Where a triangle's sum is a multiple of the prime other than
    0, the next multiple may do, or else a smaller complex: the threshold goes down from death
    towards birth.
    """
    for threshold in np.linspace(death, birth, LIFT_THRESHOLDS, endpoint=False):
        joined = distances < np.float32(threshold)
        inside = joined[cocycle[:, 0], cocycle[:, 1]]
        units = np.arange(1, prime // 2 + 1)
        values = (np.outer(units, cocycle[inside, 2]) + prime // 2) % prime - prime // 2
        for row in np.argsort(np.abs(values).sum(axis=1), kind="stable"):
            lifted = np.column_stack([cocycle[inside, :2], values[row]])
            if _is_cocycle(lifted, joined):
                return lifted, float(threshold)
    raise NoPeriodError(
        f"Expected a cocycle of integers between distances {birth:.4g} and {death:.4g}, but "
        f"modulo {prime} none fits. Use a stride, another rank or another embedding."
    )


def expect_odd_prime(number: int) -> None:
    """Raise a CycleError for a number that is no odd prime."""
    divisors = range(2, math.isqrt(max(number, 0)) + 1)
    if number <= 2 or not all(number % divisor for divisor in divisors):
        raise CycleError(f"Expected an odd prime, but got {number}. Use 47, say.")


def _distances(points: FloatArray) -> Float32Array:
    """Return the (N, N) Euclidean distances in float32: what ripser computes with.

    In float64 the triangle that kills a class may seem to have an edge shorter than its death.
    """
    squares = np.zeros((len(points), len(points)))
    for column in points.T:
        squares += (column[:, None] - column) ** 2
    return np.sqrt(squares).astype(np.float32)


def _persistent_cocycles(
    distances: Float32Array, limit: float, prime: int
) -> tuple[FloatArray, list[IntArray]]:
    """Return the bars (B, 2) of the first cohomology, longest first, and their cocycles."""
    # ripser's own module imports scikit-learn, which takes longer than all the rest of a clip
    from pyRipser import doRipsFiltrationDM

    upper = distances[np.triu_indices(len(distances), 1)]
    found = doRipsFiltrationDM(upper, 1, limit, prime, True)
    bars = np.array(found["births_and_deaths_by_dim"][1], dtype=np.float64).reshape(-1, 2)
    bars[np.isinf(bars[:, 1]), 1] = limit
    order = np.argsort(bars[:, 0] - bars[:, 1], kind="stable")
    cocycles = [
        np.array(found["cocycles_by_dim"][1][i], dtype=np.int64).reshape(-1, 3) for i in order
    ]
    for cocycle in cocycles:
        cocycle[:, 2] %= prime
    return bars[order], cocycles


def _matrix(cocycle: IntArray, n_points: int) -> FloatArray:
    """Return (N, N) the antisymmetric matrix of a cocycle's values."""
    values = np.zeros((n_points, n_points))
    i, j, value = cocycle.T
    values[i, j] = value
    values[j, i] = -value
    return values


def _is_cocycle(cocycle: IntArray, joined: BoolArray) -> bool:
    """Whether the values around every triangle add up to 0.

    Only triangles on an edge with a value other than 0 can fail.
    """
    values = _matrix(cocycle, len(joined))
    edges = cocycle[cocycle[:, 2] != 0, :2]
    for part in np.array_split(edges, max(1, len(edges) // 512)):
        i, j = part.T
        around = values[i, j][:, None] + values[j] - values[i]
        if np.any(around[joined[i] & joined[j]]):
            return False
    return True


def _smoothed(cocycle: IntArray, joined: BoolArray) -> FloatArray:
    """Return (N,) the coordinates that vary least along the edges, in [0, 1).

    Of all cocycles that differ by the differences of a function f the one with the least sum of
    squares: f solves the graph's Laplace equation, and f modulo 1 is the coordinate.
    """
    from scipy.linalg import solve

    joined = joined.copy()
    np.fill_diagonal(joined, False)
    values = np.where(joined, _matrix(cocycle, len(joined)), 0.0)
    weights = joined.astype(np.float64)
    degrees = weights.sum(axis=1)
    laplacian = np.diag(degrees) - weights
    laplacian += 1.0 / len(joined)  # the constant is free: hold the mean at 0
    laplacian[np.diag_indices_from(laplacian)] += 1e-12 * (degrees + 1.0)  # lone points
    return np.asarray(solve(laplacian, -values.sum(axis=0), assume_a="pos") % 1.0)


def _spread(coordinates: FloatArray, stride: int, n_points: int) -> FloatArray:
    """Return coordinates for the points left out, on the shorter arc between their neighbours."""
    if stride == 1:
        return coordinates
    turns = np.round([b - a for a, b in pairwise(coordinates)])
    unwrapped = coordinates - np.concatenate([[0.0], np.cumsum(turns)])
    kept = np.arange(len(coordinates)) * stride
    speed = (unwrapped[-1] - unwrapped[-2]) / stride
    beyond = np.maximum(np.arange(n_points) - kept[-1], 0) * speed
    return np.asarray((np.interp(np.arange(n_points), kept, unwrapped) + beyond) % 1.0)
