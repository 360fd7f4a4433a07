"""One browser: opens clips, compares them, and tells the stage and the panels what changed.

Whatever arrives from the browser is put into the session's loop; only the session's own thread
touches its library, its scene and its panels. So browsers do not disturb each other.
"""

from __future__ import annotations

import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocapdb.errors import LibraryError, MocapdbError
from mocapdb.motion.clip import Clip
from mocapdb.scenes.stage import Stage
from mocapdb.viewer.bridge import Bridge
from mocapdb.viewer.cleaned_clips import CleanedClips
from mocapdb.viewer.clip_choice import Choice, ClipChoice
from mocapdb.viewer.clip_panel import ClipPanel
from mocapdb.viewer.comparisons import COMPARISONS, comparison
from mocapdb.viewer.cycle_panel import CyclePanel
from mocapdb.viewer.event_loop import EventLoop
from mocapdb.viewer.facet_panel import FacetPanel
from mocapdb.viewer.fill_panel import FillPanel
from mocapdb.viewer.query_panel import QueryPanel
from mocapdb.viewer.scene import StageScene
from mocapdb.viewer.timeline_panel import TimelinePanel
from mocapdb.viewer.tuning import SHORTEST_SELECTION_S
from mocapdb.viewer.view_state import ViewState

if TYPE_CHECKING:
    from mocapdb.cleaning import Cleaned
    from mocapdb.library import Library

__all__ = ["Session"]

CLOCK_S = 1.0 / 15.0  # from one writing of the clock to the next: each is a message
LONGEST_STEP_S = 0.25  # of the clock, after something has held the session up
PANELS_PX, FACETS_PX = 390, 220  # width of the panels at the right, and at the left
ROOM_PX = 960  # windows that are narrower keep the left panel folded
NOTICE_S, FAILURE_S = 3.0, 8.0  # how long a notice stays


class Session:
    """A browser's session, from `start` to `close`; it is the `PanelHost` of its panels.

    Parameters
    ----------
    client : viser.ClientHandle
    path : Path
        Of the library.
    opening : str, optional
        The clip to open first.
    original : bool
        Whether clips are shown as they were captured, also where they were cleaned since.

    Attributes
    ----------
    view : ViewState
        What the browser shows.
    loop : EventLoop
        What the session is asked for.
    library : Library
        Of its own.
    """

    library: Library

    def __init__(
        self, client: Any, path: Path, opening: str | None = None, *, original: bool = False
    ) -> None:
        self.view = ViewState()
        self.loop = EventLoop(f"mocapdb worker {client.client_id}", self._tell_failure)
        self._client = client
        self._path = path
        self._opening = opening
        self._original = original
        self._cleaned = CleanedClips()
        self._stage_px: tuple[int, int] | None = None
        self._drawn_s = -1.0  # time of the frame that is drawn
        self._clock_written = 0.0  # when the clock was last written
        self._thread = threading.Thread(
            target=self._run, name=f"mocapdb session {client.client_id}", daemon=True
        )

    def start(self) -> None:
        """Play and answer in a thread of its own, until the session is closed."""
        self._thread.start()

    def close(self) -> None:
        """End the session."""
        self.loop.close()

    def join(self, timeout_s: float) -> None:
        """Wait until the session has ended, but no longer than that."""
        self._thread.join(timeout_s)

    def _run(self) -> None:
        from mocapdb.library import Library

        with Library(self._path, original=self._original) as self.library:
            if self.loop.attempt(self._build):
                self.loop.run(self._tick, lambda: self.view.playback.playing)

    def _build(self) -> None:
        gui = self._client.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        gui.set_panel_label(self._path.resolve().name)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANELS_PX)
        self._scene = StageScene(self._client)
        self._bridge = Bridge(gui, self.loop)
        self.on_message("stage", self._set_size)
        clips = ClipChoice(self.library)
        self._chooser = chooser = gui.add_panel()
        with chooser.add_tab("Choose"):
            self._facets = FacetPanel(
                self, gui, clips, lambda: self._clips.show(self._facets.choice)
            )
        chooser.dock_left()
        chooser.set_width(FACETS_PX)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Clips"):
            self._clips = ClipPanel(self, gui, clips)
        with tabs.add_tab("Query"):
            self._query = QueryPanel(self, gui)
        with tabs.add_tab("Cycles"):
            self._cycles = CyclePanel(self, gui)
        with tabs.add_tab("Fill"):
            self._fill = FillPanel(self, gui, clips)
        self._timeline = TimelinePanel(self, gui)
        self._fit()
        if not clips.records:
            raise LibraryError(f"{self._path}: the library is empty. Build clips into it first.")
        self._opening = self._opening or clips.records[0].name

    def _tick(self, passed_s: float) -> None:
        clock = self.view.playback
        was_playing = clock.playing
        clock.advance(min(passed_s, LONGEST_STEP_S))
        if clock.time_s != self._drawn_s:
            self._drawn_s = clock.time_s
            self._scene.draw(clock.time_s, follow=self.view.follow)
            if time.perf_counter() - self._clock_written > CLOCK_S or not clock.playing:
                self._clock_written = time.perf_counter()
                self._timeline.tell()
        if was_playing and not clock.playing:
            self._timeline.refresh()
        self._fit()

    def _set_size(self, message: str) -> None:
        """Take the size of the stage and the width of the window, in CSS pixels.

        The first time it says that the panels are seen: then the first clip is opened.
        """
        width, height, window = (int(part) for part in message.split())
        is_first = self._stage_px is None
        self._stage_px = width, height
        self._fit()
        if not is_first:
            return
        if window < ROOM_PX:
            self._chooser.minimize()
        if self._opening is not None:
            self.open(self._opening)

    def _fit(self) -> None:
        camera = self._client.camera  # it counts the pixels that are drawn, which may be others
        size = self._stage_px or (camera.image_width, camera.image_height)
        self._scene.covered = self._timeline.fit(*size)

    def _tell_failure(self, problem: Exception) -> None:
        text = str(problem)
        if not isinstance(problem, MocapdbError):
            traceback.print_exception(problem, file=sys.stderr)
            text = f"a fault of mocapdb's own: {problem}"
        self._tell_failed(text)

    def _tell_failed(self, text: str) -> None:
        self._notify("That did not work", text, "red", FAILURE_S)

    def _notify(self, title: str, text: str, color: str, seconds: float) -> None:
        self._client.add_notification(title, text, color=color, auto_close_seconds=seconds)

    # -- what panels ask for -----------------------------------------------------------------------

    @property
    def choice(self) -> Choice:
        """Which clips are listed."""
        return self._facets.choice

    @property
    def flags(self) -> Mapping[str, int]:
        """Flagged spans of the clips that were searched for faults, by name."""
        return self._cleaned.flags

    def on_message(self, verb: str, take: Callable[[str], None], *, latest: bool = False) -> None:
        """Say what is done when an element of our HTML sends a verb; see `Bridge.on`."""
        self._bridge.on(verb, take, latest=latest)

    def say(self, text: str) -> None:
        """Tell the browser something in passing."""
        self._notify("mocapdb", text, "blue", NOTICE_S)

    def download(self, name: str, content: bytes) -> None:
        """Have the browser keep a file."""
        self._client.send_file_download(name, content, save_immediately=True)

    def open(self, name: str) -> None:
        """Open a clip and play it; what is flagged in it follows when it is known."""
        view = self.view
        record = self.library.record(name)
        view.clip = self.library.clip(record.name)
        view.record, view.selection = record, None
        cleaned = self._cleaned.get(record.name)
        view.digression_map = None if cleaned is None else cleaned.digression_map
        view.waiting = "looking for faults…" if cleaned is None else ""
        self._cycles.forget_clip()
        self._fill.follow()
        view.comparison = COMPARISONS[0]
        self.compare(view.comparison)
        self._clips.follow()
        self._query.refresh()
        if cleaned is None:
            self.find_faults(record.name, self._show_faults)

    def compare(self, how: str) -> None:
        """Show the clip that is open alone, beside its original, or beside its repair."""
        view = self.view
        if view.clip is None or view.record is None:
            return
        try:
            stage = comparison(how, view.clip, view.record, self._repaired)
        except MocapdbError:
            self._timeline.refresh()  # the menu shows again what is shown
            raise
        same = view.shows_clip and view.title == view.name
        view.comparison, view.shows_clip = how, True
        self._show(stage, view.name, keep_time=same)

    def _repaired(self) -> tuple[Clip, Clip]:
        """Return the open clip as captured and repaired: the revision, else what is found now."""
        record = self.library.record(self.view.name)
        before, revision = self.library.captured(record), self.library.revision(record)
        if revision is not None:
            return before, self.library.decode_revision(record, revision)
        return before, self._cleaned.find(record.name, lambda _: before).clip

    def show_aside(self, stage: Stage, title: str, *, keep_camera: bool = False) -> None:
        """Show something other than the clip that is open."""
        keep = keep_camera and not self.view.shows_clip
        self.view.shows_clip = False
        self._show(stage, title, keep_time=keep, keep_camera=keep)

    def _show(
        self, stage: Stage, title: str, *, keep_time: bool, keep_camera: bool = False
    ) -> None:
        view, clock = self.view, self.view.playback
        time_s = clock.time_s if keep_time else 0.0
        view.stage, view.title = stage, title
        self._scene.show(stage, keep_camera=keep_camera)
        clock.restart((stage.n_frames - 1) / stage.fps, playing=True)
        clock.seek(time_s)
        self._drawn_s = -1.0
        self._timeline.refresh()

    def find_faults(self, name: str, then: Callable[[str], None]) -> None:
        """Search a clip as captured for faults beside the playing, then use its name."""
        from mocapdb.cleaning import clean_clip

        clip = self.library.captured(self.library.record(name))

        def work() -> Cleaned | MocapdbError:
            try:
                return clean_clip(clip)
            except MocapdbError as problem:  # a body without joints that rotate, say
                return problem

        def keep(found: Cleaned | MocapdbError) -> None:
            if isinstance(found, MocapdbError):
                self._tell_failed(f"{name}: {found}")
            else:
                self._cleaned.keep(name, found)
            then(name)

        self.loop.background(work, keep)

    def _show_faults(self, name: str) -> None:
        view = self.view
        if name == view.name:  # no other clip has been opened since
            found = self._cleaned.get(name)
            view.digression_map = None if found is None else found.digression_map
            view.waiting = "" if found else "this clip cannot be searched for faults"
            self._timeline.refresh()
        self._clips.tell_flags()

    def go_to_span(self, number: int) -> None:
        """Go to a flagged span, pause, and wait for the user to look."""
        view = self.view
        if view.digression_map is None or not 0 <= number < len(view.digression_map.spans):
            return
        if not view.shows_clip:
            self.compare(view.comparison)
        view.playback.playing = False
        view.playback.seek(view.digression_map.spans[number].start / view.digression_map.fps)
        self._timeline.refresh()

    def select(self, start_s: float, end_s: float) -> None:
        """Select a range of the clip; one that is too short for a query selects nothing."""
        view = self.view
        if view.clip is None:
            return
        long_enough = end_s - start_s >= SHORTEST_SELECTION_S
        view.selection = (start_s, min(end_s, view.clip.duration_s)) if long_enough else None
        self._timeline.refresh()
        self._query.refresh()
