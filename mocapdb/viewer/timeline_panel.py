"""Panel: playing, the digression map with its flagged spans, a strip to select a range on."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.scenes.capsule_body import ERROR_COLOURS
from mocapdb.scenes.stage import SHOWN_FPS, Actor
from mocapdb.viewer.comparisons import COMPARISONS
from mocapdb.viewer.panel import Panel
from mocapdb.viewer.playback import SPEEDS

if TYPE_CHECKING:
    from mocapdb.cleaning import MovementDigressionMap
    from mocapdb.cleaning.map.digression_map import Span

__all__ = ["TimelinePanel", "map_image", "map_rows"]

MOST_ROWS = 12  # joints of the map: the panel may not cover the bodies
MOST_COLUMNS = 1200  # pixels of the map's picture; each is the surest of the frames that it covers
WORTH_A_ROW = 0.25  # confidence that a joint must reach somewhere to be shown
ERROR_RAMP = ",".join(f"rgb{colour}" for colour in ERROR_COLOURS)  # of the legend, as CSS

# viser's panels do not grow with what they hold, so their size is reckoned, in pixels
MARGIN_PX = 16  # between the panel and the edge of the window
LEAST_WIDTH_PX = 360
HEIGHT_PX = 82  # of the panel's frame, the ruler and the strip
ROW_PX = 11  # of a joint of the map
FLAGS_PX = 46  # of the buttons of flagged spans
LINE_PX = 31  # of a line of the bar of controls
CONTROLS_PX, LETTER_PX, DOT_PX = 620, 7, 30  # widths in that bar: controls, a letter, a colour
MOST_COVERED = 0.5  # share of the window's height

TICKS_S = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60, 1e9)  # steps of the ruler, the last for none
MOST_TICKS = 14


class TimelinePanel(Panel):
    """The panel below the stage."""

    def _add_controls(self, gui: Any) -> None:
        self._panel = gui.add_panel()
        with self._panel.add_tab("Timeline"):
            self._body = gui.add_html("")
            self._now = gui.add_html("")
        self._rows: list[int] = []
        self._writing = 0
        self._place: tuple[int, int] | None = None
        host = self._host
        host.on_message("compare", host.compare)
        host.on_message("back", lambda _: host.compare(self._view.comparison))
        host.on_message("span", lambda number: host.go_to_span(int(number)))
        host.on_message("range", lambda ends: host.select(*map(float, ends.split())))
        host.on_message("seek", lambda time_s: self._view.playback.seek(float(time_s)), latest=True)
        host.on_message("step", lambda frames: self._step(int(frames)))
        host.on_message("speed", lambda speed: self._set_speed(float(speed)))
        for switch in ("toggle", "loop", "follow"):
            host.on_message(switch, partial(self._switch, switch))
        self.refresh()

    def _step(self, frames: int) -> None:
        view, clock = self._view, self._view.playback
        clock.playing = False
        clock.seek(clock.time_s + frames / min(view.fps, SHOWN_FPS))
        self.refresh()

    def _set_speed(self, wanted: float) -> None:
        self._view.playback.speed = min(SPEEDS, key=lambda speed: abs(speed - wanted))
        self.refresh()

    def _switch(self, what: str, _: str) -> None:
        view, clock = self._view, self._view.playback
        if what == "toggle":
            clock.toggle()
        elif what == "loop":
            clock.loop = not clock.loop
        else:
            view.follow = not view.follow
        self.refresh()

    def fit(self, width: int, stage_height: int) -> float:
        """Lay the panel along the lower edge of a stage of that size in pixels.

        Returns
        -------
        float
            The share of the height that it covers.
        """
        height = HEIGHT_PX + ROW_PX * len(self._rows)
        height += LINE_PX * self._lines(width - 4 * MARGIN_PX)
        if self._view.shows_clip:
            height += FLAGS_PX
        if (width, height) != self._place and width > 0:
            self._place = (width, height)
            self._panel.float(
                x=MARGIN_PX, y=-MARGIN_PX, height=height,
                width=max(LEAST_WIDTH_PX, width - 2 * MARGIN_PX),
            )  # fmt: skip
        return min(MOST_COVERED, (height + MARGIN_PX) / stage_height) if stage_height > 0 else 0.0

    def _lines(self, width: int) -> int:
        """Return how many lines the bar of controls takes in a width of pixels."""
        needed = CONTROLS_PX + LETTER_PX * len(self._view.title)
        needed += sum(DOT_PX + LETTER_PX * len(text) for _, text in self._legend())
        return max(1, -(-needed // max(width, 1)))

    def tell(self) -> None:
        """Show the time: a rule of style that moves the head, so that nothing else is rewritten."""
        clock = self._view.playback
        share = 100 * clock.time_s / clock.duration_s if clock.duration_s else 0.0
        frame = round(clock.time_s * self._view.fps)
        self._now.content = (
            f"<style>.mt-head {{ left: {share:.3f}% }} .mt-clock::after {{ content: "
            f'"{clock.time_s:.2f} s, frame {frame}" }}</style>'
        )

    def refresh(self) -> None:
        """Write everything but the time anew."""
        view, clock = self._view, self._view.playback
        duration = max(clock.duration_s, 1e-9)
        self._writing += 1  # what is the same is not written again, whatever a menu shows
        digression = view.digression_map if view.shows_clip else None
        self._rows = [] if digression is None else map_rows(digression)
        self._body.content = (
            f'<div class="mt" data-writing="{self._writing}">{self._controls()}'
            f'<div class="mt-tracks"><div class="mt-names">{self._names(digression)}</div>'
            f'<div class="mt-track" data-drag="seek" data-low="0" data-high="{duration:.6f}">'
            f'{_ruler(duration)}{self._map(digression, duration)}<div class="mt-head"></div></div>'
            f"{self._strip(duration)}</div>{self._flags(digression)}</div>"
        )
        self.tell()

    def _controls(self) -> str:
        view, clock = self._view, self._view.playback
        play = "pause" if clock.playing else "play"
        sign = "❚❚" if clock.playing else "▶"
        speeds = _options(SPEEDS, clock.speed, "{:g}×")
        loop = " aria-pressed=true" if clock.loop else ""
        follow = " aria-pressed=true" if view.follow else ""
        compare = (
            f'<select data-choose="compare" aria-label="compare">'
            f"{_options(COMPARISONS, view.comparison, '{}')}</select>"
            if view.shows_clip
            else '<button data-send="back">back to the clip</button>'
        )
        return (
            '<div class="mt-bar">'
            f'<button data-send="toggle" class="mt-play" aria-label="{play}">{sign}</button>'
            f'<select data-choose="speed" aria-label="speed">{speeds}</select>'
            f'<button data-send="loop"{loop}>loop</button>'
            f'<button data-send="follow"{follow}>follow</button>{compare}'
            f'<b class="mt-title">{html.escape(view.title)}</b>{self._key()}'
            '<output class="mt-clock"></output></div>'
        )

    def _key(self) -> str:
        """Return the names of the actors beside their colours."""
        keys = []
        for actor, text in self._legend():
            if actor.error_mm is None:
                dot = f'style="background:{actor.colour}"'
            else:
                dot = f'class="mt-ramp" style="background:linear-gradient(90deg,{ERROR_RAMP})"'
            keys.append(f'<span class="mt-key"><i {dot}></i>{html.escape(text)}</span>')
        return "".join(keys)

    def _legend(self) -> list[tuple[Actor, str]]:
        return [] if self._view.stage is None else self._view.stage.legend()

    def _names(self, digression: MovementDigressionMap | None) -> str:
        if digression is None:
            return ""
        names = (html.escape(digression.skeleton.names[joint]) for joint in self._rows)
        return "".join(f'<div style="height:{ROW_PX}px">{name}</div>' for name in names)

    def _map(self, digression: MovementDigressionMap | None, duration: float) -> str:
        if digression is None or not self._rows:
            return ""
        image = map_image(digression.scores[:, self._rows])
        spans = []
        for number, span in enumerate(digression.spans):
            if span.joint not in self._rows:
                continue
            start, end = span.start / digression.fps, span.end / digression.fps
            row = self._rows.index(span.joint)
            name = digression.skeleton.names[span.joint]
            spans.append(
                f'<button class="mt-span" data-send="span {number}" '
                f'style="left:{100 * start / duration:.3f}%;top:{ROW_PX * row}px;'
                f'width:{100 * (end - start) / duration:.3f}%;height:{ROW_PX}px" '
                f'title="{html.escape(_about(name, span))}"></button>'
            )
        return (
            f'<div class="mt-map" style="height:{ROW_PX * len(self._rows)}px">'
            f'<img src="{image}" alt="movement digression map">{"".join(spans)}</div>'
        )

    def _strip(self, duration: float) -> str:
        if not self._view.shows_clip:
            return ""
        start, end = self._view.selection or (0.0, 0.0)
        place = f"left:{100 * start / duration:.3f}%;width:{100 * (end - start) / duration:.3f}%"
        return (
            '<div class="mt-names mt-hint">select</div>'
            f'<div class="mt-strip" data-drag="range" data-verb="range" data-low="0" '
            f'data-high="{duration:.6f}" '
            'title="Drag to select a range: a query.">'
            f'<div class="mt-chosen" style="{place}"></div></div>'
        )

    def _flags(self, digression: MovementDigressionMap | None) -> str:
        """Return the flagged spans as buttons, the surest first."""
        if digression is None:
            waiting = self._view.waiting
            return f'<p class="mt-flags">{html.escape(waiting)}</p>' if waiting else ""
        if not digression.spans:
            return '<p class="mt-flags">nothing is flagged</p>'
        numbered = sorted(enumerate(digression.spans), key=lambda pair: -pair[1].confidence)
        buttons = (
            f'<button data-send="span {number}">'
            f"{html.escape(_about(digression.skeleton.names[span.joint], span))}, "
            f"{span.start / digression.fps:.2f} s</button>"
            for number, span in numbered
        )
        return f'<p class="mt-flags">{"".join(buttons)}</p>'


def map_rows(digression: MovementDigressionMap) -> list[int]:
    """Return the joints that are worth a row of the map, in the order of the skeleton."""
    most = digression.scores.max(axis=0) if len(digression.scores) else np.zeros(0)
    flagged = {span.joint for span in digression.spans}
    worth = [j for j in np.argsort(-most, kind="stable") if most[j] >= WORTH_A_ROW or j in flagged]
    return sorted(int(joint) for joint in worth[:MOST_ROWS])


def map_image(scores: FloatArray) -> str:
    """Return (F, R) scores in [0, 1] as a picture: a data URI, a row a joint, hot where sure."""
    from matplotlib import colormaps
    from PIL import Image

    n_frames = len(scores)
    columns = min(n_frames, MOST_COLUMNS)
    starts = (np.arange(columns) * n_frames) // columns
    thinned = np.maximum.reduceat(scores, starts, axis=0)
    colours = (255 * colormaps["inferno"](thinned.T)[..., :3]).astype(np.uint8)
    image = io.BytesIO()
    Image.fromarray(colours).save(image, format="PNG")
    return "data:image/png;base64," + base64.b64encode(image.getvalue()).decode("ascii")


def _about(name: str, span: Span) -> str:
    return f"{name} {span.kind} {span.confidence:.0%}"


def _options(values: Sequence[Any], chosen: Any, form: str) -> str:
    return "".join(
        f'<option value="{value}"{" selected" if value == chosen else ""}>{form.format(value)}'
        "</option>"
        for value in values
    )


def _ruler(duration: float) -> str:
    """Return the ruler: a tick at every round number of seconds."""
    step = next(step for step in TICKS_S if duration / step <= MOST_TICKS)
    ticks = np.arange(0, duration + 1e-9, step)
    marks = "".join(
        f'<span style="left:{100 * tick / duration:.3f}%">{tick:g}</span>' for tick in ticks
    )
    return f'<div class="mt-ruler">{marks}</div>'
