"""A browser that is not there: what a session adds to it can be read, set and clicked."""

from __future__ import annotations

import json
import time
from contextlib import nullcontext
from types import SimpleNamespace
from unittest.mock import MagicMock


class Control(SimpleNamespace):
    """A control of viser's; `fire` does what a click or a change of its value would."""

    def __init__(self, **state):
        super().__init__(callbacks=[], _impl=SimpleNamespace(uuid="uuid"), **state)

    def on_update(self, callback):
        self.callbacks.append(callback)

    on_click = on_update

    def fire(self):
        for callback in self.callbacks:
            callback(None)


class FakeGui:
    """Controls by their label; those of HTML in a list."""

    def __init__(self):
        self.controls, self.pages = {}, []
        self.main_panel = MagicMock()

    def _add(self, label, value=None, **_):
        self.controls[label] = Control(value=value, visible=True)
        return self.controls[label]

    add_text = add_button = add_checkbox = _add

    def add_slider(self, label, low, high, step, value, **_):
        return self._add(label, value)

    def add_dropdown(self, label, options, initial_value):
        return self._add(label, initial_value)

    def add_html(self, content):
        self.pages.append(Control(content=content))
        return self.pages[-1]

    def add_tab_group(self):
        return SimpleNamespace(add_tab=lambda name: nullcontext())

    def add_panel(self):
        return MagicMock(add_tab=lambda name: nullcontext())

    def configure_theme(self, **_):
        pass

    set_panel_label = MagicMock()

    @property
    def text(self):
        """All that is shown, without the places where names may break."""
        return "\n".join(page.content for page in self.pages).replace("<wbr>", "")


class FakeClient:
    """A client of viser's, and what it was told and given."""

    client_id = 0

    def __init__(self):
        self.gui, self.scene = FakeGui(), MagicMock()
        self.camera = SimpleNamespace(image_width=800, image_height=600)
        self.notices, self.files, self.sent = [], {}, []

    def atomic(self):
        return nullcontext()

    def add_notification(self, title, text, **_):
        self.notices.append((title, text))

    def send_file_download(self, name, content, save_immediately):
        self.files[name] = content

    def send(self, *messages):
        """Send what elements of our own HTML would; several at once like quick clicks."""
        field = self.gui.controls["messages"]
        self.sent += messages
        kept = list(enumerate(self.sent, 1))[-len(messages) - 2 :]  # two were sent before
        field.value = json.dumps(kept)
        field.fire()


def wait_until(condition, seconds=300.0):  # kernels may have to be compiled first
    """Wait for another thread."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not come"
        time.sleep(0.005)
