"""Measuring the facets of a clip."""

from __future__ import annotations

import numpy as np

from mocapdb.errors import GaitError
from mocapdb.gait.feet import understand_walker
from mocapdb.gait.foot_events import find_foot_contacts
from mocapdb.library.facets import Facets
from mocapdb.library.tuning import SPEED_SPAN_S
from mocapdb.motion.clip import Clip

__all__ = ["measure_facets"]


def measure_facets(clip: Clip) -> Facets | None:
    """Return what is measured of a clip; None where its body has not two legs, or hardly a frame.

    Speeds are taken over a tenth of a second, so that the noise of a capture is no speed.
    """
    try:
        walker = understand_walker(clip)
    except GaitError:
        return None
    left, right = walker.place("left_hip"), walker.place("right_hip")
    hips = ((left + right) / 2)[:, [0, 2]]
    span = min(max(1, round(SPEED_SPAN_S * walker.fps)), len(hips) - 1)
    ways = np.linalg.norm(hips[span:] - hips[:-span], axis=1)
    across = left - right
    facing = np.unwrap(np.arctan2(-across[:, 2], across[:, 0]))
    contacts = (contact for foot in find_foot_contacts(walker) for contact in foot)
    return Facets(
        root_speed_ms=float(ways.mean() / span * walker.fps),
        turn_deg=float(np.rad2deg(facing[-1] - facing[0])),
        contacts=sum(contact.strike is not None for contact in contacts),
    )
