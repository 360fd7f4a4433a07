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


def body_fault(tree: PoseTree, nodes: Mapping[str, int], *, is_posed: bool) -> str:
    """Return what is not human about joints that were found; empty where nothing is.

    Lengths are compared side by side and with a human's. Poses are asked only where they are of a
    motion: a body whose trunk lies level all the time, with arms and legs that stand on the
    ground, must have a human's arms and trunk.
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
    segments = {pair: sum(length[side, *pair] for side in SIDES) / 2 for pair in SEGMENTS}
    ratios = _ratios_of_segments(segments)
    if is_posed:
        ratios |= _ratios_over_motion(tree, nodes, segments)
    for what, ratio in ratios.items():
        least, most = PROPORTIONS[what]
        if not least <= ratio <= most:
            return f"its {what} are as {ratio:.2f} to 1, a human's are {least:g} to {most:g}"
    return _fault_of_poses(tree, nodes, ratios) if is_posed else ""


def _ratios_of_segments(segments: Mapping[tuple[str, str], float]) -> dict[str, float]:
    """Return the ratios of a body's segments to each other, the same in every pose."""
    thigh, shank, upper, lower = (segments[pair] for pair in SEGMENTS)
    return {
        "thigh to shank": thigh / shank,
        "upper arm to forearm": upper / lower,
        "arms to legs": (upper + lower) / (thigh + shank),
    }


def _ratios_over_motion(
    tree: PoseTree, nodes: Mapping[str, int], segments: Mapping[tuple[str, str], float]
) -> dict[str, float]:
    """Return the median ratios of distances across joints to the legs."""
    leg = segments["hip", "knee"] + segments["knee", "ankle"]
    hips, shoulders = (_between(tree, nodes, part) for part in ("hip", "shoulder"))
    trunk = float(np.median(np.linalg.norm(shoulders - hips, axis=1)))
    neck = float(np.median(np.linalg.norm(tree.positions[:, nodes["head"]] - shoulders, axis=1)))
    return {
        "trunk to legs": trunk / leg,
        "head to trunk": neck / max(trunk, 1e-12),
        "hips to legs": tree.distance(nodes["left_hip"], nodes["right_hip"]) / leg,
        "shoulders to legs": tree.distance(nodes["left_shoulder"], nodes["right_shoulder"]) / leg,
    }


def _fault_of_poses(tree: PoseTree, nodes: Mapping[str, int], ratios: Mapping[str, float]) -> str:
    """Return what a human does not do over a whole motion; empty where nothing is wrong."""
    hips = _between(tree, nodes, "hip")
    trunk = _between(tree, nodes, "shoulder") - hips
    if np.median(_cosines(_between(tree, nodes, "ankle") - hips, trunk)) > FOLDED_COSINE:
        return "its legs lie along its trunk"
    is_like_animal = ratios["arms to legs"] > LONG_ARM or ratios["trunk to legs"] > LONG_TRUNK
    if is_like_animal and _walks_on_all_fours(tree, nodes, trunk):
        return "it walks on four legs, and has the arms or the trunk of an animal that does"
    return ""


def _between(tree: PoseTree, nodes: Mapping[str, int], part: str) -> FloatArray:
    """Return (F, 3) the middle of a part of both sides."""
    left, right = (tree.positions[:, nodes[f"{side}_{part}"]] for side in SIDES)
    return np.asarray((left + right) / 2)


def _walks_on_all_fours(tree: PoseTree, nodes: Mapping[str, int], trunk: FloatArray) -> bool:
    """Return whether arms and legs hang down from a level trunk in nearly all frames."""
    level = np.ones(len(trunk), dtype=bool)
    for start, end in (("hip", "ankle"), ("shoulder", "wrist")):
        limb = _between(tree, nodes, end) - _between(tree, nodes, start)
        level &= np.abs(_cosines(limb, trunk)) < ALL_FOURS_COSINE
    return bool(level.mean() > ALL_FOURS_SHARE)


def _cosines(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return (F,) the cosines of the angles between vectors (F, 3)."""
    sizes = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    return np.asarray(np.sum(a * b, axis=1) / np.maximum(sizes, 1e-12))
