"""Quieting: a joint without the noise that a viewer does not see, and with its edges.

What storing a clip takes away, and what one capture trembles more than the next, must not decide
what is called a fault. So jumps are looked for in rotations of which each is averaged with those
beside it, the less the further they are away in time and in angle (a bilateral filter): noise below
some degrees goes, and a jump, which is larger, stays as sharp as it was.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import QUIET_DEG, QUIET_ROUNDS, QUIET_S

__all__ = ["quieted"]


def quieted(texture: Texture) -> Texture:
    """Return a texture without small noise; its edges are where they were.

    Parameters
    ----------
    texture : Texture
        Of a clip at its own rate.
    """
    sigma = QUIET_S * texture.fps
    quats = texture.quat_xyzw.copy()
    for row in range(quats.shape[1]):
        one = quats[:, row]
        for _ in range(QUIET_ROUNDS):
            one = _averaged(one, sigma)
        quats[:, row] = one
    return replace(texture, quat_xyzw=quats)


def _averaged(quats: FloatArray, sigma: float) -> FloatArray:
    """Return rotations (F, 4), each averaged with those beside it, in time and in angle."""
    total = quats.copy()
    half_angle = math.radians(QUIET_DEG) / 2.0
    for apart in range(1, min(math.ceil(2.0 * sigma), len(quats) - 1) + 1):
        before, after = quats[:-apart], quats[apart:]
        # of unit quaternions in one hemisphere the chord is half the angle, where that is small
        chords = np.sum((after - before) ** 2, axis=1) / half_angle**2
        weights = np.exp(-0.5 * (chords + (apart / sigma) ** 2))[:, None]
        total[:-apart] += weights * after
        total[apart:] += weights * before
    return np.asarray(total / np.linalg.norm(total, axis=1, keepdims=True))
