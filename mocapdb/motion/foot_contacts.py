"""Legs, and feet on the ground: where they rest, and how far they slide there."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.motion.body import Body, understand, understand_pose
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import LEAST_CONTACT_S, NEAR_GROUND_M, SLOW_M_S, SLOW_SHARE, SOLE_REACH

__all__ = ["Leg", "contacts_by_foot", "find_contacts", "find_legs", "foot_slide_mm", "runs"]


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


def find_legs(skeleton: Skeleton, positions: FloatArray | None = None) -> tuple[Leg, ...]:
    """Return the legs of a skeleton, in the order of its joints.

    Parameters
    ----------
    skeleton : Skeleton
    positions : (F, J, 3), optional, skeleton units
        Of a motion. Without one only names tell, or else the rest pose.

    Notes
    -----
    A body's legs are what `mocapdb.motion.body` says. Of what is no human body a leg is a chain of
    three bones or more that ends as low as the lowest one, in the median frame; its two longest
    neighbours are thigh and shank.
    """
    named = _named_legs(skeleton)
    if named:
        return named
    if positions is None:
        return _lowest_legs(skeleton, skeleton.rest_positions[None])
    return _legs_of(understand_pose(skeleton, positions)) or _lowest_legs(skeleton, positions)


@lru_cache(maxsize=64)
def _named_legs(skeleton: Skeleton) -> tuple[Leg, ...]:
    """Return the legs that names tell, which no motion changes."""
    body = understand(skeleton)
    return _legs_of(body) if body.by == "names" or not body.is_human else ()


def _legs_of(body: Body) -> tuple[Leg, ...]:
    """Return the legs of what was found of a body."""
    legs = []
    for side in SIDES:
        joints = [f"{side}_{part}" for part in ("hip", "knee", "ankle")]
        if all(joint in body.parts and joint in body.turns for joint in joints):
            hip, knee, ankle = (body.parts[joint] for joint in joints)
            ball = body.parts.get(f"{side}_toe", ankle)
            legs.append(Leg(hip, knee, ankle, ball, *(body.turns[joint] for joint in joints)))
    return tuple(sorted(legs))


def _lowest_legs(skeleton: Skeleton, positions: FloatArray) -> tuple[Leg, ...]:
    """Return the chains of joints that end lowest in the median frame."""
    heights = np.median(positions[:, :, skeleton.up_index], axis=0)
    leaves = [joint for joint, below in enumerate(skeleton.children) if not below]
    lowest = min(heights[leaf] for leaf in leaves)
    legs: dict[int, Leg] = {}
    for leaf in leaves:
        if heights[leaf] > lowest + SOLE_REACH * float(np.ptp(heights)):
            continue
        leg = _leg_of(skeleton, skeleton.chain_to_root(leaf)[::-1])
        if leg is not None:
            legs.setdefault(leg.knee, leg)
    return tuple(legs.values())


def _leg_of(skeleton: Skeleton, chain: list[int]) -> Leg | None:
    """Return the leg that a chain from the root down holds."""
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
        Of a motion with its root motion.
    fps : float, frames per second

    Notes
    -----
    A foot rests where its ball is within 6 cm of its lowest and slow: under 0.45 m/s or 15 % of
    its fastest. Rests under 0.06 s do not count.
    """
    legs = find_legs(skeleton, positions)
    contacts = np.zeros((len(positions), len(legs)), dtype=bool)
    for i, leg in enumerate(legs):
        ball = positions[:, leg.ball] * skeleton.metres_per_unit
        speed = _speed(ball, fps)
        height = ball[:, skeleton.up_index]
        low = height < height.min() + NEAR_GROUND_M
        slow = speed < max(SLOW_M_S, SLOW_SHARE * float(np.percentile(speed, 95)))
        contacts[:, i] = _long_enough(low & slow, LEAST_CONTACT_S * fps)
    return contacts


def contacts_by_foot(skeleton: Skeleton, positions: FloatArray, fps: float) -> dict[str, BoolArray]:
    """Return for each foot whether it rests, (F,): ``left`` before ``right``.

    Feet of what is no human body go by the names of their joints. See `find_contacts`.
    """
    legs = find_legs(skeleton, positions)
    contacts = find_contacts(skeleton, positions, fps)
    ankles = {
        joint: side
        for side in SIDES
        for part, joint in understand_pose(skeleton, positions).parts.items()
        if part == f"{side}_ankle"
    }
    found = {
        ankles.get(leg.ankle, skeleton.names[leg.ball]): contacts[:, i]
        for i, leg in enumerate(legs)
    }
    return {foot: found[foot] for foot in (*SIDES, *found) if foot in found}


def foot_slide_mm(skeleton: Skeleton, positions: FloatArray, contacts: BoolArray) -> float:
    """Return how far resting feet wander: the mean distance from where each rests, level, in mm.

    Zero where no foot rests.
    """
    level = [i for i in range(3) if i != skeleton.up_index]
    away = []
    for i, leg in enumerate(find_legs(skeleton, positions)):
        for rest in runs(contacts[:, i]):
            places = positions[rest][:, leg.ball][:, level]
            away.append(np.linalg.norm(places - places.mean(axis=0), axis=1))
    if not away:
        return 0.0
    return float(np.concatenate(away).mean()) * skeleton.metres_per_unit * 1000.0


def runs(flags: BoolArray) -> list[np.ndarray]:
    """Return the frames of each unbroken run of True."""
    frames = np.flatnonzero(flags)
    if len(frames) == 0:
        return []
    return np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)


def _speed(path: FloatArray, fps: float) -> FloatArray:
    """Return (F,) the mean of the speeds before and after each frame."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1) * fps
    if len(steps) == 0:
        return np.zeros(len(path))
    return np.asarray((np.append(steps, steps[-1]) + np.insert(steps, 0, steps[0])) / 2)


def _long_enough(flags: BoolArray, least: float) -> BoolArray:
    kept = np.zeros_like(flags)
    for run in runs(flags):
        if len(run) >= least:
            kept[run] = True
    return kept
