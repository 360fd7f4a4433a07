"""Limbs that were exchanged: what is right stands on the other side, for every joint of them.

Each joint by itself may look like an offset, or be filled a little better by similar motion. Where
one joint of a limb is exchanged, the opposite one is, and so are those above and below that are
flagged at the same time, if swapping mends their edges: the whole limb is swapped back as one.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import IntArray
from mocapdb.cleaning.map.digression_map import Span
from mocapdb.cleaning.repair.gaps import TAKEN_BACK, Gap
from mocapdb.cleaning.tuning import LARGEST_JUMP_LEFT, SAME_SPAN_SHARE
from mocapdb.motion.frame_range import FrameRange
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Swap", "find_swaps"]


class Swap(NamedTuple):
    """How a joint is swapped back.

    Attributes
    ----------
    mirror : int
        Of `exchanges.MIRRORS`.
    misfit_deg : float, degrees
        How far it is then from what the frames beside the span lead to.
    """

    mirror: int
    misfit_deg: float


class _Pair(NamedTuple):
    gaps: tuple[Gap, Gap]
    swaps: tuple[Swap, Swap]
    is_exchange: bool


def find_swaps(skeleton: Skeleton, across: IntArray, gaps: Mapping[Span, Gap]) -> dict[Span, Swap]:
    """Return which spans are swapped back with those of the opposite joints.

    Parameters
    ----------
    skeleton : Skeleton
    across : (J,)
        The opposite of each joint; itself where there is none.
    gaps : mapping of Span to Gap
    """
    pairs = [
        pair
        for one, other in combinations(gaps.values(), 2)
        if other.span.joint == across[one.span.joint]
        and _are_alike(one.span, other.span)
        and (pair := _pair(one, other)) is not None
    ]
    sure = [pair for pair in pairs if pair.is_exchange]
    return {
        gap.span: swap
        for pair in pairs
        if any(_are_of_a_limb(skeleton, pair, other) for other in sure)
        for gap, swap in zip(pair.gaps, pair.swaps, strict=True)
    }


def _pair(one: Gap, other: Gap) -> _Pair | None:
    """Return the gaps of opposite joints as a pair, if swapping mends the edges of both."""
    kinds = {one.span.kind, other.span.kind}
    mine, its = one.swapped_misfits_deg(), other.swapped_misfits_deg()
    if not kinds <= TAKEN_BACK or mine is None or its is None:
        return None
    mirror = int(np.argmin(mine + its))
    if mine[mirror] + its[mirror] > LARGEST_JUMP_LEFT * (one.misfit_deg() + other.misfit_deg()):
        return None
    swaps = Swap(mirror, float(mine[mirror])), Swap(mirror, float(its[mirror]))
    return _Pair((one, other), swaps, "exchange" in kinds)


def _are_alike(first: FrameRange, second: FrameRange) -> bool:
    """Return whether two spans are nearly the same frames."""
    both = min(first.end, second.end) - max(first.start, second.start)
    either = max(first.end, second.end) - min(first.start, second.start)
    return both >= SAME_SPAN_SHARE * either


def _are_of_a_limb(skeleton: Skeleton, first: _Pair, second: _Pair) -> bool:
    """Return whether a joint of one pair is, or is above, one of the other, at the same time."""
    return any(
        _are_alike(a.span, b.span)
        and (
            a.span.joint in skeleton.chain_to_root(b.span.joint)
            or b.span.joint in skeleton.chain_to_root(a.span.joint)
        )
        for a in first.gaps
        for b in second.gaps
    )
