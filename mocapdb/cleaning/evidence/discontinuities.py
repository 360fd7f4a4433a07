"""Discontinuities: where a joint jumps as no body does.

A boundary lies between two frames. A joint's *jump* there is how far its step differs from the
steps beside it, the nearer of the two: zero in steady rotation, small in any smooth motion, and
the whole size of the error at either edge of an offset, a flip or noise, or where a drift or a
freeze ends. A step of over a third of a turn is no pace that a joint goes on at: after a pop by
half a turn, the step back would else be what its pace foretells. Smooth motion's jumps shrink with
the square of the time between frames, so clips of a low rate have a higher floor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import LARGEST_PACE_DEG
from mocapdb.motion.quaternions import (
    angles_deg,
    conjugate,
    from_rotation_vectors_deg,
    multiply,
    rotation_vectors_deg,
)

__all__ = ["Jumps", "find_jumps"]


@dataclass(frozen=True, eq=False)
class Jumps:
    """Steps and jumps at every boundary; boundary t lies between the frames t and t + 1.

    Attributes
    ----------
    steps_deg : (F - 1, K, 3)
        Rotation from each frame to the next, in the joint's turning frame.
    sizes_deg : (F - 1, K)
        Jumps.
    """

    steps_deg: FloatArray
    sizes_deg: FloatArray


def find_jumps(texture: Texture) -> Jumps:
    """Return the jumps of every joint; the first and last boundary are judged by one side."""
    quats = texture.quat_xyzw
    steps = rotation_vectors_deg(multiply(conjugate(quats[:-1]), quats[1:]))
    if len(steps) < 2:
        return Jumps(steps, np.zeros(steps.shape[:2]))
    far = np.linalg.norm(steps, axis=-1, keepdims=True) > LARGEST_PACE_DEG
    paces = np.where(far, 0.0, steps)
    onwards = angles_deg(multiply(quats[1:-1], from_rotation_vectors_deg(paces[:-1])), quats[2:])
    backwards = angles_deg(multiply(quats[1:-1], from_rotation_vectors_deg(-paces[1:])), quats[:-2])
    sizes = np.empty(steps.shape[:2])
    sizes[0], sizes[-1] = backwards[0], onwards[-1]
    sizes[1:-1] = np.minimum(onwards[:-1], backwards[1:])
    return Jumps(steps, sizes)
