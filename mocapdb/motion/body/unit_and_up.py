"""The unit of length and the vertical axis, from posed frames."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.body.findings import Finding
from mocapdb.motion.body.pose_tree import PoseTree
from mocapdb.motion.tuning import (
    AXIS_SPREAD,
    FLOOR_SPREAD,
    FLOOR_WEIGHT,
    REST_WEIGHT,
    STATURE_M,
    STATURE_SPREADS,
    SURELY_STANDS,
    UNIT_COSTS,
)

__all__ = ["UNITS", "find_unit", "find_up"]


class Unit(NamedTuple):
    """A unit of length that files are in."""

    name: str
    metres: float


UNITS = (
    Unit("metres", 1.0),
    Unit("centimetres", 0.01),
    Unit("millimetres", 0.001),
    Unit("inches", 0.0254),
    Unit("decimetres", 0.1),
    Unit("feet", 0.3048),
    Unit("CMU units (inches / 0.45)", 0.0254 / 0.45),
)
AXES: tuple[Literal["y", "z"], ...] = ("y", "z")


def find_unit(height: float, of_what: str, *, is_human: bool = True) -> Finding[float]:
    """Return the metres in a unit: that which gives the most usual stature.

    Parameters
    ----------
    height : float, skeleton units
        The body's stature, or what comes nearest to it.
    of_what : str
        What that height is, for the evidence.
    is_human : bool
        Whether it is a human's. Of anything else it tells little: then the unit is assumed.
    """
    if not 0 < height < math.inf:
        return Finding(1.0, "metres assumed: the body has no height", 0.0, "assumed")
    away = [math.log(height * unit.metres / STATURE_M) for unit in UNITS]
    costs = [
        (size / STATURE_SPREADS[size > 0]) ** 2 / 2 + UNIT_COSTS[unit.name.split()[0]]
        for size, unit in zip(away, UNITS, strict=True)
    ]
    best = int(np.argmin(costs))
    weights = np.exp(min(costs) - np.array(costs))
    unit = UNITS[best]
    then = f"{of_what} is then {height * unit.metres:.3g} m"
    if not is_human:
        return Finding(unit.metres, f"unit {unit.name} assumed: {then}", 0.0, "assumed")
    return Finding(
        unit.metres,
        f"unit {unit.name} inferred: {then}",
        float(weights[best] / weights.sum()),
    )


def find_up(
    tree: PoseTree, clips: Sequence[FloatArray], rest: PoseTree, nodes: Mapping[str, int]
) -> Finding[Literal["y", "z"]]:
    """Return the vertical axis: the one that the head is above the feet along, over the motion.

    Above the root where there are no feet; where there is no head the body is taller than deep.

    Frames in which it lies or hangs vote for other axes, so its rest pose counts for a little,
    and so does the floor: along the vertical what is lowest stays about as low, and near zero.
    Several clips (F, N, 3) share a floor; each axis has the vote of the clip that stands along it
    most, so that those who lie do not outvote one who stands.
    """
    if "head" not in nodes:
        return _up_of_extents(tree)
    feet = [nodes[f"{side}_ankle"] for side in SIDES if f"{side}_ankle" in nodes]
    rises = [_rise(positions, feet or [0], nodes["head"]) for positions in clips]
    votes = np.max([rise.mean(axis=0) for rise in rises], axis=0)
    resting = _rise(rest.positions, feet or [0], nodes["head"]).mean(axis=0)
    scores = {
        axis: float(votes[i] + REST_WEIGHT * max(resting[i], 0.0) + FLOOR_WEIGHT * floor)
        for axis, i, floor in zip(AXES, (1, 2), _floors(clips, tree.extent), strict=True)
    }
    up = max(AXES, key=lambda axis: scores[axis])
    lead = scores[up] - min(scores.values())
    confidence = float(1 / (1 + math.exp(-lead / AXIS_SPREAD)))
    below = "feet" if feet else "root"
    together = np.concatenate(rises)
    rise = together.mean(axis=0)
    stands = together[:, "xyz".index(up)] > 0.5
    both = np.where(np.abs(rise) < np.abs(resting), rise, resting) * (rise * resting > 0)
    other = _other_direction(both)  # at rest too: then it does not only lie or hang
    if other:
        confidence = 0.1
    elif not stands.any():
        other = _other_direction(rise)
    if other:
        return Finding(
            up,
            f"warning: up axis {up} assumed, but the head is above the {below} along {other}. If "
            f"that is up, say so: --up {other}",
            confidence,
            "assumed",
        )
    if not stands.any():
        evidence = f"up axis {up} assumed: the head is above the {below} along it in no frame"
        return Finding(up, evidence, confidence, "assumed")
    return Finding(
        up,
        f"up axis {up} inferred: the head is above the {below} along it "
        f"in {stands.mean():.0%} of the frames",
        confidence,
    )


def _other_direction(rise: FloatArray) -> str:
    """Return the direction other than y and z that a body stands along; empty without one."""
    for i, axis in enumerate("xyz"):
        for sign, name in ((1.0, axis), (-1.0, f"-{axis}")):
            if name not in AXES and sign * rise[i] > SURELY_STANDS:
                return name
    return ""


def _rise(positions: FloatArray, feet: list[int], head: int) -> FloatArray:
    """Return (F, 3) the direction from the middle of some nodes to the head."""
    rise = positions[:, head] - positions[:, feet].mean(axis=1)
    return np.asarray(rise / np.maximum(np.linalg.norm(rise, axis=1, keepdims=True), 1e-12))


def _floors(clips: Sequence[FloatArray], extent: float) -> list[float]:
    """Return for y and z how much the lowest points look like standing on a floor, up to 1."""
    found = []
    for axis in (1, 2):
        lowest = [positions[:, :, axis].min(axis=1) for positions in clips]
        levels = [np.median(each) for each in lowest]
        low, high = np.percentile(levels, (5, 95))
        wander = float(np.median([np.ptp(each) for each in lowest])) + float(high - low)
        away = (abs(float(np.median(levels))) + wander) / max(extent, 1e-12)
        found.append(math.exp(-away / FLOOR_SPREAD))
    return found


def _up_of_extents(tree: PoseTree) -> Finding[Literal["y", "z"]]:
    """Return the axis along which a body without a head or feet is taller."""
    extent = np.median(np.ptp(tree.positions, axis=1), axis=0)
    up: Literal["y", "z"] = "y" if extent[1] >= extent[2] else "z"
    return Finding(
        up,
        f"up axis {up} assumed: the body extends {extent[1]:.4g} along y and {extent[2]:.4g} "
        "along z, and has no head",
        0.5,
        "assumed",
    )
