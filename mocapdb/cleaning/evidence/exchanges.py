"""Exchanges: a joint and the opposite one swapped for a while.

Markers of the left taken for those of the right: two joints jump at the same two moments, to where
the other one was. Each by itself fits no offset, since the two edges jump by different turns.
Swapped back, in the rotations as they are or mirrored, the edges are gone: each joint goes on, at
its pace, where the other one is. Whole limbs are swapped at once, so where one pair is, others are
tried that jump by less. The evidence, in logarithms:

============  ====================================================================================
`jump`        how far both joints jump at the lesser edge, in degrees
`left_over`   what is left of that after swapping back
`strength`    the jump against the usual steps of both
`length`      in seconds
`misfit`      the share that is left at the worse edge
`together`    how many other pairs are swapped from when to when this one is
============  ====================================================================================
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.evidence.discontinuities import Jumps, find_jumps
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import (
    LARGEST_LEFT_OVER,
    LEAST_ANGLE_DEG,
    LEAST_EXCHANGE_DEG,
    LEAST_LENGTH_S,
    LEAST_MOVED_DEG,
    LONGEST_EXCHANGE_S,
    SPREAD_QUANTILE,
)
from mocapdb.motion.body.joint_names import across_by_names
from mocapdb.motion.quaternions import angles_deg, from_rotation_vectors_deg, multiply

__all__ = ["EXCHANGE_EVIDENCE", "MIRRORS", "find_exchanges"]

EXCHANGE_EVIDENCE = ("jump", "left_over", "strength", "length", "misfit", "together")
MIRRORS = np.array([[1, 1, 1, 1], [1, -1, -1, 1], [-1, 1, -1, 1], [-1, -1, 1, 1]], dtype=float)
"""A rotation as it is, and mirrored through the plane across each axis: signs of x, y, z, w."""


@dataclass(frozen=True)
class _Pair:
    """A joint and the opposite one: how far they jump, and how far they would if swapped.

    Attributes
    ----------
    rows : (int, int)
    own_deg : (F - 1,)
        How far both jump at each boundary.
    swapped_deg : (4, F - 1)
        How far each goes on from its own course to that of the other, by mirror.
    usual_deg : float
        What most of their jumps stay below.
    """

    rows: tuple[int, int]
    own_deg: FloatArray
    swapped_deg: FloatArray
    usual_deg: float


class _Stretch(NamedTuple):
    first: int
    last: int
    mirror: int


def find_exchanges(native: Texture) -> list[Hypothesis]:
    """Return the stretches in which a joint and the opposite one are swapped, of both joints."""
    if len(native) < 4:
        return []
    across = across_by_names(native.skeleton.names)
    rows = {joint: row for row, joint in enumerate(native.joints.tolist())}
    jumps = find_jumps(native)
    pairs = [
        _pair(native, jumps, row, other)
        for joint, row in rows.items()
        if (other := rows.get(int(across[joint]), row)) > row
    ]
    seen = [_stretches(pair, native.fps) for pair in pairs]
    every = sorted({(one.first, one.last) for several in seen for one in several})
    for number, pair in enumerate(pairs):
        seen[number] += _where_others_are(pair, seen[number], every)
    found = []
    for number, (pair, several) in enumerate(zip(pairs, seen, strict=True)):
        others = [one for k, more in enumerate(seen) if k != number for one in more]
        for one in several:
            evidence = _evidence(pair, one, others, native.fps)
            found += [
                Hypothesis(one.first + 1, one.last + 1, row, "exchange", evidence, "exchange")
                for row in pair.rows
            ]
    return found


def _pair(native: Texture, jumps: Jumps, row: int, other: int) -> _Pair:
    a, b = native.quat_xyzw[:, row], native.quat_xyzw[:, other]
    steps_a, steps_b = jumps.steps_deg[:, row], jumps.steps_deg[:, other]
    own = jumps.sizes_deg[:, row] + jumps.sizes_deg[:, other]
    swapped = [_goes_on(a, steps_a, b, steps_b, signs) for signs in MIRRORS]
    usual = float(np.quantile(own, SPREAD_QUANTILE)) + LEAST_ANGLE_DEG
    return _Pair((row, other), own, np.array(swapped), usual)


def _goes_on(
    a: FloatArray, steps_a: FloatArray, b: FloatArray, steps_b: FloatArray, signs: FloatArray
) -> FloatArray:
    """Return (F - 1,) how far either joint is from its course where the other one's goes on.

    The course before the boundary is carried on to the frame after it, or the one after it back to
    the frame before: whichever fits better, as for a jump.
    """
    total = np.zeros(len(a) - 1)
    for (mine, my_steps), (other, its_steps) in (
        ((a, steps_a), (b, steps_b)), ((b, steps_b), (a, steps_a)),
    ):  # fmt: skip
        then = other[1:] * signs
        onwards = np.concatenate(
            [mine[:1], multiply(mine[1:-1], from_rotation_vectors_deg(my_steps[:-1]))]
        )
        back = multiply(other[1:-1], from_rotation_vectors_deg(-its_steps[1:])) * signs
        before = np.concatenate([back, then[-1:]])
        total += np.minimum(angles_deg(onwards, then), angles_deg(mine[:-1], before))
    return total


def _stretches(pair: _Pair, fps: float) -> list[_Stretch]:
    """Return the stretches between two boundaries at which swapping mends a jump."""
    own, shares = pair.own_deg, pair.swapped_deg / np.maximum(pair.own_deg, LEAST_ANGLE_DEG)
    candidates = np.flatnonzero(own > max(LEAST_EXCHANGE_DEG, pair.usual_deg))
    if len(candidates) < 2:
        return []
    mirror = int(np.sort(shares[:, candidates], axis=1)[:, :2].mean(axis=1).argmin())
    share = shares[mirror]
    edges = candidates[share[candidates] < LARGEST_LEFT_OVER].tolist()
    near = set(edges)
    # of edges side by side the best
    edges = [t for t in edges if all(s not in near or share[t] <= share[s] for s in (t - 1, t + 1))]
    found, i = [], 0
    while i + 1 < len(edges):
        first, last = edges[i], edges[i + 1]
        if last - first > LONGEST_EXCHANGE_S * fps:
            i += 1
            continue
        found.append(_Stretch(first, last, mirror))
        i += 2
    return found


def _where_others_are(
    pair: _Pair, own: list[_Stretch], every: Sequence[tuple[int, int]]
) -> list[_Stretch]:
    """Return the stretches in which other pairs are swapped, and this one is, too.

    It may jump by less than would be seen if nothing else were swapped.
    """
    found = []
    for first, last in every:
        if any(one.first < last and first < one.last for one in own):
            continue
        jumps = pair.own_deg[[first, last]]
        shares = pair.swapped_deg[:, [first, last]].max(axis=1) / max(jumps.min(), LEAST_ANGLE_DEG)
        mirror = int(shares.argmin())
        if jumps.min() > LEAST_MOVED_DEG and shares[mirror] < LARGEST_LEFT_OVER:
            found.append(_Stretch(first, last, mirror))
    return found


def _evidence(
    pair: _Pair, one: _Stretch, others: Sequence[_Stretch], fps: float
) -> tuple[float, ...]:
    ends = [one.first, one.last]
    jump = float(pair.own_deg[ends].min())
    shares = pair.swapped_deg[one.mirror, ends] / np.maximum(pair.own_deg[ends], LEAST_ANGLE_DEG)
    misfit = float(shares.max())
    alike = sum(abs(k.first - one.first) <= 1 and abs(k.last - one.last) <= 1 for k in others)
    return (
        math.log(jump),
        math.log(misfit * jump + LEAST_ANGLE_DEG),
        math.log(jump / pair.usual_deg),
        math.log(max((one.last - one.first) / fps, LEAST_LENGTH_S)),
        misfit,
        math.log1p(alike),
    )
