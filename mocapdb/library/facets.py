"""Facets: numbers of each clip that clips are chosen by, such as how fast its root goes.

`Facets`      what is measured of a clip when its features are made, kept in the catalogue
`FACETS`      every number that clips can be chosen by, measured or known anyway
`FacetRange`  from where to where, both ends included
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from mocapdb.base.spelling import did_you_mean
from mocapdb.errors import LibraryError

__all__ = ["FACETS", "Facet", "FacetRange", "Facets", "checked_facets"]


@dataclass(frozen=True)
class Facets:
    """What is measured of a clip.

    Attributes
    ----------
    root_speed_ms : float, metres a second
        Mean speed of the middle of the hips over the ground.
    turn_deg : float, degrees
        By how much the hips face elsewhere at the end than at the beginning, whole turns
        counted; to the left is positive.
    contacts : int
        How often a foot is set down.
    """

    root_speed_ms: float
    turn_deg: float
    contacts: int


class Facet(NamedTuple):
    """A number that clips can be chosen by.

    Attributes
    ----------
    sql : str
        The number in SQL, of a row of ``clips`` joined with ``facets``.
    unit : str
    least : float
        It cannot be less.
    what : str
    measured : bool
        Whether it stands in the table ``facets``.
    """

    sql: str
    unit: str
    least: float
    what: str
    measured: bool


FACETS: Final[Mapping[str, Facet]] = {
    "root_speed": Facet(
        "facets.root_speed_ms", "m/s", 0.0, "Mean speed of the hips over the ground", True
    ),
    "turn": Facet(
        "facets.turn_deg", "degrees", -math.inf, "Change of facing, to the left positive", True
    ),
    "height": Facet("clips.height_m", "m", 0.0, "Stature of who performs it", False),
    "duration": Facet("clips.frames / clips.fps", "s", 0.0, "Length in seconds", False),
    "contacts": Facet("facets.contacts", "times", 0.0, "How often a foot is set down", True),
}


class FacetRange(NamedTuple):
    """A range of numbers, both ends included; infinite where it is open."""

    low: float = -math.inf
    high: float = math.inf

    @classmethod
    def of_text(cls, text: str) -> FacetRange:
        """Return what ``A:B``, ``A:`` or ``:B`` says.

        Raises
        ------
        LibraryError
            If it is no such text, or says nothing.
        """
        low, colon, high = text.partition(":")
        try:
            if not colon or not text.strip(": "):
                raise ValueError
            return cls(float(low) if low.strip() else -math.inf,
                       float(high) if high.strip() else math.inf)  # fmt: skip
        except ValueError:
            raise LibraryError(f"Expected a range A:B, A: or :B, but got {text!r}.") from None

    def __str__(self) -> str:
        ends = ("" if math.isinf(end) else f"{end:g}" for end in self)
        return ":".join(ends)


def checked_facets(
    facets: Mapping[str, tuple[float | None, float | None]],
) -> dict[str, FacetRange]:
    """Return ranges by facet, once they make sense.

    Parameters
    ----------
    facets : mapping of str to (low, high)
        None, or an infinite number, where a range is open.

    Raises
    ------
    LibraryError
        If there is no such facet, or a range is reversed, no number, or less than can be.

    Examples
    --------
    >>> checked_facets({"root_speed": (1.0, None)})
    {'root_speed': FacetRange(low=1.0, high=inf)}
    """
    checked = {}
    for name, (low, high) in facets.items():
        if name not in FACETS:
            raise LibraryError(
                f"Expected a facet out of {', '.join(FACETS)}, but got {name!r}."
                + did_you_mean(name, FACETS)
            )
        facet, said = FACETS[name], name.replace("_", "-")
        ends = FacetRange(-math.inf if low is None else low, math.inf if high is None else high)
        if math.isnan(ends.low) or math.isnan(ends.high):
            raise LibraryError(f"Expected numbers for {said}, but got {ends}.")
        if ends.low > ends.high:
            raise LibraryError(
                f"Expected the lower end of {said} first, but got {ends}. "
                f"Say {FacetRange(ends.high, ends.low)}."
            )
        if (math.isfinite(ends.low) and ends.low < facet.least) or ends.high < facet.least:
            raise LibraryError(f"Expected a {said} of {facet.least:g} or more, but got {ends}.")
        checked[name] = ends
    return checked
