"""Panel: the list of clips, searched and sorted."""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mocapdb.library.catalogue import ClipRecord
from mocapdb.library.naming import subject_of

if TYPE_CHECKING:
    from mocapdb.viewer.session import Session

__all__ = ["COLUMNS", "ClipsPanel", "matching", "ordered"]

MOST_ROWS = 200
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
    Column("subject", lambda record, _: subject_of(record.stem)),
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


class ClipsPanel:
    """The list of clips, a field to search it and a menu of classes.

    Parameters
    ----------
    session : Session
    gui : viser.GuiApi

    Attributes
    ----------
    records : list of ClipRecord
        Every clip of the library, as it was when the session began.
    """

    def __init__(self, session: Session, gui: Any) -> None:
        self._session = session
        self._column, self._down = 0, False
        library = session.library
        self.records = library.records()
        self._text = gui.add_text("search", "", hint="Words of name, class or description.")
        counts = library.classes()
        self._label = gui.add_dropdown("class", (EVERY_CLASS, *counts), initial_value=EVERY_CLASS)
        self._table = gui.add_html("")
        self._look = gui.add_button(
            "Look for faults in these", hint="Counts what is flagged in each clip of the list."
        )
        self._text.on_update(lambda _: session.post(self.refresh))
        self._label.on_update(lambda _: session.post(self.refresh))
        self._look.on_click(lambda _: session.post(self._look_for_faults))
        self.refresh()

    def sort(self, column: int) -> None:
        """Sort by a column; again, the other way round."""
        self._down = column == self._column and not self._down
        self._column = column
        self.refresh()

    def shown(self) -> list[ClipRecord]:
        """Return the clips of the list."""
        label = None if self._label.value == EVERY_CLASS else self._label.value
        records = matching(self.records, self._text.value, label)
        return ordered(records, self._column, self._down, self._session.flags)

    def refresh(self) -> None:
        """Write the list anew."""
        records = self.shown()
        heads = "".join(
            f'<th data-send="sort {i}">{column.head}'
            f"{('▼' if self._down else '▲') if i == self._column else ''}</th>"
            for i, column in enumerate(COLUMNS)
        )
        rows = "".join(self._row(record) for record in records[:MOST_ROWS])
        more = f" (the first {MOST_ROWS} are listed)" if len(records) > MOST_ROWS else ""
        self._table.content = (
            f'<div class="mt-list"><p>{len(records)} clips{more}</p><div class="mt-scroll">'
            f"<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div></div>"
        )

    def _row(self, record: ClipRecord) -> str:
        flags = self._session.flags
        cells = []
        for column in COLUMNS:
            value = column.value(record, flags)
            number = "" if isinstance(value, str) else " class=mt-number"
            text = "–" if value == -1 else column.form.format(value)
            cells.append(f"<td{number}>{html.escape(text)}</td>")
        here = " class=mt-here" if record.name == self._session.name else ""
        name = html.escape(record.name)
        about = html.escape(record.description)
        return f'<tr{here} data-send="open {name}" title="{about}">{"".join(cells)}</tr>'

    def _look_for_faults(self) -> None:
        names = [record.name for record in self.shown() if record.name not in self._session.flags]
        self._count_next(names[:MOST_ROWS])

    def _count_next(self, names: list[str]) -> None:
        """Look for faults in the first of some clips, and then in the others."""
        self.refresh()
        if names:
            self._session.find_faults(names[0], lambda _: self._count_next(names[1:]))
