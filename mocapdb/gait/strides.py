"""Strides: their times, lengths and shares, in the terms of Perry and Whittle.

A stride is from a strike of a foot to the next strike of the same foot (Perry, *Gait Analysis*,
1992). Lengths are between the places where feet rest in mid-stance, and a step's length and width
are along and across the way of the stride (Huxham et al., Gait and Posture 23, 2006), so that
they hold on curves, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.gait.feet import Walker
from mocapdb.gait.foot_events import FootContact
from mocapdb.gait.tuning import LEAST_STRIDE, MOST_TURN_DEG, OPPOSITE_STRIKE, STRIDE_S
from mocapdb.motion.body.canonical_joints import SIDES

__all__ = ["MEASURES", "Stride", "find_strides"]

MEASURES = {
    "stride_time_s": "s",
    "step_time_s": "s",
    "cadence_steps_min": "steps/min",
    "stride_length_m": "m",
    "step_length_m": "m",
    "step_width_m": "m",
    "speed_m_s": "m/s",
    "stance_pct": "% of the stride",
    "swing_pct": "% of the stride",
    "double_support_pct": "% of the stride",
    "flight_pct": "% of the stride",
    "rise_m": "m",
    "turn_deg": "degrees",
}
"""What is measured of each stride, with its unit."""


@dataclass(frozen=True)
class Stride:
    """One stride of one foot.

    Attributes
    ----------
    side : {"left", "right"}
    number : int
        Counted from 1 on each side.
    start, toe_off, opposite_toe_off, opposite_strike, end : float, frames
        Its events; `start` and `end` are strikes of its own foot.
    stride_time_s, step_time_s : float, seconds
        The step is from the other foot's strike to the strike that ends the stride.
    cadence_steps_min : float
        Two steps a stride.
    stride_length_m, step_length_m, step_width_m : float, metres
        The width is negative where feet cross.
    speed_m_s : float
    stance_pct, swing_pct, double_support_pct, flight_pct : float
        Shares of the stride: own foot on the ground, own foot in the air, both feet on the
        ground, none.
    rise_m : float, metres
        How much higher it ends than it starts: stairs.
    turn_deg : float, degrees
        How far the pelvis turns in it, to the left.
    """

    side: str
    number: int
    start: float
    toe_off: float
    opposite_toe_off: float
    opposite_strike: float
    end: float
    stride_time_s: float
    step_time_s: float
    cadence_steps_min: float
    stride_length_m: float
    step_length_m: float
    step_width_m: float
    speed_m_s: float
    stance_pct: float
    swing_pct: float
    double_support_pct: float
    flight_pct: float
    rise_m: float
    turn_deg: float


def find_strides(
    walker: Walker, contacts: tuple[Sequence[FootContact], Sequence[FootContact]]
) -> tuple[list[Stride], list[str]]:
    """Return the strides of both sides in order of time, and why others are none.

    Parameters
    ----------
    walker : Walker
    contacts : (left, right)
        As of `mocapdb.gait.foot_events.find_foot_contacts`.
    """
    strides: list[Stride] = []
    refused: list[str] = []
    headings = np.unwrap(_headings(walker))
    for index, side in enumerate(SIDES):
        own, others = contacts[index], contacts[1 - index]
        number = 0
        for contact, following in pairwise(own):
            found = _stride(walker, headings, index, number + 1, contact, following, others)
            if isinstance(found, Stride):
                number += 1
                strides.append(found)
            elif found:
                refused.append(
                    f"{side} stride at {contact.frames.start / walker.fps:.2f} s {found}"
                )
    return sorted(strides, key=lambda stride: stride.start), refused


def _stride(
    walker: Walker,
    headings: FloatArray,
    side: int,
    number: int,
    contact: FootContact,
    following: FootContact,
    others: Sequence[FootContact],
) -> Stride | str:
    """Return the stride between two contacts of a foot, or why it is none; empty if cut off."""
    start, toe_off, end = contact.strike, contact.toe_off, following.strike
    if start is None or toe_off is None or end is None:
        return ""
    fps = walker.fps
    time_s = (end - start) / fps
    if not STRIDE_S[0] <= time_s <= STRIDE_S[1]:
        return f"takes {time_s:.2f} s, expected {STRIDE_S[0]:g} to {STRIDE_S[1]:g}"
    between = [other for other in others if other.strike is not None and start < other.strike < end]
    if len(between) != 1 or between[0].strike is None:
        return f"has {len(between)} strikes of the other foot in it, expected 1"
    other, opposite_strike = between[0], between[0].strike
    share = (opposite_strike - start) / (end - start)
    if not OPPOSITE_STRIKE[0] <= share <= OPPOSITE_STRIKE[1]:
        return f"has the other foot's strike at {share:.0%}, expected it near the middle"
    before = [each for each in others if each.frames.start < other.frames.start]
    opposite_toe_off = before[-1].toe_off if before else None
    if opposite_toe_off is None:
        return ""
    way = following.place - contact.place
    way_level = way * [1.0, 0.0, 1.0]
    length = float(np.linalg.norm(way_level))
    if length < LEAST_STRIDE * walker.leg_m:
        return f"is {length:.2f} m long, too short for a leg of {walker.leg_m:.2f} m"
    turn = float(np.rad2deg(headings[round(end)] - headings[round(start)]))
    if abs(turn) > MOST_TURN_DEG:
        return f"turns by {turn:.0f} degrees, expected {MOST_TURN_DEG:g} at most"
    ahead = way_level / length
    to_left = walker.place("left_hip") - walker.place("right_hip")
    middle = to_left[round(start) : round(end) + 1].mean(axis=0)
    across = np.array([ahead[2], 0.0, -ahead[0]])  # to the left of the way, or the right
    if across @ middle < 0:
        across = -across
    aside = float((other.place - contact.place) @ across) * (-1.0 if side == 0 else 1.0)
    both = _overlap((start, toe_off), (opposite_strike, other.toe_off or end), end)
    both += max(0.0, min(opposite_toe_off, toe_off) - start)
    flight = max(0.0, opposite_strike - toe_off)
    landed = other.toe_off
    if landed is not None:
        flight += max(0.0, end - max(landed, opposite_strike))
    frames = end - start
    return Stride(
        side=SIDES[side],
        number=number,
        start=start,
        toe_off=toe_off,
        opposite_toe_off=opposite_toe_off,
        opposite_strike=opposite_strike,
        end=end,
        stride_time_s=time_s,
        step_time_s=(end - opposite_strike) / fps,
        cadence_steps_min=120.0 / time_s,
        stride_length_m=length,
        step_length_m=float((following.place - other.place) @ ahead),
        step_width_m=aside,
        speed_m_s=length / time_s,
        stance_pct=100.0 * (toe_off - start) / frames,
        swing_pct=100.0 * (end - toe_off) / frames,
        double_support_pct=100.0 * both / frames,
        flight_pct=100.0 * flight / frames,
        rise_m=float(way[1]),
        turn_deg=turn,
    )


def _overlap(own: tuple[float, float], other: tuple[float, float], end: float) -> float:
    """Return how long two contacts last together before `end`."""
    return max(0.0, min(own[1], other[1], end) - max(own[0], other[0]))


def _headings(walker: Walker) -> FloatArray:
    """Return (F,) the way that the hips face, in radians, growing to the left."""
    to_left = walker.place("left_hip") - walker.place("right_hip")
    return np.asarray(np.arctan2(to_left[:, 0], to_left[:, 2]))
