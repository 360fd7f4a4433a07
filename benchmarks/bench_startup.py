"""What a first minute costs: compiling, and each command when all is compiled.

Compiling is measured in a fresh ``NUMBA_CACHE_DIR``: as ``mocapdb demo`` does it, shared among the
processors, and in one process, where kernels are counted. Commands are the medians of five runs on
real clips, else on synthetic ones, beside ``import numpy`` in the same run.
"""

from __future__ import annotations

import os
import resource
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from _corpus import corpus_folder

from mocapdb.cli._kernels import _write_files

RUNS = 5

SHARED = """
from mocapdb.cli._kernels import compile_kernels
compile_kernels(lambda done, total, name: None)
"""

ALONE = """
import tempfile
from pathlib import Path
from numba.core import event
from mocapdb.cli import _kernels

compiled = []

class Listener(event.Listener):
    def on_start(self, event):
        compiled.append(event.data["dispatcher"].py_func)

    def on_end(self, event):
        pass

event.register("numba:compile", Listener())
with tempfile.TemporaryDirectory() as folder:
    for job in _kernels._JOBS:
        _kernels._do(job, Path(folder, job.__name__))
print(f"{len(set(compiled))} kernels, compiled {len(compiled)} times")
"""


def measured(arguments: Sequence[str], cache: Path) -> tuple[float, float, str]:
    """Return the seconds of a Python process by the clock and of processor time, and its output."""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        check=True,
    )
    taken, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return taken, processor, done.stdout.strip()


def main() -> None:
    with TemporaryDirectory() as name:
        folder = Path(name)
        taken, processor, _ = measured(["-c", SHARED], folder / "shared")
        print(f"compiling, {os.cpu_count()} cores: {taken:.1f} s, {processor:.1f} s of processors")
        taken, processor, counts = measured(["-c", ALONE], folder / "alone")
        print(f"compiling, one process: {taken:.1f} s, {processor:.1f} s of processors; {counts}")

        source = folder / "clips"
        source.mkdir()
        clip = next(corpus_folder().rglob("07_05.amc"), None)
        if clip is None:
            _write_files(source)
            clip = source / "01_01.amc"
        else:
            shutil.copy(clip, source)
            shutil.copy(clip.with_name("07.asf"), source)
            clip = source / clip.name
        library = folder / "library.mocapdb"
        measured(["-m", "mocapdb", "build", str(source), "-o", str(library)], folder / "alone")
        commands = {
            "ls": ["ls", str(library)],
            "info": ["info", str(library)],
            "convert": ["convert", str(clip), str(folder / "converted.bvh")],
            "export": ["export", str(library), clip.stem, "-o", str(folder / "exported.bvh")],
            "query": ["query", str(library), str(clip)],
            "cycle": ["cycle", str(clip)],
        }
        show("import numpy", ["-c", "import numpy"], folder / "alone")
        for command, arguments in commands.items():
            show(command, ["-m", "mocapdb", *arguments], folder / "alone")


def show(label: str, arguments: Sequence[str], cache: Path) -> None:
    """Print the median of warm runs."""
    measured(arguments, cache)
    runs = [measured(arguments, cache) for _ in range(RUNS)]
    taken, processor = (statistics.median(run[i] for run in runs) for i in range(2))
    print(f"{label:12} {taken:5.2f} s, {processor:5.2f} s of processors")


if __name__ == "__main__":
    main()
