"""A claim of a paper, and whether it comes back on the clips at hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from mocapdb.reproduce._tables import Row

__all__ = ["Holds", "PaperFigures", "Verdict", "all_or_part", "cannot_be_told", "judged"]

Holds: TypeAlias = bool | Literal["partly"] | None
"""``"partly"`` where some of what speaks of a claim fulfils it; None where nothing tells."""

WORDS = {True: "holds", "partly": "holds partly", False: "does not hold", None: "cannot be told"}


@dataclass(frozen=True)
class Verdict:
    """One claim of a paper.

    Attributes
    ----------
    claim : str
    holds : bool, "partly" or None
        "partly" where some of what speaks of it fulfils it; None where what is at hand does not
        tell.
    figures : str
        What was found, or why it cannot be told.
    """

    claim: str
    holds: Holds
    figures: str

    @property
    def word(self) -> str:
        """The verdict in words."""
        return WORDS[self.holds]

    def __str__(self) -> str:
        return f"{self.claim}: {self.word}; {self.figures}"


class PaperFigures:
    """Ours and the paper's, by table, row and column; a row's number of frames is left out."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self._rows = rows
        self._ours = {
            (row["table"], row["row"].split(" (")[0], row["column"]): float(row["ours"])
            for row in rows
            if row["ours"] is not None
        }

    def get(self, table: str, row: str, column: str) -> float | None:
        """Return ours of a cell; None where there is none."""
        return self._ours.get((table, row.split(" (", maxsplit=1)[0], column))

    def column(self, table: str, column: str) -> dict[str, float]:
        """Return ours of a column of a table by row."""
        return {
            row: ours for (own, row, of), ours in self._ours.items() if (own, of) == (table, column)
        }

    def ratios(
        self,
        top: tuple[str, str],
        bottom: tuple[str, str],
        rows: Sequence[str] | None = None,
    ) -> dict[str, float]:
        """Return by row one (table, column) over another, where both are there."""
        above, below = self.column(*top), self.column(*bottom)
        names = list(above) if rows is None else rows
        return {
            name: above[name] / below[name] for name in names if name in above and below.get(name)
        }


def all_or_part(fulfilled: Sequence[bool]) -> bool | Literal["partly"]:
    """Return whether all, none or some of what speaks of a claim fulfils it."""
    return all(fulfilled) if all(fulfilled) == any(fulfilled) else "partly"


def judged(
    claim: str, found: Mapping[str, float], holds: Callable[[float], bool], what: str
) -> Verdict:
    """Return a verdict that needs all of some figures to fulfil a condition, and names them."""
    if not found:
        return Verdict(claim, None, "nothing at hand")
    told = ", ".join(f"{name} {value:.2f}" for name, value in found.items())
    return Verdict(claim, all(map(holds, found.values())), f"{what}: {told}")


def cannot_be_told(claim: str, why: str) -> Verdict:
    """Return the verdict on a claim that nothing at hand speaks of."""
    return Verdict(claim, None, why)
