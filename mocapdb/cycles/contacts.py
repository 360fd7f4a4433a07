"""Feet on the ground: where a cycle's feet rest, how much they slide, and keeping them there."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from mocapdb._typing import BoolArray, FloatArray
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Leg", "find_contacts", "find_legs", "foot_slide_mm", "planted"]

SOLE_REACH = 0.12  # of the height: leaves so near the lowest one are feet
SLOW_M_S = 0.45
SLOW_SHARE = 0.15  # of the fastest that the foot moves
NEAR_GROUND_M = 0.06
LEAST_CONTACT_S = 0.06
EASE_S = 0.2
SMOOTH_S = 0.02
LEAST_BEND = 1e-4


class Leg(NamedTuple):
    """The joints of a leg, as indices.

    Attributes
    ----------
    hip, knee, ankle : int
        Joints at the places of hip, knee and ankle.
    ball : int
        The joint at the ball of the foot, or at its tip where there is no other: what rests.
    upper, lower, foot : int
        The joints whose rotation turns the thigh, the shank and the foot.
    """

    hip: int
    knee: int
    ankle: int
    ball: int
    upper: int
    lower: int
    foot: int


@lru_cache(maxsize=64)
def find_legs(skeleton: Skeleton) -> tuple[Leg, ...]:
    """Return the legs of a skeleton by its hierarchy: the chains that end lowest at rest.

    A leg is a chain of three bones or more, its two longest neighbours being thigh and shank.
    """
    rest = skeleton.rest_positions[:, skeleton.up_index]
    leaves = [joint for joint, below in enumerate(skeleton.children) if not below]
    lowest = min(rest[leaf] for leaf in leaves)
    legs: dict[int, Leg] = {}
    for leaf in leaves:
        if rest[leaf] > lowest + SOLE_REACH * skeleton.height:
            continue
        chain = [leaf]
        while skeleton.parents[chain[-1]] >= 0:
            chain.append(int(skeleton.parents[chain[-1]]))
        chain.reverse()  # from the root down
        leg = _leg_of(skeleton, chain)
        if leg is not None:
            legs.setdefault(leg.knee, leg)
    return tuple(legs.values())


def _leg_of(skeleton: Skeleton, chain: list[int]) -> Leg | None:
    lengths = np.linalg.norm(skeleton.offsets[chain], axis=1)
    pairs = lengths[1:-1] + lengths[2:]
    if len(pairs) < 2 or lengths[1:].max() == 0:
        return None
    thigh = int(np.argmax(pairs[:-1])) + 1  # the bone that ends in the knee, with one after it
    hip, knee, ankle = chain[thigh - 1], chain[thigh], chain[thigh + 1]
    ball = next(
        (
            j
            for j, length in zip(chain[thigh + 2 :], lengths[thigh + 2 :], strict=True)
            if length > 0
        ),
        ankle,
    )
    if skeleton.convention == "acclaim":
        foot = chain[thigh + 2] if ball != ankle else ankle
        return Leg(hip, knee, ankle, ball, knee, ankle, foot)
    return Leg(hip, knee, ankle, ball, hip, knee, ankle)


def find_contacts(skeleton: Skeleton, positions: FloatArray, fps: float) -> BoolArray:
    """Return (F, L) whether each leg's foot rests on the ground.

    Parameters
    ----------
    skeleton : Skeleton
    positions : (F, J, 3), skeleton units
        Of a motion with its root motion; frames of whole laps, so that the ends meet.
    fps : float, frames per second

    Notes
    -----
    A foot rests where its ball is within 6 cm of its lowest and slow: under 0.45 m/s or 15 % of
    its fastest. Rests under 0.06 s do not count.
    """
    legs = find_legs(skeleton)
    contacts = np.zeros((len(positions), len(legs)), dtype=bool)
    for i, leg in enumerate(legs):
        ball = positions[:, leg.ball] * skeleton.metres_per_unit
        step = np.diff(ball, axis=0, append=2 * ball[-1:] - ball[-2:-1])
        speed = np.linalg.norm(step, axis=1) * fps
        speed = (speed + np.roll(speed, 1)) / 2
        height = ball[:, skeleton.up_index]
        low = height < height.min() + NEAR_GROUND_M
        slow = speed < max(SLOW_M_S, SLOW_SHARE * float(np.percentile(speed, 95)))
        contacts[:, i] = _long_enough(low & slow, LEAST_CONTACT_S * fps)
    return contacts


def foot_slide_mm(skeleton: Skeleton, positions: FloatArray, contacts: BoolArray) -> float:
    """Return how far resting feet wander: the mean distance from where each rests, level, in mm.

    Zero where no foot rests.
    """
    level = [i for i in range(3) if i != skeleton.up_index]
    away = []
    for i, leg in enumerate(find_legs(skeleton)):
        for rest in _runs(contacts[:, i]):
            places = positions[rest][:, leg.ball][:, level]
            away.append(np.linalg.norm(places - places.mean(axis=0), axis=1))
    if not away:
        return 0.0
    return float(np.concatenate(away).mean()) * skeleton.metres_per_unit * 1000.0


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
    for rest in _runs(contact):
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


def _runs(flags: BoolArray) -> list[np.ndarray]:
    """Return the frames of each unbroken run of True."""
    frames = np.flatnonzero(flags)
    if len(frames) == 0:
        return []
    return np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)


def _long_enough(flags: BoolArray, least: float) -> BoolArray:
    kept = np.zeros_like(flags)
    for run in _runs(flags):
        if len(run) >= least:
            kept[run] = True
    return kept
