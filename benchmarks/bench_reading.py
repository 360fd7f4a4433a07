"""How fast motion files are read: the largest of each folder of real clips.

Run: ``python benchmarks/bench_reading.py``. One process, one thread, warm kernels and warm file
cache; every figure is the median over rounds. `peers.py` has other readers beside it.
"""

from __future__ import annotations

import statistics
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from _corpus import corpus_or_exit

from mocapdb.io import find_skeleton
from mocapdb.io.acclaim import read_amc, read_asf
from mocapdb.io.bvh import read_bvh

ROUNDS = 15
FILES_PER_FOLDER = 2


def main() -> None:
    corpus = corpus_or_exit()
    warnings.simplefilter("ignore")
    amcs = largest(corpus, ".amc")
    skeletons = {path: read_asf(find_skeleton(path)) for path in amcs}
    print("AMC, its skeleton read before")
    measure(amcs, lambda path: read_amc(path, skeletons[path]))
    print("BVH")
    measure(largest(corpus, ".bvh"), read_bvh)


def largest(corpus: Path, suffix: str) -> list[Path]:
    """Return the largest files of each subfolder, so that every family of files takes part."""
    families: dict[Path, list[Path]] = {}
    for path in corpus.rglob(f"*{suffix}"):
        families.setdefault(corpus / Path(*path.relative_to(corpus).parts[:2]), []).append(path)
    return [
        path
        for _, paths in sorted(families.items())
        for path in sorted(paths, key=lambda path: -path.stat().st_size)[:FILES_PER_FOLDER]
    ]


def measure(paths: list[Path], read: Callable[[Path], Any]) -> None:
    """Print how fast each file is read, when all are read in turn as those of a folder are."""
    seconds: dict[Path, list[float]] = {path: [] for path in paths}
    for turn in range(1 + ROUNDS):
        for path in paths:
            start = time.perf_counter()
            read(path)
            if turn > 0:  # the first turn compiles, and fills the caches
                seconds[path].append(time.perf_counter() - start)
    for path in paths:
        size_mb = path.stat().st_size / 1e6
        speed = size_mb / statistics.median(seconds[path])
        print(f"  {path.name:32} {size_mb:5.2f} MB  {speed:6.1f} MB/s")


if __name__ == "__main__":
    main()
