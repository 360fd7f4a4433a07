"""Which side of a body is left: by names, or by where feet and knees point."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mocapdb.motion.body.canonical_joints import SIDES, other_side
from mocapdb.motion.body.joint_names import parse_name
from mocapdb.motion.body.pose_tree import PoseTree
from mocapdb.motion.tuning import SURELY_MIRRORED

__all__ = ["are_named_otherwise", "facing_left", "with_sides"]

LEG = ("hip", "knee", "ankle")
ARM = ("shoulder", "elbow", "wrist")


def with_sides(tree: PoseTree, nodes: Mapping[str, int]) -> dict[str, int]:
    """Return the nodes of limbs called ``first_`` and ``second_`` under the names of sides.

    Names tell the side where they have one, unless toes and knees clearly point the other way, as
    in mirrored exports; else left is left of where these point. The
    arm of a leg's side is the one that is on that side of the body, or that is named so.
    """
    pairs = {part: (nodes[f"first_{part}"], nodes[f"second_{part}"]) for part in (*LEG, *ARM)}
    legs, arms = (_said_side(tree, [pairs[part] for part in limb]) for limb in (LEG, ARM))
    if legs and arms:
        same = legs == arms
    else:
        hips, shoulders = (
            tree.positions[:, first] - tree.positions[:, second]
            for first, second in (pairs["hip"], pairs["shoulder"])
        )
        same = float(np.sum(hips * shoulders)) >= 0
    together = {
        f"{side}_{part}": pairs[part][i if part in LEG or same else 1 - i]
        for i, side in enumerate(SIDES)
        for part in (*LEG, *ARM)
    }
    said = legs or (arms if same or not arms else SIDES[1 - SIDES.index(arms)])
    if not said:
        said = SIDES[0] if facing_left(tree, together) >= 0 else SIDES[1]
    if said == SIDES[1]:
        together = {other_side(name): node for name, node in together.items()}
    if facing_left(tree, together) < SURELY_MIRRORED:
        together = {other_side(name): node for name, node in together.items()}
    return together


def _said_side(tree: PoseTree, pairs: list[tuple[int, int]]) -> str:
    """Return which side the first ones of some pairs are on by their names; nothing if unsaid."""
    votes = 0
    for pair in pairs:
        first, second = (parse_name(tree.names[node]).side for node in pair)
        if first and second and first != second:
            votes += 1 if first == SIDES[0] else -1
    return "" if votes == 0 else SIDES[0] if votes > 0 else SIDES[1]


def are_named_otherwise(tree: PoseTree, nodes: Mapping[str, int]) -> bool:
    """Return whether the legs have names of the other side each."""
    return (
        _said_side(tree, [(nodes[f"right_{part}"], nodes[f"left_{part}"]) for part in LEG])
        == (SIDES[0])
    )


def facing_left(tree: PoseTree, nodes: Mapping[str, int]) -> float:
    """Return the mean cosine between the way to the left hip and what the body's front says.

    The front is where feet point and knees bend; up is along the trunk, from hips to shoulders.
    """
    at = {name: tree.positions[:, node] for name, node in nodes.items()}
    hips = (at["left_hip"] + at["right_hip"]) / 2
    up = (at["left_shoulder"] + at["right_shoulder"]) / 2 - hips
    ahead = np.zeros_like(up)
    for side in SIDES:
        hip, knee, ankle = (at[f"{side}_{part}"] for part in ("hip", "knee", "ankle"))
        leg = ankle - hip
        share = np.sum((knee - hip) * leg, axis=1) / np.maximum(np.sum(leg * leg, axis=1), 1e-12)
        ahead += knee - (hip + share[:, None] * leg)
        start = nodes[f"{side}_ankle"]
        reach = [(tree.distance(start, end), end) for end in tree.leaves_below(start)]
        far = max(reach)[1]
        foot = tree.positions[:, far] - ankle
        along = leg / np.maximum(np.linalg.norm(leg, axis=1, keepdims=True), 1e-12)
        ahead += foot - np.sum(foot * along, axis=1, keepdims=True) * along
    left = np.cross(up, ahead)
    across = at["left_hip"] - at["right_hip"]
    sizes = np.linalg.norm(left, axis=1) * np.linalg.norm(across, axis=1)
    usable = sizes > 0
    if not usable.any():
        return 0.0
    return float((np.sum(left * across, axis=1)[usable] / sizes[usable]).mean())
