"""What Raunio (2014) concludes from his tables, and whether it comes back on the clips at hand."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from mocapdb.reproduce._tables import Row
from mocapdb.reproduce.raunio import FAILED
from mocapdb.reproduce.side_by_side.verdict import (
    Holds,
    PaperFigures,
    Verdict,
    all_or_part,
    cannot_be_told,
)

__all__ = ["verdicts"]

GAITS = ("A.2", "A.3")
BOXING = "A.1"
ERRORS = ("B.1", "B.2", "B.3")
SIMILAR = 1.25
LARGER = 1.5
MOSTLY = 0.8
"""Share of clips from which on he may say "tends to" and "generally"."""


def verdicts(rows: Sequence[Row]) -> list[Verdict]:
    """Return a verdict on each of his claims, from the rows of `raunio.reproduce`."""
    figures = PaperFigures(rows)
    boxers = sorted({row["row"] for row in rows if row["table"] == BOXING})
    return [
        _ratio_claim(
            figures, "M1 is about as near to the poses as M2", "M1 pos", "M2 pos", at_most=SIMILAR
        ),
        _alike(figures),
        _ratio_claim(
            figures, "M3 is much further off in position", "M3 pos", "M1 pos", at_least=LARGER
        ),
        _ratio_claim(
            figures, "M3's accelerations outweigh its positions", "M3 acc", "M3 pos", at_least=10.0
        ),
        _ratio_claim(
            figures,
            "Velocities and accelerations keep M1 from overfitting: its accelerations are nearer "
            "than M2's",
            "M2 acc",
            "M1 acc",
            at_least=1.0,
        ),
        _templates(figures),
        _same_index(figures),
        _gaits(rows),
        cannot_be_told(
            "Boxing gives no good circle: its laps differ too much",
            f"clips {', '.join(boxers)} not at hand" if boxers else "nothing at hand",
        ),
        cannot_be_told(
            "One bone of the hand makes 35_19 fail, and without it the circle is right",
            "clip 35_19 not at hand",
        ),
        cannot_be_told(
            "Laps that are not whole make the motion pass some poses too quickly, runs' more than "
            "walks'",
            "he gives no figure for it",
        ),
    ]


def _counted(claim: str, found: dict[str, bool], figures: str) -> Verdict:
    """Return a verdict that holds if most clips fulfil it, and partly if some do."""
    if not found:
        return Verdict(claim, None, "nothing at hand")
    right = sum(found.values())
    holds: Holds = right >= MOSTLY * len(found)
    if right and not holds:
        holds = "partly"
    return Verdict(claim, holds, f"in {right} of {len(found)} clips; {figures}")


def _ratio_claim(
    figures: PaperFigures,
    claim: str,
    top: str,
    bottom: str,
    *,
    at_most: float = float("inf"),
    at_least: float = 0.0,
) -> Verdict:
    """Return a verdict on how many times one column another is."""
    ratios: dict[str, float] = {}
    for table in ERRORS:
        ratios |= figures.ratios((table, top), (table, bottom))
    found = {clip: at_least <= ratio <= at_most for clip, ratio in ratios.items()}
    if not ratios:
        return _counted(claim, found, "")
    middle, most = float(np.median(list(ratios.values()))), max(ratios.values())
    told = f"{top} over {bottom}: {middle:.2f} in the median, {most:.2f} at most"
    return _counted(claim, found, told)


def _alike(figures: PaperFigures) -> Verdict:
    claim = "M1 is as far off in velocity and acceleration, weighted, as in position"
    spread = {}
    for table in ERRORS:
        columns = [figures.column(table, f"M1 {name}") for name in ("pos", "vel", "acc")]
        for clip in columns[0]:
            values = [column[clip] for column in columns if clip in column]
            spread[clip] = max(values) / max(min(values), 1e-12)
    if not spread:
        return _counted(claim, {}, "")
    middle, most = float(np.median(list(spread.values()))), max(spread.values())
    told = f"largest over smallest: {middle:.2f} in the median, {most:.2f} at most"
    return _counted(claim, {clip: ratio <= SIMILAR for clip, ratio in spread.items()}, told)


def _templates(figures: PaperFigures) -> Verdict:
    claim = "M1 and M2 have about the same template error"
    ratios: dict[str, float] = {}
    for table in (BOXING, *GAITS):
        ratios |= figures.ratios((table, "M1 template"), (table, "M2 template"))
    if not ratios:
        return _counted(claim, {}, "")
    found = {clip: 1 / SIMILAR <= ratio <= SIMILAR for clip, ratio in ratios.items()}
    middle = float(np.median(list(ratios.values())))
    return _counted(claim, found, f"M1 over M2: {middle:.2f} in the median")


def _same_index(figures: PaperFigures) -> Verdict:
    claim = "M1 and M2 match the same frame"
    apart: dict[str, float] = {}
    for table in (BOXING, *GAITS):
        first, second = (figures.column(table, f"{model} index") for model in ("M1", "M2"))
        apart |= {clip: abs(first[clip] - second[clip]) for clip in first if clip in second}
    found = {clip: frames <= 2 for clip, frames in apart.items()}
    told = f"{np.median(list(apart.values())):g} frames apart in the median" if apart else ""
    return _counted(claim, found, told)


def _gaits(rows: Sequence[Row]) -> Verdict:
    claim = "Walks and runs give a good circle: laps are counted right"
    by_class: dict[str, list[bool]] = {"walks": [], "runs": []}
    failed = []
    for row in rows:
        if row["table"] not in GAITS or row["column"] != "period count" or row["ours"] is None:
            continue
        told = re.search(r"autocorrelation ([\d.]+)", row["note"])
        if told is None:
            continue
        right = abs(float(row["ours"]) / float(told[1]) - 1.0) <= FAILED
        by_class["walks" if row["table"] == GAITS[0] else "runs"].append(right)
        if not right:
            failed.append(row["row"])
    known = {name: found for name, found in by_class.items() if found}
    if not known:
        return Verdict(claim, None, "nothing at hand")
    told_of = ", ".join(f"{sum(own)} of {len(own)} {name}" for name, own in known.items())
    more = f"; not {', '.join(failed)}" if failed else ""
    holds = all_or_part([right for own in known.values() for right in own])
    return Verdict(claim, holds, f"within {FAILED:.0%} of autocorrelation: {told_of}{more}")
