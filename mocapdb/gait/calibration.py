"""What zero means: the axes of each segment of the body, from a standing rest pose or from motion.

Every segment gets axes as the ISB recommends (Wu et al., J. Biomechanics 35, 2002, and 38, 2005):
x forwards, y up along the segment, z to the right. y runs through joint centres, so flexion and
abduction of hip and knee need no pose to be zero in; about y, and of the foot, something has to
say what straight ahead and level are, and that is chosen here and told.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.gait.feet import UP, Walker
from mocapdb.gait.tuning import (
    LEAST_BEND_DEG,
    STANDING_FOOT_DEG,
    STANDING_KNEE_DEG,
    STANDING_LEG_DEG,
)
from mocapdb.motion.body.canonical_joints import SIDES

__all__ = ["Calibration", "calibrate"]


@dataclass(frozen=True)
class Calibration:
    """The axes of segments as the joints that turn them see them.

    Attributes
    ----------
    axes : mapping of str to (3, 3)
        Of "pelvis", and of "left_thigh", "left_shank", "left_foot" and so on: the columns are
        forwards, up and right.
    zero : str
        What zero means, to be printed.
    """

    axes: Mapping[str, FloatArray]
    zero: str


def calibrate(walker: Walker) -> Calibration:
    """Return the axes of a body's segments, and what says so.

    The rest pose where somebody stands in it: legs down, knees straight, feet as level as in
    mid-stance. Else the motion: the pelvis is upright in the mean, knees turn about the axis that
    they bend about most, feet are level in mid-stance.
    """
    problem = _why_not_standing(walker)
    if not problem:
        return Calibration(
            _axes_at_rest(walker), "rest pose: feet, knees and pelvis are straight ahead in it"
        )
    return Calibration(
        _axes_from_motion(walker),
        f"motion: pelvis upright in the mean, knees by their axis, feet level in mid-stance "
        f"(not the rest pose: {problem})",
    )


def _why_not_standing(walker: Walker) -> str:
    """Return why nobody stands in the rest pose; empty where somebody does."""
    rest = walker.rest_positions
    for side in SIDES:
        hip, knee, ankle = (
            rest[walker.parts[f"{side}_{part}"]] for part in ("hip", "knee", "ankle")
        )
        if min(np.linalg.norm(hip - knee), np.linalg.norm(knee - ankle)) < 1e-9:
            return "its legs have no length"
        if _angle_deg(hip - ankle, UP) > STANDING_LEG_DEG:
            return f"its {side} leg is over {STANDING_LEG_DEG:g} degrees from the vertical"
        if _angle_deg(hip - knee, knee - ankle) > STANDING_KNEE_DEG:
            return f"its {side} knee is bent by over {STANDING_KNEE_DEG:g} degrees"
    left, right = (rest[walker.parts[f"{side}_hip"]] for side in SIDES)
    if abs(_angle_deg(right - left, UP) - 90.0) > STANDING_FOOT_DEG:
        return "its hips are not level"
    for side, foot in zip(SIDES, walker.feet, strict=True):
        slope = _angle_deg(walker.to_y_up @ foot.sole_up, UP) if foot.is_whole else 0.0
        if slope > STANDING_FOOT_DEG:
            return (
                f"its {side} foot is over {STANDING_FOOT_DEG:g} degrees from how it stands on the "
                "ground"
            )
    return ""


def _axes_at_rest(walker: Walker) -> dict[str, FloatArray]:
    rest, turned = walker.rest_positions, walker.to_y_up.T
    right = rest[walker.parts["right_hip"]] - rest[walker.parts["left_hip"]]
    axes = {"pelvis": turned @ _frame(UP, right)}
    for side in SIDES:
        hip, knee, ankle = (
            rest[walker.parts[f"{side}_{part}"]] for part in ("hip", "knee", "ankle")
        )
        axes[f"{side}_thigh"] = turned @ _frame(hip - knee, right)
        axes[f"{side}_shank"] = turned @ _frame(knee - ankle, right)
        axes[f"{side}_foot"] = turned @ _frame(UP, right)
    return axes


def _axes_from_motion(walker: Walker) -> dict[str, FloatArray]:
    live = walker.live.frames
    to_right = (walker.place("right_hip") - walker.place("left_hip"))[live]
    pelvis = walker.turn("hips" if "hips" in walker.turns else "left_hip")[live]
    right = _mean_seen_from(pelvis, to_right)
    up = pelvis[:, 1, :].mean(axis=0)
    axes = {"pelvis": _frame_by_right(up, right)}
    for side in SIDES:
        hip, knee, ankle = (
            walker.place(f"{side}_{part}")[live] for part in ("hip", "knee", "ankle")
        )
        thigh, shank, foot = (
            walker.turn(f"{side}_{part}")[live] for part in ("hip", "knee", "ankle")
        )
        axis = _knee_axis(hip, knee, ankle, to_right)
        axes[f"{side}_thigh"] = _frame(
            _mean_seen_from(thigh, hip - knee), _mean_seen_from(thigh, axis)
        )
        axes[f"{side}_shank"] = _frame(
            _mean_seen_from(shank, knee - ankle), _mean_seen_from(shank, axis)
        )
        sole_up = walker.feet[SIDES.index(side)].sole_up
        axes[f"{side}_foot"] = _frame(sole_up, _mean_seen_from(foot, axis))
    return axes


def _knee_axis(
    hip: FloatArray, knee: FloatArray, ankle: FloatArray, right: FloatArray
) -> FloatArray:
    """Return (F, 3) the axis that a knee bends about, to the right; as long as it is bent.

    The normal of the plane of hip, knee and ankle, which is sure where the knee is well bent; of
    a knee that hardly ever bends, the line of the hips.
    """
    normal = np.cross(knee - ankle, hip - knee)
    lengths = np.linalg.norm(hip - knee, axis=1) * np.linalg.norm(knee - ankle, axis=1)
    normal /= np.maximum(lengths, 1e-12)[:, None]
    bend = np.rad2deg(np.arcsin(np.clip(np.linalg.norm(normal, axis=1), 0.0, 1.0)))
    if np.ptp(bend) < LEAST_BEND_DEG:
        return right
    sides = np.sign(np.einsum("fj,fj->f", normal, right))
    return np.asarray(normal * (sides * (bend > LEAST_BEND_DEG))[:, None])


def _mean_seen_from(turn: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return the mean direction (3,) of vectors (F, 3) as a joint with rotations sees them."""
    mean = np.einsum("fji,fj->fi", turn, vectors).mean(axis=0)
    return np.asarray(mean / max(float(np.linalg.norm(mean)), 1e-12))


def _frame(up: FloatArray, right: FloatArray) -> FloatArray:
    """Return axes (3, 3) with y along `up`, and z as near to `right` as it may be."""
    y = up / np.linalg.norm(up)
    z = right - (right @ y) * y
    z /= np.linalg.norm(z)
    return np.stack([np.cross(y, z), y, z], axis=1)


def _frame_by_right(up: FloatArray, right: FloatArray) -> FloatArray:
    """Return axes (3, 3) with z along `right`, and y as near to `up` as it may be."""
    z = right / np.linalg.norm(right)
    y = up - (up @ z) * z
    y /= np.linalg.norm(y)
    return np.stack([np.cross(y, z), y, z], axis=1)


def _angle_deg(a: FloatArray, b: FloatArray) -> float:
    cosine = a @ b / (np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))))
