"""What Vejdemo-Johansson et al. (2015) conclude, and whether it comes back on clips at hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from mocapdb.reproduce._tables import Row
from mocapdb.reproduce.side_by_side.verdict import (
    PaperFigures,
    Verdict,
    all_or_part,
    cannot_be_told,
)
from mocapdb.reproduce.vejdemo_walks import OTHERS, TABLE

__all__ = ["verdicts"]

NEAR = 0.05
"""Share by which laps may differ."""

FRAMES_A_SECOND = 11.78
JERK = 2.0
"""Times that a jerk of similar size may differ by."""

SEAM = 2.0
"""Median steps up to which a seam is a step like others."""


def verdicts(rows: Sequence[Row]) -> list[Verdict]:
    """Return a verdict on each of their claims, from table 1 and the walks."""
    figures = PaperFigures(rows)
    laps = figures.column(TABLE, "laps")
    true = figures.column(TABLE, "laps by autocorrelation")
    return [
        _near("A period is found without marking where it begins and ends", laps, true),
        _robust(figures, laps),
        _near(
            "A projection on few principal axes keeps the circle",
            figures.column(TABLE, "laps on 3 axes"),
            laps,
        ),
        _speed(figures),
        _post(figures),
        _jerk(figures),
        _blends(figures),
        _several(figures),
        cannot_be_told(
            "The three punches of 143_23 are five persistent classes", "clip 143_23 not at hand"
        ),
        cannot_be_told(
            "Walking, jogging and hopping, put after each other, show at two distances",
            "clips 104_19, 143_01 and 143_05 not at hand; two gaits in one clip are above",
        ),
    ]


def _told(found: Mapping[str, float], digits: int = 2) -> str:
    return ", ".join(f"{name} {value:.{digits}f}" for name, value in found.items())


def _near(claim: str, ours: Mapping[str, float], other: Mapping[str, float]) -> Verdict:
    """Return a verdict that needs laps to agree, clip by clip."""
    ratios = {clip: ours[clip] / other[clip] for clip in ours if other.get(clip)}
    return _by_clip(
        claim, ratios, lambda ratio: abs(ratio - 1) <= NEAR, "laps over what they should be"
    )


def _robust(figures: PaperFigures, laps: Mapping[str, float]) -> Verdict:
    claim = "The circle hardly depends on the one parameter, the distance"
    if not laps:
        return Verdict(claim, None, "no walk at hand as AMC")
    right, told = [], []
    for share in OTHERS:
        other = figures.column(TABLE, f"laps at {share:g} times the distance")
        ratios = [other.get(clip, np.nan) / laps[clip] for clip in laps]
        same = [abs(ratio - 1) <= NEAR for ratio in ratios]
        right += same
        told.append(f"{sum(same)} of {len(same)} keep their laps at {share:g} times")
    return Verdict(claim, all_or_part(right), ", ".join(told))


def _by_clip(
    claim: str,
    found: Mapping[str, float],
    holds: Callable[[float], bool],
    what: str,
    *,
    lacks: str = "no walk at hand as AMC",
    digits: int = 2,
) -> Verdict:
    """Return a verdict that holds partly where some clips bear it out, and names their figures."""
    if not found:
        return Verdict(claim, None, lacks)
    right = [holds(value) for value in found.values()]
    return Verdict(claim, all_or_part(right), f"{what}: {_told(found, digits)}")


def _speed(figures: PaperFigures) -> Verdict:
    return _by_clip(
        f"A clip takes minutes at most: {FRAMES_A_SECOND} frames a second and more",
        figures.column(TABLE, "frames a second"),
        lambda speed: speed >= FRAMES_A_SECOND,
        "frames a second",
        digits=0,
    )


def _post(figures: PaperFigures) -> Verdict:
    return _by_clip(
        "What follows the cohomology takes longer than the cohomology in many cases",
        figures.column(TABLE, "time after cohomology over its own"),
        lambda share: share > 1,
        "times its time",
    )


def _jerk(figures: PaperFigures) -> Verdict:
    return _by_clip(
        "The typical motion jerks about as much as the clip",
        figures.column(TABLE, "jerk over the clip's"),
        lambda ratio: 1 / JERK <= ratio <= JERK,
        "times the clip's",
    )


def _blends(figures: PaperFigures) -> Verdict:
    return _by_clip(
        "Between two motions lies one that is periodic too",
        figures.column(TABLE, "seam of the blend, steps"),
        lambda seam: seam <= SEAM,
        "seam of the blend in median steps",
        lacks="no two walks at hand as AMC",
    )


def _several(figures: PaperFigures) -> Verdict:
    return _by_clip(
        "Several motions in one clip are found, each by a coordinate of its own",
        figures.column(TABLE, "motions found of two in one"),
        lambda count: count == 2,
        "motions found of two",
        lacks="no two walks at hand as AMC",
        digits=0,
    )
