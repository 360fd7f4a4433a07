"""Foot strikes and toe-offs from motion alone, between frames.

A foot is on the ground while its heel, its ball or the tip of its toes rests over the ground:
velocity decides, as in O'Connor et al. (Gait and Posture 25, 2007), and not height, so that stairs,
slopes and captures that float over the floor do as well. Where the first of the three comes to
rest, and where the last one parts, is then told to a fraction of a frame: the path of that point
is a straight slow line on the ground's side of the event and a power of time more on the other
side, so the event is the time of the hinge that fits best (the kink that Hreljac and Marshall,
J. Biomechanics 33, 2000, look for by derivatives, which noise does not let through). Feet that
slide when they land have that kink in their height, which counts more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.gait.feet import Foot, Walker, point_speeds
from mocapdb.gait.tuning import (
    AIR_WINDOW_S,
    ALIKE_M_S,
    DRIFT_WEIGHT_S,
    DUTIES,
    EVENT_HZ,
    FALL_REACH_S,
    FALL_SHORT,
    GROUND_WINDOW_S,
    LANDING_POWER,
    LANDING_UP_WEIGHT,
    LEAST_PHASE_S,
    LEAVING_POWERS,
    LEAVING_UP_WEIGHT,
    REFINE_REACH_S,
    RESTING_M_S,
    RESTING_SHARE,
    SLIDING_TIMES,
    WALK_RUN_FALL,
    WALK_RUN_FROUDE,
)
from mocapdb.motion.frame_range import FrameRange, ranges_where

__all__ = [
    "FootContact",
    "air_shares",
    "find_foot_contacts",
    "foot_contacts",
    "resting_speed",
    "usual_resting_speed",
]

GRAVITY = 9.81
REFINE_STEP_S = 0.001
LEAST_HINGE_FRAMES = 5
LEAST_WEIGHT = 0.01  # a point of less changes nothing


@dataclass(frozen=True)
class FootContact:
    """A foot on the ground.

    Attributes
    ----------
    strike, toe_off : float or None, frames
        When it lands and when it leaves, to a fraction of a frame; None where that is not in the
        clip.
    frames : FrameRange
        Frames on the ground.
    place : (3,), metres
        Where the ball is in the middle half of the contact.
    """

    strike: float | None
    toe_off: float | None
    frames: FrameRange
    place: FloatArray


def find_foot_contacts(
    walker: Walker, resting_m_s: float | None = None
) -> tuple[list[FootContact], list[FootContact]]:
    """Return the contacts of the left and the right foot, in order.

    Parameters
    ----------
    walker : Walker
    resting_m_s : float, optional
        Feet that are slower are on the ground; as of `resting_speed` by default.
    """
    if resting_m_s is None:
        resting_m_s = resting_speed(walker)
    left, right = (
        foot_contacts(foot, walker.fps, resting_m_s, walker.live) for foot in walker.feet
    )
    return left, right


def usual_resting_speed(walker: Walker) -> float:
    """Return the speed below which feet of a sharp capture are on the ground."""
    return max(RESTING_M_S, RESTING_SHARE * _body_speed(walker))


def _body_speed(walker: Walker) -> float:
    return float(np.median(point_speeds(walker.hips[walker.live.frames], walker.fps)))


def resting_speed(walker: Walker) -> float:
    """Return the speed below which feet are on the ground.

    That of `usual_resting_speed`, or more for runs. Runs that were smoothed have feet that slide as
    they land and creep before they leave, and their rest is seen too short. How the body moves up
    and down tells then, which smoothing changes less: while no foot is down it falls freely. So the
    speed grows for as long as feet are in the air for clearly longer than the hips fall.

    Nothing is switched: the speed grows by each step as much as there is flight too much with it,
    and as much as it is a run: fast, with hips that fall. A walk is left as it is, since its
    flight, if there is any, is as short as what smoothing makes.
    """
    usual = usual_resting_speed(walker)
    froude = _body_speed(walker) ** 2 / (GRAVITY * max(walker.leg_m, 1e-6))
    runs = float(np.interp(froude, WALK_RUN_FROUDE, (0.0, 1.0)))
    if runs == 0.0:
        return usual
    more = 0.0
    for number, (times, following) in enumerate(pairwise(SLIDING_TIMES)):
        flight, fall = air_shares(walker, find_foot_contacts(walker, times * usual))
        if math.isnan(flight):
            continue
        if number == 0:
            runs *= float(np.interp(fall, WALK_RUN_FALL, (0.0, 1.0)))
        more += (following - times) * float(np.interp(flight - fall, FALL_SHORT, (0.0, 1.0)))
    return usual * (1.0 + runs * more)


def air_shares(
    walker: Walker, contacts: tuple[list[FootContact], list[FootContact]]
) -> tuple[float, float]:
    """Return the shares of frames in which no foot is down, and in which the hips fall.

    Parameters
    ----------
    walker : Walker
    contacts : (left, right)

    Returns
    -------
    flight, fall : float
        From the first strike to the last; not a number where there are no two a frame apart, as in
        a single hop of both feet. The hips fall where
        half of gravity or more pulls them down.
    """
    strikes = [c.strike for side in contacts for c in side if c.strike is not None]
    if len(strikes) < 2:
        return math.nan, math.nan
    first, last = round(min(strikes)), round(max(strikes))
    if first == last:
        return math.nan, math.nan
    frames = np.arange(len(walker.positions))
    down = np.zeros(len(frames), dtype=bool)
    for contact in (*contacts[0], *contacts[1]):
        start = contact.frames.start if contact.strike is None else contact.strike
        end = contact.frames.end if contact.toe_off is None else contact.toe_off
        down |= (frames >= start) & (frames <= end)
    reach = max(1, round(FALL_REACH_S * walker.fps))
    height = np.pad(walker.hips[:, 1], reach, mode="edge")
    twice = height[2 * reach :] - 2 * height[reach:-reach] + height[: -2 * reach]
    falls = twice * (walker.fps / reach) ** 2 < -GRAVITY / 2
    return float(np.mean(~down[first:last])), float(np.mean(falls[first:last]))


def foot_contacts(
    foot: Foot, fps: float, resting_m_s: float, live: FrameRange | None = None
) -> list[FootContact]:
    """Return the contacts of a foot with the ground, in order.

    Parameters
    ----------
    foot : Foot
    fps : float, frames per second
    resting_m_s : float
        A point of the foot that is slower rests.
    live : FrameRange, optional
        Only in these frames, as if the clip had no others.

    Notes
    -----
    Clips of lower rates are brought to `EVENT_HZ` by splines first: speeds over longer times stay
    high for longer after a foot stops, and grow sooner before it leaves.
    """
    live = live or FrameRange(0, len(foot.ball))
    times = max(1, round(EVENT_HZ / fps))
    points = _between_frames(foot.points[:, live.frames], times)
    return [
        FootContact(
            None if contact.strike is None else live.start + contact.strike / times,
            None if contact.toe_off is None else live.start + contact.toe_off / times,
            _whole_frames(contact.frames, times, live.start),
            contact.place,
        )
        for contact in _contacts(points, fps * times, resting_m_s)
    ]


def _between_frames(points: FloatArray, times: int) -> FloatArray:
    """Return points (P, F, 3) at so many times as many frames, by cubic splines."""
    n = points.shape[1]
    if times == 1 or n < 2:
        return points
    return np.asarray(
        CubicSpline(np.arange(n), points, axis=1)(np.arange((n - 1) * times + 1) / times)
    )


def _whole_frames(dense: FrameRange, times: int, first: int) -> FrameRange:
    """Return the frames within a range that counts more of them; one at least."""
    start = -(-dense.start // times)
    return FrameRange(first + start, first + max(start, (dense.end - 1) // times) + 1)


def _contacts(points: FloatArray, fps: float, resting_m_s: float) -> list[FootContact]:
    """Return the contacts of a foot of heel, ball and tip (3, F, 3)."""
    speeds = point_speeds(points, fps)
    down = _without_short(np.any(speeds < resting_m_s, axis=0), LEAST_PHASE_S * fps)
    contacts = []
    on_ground = ranges_where(down)
    leaving = float(np.interp(-_duty(on_ground), np.negative(DUTIES), LEAVING_POWERS))
    for frames in on_ground:
        strike = toe_off = None
        if frames.start > 0:
            near = speeds[:, frames.start : frames.start + 2]
            strike = _event(points, near, frames.start, fps, LANDING_POWER, ground_is_after=True)
        if frames.end < len(down):
            near = speeds[:, max(0, frames.end - 2) : frames.end]
            toe_off = _event(points, near, frames.end - 1, fps, leaving, ground_is_after=False)
        quarter = len(frames) // 4
        middle = points[1, frames.start + quarter : frames.end - quarter]
        contacts.append(FootContact(strike, toe_off, frames, np.median(middle, axis=0)))
    return contacts


def _duty(on_ground: list[FrameRange]) -> float:
    """Return the share of the stride that a foot is on the ground; a walk's if that is not told."""
    shares = [
        len(contact) / (following.start - contact.start)
        for contact, following in pairwise(on_ground)
        if contact.start > 0
    ]
    return float(np.median(shares)) if shares else DUTIES[0]


def hinge(
    path: FloatArray, frame: int, fps: float, power: float, *, ground_is_after: bool
) -> float:
    """Return when a point comes to rest or parts from it, in frames, near a frame.

    Parameters
    ----------
    path : (F, 3)
    frame : int
        About when.
    fps : float, frames per second
    power : float
        Of the time off the ground by which the point has gone.
    ground_is_after : bool
        Whether it rests after the event or before it.

    Notes
    -----
    Least squares of ``c + g t + e s^p``, where ``s`` is the time off the ground and zero on it, for
    each of the times in question; ``g``, the slide on the ground, is held small.
    """
    time = float(frame)
    for reach_s in (REFINE_REACH_S, REFINE_REACH_S / 3):
        time = _hinge_near(path, time, fps, power, 1.0 if ground_is_after else -1.0, reach_s)
    return min(max(time, 0.0), len(path) - 1.0)


def _hinge_near(
    path: FloatArray, about: float, fps: float, power: float, ground: float, reach_s: float
) -> float:
    """Return the hinge near a time in frames; the ground is after it (1) or before it (-1)."""
    air, floor = (max(2.0, window * fps) for window in (AIR_WINDOW_S, GROUND_WINDOW_S))
    before, after = (air, floor) if ground > 0 else (floor, air)
    first, last = max(0, round(about - before)), min(len(path) - 1, round(about + after))
    time = (np.arange(first, last + 1) - about) / fps
    if len(time) < LEAST_HINGE_FRAMES:
        return about
    up = LANDING_UP_WEIGHT if ground > 0 else LEAVING_UP_WEIGHT
    places = (path[first : last + 1] - path[first]) * [1.0, up, 1.0]
    shifts = np.arange(-reach_s, reach_s + REFINE_STEP_S / 2, REFINE_STEP_S)
    off = np.maximum(0.0, ground * (shifts[:, None] - time))
    ones = np.ones_like(off)
    terms = np.stack([ones, ones * time, off**power], axis=-1)
    # one more row: what the point drifts by on the ground costs as much as so many seconds of it
    prior = np.broadcast_to([0.0, DRIFT_WEIGHT_S, 0.0], (len(shifts), 1, 3))
    terms = np.concatenate([terms, prior], axis=1)
    places = np.concatenate([places, np.zeros((1, 3))])
    missed = ((terms @ (np.linalg.pinv(terms) @ places) - places) ** 2).sum(axis=(1, 2))
    return about + float(shifts[np.argmin(missed)]) * fps


def _event(
    points: FloatArray,
    speeds: FloatArray,
    frame: int,
    fps: float,
    power: float,
    *,
    ground_is_after: bool,
) -> float:
    """Return when a foot of points (P, F, 3) lands or leaves, in frames, near a frame.

    That is when the slowest point does, by speeds (P, 2) beside the event. Points that are hardly
    faster count in part, so that a small change of the clip never exchanges one for another.
    """
    slow = speeds.mean(axis=1)
    weights = np.exp((slow.min() - slow) / ALIKE_M_S)
    weights[weights < LEAST_WEIGHT] = 0.0
    times = [
        hinge(path, frame, fps, power, ground_is_after=ground_is_after) if weight else 0.0
        for path, weight in zip(points, weights, strict=True)
    ]
    return float(weights @ times / weights.sum())


def _without_short(down: BoolArray, least: float) -> BoolArray:
    """Return contacts without gaps and then without contacts of fewer frames than `least`."""
    down = down.copy()
    for gap in ranges_where(~down):
        if gap.start > 0 and gap.end < len(down) and len(gap) < least:
            down[gap.frames] = True
    for contact in ranges_where(down):
        if len(contact) < least and contact.start > 0 and contact.end < len(down):
            down[contact.frames] = False
    return down
