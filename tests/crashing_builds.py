"""Build libraries that die on the way: ``python crashing_builds.py CORPUS OUT KILLS``.

OUT gets ``step-000.mocapdb``, ``step-001.mocapdb``, ...: the builder of each is killed just before
it touches the disk for that time, until one of them gets through; and KILLS more whose builders are
killed at any moment. Each builder is a process forked from this one, which has everything loaded.
Prints how many steps there were.
"""

from __future__ import annotations

import os
import random
import re
import signal
import sys
import time
from pathlib import Path

# only a process of one thread may be forked
os.environ |= dict.fromkeys(["OPENBLAS_NUM_THREADS", "DUCC0_NUM_THREADS"], "1")

from small_library import build

import mocapdb.library.building.commit_clips as committing
from mocapdb.library.writing.catalogue_writer import CatalogueWriter

WRITING = re.compile("BEGIN|COMMIT|INSERT|UPDATE|DELETE", re.IGNORECASE)
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
    prepare = CatalogueWriter._prepare

    def prepare_and_step(self):  # what SQLite does itself is not audited
        prepare(self)
        self._connection.set_trace_callback(lambda sql: step() if WRITING.match(sql) else None)

    CatalogueWriter._prepare = prepare_and_step


def main(corpus: Path, out: Path, kills: int) -> None:
    committing.COMMIT_SECONDS = 0.0  # a shard and a commit for every clip
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
