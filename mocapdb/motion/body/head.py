"""Finding the head by its shape: the branch beyond the arms."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.body.pose_tree import PoseTree
from mocapdb.motion.tuning import HEAD_REACH, HEAD_RISE

__all__ = ["find_head"]


def find_head(tree: PoseTree, nodes: Mapping[str, int], stature: float) -> int | None:
    """Return the node at the base of the head: on the branch beyond the arms that goes furthest.

    Of the nodes on it that is the last one about a neck's length above the shoulders, and before
    the top of the head.
    """
    thighs = [nodes[f"{side}_hip"] for side in SIDES]
    arms = [nodes[f"{side}_shoulder"] for side in SIDES]
    chest = tree.meeting(*arms)
    limbs = {node for end in (*thighs, *arms) for node in tree.way_up(end)}
    hips = (tree.positions[:, thighs[0]] + tree.positions[:, thighs[1]]) / 2
    best: tuple[float, int] | None = None
    for leaf in range(tree.n_nodes):
        if tree.children[leaf] or leaf in limbs:
            continue
        way = tree.way_up(leaf)
        branch = next(node for node in way if node in limbs)
        if any(tree.is_above(end, leaf) for end in (*thighs, *arms)):
            continue
        if tree.distance(branch, chest) > HEAD_REACH * stature:
            continue
        left, right = (tree.distance(leaf, arm) for arm in arms)
        far = float(np.median(np.linalg.norm(tree.positions[:, leaf] - hips, axis=1)))
        score = far - abs(left - right)
        if best is None or score > best[0]:
            best = score, leaf
    if best is None:
        return None
    start = tree.meeting(chest, best[1])
    way = tree.places_apart(tree.way_down(start, best[1]))[1:]
    if not way:
        return None
    inner = [node for node in way if not tree.is_end[node]] or way
    for i, node in enumerate(inner):
        apart = [child for child in tree.children[node] if tree.lengths[child] > 0]
        if node not in limbs and len(apart) > 1:  # a face
            inner = inner[: i + 1]
            break
    shoulders = (tree.positions[:, arms[0]] + tree.positions[:, arms[1]]) / 2
    up = shoulders - hips
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-12)
    rises = [np.sum((tree.positions[:, node] - shoulders) * up, axis=1) for node in inner]
    shares = [float(np.median(rise)) / stature for rise in rises]
    least, most = HEAD_RISE
    usual = [node for node, share in zip(inner, shares, strict=True) if least <= share <= most]
    if usual:
        return usual[-1]
    return inner[int(np.argmin([abs(share - (least + most) / 2) for share in shares]))]
