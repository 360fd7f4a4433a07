"""Contacts: places where a joint has to be, which repairs choose by and then reach.

A contact is given by the user, or found from feet: one that rests before and after a flagged
stretch, at the same place, has rested all the while.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cleaning.tuning import LEAST_BESIDE, SAME_PLACE_M
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_contacts, find_legs
from mocapdb.motion.frame_range import FrameRange, ranges_where
from mocapdb.motion.ik import reach
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "Contact",
    "contact_distance",
    "find_resting_feet",
    "make_contact",
    "reach_contacts",
    "touching",
]


@dataclass(frozen=True)
class Contact(FrameRange):
    """Where a joint has to be.

    Attributes
    ----------
    start, end : int
        Frames ``start:end``.
    joint : int
        In Acclaim the end of its bone, in BVH the joint itself.
    places : (end - start, 3), skeleton units
    """

    joint: int
    places: FloatArray = field(compare=False)


def make_contact(
    clip: Clip,
    joint: str,
    start_s: float,
    end_s: float,
    place: Sequence[float] | None = None,
    *,
    flagged: BoolArray | None = None,
) -> Contact:
    """Return a contact of a joint by name, from a time to another.

    Parameters
    ----------
    clip : Clip
    joint : str
    start_s, end_s : float, seconds
    place : sequence of 3 floats, optional, skeleton units
        In the clip's own frame. By default where the joint is during the contact in frames in
        which nothing above it is flagged.
    flagged : (F, J), optional
        Joints' frames that are not to be trusted.

    Raises
    ------
    SkeletonError
        If there is no such joint.
    ClipError
        If the times are not within the clip, or there is no frame to take the place from.
    """
    index = clip.skeleton.joint(joint)
    start, end = round(start_s * clip.fps), round(end_s * clip.fps)
    if not (0 <= start < end <= len(clip)):
        raise ClipError(
            f"Expected a contact within the {clip.duration_s:.2f} s of {clip.name!r}, but got "
            f"{start_s:g} to {end_s:g} s."
        )
    if place is None:
        trusted = np.ones(end - start, dtype=np.bool_)
        if flagged is not None:
            trusted = _all_right(clip.skeleton, index, flagged[start:end])
        if not trusted.any():
            raise ClipError(
                f"Expected a place for the contact of {joint!r}, which is flagged all the while. "
                "Give x, y and z."
            )
        here = forward_kinematics(clip.skeleton, clip.channels[start:end]).positions[:, index]
        place = here[trusted].mean(axis=0).tolist()
    if len(place) != 3 or not np.isfinite(place).all():
        raise ClipError(f"Expected a place of three numbers, but got {list(place)}.")
    places = np.tile(np.asarray(place, dtype=np.float64), (end - start, 1))
    return Contact(start, end, index, places)


def find_resting_feet(clip: Clip, flagged: BoolArray) -> list[Contact]:
    """Return the contacts of feet that rest beside flagged stretches, and so within them.

    Parameters
    ----------
    clip : Clip
    flagged : (F, J)
        Joints' frames that are not to be trusted.
    """
    skeleton = clip.skeleton
    if not flagged.any():
        return []
    positions = forward_kinematics(skeleton, clip.channels).positions
    legs = find_legs(skeleton, positions)
    unseen = [~_all_right(skeleton, leg.ball, flagged) for leg in legs]
    for leg, gone in zip(legs, unseen, strict=True):
        if gone.any() and not gone.all():  # where it may be is a line from edge to edge
            seen = np.flatnonzero(~gone)
            for axis in range(3):
                path = positions[:, leg.ball, axis]
                path[gone] = np.interp(np.flatnonzero(gone), seen, path[seen])
    resting = find_contacts(skeleton, positions, clip.fps)
    found = []
    for i, (leg, gone) in enumerate(zip(legs, unseen, strict=True)):
        for run in ranges_where(gone):
            start, end = run.start, run.end
            if start < LEAST_BESIDE or end > len(clip) - LEAST_BESIDE:
                continue
            around = resting[start - LEAST_BESIDE : end + LEAST_BESIDE, i]
            places = positions[start:end, leg.ball]
            apart = np.linalg.norm(places[-1] - places[0]) * skeleton.metres_per_unit
            if around.all() and apart < SAME_PLACE_M:
                found.append(Contact(start, end, leg.ball, places.copy()))
    return found


def contact_distance(
    skeleton: Skeleton, channels: FloatArray, contacts: Sequence[Contact], within: FrameRange
) -> float:
    """Return how far joints are from their contacts in frames, on average, in skeleton units."""
    positions = forward_kinematics(skeleton, channels[within.frames]).positions
    apart = []
    for contact in contacts:
        first, last = max(within.start, contact.start), min(within.end, contact.end)
        here = positions[first - within.start : last - within.start, contact.joint]
        wanted = contact.places[first - contact.start : last - contact.start]
        apart.append(np.linalg.norm(here - wanted, axis=1))
    return float(np.concatenate(apart).mean())


def reach_contacts(
    skeleton: Skeleton, channels: FloatArray, contacts: Sequence[Contact], movable: BoolArray
) -> FloatArray:
    """Return channels in which joints are at their contacts, as far as movable joints allow.

    Parameters
    ----------
    skeleton : Skeleton
    channels : (F, C)
    contacts : sequence of Contact
    movable : (F, J)
        Joints' frames that may change; all else stays bit for bit.
    """
    channels = np.array(channels, dtype=np.float64)
    for contact in contacts:
        above = skeleton.chain_to_root(contact.joint)
        free = movable[contact.frames, above]
        for pattern in np.unique(free, axis=0):
            turning = [above[i] for i in np.flatnonzero(pattern)]
            if not turning:
                continue
            frames = np.flatnonzero((free == pattern).all(axis=1))
            channels[contact.start + frames] = reach(
                skeleton,
                channels[contact.start + frames],
                {contact.joint: contact.places[frames]},
                turning,
            )
    return channels


def touching(
    skeleton: Skeleton, contacts: Sequence[Contact], joint: int, within: FrameRange
) -> list[Contact]:
    """Return the contacts that a joint's rotation in some frames can help to keep."""
    return [
        contact
        for contact in contacts
        if contact.overlap(within) and joint in skeleton.chain_to_root(contact.joint)
    ]


def _all_right(skeleton: Skeleton, joint: int, flagged: BoolArray) -> BoolArray:
    """Return (F,) whether nothing that a joint hangs on is flagged."""
    return np.asarray(~flagged[:, skeleton.chain_to_root(joint)].any(axis=1))
