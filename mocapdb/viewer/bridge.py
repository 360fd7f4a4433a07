"""How clicks in our own HTML reach the session.

viser shows HTML but hears nothing from it. So a script of ours types what was clicked into a text
field of viser's that nobody sees: ``data-send="seek 1.5"`` on an element is all that it needs.
"""

from __future__ import annotations

import html
from collections.abc import Callable
from importlib.resources import files
from typing import Any

__all__ = ["Bridge"]


class Bridge:
    """The hidden field of one browser.

    Parameters
    ----------
    gui : viser.GuiApi
    receive : callable
        Called with a verb and the rest of what was sent, on viser's threads.
    """

    def __init__(self, gui: Any, receive: Callable[[str, str], None]) -> None:
        field = gui.add_text("messages", "")
        uuid = field._impl.uuid

        def take(_: Any) -> None:
            message = field.value.partition(" ")[2]  # behind its number
            verb, _, rest = message.partition(" ")
            if verb:
                receive(verb, rest)

        field.on_update(take)
        script = (files("mocapdb.viewer") / "bridge.js").read_text(encoding="utf-8")
        style = (files("mocapdb.viewer") / "viewer.css").read_text(encoding="utf-8")
        code = html.escape(script.replace("@INPUT@", uuid))
        hidden = f'*:has(> div > p > label[for="{uuid}"]) {{ display: none !important; }}'
        gui.add_html(f'<style>{hidden}\n{style}</style><img hidden src="data:," onerror="{code}">')
