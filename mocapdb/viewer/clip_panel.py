"""Panel: the list of clips, searched and sorted."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mocapdb.library.clip_record import ClipRecord
from mocapdb.viewer.panel import Panel, number_cell, paragraph, row, table, text_cell

__all__ = ["COLUMNS", "ClipPanel", "matching", "ordered"]

MOST_ROWS = 200  # clips that are listed, and searched for faults at once
EVERY_CLASS = "every class"


@dataclass(frozen=True)
class Column:
    """A column of the list."""

    head: str
    value: Callable[[ClipRecord, Mapping[str, int]], float | str]
    form: str = "{}"


COLUMNS = (
    Column("clip", lambda record, _: record.name),
    Column("class", lambda record, _: record.label or ""),
    Column("subject", lambda record, _: record.performer),
    Column("s", lambda record, _: record.duration_s, "{:.1f}"),
    Column("B/frame", lambda record, _: record.bytes_per_frame, "{:.1f}"),
    Column("mm", lambda record, _: record.error_mean_mm, "{:.2f}"),
    Column("flags", lambda record, flags: flags.get(record.name, -1)),
)


def matching(records: Sequence[ClipRecord], text: str, label: str | None) -> list[ClipRecord]:
    """Return the records of a class, or of any, that have every word of a text somewhere."""
    words = text.lower().split()
    return [
        record
        for record in records
        if (label is None or record.label == label)
        and all(
            word in f"{record.name} {record.label or ''} {record.description}".lower()
            for word in words
        )
    ]


def ordered(
    records: Sequence[ClipRecord], column: int, down: bool, flags: Mapping[str, int]
) -> list[ClipRecord]:
    """Return the records sorted by a column."""
    value = COLUMNS[column].value
    return sorted(records, key=lambda record: (value(record, flags), record.name), reverse=down)


class ClipPanel(Panel):
    """The list of clips, a field to search it and a menu of classes.

    Attributes
    ----------
    records : list of ClipRecord
        Every clip of the library, as it was when the session began.
    """

    def _add_controls(self, gui: Any) -> None:
        host = self._host
        self._column, self._down = 0, False
        self.records = host.library.records()
        self._text = gui.add_text("search", "", hint="Words of name, class or description.")
        classes = (EVERY_CLASS, *host.library.classes())
        self._label = gui.add_dropdown("class", classes, initial_value=EVERY_CLASS)
        self._table = gui.add_html("")
        search = gui.add_button(
            "Look for faults in these", hint="Counts what is flagged in each clip of the list."
        )
        for control in (self._text, self._label):
            control.on_update(self._does(self.refresh))
        search.on_click(self._does(self._find_faults))
        host.on_message("open", host.open)
        host.on_message("sort", lambda column: self._sort(int(column) % len(COLUMNS)))
        self.refresh()

    def _sort(self, column: int) -> None:
        """Sort by a column; again, the other way round."""
        self._down = column == self._column and not self._down
        self._column = column
        self.refresh()

    def _shown(self) -> list[ClipRecord]:
        label = None if self._label.value == EVERY_CLASS else self._label.value
        records = matching(self.records, self._text.value, label)
        return ordered(records, self._column, self._down, self._host.flags)

    def refresh(self) -> None:
        """Write the list anew."""
        records = self._shown()
        heads = (
            f'<th data-send="sort {i}">{column.head}'
            f"{('▼' if self._down else '▲') if i == self._column else ''}</th>"
            for i, column in enumerate(COLUMNS)
        )
        more = f" (the first {MOST_ROWS} are listed)" if len(records) > MOST_ROWS else ""
        rows = map(self._row, records[:MOST_ROWS])
        self._table.content = paragraph(f"{len(records)} clips{more}", table(heads, rows))

    def _row(self, record: ClipRecord) -> str:
        cells = []
        for column in COLUMNS:
            value = column.value(record, self._host.flags)
            if isinstance(value, str):
                cells.append(text_cell(value))
            else:
                cells.append(number_cell("–" if value == -1 else column.form.format(value)))
        here = record.name == self._view.name
        return row(f"open {record.name}", cells, here=here, title=record.description)

    def _find_faults(self) -> None:
        flags = self._host.flags
        names = [record.name for record in self._shown() if record.name not in flags]
        self._find_next(names[:MOST_ROWS])

    def _find_next(self, names: list[str]) -> None:
        """Look for faults in the first of some clips, and then in the others."""
        self.refresh()
        if names:
            self._host.find_faults(names[0], lambda _: self._find_next(names[1:]))
