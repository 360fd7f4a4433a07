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

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.gait.feet import Foot, Walker, point_speeds
from mocapdb.gait.tuning import (
    AIR_WINDOW_S,
    DRIFT_WEIGHT_S,
    DUTIES,
    GROUND_WINDOW_S,
    LANDING_POWER,
    LANDING_UP_WEIGHT,
    LEAST_PHASE_S,
    LEAVING_POWERS,
    LEAVING_UP_WEIGHT,
    MOST_FLIGHT,
    NEAR_EVENT_S,
    REFINE_REACH_S,
    RESTING_M_S,
    RESTING_SHARE,
    SLIDING_TIMES,
    WALKING_FROUDE,
)
from mocapdb.motion.frame_range import FrameRange, ranges_where

__all__ = ["FootContact", "find_foot_contacts", "foot_contacts", "resting_speed"]

GRAVITY = 9.81
REFINE_STEP_S = 0.001
LEAST_HINGE_FRAMES = 5


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
    left, right = (foot_contacts(foot, walker.fps, resting_m_s) for foot in walker.feet)
    return left, right


def resting_speed(walker: Walker) -> float:
    """Return the speed below which feet are on the ground.

    `RESTING_M_S`, or more for the fast. Who goes slower than a Froude number of a half walks
    (Alexander, Physiological Reviews 69, 1989), and who walks has a foot on the ground at all
    times: where that is not so because feet slide as they land, as in some captures, a higher speed
    is rest as well, up to where it would make a walk out of a slow run.
    """
    body_m_s = float(np.median(point_speeds(walker.hips, walker.fps)))
    usual = max(RESTING_M_S, RESTING_SHARE * body_m_s)
    if body_m_s**2 > WALKING_FROUDE * GRAVITY * walker.leg_m:
        return usual
    least = math.inf
    for times in SLIDING_TIMES:
        flight = _flight(find_foot_contacts(walker, times * usual), walker)
        least = min(least, flight)
        if flight <= MOST_FLIGHT:
            return times * usual
    # nearly none is a walk whose feet slide even more; else it is a slow run
    return SLIDING_TIMES[-1] * usual if least <= 3 * MOST_FLIGHT else usual


def _flight(contacts: tuple[list[FootContact], list[FootContact]], walker: Walker) -> float:
    """Return the share of frames, from where both feet have landed on, with no foot down."""
    frames = np.arange(len(walker.positions))
    down = np.zeros(len(frames), dtype=bool)
    for contact in (*contacts[0], *contacts[1]):
        start = contact.frames.start if contact.strike is None else contact.strike
        end = contact.frames.end if contact.toe_off is None else contact.toe_off
        down |= (frames >= start) & (frames <= end)
    strikes = [[c.strike for c in side if c.strike is not None] for side in contacts]
    if not all(strikes):
        return 0.0
    between = slice(round(max(side[0] for side in strikes)), round(min(s[-1] for s in strikes)))
    return float(np.mean(~down[between])) if between.stop > between.start else 0.0


def foot_contacts(foot: Foot, fps: float, resting_m_s: float) -> list[FootContact]:
    """Return the contacts of a foot with the ground, in order.

    Parameters
    ----------
    foot : Foot
    fps : float, frames per second
    resting_m_s : float
        A point of the foot that is slower rests.
    """
    points = foot.points
    speeds = point_speeds(points, fps)
    down = _without_short(np.any(speeds < resting_m_s, axis=0), LEAST_PHASE_S * fps)
    near = max(2, round(NEAR_EVENT_S * fps))
    contacts = []
    on_ground = ranges_where(down)
    leaving = float(np.interp(-_duty(on_ground), np.negative(DUTIES), LEAVING_POWERS))
    for frames in on_ground:
        strike = toe_off = None
        if frames.start > 0:
            first = _slowest(speeds[:, frames.start : frames.start + near])
            strike = hinge(points[first], frames.start, fps, LANDING_POWER, ground_is_after=True)
        if frames.end < len(down):
            last = _slowest(speeds[:, max(0, frames.end - near) : frames.end])
            toe_off = hinge(points[last], frames.end - 1, fps, leaving, ground_is_after=False)
        quarter = len(frames) // 4
        middle = foot.ball[frames.start + quarter : frames.end - quarter]
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


def _slowest(speeds: FloatArray) -> int:
    """Return which point of the foot is the slowest in some frames (3, F) beside an event."""
    return int(np.argmin(speeds.mean(axis=1)))


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
