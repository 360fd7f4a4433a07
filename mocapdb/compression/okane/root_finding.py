"""Root finding and minimisation (O'Kane 2008, section 3.2.3).

The smallest number of coefficients or components that will do, and the budgets that cost least.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.tuning import GUESS_MARGIN, GUESS_REACH

__all__ = ["Ranking", "fewest", "golden_section"]


GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


class Ranking:
    """The coefficients of a clip in order of magnitude, whatever their column.

    Parameters
    ----------
    coefficients : (L, N)
    weights : (N,), optional
        Their magnitudes count so many times over, column by column.

    Attributes
    ----------
    coefficients : (L, N)
        Rounded to the float32 that is stored.
    magnitudes : (L * N,)
        Largest first.
    """

    def __init__(self, coefficients: FloatArray, weights: FloatArray | None = None) -> None:
        self.coefficients = coefficients.astype(np.float32).astype(np.float64)
        self._weighed = np.abs(self.coefficients)
        if weights is not None:
            self._weighed *= weights
        self.magnitudes = np.sort(self._weighed, axis=None)[::-1]

    def __len__(self) -> int:
        return len(self.magnitudes)

    def threshold(self, count: int) -> float:
        """Return what the `count` largest reach."""
        return float(self.magnitudes[count - 1]) if count else math.inf

    def count(self, threshold: float) -> int:
        """Return how many reach a threshold."""
        return int(np.searchsorted(-self.magnitudes, -threshold, side="right"))

    def largest(self, count: int) -> FloatArray:
        """Return the coefficients (L, N) with all but the `count` largest set to zero.

        One threshold serves the whole matrix; those that equal it stay.
        """
        if count == 0:
            return np.zeros_like(self.coefficients)
        threshold = self.threshold(count)
        return np.where(self._weighed >= threshold, self.coefficients, 0.0)


def fewest(
    error_of: Callable[[int], float],
    allowed: float,
    most: int,
    *,
    least: int = 0,
    slack: float = 0.0,
    guess: int | None = None,
) -> int | None:
    """Return the smallest count whose error is allowed, or None if even `most` loses too much.

    Parameters
    ----------
    error_of : callable
        The error that is left when so many are kept. It should fall as the count grows; where it
        does not, the count returned is still one whose error was measured and allowed.
    allowed : float
    most : int
        The largest count there is.
    least : int
        The smallest count to consider.
    slack : float
        Stop when the answer is known to within this share of itself; 0 finds it exactly.
    guess : int, optional
        Where the answer is likely to be near.

    Notes
    -----
    Bisection as in the thesis, made quicker by guessing: the logarithm of the error is roughly
    linear in the count's, so the next count to test is interpolated, and halves the range in the
    logarithm only where the guesses do not close in.
    """
    low, low_error = least - 1, math.inf
    high, high_error = most, math.inf
    if guess is not None and least < guess < most:
        for tested in (
            guess,
            round(guess * (1.0 + GUESS_REACH)),
            round(guess * (1.0 - GUESS_REACH)),
        ):
            if not low < tested < high:
                continue
            error = error_of(tested)
            if error <= allowed:
                high, high_error = tested, error
            else:
                low, low_error = tested, error
    if high == most:
        high_error = error_of(most)
        if high_error > allowed:
            return None
    for step in range(10_000):
        if high - low <= max(1, int(slack * high)):
            break
        middle = _between(low, high, low_error, high_error, allowed, guess=step % 3 != 2)
        error = error_of(middle)
        if error <= allowed:
            high, high_error = middle, error
        else:
            low, low_error = middle, error
    return high


def _between(
    low: int, high: int, low_error: float, high_error: float, allowed: float, *, guess: bool
) -> int:
    """Return the next count to test, strictly between `low` and `high`."""
    if low < 1:
        return (low + high) // 2 if high - low < 32 else max(low + 1, high // 16)
    share = 0.5
    if guess and math.isfinite(low_error) and low_error > allowed and 0 < high_error < allowed:
        share = math.log(low_error / allowed) / math.log(low_error / high_error)
        share = min(max(share + GUESS_MARGIN, GUESS_MARGIN), 1.0 - GUESS_MARGIN)
    middle = round(low * math.exp(share * math.log(high / low)))
    return min(max(middle, low + 1), high - 1)


def golden_section(
    cost_of: Callable[[float], float], low: float, high: float, rounds: int
) -> float:
    """Return the cheapest place that a golden-section search finds in an interval.

    Parameters
    ----------
    cost_of : callable
        What should fall and then rise; infinite where a place will not do.
    low, high : float
    rounds : int
        How often the interval shrinks, to 0.618 of itself each time. One evaluation each, and one.

    Examples
    --------
    >>> round(golden_section(lambda x: (x - 2) ** 2, 0.0, 5.0, 20), 3)
    2.0
    """
    costs: dict[float, float] = {}

    def cost(place: float) -> float:
        if place not in costs:
            costs[place] = cost_of(place)
        return costs[place]

    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    for _ in range(rounds):
        if cost(left) <= cost(right):
            high, right = right, left
            left = high - GOLDEN * (high - low)
        else:
            low, left = left, right
            right = low + GOLDEN * (high - low)
    return min(costs, key=costs.__getitem__)
