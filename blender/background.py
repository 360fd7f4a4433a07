"""The worker as the add-on sees it: started when it is first needed, asked, looked at, stopped."""

from __future__ import annotations

import contextlib
import io
import json
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from pathlib import Path
from typing import IO, Any, NamedTuple

__all__ = ["WORKER", "Progress", "TaskError", "Worker"]

PROGRAM = Path(__file__).with_name("worker.py")
LOOK_S = 0.005  # how long waiting sleeps between two looks
KEPT_FILES = 40  # of those that were handed over
TOLD_LINES = 12  # of what a worker that broke down has printed


class Progress(NamedTuple):
    """How far a task has come."""

    done: int
    total: int
    name: str


class TaskError(Exception):
    """A task that was refused or failed, with what the user is told of it."""


class Worker:
    """A process that does one task at a time.

    Examples
    --------
    ::

        WORKER.start("clean", motion="take.npz", ...)
        while (answer := WORKER.look()) is None or isinstance(answer, Progress):
            ...  # the window lives on
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._orders: IO[str] = io.StringIO()
        self._folder: Path | None = None
        self._files: deque[str] = deque()
        self.busy = False
        self._unheard = 0  # answers that nobody waits for

    @property
    def folder(self) -> Path:
        """A folder of its own for what is handed over; it is gone when Blender is."""
        if self._folder is None or not self._folder.is_dir():
            self._folder = Path(tempfile.mkdtemp(prefix="mocapdb_"))
        return self._folder

    def file(self, suffix: str) -> str:
        """Return a new file in the folder."""
        handle, name = tempfile.mkstemp(suffix=suffix, dir=self.folder)
        os.close(handle)
        self._files.append(name)
        if len(self._files) > KEPT_FILES:
            Path(self._files.popleft()).unlink(missing_ok=True)
        return name

    def prepare(self) -> None:
        """Start the process where there is none, and let it load what most tasks need.

        Nobody waits for it; the next task does, if it comes sooner.
        """
        if self._process is None and not self.busy:
            self.start("get_ready")
            self.busy, self._unheard = False, 1

    def start(self, task: str, **arguments: Any) -> None:
        """Begin a task.

        Raises
        ------
        TaskError
            If another one is being done, or the process cannot be started.
        """
        if self.busy:
            raise TaskError("mocapdb is at work on something else: wait for it, or cancel it.")
        if self._process is None or self._process.poll() is not None:
            self._begin()
        order = json.dumps({"task": task, "arguments": arguments})
        try:
            self._orders.write(order + "\n")
            self._orders.flush()
        except OSError as problem:
            raise TaskError(f"mocapdb's process has ended ({problem}). Try again.") from None
        self.busy = True

    def look(self) -> Progress | dict[str, Any] | None:
        """Return the latest progress, the result when there is one, or None if nothing is new.

        Raises
        ------
        TaskError
            If the task was refused or failed, or the process has ended.
        """
        latest = None
        with contextlib.suppress(queue.Empty):
            while True:
                line = self._lines.get_nowait()
                if line is None:
                    raise self._ended()
                answer = json.loads(line)
                if self._unheard and "progress" not in answer:
                    self._unheard = 0  # of what was prepared
                    continue
                if "progress" in answer:
                    latest = Progress(*answer["progress"])
                    continue
                self.busy = False
                if "error" in answer:
                    raise TaskError(_said(answer))
                return dict(answer["result"])
        return latest

    def do(self, task: str, **arguments: Any) -> dict[str, Any]:
        """Do a task and wait for it."""
        self.start(task, **arguments)
        return self.wait()

    def wait(self) -> dict[str, Any]:
        """Wait for the result of the task that was begun."""
        while not isinstance(answer := self.look(), dict):
            time.sleep(LOOK_S)
        return answer

    def stop(self) -> None:
        """Break off what is being done; the next task starts a new process."""
        process, self._process = self._process, None
        self.busy, self._unheard = False, 0
        self._lines = queue.Queue()
        if process is not None:
            process.kill()
            process.wait()
            with contextlib.suppress(OSError):
                self._orders.close()

    def close(self) -> None:
        """Stop, and remove what was handed over."""
        self.stop()
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None

    def _begin(self) -> None:
        self.stop()
        environment = dict(os.environ, PYTHONPATH=os.pathsep.join(filter(None, sys.path)))
        try:
            with (self.folder / "worker.log").open("w", encoding="utf-8") as log:
                process = subprocess.Popen(
                    [sys.executable, "-P", str(PROGRAM)],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=log,
                    env=environment,
                    cwd=self.folder,
                    text=True,
                    encoding="utf-8",
                    creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),  # of Windows
                )
        except OSError as problem:
            raise TaskError(f"Cannot start {sys.executable} ({problem.strerror}).") from None
        assert process.stdin is not None and process.stdout is not None  # both are pipes
        self._process, self._orders = process, process.stdin
        pipe, lines = process.stdout, self._lines

        def read() -> None:
            with pipe:
                for line in pipe:
                    lines.put(line)
            lines.put(None)

        threading.Thread(target=read, daemon=True).start()

    def _ended(self) -> TaskError:
        told = ""
        with contextlib.suppress(OSError):
            lines = (self.folder / "worker.log").read_text(encoding="utf-8").splitlines()
            told = "\n".join(lines[-TOLD_LINES:])
        self.stop()
        return TaskError(f"mocapdb's process has ended before it had a result. {told}".strip())


def _said(answer: dict[str, Any]) -> str:
    if answer["kind"] == "missing":
        return (
            f"This needs the Python package {answer['error'].partition('.')[0]}, which this build "
            "of the extension does not carry: install the full one (make blender)."
        )
    if answer["kind"] == "unexpected":
        return f"mocapdb failed: {answer['error']}. Its log is {WORKER.folder / 'worker.log'}."
    return str(answer["error"])


WORKER = Worker()
