"""Cycles on another body: what one body does, done by another one.

Bodies of one kind, whose bones also point the same ways at rest, take each other's rotations joint
by joint. Any other two have to be human, as `mocapdb.motion.body` understands it: then each segment
of the one body is turned as that of the other (`mocapdb.motion.body.segments`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.curve.rotation_values import local_rotations
from mocapdb.cycles.cycle import Cycle, from_columns, to_columns, world_pose
from mocapdb.cycles.tuning import WEIGHTY_BONE
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.body.segments import Segments
from mocapdb.motion.kinematics import Pose, channels_from_pose
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import SAME_REST_COSINE

__all__ = ["is_of_one_kind", "on_body"]


def on_body(cycle: Cycle, other: Cycle) -> Cycle:
    """Return a cycle on the body of another cycle, its root's way scaled as the legs are.

    Parameters
    ----------
    cycle : Cycle
    other : Cycle
        Of the body that is wanted, from whose motion its joints are understood.

    Raises
    ------
    SkeletonError
        If the bodies differ, and one of them is no whole human body.
    """
    if cycle.skeleton == other.skeleton:
        return cycle
    if is_of_one_kind(cycle.skeleton, other.skeleton):
        return _scaled(cycle, other)
    source, target = _segments(cycle), _segments(other)
    facing = _level_turn(source, target)
    frames = {name: facing @ frame for name, frame in source.frames().items()}
    means = from_columns(other.columns.mean(axis=0))
    rotations = target.turned(frames, means, target.rotations[:, 0])
    skeleton = other.skeleton
    local = np.einsum("fjki,fjkl->fjil", rotations[:, _above(skeleton)], rotations)
    local[:, 0] = rotations[:, 0]
    ratio = _leg_m(target) / _leg_m(source)
    units = ratio * cycle.skeleton.metres_per_unit / skeleton.metres_per_unit
    middle = units * np.einsum("ij,fj->fi", facing, source.middle_of(source.positions))
    local, pose = _reached(other, local)
    sway = middle - (target.middle_of(pose.positions) - pose.positions[:, 0])
    up = skeleton.up_index
    feet = [joint for name, joint in target.joints.items() if name.endswith(("ankle", "toe"))]
    lowest = (pose.positions[:, feet, up] - pose.positions[:, :1, up] + sway[:, None, up]).min()
    sway[:, up] += target.positions[:, feet, up].min() - lowest
    return replace(
        cycle,
        skeleton=skeleton,
        columns=to_columns(local),
        sway=sway,
        advance=units * facing @ cycle.advance,
        translations=other.translations,
        provenance=(*cycle.provenance, f"on the body of {other.name or skeleton.name}"),
    )


def is_of_one_kind(one: Skeleton, other: Skeleton) -> bool:
    """Return whether two skeletons have the same joints, and bones that point the same ways."""
    if (one.names, one.parents.tolist(), one.convention, one.up) != (
        other.names,
        other.parents.tolist(),
        other.convention,
        other.up,
    ):
        return False
    ways, shares = [], []
    for skeleton in (one, other):
        lengths = np.linalg.norm(skeleton.offsets, axis=1)
        ways.append(skeleton.offsets / np.maximum(lengths, 1e-300)[:, None])
        shares.append(lengths / max(float(lengths[1:].max(initial=0.0)), 1e-300))
    weighty = np.minimum(*shares) > WEIGHTY_BONE
    weighty[0] = False
    return bool(((ways[0] * ways[1]).sum(axis=1)[weighty] > SAME_REST_COSINE).all())


def _scaled(cycle: Cycle, other: Cycle) -> Cycle:
    ratio = other.skeleton.height / cycle.skeleton.height
    return replace(
        cycle,
        skeleton=other.skeleton,
        sway=ratio * cycle.sway,
        advance=ratio * cycle.advance,
        translations=other.translations,
        provenance=(*cycle.provenance, f"on the body of {other.name or other.skeleton.name}"),
    )


def _segments(cycle: Cycle) -> Segments:
    samples = len(cycle.sway)
    pose = cycle.pose(np.arange(samples) / samples, "in-place")
    return Segments.of(cycle.skeleton, pose, cycle.name)


def _leg_m(body: Segments) -> float:
    """Return the mean length of a leg, in metres."""
    joints, first = body.joints, body.positions[0]
    lengths = [
        np.linalg.norm(first[joints[f"{side}_{end}"]] - first[joints[f"{side}_{start}"]])
        for side in SIDES
        for start, end in (("hip", "knee"), ("knee", "ankle"))
    ]
    return float(np.sum(lengths)) / len(SIDES) * body.skeleton.metres_per_unit


def _level_turn(source: Segments, target: Segments) -> FloatArray:
    """Return the rotation (3, 3) from the one's world to the other's: up and facing the same."""
    frames = []
    for body in (source, target):
        up = np.eye(3)[body.skeleton.up_index]
        across = body.across.mean(axis=0)
        across = _unit(across - (across @ up) * up)
        frames.append(np.stack([across, up, np.cross(across, up)], axis=-1))
    return np.asarray(frames[1] @ frames[0].T)


def _reached(other: Cycle, local: FloatArray) -> tuple[FloatArray, Pose]:
    """Return the rotations that the skeleton's degrees of freedom can reach, and the pose."""
    skeleton = other.skeleton
    pose = world_pose(skeleton, local, np.zeros((len(local), 3)), other.translations)
    channels = channels_from_pose(skeleton, pose)
    reached = local_rotations(skeleton, channels)
    return reached, world_pose(skeleton, reached, np.zeros((len(local), 3)), other.translations)


def _above(skeleton: Skeleton) -> FloatArray:
    return np.maximum(skeleton.parents, 0)


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))
