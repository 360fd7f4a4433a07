"""Panel: the list of the clips that are chosen, with their pictures, sorted by any column."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mocapdb.viewer.clip_choice import Choice, ClipChoice
from mocapdb.viewer.panel import Panel, breakable, number_cell, paragraph, table, text_cell
from mocapdb.viewer.pictures import picture_html

if TYPE_CHECKING:
    from mocapdb.base.arrays import IntArray
    from mocapdb.library.clip_record import ClipRecord
    from mocapdb.viewer.panel import PanelHost

__all__ = ["COLUMNS", "FIRST_COLUMNS", "ClipPanel", "Column", "ordered"]

PAGE_ROWS = 60  # clips that are listed at once
MOST_SEARCHED = 200  # clips that are searched for faults at once
FIRST_COLUMNS = ("length", "speed", "turn")


@dataclass(frozen=True)
class Column:
    """A column of the list.

    Attributes
    ----------
    value : callable
        Returns the numbers, NaN where nobody knows, or the texts of all clips by name.
    form : str
        How a number is written, with its unit.
    """

    value: Callable[[ClipChoice, Mapping[str, int]], Sequence[float | str]]
    form: str = "{}"


def _number(facet: str, form: str) -> Column:
    return Column(lambda clips, _: clips.numbers[facet].tolist(), form)


def _flags(clips: ClipChoice, flags: Mapping[str, int]) -> list[float]:
    return [flags.get(record.name, math.nan) for record in clips.records]


NAME = "clip"
COLUMNS: Mapping[str, Column] = {
    NAME: Column(lambda clips, _: [record.name for record in clips.records]),
    "length": _number("duration", "{:.1f} s"),
    "speed": _number("root_speed", "{:.1f} m/s"),
    "turn": _number("turn", "{:.0f}°"),
    "steps": _number("contacts", "{:.0f}"),
    "stature": _number("height", "{:.2f} m"),
    "frame rate": Column(lambda clips, _: [r.fps for r in clips.records], "{:g} fps"),
    "flags": Column(_flags, "{:.0f}"),
}
"""Columns that any library has, beside those of its labels."""


def ordered(values: Sequence[float | str], rows: Sequence[int], *, down: bool) -> list[int]:
    """Return rows by their values, and by name where these are the same; the unknown come last."""

    def is_known(row: int) -> bool:
        value = values[row]
        return value != "" and not (isinstance(value, float) and math.isnan(value))

    known = [row for row in rows if is_known(row)]
    first = sorted(sorted(known), key=lambda row: (values[row],), reverse=down)
    return [*first, *sorted(row for row in rows if not is_known(row))]


class ClipPanel(Panel):
    """The list of clips.

    Parameters
    ----------
    host : PanelHost
    gui : viser.GuiApi
    clips : ClipChoice
    """

    def __init__(self, host: PanelHost, gui: Any, clips: ClipChoice) -> None:
        self._clips = clips
        super().__init__(host, gui)

    def _add_controls(self, gui: Any) -> None:
        host = self._host
        of_labels = {name: self._of_labels(name) for name in self._clips.columns}
        self._columns = {**COLUMNS, **of_labels}
        self._shown = [NAME, *FIRST_COLUMNS]
        self._sorted, self._down = NAME, False  # by name, or what the words fit best
        self._page = 0
        self._choice = Choice()
        self._rows: list[int] = []
        self._marks = 0
        self._table = gui.add_html("")
        self._mark = gui.add_html("")
        search = gui.add_button(
            "Look for faults in these", hint="Counts what is flagged in each clip of the list."
        )
        search.on_click(self._does(self._find_faults))
        host.on_message("open", host.open)
        host.on_message("sort", self._sort)
        host.on_message("page", lambda number: self._turn_to(int(number)))
        host.on_message("column", self._switch_column)
        host.on_message("next", lambda step: self._open_next(int(step)))
        self.show(self._choice)

    @staticmethod
    def _of_labels(name: str) -> Column:
        return Column(lambda clips, _: clips.columns[name])

    def _values(self, column: str) -> Sequence[float | str]:
        values: Sequence[float | str] = self._columns[column].value(self._clips, self._host.flags)
        return values

    def show(self, choice: Choice) -> None:
        """List the clips that are chosen, from the first."""
        self._choice = choice
        self._order()
        self._page = 0
        self._write()

    def follow(self) -> None:
        """Mark the clip that is open, and turn to its page."""
        place = self._place_of_open()
        if place is not None and place // PAGE_ROWS != self._page:
            self._page = place // PAGE_ROWS
            self._write()
        else:
            self._mark_open()

    def tell_flags(self) -> None:
        """Write what is flagged, where that is shown."""
        if "flags" in self._shown:
            self._order()
            self._write()

    def _order(self) -> None:
        rows: IntArray = self._clips.rows(self._choice)
        by_name = self._sorted == NAME and not self._down
        if by_name:  # they are, or the best first
            self._rows = rows.tolist()
        else:
            self._rows = ordered(self._values(self._sorted), rows.tolist(), down=self._down)

    def _sort(self, column: str) -> None:
        """Sort by a column; again, the other way round."""
        if column not in self._shown:
            return
        self._down = column == self._sorted and not self._down
        self._sorted = column
        self._order()
        self._page = 0
        self._write()

    def _turn_to(self, page: int) -> None:
        self._page = min(max(page, 0), max(0, (len(self._rows) - 1) // PAGE_ROWS))
        self._write()

    def _switch_column(self, column: str) -> None:
        """Show a column, or no more."""
        if column in self._shown and column != NAME:
            self._shown.remove(column)
            if self._sorted == column:
                self._sorted, self._down = NAME, False
                self._order()
        elif column in self._columns and column != NAME:
            self._shown.append(column)
        self._write()

    def _place_of_open(self) -> int | None:
        name = self._view.name
        for place, row in enumerate(self._rows):
            if self._clips.records[row].name == name:
                return place
        return None

    def _open_next(self, step: int) -> None:
        """Open the clip after the one that is open in the list, or before it."""
        place = self._place_of_open()
        after = 0 if place is None else place + step
        if 0 <= after < len(self._rows):
            self._host.open(self._clips.records[self._rows[after]].name)

    # -- HTML --------------------------------------------------------------------------------------

    def _write(self) -> None:
        first = PAGE_ROWS * self._page
        shown = self._rows[first : first + PAGE_ROWS]
        values = {name: self._values(name) for name in self._shown if name != NAME}
        heads = (
            f'<th data-send="sort {html.escape(name)}">{html.escape(name)}'
            f"{('▼' if self._down else '▲') if name == self._sorted else ''}</th>"
            for name in self._shown
        )
        rows = (self._row(row, values) for row in shown)
        self._table.content = paragraph(
            f"{self._pages(first, len(shown))}{self._menu()}",
            table(heads, rows, scroll=f"clips {self._page}"),
            " mt-clips",
        )
        self._mark_open()

    def _row(self, row: int, values: Mapping[str, Sequence[float | str]]) -> str:
        record = self._clips.records[row]
        cells = [self._name_cell(record)]
        for name, column in values.items():
            value = column[row]
            if isinstance(value, str):
                cells.append(text_cell(value))
            else:
                form = self._columns[name].form
                text = "–" if math.isnan(value) else form.format(value)
                cells.append(number_cell(re.sub(r"^-(0(\.0*)?)(?!\d)", r"\1", text)))  # no -0
        return (
            f'<tr id="clip-{record.id}" data-send="open {html.escape(record.name)}" '
            f'title="{html.escape(record.description)}">{"".join(cells)}</tr>'
        )

    def _name_cell(self, record: ClipRecord) -> str:
        said = " · ".join(text for text in (record.label, record.description) if text)
        return (
            f"<td class=mt-name><div>{picture_html(self._host.library, record)}"
            f"<span><b>{breakable(record.name)}</b><small>{html.escape(said)}</small></span>"
            "</div></td>"
        )

    def _pages(self, first: int, n_shown: int) -> str:
        """Return which clips are shown, and buttons for those before and after them."""
        n_all = len(self._rows)
        if n_all <= PAGE_ROWS:
            return f"{n_all} clips"
        before = f'<button data-send="page {self._page - 1}" aria-label="before">‹</button>'
        after = f'<button data-send="page {self._page + 1}" aria-label="after">›</button>'
        return (
            f"{before if first else ''} {first + 1:,} to {first + n_shown:,} of {n_all:,} clips "
            f"{after if first + n_shown < n_all else ''}"
        )

    def _menu(self) -> str:
        """Return the menu of columns: choosing one shows or hides it."""
        options = "".join(
            f'<option value="{html.escape(name)}">{"✓" if name in self._shown else "  "} '
            f"{html.escape(name)}</option>"
            for name in self._columns
            if name != NAME
        )
        return (
            '<select data-choose="column" aria-label="columns">'
            f"<option selected disabled>columns</option>{options}</select>"
        )

    def _mark_open(self) -> None:
        """Mark the row of the clip that is open, by a rule of style, and bring it in sight.

        The list itself is not written anew: it stays where it was scrolled to.
        """
        record = self._view.record
        if record is None:
            return
        self._marks += 1
        missing = "" if self._place_of_open() is not None else paragraph(
            f"{breakable(record.name)} is open, and not among these."
        )  # fmt: skip
        self._mark.content = (
            f"<style>#clip-{record.id} {{ background: #d8e9f5 }}</style>{missing}"
            f'<img hidden alt="" src="data:,{self._marks}" '
            f"onerror=\"window.mocapdbShow && mocapdbShow('clip-{record.id}')\">"
        )

    # -- faults ------------------------------------------------------------------------------------

    def _find_faults(self) -> None:
        if "flags" not in self._shown:
            self._switch_column("flags")
        flags = self._host.flags
        names = [self._clips.records[row].name for row in self._rows]
        self._find_next([name for name in names if name not in flags][:MOST_SEARCHED])

    def _find_next(self, names: list[str]) -> None:
        """Look for faults in the first of some clips, and then in the others."""
        self.tell_flags()
        if names:
            self._host.find_faults(names[0], lambda _: self._find_next(names[1:]))
