"""The joints that a human body is understood by, and a human's proportions.

Segment lengths are fractions of stature after Drillis and Contini (1966), as tabulated by Winter,
*Biomechanics and Motor Control of Human Movement*, figure 4.1.
"""

from __future__ import annotations

__all__ = ["CHAINS", "JOINTS", "LIMBS", "MIDDLE", "SEGMENTS", "SIDES", "other_side"]

SIDES = ("left", "right")
LIMBS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "toe")
MIDDLE = ("hips", "spine", "chest", "head")
JOINTS: tuple[str, ...] = (*MIDDLE, *(f"{side}_{limb}" for side in SIDES for limb in LIMBS))
"""Names of the joints: the middle of the hips first, the left side before the right."""

CHAINS = (("hip", "knee", "ankle", "toe"), ("shoulder", "elbow", "wrist"))
"""The joints of a leg and of an arm, each hanging on the one before it."""

SEGMENTS = {
    ("hip", "knee"): 0.245,
    ("knee", "ankle"): 0.246,
    ("shoulder", "elbow"): 0.186,
    ("elbow", "wrist"): 0.146,
}
"""Lengths between joints as fractions of stature."""


def other_side(joint: str) -> str:
    """Return a joint's name on the other side of the body."""
    side, _, limb = joint.partition("_")
    if side not in SIDES:
        return joint
    return f"{SIDES[1 - SIDES.index(side)]}_{limb}"
