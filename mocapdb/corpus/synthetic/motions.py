"""The classes of motion, each a function of phase.

Since a pose depends on time only through the phase, a change of tempo or a noisy phase leaves
planted feet planted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.corpus.synthetic.body import Dimensions
from mocapdb.corpus.synthetic.gait import GRAVITY, RUN, TURN, WALK, Gait, bounce, gait_targets
from mocapdb.corpus.synthetic.posing import PoseTargets, highest_pelvis
from mocapdb.corpus.synthetic.style import Style, arm, neck, rest_pose, spine
from mocapdb.corpus.tuning import HOP_DUTY, LONGEST_FLIGHT_S

__all__ = ["MOTIONS", "Motion", "Performance"]


@dataclass(frozen=True)
class Performance:
    """Who does it and how.

    Attributes
    ----------
    dimensions : Dimensions
    style : Style
    period_s : float, seconds
        Of a cycle.
    pace : float
        Length of a stride relative to the usual.
    """

    dimensions: Dimensions
    style: Style
    period_s: float
    pace: float = 1.0

    @property
    def size(self) -> float:
        """Stature relative to 1.75 m."""
        return self.dimensions.size


@dataclass(frozen=True)
class Motion:
    """A class of motion.

    Attributes
    ----------
    targets : callable
        From the phase in cycles (F,) and a performance to the poses.
    period_s : float, seconds
        Usual duration of a cycle for a body of 1.75 m.
    description : str
    gait : Gait, optional
        Where the motion goes somewhere.
    """

    targets: Callable[[FloatArray, Performance], PoseTargets]
    period_s: float
    description: str
    gait: Gait | None = None

    def performance(self, dimensions: Dimensions, style: Style, speed: float) -> Performance:
        """Return who does it; long legs swing slowly, as pendulums do."""
        period_s = self.period_s * style.tempo * math.sqrt(dimensions.size)
        if self.gait is None:
            return Performance(dimensions, style, period_s / speed)
        pace = math.sqrt(speed)
        return Performance(dimensions, style, period_s / pace, pace)

    def perform(self, cycle: FloatArray, performance: Performance) -> PoseTargets:
        """Return the poses, with the pelvis as low as the legs need it.

        It is lowered by one amount for the whole cycle, and so stays a function of phase.
        """
        one_cycle = np.linspace(0.0, 1.0, 96, endpoint=False)
        sample = self.targets(one_cycle, performance)
        room = highest_pelvis(performance.dimensions, sample) - sample.pelvis_m[:, 1]
        targets = self.targets(cycle, performance)
        targets.pelvis_m[:, 1] += min(0.0, float(room.min()))
        return targets


def _walk(cycle: FloatArray, who: Performance) -> PoseTargets:
    return gait_targets(WALK, cycle, who.dimensions, who.style, who.pace, who.period_s)


def _run(cycle: FloatArray, who: Performance) -> PoseTargets:
    return gait_targets(RUN, cycle, who.dimensions, who.style, who.pace, who.period_s)


def _hop(cycle: FloatArray, who: Performance) -> PoseTargets:
    """Return hops on both legs on the spot; phase 0 is touch-down."""
    n_frames, style = len(cycle), who.style
    own = cycle % 1.0
    flight_s = min((1 - HOP_DUTY) * who.period_s, LONGEST_FLIGHT_S)
    duty = 1 - flight_s / who.period_s
    height_m = bounce(cycle, duty, who.period_s, 0.3 * who.dimensions.leg)
    in_air = np.clip((own - duty) / (1 - duty), 0.0, 1.0)
    pelvis = np.zeros((n_frames, 3))
    pelvis[:, 1] = who.dimensions.standing + 0.045 * who.size + height_m
    pelvis[:, 2] = -0.02 * who.size
    apex_m = GRAVITY * flight_s**2 / 8
    balls = _feet(n_frames, who, half_track=0.05)
    balls[:, :, 1] += (1.05 * apex_m * np.sin(math.pi * in_air) ** 2)[:, None]
    # on the toes at both ends of the contact, nearly flat in its middle, pointed in the air
    on_toes = 0.5 + 0.5 * np.cos(TURN * own / duty)
    pitch = np.where(own < duty, 4.0 + 26.0 * on_toes, 30.0 + 12.0 * np.sin(math.pi * in_air))
    crouch = -height_m / (0.1 * who.size)
    lean = 8.0 + style.lean_deg + 5.0 * np.clip(crouch, -0.5, 2.0)
    swing = style.arm_swing * 10.0 * np.cos(TURN * (cycle - 0.75))
    angles = {
        **rest_pose(n_frames, style),
        **spine(lean, np.zeros(n_frames), np.zeros(n_frames)),
        **neck(-0.7 * lean, np.zeros(n_frames), np.zeros(n_frames)),
    }
    for side in "lr":
        angles |= arm(
            side,
            flexion=8.0 + swing,
            inward=np.full(n_frames, 15.0),
            abduction=style.abduction_deg + 8.0 + 0.5 * swing,
            elbow=62.0 + style.elbow_deg + 0.5 * swing,
        )
    return _in_place(pelvis, balls, pitch, own < duty, angles, who)


def _box(cycle: FloatArray, who: Performance) -> PoseTargets:
    """Return jabs from a guard, left at a quarter of the cycle and right at three quarters."""
    n_frames, style = len(cycle), who.style
    left, right = _pulse(cycle - 0.25, 7.0), _pulse(cycle - 0.75, 7.0)
    vigour = style.vigour
    balls = _feet(n_frames, who, half_track=0.085)
    balls[:, 0, 2] += 0.13 * who.size
    balls[:, 1, 2] -= 0.17 * who.size
    pelvis = np.zeros((n_frames, 3))
    dip = 0.012 * who.size * np.cos(2 * TURN * cycle)
    pelvis[:, 0] = 0.015 * who.size * np.sin(TURN * cycle)
    pelvis[:, 1] = who.dimensions.standing - 0.055 * who.size + dip
    pelvis[:, 2] = who.size * vigour * (0.04 * (left + right) - 0.03)
    hips_turn = vigour * (8.0 * right - 5.0 * left) - 14.0
    shoulders_turn = vigour * (26.0 * right - 16.0 * left) - 4.0
    lean = 10.0 + style.lean_deg + 5.0 * (left + right)
    angles = {
        **rest_pose(n_frames, style),
        **spine(lean, shoulders_turn, np.zeros(n_frames)),
        **neck(-0.3 * lean, -shoulders_turn - hips_turn, np.zeros(n_frames)),
    }
    for side, out in (("l", left), ("r", right)):
        guard = 1.0 - out
        angles |= arm(
            side,
            flexion=86.0 * out + 38.0 * guard,
            inward=6.0 * out + 14.0 * guard,
            abduction=6.0 * out + (style.abduction_deg + 6.0) * guard,
            elbow=9.0 * out + (118.0 + style.elbow_deg) * guard,
        )
    pitch = np.zeros(n_frames)
    targets = _in_place(pelvis, balls, pitch, np.ones(n_frames, dtype=bool), angles, who)
    targets.pelvis_deg[:, 1] = hips_turn
    targets.foot_turn_deg[:, 1] -= 20.0
    return targets


def _wave(cycle: FloatArray, who: Performance) -> PoseTargets:
    """Return a wave of the right hand beside the head; phase 0 is the hand furthest inside."""
    n_frames, style = len(cycle), who.style
    balls = _feet(n_frames, who, half_track=0.06)
    pelvis = np.zeros((n_frames, 3))
    pelvis[:, 0] = 0.006 * who.size * np.cos(TURN * cycle)
    pelvis[:, 1] = who.dimensions.standing - 0.003 * who.size
    aside = np.cos(TURN * cycle)
    still = np.zeros(n_frames)
    angles = {
        **rest_pose(n_frames, style),
        **spine(still + 2.0 + style.lean_deg, still, 3.0 + 1.5 * aside),
        **neck(still, -still - 5.0, -2.0 * aside),
        **arm("l", flexion=still, inward=still + 5.0, abduction=still + 9.0, elbow=still + 15.0),
        **arm(
            "r",
            flexion=still + 12.0,
            inward=-72.0 + 6.0 * aside,
            abduction=84.0 + style.abduction_deg + 4.0 * aside,
            elbow=82.0 + style.elbow_deg + 27.0 * style.vigour * aside,
        ),
    }
    angles["rhand.rx"] = angles["rhand.rx"] + 12.0 * np.cos(TURN * (cycle - 0.1))
    pitch = np.zeros(n_frames)
    return _in_place(pelvis, balls, pitch, np.ones(n_frames, dtype=bool), angles, who)


def _squat(cycle: FloatArray, who: Performance) -> PoseTargets:
    """Return squats with the arms lifted forwards; phase 0 is standing."""
    n_frames, style = len(cycle), who.style
    depth = style.vigour * (0.5 - 0.5 * np.cos(TURN * cycle))
    balls = _feet(n_frames, who, half_track=0.085)
    pelvis = np.zeros((n_frames, 3))
    pelvis[:, 1] = who.dimensions.standing - 0.01 * who.size - 0.42 * who.dimensions.leg * depth
    pelvis[:, 2] = -0.20 * who.dimensions.leg * depth
    tilt = 22.0 * depth
    still = np.zeros(n_frames)
    lean = 2.0 + style.lean_deg + 16.0 * depth
    angles = {
        **rest_pose(n_frames, style),
        **spine(lean, still, still),
        **neck(-0.7 * (tilt + lean), still, still),
    }
    for side in "lr":
        angles |= arm(
            side,
            flexion=2.0 + 115.0 * depth,
            inward=still + 4.0,
            abduction=still + style.abduction_deg,
            elbow=12.0 + style.elbow_deg - 6.0 * depth,
        )
    pitch = np.zeros(n_frames)
    targets = _in_place(pelvis, balls, pitch, np.ones(n_frames, dtype=bool), angles, who)
    targets.pelvis_deg[:, 0] = tilt
    targets.foot_turn_deg[:] *= 2.0
    return targets


def _feet(n_frames: int, who: Performance, half_track: float) -> FloatArray:
    """Return (F, 2, 3) balls of the feet beside each other, the ankles under the hips."""
    aside = half_track * who.style.track * who.dimensions.height
    forward = who.dimensions.left_hip[2] + who.dimensions.ball_forward - 0.01 * who.size
    return np.tile([[aside, 0.0, forward], [-aside, 0.0, forward]], (n_frames, 1, 1))


def _in_place(
    pelvis: FloatArray,
    balls: FloatArray,
    pitch: FloatArray,
    on_ground: np.ndarray,
    angles: dict[str, FloatArray],
    who: Performance,
) -> PoseTargets:
    """Return targets with both feet alike."""
    n_frames = len(pelvis)
    toe_out = who.style.toe_out_deg
    return PoseTargets(
        pelvis,
        np.zeros((n_frames, 3)),
        balls,
        np.stack([pitch, pitch], axis=1),
        np.tile([toe_out, -toe_out], (n_frames, 1)),
        np.stack([on_ground, on_ground], axis=1),
        angles,
    )


def _pulse(cycle: FloatArray, sharpness: float) -> FloatArray:
    """Return a smooth periodic pulse of height 1 at phase 0 (von Mises)."""
    return np.asarray(np.exp(sharpness * (np.cos(TURN * cycle) - 1)))


MOTIONS = {
    "walk": Motion(_walk, WALK.period_s, "walk straight ahead", WALK),
    "run": Motion(_run, RUN.period_s, "run straight ahead", RUN),
    "hop": Motion(_hop, 0.58, "hop on the spot on both legs"),
    "box": Motion(_box, 1.30, "box: jabs with alternate arms"),
    "wave": Motion(_wave, 0.95, "wave with the right hand"),
    "squat": Motion(_squat, 2.40, "squats with lifted arms"),
}
