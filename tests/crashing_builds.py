"""Build libraries that die on the way: ``python crashing_builds.py CORPUS OUT KILLS``.

OUT gets ``step-000.mocapdb``, ``step-001.mocapdb``, ...: the builder of each is killed just before
it touches the disk for that time, until one of them gets through; and KILLS more whose builders are
killed at any moment. Each builder is a process forked from this one, which has everything loaded.
Prints how many steps there were.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from pathlib import Path

from small_library import build

import mocapdb.library.build as builder
from mocapdb.library.catalogue import Catalogue

TOUCHING = {"open", "os.rename", "os.remove", "os.mkdir", "sqlite3.connect"}


def forked(corpus: Path, library: Path, steps: int | None) -> int:
    pid = os.fork()
    if pid == 0:
        if steps is not None:
            die_after(steps, str(library))
        build(corpus, library)
        os._exit(0)
    return pid


def die_after(steps: int, library: str) -> None:
    """Kill this process before it touches the library for the time after `steps`."""
    left = steps

    def step() -> None:
        nonlocal left
        left -= 1
        if left < 0:
            os.kill(os.getpid(), signal.SIGKILL)

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        if event in TOUCHING and library in str(arguments[0]):
            step()

    sys.addaudithook(hook)
    for name in ("_execute", "_insert"):  # what SQLite does itself is not audited
        method = getattr(Catalogue, name)

        def stepping(self, *arguments, method=method):
            step()
            return method(self, *arguments)

        setattr(Catalogue, name, stepping)


def main(corpus: Path, out: Path, kills: int) -> None:
    builder.COMMIT_SECONDS = 0.0  # a shard and a commit for every clip
    build(corpus, out / "warm-up.mocapdb")
    took_s = build(corpus, out / "again.mocapdb").seconds
    steps = 0
    while os.waitpid(forked(corpus, out / f"step-{steps:03d}.mocapdb", steps), 0)[1]:
        steps += 1
    chance = random.Random(0)
    for kill in range(kills):
        pid = forked(corpus, out / f"kill-{kill:03d}.mocapdb", None)
        time.sleep(chance.uniform(0, took_s))
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
    print(steps)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))
