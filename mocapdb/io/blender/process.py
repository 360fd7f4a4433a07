"""A Blender that runs beside mocapdb, and answers one request after the other."""

from __future__ import annotations

import json
import os
import queue
import re
import shutil
import subprocess
import tempfile
import threading
import time
from multiprocessing import util
from pathlib import Path
from typing import IO, Any, NamedTuple

from mocapdb.errors import MocapdbError
from mocapdb.io.blender.program import NEEDED, Program

__all__ = ["PATIENCE", "BlenderError", "BlenderProcess", "shared_blender"]

PATIENCE = "MOCAPDB_BLENDER_SECONDS"
"""The environment variable that says how many seconds Blender may take at least for an answer."""

START_S = 120.0  # a first start reads hundreds of megabytes
END_S = 5.0
LAST_WORDS = 400  # characters of what it printed last
LACKING = re.compile(r"ModuleNotFoundError: No module named '(bpy|numpy)'")


class BlenderError(MocapdbError):
    """Blender could not do what was asked of it; the message says why."""


class BlenderProcess:
    """One Blender, started when it is first asked, and anew after it has stopped.

    Parameters
    ----------
    program : Program
    """

    def __init__(self, program: Program) -> None:
        self._program = program
        self._process: subprocess.Popen[bytes] | None = None
        self._answers: queue.Queue[bytes | None] = queue.Queue()
        self._folder = Path()
        self._log: IO[bytes] | None = None

    @property
    def folder(self) -> Path:
        """The folder for files that go to and fro; it is there while Blender runs."""
        self._start()
        return self._folder

    def ask(self, request: dict[str, Any], timeout_s: float) -> dict[str, Any]:
        """Return the answer to a request.

        Raises
        ------
        BlenderError
            If Blender cannot do it, stops, or does not answer in time; it is then ended.
        """
        self._start()
        limit = _Limit.of(timeout_s)  # before anything is asked, for it may be refused
        self._send(request)
        answer = self._next(limit)
        if "error" in answer:
            raise BlenderError(str(answer["error"]))
        return answer

    def close(self) -> None:
        """End Blender, and remove what it left."""
        process, self._process = self._process, None
        if process is None:
            return
        for stream in (process.stdin, process.stdout):
            if stream is not None and stream is not process.stdout:
                try:
                    stream.close()
                except OSError:  # it is gone already
                    continue
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if self._log is not None:
            self._log.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _start(self) -> None:
        if self._process is not None:
            return
        limit = _Limit.of(START_S)
        self._folder = Path(tempfile.mkdtemp(prefix="mocapdb-blender-"))
        self._log = (self._folder / "printed.txt").open("w+b")
        own = {"BLENDER_USER_RESOURCES": str(self._folder / "user")}  # nobody's add-ons
        try:
            self._process = subprocess.Popen(
                [*self._program.command, str(self._folder)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                env=os.environ | own,
            )
        except OSError as problem:
            self._log.close()
            shutil.rmtree(self._folder, ignore_errors=True)
            raise BlenderError(f"Expected to start Blender, but cannot: {problem}.") from None
        self._answers = queue.Queue()
        threading.Thread(
            target=_listen, args=(self._process.stdout, self._answers), daemon=True
        ).start()
        hello = self._next(limit)
        while "version" not in hello:
            hello = self._next(limit)
        if not hello.get("usable"):
            self._end_now()
            raise BlenderError(f"Expected Blender 4.5 or later, but got {hello['version']}.")

    def _send(self, request: dict[str, Any]) -> None:
        assert self._process is not None and self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(request).encode() + b"\n")
            self._process.stdin.flush()
        except OSError:  # it has stopped: the next answer says so
            return

    def _end_now(self) -> None:
        """End Blender without waiting for what it does."""
        assert self._process is not None
        self._process.kill()
        self.close()

    def _next(self, limit: _Limit) -> dict[str, Any]:
        """Return the next answer; lines that are none are somebody's prints, and win no time."""
        assert self._process is not None
        while True:
            try:
                left_s = limit.until - time.monotonic()
                if left_s <= 0:
                    raise queue.Empty
                line = self._answers.get(timeout=left_s)
            except queue.Empty:
                self._end_now()
                raise BlenderError(
                    f"Expected an answer of Blender within {limit.seconds:g} s, but it gave none. "
                    "A first start or a busy computer may be why: try again, or allow more seconds "
                    f"in {PATIENCE}."
                ) from None
            if line is None:
                raise BlenderError(self._how_it_ended())
            try:
                answer = json.loads(line)
            except ValueError:
                continue
            if isinstance(answer, dict):
                return answer

    def _how_it_ended(self) -> str:
        assert self._process is not None and self._log is not None
        try:
            code = self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        self._log.seek(0)
        said = self._log.read().decode("utf-8", "replace").strip()[-LAST_WORDS:]
        self.close()
        lacking = LACKING.search(said)
        if lacking is not None:
            return (
                f"Expected Blender or a Python that has its module bpy, but "
                f"{self._program.command[0]!r} has no module {lacking[1]}. {NEEDED}"
            )
        how = f"was ended by signal {-code}" if code < 0 else f"stopped with exit code {code}"
        return f"Expected an answer of Blender, but it {how}" + (f": {said}" if said else ".")


class _Limit(NamedTuple):
    """Until when an answer is waited for."""

    seconds: float
    until: float

    @classmethod
    def of(cls, seconds: float) -> _Limit:
        """Return the limit that is so many seconds away, or more where `PATIENCE` says so."""
        said = os.environ.get(PATIENCE, "").strip()
        try:
            asked = float(said or 0.0)
        except ValueError:
            asked = -1.0
        if not 0.0 <= asked <= threading.TIMEOUT_MAX:
            raise BlenderError(f"Expected {PATIENCE} to be a number of seconds, but got {said!r}.")
        seconds = max(seconds, asked)
        return cls(seconds, time.monotonic() + seconds)


def _listen(stream: IO[bytes], answers: queue.Queue[bytes | None]) -> None:
    """Pass on lines as they come, then None."""
    with stream:
        for line in stream:
            answers.put(line)
    answers.put(None)


_SHARED: dict[tuple[int, Program], BlenderProcess] = {}
_LOCK = threading.Lock()


def shared_blender(program: Program) -> BlenderProcess:
    """Return this process's Blender: one reads many files, since to start one takes seconds."""
    key = (os.getpid(), program)
    with _LOCK:
        if key not in _SHARED:
            _SHARED[key] = BlenderProcess(program)
            util.Finalize(None, _SHARED[key].close, exitpriority=10)
        return _SHARED[key]
