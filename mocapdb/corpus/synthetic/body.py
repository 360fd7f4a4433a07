"""Bodies: skeletons of the CMU topology with proportions from anthropometry.

Segment lengths are fractions of stature after Drillis and Contini (1966), as tabulated by Winter,
*Biomechanics and Motor Control of Human Movement*, figure 4.1. The topology (31 joints, 62
channels, Acclaim convention) is that of the CMU motion capture database, the lengths and
directions are not.

The local frames are simple: every limb lies along -y of its own frame, x is the axis about which
knees and elbows bend. A leg's channels are then flexion (rx), turning (ry) and spreading (rz), and
an arm's are flexion (rx), turning (ry) and adduction from the T-pose (rz).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.corpus.tuning import PROPORTION_RANGE, PROPORTION_SD, STATURE_M, STATURE_RANGE_M
from mocapdb.errors import SkeletonError
from mocapdb.motion.kinematics import axis_rotations
from mocapdb.motion.skeleton import Skeleton

__all__ = ["CMU_METRES_PER_UNIT", "Dimensions", "make_skeleton", "measure", "subject"]

CMU_METRES_PER_UNIT = 0.0254 / 0.45
REFERENCE_HEIGHT_M = 1.75
LEG_SPLAY_DEG = 15.0  # of the rest pose
HIP_DROP = 0.030  # from the root to the hip joints, down and forwards
HIP_FORWARD = 0.030
HEEL_BACK = 0.038  # from the ankle to the back of the heel
CLAVICLE_RISE = 0.033

THIGH, SHANK, ANKLE_HEIGHT = 0.245, 0.246, 0.039
ANKLE_TO_BALL, BALL_TO_TIP = 0.071, 0.043  # with the heel a foot of 0.152
HALF_SHOULDERS, UPPER_ARM, FOREARM, HAND = 0.129, 0.186, 0.146, 0.108
SPINE = {
    "lowerback": 0.075,
    "upperback": 0.075,
    "thorax": 0.075,
    "lowerneck": 0.050,
    "upperneck": 0.050,
    "head": 0.115,
}


class _Bone(NamedTuple):
    """A bone as fractions of stature, for the left side or the middle of the body."""

    name: str
    parent: str
    offset: tuple[float, float, float]
    axis_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    dofs: str = ""

    def mirrored(self) -> _Bone:
        """Return the same bone on the right: the mirror image in the plane x = 0."""
        x, y, z = self.offset
        a, b, c = self.axis_deg
        return _Bone(
            "r" + self.name[1:],
            "r" + self.parent[1:] if self.parent[0] == "l" else self.parent,
            (-x, y, z),
            (a, -b, -c),
            self.dofs,
        )


@dataclass(frozen=True)
class Dimensions:
    """What the motion generators need to know of a body, in metres.

    Attributes
    ----------
    height, thigh, shank, ankle_height : float
        Stature and lengths of the leg.
    ball_forward, heel_back, toe : float
        From the ankle to the ball of the foot and to the heel, and from the ball to the tip.
    left_hip : (float, float, float)
        The left hip joint relative to the root.
    """

    height: float
    thigh: float
    shank: float
    ankle_height: float
    ball_forward: float
    heel_back: float
    toe: float
    left_hip: tuple[float, float, float]

    @property
    def hips(self) -> FloatArray:
        """(2, 3) left and right hip joint relative to the root."""
        return np.array([self.left_hip, self.left_hip]) * [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]

    @property
    def size(self) -> float:
        """Stature relative to the body that times and ways are stated for."""
        return self.height / REFERENCE_HEIGHT_M

    @property
    def leg(self) -> float:
        """Length of thigh and shank."""
        return self.thigh + self.shank

    @property
    def sole(self) -> float:
        """Length from the heel to the ball of the foot."""
        return self.heel_back + self.ball_forward

    @property
    def standing(self) -> float:
        """Height of the root above the ground with straight legs."""
        return self.leg + self.ankle_height - self.left_hip[1]


def make_skeleton(
    height_m: float = REFERENCE_HEIGHT_M,
    *,
    leg: float = 1.0,
    arm: float = 1.0,
    shoulder: float = 1.0,
    name: str = "synthetic",
) -> Skeleton:
    """Return a body of that height on the CMU topology.

    Parameters
    ----------
    height_m : float, metres
        Stature; equals ``skeleton.height * skeleton.metres_per_unit``.
    leg, arm, shoulder : float
        Length of the legs and arms and breadth of the shoulders, relative to the average body of
        that stature. With longer legs the trunk is shorter.
    name : str
        Name of the skeleton.

    Returns
    -------
    Skeleton
        31 joints and 62 channels, Acclaim convention, in CMU's unit of 0.0254 / 0.45 m.

    Raises
    ------
    SkeletonError
        If a length is not positive.

    Examples
    --------
    >>> skeleton = make_skeleton(1.62, leg=1.05)
    >>> round(skeleton.height * skeleton.metres_per_unit, 6)
    1.62
    """
    for what, value in {
        "height_m": height_m, "leg": leg, "arm": arm, "shoulder": shoulder
    }.items():  # fmt: skip
        if not (math.isfinite(value) and value > 0):
            raise SkeletonError(f"Expected {what} to be positive, but got {value}.")
    bones = _bones(leg, arm, shoulder)
    names = ["root", *(bone.name for bone in bones)]
    dofs = [("tx", "ty", "tz", "rx", "ry", "rz"), *(tuple(bone.dofs.split()) for bone in bones)]
    fractions = np.array([(0.0, 0.0, 0.0), *(bone.offset for bone in bones)])

    def build(offsets: FloatArray) -> Skeleton:
        return Skeleton(
            names,
            [-1, *(names.index(bone.parent) for bone in bones)],
            offsets,
            dofs,
            ["".join(dof[1].upper() for dof in reversed(joint) if dof[0] == "r") for joint in dofs],
            axis_deg=[(0.0, 0.0, 0.0), *(bone.axis_deg for bone in bones)],
            convention="acclaim",
            metres_per_unit=CMU_METRES_PER_UNIT,
            name=name,
        )

    return build(fractions * (height_m / CMU_METRES_PER_UNIT / build(fractions).height))


def subject(seed: int) -> Skeleton:
    """Return the body of a person drawn at random, always the same for the same seed.

    Stature is normal around 1.71 m with a standard deviation of 0.09 m, and proportions vary by
    three per cent.
    """
    rng = np.random.default_rng(seed)
    height_m = float(np.clip(rng.normal(*STATURE_M), *STATURE_RANGE_M))
    leg, arm, shoulder = np.clip(rng.normal(1.0, PROPORTION_SD, 3), *PROPORTION_RANGE)
    return make_skeleton(
        height_m, leg=float(leg), arm=float(arm), shoulder=float(shoulder), name=f"subject{seed}"
    )


@lru_cache(maxsize=64)
def measure(skeleton: Skeleton) -> Dimensions:
    """Return the dimensions of a body that `make_skeleton` built.

    Raises
    ------
    SkeletonError
        If a joint of the CMU topology is missing.
    """
    offsets_m = skeleton.offsets * skeleton.metres_per_unit
    femur, tibia, foot, toes = (
        skeleton.joint(name) for name in ("lfemur", "ltibia", "lfoot", "ltoes")
    )
    foot_m = axis_rotations(skeleton)[femur].T @ offsets_m[foot]
    height_m = skeleton.height * skeleton.metres_per_unit
    x, y, z = offsets_m[skeleton.joint("lhipjoint")].tolist()
    return Dimensions(
        height=height_m,
        thigh=float(np.linalg.norm(offsets_m[femur])),
        shank=float(np.linalg.norm(offsets_m[tibia])),
        ankle_height=float(-foot_m[1]),
        ball_forward=float(foot_m[2]),
        heel_back=HEEL_BACK * height_m,
        toe=float(np.linalg.norm(offsets_m[toes])),
        left_hip=(x, y, z),
    )


def _bones(leg: float, arm: float, shoulder: float) -> list[_Bone]:
    """Return the 30 bones in CMU's order, as fractions of (nearly) the stature."""
    spine = [
        _Bone(name, parent, (0.0, length, 0.0), dofs="rx ry rz")
        for (name, length), parent in zip(SPINE.items(), ["root", *SPINE], strict=False)
    ]
    left_leg, left_arm = _left_leg(leg), _left_arm(arm, shoulder)
    return [
        *left_leg,
        *(bone.mirrored() for bone in left_leg),
        *spine,
        *left_arm,
        *(bone.mirrored() for bone in left_arm),
    ]


def _left_leg(leg: float) -> list[_Bone]:
    # hip joints as wide apart as makes the average body's leg, spine and head add up to one
    hip_joint = 1.0 - THIGH - SHANK - sum(SPINE.values())
    half_width = math.sqrt(hip_joint**2 - HIP_DROP**2 - HIP_FORWARD**2)
    splay = math.radians(LEG_SPLAY_DEG)

    def below(down: float, forward: float) -> tuple[float, float, float]:
        return math.sin(splay) * down, -math.cos(splay) * down, forward

    along, across = (0.0, 0.0, LEG_SPLAY_DEG), (-90.0, 0.0, LEG_SPLAY_DEG)
    return [
        _Bone("lhipjoint", "root", (half_width, -HIP_DROP, HIP_FORWARD)),
        _Bone("lfemur", "lhipjoint", below(leg * THIGH, 0.0), along, "rx ry rz"),
        _Bone("ltibia", "lfemur", below(leg * SHANK, 0.0), along, "rx"),
        _Bone("lfoot", "ltibia", below(ANKLE_HEIGHT, ANKLE_TO_BALL), across, "rx rz"),
        _Bone("ltoes", "lfoot", below(0.0, BALL_TO_TIP), across, "rx"),
    ]


def _left_arm(arm: float, shoulder: float) -> list[_Bone]:
    along = (180.0, 0.0, -90.0)
    thumb = 0.4 * arm * HAND / math.sqrt(2.0)
    return [
        _Bone("lclavicle", "thorax", (shoulder * HALF_SHOULDERS, CLAVICLE_RISE, 0.0), dofs="ry rz"),
        _Bone("lhumerus", "lclavicle", (arm * UPPER_ARM, 0.0, 0.0), along, "rx ry rz"),
        _Bone("lradius", "lhumerus", (0.6 * arm * FOREARM, 0.0, 0.0), along, "rx"),
        _Bone("lwrist", "lradius", (0.4 * arm * FOREARM, 0.0, 0.0), along, "ry"),
        _Bone("lhand", "lwrist", (0.5 * arm * HAND, 0.0, 0.0), along, "rx rz"),
        _Bone("lfingers", "lhand", (0.5 * arm * HAND, 0.0, 0.0), along, "rx"),
        _Bone("lthumb", "lwrist", (thumb, 0.0, thumb), (-90.0, 45.0, 0.0), "rx rz"),
    ]
