"""From pelvis, feet and joint angles over time to the channels of a body.

Motions say where the pelvis and the feet are and how the upper body bends; the legs follow by
inverse kinematics. A foot that is planted is therefore planted exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.corpus.synthetic.body import Dimensions, measure
from mocapdb.corpus.tuning import LONGEST_REACH
from mocapdb.motion.kinematics import axis_rotations
from mocapdb.motion.rotations import elementary
from mocapdb.motion.skeleton import Skeleton

__all__ = ["PoseTargets", "blend", "concatenate", "highest_pelvis", "solve"]

SIDES = ("l", "r")


@dataclass(frozen=True)
class PoseTargets:
    """What a body is to do, frame by frame, in metres and degrees.

    The world is y up, the body faces +z, its left is +x and the ground is y = 0.

    Attributes
    ----------
    pelvis_m : (F, 3)
        Position of the root.
    pelvis_deg : (F, 3)
        Its tilt forwards (about x), turn to the left (about y) and list to the right (about z).
    balls_m : (F, 2, 3)
        Position of the ball of the left and right foot, where the toes begin.
    foot_pitch_deg : (F, 2)
        Pitch of the feet, 0 is flat on the ground, positive is heel up.
    foot_turn_deg : (F, 2)
        Turn of the feet to the left.
    contacts : (F, 2)
        Whether a foot is on the ground.
    angles : dict of str to (F,)
        Channels of the other joints, such as ``"lhumerus.rx"``, in degrees. Zero where absent.
    """

    pelvis_m: FloatArray
    pelvis_deg: FloatArray
    balls_m: FloatArray
    foot_pitch_deg: FloatArray
    foot_turn_deg: FloatArray
    contacts: BoolArray
    angles: Mapping[str, FloatArray]

    def __len__(self) -> int:
        return len(self.pelvis_m)

    def __getitem__(self, frames: slice) -> PoseTargets:
        """Return some of the frames."""
        return self._map(lambda values: values[frames])

    def moved(self, offset_m: FloatArray) -> PoseTargets:
        """Return the same poses elsewhere, moved by (3,) or (F, 3) metres."""
        return replace(
            self,
            pelvis_m=self.pelvis_m + offset_m,
            balls_m=self.balls_m + np.atleast_2d(offset_m)[:, None],
        )

    def _map(self, change: Callable[..., FloatArray], *others: PoseTargets) -> PoseTargets:
        """Return targets whose every array is `change` of the same array of several."""
        several = (self, *others)

        def changed(name: str) -> Any:
            return change(*(getattr(targets, name) for targets in several))

        return PoseTargets(
            pelvis_m=changed("pelvis_m"),
            pelvis_deg=changed("pelvis_deg"),
            balls_m=changed("balls_m"),
            foot_pitch_deg=changed("foot_pitch_deg"),
            foot_turn_deg=changed("foot_turn_deg"),
            contacts=changed("contacts"),
            angles={
                name: change(*(targets.angles[name] for targets in several)) for name in self.angles
            },
        )


def solve(skeleton: Skeleton, targets: PoseTargets) -> FloatArray:
    """Return the (F, C) channels that bring a body into the poses.

    Feet that are out of reach are approached with a nearly straight leg.
    """
    column = {name: i for i, name in enumerate(skeleton.channel_names)}
    channels = np.zeros((len(targets), skeleton.n_channels))
    channels[:, [column[f"root.t{axis}"] for axis in "xyz"]] = (
        targets.pelvis_m / skeleton.metres_per_unit
    )
    channels[:, [column[f"root.r{axis}"] for axis in "xyz"]] = targets.pelvis_deg
    for name, values in targets.angles.items():
        channels[:, column[name]] = values
    dimensions = measure(skeleton)
    pelvis = _pelvis_rotations(targets)
    for side, letter in enumerate(SIDES):
        frame = axis_rotations(skeleton)[skeleton.joint(f"{letter}femur")]
        leg = _solve_leg(dimensions, targets, side, pelvis @ frame)
        for name, values in leg.items():
            channels[:, column[letter + name]] = np.rad2deg(values)
    return channels


def highest_pelvis(dimensions: Dimensions, targets: PoseTargets) -> FloatArray:
    """Return (F,) how high the pelvis may be for both feet to be in reach, in metres."""
    pelvis = _pelvis_rotations(targets)
    highest = np.full(len(targets), np.inf)
    for side in range(2):
        hip = targets.pelvis_m + pelvis @ dimensions.hips[side]
        ankle = _ankles(dimensions, targets, side)
        apart = ankle - hip
        reach = LONGEST_REACH * dimensions.leg
        room = reach**2 - apart[:, 0] ** 2 - apart[:, 2] ** 2
        below = np.sqrt(np.maximum(room, 0.0))
        np.minimum(highest, ankle[:, 1] + below - (hip - targets.pelvis_m)[:, 1], out=highest)
    return highest


def blend(a: PoseTargets, b: PoseTargets, weight: FloatArray) -> PoseTargets:
    """Return the motion that goes from `a` (weight 0) to `b` (weight 1), frame by frame.

    Feet count as on the ground only where both motions have them there.
    """

    def mix(x: FloatArray, y: FloatArray) -> FloatArray:
        if x.dtype == np.bool_:
            return np.logical_and(x, y)
        w = weight.reshape(-1, *[1] * (x.ndim - 1))
        return np.asarray((1 - w) * x + w * y)

    return a._map(mix, b)


def concatenate(parts: Sequence[PoseTargets]) -> PoseTargets:
    """Return one motion after the other; all have the same `angles`."""
    return parts[0]._map(lambda *arrays: np.concatenate(arrays), *parts[1:])


def _pelvis_rotations(targets: PoseTargets) -> FloatArray:
    tilt, turn, list_ = np.deg2rad(targets.pelvis_deg).T
    return elementary("Z", list_) @ elementary("Y", turn) @ elementary("X", tilt)


def _foot_rotations(targets: PoseTargets, side: int) -> FloatArray:
    turn = elementary("Y", np.deg2rad(targets.foot_turn_deg[:, side]))
    return turn @ elementary("X", np.deg2rad(targets.foot_pitch_deg[:, side]))


def _ankles(dimensions: Dimensions, targets: PoseTargets, side: int) -> FloatArray:
    to_ball = np.array([0.0, -dimensions.ankle_height, dimensions.ball_forward])
    return np.asarray(targets.balls_m[:, side] - _foot_rotations(targets, side) @ to_ball)


def _solve_leg(
    dimensions: Dimensions, targets: PoseTargets, side: int, frame: FloatArray
) -> dict[str, FloatArray]:
    """Return the angles of one leg in radians, by channel without the side's letter.

    Parameters
    ----------
    frame : (F, 3, 3)
        The leg's local frame in the world: the pelvis's rotation times the femur's ``axis``.

    Notes
    -----
    The femur turns by ``Rz Ry Rx`` and the knee by a further ``Rx(knee)``. Seen from the hip, in
    the local frame, the ankle is then at ``Rz Ry r (0, -cos a, -sin a)`` where r follows from the
    knee and a is the femur's rx plus the angle between thigh and hip-ankle line. With ry given
    (knees point where the feet do), z gives a, and the direction in the xy plane gives rz.
    """
    thigh, shank = dimensions.thigh, dimensions.shank
    pelvis_m = targets.pelvis_m
    hip = pelvis_m + _pelvis_rotations(targets) @ dimensions.hips[side]
    to_ankle = _apply_inverse(frame, _ankles(dimensions, targets, side) - hip)
    distance = np.linalg.norm(to_ankle, axis=1)
    reach = np.clip(distance, abs(thigh - shank) + 0.1 * shank, LONGEST_REACH * (thigh + shank))
    knee = np.arccos((reach**2 - thigh**2 - shank**2) / (2 * thigh * shank))
    direction = to_ankle / distance[:, None]
    turn = np.deg2rad(targets.foot_turn_deg[:, side] - targets.pelvis_deg[:, 1])
    a = np.arcsin(np.clip(-direction[:, 2] / np.cos(turn), -1.0, 1.0))
    spread = np.arctan2(direction[:, 1], direction[:, 0]) - np.arctan2(
        -np.cos(a), -np.sin(turn) * np.sin(a)
    )
    flexion = a - np.arctan2(shank * np.sin(knee), thigh + shank * np.cos(knee))
    shank_frame = (
        frame
        @ elementary("Z", spread)
        @ elementary("Y", turn)
        @ elementary("X", np.asarray(flexion + knee))
    )
    return {
        "femur.rx": flexion,
        "femur.ry": turn,
        "femur.rz": spread,
        "tibia.rx": knee,
        **_solve_foot(dimensions, targets, side, shank_frame),
    }


def _solve_foot(
    dimensions: Dimensions, targets: PoseTargets, side: int, shank_frame: FloatArray
) -> dict[str, FloatArray]:
    """Return the angles of a foot and its toes in radians.

    The foot turns by ``Ry(rz) Rx(rx)`` in the shank's frame, which suffices to put the ball
    exactly where it is wanted. Toes follow the foot unless that would push them into the ground.
    """
    to_ball = np.array([0.0, -dimensions.ankle_height, dimensions.ball_forward])
    wanted = _apply_inverse(shank_frame, _foot_rotations(targets, side) @ to_ball)
    length = np.linalg.norm(to_ball)
    slope = np.arcsin(dimensions.ankle_height / length)  # of the line from the ankle to the ball
    ankle = np.arcsin(np.clip(-wanted[:, 1] / length, -1.0, 1.0)) - slope
    turn = np.arctan2(wanted[:, 0], wanted[:, 2])
    foot = shank_frame @ elementary("Y", turn) @ elementary("X", ankle)
    room = np.maximum(targets.balls_m[:, side, 1] / dimensions.toe, 0.0)
    # all of the room while the tip is on the ground; once in the air toes stretch gradually
    deepest = np.where(room < 0.5, room, 1.0 - 0.5 * np.exp(1.0 - 2.0 * room))
    descent = np.minimum(-foot[:, 1, 2], deepest)
    up_y, up_z = foot[:, 1, 1], foot[:, 1, 2]
    # the toes' direction (0, -sin, cos) in the foot's frame descends by this
    steepest = np.hypot(up_y, up_z)
    toes = np.arcsin(np.clip(descent / steepest, -1.0, 1.0)) + np.arctan2(up_z, up_y)
    return {"foot.rx": ankle, "foot.rz": turn, "toes.rx": toes}


def _apply_inverse(rotations: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("fji,fj->fi", rotations, vectors))
