"""Which joint of each file of the zoo is which: written down by hand, for tests and benchmarks.

Of the trunk only the head is named: between hips and neck programs have from one to six joints.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics, to_metres

LIMBS = ("hip", "knee", "ankle", "toe", "shoulder", "elbow", "wrist")

_LONG = "{}UpLeg {}Leg {}Foot {}ToeBase {}Arm {}ForeArm {}Hand"
_MIXAMO = " ".join(f"mixamorig:{name}" for name in _LONG.split())
_POSER = "{}Thigh {}Shin {}Foot {}Foot_End {}Shldr {}ForeArm {}Hand"
_CASE = "{}_thigh {}_shin {}_foot {}_toe {}_arm {}_fore {}_hand"
_CASE_WITHOUT_TOES = _CASE.replace("_toe", "_foot_End")

_FAMILIES = {
    "20tab": ("mixamorig:Head", "Left Right", _MIXAMO),
    "PeizhuoLi-ganimator__Gangnam": ("mixamorig:Head", "Left Right", _MIXAMO),
    "PeizhuoLi-ganimator__Baseball": ("Head", "Left Right", _LONG),
    "DeepMotionEditing": ("Head", "Left Right", _LONG),
    "facebookresearch": ("Head", "Left Right", _LONG),
    "orangeduck": ("Head", "Left Right", _LONG),
    "Enekoassets": ("Head", "Left Right", _LONG.replace("ToeBase", "Toe")),
    "VictorS-67-pybvh__bvh_test3": ("Head", "Left Right", _LONG.replace("ToeBase", "ForeFoot")),
    "KevinLTT": ("Neck1", "Left Right", _LONG.replace("ToeBase", "Foot_End")),
    "Nehon": (
        "Head",
        "Left Right",
        "{}Hip {}Knee {}Ankle {}Ankle_End {}Shoulder {}Elbow {}Wrist",
    ),
    "SheffieldML": ("head", "l r", "{}femur {}tibia {}foot {}toes {}humerus {}radius {}hand"),
    "FORTH-ModelBasedTracker-MocapNET__header": ("head", "l r", _POSER),
    "tapple": ("head", "l r", _POSER),
    "furylynx": (
        "HEAD",
        "LEFT RIGHT",
        "{}_HIP# {}_KNEE {}_FOOT {}_FOOT_End {}_SHOULDER# {}_ELBOW {}_HAND",
    ),
    "makehumancommunity-makehuman__walk1": (
        "Head",
        "L R",
        "UpLeg_{} LoLeg_{} Foot_{} Toe_{} UpArm_{} LoArm_{} Hand_{}",
    ),
    "makehumancommunity-makehuman__benchmark": (
        "head",
        "L R",
        "upperleg01.{} lowerleg01.{} foot.{} toe1-1.{} upperarm01.{} lowerarm01.{} wrist.{}",
    ),
    "omimo": ("head", "L R", "{}_Femur {}_Tibia {}_Foot {}_Toe {}_Humerus {}_Elbow {}_Wrist"),
    "dataset-": (
        "Head",
        "L R",
        "UpperLeg_{} LowerLeg_{} Foot_{} Toes_{} UpperArm_{} LowerArm_{} Hand_{}",
    ),
    "H_toe": ("head", "l r", _CASE),
    "A3_zero": ("head", "l r", _CASE),
    "K1_": ("head", "l r", _CASE),
    "K2_": ("head", "l r", _CASE),
    "L_near": ("head", "l r", _CASE),
    "B1_": ("head", "l r", _CASE_WITHOUT_TOES),
    "C_": ("head", "l r", _CASE_WITHOUT_TOES),
}
"""By the beginning of a file's name: the head, both sides' words, and limbs; {} is the side."""

NOT_HUMAN = ("Anytop", "FORTH-ModelBasedTracker-MocapNET__lhand", "PeizhuoLi-ganimator__Crab")
"""Beginnings of the names of files of other bodies."""

CASES = {
    "A1_bones_along_x_cm": ("y", 0.01, 1.66),
    "A3_zero_offsets_absolute_positions": ("y", 0.01, 1.78),
    "B1_yrest_zworld": ("z", 0.01, 1.78),
    "H_toe_tip_zero_end_site": ("y", 0.01, 1.78),
    "K1_positions_absolute": ("y", 0.01, 1.78),
    "K2_positions_are_displacements": ("y", 0.01, 1.78),
    "L_near_zero_positions": ("y", 0.01, 1.78),
}
"""Up axis, unit and vertical extent, in metres, of the cases that state them."""


def names_of(path: Path) -> dict[str, str] | None:
    """Return the joints of a file by canonical joint; None where it is in no table."""
    for beginning, (head, sides, limbs) in _FAMILIES.items():
        if path.name.startswith(beginning):
            names = {"head": head}
            for side, said in zip(("left", "right"), sides.split(), strict=True):
                for limb, name in zip(LIMBS, limbs.split(), strict=True):
                    names[f"{side}_{limb}"] = name.format(said)
            return names
    return None


def extent_m(clip: Clip) -> float:
    """Return the median vertical extent of the joints; a first one that never moves left out."""
    skeleton = clip.skeleton
    positions = to_metres(skeleton, forward_kinematics(skeleton, clip.channels).positions)
    still = not np.ptp(positions[:, 0], axis=0).any()
    first = 1 if still and len(clip) > 1 and len(skeleton.children[0]) == 1 else 0
    return float(np.median(np.ptp(positions[:, first:, 1], axis=1)))


def zoo_rows(zoo: Path) -> list[dict[str, str]]:
    """Return the rows of ``ZOO.csv``."""
    with (zoo / "ZOO.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


LAPS = {
    "dataset-1_dash_active_001": 3.05,
    "dataset-1_dash_old_001": 5.0,
    "dataset-1_run_active_001": 2.55,
    "dataset-1_run_old_001": 5.05,
    "dataset-1_walk_active_001": 4.55,
    "dataset-1_walk_normal_001": 6.0,
    "dataset-1_walk_old_001": 8.0,
    "dataset-2_run_feminine_001": 4.35,
    "dataset-2_run_feminine_002": 4.15,
    "dataset-2_run_normal_001": 3.1,
    "dataset-2_run_normal_002": 3.35,
    "dataset-2_walk_feminine_001": 7.3,
    "dataset-2_walk_feminine_002": 7.5,
    "dataset-2_walk_normal_001": 8.0,
    "dataset-2_walk_normal_002": 7.85,
}
"""Laps of Bandai's straight walks and runs, read from a plot of the heights of both feet: frames
of the clip by frames from one strike of a foot to its next, on average."""

TOO_SHORT = {"dataset-1_dash_normal_001": 1.05, "dataset-1_run_normal_001": 1.1}
"""Laps of those that are not long enough for a cycle: hardly a pose of them comes twice."""
