"""The body in metres, and heel, ball and tip of each foot over the ground."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import GaitError
from mocapdb.gait.tuning import (
    BELT_REACH_S,
    FLAT_SHARE,
    HEEL_BACK,
    LEAST_BELT_M_S,
    MOST_TRAVEL_OF_BELT,
)
from mocapdb.motion.body import part_from_scene, understand
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange, live_frames
from mocapdb.motion.kinematics import forward_kinematics, to_metres
from mocapdb.motion.skeleton import Skeleton

__all__ = ["UP", "Foot", "Walker", "point_speeds", "understand_walker"]

UP = np.array([0.0, 1.0, 0.0])
NEEDED = tuple(f"{side}_{part}" for side in SIDES for part in ("hip", "knee", "ankle"))


@dataclass(frozen=True)
class Foot:
    """A foot over the ground.

    Attributes
    ----------
    heel, ball, tip : (F, 3), metres
        The sole under the heel, the ball, and the tip of the toes; relative to the belt where
        there is one. All three are the ankle where a skeleton has no foot.
    sole_up : (3,)
        The direction that is up while the foot is flat, seen from the joint that turns the foot.
    """

    heel: FloatArray
    ball: FloatArray
    tip: FloatArray
    sole_up: FloatArray

    @property
    def points(self) -> FloatArray:
        """(3, F, 3) heel, ball and tip."""
        return np.stack([self.heel, self.ball, self.tip])

    @property
    def is_whole(self) -> bool:
        """Whether there is more of it than the ankle."""
        return not np.array_equal(self.heel, self.ball)


@dataclass(frozen=True)
class Walker:
    """A clip of a body with two legs, as gait is looked at.

    Attributes
    ----------
    clip : Clip
        Parted from its scene.
    positions : (F, J, 3), metres
        Y up.
    rotations : (F, J, 3, 3)
    rest_positions : (J, 3), metres
        Y up.
    to_y_up : (3, 3)
        What turns the file's axes so that Y is up.
    parts, turns : mapping of str to int
        As `mocapdb.motion.body.Body` has them.
    feet : (Foot, Foot)
        Left and right.
    live : FrameRange
        Without the frame that the capture holds at either end: a foot that stops in the air there
        is not on the ground.
    belt_m_s : (3,)
        Velocity of the ground under a body that walks in place; zero elsewhere.
    notes : tuple of str
        What was assumed.
    """

    clip: Clip
    positions: FloatArray
    rotations: FloatArray
    rest_positions: FloatArray
    to_y_up: FloatArray
    parts: Mapping[str, int]
    turns: Mapping[str, int]
    feet: tuple[Foot, Foot]
    live: FrameRange
    belt_m_s: FloatArray
    notes: tuple[str, ...]

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.clip.fps

    @property
    def hips(self) -> FloatArray:
        """(F, 3) the middle of the hips over the ground, in metres."""
        middle = (self.place("left_hip") + self.place("right_hip")) / 2
        return middle - np.arange(len(middle))[:, None] / self.fps * self.belt_m_s

    @property
    def leg_m(self) -> float:
        """Length of thigh and shank, the mean of both sides."""
        bones = [("hip", "knee"), ("knee", "ankle")]
        return float(
            sum(
                np.linalg.norm(self.place(f"{side}_{a}") - self.place(f"{side}_{b}"), axis=1).mean()
                for side in SIDES
                for a, b in bones
            )
            / 2
        )

    def place(self, part: str) -> FloatArray:
        """Return (F, 3) where a canonical joint is, in metres."""
        return self.positions[:, self.parts[part]]

    def turn(self, part: str) -> FloatArray:
        """Return (F, 3, 3) the rotation of what begins at a canonical joint."""
        return self.rotations[:, self.turns[part]]


def understand_walker(clip: Clip) -> Walker:
    """Return a clip as gait is looked at.

    Raises
    ------
    GaitError
        If the body has not two legs, or the clip is too short.
    """
    clip, _ = part_from_scene(clip)
    name = clip.name or "the clip"
    if len(clip) < 3:
        raise GaitError(
            f"Expected a motion, but {name!r} has {len(clip)} frame{'s'[: len(clip) > 1]}."
        )
    body = understand(clip.skeleton, clip.channels)
    missing = [joint for joint in NEEDED if joint not in body.parts or joint not in body.turns]
    if missing:
        why = body.refusal or f"its {missing[0].replace('_', ' ')} was not found"
        raise GaitError(
            f"Expected a body with two legs and feet, but of {name!r} {why}. "
            "Say which joints they are with --joint-map."
        )
    pose = forward_kinematics(clip.skeleton, clip.channels)
    positions = to_metres(clip.skeleton, pose.positions)
    to_y_up = to_metres(clip.skeleton, np.eye(3)).T / clip.skeleton.metres_per_unit
    rotations = to_y_up @ pose.rotations
    notes = []
    live = live_frames(clip.channels)
    if len(live) < len(clip):
        notes.append(
            f"frames {live.start}:{live.end} are live, those around them are one frame held"
        )
    if len(live) < 3:
        live = FrameRange(0, len(clip))
    chains = {}  # ankle, ball and tip of each foot
    for side in SIDES:
        ankle = body.parts[f"{side}_ankle"]
        toe = body.parts.get(f"{side}_toe", ankle)
        if toe == ankle:
            notes.append(f"no {side} foot below the ankle: events are the ankle's")
        chains[side] = [ankle, toe, ankle if toe == ankle else _tip(clip.skeleton, toe)]
    moving = positions[live.frames]
    hips = moving[:, [body.parts[f"{side}_hip"] for side in SIDES]]
    belt = _belt(moving[:, chains["left"] + chains["right"]], hips, clip.fps)
    if belt.any():
        speed = float(np.linalg.norm(belt))
        notes.append(f"walks in place: the ground goes backwards at {speed:.2f} m/s")
    way = np.arange(len(clip))[:, None, None] / clip.fps * belt
    left, right = (
        _foot(positions[:, chain] - way, rotations[:, body.turns[f"{side}_ankle"]], clip.fps, live)
        for side, chain in chains.items()
    )
    return Walker(
        clip=clip,
        positions=positions,
        rotations=rotations,
        rest_positions=to_metres(clip.skeleton, clip.skeleton.rest_positions),
        to_y_up=to_y_up,
        parts=body.parts,
        turns=body.turns,
        feet=(left, right),
        live=live,
        belt_m_s=belt,
        notes=tuple(notes),
    )


def point_speeds(path: FloatArray, fps: float) -> FloatArray:
    """Return (..., F) the speeds of points (..., F, 3): over two frames, a rate of 60 Hz at most.

    Examples
    --------
    >>> point_speeds(np.outer(np.arange(5.0), [0.1, 0.0, 0.0]), 30.0).round(6).tolist()
    [3.0, 3.0, 3.0, 3.0, 3.0]
    """
    reach = max(1, round(fps / 120))
    frames = np.arange(path.shape[-2])
    after = np.minimum(frames + reach, frames[-1])
    before = np.maximum(frames - reach, 0)
    way = np.linalg.norm(path[..., after, :] - path[..., before, :], axis=-1)
    return np.asarray(way / (after - before) * fps)


def _tip(skeleton: Skeleton, toe: int) -> int:
    """Return the joint at the end of the longest way down from a toe, or the toe itself."""
    best, longest = toe, 0.0
    below = [(toe, 0.0)]
    while below:
        joint, way = below.pop()
        if way > longest:
            best, longest = joint, way
        below += [
            (child, way + float(np.linalg.norm(skeleton.offsets[child])))
            for child in skeleton.children[joint]
        ]
    return best


def _foot(places: FloatArray, turn: FloatArray, fps: float, live: FrameRange) -> Foot:
    """Return a foot from ankle, ball and tip (F, 3, 3), and the rotation (F, 3, 3) of the foot."""
    ankle, ball, tip = places.transpose(1, 0, 2)
    if np.array_equal(ankle, ball):
        return Foot(ankle, ankle, ankle, UP)
    up_in_foot = turn[live.frames, 1, :]  # the world's Y axis, seen from the foot
    speed = point_speeds(ankle[live.frames], fps) + point_speeds(ball[live.frames], fps)
    flat = speed <= np.quantile(speed, FLAT_SHARE)
    sole_up = np.median(up_in_foot[flat], axis=0)
    sole_up /= max(float(np.linalg.norm(sole_up)), 1e-12)
    to_ball = np.median(np.einsum("fji,fj->fi", turn, ball - ankle), axis=0)
    drop = float(to_ball @ sole_up)
    level = to_ball - drop * sole_up
    heel = ankle + turn @ (drop * sole_up - HEEL_BACK * level)
    return Foot(heel, ball, tip, sole_up)


def _belt(feet: FloatArray, hips: FloatArray, fps: float) -> FloatArray:
    """Return the velocity (3,) of the ground under a body that walks in place; else zeros.

    `feet` (F, P, 3) are points of both feet, `hips` (F, 2, 3) the hips.
    """
    still = np.zeros(3)
    points = feet.transpose(1, 0, 2)
    lowest = np.argmin(points[..., 1], axis=0)
    frames = np.arange(len(lowest))
    reach = max(1, round(BELT_REACH_S * fps))
    after, before = np.minimum(frames + reach, frames[-1]), np.maximum(frames - reach, 0)
    way = points[lowest, after] - points[lowest, before]
    velocities = way / ((after - before) / fps)[:, None]
    belt = np.median(velocities, axis=0)
    for _ in range(3):  # without the moments in which a low foot swings
        off = np.linalg.norm(velocities - belt, axis=1)
        belt = np.median(velocities[off <= np.median(off)], axis=0)
    belt[1] = 0.0
    size = float(np.linalg.norm(belt))
    middle = hips.mean(axis=1)
    travel = np.linalg.norm((middle[-1] - middle[0])[[0, 2]]) * fps / (len(frames) - 1)
    steady = np.median(np.linalg.norm((velocities - belt)[:, [0, 2]], axis=1)) < size / 2
    is_belt = size > LEAST_BELT_M_S and travel < MOST_TRAVEL_OF_BELT * size and steady
    return belt if is_belt else still
