"""Foot skate: feet that slide where they rest, and two ways to stop them.

After Lyard and Magnenat-Thalmann, *A simple footskate removal method for virtual reality
applications* (2007): the part of the sole that rests is what moves least, and the root alone is
moved so that it stays where it is; all rotations are kept, and feet that are right against each
other are right on the ground. Where both feet rest and slide against each other, legs have to
bend: the other way turns hips, knees and ankles, and keeps the root.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cleaning.tuning import LEAST_PULL, SETTLE_S
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import Leg, find_contacts, find_legs, foot_slide_mm
from mocapdb.motion.ik import pull_to_rest, reach
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Skate", "Way", "remove_foot_skate"]

Way: TypeAlias = Literal["root", "legs"]


class Skate(NamedTuple):
    """A clip whose feet stay where they rest.

    Attributes
    ----------
    clip : Clip
    contacts : (F, L)
        Whether each leg's foot rests (see `motion.foot_contacts.find_contacts`).
    slide_before_mm, slide_after_mm : float
        How far resting feet wander, level, on average.
    """

    clip: Clip
    contacts: BoolArray
    slide_before_mm: float
    slide_after_mm: float


def remove_foot_skate(clip: Clip, way: Way = "legs", *, contacts: BoolArray | None = None) -> Skate:
    """Return a clip whose feet stay where they rest.

    Parameters
    ----------
    clip : Clip
    way : {"root", "legs"}
        ``"root"`` moves the root (Lyard and Magnenat-Thalmann 2007): where one foot rests it stays
        exactly, and what it slid is left out of the path from there on. ``"legs"`` turns hips,
        knees and ankles around each rest, and leaves everything else bit for bit.
    contacts : (F, L) of bool, optional
        Where each leg's foot rests, the legs as `motion.foot_contacts.find_legs` gives them; by
        default found from their height and speed.

    Raises
    ------
    ClipError
        If the skeleton has no legs, the contacts do not fit it, or its root has no translation
        to move.
    """
    skeleton = clip.skeleton
    positions = forward_kinematics(skeleton, clip.channels).positions
    legs = find_legs(skeleton, positions)
    if not legs:
        raise ClipError(
            f"Expected {clip.name!r} to have legs, but no chain of its joints ends near the ground."
        )
    if way not in ("root", "legs"):
        raise ClipError(f"Expected 'root' or 'legs', but got {way!r}.")
    if contacts is None:
        contacts = find_contacts(skeleton, positions, clip.fps)
    if contacts.shape != (len(clip), len(legs)):
        raise ClipError(
            f"Expected contacts of shape ({len(clip)}, {len(legs)}) for {clip.name!r}, but got "
            f"{contacts.shape}."
        )
    before = foot_slide_mm(skeleton, positions, contacts)
    if before == 0.0:
        return Skate(clip, contacts, before, before)
    move = _move_root if way == "root" else _bend_legs
    channels = move(clip, legs, positions, contacts)
    after = foot_slide_mm(skeleton, forward_kinematics(skeleton, channels).positions, contacts)
    if after >= before:
        return Skate(clip, contacts, before, before)
    cleaned = clip.replace(channels=channels, step=f"foot skate removed by the {way}")
    return Skate(cleaned, contacts, before, after)


def _move_root(
    clip: Clip, legs: tuple[Leg, ...], positions: FloatArray, contacts: BoolArray
) -> FloatArray:
    """Return channels in which the root makes up for what the resting foot slides."""
    from scipy.ndimage import gaussian_filter1d

    skeleton = clip.skeleton
    columns = _level_columns(skeleton)
    steps = np.zeros((len(clip), 3))
    balls = positions[:, [leg.ball for leg in legs]]
    moved = np.diff(balls, axis=0)
    for frame in range(1, len(clip)):
        resting = contacts[frame - 1] & contacts[frame]
        if resting.any():  # the one that moves least is the one that the body stands on
            feet = moved[frame - 1, resting]
            steps[frame] = -feet[np.linalg.norm(feet, axis=1).argmin()]
    # the root's pace must not change from one frame to the next
    steps = gaussian_filter1d(steps, SETTLE_S * clip.fps, axis=0)
    path = np.cumsum(steps, axis=0)
    channels = clip.channels.copy()
    for axis, column in columns.items():
        channels[:, column] += path[:, axis]
    return channels


def _level_columns(skeleton: Skeleton) -> dict[int, int]:
    """Return the channel that moves the root along each level axis."""
    first = int(skeleton.channel_starts[0])
    found = {
        "xyz".index(dof[1]): first + i
        for i, dof in enumerate(skeleton.dofs[0])
        if dof[0] == "t" and "xyz".index(dof[1]) != skeleton.up_index
    }
    if len(found) < 2:
        raise ClipError("Expected a root with translation channels, but it has none to move.")
    return found


def _bend_legs(
    clip: Clip, legs: tuple[Leg, ...], positions: FloatArray, contacts: BoolArray
) -> FloatArray:
    """Return channels in which legs are turned so that feet stay, and keep facing as they did."""
    skeleton = clip.skeleton
    channels = clip.channels.copy()
    for i, leg in enumerate(legs):
        pull = pull_to_rest(positions[:, leg.ball], contacts[:, i], skeleton.up_index, clip.fps)
        frames = np.flatnonzero(np.abs(pull).max(axis=1) > LEAST_PULL * skeleton.height)
        if len(frames) == 0:
            continue
        goals = {j: positions[frames, j] + pull[frames] for j in {leg.ankle, leg.ball}}
        turning = list(dict.fromkeys((leg.upper, leg.lower, leg.foot)))
        channels[frames] = reach(skeleton, channels[frames], goals, turning)
    return channels
