"""The heading of a body: a yaw about the vertical that stays continuous upside down.

O'Kane (2008, section 3.2.1) takes the yaw from the root's x axis alone, which turns by 180 degrees
when that axis passes the vertical. Here both horizontal axes of the rest pose vote, each as a
*line* (without a sign) weighted by the squared length of its horizontal part; the sign of each is
the one nearest the frame before. An axis changes sign only while it is vertical and has no vote,
and two perpendicular axes are never vertical together, so a somersault and a cartwheel both pass.
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb._jit import jit
from mocapdb._typing import FloatArray

__all__ = ["heading_angles"]


def heading_angles(rotations: FloatArray, up_index: int) -> FloatArray:
    """Return the yaw of a body over time.

    Parameters
    ----------
    rotations : (F, 3, 3)
        World rotations of the root, which are identity in the rest pose.
    up_index : int
        Index of the vertical axis, 1 or 2.

    Returns
    -------
    (F,) radians
        Rotation about the vertical from the rest pose's heading, continuous over time. Zero for
        a root that never turns; for an upright body the angle that O'Kane removes, to within its
        tilt.
    """
    yaw = np.empty(len(rotations))
    _track_heading(np.ascontiguousarray(rotations), up_index, yaw)
    return np.asarray(np.unwrap(yaw))


@jit
def _track_heading(rotations: FloatArray, up: int, yaw: FloatArray) -> None:
    first = (up + 1) % 3
    second = (up + 2) % 3
    # direction of the heading in the frame before, as (cosine, sine)
    along, across = 0.0, 0.0
    for f in range(len(rotations)):
        # the first axis points along the yaw, the second a quarter turn ahead of it
        ax, ay = rotations[f, first, first], rotations[f, second, first]
        bx, by = rotations[f, second, second], -rotations[f, first, second]
        weight_a = math.sqrt(ax * ax + ay * ay)
        weight_b = math.sqrt(bx * bx + by * by)
        if f == 0:
            along, across = (ax, ay) if weight_a >= weight_b else (bx, by)
        if ax * along + ay * across < 0.0:
            ax, ay = -ax, -ay
        if bx * along + by * across < 0.0:
            bx, by = -bx, -by
        along = weight_a * ax + weight_b * bx
        across = weight_a * ay + weight_b * by
        yaw[f] = math.atan2(across, along)
