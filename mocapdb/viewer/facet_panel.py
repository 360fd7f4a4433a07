"""Panel at the left: which clips are listed, by words, by labels, and by measured numbers."""

from __future__ import annotations

import html
import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from mocapdb.library.facets import FACETS, FacetRange
from mocapdb.viewer.clip_choice import FLAGGED, Choice, ClipChoice, Histogram
from mocapdb.viewer.panel import Panel

if TYPE_CHECKING:
    from mocapdb.viewer.panel import PanelHost

__all__ = ["FacetPanel"]

FEW_VALUES = 6  # of a column that are shown at once, those of the most clips
WORDS = {
    "root_speed": ("speed", "m/s"),
    "turn": ("turn", "°, left positive"),
    "height": ("stature", "m"),
    "duration": ("length", "s"),
    "contacts": ("steps", ""),
}
"""What a facet is called, and its unit."""

BAR_WIDTH, BAR_HEIGHT = 8, 28  # of a histogram, in units of its own


class FacetPanel(Panel):
    """Words to search for, labels to choose, numbers to keep within.

    Parameters
    ----------
    host : PanelHost
    gui : viser.GuiApi
    clips : ClipChoice
    changed : callable
        Called when something else is chosen.

    Attributes
    ----------
    choice : Choice
        What is chosen.
    """

    def __init__(
        self, host: PanelHost, gui: Any, clips: ClipChoice, changed: Callable[[], None]
    ) -> None:
        self._clips = clips
        self._changed = changed
        self.choice = Choice()
        super().__init__(host, gui)

    def _add_controls(self, gui: Any) -> None:
        self._unfolded: set[str] = set()
        self._columns = list(self._clips.facet_columns())
        self._field = gui.add_html("")
        self._cleared = 0
        self._body = gui.add_html("")
        host = self._host
        host.on_message("search", self._search, latest=True)
        host.on_message("choose", self._choose)
        host.on_message("unfold", self._unfold)
        host.on_message("within", self._within)
        for which, end in enumerate(("from", "to")):
            host.on_message(end, partial(self._set_end, which))
        host.on_message("clear", lambda _: self._clear())
        self._write_field()
        self.refresh()

    def _set(self, choice: Choice) -> None:
        self.choice = choice
        self.refresh()
        self._changed()

    def _search(self, text: str) -> None:
        if text != self.choice.text:
            self._set(replace(self.choice, text=text))

    def _choose(self, message: str) -> None:
        """Choose the value of a column by their numbers, or whether faults are left."""
        what, _, value = message.partition(" ")
        if what == "flagged":
            flagged = FLAGGED.get(value)
            same = flagged == self.choice.flagged
            self._set(replace(self.choice, flagged=None if same else flagged))
            return
        column = self._columns[int(what)]
        self._set(self.choice.with_value(column, self._values(column)[int(value)]))

    def _unfold(self, column: str) -> None:
        self._unfolded ^= {self._columns[int(column)]}
        self.refresh()

    def _within(self, message: str) -> None:
        """Keep a facet within the part of its histogram that was dragged over."""
        facet, *ends = message.split()
        start, end = map(float, ends)
        histogram = self._clips.histogram(facet, self.choice)
        if histogram is None:
            return
        bar = (histogram.high - histogram.low) / len(histogram.counts)
        if end - start < bar / 2:  # a click: all again
            self._set(self.choice.with_range(facet, None))
            return
        low = -math.inf if start <= histogram.low + bar / 4 else float(f"{start:.3g}")
        high = math.inf if end >= histogram.high - bar / 4 else float(f"{end:.3g}")
        self._set(self.choice.with_range(facet, FacetRange(low, high)))

    def _set_end(self, which: int, message: str) -> None:
        """Set one end of a range to a number that was typed, or open it."""
        facet, _, text = message.partition(" ")
        ends = [*self.choice.ranges.get(facet, FacetRange())]
        ends[which] = float(text) if text.strip() else (math.inf if which else -math.inf)
        try:
            self._set(self.choice.with_range(facet, FacetRange(*ends)))
        finally:
            self.refresh()  # of what cannot be, the fields show again what is so

    def _clear(self) -> None:
        self._cleared += 1
        self._write_field()
        self._set(Choice())

    # -- HTML --------------------------------------------------------------------------------------

    def _write_field(self) -> None:
        """Write an empty field for words; it is left alone while somebody types."""
        self._field.content = (
            f'<div class="mt-facets" data-cleared="{self._cleared}"><input type="search" '
            'class="mt-search" data-type="search" placeholder="search" aria-label="search" '
            'title="Words of name, class or description, or other words for the same."></div>'
        )

    def refresh(self) -> None:
        """Write what can be chosen anew."""
        n_clips = len(self._clips.rows(self.choice))
        clear = '<button data-send="clear">clear</button>' if self.choice else ""
        parts = [f"<p>{n_clips:,} of {len(self._clips.records):,} clips {clear}</p>"]
        parts += (self._column(number) for number in range(len(self._columns)))
        parts += (self._facet(name) for name in FACETS)
        if self._clips.was_searched:
            parts.append(self._flagged())
        self._body.content = (
            f'<div class="mt mt-facets" data-scroll="facets">{"".join(parts)}</div>'
        )

    def _values(self, column: str) -> list[str]:
        """Return the values of a column, those of the most clips first."""
        counts = self._clips.counts(column, Choice())
        return sorted(counts, key=lambda value: (-counts[value], value))

    def _column(self, number: int) -> str:
        column = self._columns[number]
        counts = self._clips.counts(column, self.choice)
        chosen = self.choice.values.get(column)
        values = list(enumerate(self._values(column)))
        unfolded = column in self._unfolded or len(values) <= FEW_VALUES + 1
        shown = values if unfolded else values[:FEW_VALUES]
        shown += [pair for pair in values[len(shown) :] if pair[1] == chosen]
        buttons = "".join(
            _button(f"choose {number} {place}", value, counts[value], pressed=value == chosen)
            for place, value in shown
        )
        if len(values) > FEW_VALUES + 1:
            more = "fewer" if unfolded else f"all {len(values)}"
            buttons += f'<button class=mt-more data-send="unfold {number}">{more}</button>'
        return f"<h4>{html.escape(column)}</h4><div class=mt-values>{buttons}</div>"

    def _facet(self, name: str) -> str:
        histogram = self._clips.histogram(name, self.choice)
        if histogram is None:
            return ""
        word, unit = WORDS[name]
        chosen = self.choice.ranges.get(name, FacetRange())
        fields = " to ".join(
            f'<input data-choose="{end} {name}" inputmode="decimal" size="4" '
            f'aria-label="{word} {end}" value="{value:g}">'
            if math.isfinite(value)
            else f'<input data-choose="{end} {name}" inputmode="decimal" size="4" '
            f'aria-label="{word} {end}" placeholder="{end}">'
            for end, value in zip(("from", "to"), chosen, strict=True)
        )
        digits = max(0, 1 - math.floor(math.log10(histogram.high - histogram.low)))
        low, high = (f"{round(end, digits) + 0.0:.{digits}f}" for end in histogram[:2])
        about = f"{FACETS[name].what}. Drag to choose, click for all."
        return (
            f"<h4>{word} <small>{unit}</small></h4>"
            f'<div class="mt-bars" data-drag="range" data-verb="within {name}" '
            f'data-low="{histogram.low!r}" data-high="{histogram.high!r}" '
            f'title="{html.escape(about)}">{_bars(histogram)}'
            f'<div class="mt-chosen" style="{_part(histogram, chosen)}"></div></div>'
            f'<div class="mt-ends"><i>{low}</i>{fields}<i>{high}</i>'
            "</div>"
        )

    def _flagged(self) -> str:
        counts = {
            name: len(self._clips.rows(replace(self.choice, flagged=is_left)))
            for name, is_left in FLAGGED.items()
        }
        buttons = "".join(
            _button(f"choose flagged {name}", name, counts[name],
                    pressed=self.choice.flagged == FLAGGED[name])
            for name in FLAGGED
        )  # fmt: skip
        return f"<h4>flagged faults</h4><div class=mt-values>{buttons}</div>"


def _button(message: str, text: str, count: int, *, pressed: bool) -> str:
    on = " aria-pressed=true" if pressed else ""
    none = "" if count else " class=mt-none"
    return (
        f'<button data-send="{html.escape(message)}"{on}{none}>{html.escape(text)} '
        f"<i>{count:,}</i></button>"
    )


def _bars(histogram: Histogram) -> str:
    """Return a histogram as a picture; a bar of one clip can be seen."""
    most = max(int(histogram.counts.max()), 1)
    bars = "".join(
        f"M{BAR_WIDTH * i} {BAR_HEIGHT}v{-max(2, round(BAR_HEIGHT * count / most))}"
        f"h{BAR_WIDTH - 1}V{BAR_HEIGHT}z"
        for i, count in enumerate(histogram.counts.tolist())
        if count
    )
    return (
        f'<svg viewBox="0 0 {BAR_WIDTH * len(histogram.counts)} {BAR_HEIGHT}" '
        f'preserveAspectRatio="none"><path d="{bars}"/></svg>'
    )


def _part(histogram: Histogram, chosen: FacetRange) -> str:
    """Return where in a histogram a range is, as CSS; nowhere if all is chosen."""
    if chosen == FacetRange():
        return "width:0"
    width = histogram.high - histogram.low
    start, end = (min(max((e - histogram.low) / width, 0.0), 1.0) for e in chosen)
    return f"left:{100 * start:.2f}%;width:{100 * (end - start):.2f}%"
