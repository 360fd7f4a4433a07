"""Walking and running from normative joint-angle curves.

The curves are short Fourier series that follow the shape of published sagittal angles: walking
after Winter (*The Biomechanics and Motor Control of Human Gait*, 1991) and Perry (*Gait Analysis*,
1992), running after Novacheck (Gait and Posture 7, 1998), pelvis after Perry, arms after Murray
et al. (Am. J. Phys. Med. 46, 1967). They say how the leg swings, how the foot rolls and how long
the stride is. During stance the foot stays where it landed, and the rest of the swing is bent
smoothly to meet it, so the solved angles differ from the curves by a few degrees.

Walking faster lengthens the stride and quickens the cadence in equal parts: the walk ratio is
constant (Sekiya and Nagasaki, Gait and Posture 7, 1998).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.corpus.synthetic.body import Dimensions
from mocapdb.corpus.synthetic.posing import PoseTargets
from mocapdb.corpus.synthetic.style import Style, arm, neck, rest_pose, spine
from mocapdb.corpus.tuning import DIP_PHASE

__all__ = ["RUN", "WALK", "Gait", "Harmonics", "bounce", "gait_targets", "stride_m"]

TURN = 2 * math.pi
GRAVITY = 9.81


@dataclass(frozen=True)
class Harmonics:
    """A periodic curve: the cosine terms from the mean upwards, and the sine terms."""

    cosine: tuple[float, ...]
    sine: tuple[float, ...]

    def __call__(self, cycle: FloatArray) -> FloatArray:
        """Return the curve at a phase counted in cycles."""
        angle = TURN * np.asarray(cycle)
        total = np.full(angle.shape, self.cosine[0])
        for k, (a, b) in enumerate(zip(self.cosine[1:], self.sine, strict=True), start=1):
            total += a * np.cos(k * angle) + b * np.sin(k * angle)
        return total


@dataclass(frozen=True)
class Gait:
    """A way of going. Phase 0 is the contact of the foot; angles in degrees.

    Attributes
    ----------
    hip, knee, ankle : Harmonics
        Flexion of the hip relative to the pelvis, of the knee, and of the ankle towards the shin.
    duty : float
        Share of the cycle that a foot is on the ground.
    flat : (float, float, float, float)
        Phases when the foot begins to be put down flat, is flat, begins to rise and has risen as
        the curves say.
    tilt, lean : float
        Of the pelvis and of the trunk, forwards.
    pelvis_turn, pelvis_list, trunk_turn : float
        Amplitudes.
    rise_m, sway_m, surge_m : float, metres
        Amplitudes of the pelvis up and down, to the sides, and to and fro, for a body of 1.75 m.
        Where there is a flight phase, the height follows from gravity instead.
    lift_m : float, metres
        How much higher than by the curves the feet are lifted, to clear the ground.
    toe_bend : float
        How far the toes bend before the foot rolls over their tip.
    half_track : float
        Distance of a foot from the line of progress, as a fraction of stature.
    shoulder, elbow : (float, float)
        Mean and amplitude of flexion.
    period_s : float
        Of a stride, at the speed of the curves, for a body of 1.75 m.
    """

    hip: Harmonics
    knee: Harmonics
    ankle: Harmonics
    duty: float
    flat: tuple[float, float, float, float]
    tilt: float
    lean: float
    pelvis_turn: float
    pelvis_list: float
    trunk_turn: float
    rise_m: float
    sway_m: float
    surge_m: float
    lift_m: float
    toe_bend: float
    half_track: float
    shoulder: tuple[float, float]
    elbow: tuple[float, float]
    period_s: float


WALK = Gait(
    hip=Harmonics((13.5, 19.2, -3.4, 0.0, -0.2, -0.1), (-3.1, -2.6, 1.3, -0.3, 0.2)),
    knee=Harmonics((22.5, -3.3, -13.8, -0.4, -0.4, -0.1), (-19.6, 8.2, 4.0, 0.7, 0.4)),
    ankle=Harmonics((0.3, -1.1, 1.1, -3.4, 2.1, -0.4), (6.1, -6.9, 0.5, -0.5, -1.2)),
    duty=0.61,
    flat=(0.0, 0.075, 0.125, 0.37),
    tilt=10.0,
    lean=3.0,
    pelvis_turn=5.0,
    pelvis_list=4.0,
    trunk_turn=5.0,
    rise_m=0.011,
    sway_m=0.020,
    surge_m=0.024,
    lift_m=0.05,
    toe_bend=33.0,
    half_track=0.030,
    shoulder=(-2.0, 17.0),
    elbow=(22.0, 9.0),
    period_s=1.08,
)
RUN = Gait(
    hip=Harmonics((25.7, 21.8, -6.0, -0.6, -0.1, -0.4), (-14.5, 0.8, 0.6, -0.4, 0.1)),
    knee=Harmonics((46.1, -11.3, -17.4, -1.3, 0.0, -0.2), (-25.2, 18.3, 2.0, 1.6, 0.4)),
    ankle=Harmonics((3.2, 11.4, -8.6, -1.5, 0.8, -0.5), (3.7, 7.1, -4.6, 0.5, -0.4)),
    duty=0.36,
    flat=(0.0, 0.04, 0.125, 0.26),
    tilt=16.0,
    lean=9.0,
    pelvis_turn=7.0,
    pelvis_list=5.0,
    trunk_turn=11.0,
    rise_m=0.0,
    sway_m=0.010,
    surge_m=0.0,
    lift_m=0.065,
    toe_bend=28.0,
    half_track=0.020,
    shoulder=(-12.0, 26.0),
    elbow=(88.0, 12.0),
    period_s=0.70,
)


def stride_m(gait: Gait, dimensions: Dimensions) -> float:
    """Return the length of a stride at the speed of the curves."""
    return _stance(gait, dimensions, 1.0)[0]


def gait_targets(
    gait: Gait,
    cycle: FloatArray,
    dimensions: Dimensions,
    style: Style,
    pace: float,
    period_s: float,
) -> PoseTargets:
    """Return walking or running along +z.

    Parameters
    ----------
    gait : Gait
    cycle : (F,)
        Phase counted in cycles, unwrapped: a whole number where the left foot lands. The way
        travelled is a function of it.
    dimensions : Dimensions
    style : Style
    pace : float
        Length of the stride relative to the curves'.
    period_s : float, seconds
        Of a stride; gives the height of a flight phase.
    """
    n_frames = len(cycle)
    stride = pace * stride_m(gait, dimensions)
    pelvis = np.empty((n_frames, 3))
    pelvis[:, 0] = dimensions.size * gait.sway_m * np.cos(TURN * (cycle - gait.duty / 2))
    pelvis[:, 1] = dimensions.standing + _heave(gait, cycle, dimensions, pace, period_s)
    # fastest when lowest, in the middle of double support
    surge = gait.surge_m * dimensions.size * pace * np.sin(2 * TURN * (cycle - DIP_PHASE))
    pelvis[:, 2] = stride * cycle + surge

    balls = np.zeros((n_frames, 2, 3))
    pitch = np.empty((n_frames, 2))
    contacts = np.empty((n_frames, 2), dtype=bool)
    for side, foot_cycle in enumerate([cycle, cycle + 0.5]):
        own = foot_cycle % 1.0
        track = style.track * gait.half_track * dimensions.height
        balls[:, side, 0] = track if side == 0 else -track
        balls[:, side, 1], balls[:, side, 2] = _foot_path(gait, own, dimensions, pace, period_s)
        balls[:, side, 2] += stride * cycle
        pitch[:, side] = _pitch(gait, own, pace)
        contacts[:, side] = own < gait.duty

    # the pelvis turns with the leading leg, the shoulders against it
    turn = -pace * gait.pelvis_turn * np.cos(TURN * cycle)
    tilt = np.full(n_frames, gait.tilt)
    list_ = gait.pelvis_list * np.cos(TURN * (cycle - 0.17))
    trunk = style.vigour * pace * gait.trunk_turn * np.cos(TURN * cycle)
    angles = {
        **rest_pose(n_frames, style),
        **spine(gait.lean + style.lean_deg - tilt, -turn + trunk, -list_),
        **neck(np.full(n_frames, -0.6 * gait.lean), -trunk, np.zeros(n_frames)),
    }
    swing = style.vigour * style.arm_swing * pace
    for letter, opposite in (("l", cycle + 0.5), ("r", cycle)):
        forward = np.cos(TURN * opposite)
        angles |= arm(
            letter,
            flexion=gait.shoulder[0] + swing * gait.shoulder[1] * forward,
            inward=8.0 + 0.15 * gait.elbow[0] + 4.0 * forward,
            abduction=np.full(n_frames, style.abduction_deg),
            elbow=gait.elbow[0] + style.elbow_deg + swing * gait.elbow[1] * forward,
        )
    turns = np.tile([style.toe_out_deg, -style.toe_out_deg], (n_frames, 1))
    return PoseTargets(
        pelvis, np.stack([tilt, turn, list_], axis=1), balls, pitch, turns, contacts, angles
    )


def bounce(
    cycle: FloatArray, duty: float, period_s: float, deepest_m: float = math.inf
) -> FloatArray:
    """Return the height of a body that flies freely between contacts, in metres.

    Parameters
    ----------
    cycle : (F,)
        Phase counted in bounces, a whole number at touch-down.
    duty : float
        Share of the bounce on the ground.
    period_s : float, seconds
        Duration of a bounce.
    deepest_m : float, metres
        How far the legs may give way on the ground.

    Returns
    -------
    (F,) metres
        Zero at touch-down and take-off: a parabola under gravity in the air, and on the ground
        half a sine that meets it with the same speed, if it is deep enough.
    """
    own = cycle % 1.0
    flight_s, ground_s = (1 - duty) * period_s, duty * period_s
    speed = GRAVITY * flight_s / 2
    in_air_s = (own - duty) * period_s
    parabola = in_air_s * (speed - GRAVITY * in_air_s / 2)
    depth_m = min(speed * ground_s / math.pi, deepest_m)
    dip = -depth_m * np.sin(math.pi * own / duty)
    return np.where(own < duty, dip, parabola)


def _heave(
    gait: Gait, cycle: FloatArray, dimensions: Dimensions, pace: float, period_s: float
) -> FloatArray:
    """Return the height of the pelvis relative to standing, twice up and down in a cycle."""
    if gait.duty < 0.5:
        return bounce(2 * cycle, 2 * gait.duty, period_s / 2) - 0.03 * dimensions.size
    return -(pace**2) * gait.rise_m * dimensions.size * np.cos(2 * TURN * (cycle - DIP_PHASE))


def _pitch(gait: Gait, own: FloatArray, pace: float) -> FloatArray:
    """Return the pitch of a foot at its own phase in [0, 1): the curves', but flat in stance."""
    down, flat, rise, risen = gait.flat
    free = (
        1 - _smooth_step((own - down) / (flat - down)) + _smooth_step((own - rise) / (risen - rise))
    )
    return free * _sagittal(gait, own, pace)[2]


def _sagittal(
    gait: Gait, own: FloatArray, pace: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the inclinations of thigh, shank and foot in degrees, positive from y to z."""
    hip_mean = gait.hip.cosine[0]
    thigh = gait.tilt - hip_mean - pace * (gait.hip(own) - hip_mean)
    shank = thigh + gait.knee(own)
    return thigh, shank, shank - gait.ankle(own)


def _free_path(
    gait: Gait, own: FloatArray, dimensions: Dimensions, pace: float
) -> tuple[FloatArray, FloatArray]:
    """Return height and way forward of the ball of the foot, seen from the hip, by the curves."""
    thigh, shank, foot = np.deg2rad(_sagittal(gait, own, pace))
    y = (
        -dimensions.thigh * np.cos(thigh)
        - dimensions.shank * np.cos(shank)
        - dimensions.ankle_height * np.cos(foot)
        - dimensions.ball_forward * np.sin(foot)
    )
    z = (
        -dimensions.thigh * np.sin(thigh)
        - dimensions.shank * np.sin(shank)
        - dimensions.ankle_height * np.sin(foot)
        + dimensions.ball_forward * np.cos(foot)
    )
    return y, z


def _rocker(
    gait: Gait, own: FloatArray, dimensions: Dimensions, pace: float
) -> tuple[FloatArray, FloatArray]:
    """Return how far the ball of a planted foot is above and before its place on a flat foot.

    The foot rolls over the heel, then over the ball, and when the toes are bent as far as they
    go, over their tip (Perry's rockers).
    """
    pitch = _pitch(gait, own % 1.0, pace)
    heel = np.deg2rad(np.minimum(pitch, 0.0))
    tip = np.deg2rad(np.maximum(pitch - gait.toe_bend, 0.0))
    y = dimensions.toe * np.sin(tip) - dimensions.sole * np.sin(heel)
    z = dimensions.toe * (1 - np.cos(tip)) - dimensions.sole * (1 - np.cos(heel))
    return y, z


@lru_cache(maxsize=64)
def _stance(gait: Gait, dimensions: Dimensions, pace: float) -> tuple[float, float]:
    """Return the stride and where the foot is planted: the line that fits the curves' stance.

    The second is the place of the ball of the flat foot relative to the hip, at contact.
    """
    own = np.linspace(0.0, gait.duty, 32)
    way = _free_path(gait, own, dimensions, pace)[1] - _rocker(gait, own, dimensions, pace)[1]
    slope, start = np.polyfit(own, way, 1)
    return -float(slope), float(start)


def _planted_path(
    gait: Gait, own: FloatArray, dimensions: Dimensions, pace: float
) -> tuple[FloatArray, FloatArray]:
    """Return height and way of the ball of a planted foot, relative to the pelvis's way."""
    tilt = math.radians(gait.tilt)
    hip = math.cos(tilt) * dimensions.left_hip[2] + math.sin(tilt) * dimensions.left_hip[1]
    start = _stance(gait, dimensions, pace)[1]
    y, z = _rocker(gait, own, dimensions, pace)
    return y, z + hip + start - pace * stride_m(gait, dimensions) * own


def _foot_path(
    gait: Gait, own: FloatArray, dimensions: Dimensions, pace: float, period_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return height above ground and way of the ball of a foot, relative to the pelvis's way.

    Planted until `duty`; then the curves' swing plus the cubic that makes it leave and land with
    the planted foot's place and speed.
    """

    def swing(phase: FloatArray) -> FloatArray:
        y, z = _free_path(gait, phase, dimensions, pace)
        return np.stack([y + _heave(gait, phase, dimensions, pace, period_s), z], axis=1)

    def planted(phase: FloatArray) -> FloatArray:
        return np.stack(_planted_path(gait, phase, dimensions, pace), axis=1)

    next_place = np.array([0.0, pace * stride_m(gait, dimensions)])
    step, swing_share = 1e-4, 1.0 - gait.duty
    leave, land = np.array([gait.duty, gait.duty + step]), np.array([1.0 - step, 1.0])
    gap_leaving = planted(leave) - swing(leave)
    gap_landing = planted(land) + next_place - swing(land)
    s = np.clip((own - gait.duty) / swing_share, 0.0, 1.0)
    lift = gait.lift_m * dimensions.size * np.sin(math.pi * s) ** 2
    path = (
        swing(own)
        + np.outer(lift, [1.0, 0.0])
        + np.outer(2 * s**3 - 3 * s**2 + 1, gap_leaving[0])
        + np.outer(s**3 - 2 * s**2 + s, np.diff(gap_leaving, axis=0) / step * swing_share)
        + np.outer(3 * s**2 - 2 * s**3, gap_landing[1])
        + np.outer(s**3 - s**2, np.diff(gap_landing, axis=0) / step * swing_share)
    )
    on_ground = own < gait.duty
    path[on_ground] = planted(own[on_ground])
    heel_down = np.deg2rad(np.minimum(_pitch(gait, own, pace), 0.0))
    return np.maximum(path[:, 0], -dimensions.sole * np.sin(heel_down)), path[:, 1]


def _smooth_step(x: FloatArray) -> FloatArray:
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x * x * (3 - 2 * x))
