"""Exchanges: a joint and the opposite one swapped for a while.

Markers of the left taken for those of the right: two joints jump at the same two moments, to where
the other one was. Each by itself fits no offset, since the two edges jump by different turns.
Swapped back, in the rotations as they are or mirrored, the edges are gone. The evidence, in
logarithms:

============  ====================================================================================
`jump`        how far both joints jump at the lesser edge, in degrees
`left_over`   what is left of that after swapping back
`strength`    the jump against the usual steps of both
`length`      in seconds
`misfit`      the share that is left at the worse edge
============  ====================================================================================
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import (
    LARGEST_LEFT_OVER,
    LEAST_ANGLE_DEG,
    LEAST_EXCHANGE_DEG,
    LEAST_LENGTH_S,
    LONGEST_EXCHANGE_S,
    SPREAD_QUANTILE,
)
from mocapdb.motion.body.joint_names import across_by_names
from mocapdb.motion.quaternions import angles_deg

__all__ = ["EXCHANGE_EVIDENCE", "MIRRORS", "find_exchanges"]

EXCHANGE_EVIDENCE = ("jump", "left_over", "strength", "length", "misfit")
MIRRORS = np.array([[1, 1, 1, 1], [1, -1, -1, 1], [-1, 1, -1, 1], [-1, -1, 1, 1]], dtype=float)
"""A rotation as it is, and mirrored through the plane across each axis: signs of x, y, z, w."""


def find_exchanges(native: Texture) -> list[Hypothesis]:
    """Return the stretches in which a joint and the opposite one are swapped, of both joints."""
    if len(native) < 3:
        return []
    across = across_by_names(native.skeleton.names)
    rows = {joint: row for row, joint in enumerate(native.joints.tolist())}
    found = []
    for joint, row in rows.items():
        other = rows.get(int(across[joint]), row)
        if other > row:
            found += _of_pair(native, row, other)
    return found


def _of_pair(native: Texture, row: int, other: int) -> list[Hypothesis]:
    a, b = native.quat_xyzw[:, row], native.quat_xyzw[:, other]
    own_a, own_b = angles_deg(a[:-1], a[1:]), angles_deg(b[:-1], b[1:])
    own = own_a + own_b
    usual = float(np.quantile(own, SPREAD_QUANTILE)) + LEAST_ANGLE_DEG
    candidates = np.flatnonzero(own > max(LEAST_EXCHANGE_DEG, usual))
    if len(candidates) < 2:
        return []
    best: FloatArray | None = None
    for signs in MIRRORS:
        # the frame after the edge, as it would be on the other side
        swapped = angles_deg(a[candidates], b[candidates + 1] * signs)
        swapped += angles_deg(b[candidates], a[candidates + 1] * signs)
        share = swapped / own[candidates]
        if best is None or np.median(np.sort(share)[:2]) < np.median(np.sort(best)[:2]):
            best = share
    assert best is not None
    good = best < LARGEST_LEFT_OVER
    edges = candidates[good].tolist()
    shares = dict(zip(edges, best[good].tolist(), strict=True))
    # of edges side by side the best
    edges = [t for t in edges if all(shares[t] <= shares.get(s, 2.0) for s in (t - 1, t + 1))]
    found, i = [], 0
    while i + 1 < len(edges):
        first, last = edges[i], edges[i + 1]
        length_s = (last - first) / native.fps
        if length_s > LONGEST_EXCHANGE_S:
            i += 1
            continue
        jump = min(own[first], own[last])
        misfit = max(shares[first], shares[last])
        evidence = (
            math.log(jump),
            math.log(misfit * jump + LEAST_ANGLE_DEG),
            math.log(jump / usual),
            math.log(max(length_s, LEAST_LENGTH_S)),
            misfit,
        )
        found += [
            Hypothesis(first + 1, last + 1, r, "exchange", evidence, "exchange")
            for r in (row, other)
        ]
        i += 2
    return found
