"""How sure a cycle is: what speaks for it, each from 0 to 1, and what the user should know."""

from __future__ import annotations

import math
from collections.abc import Mapping

from mocapdb.cycles.period.autocorrelation import PeriodGuess
from mocapdb.cycles.phase.circular_coordinates import Topology
from mocapdb.cycles.tuning import (
    AGREEMENT,
    CHANCE,
    DISAGREEMENT,
    DOUBTFUL,
    FEW_LAPS,
    LAPS_TO_KNOW_RESTS,
    POP_TIMES,
    SECOND_LOOP,
    UNKNOWN_RESTS,
    UNRELATED_DIFFERENCE,
    USUAL_TEMPO_CHANGE,
    WITHOUT_TOPOLOGY,
)

__all__ = ["gather_evidence", "list_doubts", "smoothness"]


def gather_evidence(
    guess: PeriodGuess,
    topology: Topology | None,
    period_frames: float,
    laps: float,
    share: float = 1.0,
    *,
    left_over: float = 0.0,
    tempo_change: float = 0.0,
    rests: bool = False,
) -> dict[str, float]:
    """Return what speaks for a period, each from 0 to 1.

    Parameters
    ----------
    guess : PeriodGuess
        By autocorrelation.
    topology : Topology or None
        None if cohomology found no loop, or was not asked.
    period_frames : float
        As refined.
    laps : float
        How many there are.
    share : float
        Of the clip that they are. In a long clip two stretches may be alike by chance: the shorter
        a part, the more laps it takes.
    left_over : float
        Share of the variance of the poses that the laps differ from their mean by: lap against lap.
    tempo_change : float
        Of the quickest lap to the slowest, relative to the mean.
    rests : bool
        Whether the body rests within the motion: of few laps nobody can tell whether a rest is
        part of each.
    """
    evidence = {
        "repetition": 1.0 - ((1.0 - guess.clarity) / UNRELATED_DIFFERENCE) ** 2,
        "laps": (1.0 + share) * (laps - 1.0) + CHANCE * math.log2(share),
        "fit": 1.0 - left_over / UNRELATED_DIFFERENCE,
        "tempo": 1.0 - (tempo_change - USUAL_TEMPO_CHANGE),
    }
    if rests and laps < LAPS_TO_KNOW_RESTS:
        evidence["rests"] = UNKNOWN_RESTS
    if topology is None:
        evidence["topology"] = WITHOUT_TOPOLOGY
    else:
        apart = abs(topology.period_frames / period_frames - 1.0)
        evidence["agreement"] = 1.0 - (apart - AGREEMENT) / (DISAGREEMENT - AGREEMENT)
        evidence["persistence"] = 1.0 - SECOND_LOOP / max(topology.persistence_ratio, 1.0)
        evidence["forwards"] = 1.0 - 2.0 * topology.backtracking
    return {name: min(1.0, max(0.0, value)) for name, value in evidence.items()}


def smoothness(pops: Mapping[str, float]) -> float:
    """Return what speaks for a loop that may pop, from 0 to 1.

    Parameters
    ----------
    pops : mapping of str to float
        As `Loop` has them: how many times its own peak acceleration a joint that pops has.

    Examples
    --------
    >>> smoothness({}), smoothness({"ltibia": 3.0})
    (1.0, 0.5)
    """
    return min(1.0, POP_TIMES / max(pops.values(), default=POP_TIMES))


def list_doubts(
    guess: PeriodGuess,
    topology: Topology | None,
    laps: float,
    evidence: dict[str, float],
    by_hand: bool = False,
) -> list[str]:
    """Return what a user should be warned of, in words."""
    doubts = []
    if topology is None:
        doubts.append("cohomology found no loop: the period is the autocorrelation's alone")
    elif abs(topology.period_frames / guess.frames - 1.0) >= AGREEMENT:
        taken = "second" if by_hand else "first"
        doubts.append(
            f"the periods disagree: {guess.frames:.1f} frames by autocorrelation, "
            f"{topology.period_frames:.1f} by cohomology; the {taken} was taken"
        )
    weakest = min(evidence, key=lambda name: evidence[name])
    if evidence[weakest] < DOUBTFUL:
        doubts.append(f"doubtful: the evidence of {weakest} is {evidence[weakest]:.2f}")
    if laps < FEW_LAPS:
        doubts.append(f"only {laps:.2f} laps: the cycle is hardly an average")
    return doubts
