"""How far each degree of freedom moves the points that an error is measured on.

To first order a change e of a frame's channels moves the points by J e, and the sum of the
squared distances is ``e.T @ W @ e`` with ``W = J.T @ J``. If the points had masses (their weights),
W would be the body's joint-space inertia matrix; so it is computed like one, by composite bodies
(Walker and Orin 1982; Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 6.2): each
joint carries the mass, the first and the second moments of all points below it.

``W = R.T @ R`` with R upper triangular (Cholesky) puts the sum in the order in which channels are
quantised: row i weighs the error of channel i and of the channels after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.base.kernels import jit, jit_inline
from mocapdb.compression.tuning import METRIC_DAMPING, METRIC_RIDGE, SHELL_WEIGHT
from mocapdb.motion.kinematics import Pose, axis_rotations
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import (
    BELT_FRACTION,
    BELT_RADIUS_M,
    SHELL_RADIUS_M,
    PointsName,
    bone_bases,
)

__all__ = ["Points", "error_points", "metric_factors", "point_distances"]

_DEGREE = np.pi / 180.0


@dataclass(frozen=True)
class Points:
    """Points that move with the joints.

    Attributes
    ----------
    joints : (P,) the joint that carries each point
    places : (P, 3) where it is in that joint's frame, in skeleton units
    weights : (P,) how much its error counts
    is_measured : (P,) whether the error of a motion is measured on it
    """

    joints: IntArray
    places: FloatArray
    weights: FloatArray
    is_measured: BoolArray


@lru_cache(maxsize=64)
def error_points(skeleton: Skeleton, name: PointsName) -> Points:
    """Return the points of the skin or of the shell (see `mocapdb.motion.skin`).

    The skin comes with a shell of little weight, so that what moves no bone is not lost. The ends
    of bones that translation channels stretch are taken as rigid, which is good enough here.
    """
    radius = SHELL_RADIUS_M / skeleton.metres_per_unit
    own = [joint for joint in range(skeleton.n_joints) if joint not in skeleton.scene_joints]
    joints = np.repeat(own, 3)
    places = np.tile(radius * np.eye(3), (len(own), 1))
    if name == "shell" or len(own) == 1:
        return Points(joints, places, np.ones(len(joints)), np.ones(len(joints), dtype=np.bool_))

    bones = skeleton.offsets[skeleton.bone_joints]
    starts = -bones if skeleton.convention == "acclaim" else np.zeros_like(bones)
    belt = starts + BELT_FRACTION * bones
    sides = bone_bases(skeleton)[:, :, 1:] * (BELT_RADIUS_M / skeleton.metres_per_unit)
    vertices = [starts, starts + bones]
    vertices += [belt + sign * sides[:, :, axis] for axis in (0, 1) for sign in (1.0, -1.0)]
    carriers = np.tile(skeleton.bone_carriers, len(vertices))
    is_measured = np.arange(len(carriers) + len(joints)) < len(carriers)
    return Points(
        np.concatenate([carriers, joints]),
        np.concatenate([*vertices, places]),
        np.where(is_measured, 1.0, SHELL_WEIGHT),
        is_measured,
    )


def metric_factors(
    skeleton: Skeleton,
    values: FloatArray,
    pose: Pose,
    points: Points,
    emphasis: FloatArray | None = None,
    own: FloatArray | None = None,
) -> FloatArray:
    """Return the metric's factor R (F, C, C), upper triangular, for every frame.

    Parameters
    ----------
    skeleton : Skeleton
    values : (F, C) degrees and skeleton units
        Its channels.
    pose : Pose
        What they bring it into (see `forward_kinematics`).
    points : Points
    emphasis : (F, P), optional
        By how much to multiply the weights of the points.
    own : (2, F, J), optional
        What a squared error of a joint's own costs besides: of its local rotation, in squared
        skeleton units a squared degree, and of its translation.

    Returns
    -------
    (F, C, C)
        In skeleton units a degree or a skeleton unit; the squares of all points are averaged.
    """
    plan = _plan(skeleton)
    weights = (points.weights / points.weights.sum())[None]
    if own is None:
        own = np.zeros((2, 1, skeleton.n_joints))
    factors = np.zeros((len(values), skeleton.n_channels, skeleton.n_channels))
    _metric(
        np.ascontiguousarray(values),
        np.ascontiguousarray(pose.positions),
        np.ascontiguousarray(pose.rotations),
        skeleton.parents,
        axis_rotations(skeleton),
        skeleton.offsets,
        skeleton.convention == "acclaim",
        plan.starts,
        plan.channels,
        plan.axes,
        plan.turns,
        points.joints,
        points.places,
        weights if emphasis is None else weights * emphasis,
        own,
        factors,
    )
    _factorise(factors)
    return factors


def _factorise(metric: FloatArray) -> None:
    """Replace the upper triangles of W by their Cholesky factors R, ``R.T @ R``.

    A little is added to the diagonal: two channels may have the same effect, or one none at all.
    The share of each entry keeps errors that cancel small enough for the first order to hold.
    """
    from scipy.linalg.lapack import dpotrf

    diagonal = np.einsum("fii->fi", metric)
    ridge = METRIC_RIDGE * diagonal.max(axis=1, initial=0.0, keepdims=True) + 1e-30
    diagonal *= 1.0 + METRIC_DAMPING
    diagonal += ridge
    for matrix in metric:
        dpotrf(matrix.T, lower=True, clean=False, overwrite_a=True)


def point_distances(points: Points, pose: Pose, other: Pose) -> FloatArray:
    """Return the distance (F, P) of each point between two poses, in skeleton units.

    Zero for points that no error is measured on.
    """
    distances = np.empty((len(pose.positions), len(points.joints)))
    _measure_distances(
        pose.positions,
        pose.rotations,
        other.positions,
        other.rotations,
        points.joints,
        points.places,
        distances,
    )
    distances[:, ~points.is_measured] = 0.0
    return distances


@jit
def _measure_distances(
    positions_a: FloatArray,
    rotations_a: FloatArray,
    positions_b: FloatArray,
    rotations_b: FloatArray,
    joints: IntArray,
    places: FloatArray,
    distances: FloatArray,
) -> None:
    for f in range(len(distances)):
        for p in range(len(joints)):
            j = joints[p]
            square = 0.0
            for r in range(3):
                moved = positions_a[f, j, r] - positions_b[f, j, r]
                for c in range(3):
                    moved += (rotations_a[f, j, r, c] - rotations_b[f, j, r, c]) * places[p, c]
                square += moved * moved
            distances[f, p] = np.sqrt(square)


@dataclass(frozen=True)
class _Plan:
    """The degrees of freedom, joint by joint: translations, then rotations, outermost first."""

    starts: IntArray
    channels: IntArray
    axes: IntArray
    turns: IntArray


@lru_cache(maxsize=64)
def _plan(skeleton: Skeleton) -> _Plan:
    starts, freedoms = [0], []
    for joint, (dofs, order) in enumerate(
        zip(skeleton.dofs, skeleton.rotation_orders, strict=True)
    ):
        first = int(skeleton.channel_starts[joint])
        freedoms += [(first + i, "xyz".index(d[1]), 0) for i, d in enumerate(dofs) if d[0] == "t"]
        columns = skeleton.rotation_columns(joint)
        freedoms += [
            (column, "XYZ".index(axis), 1) for column, axis in zip(columns, order, strict=True)
        ]
        starts.append(len(freedoms))
    table = np.array(freedoms, dtype=np.int64).reshape(-1, 3).T
    return _Plan(np.array(starts, dtype=np.int64), *np.ascontiguousarray(table))


@jit
def _metric(
    values: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
    parents: IntArray,
    axis_matrices: FloatArray,
    offsets: FloatArray,
    turns_about_start: bool,
    dof_starts: IntArray,
    dof_channels: IntArray,
    dof_axes: IntArray,
    dof_turns: IntArray,
    point_joints: IntArray,
    point_places: FloatArray,
    point_weights: FloatArray,
    own_weights: FloatArray,
    metric: FloatArray,
) -> None:
    n_frames, n_joints = positions.shape[:2]
    n_dofs = len(dof_channels)
    masses = np.empty(n_joints)
    firsts = np.empty((n_joints, 3))
    seconds = np.empty((n_joints, 3, 3))
    turning = np.zeros((n_dofs, 3))  # a dof moves a point p at turning x p + moving
    moving = np.empty((n_dofs, 3))
    above = np.empty((3, 3))
    frame = np.empty((3, 3))
    pivot = np.empty(3)
    for f in range(n_frames):
        weights = point_weights[f if len(point_weights) > 1 else 0]
        _gather_moments(
            positions[f], rotations[f], parents, point_joints, point_places, weights,
            masses, firsts, seconds,
        )  # fmt: skip
        for j in range(n_joints):
            for r in range(3):
                pivot[r] = positions[f, j, r] - positions[f, 0, r]
                for c in range(3):
                    above[r, c] = rotations[f, parents[j], r, c] if parents[j] >= 0 else r == c
                    if turns_about_start:
                        pivot[r] -= rotations[f, j, r, c] * offsets[j, c]
            for r in range(3):
                for c in range(3):
                    frame[r, c] = 0.0
                    for k in range(3):
                        frame[r, c] += above[r, k] * axis_matrices[j, k, c]
            for d in range(dof_starts[j], dof_starts[j + 1]):
                axis = dof_axes[d]
                if dof_turns[d]:
                    for r in range(3):
                        turning[d, r] = _DEGREE * frame[r, axis]
                    _cross(pivot, turning[d], moving[d])
                    _turn_about(frame, axis, _DEGREE * values[f, dof_channels[d]])
                else:
                    for r in range(3):
                        moving[d, r] = above[r, axis]
        _gather_inertia(
            parents, dof_starts, dof_channels, turning, moving, masses, firsts, seconds, metric[f]
        )
        _add_own(
            own_weights[:, f if own_weights.shape[1] > 1 else 0],
            dof_starts, dof_channels, dof_turns, turning, metric[f],
        )  # fmt: skip


@jit
def _gather_moments(
    positions: FloatArray,
    rotations: FloatArray,
    parents: IntArray,
    point_joints: IntArray,
    point_places: FloatArray,
    weights: FloatArray,
    masses: FloatArray,
    firsts: FloatArray,
    seconds: FloatArray,
) -> None:
    """Sum mass, first and second moments about joint 0 of all points at and below each joint."""
    n_joints = len(masses)
    point = np.empty(3)
    masses[:] = 0.0
    firsts[:] = 0.0
    seconds[:] = 0.0
    for p in range(len(point_joints)):
        j = point_joints[p]
        for r in range(3):
            point[r] = positions[j, r] - positions[0, r]
            for c in range(3):
                point[r] += rotations[j, r, c] * point_places[p, c]
        masses[j] += weights[p]
        for r in range(3):
            firsts[j, r] += weights[p] * point[r]
            for c in range(3):
                seconds[j, r, c] += weights[p] * point[r] * point[c]
    for j in range(n_joints - 1, 0, -1):
        masses[parents[j]] += masses[j]
        for r in range(3):
            firsts[parents[j], r] += firsts[j, r]
            for c in range(3):
                seconds[parents[j], r, c] += seconds[j, r, c]


@jit
def _gather_inertia(
    parents: IntArray,
    dof_starts: IntArray,
    dof_channels: IntArray,
    turning: FloatArray,
    moving: FloatArray,
    masses: FloatArray,
    firsts: FloatArray,
    seconds: FloatArray,
    metric: FloatArray,
) -> None:
    """Write the upper triangle of W from the moments of the bodies below each joint."""
    momentum = np.empty(3)
    angular = np.empty(3)
    spin = np.empty(3)
    for j in range(len(parents)):
        trace = seconds[j, 0, 0] + seconds[j, 1, 1] + seconds[j, 2, 2]
        for d in range(dof_starts[j], dof_starts[j + 1]):
            _cross(turning[d], firsts[j], momentum)
            _cross(firsts[j], moving[d], spin)
            for r in range(3):
                momentum[r] += masses[j] * moving[d, r]
                angular[r] = trace * turning[d, r] + spin[r]
                for c in range(3):
                    angular[r] -= seconds[j, r, c] * turning[d, c]
            i = j
            while i >= 0:
                for e in range(dof_starts[i], dof_starts[i + 1]):
                    value = 0.0
                    for r in range(3):
                        value += turning[e, r] * angular[r] + moving[e, r] * momentum[r]
                    low = min(dof_channels[d], dof_channels[e])
                    metric[low, dof_channels[d] + dof_channels[e] - low] = value
                i = parents[i]


@jit
def _add_own(
    weights: FloatArray,
    dof_starts: IntArray,
    dof_channels: IntArray,
    dof_turns: IntArray,
    turning: FloatArray,
    metric: FloatArray,
) -> None:
    """Add what errors of a joint's own cost, whatever hangs on it."""
    for j in range(weights.shape[1]):
        turn, shift = weights[0, j] / (_DEGREE * _DEGREE), weights[1, j]
        if turn == 0.0 and shift == 0.0:
            continue
        for d in range(dof_starts[j], dof_starts[j + 1]):
            if not dof_turns[d]:
                metric[dof_channels[d], dof_channels[d]] += shift
                continue
            for e in range(dof_starts[j], d + 1):
                if dof_turns[e]:
                    value = 0.0
                    for r in range(3):
                        value += turning[d, r] * turning[e, r]
                    low = min(dof_channels[d], dof_channels[e])
                    metric[low, dof_channels[d] + dof_channels[e] - low] += turn * value


@jit_inline
def _turn_about(frame: FloatArray, axis: int, angle_rad: float) -> None:
    """Turn a frame about one of its own axes."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    for r in range(3):
        first = frame[r, a]
        second = frame[r, b]
        frame[r, a] = first * cosine + second * sine
        frame[r, b] = second * cosine - first * sine


@jit_inline
def _cross(a: FloatArray, b: FloatArray, product: FloatArray) -> None:
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]
