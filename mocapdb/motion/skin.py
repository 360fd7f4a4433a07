"""How much a motion lost: measured on a skin rather than on channels.

``skinned_error``, ``vertex_error``
    On a faux mesh of six vertices a bone (O'Kane 2008, section 3.1.1 and eq. 3.1).
``shell_error``
    On three points 3 cm from every joint, as the ACL animation compressor measures.

O'Kane draws his mesh but does not state it. Here a bone has a vertex at each end and four around
it, at 30 % of its length and 1.3 CMU units (7.3 cm) away: with these his table 4.1 comes out. Bones
begin at the body's root: what it hangs on in the scene has neither skin nor shell.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from mocapdb.base.arrays import FloatArray, FrameSource, IntArray
from mocapdb.base.kernels import jit
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose, forward_kinematics
from mocapdb.motion.rotations import basis_along
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import CHUNK_FRAMES

__all__ = [
    "BELT_FRACTION",
    "BELT_RADIUS_M",
    "SHELL_RADIUS_M",
    "VERTICES_PER_BONE",
    "MotionError",
    "PointError",
    "PointsName",
    "channels_error",
    "error_of_squares",
    "motion_error",
    "pose_error",
    "shell_error",
    "skin_vertices",
    "skinned_error",
    "squared_distances",
]

# the faux mesh of O'Kane (2008): a belt of four vertices round each bone, at this share of it
BELT_FRACTION = 0.3
BELT_RADIUS_M = 1.3 * 0.0254 / 0.45
SHELL_RADIUS_M = 0.03
VERTICES_PER_BONE = 6

PointsName: TypeAlias = Literal["skin", "shell"]
"""The points that an error is measured on."""


@dataclass(frozen=True)
class PointError:
    """Distances between the points of two motions, in millimetres.

    Attributes
    ----------
    mean, p95, max : float
        Mean, 95th percentile and maximum over all points and frames.
    """

    mean: float
    p95: float
    max: float

    def to_dict(self) -> dict[str, float]:
        """Return the three figures by name."""
        return asdict(self)


@dataclass(frozen=True)
class MotionError:
    """What a motion lost.

    Attributes
    ----------
    skinned : float, skeleton units
        Mean over frames of the L2 norm of the difference of all vertices (eq. 3.1).
    vertices : PointError, millimetres
        Distances of single vertices.
    """

    skinned: float
    vertices: PointError


def motion_error(original: Clip, other: Clip) -> MotionError:
    """Return what one clip lost against another of the same skeleton and length.

    Raises
    ------
    ClipError
        If the clips have different skeletons or lengths.
    """
    _check_alike(original, other)
    return channels_error(original.skeleton, original.channels, other.channels)


def channels_error(
    skeleton: Skeleton,
    original: FloatArray,
    other: FrameSource,
    *,
    points: PointsName = "skin",
) -> MotionError:
    """Return what channels (F, C) lost: `motion_error` without the clips, in little memory.

    Of more than `CHUNK_FRAMES` frames the 95th percentile is that of every second, third ...
    frame, at most so many; means and maximum are of all frames.
    """
    n_frames = len(original)

    def error(part: slice) -> MotionError:
        before = forward_kinematics(skeleton, original[part])
        after = forward_kinematics(skeleton, other[part])
        return pose_error(skeleton, before, after, points=points)

    if n_frames <= CHUNK_FRAMES:
        return error(slice(None))
    starts = range(0, n_frames, CHUNK_FRAMES)
    errors = [error(slice(start, start + CHUNK_FRAMES)) for start in starts]
    shares = [min(CHUNK_FRAMES, n_frames - start) / n_frames for start in starts]
    some = error(slice(None, None, -(-n_frames // CHUNK_FRAMES)))
    return MotionError(
        skinned=float(np.dot(shares, [each.skinned for each in errors])),
        vertices=PointError(
            mean=float(np.dot(shares, [each.vertices.mean for each in errors])),
            p95=some.vertices.p95,
            max=max(each.vertices.max for each in errors),
        ),
    )


def skinned_error(original: Clip, other: Clip) -> float:
    """Return the mean skinned error (eq. 3.1) in skeleton units, every frame counted."""
    return motion_error(original, other).skinned


def shell_error(original: Clip, other: Clip) -> PointError:
    """Return distances of three points 3 cm from every joint, along the axes of its world frame.

    Raises
    ------
    ClipError
        If the clips have different skeletons or lengths.
    """
    _check_alike(original, other)
    skeleton = original.skeleton
    return channels_error(skeleton, original.channels, other.channels, points="shell").vertices


def pose_error(
    skeleton: Skeleton,
    original: Pose,
    other: Pose,
    *,
    points: PointsName = "skin",
    with_p95: bool = True,
) -> MotionError:
    """Return what a pose over time lost against another: `motion_error` without the clips.

    With the shell for `points`, its points take the place of the vertices. Without the 95th
    percentile, which takes the most time, it is nan.
    """
    squares = squared_distances(skeleton, original, other, points=points)
    return error_of_squares(squares, skeleton.metres_per_unit, with_p95=with_p95)


def squared_distances(
    skeleton: Skeleton, original: Pose, other: Pose, *, points: PointsName = "skin"
) -> FloatArray:
    """Return how far each point is off, squared, in skeleton units.

    Of the skin (F, 6 B), bone by bone, in the order of `skin_vertices`; of the shell three each
    joint, joint by joint.
    """
    if points == "skin":
        return _squared_vertex_distances(skeleton, original, other)
    radius = SHELL_RADIUS_M / skeleton.metres_per_unit
    moved = (original.positions - other.positions)[..., None]
    moved = moved + radius * (original.rotations - other.rotations)
    if skeleton.scene_joints:
        moved = np.delete(moved, skeleton.scene_joints, axis=1)
    return np.asarray((moved * moved).sum(axis=-2).reshape(len(moved), -1))


def error_of_squares(
    squares: FloatArray, metres_per_unit: float, *, with_p95: bool = True
) -> MotionError:
    """Return what a motion lost whose points are so far off (see `squared_distances`)."""
    return MotionError(
        skinned=float(np.sqrt(squares.sum(axis=1)).mean()),
        vertices=_point_error(np.sqrt(squares), metres_per_unit, with_p95),
    )


def skin_vertices(skeleton: Skeleton, pose: Pose) -> FloatArray:
    """Return the vertices (F, 6 B, 3) of the faux mesh, in skeleton units.

    In the order start, end, and around the belt +y, -y, +z, -z of the bone's frame, bone by bone.
    """
    tails = pose.positions[:, skeleton.parents[skeleton.bone_joints]]
    heads = pose.positions[:, skeleton.bone_joints]
    frames = pose.rotations[:, skeleton.bone_carriers] @ bone_bases(skeleton)
    radius = BELT_RADIUS_M / skeleton.metres_per_unit
    belt = (1 - BELT_FRACTION) * tails + BELT_FRACTION * heads
    y, z = radius * frames[..., 1], radius * frames[..., 2]
    vertices = np.stack([tails, heads, belt + y, belt - y, belt + z, belt - z], axis=2)
    return vertices.reshape(len(vertices), -1, 3)


@lru_cache(maxsize=256)
def bone_bases(skeleton: Skeleton) -> FloatArray:
    """Return (B, 3, 3) the frame of each bone in its carrier's coordinates, x along the bone."""
    bases = np.tile(np.eye(3), (len(skeleton.bone_joints), 1, 1))
    for bone, joint in enumerate(skeleton.bone_joints):
        if skeleton.bone_lengths[bone] > 1e-9:
            bases[bone] = basis_along(skeleton.offsets[joint])
    return bases


def _check_alike(original: Clip, other: Clip) -> None:
    if original.skeleton != other.skeleton:
        raise ClipError(
            f"Expected two clips of one skeleton, but {original.name!r} has "
            f"{original.skeleton.name!r} and {other.name!r} has {other.skeleton.name!r}."
        )
    if len(original) != len(other):
        raise ClipError(
            f"Expected two clips of one length, but {original.name!r} has {len(original)} frames "
            f"and {other.name!r} has {len(other)}."
        )


def _point_error(distances: FloatArray, metres_per_unit: float, with_p95: bool) -> PointError:
    millimetres = 1000.0 * metres_per_unit
    if distances.size == 0:  # a skeleton of one joint has no bones and so no skin
        return PointError(0.0, 0.0, 0.0)
    return PointError(
        mean=float(distances.mean()) * millimetres,
        p95=float(np.percentile(distances, 95)) * millimetres if with_p95 else math.nan,
        max=float(distances.max()) * millimetres,
    )


def _squared_vertex_distances(skeleton: Skeleton, original: Pose, other: Pose) -> FloatArray:
    """Return (F, 6 B) squared vertex distances, in skeleton units squared."""
    heads = skeleton.bone_joints
    squares = np.empty((len(original.positions), VERTICES_PER_BONE * len(heads)))
    _difference(
        original.positions,
        original.rotations,
        other.positions,
        other.rotations,
        np.array(skeleton.parents[heads]),
        np.array(heads),
        np.array(skeleton.bone_carriers),
        bone_bases(skeleton),
        BELT_RADIUS_M / skeleton.metres_per_unit,
        squares,
    )
    return squares


@jit
def _difference(
    positions_a: FloatArray,
    rotations_a: FloatArray,
    positions_b: FloatArray,
    rotations_b: FloatArray,
    tails: IntArray,
    heads: IntArray,
    carriers: IntArray,
    bases: FloatArray,
    radius: float,
    squares: FloatArray,
) -> None:
    """Vertices are linear in positions and rotations, so their differences need no vertices."""
    for f in range(len(positions_a)):
        for bone in range(len(carriers)):
            head = heads[bone]
            tail = tails[bone]
            carrier = carriers[bone]
            out = squares[f, 6 * bone : 6 * bone + 6]
            out[:] = 0.0
            for r in range(3):
                start = positions_a[f, tail, r] - positions_b[f, tail, r]
                end = positions_a[f, head, r] - positions_b[f, head, r]
                y = 0.0
                z = 0.0
                for c in range(3):
                    turn = rotations_a[f, carrier, r, c] - rotations_b[f, carrier, r, c]
                    y += turn * bases[bone, c, 1]
                    z += turn * bases[bone, c, 2]
                belt = (1.0 - BELT_FRACTION) * start + BELT_FRACTION * end
                out[0] += start * start
                out[1] += end * end
                out[2] += (belt + radius * y) ** 2
                out[3] += (belt - radius * y) ** 2
                out[4] += (belt + radius * z) ** 2
                out[5] += (belt - radius * z) ** 2
