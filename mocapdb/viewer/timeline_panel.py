"""Panel: playing, the digression map with its flagged spans, a strip to select a range on."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.scenes.capsule_body import ERROR_COLOURS
from mocapdb.viewer.playback import SPEEDS

if TYPE_CHECKING:
    from mocapdb.cleaning import MovementDigressionMap
    from mocapdb.viewer.session import Session

__all__ = ["COMPARISONS", "TimelinePanel", "map_image", "map_rows"]

COMPARISONS = ("decoded", "original beside decoded", "before beside repaired")
MOST_ROWS, MOST_COLUMNS = 12, 1200
RAMP = ",".join(f"rgb{colour}" for colour in ERROR_COLOURS)
WORTH_A_ROW = 0.25  # confidence that a joint must reach somewhere to be shown
MARGIN_PX, HEIGHT_PX = 16, 82
LINE_PX, FLAGS_PX = 31, 46  # of the bar's lines; where flagged spans may be
CONTROLS_PX, LETTER_PX, DOT_PX = 620, 7, 30
ROW_PX = 11


class TimelinePanel:
    """The panel below the stage.

    Parameters
    ----------
    session : Session
    gui : viser.GuiApi
    """

    def __init__(self, session: Session, gui: Any) -> None:
        self._session = session
        self._panel = gui.add_panel()
        with self._panel.add_tab("Timeline"):
            self._body = gui.add_html("")
            self._now = gui.add_html("")
        self._rows: list[int] = []
        self._writing = 0
        self._place: tuple[int, int] | None = None

    def fit(self, width: int, stage_height: int) -> None:
        """Lay the panel along the lower edge of a stage of that size in pixels."""
        height = HEIGHT_PX + ROW_PX * len(self._rows)
        height += LINE_PX * self._lines(width - 4 * MARGIN_PX)
        if self._session.shows_clip:
            height += FLAGS_PX
        if stage_height > 0:
            self._session.scene.covered = min(0.5, (height + MARGIN_PX) / stage_height)
        if (width, height) != self._place and width > 0:
            self._place = (width, height)
            self._panel.float(
                x=MARGIN_PX, y=-MARGIN_PX, width=max(360, width - 2 * MARGIN_PX), height=height
            )

    def _lines(self, width: int) -> int:
        """Return how many lines the bar takes: viser's panels do not grow with what they hold."""
        stage = self._session.scene.stage
        legend = [] if stage is None else stage.legend()
        needed = CONTROLS_PX + LETTER_PX * len(self._session.title)
        needed += sum(DOT_PX + LETTER_PX * len(text) for _, text in legend)
        return max(1, -(-needed // max(width, 1)))

    def tell(self) -> None:
        """Show the time: a rule of style that moves the head, so that nothing else is rewritten."""
        clock = self._session.playback
        share = 100 * clock.time_s / clock.duration_s if clock.duration_s else 0.0
        frame = round(clock.time_s * self._session.fps)
        self._now.content = (
            f"<style>.mt-head {{ left: {share:.3f}% }} .mt-clock::after {{ content: "
            f'"{clock.time_s:.2f} s, frame {frame}" }}</style>'
        )

    def refresh(self) -> None:
        """Write everything but the time anew."""
        session, clock = self._session, self._session.playback
        duration = max(clock.duration_s, 1e-9)
        self._writing += 1  # what is the same is not written again, whatever a menu shows
        digression = session.digression_map if session.shows_clip else None
        self._rows = [] if digression is None else map_rows(digression)
        self._body.content = (
            f'<div class="mt" data-writing="{self._writing}">{self._controls()}'
            f'<div class="mt-tracks"><div class="mt-names">{self._names(digression)}</div>'
            f'<div class="mt-track" data-drag="seek" data-seconds="{duration:.6f}">'
            f'{_ruler(duration)}{self._map(digression, duration)}<div class="mt-head"></div></div>'
            f"{self._strip(duration)}</div>{self._flags(digression)}</div>"
        )
        self.tell()

    def _controls(self) -> str:
        session, clock = self._session, self._session.playback
        play = "pause" if clock.playing else "play"
        sign = "❚❚" if clock.playing else "▶"
        speeds = _options(SPEEDS, clock.speed, "{:g}×")
        loop = " aria-pressed=true" if clock.loop else ""
        follow = " aria-pressed=true" if session.scene.follow else ""
        compare = (
            f'<select data-choose="compare" aria-label="compare">'
            f"{_options(COMPARISONS, session.comparison, '{}')}</select>"
            if session.shows_clip
            else '<button data-send="back">back to the clip</button>'
        )
        return (
            '<div class="mt-bar">'
            f'<button data-send="toggle" class="mt-play" aria-label="{play}">{sign}</button>'
            f'<select data-choose="speed" aria-label="speed">{speeds}</select>'
            f'<button data-send="loop"{loop}>loop</button>'
            f'<button data-send="follow"{follow}>follow</button>{compare}'
            f'<b class="mt-title">{html.escape(session.title)}</b>{self._key()}'
            '<output class="mt-clock"></output></div>'
        )

    def _key(self) -> str:
        """Return the names of the actors beside their colours."""
        stage = self._session.scene.stage
        dots = (
            (f'style="background:{actor.colour}"', text)
            if actor.error_mm is None
            else (f'class="mt-ramp" style="background:linear-gradient(90deg,{RAMP})"', text)
            for actor, text in ([] if stage is None else stage.legend())
        )
        keys = (
            f'<span class="mt-key"><i {dot}></i>{html.escape(text)}</span>' for dot, text in dots
        )
        return "".join(keys)

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
        if not self._session.shows_clip:
            return ""
        start, end = self._session.selection or (0.0, 0.0)
        place = f"left:{100 * start / duration:.3f}%;width:{100 * (end - start) / duration:.3f}%"
        return (
            '<div class="mt-names mt-hint">select</div>'
            f'<div class="mt-strip" data-drag="range" data-seconds="{duration:.6f}" '
            'title="Drag to select a range: a query.">'
            f'<div class="mt-chosen" style="{place}"></div></div>'
        )

    def _flags(self, digression: MovementDigressionMap | None) -> str:
        """Return the flagged spans as buttons, the surest first."""
        if digression is None:
            busy = self._session.busy
            return f'<p class="mt-flags">{html.escape(busy)}</p>' if busy else ""
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


def _about(name: str, span: Any) -> str:
    return f"{name} {span.kind} {span.confidence:.0%}"


def _options(values: Sequence[Any], chosen: Any, form: str) -> str:
    return "".join(
        f'<option value="{value}"{" selected" if value == chosen else ""}>{form.format(value)}'
        "</option>"
        for value in values
    )


def _ruler(duration: float) -> str:
    """Return the ruler: a tick at every round number of seconds."""
    step = next(step for step in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60, 1e9) if duration / step <= 14)
    ticks = np.arange(0, duration + 1e-9, step)
    marks = "".join(
        f'<span style="left:{100 * tick / duration:.3f}%">{tick:g}</span>' for tick in ticks
    )
    return f'<div class="mt-ruler">{marks}</div>'
