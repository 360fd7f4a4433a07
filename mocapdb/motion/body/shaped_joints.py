"""Finding a body's limbs by their shape: two pairs of long branches that mirror each other.

Only lengths of bones, the way they hang together and where joints bend are asked, all of them over
posed frames, so neither the rest pose nor the pose nor the vertical axis matters.
"""

from __future__ import annotations

from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.motion.body.canonical_joints import SEGMENTS
from mocapdb.motion.body.findings import NoBodyError
from mocapdb.motion.body.pose_tree import PoseTree
from mocapdb.motion.body.sides import with_sides
from mocapdb.motion.tuning import (
    BEND_WEIGHT,
    BENDING_DEG,
    FINGERS_SHARE,
    FOOT_SHARE,
    LONG_LIMB,
    MOST_LIMB_COST,
    MOST_LIMB_JOINTS,
    MOST_LONG_ENDS,
    MOST_UNLIKE,
    PLACE_WEIGHT,
)

__all__ = ["shaped_nodes"]

HIP_WIDTH, SHOULDER_WIDTH = 0.191, 0.258
LEG_SHARES = (SEGMENTS["hip", "knee"], SEGMENTS["knee", "ankle"])
ARM_SHARES = (SEGMENTS["shoulder", "elbow"], SEGMENTS["elbow", "wrist"])


class _Limb(NamedTuple):
    """The two ways from where a pair of limbs meets to its ends, places apart only."""

    meeting: int
    ways: tuple[list[int], list[int]]


class _Triples(NamedTuple):
    """Ways to take three joints of a limb.

    Attributes
    ----------
    joints : (T, 3) indices into the limb's ways
    lengths : (T,) upper and lower segment together
    costs : (T,)
    """

    joints: list[tuple[int, int, int]]
    lengths: FloatArray
    costs: FloatArray


def shaped_nodes(tree: PoseTree) -> dict[str, int]:
    """Return the nodes of hips, knees, ankles, shoulders, elbows and wrists.

    Raises
    ------
    NoBodyError
        If it is not the shape of a body with two legs and two arms.
    """
    pairs = _pairs(tree)
    if len(pairs) < 2:
        number = "1 pair" if pairs else "0 pairs"
        raise NoBodyError(
            f"it has {number} of long limbs that mirror each other, but two are needed"
        )
    if len(pairs) > 2:
        raise NoBodyError(f"it has {len(pairs)} pairs of long limbs, not 2")
    choices = []
    for legs, arms in (pairs, pairs[::-1]):
        leg, arm, cost = _fitted(tree, legs, arms)
        if cost < MOST_LIMB_COST:
            choices.append((cost, legs, leg, arms, arm))
    if not choices:
        raise NoBodyError("its limbs do not have the proportions of arms and legs")
    _, legs, leg, arms, arm = min(choices, key=lambda choice: choice[0])
    nodes: dict[str, int] = {}
    for limb, joints, parts in (
        (legs, leg, ("hip", "knee", "ankle")),
        (arms, arm, ("shoulder", "elbow", "wrist")),
    ):
        for name, way in zip(("first", "second"), limb.ways, strict=True):
            nodes |= {f"{name}_{part}": way[i] for part, i in zip(parts, joints, strict=True)}
    return with_sides(tree, nodes)


def _long_ends(tree: PoseTree) -> list[int]:
    """Return the leaves at the ends of long branches: each branch has the longest of its ways."""
    reach = np.zeros(tree.n_nodes)
    best = np.full(tree.n_nodes, -1)
    for node in range(tree.n_nodes - 1, 0, -1):
        parent, below = tree.parents[node], reach[node] + tree.lengths[node]
        if best[parent] < 0 or below >= reach[parent]:
            reach[parent], best[parent] = below, node
    ends = []
    for leaf in range(tree.n_nodes):
        if tree.children[leaf]:
            continue
        at, own = leaf, 0.0
        while tree.parents[at] >= 0 and best[tree.parents[at]] == at:
            own += tree.lengths[at]
            at = int(tree.parents[at])
        own += tree.lengths[at]
        if own > LONG_LIMB * tree.extent:
            ends.append(leaf)
    return ends


def _pairs(tree: PoseTree) -> list[_Limb]:
    """Return pairs of limbs that mirror each other, those most alike first taken."""
    ends = _long_ends(tree)
    if len(ends) > MOST_LONG_ENDS:
        raise NoBodyError(f"it has {len(ends)} long limbs")
    found = []
    for a, b in combinations(ends, 2):
        meeting = tree.meeting(a, b)
        ways = [tree.places_apart(tree.way_down(meeting, end)) for end in (a, b)]
        count = min(len(ways[0]), len(ways[1]), MOST_LIMB_JOINTS)
        if count < 3:
            continue
        ways = [way[:count] for way in ways]
        lengths = np.array([[tree.distance(*pair) for pair in pairwise(way)] for way in ways])
        unlike = float(np.abs(lengths[0] - lengths[1]).sum() / lengths.mean(axis=0).sum())
        if unlike < MOST_UNLIKE:
            found.append((unlike, a, b, _Limb(meeting, (ways[0], ways[1]))))
    pairs: list[_Limb] = []
    taken: set[int] = set()
    for _, a, b, limb in sorted(found, key=lambda each: each[0]):
        if not taken & {a, b}:
            taken |= {a, b}
            pairs.append(limb)
    return pairs


def _fitted(
    tree: PoseTree, legs: _Limb, arms: _Limb
) -> tuple[tuple[int, int, int], tuple[int, int, int], float]:
    """Return the joints of legs and arms that fit a human best, and how badly they do."""
    leg = _triples(tree, legs, LEG_SHARES, HIP_WIDTH, FOOT_SHARE)
    arm = _triples(tree, arms, ARM_SHARES, SHOULDER_WIDTH, FINGERS_SHARE)
    by_legs, by_arms = leg.lengths / sum(LEG_SHARES), arm.lengths / sum(ARM_SHARES)
    statures = np.log(by_legs)[:, None] - np.log(by_arms)
    costs = leg.costs[:, None] + arm.costs + statures**2
    first, second = np.unravel_index(int(np.argmin(costs)), costs.shape)
    return leg.joints[int(first)], arm.joints[int(second)], float(costs[first, second])


def _triples(
    tree: PoseTree, limb: _Limb, segments: tuple[float, float], width: float, beyond: float
) -> _Triples:
    """Return ways to take a limb's three joints, and how unlike a human's each is.

    What counts is the ratio of the segments, how far apart the first joints of both limbs are,
    what is left beyond the last one, and whether the middle one bends.
    """
    way, other = limb.ways
    n = len(way)
    at = np.stack([tree.positions[:, way], tree.positions[:, other]])
    apart = np.linalg.norm(at[:, :, :, None] - at[:, :, None], axis=-1)  # (2, F, n, n)
    lengths = np.median(apart, axis=1).mean(axis=0)
    along = np.concatenate([[0.0], np.cumsum(np.diagonal(lengths, 1))])
    rest_of_way = [
        max((tree.depths[leaf] for leaf in tree.leaves_below(w[-1])), default=0.0)
        - tree.depths[w[-1]]
        for w in limb.ways
    ]
    total = along[-1] + float(np.mean(rest_of_way))
    first = 0 if n == 3 else 1
    joints = list(combinations(range(first, n), 3))
    sizes, costs = [], []
    for a, b, c in joints:
        upper, lower = lengths[a, b], lengths[b, c]
        stature = (upper + lower) / sum(segments)
        cost = float(np.log(upper / lower) - np.log(segments[0] / segments[1])) ** 2
        apart_a = tree.distance(way[a], other[a])
        cost += PLACE_WEIGHT * (apart_a / stature - width) ** 2
        cost += PLACE_WEIGHT * max(0.0, (total - along[c]) / stature - beyond) ** 2
        sizes.append(upper + lower)
        costs.append(cost)
    bends = np.array([_bending_deg(apart, *joint) >= BENDING_DEG for joint in joints])
    stiff = BEND_WEIGHT * (~bends & bends.any())  # a single pose tells nothing
    return _Triples(joints, np.array(sizes), np.array(costs) + stiff)


def _bending_deg(apart: FloatArray, a: int, b: int, c: int) -> float:
    """Return over which range the angle at b between a and c changes, the wider of two limbs."""
    upper, lower, across = apart[..., a, b], apart[..., b, c], apart[..., a, c]
    cosine = (upper**2 + lower**2 - across**2) / np.maximum(2 * upper * lower, 1e-12)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return float(np.ptp(angle, axis=1).max())
