"""Where a loop starts: at a strike of the left foot, or where the body moves least."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from mocapdb.cycles.cycle import Cycle
from mocapdb.cycles.synthesis.loop import calmest_phase, make_loop
from mocapdb.cycles.tuning import STRIKE_FPS
from mocapdb.errors import CycleError, GaitError
from mocapdb.gait.feet import understand_walker
from mocapdb.gait.foot_events import find_foot_contacts

__all__ = ["LoopStart", "Start", "left_contact_phase", "start_phase"]

Start: TypeAlias = Literal["auto", "left-contact", "calmest"]


class LoopStart(NamedTuple):
    """A phase of a cycle, and what happens there.

    Attributes
    ----------
    phase : float
        In laps.
    event : {"left foot strike", "calmest pose"}
    """

    phase: float
    event: str


@lru_cache(maxsize=8)  # asked for a loop, and again for what is told of it
def start_phase(cycle: Cycle, start: Start = "auto") -> LoopStart:
    """Return where a loop of a cycle starts.

    Parameters
    ----------
    cycle : Cycle
    start : {"auto", "left-contact", "calmest"}
        By default at a strike of the left foot where feet take turns, else where the body moves
        least.

    Raises
    ------
    CycleError
        If the left foot is to strike, and does not.
    """
    if start not in ("auto", "left-contact", "calmest"):
        raise CycleError(
            f"Expected a start 'auto', 'left-contact' or 'calmest', but got {start!r}."
        )
    if start != "calmest":
        try:
            return LoopStart(left_contact_phase(cycle), "left foot strike")
        except GaitError as problem:
            if start == "left-contact":
                raise CycleError(
                    f"Expected a cycle in which the left foot strikes the ground, but: {problem} "
                    "Use --start calmest."
                ) from None
    return LoopStart(calmest_phase(cycle), "calmest pose")


def left_contact_phase(cycle: Cycle) -> float:
    """Return the phase of the first strike of the left foot.

    Raises
    ------
    GaitError
        If the body has no feet, or both feet do not strike once a lap or more.
    """
    n_laps = 4
    loop = make_loop(cycle, STRIKE_FPS, n_laps=n_laps, hold_feet=False)
    walker = understand_walker(loop.clip)
    lap = len(loop.clip) / n_laps
    strikes = [
        [c.strike / lap for c in contacts if c.strike is not None and lap <= c.strike < 2 * lap]
        for contacts in find_foot_contacts(walker)
    ]
    if not (strikes[0] and strikes[1]):
        raise GaitError(f"{cycle.name or 'the cycle'} has {len(strikes[0])} strikes of the left "
                        f"foot and {len(strikes[1])} of the right one in a lap.")  # fmt: skip
    return float(np.round(strikes[0][0] % 1.0, 6))
