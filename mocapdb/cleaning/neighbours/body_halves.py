"""Groups of joints that move together (Aristidou 2018, section 3.1), by the skeleton's hierarchy.

Top, bottom, left and right half of the body; they overlap. Nothing goes by a joint's name.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.cleaning.tuning import MIDLINE_SHARE
from mocapdb.motion.body import understand
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.foot_contacts import find_legs
from mocapdb.motion.skeleton import Skeleton

__all__ = ["body_groups"]

ACROSS = 2**-0.5  # cosine of 45 degrees: a direction is across the body or along it


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
    trunk = set.intersection(*(set(skeleton.chain_to_root(leg.knee)[1:]) for leg in legs))
    branches = {_first_below(skeleton, leg.knee, trunk) for leg in legs}
    side = _sides(skeleton, legs[0].knee, legs[1].knee)
    groups: dict[str, list[int]] = {"top": [], "bottom": [], "left": [], "right": []}
    for row, joint in enumerate(joints.tolist()):
        below = not branches.isdisjoint(skeleton.chain_to_root(joint))
        if below or joint == 0:
            groups["bottom"].append(row)
        if not below:
            groups["top"].append(row)
        if side[joint] > -MIDLINE_SHARE or joint == 0:
            groups["left"].append(row)
        if side[joint] < MIDLINE_SHARE or joint == 0:
            groups["right"].append(row)
    return {name: np.array(rows, dtype=np.int64) for name, rows in groups.items()}


def _sides(skeleton: Skeleton, knee: int, other_knee: int) -> FloatArray:
    """Return (J,) how far each joint is to the side of a knee, in heights of the body.

    In the rest pose, which has the two sides apart; where it has not (bones that all lie along
    one axis), what hangs on the limbs of one side is on that side.
    """
    rest = skeleton.rest_positions
    across = rest[knee] - rest[other_knee]
    across = across / max(float(np.linalg.norm(across)), 1e-12)
    side = (rest - (rest[knee] + rest[other_knee]) / 2) @ across / skeleton.height
    body = understand(skeleton)
    if not body.is_human or _is_mirrored(rest / skeleton.height, body.joints.value, across):
        return np.asarray(side)
    sides = np.zeros(skeleton.n_joints)
    for name in SIDES:
        limbs = {body.turns[f"{name}_hip"], body.turns[f"{name}_shoulder"]}
        on_it = [
            not limbs.isdisjoint(skeleton.chain_to_root(joint))
            for joint in range(skeleton.n_joints)
        ]
        sides[on_it] = 1.0 if on_it[knee] else -1.0
    return sides


def _is_mirrored(rest: FloatArray, joints: Mapping[str, int], across: FloatArray) -> bool:
    """Return whether limbs lie on two sides of a rest pose, and legs not along the way across.

    Positions are in heights of the body.
    """
    at = {joint: rest[place] for joint, place in joints.items()}
    spans = [
        at[f"left_{part}"] - at[f"right_{part}"] for part in ("knee", "ankle", "elbow", "wrist")
    ]
    legs = [at[f"{side}_ankle"] - at[f"{side}_hip"] for side in SIDES]
    apart = [
        abs(float(span @ across)) > max(ACROSS * float(np.linalg.norm(span)), 2 * MIDLINE_SHARE)
        for span in spans
    ]
    along = [abs(float(leg @ across)) > ACROSS * np.linalg.norm(leg) for leg in legs]
    return all(apart) and not any(along)


def _first_below(skeleton: Skeleton, joint: int, trunk: set[int]) -> int:
    """Return the joint above another, or itself, whose parent is in the trunk."""
    while int(skeleton.parents[joint]) not in trunk:
        joint = int(skeleton.parents[joint])
    return joint
