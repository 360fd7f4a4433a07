"""One browser: a thread of its own that plays, and does what the browser asks for, in turn.

Whatever arrives from the browser is put into a queue; only the session's thread touches its
library, its scene and its panels. So browsers do not disturb each other.
"""

from __future__ import annotations

import queue
import sys
import threading
import time
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from mocapdb.errors import ClipError, LibraryError, MocapdbError
from mocapdb.motion.clip import Clip
from mocapdb.scenes.stage import ACTOR_COLOURS, SHOWN_FPS, Actor, Stage
from mocapdb.viewer.bridge import Bridge
from mocapdb.viewer.clip_panel import COLUMNS, ClipsPanel
from mocapdb.viewer.loop_panel import LoopsPanel
from mocapdb.viewer.playback import SPEEDS, Playback
from mocapdb.viewer.query_panel import QueryPanel
from mocapdb.viewer.scene import StageScene
from mocapdb.viewer.timeline_panel import COMPARISONS, TimelinePanel

if TYPE_CHECKING:
    from mocapdb.cleaning import Cleaned, MovementDigressionMap
    from mocapdb.library import Library
    from mocapdb.library.catalogue import ClipRecord

__all__ = ["Session"]

Result = TypeVar("Result")

FRAME_S = 1.0 / SHOWN_FPS
IDLE_S = 0.25
TOLD_S = 1.0 / 15.0  # the clock is rewritten so often
PANEL_PX = 430
MOST_CLEANED = 8
SHORTEST_S = 0.3


class Session(threading.Thread):
    """A browser's session.

    Parameters
    ----------
    client : viser.ClientHandle
    path : Path
        Of the library.
    opening : str, optional
        The clip to open first.

    Attributes
    ----------
    library : Library
    clip : Clip or None
        The clip that is open, decoded; `name` is its name.
    digression_map : MovementDigressionMap or None
        What is flagged in it, once it is known.
    selection : (float, float) or None
        The range that is selected, in seconds.
    shows_clip : bool
        Whether the stage shows the clip, and not hits or a cycle.
    flags : dict of str to int
        Flagged spans of the clips that were looked at.
    """

    library: Library
    scene: StageScene

    def __init__(self, client: Any, path: Path, opening: str | None = None) -> None:
        super().__init__(name=f"mocapdb session {client.client_id}", daemon=True)
        self.client = client
        self._path = path
        self._opening = opening
        self._inbox: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._latest: dict[str, Callable[[], None]] = {}
        self._lock = threading.Lock()  # of _latest, which viser's threads write too
        self._worker = ThreadPoolExecutor(1, f"mocapdb worker {client.client_id}")
        self._cleaned: dict[str, Cleaned] = {}
        self._told = 0.0
        self._drawn = -1.0
        self._shown_clip: Stage | None = None
        self.playback = Playback()
        self.clip: Clip | None = None
        self.name = ""
        self.title = ""
        self.busy = ""
        self.comparison = COMPARISONS[0]
        self.digression_map: MovementDigressionMap | None = None
        self.selection: tuple[float, float] | None = None
        self.shows_clip = True
        self.flags: dict[str, int] = {}

    # -- what other threads may call -------------------------------------------------------------

    def post(self, action: Callable[[], None]) -> None:
        """Have something done by the session's thread."""
        self._inbox.put(action)

    def post_latest(self, what: str, action: Callable[[], None]) -> None:
        """The same, but of several such that wait only the last is done."""
        with self._lock:
            waiting = what in self._latest
            self._latest[what] = action
        if not waiting:
            self.post(partial(self._do_latest, what))

    def close(self) -> None:
        """End the session."""
        self._inbox.put(None)

    def _do_latest(self, what: str) -> None:
        with self._lock:
            action = self._latest.pop(what)
        action()

    def _receive(self, verb: str, rest: str) -> None:
        """Take a message of our own HTML; of several places to go to, only the last counts."""
        if verb == "seek":
            self.post_latest(verb, partial(self._obey, verb, rest))
        else:
            self.post(partial(self._obey, verb, rest))

    # -- the thread --------------------------------------------------------------------------------

    def run(self) -> None:
        """Play and answer until the browser leaves."""
        from mocapdb.library import Library

        with Library(self._path) as self.library:
            if self._guarded(self._build):
                self._play()
        self._worker.shutdown(wait=False, cancel_futures=True)

    def _play(self) -> None:
        before = due = time.perf_counter()
        while True:
            wait = due - time.perf_counter() if self.playback.playing else IDLE_S
            try:
                action = self._inbox.get(timeout=max(wait, 0.0))
            except queue.Empty:
                pass  # nothing but time has passed
            else:
                if action is None:
                    return
                self._guarded(action)
            now = time.perf_counter()
            if now >= due:
                self._guarded(partial(self._tick, now - before))
                before, due = now, max(due + FRAME_S, now)

    def _guarded(self, action: Callable[[], None]) -> bool:
        """Do something, and tell the browser if it fails."""
        try:
            action()
        except MocapdbError as problem:
            self.say(str(problem), failed=True)
        except Exception as problem:
            traceback.print_exc(file=sys.stderr)
            self.say(f"a fault of mocapdb's own: {problem}", failed=True)
        else:
            return True
        return False

    def _tick(self, passed_s: float) -> None:
        clock = self.playback
        was_playing = clock.playing
        clock.advance(min(passed_s, 0.25))
        if clock.time_s != self._drawn:
            self._drawn = clock.time_s
            self.scene.draw(clock.time_s)
            if time.perf_counter() - self._told > TOLD_S or not clock.playing:
                self._told = time.perf_counter()
                self.timeline.tell()
        if was_playing and not clock.playing:
            self.timeline.refresh()
        self._fit()

    def _fit(self) -> None:
        camera = self.client.camera
        self.timeline.fit(camera.image_width, camera.image_height)

    def _build(self) -> None:
        gui = self.client.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        gui.set_panel_label(self._path.resolve().name)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_PX)
        self.scene = StageScene(self.client)
        Bridge(gui, self._receive)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Clips"):
            self.clips = ClipsPanel(self, gui)
        with tabs.add_tab("Query"):
            self.query = QueryPanel(self, gui)
        with tabs.add_tab("Cycles"):
            self.loops = LoopsPanel(self, gui)
        self.timeline = TimelinePanel(self, gui)
        self.timeline.refresh()
        self._fit()
        first = self._opening or next((record.name for record in self.clips.records), None)
        if first is None:
            raise LibraryError(f"{self._path}: the library is empty. Build clips into it first.")
        self.open(first)

    def _obey(self, verb: str, rest: str) -> None:
        """Do what an element of our own HTML asks for."""
        clock = self.playback
        if verb == "open":
            self.open(rest)
        elif verb == "sort":
            self.clips.sort(int(rest) % len(COLUMNS))
        elif verb == "hit":
            self.query.play(int(rest))
        elif verb == "compare":
            self.compare(rest)
        elif verb == "back":
            self.compare(self.comparison)
        elif verb == "seek":
            clock.seek(float(rest))
        elif verb == "step":
            clock.playing = False
            clock.seek(clock.time_s + int(rest) / min(self.fps, SHOWN_FPS))
            self.timeline.refresh()
        elif verb == "span":
            self.go_to_span(int(rest))
        elif verb == "range":
            start, end = map(float, rest.split())
            self.select(start, end)
        else:
            if verb == "toggle":
                clock.toggle()
            elif verb == "loop":
                clock.loop = not clock.loop
            elif verb == "follow":
                self.scene.follow = not self.scene.follow
            elif verb == "speed":
                clock.speed = min(SPEEDS, key=lambda speed: abs(speed - float(rest)))
            self.timeline.refresh()

    # -- what can be done --------------------------------------------------------------------------

    @property
    def fps(self) -> float:
        """Frames a second of what is shown: the clip's own, or the stage's."""
        if self.shows_clip and self.clip is not None:
            return self.clip.fps
        return self.scene.stage.fps if self.scene.stage is not None else SHOWN_FPS

    def record(self) -> ClipRecord:
        """Return the row of the clip that is open."""
        return self.library.record(self.name)

    def background(self, work: Callable[[], Result], then: Callable[[Result], None]) -> None:
        """Have something long done beside the playing, and then something with what comes out."""
        future = self._worker.submit(work)
        future.add_done_callback(lambda done: self.post(lambda: then(done.result())))

    def say(self, text: str, *, failed: bool = False) -> None:
        """Tell the browser something in passing."""
        self.client.add_notification(
            "That did not work" if failed else "mocapdb", text, color="red" if failed else "blue",
            auto_close_seconds=8.0 if failed else 3.0,
        )  # fmt: skip

    def open(self, name: str) -> None:
        """Open a clip and play it; what is flagged in it follows when it is known."""
        record = self.library.record(name)
        self.clip = self.library.clip(record.name)
        self.name, self.selection = record.name, None
        cleaned = self._cleaned.get(record.name)
        self.digression_map = None if cleaned is None else cleaned.digression_map
        self.busy = "looking for faults…" if cleaned is None else ""
        self.loops.forget_clip()
        self.comparison = COMPARISONS[0]
        self.compare(COMPARISONS[0])
        self.clips.refresh()
        self.query.refresh()
        if cleaned is None:
            self.find_faults(record.name, self._show_faults)

    def compare(self, how: str) -> None:
        """Show the clip that is open alone, beside its original, or beside its repair."""
        if self.clip is None:
            return
        if how not in COMPARISONS:
            raise ClipError(f"Expected a comparison out of {COMPARISONS}, but got {how!r}.")
        try:
            stage = self._comparison(how)
        except MocapdbError:
            self.timeline.refresh()  # the menu shows again what is shown
            raise
        kept = self.shows_clip and self._shown_clip is not None and self.title == self.name
        time_s = self.playback.time_s
        self.comparison, self.shows_clip, self.title = how, True, self.name
        self._shown_clip = stage
        self.scene.show(stage)
        self.playback.restart((stage.n_frames - 1) / stage.fps, playing=True)
        if kept:
            self.playback.seek(time_s)
        self._drawn = -1.0
        self.timeline.refresh()

    def _comparison(self, how: str) -> Stage:
        clip = self.clip
        assert clip is not None
        if how == COMPARISONS[1]:
            original = self._original()
            actors = [
                Actor.of(original, name="original"),
                Actor.of(clip, name="decoded", against=original),
            ]
            return Stage.side_by_side(actors)
        if how == COMPARISONS[2]:
            repaired = self.cleaned(self.name).clip
            actors = [
                Actor.of(clip, name="before", colour=ACTOR_COLOURS[1]),
                Actor.of(repaired, name="repaired", against=clip, error_is="moved by"),
            ]
            return Stage.side_by_side(actors)
        return Stage.together([Actor.of(clip)])

    def _original(self) -> Clip:
        """Return the clip as it was before it was encoded, from the corpus.

        Raises
        ------
        ClipError
            If the corpus is not there any more, or its file has changed.
        """
        from mocapdb.io import read_clip

        record = self.record()
        path = Path(record.corpus) / record.source
        if not path.is_file():
            raise ClipError(f"{path}: the original is not there any more.")
        original = read_clip(path, fps=record.fps)
        assert self.clip is not None
        if len(original) > len(self.clip):  # a T-pose in front was left out
            original = original[len(original) - len(self.clip) :]
        return original

    def cleaned(self, name: str) -> Cleaned:
        """Return what is flagged in a clip, and its repair; the last few are kept."""
        from mocapdb.cleaning import clean_clip

        if name not in self._cleaned:
            self._keep(name, clean_clip(self.library.clip(name)))
        return self._cleaned[name]

    def find_faults(self, name: str, then: Callable[[str], None]) -> None:
        """Find out what `cleaned` returns beside the playing, and then do something."""
        from mocapdb.cleaning import clean_clip

        clip = self.library.clip(name)

        def work() -> Cleaned | MocapdbError:
            try:
                return clean_clip(clip)
            except MocapdbError as problem:  # a body without joints that rotate, say
                return problem

        def keep(found: Cleaned | MocapdbError) -> None:
            if isinstance(found, MocapdbError):
                self.say(f"{name}: {found}", failed=True)
            else:
                self._keep(name, found)
            then(name)

        self.background(work, keep)

    def _keep(self, name: str, found: Cleaned) -> None:
        if len(self._cleaned) >= MOST_CLEANED:
            self._cleaned.pop(next(iter(self._cleaned)))
        self._cleaned[name] = found
        self.flags[name] = len(found.digression_map.spans)

    def _show_faults(self, name: str) -> None:
        if name == self.name:  # no other clip has been opened since
            found = self._cleaned.get(name)
            self.digression_map = None if found is None else found.digression_map
            self.busy = "" if found else "this clip cannot be searched for faults"
            self.timeline.refresh()
        self.clips.refresh()

    def go_to_span(self, number: int) -> None:
        """Go to a flagged span, pause, and wait for the user to look."""
        if self.digression_map is None or not 0 <= number < len(self.digression_map.spans):
            return
        if not self.shows_clip:
            self.compare(self.comparison)
        span = self.digression_map.spans[number]
        self.playback.playing = False
        self.playback.seek(span.start / self.digression_map.fps)
        self.timeline.refresh()

    def select(self, start_s: float, end_s: float) -> None:
        """Select a range of the clip; one that is too short for a query selects nothing."""
        if self.clip is None:
            return
        long_enough = end_s - start_s >= SHORTEST_S
        self.selection = (start_s, min(end_s, self.clip.duration_s)) if long_enough else None
        self.timeline.refresh()
        self.query.refresh()

    def show_aside(self, stage: Stage, title: str, *, keep_camera: bool = False) -> None:
        """Show something other than the clip that is open."""
        time_s = self.playback.time_s
        keep = keep_camera and not self.shows_clip
        self.shows_clip, self.title = False, title
        self.scene.show(stage, keep_camera=keep)
        self.playback.restart((stage.n_frames - 1) / stage.fps, playing=True)
        if keep:
            self.playback.seek(time_s)
        self._drawn = -1.0
        self.timeline.refresh()
