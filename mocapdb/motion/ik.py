"""Limbs that reach for a place.

``planted``      legs whose resting feet are held where they rest, in closed form, on poses
``reach``        any joints to any places by turning any others, by least squares, on channels
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.motion.foot_contacts import Leg, find_legs, runs
from mocapdb.motion.kinematics import Pose, forward_kinematics
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import (
    DAMPING,
    EASE_S,
    LEAST_BEND,
    MOST_STEPS,
    REACHED,
    SMOOTH_S,
    SOFT_REACH,
)

__all__ = ["planted", "pull_to_rest", "reach"]

LEAST_ROOM = 1e-6  # share of a leg's length that keeps the logarithm in `_soft_reach` finite
SHORTEST_REACH = 1.001  # times thigh minus shank: the length of a leg with the knee folded
PROBE_DEG = 1e-3  # step of the numerical derivative; 1e-5 to 1e-2 give the same results


def planted(
    skeleton: Skeleton,
    pose: Pose,
    contacts: BoolArray,
    fps: float,
    *,
    soft_reach: float = SOFT_REACH,
    share: float = 1.0,
) -> Pose:
    """Return the pose with resting feet held in place by turning thighs and shanks.

    Parameters
    ----------
    skeleton : Skeleton
    pose : Pose
        With its root motion.
    contacts : (F, L)
    fps : float, frames per second
    soft_reach : float
        Share of a leg's length from which on its reach is soft. The less it is, the smoother the
        knee of a leg that is nearly straight, and the less the foot is held there.
    share : float
        Of the way to its place that a foot is pulled.

    Notes
    -----
    Each rest gets the place where the foot is on average, at the height where it is; the pull
    towards it eases in and out over 0.2 s. Knee and hip follow from two bones of fixed length
    (law of cosines) in the plane in which the leg was; the foot keeps its rotation. The last of a
    leg's reach is soft: near it the foot gives way rather than the knee pop.
    """
    positions, rotations = pose.positions.copy(), pose.rotations.copy()
    for i, leg in enumerate(find_legs(skeleton, pose.positions)):
        pull = pull_to_rest(positions[:, leg.ball], contacts[:, i], skeleton.up_index, fps)
        if pull.any():
            _turn_leg(skeleton, positions, rotations, leg, share * pull, soft_reach)
    return Pose(positions, rotations)


def pull_to_rest(ball: FloatArray, contact: BoolArray, up_index: int, fps: float) -> FloatArray:
    """Return how far a foot is to be moved so that it stays where it rests.

    Parameters
    ----------
    ball : (F, 3)
        Path of the foot.
    contact : (F,)
        Whether it rests.
    up_index : int
        The vertical axis, along which it is not moved.
    fps : float, frames per second

    Returns
    -------
    (F, 3)
        Eases in and out over 0.2 s beside a rest.
    """
    ease = EASE_S * fps
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
    return _gaussian_smoothed(pull, SMOOTH_S * fps)


def reach(
    skeleton: Skeleton,
    channels: FloatArray,
    places: Mapping[int, FloatArray],
    turning: Sequence[int],
) -> FloatArray:
    """Return channels in which joints come as near as they can to places.

    Parameters
    ----------
    skeleton : Skeleton
    channels : (F, C)
        Where the search starts; each frame is solved by itself.
    places : mapping of int to (F, 3), skeleton units
        Where each joint should be; NaN in frames where it may be anywhere.
    turning : sequence of int
        Joints whose rotation channels may change. All others stay bit for bit.

    Returns
    -------
    (F, C)

    Notes
    -----
    Damped least squares (Wampler 1986): the step d solves ``(J^T J + lambda^2) d = J^T e`` with
    the error e and its Jacobian J; lambda falls where a step helps and rises where it does not,
    so that a place out of reach is approached and left at that. Rotations stay within the joints'
    own degrees of freedom, near those that they had.
    """
    columns = [column for joint in turning for column in sorted(skeleton.rotation_columns(joint))]
    solved = np.array(channels, dtype=np.float64)
    if not columns or not places or len(solved) == 0:
        return solved
    joints = list(places)
    wanted = np.stack([places[joint] for joint in joints], axis=1)  # (F, G, 3)
    free = ~np.isfinite(wanted)

    def errors(values: FloatArray, frames: IntArray) -> FloatArray:
        apart = wanted[frames] - forward_kinematics(skeleton, values).positions[:, joints]
        return np.where(free[frames], 0.0, apart).reshape(len(values), -1)

    damping = np.full(len(solved), DAMPING * skeleton.height)
    error = errors(solved, np.arange(len(solved)))
    for _ in range(MOST_STEPS):
        active = np.flatnonzero(np.abs(error).max(axis=1) > REACHED * skeleton.height)
        if len(active) == 0:
            break
        here = solved[active]
        jacobian = np.empty((len(active), error.shape[1], len(columns)))
        for i, column in enumerate(columns):
            probe = here.copy()
            probe[:, column] += PROBE_DEG
            moved = error[active] - errors(probe, active)
            jacobian[:, :, i] = moved / np.deg2rad(PROBE_DEG)
        squares = np.einsum("fec,fed->fcd", jacobian, jacobian)
        squares += damping[active, None, None] ** 2 * np.eye(len(columns))
        gradient = np.einsum("fec,fe->fc", jacobian, error[active])
        step = np.linalg.solve(squares, gradient[..., None])[..., 0]
        here[:, columns] += np.rad2deg(step)
        after = errors(here, active)
        better = (after**2).sum(axis=1) < (error[active] ** 2).sum(axis=1)
        solved[active[better]], error[active[better]] = here[better], after[better]
        damping[active] *= np.where(better, 0.5, 4.0)
    return solved


def _turn_leg(
    skeleton: Skeleton,
    positions: FloatArray,
    rotations: FloatArray,
    leg: Leg,
    pull: FloatArray,
    soft_reach: float,
) -> None:
    """Move the ankle by `pull`, in place: the thigh and the shank turn, the foot keeps facing."""
    hip, knee, ankle = (positions[:, joint] for joint in (leg.hip, leg.knee, leg.ankle))
    thigh, shank = knee - hip, ankle - knee
    a, b = np.linalg.norm(thigh, axis=1), np.linalg.norm(shank, axis=1)
    target = ankle + pull - hip
    was = np.linalg.norm(ankle - hip, axis=1)
    now = _soft_reach(was, np.linalg.norm(target, axis=1), a + b, soft_reach)
    now = np.maximum(now, np.abs(a - b) * SHORTEST_REACH)
    axis = _knee_axis(thigh, shank, rotations[:, leg.upper])
    bent = _rotation_about(axis, _corner(a, b, now) - _corner(a, b, was))
    swing = _between(thigh + np.einsum("fij,fj->fi", bent, shank), target)
    unmoved = ~pull.any(axis=1)
    swing[unmoved] = bent[unmoved] = np.eye(3)
    new_thigh = np.einsum("fij,fj->fi", swing, thigh)
    new_shank = np.einsum("fij,fjk,fk->fi", swing, bent, shank)
    moved = hip + new_thigh + new_shank - ankle
    below = _below(skeleton, leg.ankle)
    rotations[:, leg.upper] = swing @ rotations[:, leg.upper]
    rotations[:, leg.lower] = swing @ bent @ rotations[:, leg.lower]
    positions[:, leg.knee] = hip + new_thigh
    positions[:, below] += moved[:, None]


def _soft_reach(
    was: FloatArray, wanted: FloatArray, longest: FloatArray, soft_reach: float
) -> FloatArray:
    """Return how long a leg becomes that is to be `wanted` long.

    Near its full length the knee's angle goes as a square root of the length, and a leg that is
    drawn straight pops. So lengths are first mapped to those of a leg that yields without end:
    equal up to `soft_reach` of the full length s, from there on ``s + r log(r / (longest - x))``
    with the room r that is left. The change of length is added there, and the sum mapped back. A
    leg that is nearly straight therefore hardly changes its length, whichever way it is pulled.
    """
    soft = soft_reach * longest
    room = longest - soft
    beyond = room * np.log(room / np.maximum(longest - was, LEAST_ROOM * longest))
    yielding = np.where(was > soft, soft + beyond, was) + wanted - was
    over = np.maximum(yielding - soft, 0.0)
    return np.where(over > 0.0, longest - room * np.exp(-over / np.maximum(room, 1e-300)), yielding)


def _knee_axis(thigh: FloatArray, shank: FloatArray, frames: FloatArray) -> FloatArray:
    """Return (F, 3) the directions about which knees bend.

    Across thigh and shank, and where these are in line, that of the other frames, which stands
    still in the thigh's own `frames` (F, 3, 3).
    """
    across = np.cross(thigh, shank)
    usual = np.einsum("fji,fj->i", frames, across)
    usual /= max(float(np.linalg.norm(usual)), 1e-300)
    lengths = np.linalg.norm(thigh, axis=1) * np.linalg.norm(shank, axis=1)
    axis = across + LEAST_BEND * lengths[:, None] * (frames @ usual)
    return np.asarray(axis / np.maximum(np.linalg.norm(axis, axis=1), 1e-300)[:, None])


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
    """Return (F, 3, 3) the turns about axes (F, 3) by angles (F,), in radians.

    What scipy's ``Rotation.from_rotvec`` makes of them, without the import, which takes longer.
    """
    vectors = axis * angle[:, None]
    angle = np.sqrt(vectors[:, 0] ** 2 + vectors[:, 1] ** 2 + vectors[:, 2] ** 2)
    small = angle <= 1e-3
    series = 0.5 - angle**2 / 48 + (angle**2) ** 2 / 3840
    scale = np.where(small, series, np.sin(angle / 2) / np.where(small, 1.0, angle))
    x, y, z = (vectors * scale[:, None]).T
    w = np.cos(angle / 2)
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    rows = [
        [xx - yy - zz + ww, 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), -xx + yy - zz + ww, 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), -xx - yy + zz + ww],
    ]
    return np.moveaxis(np.array(rows), -1, 0).copy()


def _gaussian_smoothed(values: FloatArray, sigma: float) -> FloatArray:
    """Return values (F, D) averaged over time with a bell curve of so many frames.

    What ``scipy.ndimage.gaussian_filter1d`` returns, without the import, which takes longer: the
    bell ends at four sigmas, and beyond its ends the motion is thought to run backwards.
    """
    reach = int(4.0 * sigma + 0.5)
    bell = np.exp(-0.5 / (sigma * sigma) * np.arange(-reach, reach + 1) ** 2)
    bell = bell / bell.sum()
    n_frames = len(values)
    padded = np.pad(values, ((reach, reach), (0, 0)), mode="symmetric")
    smooth = values * bell[reach]
    for i in range(reach):
        j = 2 * reach - i
        smooth += (padded[i : i + n_frames] + padded[j : j + n_frames]) * bell[i]
    return np.asarray(smooth)


def _below(skeleton: Skeleton, joint: int) -> list[int]:
    """Return a joint and all that hang on it."""
    found = [joint]
    for other in range(joint + 1, skeleton.n_joints):
        if skeleton.parents[other] in found:
            found.append(other)
    return found
