"""How clicks in our own HTML reach a session.

viser shows HTML but hears nothing from it. So a script of ours types what was clicked into a text
field of viser's that nobody sees: ``data-send="seek 1.5"`` on an element is all that it needs. The
first word, a verb, says what is to be done with the rest.

viser sends a field every 50 ms at most, and only its last value. So the field holds what was
clicked in the last half second, ``[[7, "like 0"], [8, "again"]]``, and what was seen before is
passed over by its number.
"""

from __future__ import annotations

import html
import json
import threading
from collections.abc import Callable
from functools import partial
from importlib.resources import files
from typing import Any

from mocapdb.viewer.event_loop import EventLoop

__all__ = ["Bridge"]

Take = Callable[[str], None]
"""Does what a verb asks for, with the rest of the message."""


class Bridge:
    """The hidden field of one browser, and what is done with its messages.

    Parameters
    ----------
    gui : viser.GuiApi
    loop : EventLoop
        Where it is done.
    """

    def __init__(self, gui: Any, loop: EventLoop) -> None:
        self._loop = loop
        self._takers: dict[str, tuple[Take, bool]] = {}
        field = gui.add_text("messages", "")
        self._seen = 0  # number of the last message
        self._lock = threading.Lock()  # viser calls from whichever thread is free
        field.on_update(lambda _: self._take(field.value))
        uuid = field._impl.uuid
        script = (files("mocapdb.viewer") / "bridge.js").read_text(encoding="utf-8")
        style = (files("mocapdb.viewer") / "viewer.css").read_text(encoding="utf-8")
        code = html.escape(script.replace("@INPUT@", uuid))
        hidden = f'*:has(> div > p > label[for="{uuid}"]) {{ display: none !important; }}'
        gui.add_html(f'<style>{hidden}\n{style}</style><img hidden src="data:," onerror="{code}">')

    def on(self, verb: str, take: Take, *, latest: bool = False) -> None:
        """Say what is to be done with a verb; if `latest`, of several that wait only the last."""
        self._takers[verb] = take, latest

    def _take(self, value: str) -> None:
        """Receive those messages of the field that were not seen yet, in their order."""
        try:
            messages = [(int(number), str(message)) for number, message in json.loads(value)]
        except (ValueError, TypeError):
            return  # not from our own script
        with self._lock:
            for number, message in messages:
                if number > self._seen:
                    self._seen = number
                    self._receive(message)

    def _receive(self, message: str) -> None:
        verb, _, rest = message.partition(" ")
        if verb not in self._takers:
            return  # not from our own HTML, or too early
        take, latest = self._takers[verb]
        if latest:
            self._loop.post_latest(verb, partial(take, rest))
        else:
            self._loop.post(partial(take, rest))
