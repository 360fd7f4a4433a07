"""Groups of joints that move together (Aristidou 2018, section 3.1), by the skeleton's hierarchy.

Top, bottom, left and right half of the body; they overlap. Nothing goes by a joint's name.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import IntArray
from mocapdb.cleaning.tuning import MIDLINE_SHARE
from mocapdb.motion.foot_contacts import find_legs
from mocapdb.motion.skeleton import Skeleton

__all__ = ["body_groups"]


def body_groups(skeleton: Skeleton, joints: IntArray) -> dict[str, IntArray]:
    """Return the rows of a texture that belong to each group.

    Parameters
    ----------
    skeleton : Skeleton
    joints : (K,)
        The texture's joints.

    Returns
    -------
    dict
        ``"top"``, ``"bottom"``, ``"left"`` and ``"right"``; empty for a skeleton without two legs.
        Which side is left follows from the legs alone, not from the way the body faces: the two
        may be exchanged. The root is in every group.
    """
    legs = find_legs(skeleton)
    if len(legs) < 2:
        return {}
    above = [set(_ancestors(skeleton, leg.knee)) for leg in legs]
    trunk = set.intersection(*above)
    branches = {_first_below(skeleton, leg.knee, trunk) for leg in legs}
    rest = skeleton.rest_positions
    across = rest[legs[0].knee] - rest[legs[1].knee]
    across = across / max(float(np.linalg.norm(across)), 1e-12)
    side = (rest - (rest[legs[0].knee] + rest[legs[1].knee]) / 2) @ across / skeleton.height
    groups: dict[str, list[int]] = {"top": [], "bottom": [], "left": [], "right": []}
    for row, joint in enumerate(joints.tolist()):
        below = bool(branches & {joint, *_ancestors(skeleton, joint)})
        if below or joint == 0:
            groups["bottom"].append(row)
        if not below:
            groups["top"].append(row)
        if side[joint] > -MIDLINE_SHARE or joint == 0:
            groups["left"].append(row)
        if side[joint] < MIDLINE_SHARE or joint == 0:
            groups["right"].append(row)
    return {name: np.array(rows, dtype=np.int64) for name, rows in groups.items()}


def _ancestors(skeleton: Skeleton, joint: int) -> list[int]:
    found = []
    while skeleton.parents[joint] >= 0:
        joint = int(skeleton.parents[joint])
        found.append(joint)
    return found


def _first_below(skeleton: Skeleton, joint: int, trunk: set[int]) -> int:
    """Return the joint above another, or itself, whose parent is in the trunk."""
    while int(skeleton.parents[joint]) not in trunk:
        joint = int(skeleton.parents[joint])
    return joint
