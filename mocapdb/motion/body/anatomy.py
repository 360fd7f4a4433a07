"""Whether joints that were found make a human body, asked of lengths and of the motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.motion.body.canonical_joints import SEGMENTS, SIDES
from mocapdb.motion.body.pose_tree import PoseTree
from mocapdb.motion.tuning import (
    ALL_FOURS_COSINE,
    ALL_FOURS_SHARE,
    FOLDED_COSINE,
    LONG_ARM,
    LONG_TRUNK,
    MOST_ASYMMETRY,
    PROPORTIONS,
)

__all__ = ["body_fault", "stature"]


def stature(tree: PoseTree, nodes: Mapping[str, int]) -> float | None:
    """Return a body's stature, in skeleton units, by the lengths of its limbs; None without any.

    The median of what each segment says, by its share of stature (Drillis and Contini 1966), both
    sides alike; where there are only the ends of legs and a head, nothing is said.
    """
    said = []
    for (start, end), share in SEGMENTS.items():
        for side in SIDES:
            pair = (nodes.get(f"{side}_{start}"), nodes.get(f"{side}_{end}"))
            if pair[0] is not None and pair[1] is not None:
                said.append(tree.distance(pair[0], pair[1]) / share)
    said = [each for each in said if each > 0]
    return float(np.median(said)) if said else None


def body_fault(tree: PoseTree, nodes: Mapping[str, int]) -> str:
    """Return what is not human about joints that were found; empty where nothing is.

    Lengths are compared side by side and with a human's, and a body whose trunk lies level over
    the whole motion, with arms and legs that stand on the ground, must have a human's arms and
    trunk.
    """
    length = {
        (side, start, end): tree.distance(nodes[f"{side}_{start}"], nodes[f"{side}_{end}"])
        for side in SIDES
        for start, end in SEGMENTS
    }
    if min(length.values()) <= 0:
        side, start, end = min(length, key=lambda key: length[key])
        return f"its {side} {start} and {end} are in one place"
    for start, end in SEGMENTS:
        left, right = (length[side, start, end] for side in SIDES)
        if abs(left - right) > MOST_ASYMMETRY * max(left, right):
            return f"its left and right differ between {start} and {end}"
    mean = {pair: sum(length[side, *pair] for side in SIDES) / 2 for pair in SEGMENTS}
    thigh, shank, upper, lower = (mean[pair] for pair in SEGMENTS)
    shoulders = (_at(tree, nodes, "left_shoulder") + _at(tree, nodes, "right_shoulder")) / 2
    hips = (_at(tree, nodes, "left_hip") + _at(tree, nodes, "right_hip")) / 2
    trunk = float(np.median(np.linalg.norm(shoulders - hips, axis=1)))
    neck = float(np.median(np.linalg.norm(_at(tree, nodes, "head") - shoulders, axis=1)))
    measured = {
        "thigh to shank": thigh / shank,
        "upper arm to forearm": upper / lower,
        "arms to legs": (upper + lower) / (thigh + shank),
        "trunk to legs": trunk / (thigh + shank),
        "head to trunk": neck / max(trunk, 1e-12),
        "hips to legs": tree.distance(nodes["left_hip"], nodes["right_hip"]) / (thigh + shank),
        "shoulders to legs": (
            tree.distance(nodes["left_shoulder"], nodes["right_shoulder"]) / (thigh + shank)
        ),
    }
    for what, ratio in measured.items():
        least, most = PROPORTIONS[what]
        if not least <= ratio <= most:
            return f"its {what} are as {ratio:.2f} to 1, a human's are {least:g} to {most:g}"
    legs = (_at(tree, nodes, "left_ankle") + _at(tree, nodes, "right_ankle")) / 2 - hips
    if np.median(_cosines(legs, shoulders - hips)) > FOLDED_COSINE:
        return "its legs lie along its trunk"
    if _walks_on_all_fours(tree, nodes, shoulders - hips) and (
        measured["arms to legs"] > LONG_ARM or measured["trunk to legs"] > LONG_TRUNK
    ):
        return "it walks on four legs, and has the arms or the trunk of an animal that does"
    return ""


def _at(tree: PoseTree, nodes: Mapping[str, int], joint: str) -> FloatArray:
    return tree.positions[:, nodes[joint]]


def _walks_on_all_fours(tree: PoseTree, nodes: Mapping[str, int], trunk: FloatArray) -> bool:
    """Return whether arms and legs hang down from a level trunk in nearly all frames."""
    level = np.ones(len(trunk), dtype=bool)
    for start, end in (("hip", "ankle"), ("shoulder", "wrist")):
        left, right = (
            _at(tree, nodes, f"{side}_{end}") - _at(tree, nodes, f"{side}_{start}")
            for side in SIDES
        )
        limb = left + right
        level &= np.abs(_cosines(limb, trunk)) < ALL_FOURS_COSINE
    return bool(level.mean() > ALL_FOURS_SHARE)


def _cosines(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return (F,) the cosines of the angles between vectors (F, 3)."""
    sizes = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    return np.asarray(np.sum(a * b, axis=1) / np.maximum(sizes, 1e-12))
