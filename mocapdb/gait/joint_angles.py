"""Joint angles in anatomical terms: flexion, abduction and rotation, in degrees.

Of the joint coordinate system of Grood and Suntay (J. Biomechanical Engineering 105, 1983), which
the ISB recommends: flexion about the z axis of the upper segment, rotation about the y axis of the
lower one, and abduction about the line across both. That is the order of turns z, x, y.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.gait.calibration import Calibration
from mocapdb.gait.feet import UP, Walker
from mocapdb.motion.body.canonical_joints import SIDES

__all__ = ["ANGLES", "joint_angles", "over_stride"]

ANGLES = {
    ("pelvis", "tilt"): "top forwards",
    ("pelvis", "obliquity"): "own side up",
    ("pelvis", "rotation"): "own side forwards",
    ("trunk", "flexion"): "forwards",
    ("trunk", "lean"): "to the own side",
    ("trunk", "rotation"): "own shoulder forwards of the pelvis",
    ("hip", "flexion"): "thigh forwards",
    ("hip", "abduction"): "thigh outwards",
    ("hip", "rotation"): "inwards",
    ("knee", "flexion"): "shank backwards",
    ("knee", "abduction"): "shank outwards",
    ("knee", "rotation"): "inwards",
    ("ankle", "flexion"): "dorsiflexion, toes up",
    ("ankle", "abduction"): "eversion, sole outwards",
    ("ankle", "rotation"): "toes inwards",
    ("shoulder", "flexion"): "arm forwards",
    ("shoulder", "abduction"): "arm outwards",
    ("elbow", "flexion"): "forearm bent",
}
"""The angles of each side, and which way is positive."""


def joint_angles(
    walker: Walker, calibration: Calibration
) -> dict[str, dict[tuple[str, str], FloatArray]]:
    """Return (F,) degrees of each angle, by side, then by joint and angle.

    Parameters
    ----------
    walker : Walker
    calibration : Calibration

    Notes
    -----
    Pelvis and trunk are seen from the way that the body goes, or faces where it goes nowhere.
    Joints that a body has not are left out.
    """
    pelvis = _world(walker, calibration, "pelvis", "hips" if "hips" in walker.turns else "left_hip")
    lab = _lab(walker, pelvis)
    thorax = _thorax(walker)
    both: dict[str, dict[tuple[str, str], FloatArray]] = {}
    for side in SIDES:
        sign = 1.0 if side == "right" else -1.0
        found: dict[tuple[str, str], FloatArray] = {}
        tilt, list_, turn = _cardan_deg(lab, pelvis)
        found["pelvis", "tilt"] = -tilt
        found["pelvis", "obliquity"] = -sign * list_
        found["pelvis", "rotation"] = sign * turn
        if thorax is not None:
            flexion, lean, _ = _cardan_deg(lab, thorax)
            found["trunk", "flexion"] = -flexion
            found["trunk", "lean"] = sign * lean
            found["trunk", "rotation"] = sign * _cardan_deg(pelvis, thorax)[2]
        thigh, shank, foot = (
            _world(walker, calibration, f"{side}_{segment}", f"{side}_{joint}")
            for segment, joint in (("thigh", "hip"), ("shank", "knee"), ("foot", "ankle"))
        )
        for joint, upper, lower, bends in (
            ("hip", pelvis, thigh, 1.0), ("knee", thigh, shank, -1.0), ("ankle", shank, foot, 1.0)
        ):  # fmt: skip
            flexion, adduction, inwards = _cardan_deg(upper, lower)
            found[joint, "flexion"] = bends * flexion
            found[joint, "abduction"] = -sign * adduction
            found[joint, "rotation"] = sign * inwards
        if not walker.feet[SIDES.index(side)].is_whole:
            found = {key: values for key, values in found.items() if key[0] != "ankle"}
        if thorax is not None:
            found |= _arm_angles(walker, thorax, side, sign)
        both[side] = found
    return both


def over_stride(values: FloatArray, start: float, end: float) -> FloatArray:
    """Return (101,) values at 0 to 100 % of the frames from `start` to `end`.

    Examples
    --------
    >>> over_stride(np.arange(10.0), 2.0, 4.0)[[0, 50, 100]].tolist()
    [2.0, 3.0, 4.0]
    """
    return np.interp(np.linspace(start, end, 101), np.arange(len(values)), values)


def _cardan_deg(upper: FloatArray, lower: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (F,) the turns about z, x and y that lead from axes (F, 3, 3) to others."""
    turn = np.swapaxes(upper, 1, 2) @ lower
    about_z = np.unwrap(np.arctan2(-turn[:, 0, 1], turn[:, 1, 1]))
    about_x = np.arcsin(np.clip(turn[:, 2, 1], -1.0, 1.0))
    about_y = np.unwrap(np.arctan2(-turn[:, 2, 0], turn[:, 2, 2]))
    z, x, y = (np.rad2deg(angle) for angle in (about_z, about_x, about_y))
    return _near_zero(z), x, _near_zero(y)


def _near_zero(angles_deg: FloatArray) -> FloatArray:
    """Return angles by whole turns nearer to zero, the same for all frames."""
    return angles_deg - 360.0 * np.round(np.median(angles_deg) / 360.0)


def _world(walker: Walker, calibration: Calibration, segment: str, joint: str) -> FloatArray:
    """Return the axes (F, 3, 3) of a segment in the world."""
    return walker.turn(joint) @ calibration.axes[segment]


def _lab(walker: Walker, pelvis: FloatArray) -> FloatArray:
    """Return axes (F, 3, 3) along the way that the body goes, level; as it faces if it stands."""
    hips = walker.hips * [1.0, 0.0, 1.0]
    reach = max(1, round(walker.fps / 2))
    frames = np.arange(len(hips))
    after, before = np.minimum(frames + reach, frames[-1]), np.maximum(frames - reach, 0)
    way = hips[after] - hips[before]
    faced = pelvis[:, :, 0] * [1.0, 0.0, 1.0]
    slow = np.linalg.norm(way, axis=1) < 0.25 * walker.leg_m
    backwards = np.einsum("fj,fj->f", way, faced) < 0
    ahead = np.where(slow[:, None], faced, np.where(backwards[:, None], -way, way))
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
    up = np.broadcast_to(UP, ahead.shape)
    return np.stack([ahead, up, np.cross(ahead, up)], axis=-1)


def _thorax(walker: Walker) -> FloatArray | None:
    """Return the axes (F, 3, 3) of the trunk: up from the hips to the shoulders, z along these."""
    if not {"left_shoulder", "right_shoulder"} <= walker.parts.keys():
        return None
    left, right = (walker.place(f"{side}_shoulder") for side in SIDES)
    hips = (walker.place("left_hip") + walker.place("right_hip")) / 2
    y = _unit((left + right) / 2 - hips)
    z = right - left
    z = _unit(z - np.einsum("fj,fj->f", z, y)[:, None] * y)
    return np.stack([np.cross(y, z), y, z], axis=-1)


def _arm_angles(
    walker: Walker, thorax: FloatArray, side: str, sign: float
) -> Mapping[tuple[str, str], FloatArray]:
    """Return flexion and abduction of a shoulder, and flexion of an elbow."""
    parts = [f"{side}_{part}" for part in ("shoulder", "elbow", "wrist")]
    if not set(parts) <= walker.parts.keys():
        return {}
    shoulder, elbow, wrist = map(walker.place, parts)
    arm = np.einsum("fji,fj->fi", thorax, _unit(elbow - shoulder))
    bend = np.einsum("fj,fj->f", _unit(elbow - shoulder), _unit(wrist - elbow))
    return {
        ("shoulder", "flexion"): np.rad2deg(np.arctan2(arm[:, 0], -arm[:, 1])),
        ("shoulder", "abduction"): np.rad2deg(np.arcsin(np.clip(sign * arm[:, 2], -1.0, 1.0))),
        ("elbow", "flexion"): np.rad2deg(np.arccos(np.clip(bend, -1.0, 1.0))),
    }


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))
