"""What a window of motion holds, in single precision.

===============  ==============  ===============================================================
features         motion          meaning
===============  ==============  ===============================================================
``positions``    (F, J, 3)       world positions of all joints, metres, Y up
``quaternions``  (F, J, 4)       local rotations, xyzw; the root's place beside, (F, 3) metres
``6d``           (F, J, 6)       the first two columns of their matrices (Zhou et al. 2019);
                                 the root's place beside
``canonical``    (F, 18, 3)      joints of the canonical body seen from the hips, metres;
                                 the hips' place beside and where they head, (F, 4) metres and
                                 radians: the same for every skeleton
===============  ==============  ===============================================================
"""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import Float32Array, FloatArray
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_tracks import in_units, turn_to
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.quaternions import continuous, from_matrices
from mocapdb.motion.skeleton import Skeleton

__all__ = ["FEATURES", "FeatureName", "Features", "features_of"]

FeatureName: TypeAlias = Literal["positions", "quaternions", "6d", "canonical"]
FEATURES: tuple[FeatureName, ...] = get_args(FeatureName)


class Features(NamedTuple):
    """Frames of a clip.

    Attributes
    ----------
    motion : (F, J, n)
    root : (F, m)
        What is not in `motion`; m is 0 for positions.
    """

    motion: Float32Array
    root: Float32Array


def features_of(
    skeleton: Skeleton, channels: FloatArray, fps: float, name: FeatureName
) -> Features:
    """Return the features of channels (F, C).

    Raises
    ------
    SkeletonError
        If the canonical body is asked for and the skeleton is no whole human body.
    """
    if name == "canonical":
        from mocapdb.indexing.canonical.canonical_motion import canonical_motion

        found = canonical_motion(Clip(skeleton, channels, fps), fps=None)
        return _single(found.pose, np.column_stack([found.root, found.yaw]))
    pose = forward_kinematics(skeleton, channels)
    positions = in_units(skeleton, pose.positions)
    if name == "positions":
        return _single(positions, np.empty((len(channels), 0)))
    local = pose.rotations.copy()
    back = np.swapaxes(pose.rotations, -1, -2)
    local[:, 1:] = back[:, skeleton.parents[1:]] @ pose.rotations[:, 1:]
    turn = turn_to(skeleton, "y")
    if turn is not None:
        local = turn @ local @ turn.T
    if name == "6d":
        motion = np.swapaxes(local[..., :2], -1, -2).reshape(*local.shape[:2], 6)
    else:
        motion = continuous(from_matrices(local))
    return _single(motion, positions[:, skeleton.body_root])


def _single(motion: FloatArray, root: FloatArray) -> Features:
    return Features(motion.astype(np.float32), root.astype(np.float32))
