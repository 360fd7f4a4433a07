"""On which side of the body each joint is."""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.motion.body.joint_names import parse_name
from mocapdb.motion.body.understanding import understand, understand_pose
from mocapdb.motion.skeleton import Skeleton

__all__ = ["joint_sides"]

MIDDLE = 0.012  # of the body's extent at rest: how far from the middle a joint has no side


def joint_sides(skeleton: Skeleton, positions: FloatArray | None = None) -> IntArray:
    """Return (J,): 1 for left, -1 for right, 0 for the middle.

    Of a human body as it is understood: a joint above limbs of one side only, such as a collarbone,
    and all that hangs on a limb are on that side. Of any other body as the names say; where they
    say nothing, left is where x is positive at rest.

    Parameters
    ----------
    skeleton : Skeleton
    positions : (F, J, 3), skeleton units, optional
        Where the joints are in some frames; as they rest by default.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> from mocapdb.motion.kinematics import forward_kinematics
    >>> clip = synthetic.make_clip("walk", seed=1)
    >>> pose = forward_kinematics(clip.skeleton, clip.channels)
    >>> sides = joint_sides(clip.skeleton, pose.positions)
    >>> [int(sides[clip.skeleton.names.index(name)]) for name in ("lfemur", "rfemur", "head")]
    [1, -1, 0]
    """
    body = understand(skeleton) if positions is None else understand_pose(skeleton, positions)
    parts = body.parts
    sides = np.zeros(skeleton.n_joints, dtype=np.int64)
    below = np.zeros((skeleton.n_joints, 2), dtype=np.bool_)  # whether left, right limbs are
    for name, joint in parts.items():
        if name.startswith(("left_", "right_")):
            below[joint, int(name.startswith("right_"))] = True
    if not below.any():
        said = [parse_name(name).side for name in skeleton.names]
        if any(said):
            return np.array([int(side == "left") - int(side == "right") for side in said])
        return _sides_at_rest(skeleton)
    limbs: BoolArray = np.asarray(below.any(axis=1))
    parents = skeleton.parents
    for joint in range(skeleton.n_joints - 1, 0, -1):
        below[parents[joint]] |= below[joint]
    for joint in range(1, skeleton.n_joints):
        on_limb = sides[parents[joint]] != 0 and not limbs[joint]
        own = int(below[joint, 0]) - int(below[joint, 1])
        sides[joint] = sides[parents[joint]] if on_limb else own
    return sides


def _sides_at_rest(skeleton: Skeleton) -> IntArray:
    rest = skeleton.rest_positions
    across = rest[:, 0] - rest[0, 0]
    extent = float(np.ptp(rest, axis=0).max())
    return np.where(np.abs(across) <= MIDDLE * extent, 0, np.sign(across)).astype(np.int64)
