"""The heading of a body: a yaw about the vertical that stays continuous upside down.

O'Kane (2008, section 3.2.1) takes the yaw from the root's x axis alone, which turns by 180 degrees
when that axis passes the vertical. Here both horizontal axes of the rest pose vote, each as a
*line*: its horizontal part, squared as a complex number, so that its sign does not matter and its
vote fades as it nears the vertical. Half the angle of the sum is the heading up to half a turn,
which continuity over time decides. Somersaults and cartwheels pass, leaning ones too; only a body
whose two axes rise at 45 degrees each has no heading.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import FloatArray

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
        Rotation about the vertical from the rest pose's heading, continuous over time, the first
        in (-pi, pi]. Zero for a root that never turns; for an upright body the angle that O'Kane
        removes, to within its tilt.
    """
    first, second = (up_index + 1) % 3, (up_index + 2) % 3
    # turned by a yaw, the first axis points along it and the second a quarter turn ahead
    a = rotations[:, first, first] + 1j * rotations[:, second, first]
    b = rotations[:, second, second] - 1j * rotations[:, first, second]
    heading = np.unwrap(np.angle(a**2 + b**2)) / 2
    if np.real((a[0] + b[0]) * np.exp(-1j * heading[0])) < 0:
        heading -= np.copysign(np.pi, heading[0])
    return np.asarray(heading)
