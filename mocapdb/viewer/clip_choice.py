"""Which clips of a library are looked at: by words, by what their labels say, by what was measured.

The rows of the catalogue are read once; choosing among some thousand clips is then a matter of
milliseconds, and so is saying how many each further choice would leave.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.library.facets import FACETS, FacetRange, checked_facets
from mocapdb.library.searching.retrieval import Filter

if TYPE_CHECKING:
    from mocapdb.library import Library
    from mocapdb.library.clip_record import ClipRecord

__all__ = ["CLASS", "FLAGGED", "Choice", "ClipChoice", "Histogram"]

CLASS, SUBJECT = "class", "subject"
FLAGGED = {"none left": False, "some left": True}
"""Of clips that were searched for faults with ``mocapdb clean --apply``."""

BARS = 24  # of a histogram
SAME = 1e-6  # of numbers that are this near to each other there is nothing to choose
MOST_VALUES = 200  # values of a column that are told apart: beyond, it is a text and no label


@dataclass(frozen=True)
class Choice:
    """What is asked of clips; every part that is given must fit.

    Attributes
    ----------
    text : str
        Words, as in ``mocapdb ls --search``.
    values : mapping of str to str
        A value of the class, the subject, or a further column of the labels.
    ranges : mapping of str to FacetRange
        Of what `FACETS` names.
    flagged : bool, optional
        Whether flagged faults were left in them.
    """

    text: str = ""
    values: Mapping[str, str] = field(default_factory=dict)
    ranges: Mapping[str, FacetRange] = field(default_factory=dict)
    flagged: bool | None = None

    def __bool__(self) -> bool:
        return bool(self.text.strip() or self.values or self.ranges) or self.flagged is not None

    def filter(self) -> Filter:
        """Return the same as what a query is given."""
        where = dict(self.values)
        return Filter(
            label=where.pop(CLASS, None),
            text=self.text.strip() or None,
            where=where,
            facets=dict(self.ranges),
            flagged=self.flagged,
        )

    def with_value(self, column: str, value: str) -> Choice:
        """Return it with a value of a column, or without the one it had if it is the same."""
        values = {name: said for name, said in self.values.items() if name != column}
        if self.values.get(column) != value:
            values[column] = value
        return replace(self, values=values)

    def with_range(self, facet: str, ends: FacetRange | None) -> Choice:
        """Return it with another range of a facet, or with none.

        Raises
        ------
        LibraryError
            If the range is reversed, no number, or less than can be.
        """
        ranges = {name: known for name, known in self.ranges.items() if name != facet}
        if ends is not None and ends != FacetRange():
            ranges |= checked_facets({facet: ends})
        return replace(self, ranges=ranges)


class Histogram(NamedTuple):
    """How many clips have which numbers.

    Attributes
    ----------
    low, high : float
        From where to where: the least and the most of all clips.
    counts : (B,)
    """

    low: float
    high: float
    counts: IntArray


class ClipChoice:
    """The clips of a library, and which of them fit a `Choice`.

    Parameters
    ----------
    library : Library
        Read once, but for searches by words.

    Attributes
    ----------
    records : list of ClipRecord
        By name.
    columns : dict of str to list of str
        What each clip has: its class, its subject, and further columns of the labels.
    numbers : dict of str to (N,)
        Of what `FACETS` names; NaN where nothing was measured.
    """

    def __init__(self, library: Library) -> None:
        self._library = library
        self.records: list[ClipRecord] = library.records()
        self._place = {record.id: i for i, record in enumerate(self.records)}
        measured = library.catalogue.facets()
        each = [measured.get(record.id) for record in self.records]
        self.numbers: dict[str, FloatArray] = {
            "root_speed": np.array([math.nan if m is None else m.root_speed_ms for m in each]),
            "turn": np.array([math.nan if m is None else m.turn_deg for m in each]),
            "height": np.array([r.height_m or math.nan for r in self.records]),
            "duration": np.array([record.duration_s for record in self.records]),
            "contacts": np.array([math.nan if m is None else m.contacts for m in each]),
        }
        assert [*self.numbers] == [*FACETS]
        self.columns = {
            CLASS: [record.label or "" for record in self.records],
            SUBJECT: [record.performer for record in self.records],
        }
        for name in library.catalogue.column_names():
            self.columns.setdefault(name, [each.columns.get(name, "") for each in self.records])
        revisions = library.catalogue.revisions()
        left = [revisions.get(record.id) for record in self.records]
        self._searched = np.array([revision is not None for revision in left], dtype=np.bool_)
        self._left = np.array([revision is not None and bool(revision.left) for revision in left],
                              dtype=np.bool_)  # fmt: skip
        self._words: tuple[str, IntArray] | None = None

    @property
    def was_searched(self) -> bool:
        """Whether any clip was searched for faults, so that it is known what is left."""
        return bool(self._searched.any())

    def facet_columns(self) -> Iterator[str]:
        """Yield the columns of which clips have several values, but few enough to choose among."""
        for name, values in self.columns.items():
            if 1 < len({value for value in values if value}) <= MOST_VALUES:
                yield name

    def rows(self, choice: Choice) -> IntArray:
        """Return the clips that fit, by name; where words are asked for, the best first."""
        fitting = self._fitting(choice)
        if not choice.text.strip():
            return np.flatnonzero(fitting)
        found = self._found(choice.text)
        return found[fitting[found]]

    def counts(self, column: str, choice: Choice) -> Counter[str]:
        """Return how many clips have each value of a column, of those that fit all else."""
        values = self.columns[column]
        fitting = self._fitting(choice, but=column)
        return Counter(values[i] for i in np.flatnonzero(fitting) if values[i])

    def histogram(self, facet: str, choice: Choice) -> Histogram | None:
        """Return which numbers the clips have that fit all else; None where nobody knows them.

        Nor is there one where all clips have the same. It goes from where to where the numbers of
        all clips go.
        """
        numbers = self.numbers[facet]
        known = numbers[np.isfinite(numbers)]
        if not len(known):
            return None
        low, high = float(known.min()), float(known.max())
        if high - low <= SAME * max(abs(low), abs(high)):
            return None
        own = numbers[self._fitting(choice, but=facet)]
        counts, _ = np.histogram(own[np.isfinite(own)], BARS, (low, high))
        return Histogram(low, high, counts)

    def _fitting(self, choice: Choice, but: str = "") -> BoolArray:
        """Return which clips fit, whatever they are by one column or facet."""
        fitting = np.ones(len(self.records), dtype=np.bool_)
        for column, value in choice.values.items():
            if column != but:
                values = self.columns.get(column, [])
                fitting &= np.array([each == value for each in values] or False)
        for facet, (low, high) in choice.ranges.items():
            if facet != but:
                numbers = self.numbers[facet]
                fitting &= (numbers >= low) & (numbers <= high)
        if choice.flagged is not None and but != "flagged":
            fitting &= self._searched & (self._left == choice.flagged)
        if choice.text.strip():
            with_words = np.zeros(len(self.records), dtype=np.bool_)
            with_words[self._found(choice.text)] = True
            fitting &= with_words
        return fitting

    def _found(self, text: str) -> IntArray:
        """Return the clips that have some words, the best first; those of the last are kept."""
        if self._words is None or self._words[0] != text:
            found: Sequence[ClipRecord] = self._library.records(search=text)
            places = [self._place[each.id] for each in found if each.id in self._place]
            self._words = text, np.array(places, dtype=np.int64)
        return self._words[1]
