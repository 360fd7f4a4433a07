"""What a session is asked for, done in turn by one thread, with frames drawn in between."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

from mocapdb.scenes.stage import SHOWN_FPS

__all__ = ["Action", "EventLoop"]

Action = Callable[[], None]
Result = TypeVar("Result")

FRAME_S = 1.0 / SHOWN_FPS  # from one frame to the next while something plays
IDLE_S = 0.25  # how often the size of the window is looked at while nothing plays


class EventLoop:
    """A queue of actions. Any thread may add to it; the one that calls `run` does them.

    Parameters
    ----------
    name : str
        Of the thread that does long work.
    failed : callable
        Called with the exception of an action that failed; the loop goes on.
    """

    def __init__(self, name: str, failed: Callable[[Exception], None]) -> None:
        self._failed = failed
        self._queue: queue.SimpleQueue[Action | None] = queue.SimpleQueue()
        self._latest: dict[str, Action] = {}
        self._lock = threading.Lock()  # of _latest, which other threads write too
        self._worker = ThreadPoolExecutor(1, name)

    # -- for any thread ----------------------------------------------------------------------------

    def post(self, action: Action) -> None:
        """Have something done by the loop's thread."""
        self._queue.put(action)

    def post_latest(self, what: str, action: Action) -> None:
        """The same, but of several such that wait only the last is done."""
        with self._lock:
            waiting = what in self._latest
            self._latest[what] = action
        if not waiting:
            self.post(partial(self._do_latest, what))

    def close(self) -> None:
        """End the loop once everything that waits is done."""
        self._queue.put(None)

    # -- for the loop's own thread -----------------------------------------------------------------

    def background(self, work: Callable[[], Result], then: Callable[[Result], None]) -> None:
        """Have something long done by another thread, and then something with what comes out."""
        future = self._worker.submit(work)
        future.add_done_callback(lambda done: self.post(lambda: then(done.result())))

    def attempt(self, action: Action) -> bool:
        """Do something and return whether it succeeded; a failure is told."""
        try:
            action()
        except Exception as problem:
            self._failed(problem)
            return False
        return True

    def run(self, tick: Callable[[float], None], playing: Callable[[], bool]) -> None:
        """Do what is asked for, until the loop is closed.

        Parameters
        ----------
        tick : callable
            Called at each frame, with the seconds that have passed since its last call.
        playing : callable
            Whether something moves: else the next frame can wait for the next action.
        """
        before = due = time.perf_counter()
        while True:
            wait = due - time.perf_counter() if playing() else IDLE_S
            try:
                action = self._queue.get(timeout=max(wait, 0.0))
            except queue.Empty:
                pass  # nothing but time has passed
            else:
                if action is None:
                    break
                self.attempt(action)
            now = time.perf_counter()
            if now >= due:
                self.attempt(partial(tick, now - before))
                before, due = now, max(due + FRAME_S, now)
        self._worker.shutdown(wait=False, cancel_futures=True)

    def _do_latest(self, what: str) -> None:
        with self._lock:
            action = self._latest.pop(what)
        action()
