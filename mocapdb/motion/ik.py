"""Limbs that reach for a place: resting feet held where they rest."""

from __future__ import annotations

import numpy as np

from mocapdb._typing import BoolArray, FloatArray
from mocapdb.motion.contacts import Leg, find_legs, runs
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.skeleton import Skeleton

__all__ = ["planted"]

EASE_S = 0.2
SMOOTH_S = 0.02
LEAST_BEND = 1e-4


def planted(skeleton: Skeleton, pose: Pose, contacts: BoolArray, fps: float) -> Pose:
    """Return the pose with resting feet held in place by turning thighs and shanks.

    Parameters
    ----------
    skeleton : Skeleton
    pose : Pose
        With its root motion.
    contacts : (F, L)
    fps : float, frames per second

    Notes
    -----
    Each rest gets the place where the foot is on average, at the height where it is; the pull
    towards it eases in and out over 0.2 s. Knee and hip follow from two bones of fixed length
    (law of cosines) in the plane in which the leg was; the foot keeps its rotation. A place out
    of reach is approached as far as the leg goes.
    """
    positions, rotations = pose.positions.copy(), pose.rotations.copy()
    for i, leg in enumerate(find_legs(skeleton)):
        pull = _pull(positions[:, leg.ball], contacts[:, i], skeleton.up_index, EASE_S * fps)
        if pull.any():
            _reach(skeleton, positions, rotations, leg, pull)
    return Pose(positions, rotations)


def _pull(ball: FloatArray, contact: BoolArray, up_index: int, ease: float) -> FloatArray:
    """Return (F, 3) how far the foot is to be moved in each frame."""
    from scipy.ndimage import gaussian_filter1d

    pull = np.zeros_like(ball)
    weight = np.zeros(len(ball))
    frames = np.arange(len(ball))
    for rest in runs(contact):
        place = ball[rest].mean(axis=0)
        towards = place - ball
        towards[:, up_index] = 0.0
        first, last = rest[0], rest[-1]
        outside = np.maximum(np.maximum(first - frames, frames - last), 0)
        share = np.where(outside < ease, 0.5 + 0.5 * np.cos(np.pi * outside / ease), 0.0)
        # beside a rest the foot keeps the offset that it had at the rest's edge
        edge = np.clip(frames, first, last)
        pull += share[:, None] * towards[edge]
        weight += share
    pull /= np.maximum(weight, 1.0)[:, None]
    return np.asarray(gaussian_filter1d(pull, SMOOTH_S / EASE_S * ease, axis=0))


def _reach(
    skeleton: Skeleton, positions: FloatArray, rotations: FloatArray, leg: Leg, pull: FloatArray
) -> None:
    """Move the ankle by `pull`, in place: the thigh and the shank turn, the foot keeps facing."""
    hip, knee, ankle = (positions[:, joint] for joint in (leg.hip, leg.knee, leg.ankle))
    thigh, shank = knee - hip, ankle - knee
    a, b = np.linalg.norm(thigh, axis=1), np.linalg.norm(shank, axis=1)
    old, target = ankle - hip, ankle + pull - hip
    normal = np.cross(thigh, shank)
    size = np.linalg.norm(normal, axis=1)
    usable = (size > LEAST_BEND * a * b) & (np.abs(pull).max(axis=1) > 0)
    normal = normal / np.maximum(size, 1e-300)[:, None]
    reach = np.clip(np.linalg.norm(target, axis=1), np.abs(a - b) * 1.001, (a + b) * 0.9999)
    was = _corner(a, b, np.linalg.norm(old, axis=1))
    now = _corner(a, b, reach)
    bent = _rotation_about(normal, now - was)
    swing = _between(thigh + np.einsum("fij,fj->fi", bent, shank), target)
    swing[~usable] = bent[~usable] = np.eye(3)
    new_thigh = np.einsum("fij,fj->fi", swing, thigh)
    new_shank = np.einsum("fij,fjk,fk->fi", swing, bent, shank)
    moved = hip + new_thigh + new_shank - ankle
    below = _below(skeleton, leg.ankle)
    rotations[:, leg.upper] = swing @ rotations[:, leg.upper]
    rotations[:, leg.lower] = swing @ bent @ rotations[:, leg.lower]
    positions[:, leg.knee] = hip + new_thigh
    positions[:, below] += moved[:, None]


def _corner(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return the angle by which the shank is bent out of the thigh's line."""
    cosine = (c**2 - a**2 - b**2) / np.maximum(2 * a * b, 1e-300)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _between(u: FloatArray, v: FloatArray) -> FloatArray:
    """Return the smallest rotations (F, 3, 3) that lay directions u along v."""
    axis = np.cross(u, v)
    sine = np.linalg.norm(axis, axis=1)
    angle = np.arctan2(sine, (u * v).sum(axis=1))
    return _rotation_about(axis / np.maximum(sine, 1e-300)[:, None], angle)


def _rotation_about(axis: FloatArray, angle: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(axis * angle[:, None]).as_matrix())


def _below(skeleton: Skeleton, joint: int) -> list[int]:
    """Return a joint and all that hang on it."""
    found = [joint]
    for other in range(joint + 1, skeleton.n_joints):
        if skeleton.parents[other] in found:
            found.append(other)
    return found
