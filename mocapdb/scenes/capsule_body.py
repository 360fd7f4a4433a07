"""A skeleton as something to look at: a capsule for each bone, thick where a body is.

Thickness follows from lengths and hierarchy, never from names: a bone of the trunk is thicker the
more ends it carries, the highest end of the rest pose is the head.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import ByteArray, FloatArray, IntArray
from mocapdb.motion.body import joint_sides
from mocapdb.motion.kinematics import Pose, to_metres
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import VERTICES_PER_BONE, skin_vertices

__all__ = ["ERROR_COLOURS", "Body", "body_of", "bone_error_mm", "error_colours"]

SHORTEST_M = 0.004  # what is shorter has no capsule of its own
THICKNESS = 0.085  # radius of a bone as long as the body is high, relative to that height
CARRYING = 0.5  # thicker by this share for each further end that a bone in the middle carries
MOST_CARRIED = 3  # further ends that count
HEAD_RADIUS = 0.045  # relative to the height
THINNEST_M, THICKEST_M = 0.008, 0.13  # radii
BALL_M = 0.05  # radius of a skeleton of one joint

ERROR_COLOURS = ((222, 226, 230), (253, 204, 138), (252, 141, 89), (215, 48, 31), (110, 0, 0))
"""From none, a plain grey, to the most: darker and darker, so that no colour needs to be seen."""


@dataclass(frozen=True)
class Body:
    """What is drawn of a skeleton.

    Attributes
    ----------
    tails, heads : (B,)
        Joints between which each capsule runs; bones without length have none.
    radii_m : (B,) metres
    sides : (B,)
        1 for left, -1 for right, 0 for the middle.
    """

    tails: IntArray
    heads: IntArray
    radii_m: FloatArray
    sides: IntArray

    def __len__(self) -> int:
        return len(self.tails)


def body_of(skeleton: Skeleton, positions: FloatArray | None = None) -> Body:
    """Return the capsules of a skeleton.

    Parameters
    ----------
    skeleton : Skeleton
    positions : (F, J, 3), skeleton units, optional
        Where its joints are in some frames: sides are told better by a motion than by the rest
        pose.
    """
    rest = to_metres(skeleton, skeleton.rest_positions)
    parents, n_joints = skeleton.parents, skeleton.n_joints
    if n_joints == 1:  # a point: a ball
        nothing = np.zeros(1, dtype=np.int64)
        return Body(nothing, nothing, np.array([BALL_M]), nothing)
    lengths = np.linalg.norm(rest[1:] - rest[parents[1:]], axis=1)
    heads = np.arange(1, n_joints)[lengths > SHORTEST_M]
    if not len(heads):  # a skeleton of points: each bone is a small ball
        heads = np.arange(1, n_joints)
    tails = parents[heads]
    height = max(float(np.ptp(rest[:, 1])), float(np.ptp(rest, axis=0).max()), 1e-3)
    ends = np.zeros(n_joints)
    ends[[joint for joint, children in enumerate(skeleton.children) if not children]] = 1
    for joint in range(n_joints - 1, 0, -1):
        ends[parents[joint]] += ends[joint]
    share = np.minimum(lengths[heads - 1] / height, 1.0)
    sides = joint_sides(skeleton, positions)[heads]
    carried = np.where(sides == 0, np.clip(ends[heads] - 1, 0, MOST_CARRIED), 0)
    radii = THICKNESS * height * np.sqrt(share) * (1 + CARRYING * carried)
    leaves = np.flatnonzero((ends[heads] == 1) & (sides == 0))
    if len(leaves):
        top = leaves[np.argmax(rest[heads[leaves], 1])]
        radii[top] = HEAD_RADIUS * height
    return Body(tails, heads, np.clip(radii, THINNEST_M, THICKEST_M), sides)


def bone_error_mm(skeleton: Skeleton, original: Pose, other: Pose) -> FloatArray:
    """Return (F, B) how far each bone's skin is off, in the mean over its vertices, in mm.

    Over every joint but the root, as `Skeleton.bone_joints` has them.
    """
    distances = np.linalg.norm(
        skin_vertices(skeleton, original) - skin_vertices(skeleton, other), axis=-1
    )
    per_bone = distances.reshape(len(distances), -1, VERTICES_PER_BONE).mean(axis=-1)
    return np.asarray(1000.0 * skeleton.metres_per_unit * per_bone)


def error_colours(error: FloatArray, most: float) -> ByteArray:
    """Return (..., 3) the colours of errors from 0 to `most`, and beyond as `most`."""
    share = np.clip(np.asarray(error) / max(most, 1e-12), 0, 1)
    stops = np.array(ERROR_COLOURS, dtype=np.float64)
    at = np.linspace(0, 1, len(stops))
    mixed = [np.interp(share, at, stops[:, channel]) for channel in range(3)]
    return np.stack(mixed, axis=-1).round().astype(np.uint8)
