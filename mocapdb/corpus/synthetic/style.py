"""How somebody moves, and the angles of the upper body by what they mean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mocapdb.base.arrays import FloatArray
from mocapdb.corpus.tuning import HAND_SD_DEG, POSTURE_DEG, POSTURE_SD_DEG, STYLE_RANGE, STYLE_SD

__all__ = ["Style", "arm", "draw_style", "neck", "rest_pose", "spine"]

Angles = dict[str, FloatArray]
SPINE = ("lowerback", "upperback", "thorax")
NECK = ("lowerneck", "upperneck", "head")
# slight bends that nobody is without
RELAXED_DEG = {
    "hand.rx": 8.0,
    "hand.rz": 0.0,
    "wrist.ry": 10.0,
    "fingers.rx": 15.0,
    "thumb.rx": 5.0,
    "thumb.rz": 10.0,
    "clavicle.ry": 0.0,
    "clavicle.rz": 0.0,
}


@dataclass(frozen=True)
class Style:
    """What one performance has of its own.

    Attributes
    ----------
    vigour, arm_swing, tempo, track : float
        Factors on amplitudes, on the swing of the arms, on the natural period, on the distance
        between the feet.
    lean_deg, elbow_deg, abduction_deg, toe_out_deg : float
        Lean of the trunk, bend of the elbows beyond the usual, arms and toes turned out.
    posture : dict of str to float
        Constant offsets of wrists, hands and clavicles, in degrees.
    """

    vigour: float
    arm_swing: float
    tempo: float
    track: float
    lean_deg: float
    elbow_deg: float
    abduction_deg: float
    toe_out_deg: float
    posture: dict[str, float]


def draw_style(rng: np.random.Generator) -> Style:
    """Draw how a performance is done."""
    vigour, arm_swing, tempo, track = np.clip(rng.normal(1.0, STYLE_SD), *STYLE_RANGE)
    lean, elbow, abduction, toe_out = rng.normal(POSTURE_DEG, POSTURE_SD_DEG)
    offsets = rng.normal(0.0, HAND_SD_DEG, 2 * len(RELAXED_DEG))
    names = [letter + name for letter in "lr" for name in RELAXED_DEG]
    return Style(
        vigour=float(vigour),
        arm_swing=float(arm_swing),
        tempo=float(tempo),
        track=float(track),
        lean_deg=float(lean),
        elbow_deg=float(elbow),
        abduction_deg=float(abduction),
        toe_out_deg=float(toe_out),
        posture=dict(zip(names, offsets.tolist(), strict=True)),
    )


def rest_pose(n_frames: int, style: Style) -> Angles:
    """Return the angles of clavicles, wrists and hands, which hardly move."""
    angles = {}
    for letter, mirror in (("l", 1.0), ("r", -1.0)):
        for name, relaxed in RELAXED_DEG.items():
            sign = 1.0 if name.endswith("rx") else mirror  # turns about x look the same mirrored
            value = sign * relaxed + style.posture[letter + name]
            angles[letter + name] = np.full(n_frames, value)
    return angles


def spine(lean: FloatArray, turn: FloatArray, bend: FloatArray) -> Angles:
    """Return the back's angles: forwards, to the left and to the right, in equal parts."""
    return _column(SPINE, lean, turn, bend)


def neck(nod: FloatArray, turn: FloatArray, bend: FloatArray) -> Angles:
    """Return the neck's angles: forwards, to the left and to the right, in equal parts."""
    return _column(NECK, nod, turn, bend)


def arm(
    side: str,
    *,
    flexion: ArrayLike,
    inward: ArrayLike,
    abduction: ArrayLike,
    elbow: ArrayLike,
) -> Angles:
    """Return an arm's angles: all zero is hanging down.

    Parameters
    ----------
    side : {"l", "r"}
    flexion : (F,) degrees
        Upper arm forwards, then
    inward : (F,) degrees
        turned about the vertical towards the middle, then
    abduction : (F,) degrees
        lifted to the side.
    elbow : (F,) degrees
        Flexion.
    """
    mirror = 1.0 if side == "l" else -1.0
    return {
        f"{side}humerus.rx": np.asarray(flexion),
        f"{side}humerus.ry": -mirror * np.asarray(inward),
        f"{side}humerus.rz": mirror * (90.0 - np.asarray(abduction)),
        f"{side}radius.rx": np.asarray(elbow),
    }


def _column(
    joints: tuple[str, ...], forwards: FloatArray, turn: FloatArray, bend: FloatArray
) -> Angles:
    return {
        f"{joint}.{dof}": angle / len(joints)
        for joint in joints
        for dof, angle in (("rx", forwards), ("ry", turn), ("rz", bend))
    }
