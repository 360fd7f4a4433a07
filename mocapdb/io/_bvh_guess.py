"""What a BVH does not state: its vertical axis and its unit of length."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.motion.skeleton import Skeleton, UpAxis

__all__ = ["guess_scale", "guess_up"]


class _Unit(NamedTuple):
    name: str
    metres: float


UNITS = (
    _Unit("metres", 1.0),
    _Unit("centimetres", 0.01),
    _Unit("millimetres", 0.001),
    _Unit("inches", 0.0254),
    _Unit("CMU units (inches / 0.45)", 0.0254 / 0.45),
)
USUAL_HEIGHT_M = 1.7
DECISIVE_COSINE = 0.8
MOTION_SAMPLES = 16


def guess_up(skeleton: Skeleton, channels: FloatArray) -> tuple[UpAxis, str]:
    """Return the vertical axis and the evidence for it.

    The head is above the hips: in the rest pose, or else, where the rest pose points elsewhere,
    in the middle of the motion. A skeleton without a head is taller than it is deep.
    """
    head = _head(skeleton)
    if head is not None:
        name = skeleton.names[head]
        up = _vertical(skeleton.rest_positions[head])
        if up is not None:
            return up, f"up axis {up} inferred: {name!r} is above the root in the rest pose"
        up = _vertical(_median_rise(skeleton, channels, head))
        if up is not None:
            return up, f"up axis {up} inferred: {name!r} is above the root in the motion"
    _, depth_y, depth_z = np.ptp(skeleton.rest_positions, axis=0)
    up = "y" if depth_y >= depth_z else "z"
    return up, (
        f"up axis {up} inferred: the rest pose extends {depth_y:.4g} along y "
        f"and {depth_z:.4g} along z"
    )


def guess_scale(skeleton: Skeleton, up: UpAxis) -> tuple[float, str]:
    """Return the metres in a unit and the evidence: which unit gives the most usual height."""
    height = float(np.ptp(skeleton.rest_positions[:, "xyz".index(up)]))
    if height <= 0:
        return 1.0, "unit metres assumed: the rest pose has no height"
    unit = min(UNITS, key=lambda unit: abs(math.log(height * unit.metres / USUAL_HEIGHT_M)))
    return unit.metres, (
        f"unit {unit.name} inferred: the rest pose is then {height * unit.metres:.2f} m high"
    )


def _head(skeleton: Skeleton) -> int | None:
    """Return the first joint that is called a head, if any."""
    heads = (i for i, name in enumerate(skeleton.names) if "head" in name.lower())
    return next(heads, None)


def _vertical(rise: FloatArray) -> UpAxis | None:
    """Return the axis that a vector points along, unless it points elsewhere."""
    length = float(np.linalg.norm(rise))
    if rise[1] > DECISIVE_COSINE * length:
        return "y"
    if rise[2] > DECISIVE_COSINE * length:
        return "z"
    return None


def _median_rise(skeleton: Skeleton, channels: FloatArray, head: int) -> FloatArray:
    """Return the vector from the root to the head, the median over some frames."""
    from mocapdb.motion.kinematics import forward_kinematics

    step = -(-len(channels) // MOTION_SAMPLES)
    positions = forward_kinematics(skeleton, channels[::step]).positions
    return np.asarray(np.median(positions[:, head] - positions[:, 0], axis=0))
