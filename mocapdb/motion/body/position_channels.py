"""What position channels below the root mean: places of joints, or displacements from OFFSETs."""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.motion.body.findings import Finding
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import DISPLACEMENT_SHARE

__all__ = ["positions_are_added"]


def positions_are_added(skeleton: Skeleton, channels: FloatArray) -> Finding[bool]:
    """Return whether the position channels of joints are added to their OFFSETs.

    Places have the lengths of bones, and most exporters repeat the OFFSETs; displacements are
    small beside them. The root is not asked: its channels are places in the world in any case.

    Parameters
    ----------
    skeleton : Skeleton
    channels : (F, C)
        Some frames.
    """
    if skeleton.convention == "acclaim":
        return Finding(True, "Acclaim's translations add to the bone", 1.0)
    starts = skeleton.channel_starts
    placed, offset_lengths = [], []
    for joint in range(1, skeleton.n_joints):
        dofs = skeleton.dofs[joint]
        columns = [int(starts[joint]) + i for i, dof in enumerate(dofs) if dof[0] == "t"]
        if not columns:
            continue
        axes = ["xyz".index(dof[1]) for dof in dofs if dof[0] == "t"]
        placed.append(float(np.median(np.linalg.norm(channels[:, columns], axis=1))))
        offset_lengths.append(float(np.linalg.norm(skeleton.offsets[joint, axes])))
    if not placed:
        return Finding(False, "no joint below the root has position channels", 1.0)
    # the median, for hips below a scene root carry a place in the world
    shares = [a / b for a, b in zip(placed, offset_lengths, strict=True) if b > 0]
    if not shares or float(np.median(shares)) >= DISPLACEMENT_SHARE:
        return Finding(False, "position channels are places: they have the lengths of bones", 0.95)
    share = float(np.median(shares))
    return Finding(
        True,
        f"position channels are displacements: their length is {share:.2g} of their OFFSETs'",
        0.95,
    )
