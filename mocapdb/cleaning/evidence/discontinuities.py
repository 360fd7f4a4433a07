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

FRAMES_AT_ONCE = 512  # no result depends on it


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
    n_steps = max(len(quats) - 1, 0)
    steps, sizes = np.empty((n_steps, quats.shape[1], 3)), np.zeros((n_steps, quats.shape[1]))
    onwards, backwards = np.full_like(sizes, np.inf), np.full_like(sizes, np.inf)
    for first in range(0, n_steps, FRAMES_AT_ONCE):
        some = quats[first : first + FRAMES_AT_ONCE + 1]
        steps[first : first + FRAMES_AT_ONCE] = rotation_vectors_deg(
            multiply(conjugate(some[:-1]), some[1:])
        )
    if n_steps < 2:
        return Jumps(steps, sizes)
    for first in range(0, n_steps - 1, FRAMES_AT_ONCE):
        last = min(first + FRAMES_AT_ONCE, n_steps - 1)
        some = steps[first : last + 1]
        far = np.linalg.norm(some, axis=-1, keepdims=True) > LARGEST_PACE_DEG
        paces = np.where(far, 0.0, some)
        middle = quats[first + 1 : last + 1]
        onwards[first + 1 : last + 1] = angles_deg(
            multiply(middle, from_rotation_vectors_deg(paces[:-1])), quats[first + 2 : last + 2]
        )
        backwards[first:last] = angles_deg(
            multiply(middle, from_rotation_vectors_deg(-paces[1:])), quats[first:last]
        )
    return Jumps(steps, np.minimum(onwards, backwards, out=sizes))
