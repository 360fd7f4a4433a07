"""What a panel may see of a session and ask of it, and what panels share."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from mocapdb.scenes.stage import Stage
from mocapdb.viewer.event_loop import Action, EventLoop
from mocapdb.viewer.view_state import ViewState

if TYPE_CHECKING:
    from mocapdb.library import Library
    from mocapdb.viewer.clip_choice import Choice

__all__ = ["Panel", "PanelHost", "breakable", "number_cell", "paragraph", "table", "text_cell"]


class PanelHost(Protocol):
    """All that panels know of the session that they belong to."""

    @property
    def library(self) -> Library:
        """The library, for the session's own thread."""

    @property
    def view(self) -> ViewState:
        """What is shown, to be read; the clock in it may be set."""

    @property
    def choice(self) -> Choice:
        """Which clips are listed."""

    @property
    def flags(self) -> Mapping[str, int]:
        """Flagged spans of the clips that were searched for faults, by name."""

    @property
    def loop(self) -> EventLoop:
        """Does what controls ask for, on the session's own thread."""

    def on_message(self, verb: str, take: Callable[[str], None], *, latest: bool = False) -> None:
        """Say what is done when an element of our HTML sends a verb; see `Bridge.on`."""

    def say(self, text: str) -> None:
        """Tell the browser something in passing."""

    def download(self, name: str, content: bytes) -> None:
        """Have the browser keep a file."""

    def open(self, name: str) -> None:
        """Open a clip and play it."""

    def compare(self, how: str) -> None:
        """Show the clip that is open, beside what it is compared with."""

    def select(self, start_s: float, end_s: float) -> None:
        """Select a range of the clip that is open."""

    def go_to_span(self, number: int) -> None:
        """Go to a flagged span of the clip that is open."""

    def find_faults(self, name: str, then: Callable[[str], None]) -> None:
        """Search a clip for faults beside the playing, and then do something with its name."""

    def show_aside(self, stage: Stage, title: str, *, keep_camera: bool = False) -> None:
        """Show something other than the clip that is open."""


class Panel:
    """A part of what a browser shows beside the stage.

    Parameters
    ----------
    host : PanelHost
    gui : viser.GuiApi
        Where its controls are added.
    """

    def __init__(self, host: PanelHost, gui: Any) -> None:
        self._host = host
        self._view = host.view
        self._add_controls(gui)

    def _add_controls(self, gui: Any) -> None:
        raise NotImplementedError

    def _does(self, action: Action, latest: str = "") -> Callable[[Any], None]:
        """Return a callback for a control: of several that wait under one name, only the last."""
        loop = self._host.loop
        if latest:
            return lambda _: loop.post_latest(latest, action)
        return lambda _: loop.post(action)


def paragraph(text: str, more: str = "", kind: str = "") -> str:
    """Return a line of text, and HTML below it, in the style of lists."""
    return f'<div class="mt-list{kind}"><p>{text}</p>{more}</div>'


def table(heads: Iterable[str], rows: Iterable[str], *, scroll: str) -> str:
    """Return a table that scrolls, from its heads (``<th>``) and rows (``<tr>``).

    A table of the same name that is put in its place is scrolled to where it was.
    """
    return (
        f'<div class="mt-scroll" data-scroll="{html.escape(scroll)}">'
        f"<table><thead><tr>{''.join(heads)}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
        "</div>"
    )


def breakable(name: str) -> str:
    """Return a name as HTML that may be broken where its parts meet, so that all of it is read."""
    return re.sub(r"([_/.-])", r"\1<wbr>", html.escape(name, quote=False))


def text_cell(text: str) -> str:
    """Return a cell of text."""
    return f"<td>{html.escape(text)}</td>"


def number_cell(text: str) -> str:
    """Return a cell of a number, aligned right."""
    return f"<td class=mt-number>{html.escape(text)}</td>"
