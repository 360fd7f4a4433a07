"""How fast motion files are read, beside other readers, and whether they agree.

Run: ``python benchmarks/bench_reading.py``. Real clips are looked for in MOCAPDB_CORPUS, else in
``../shared/corpus``; without any there is nothing to measure. Other readers take part if they are
installed (``pip install 'mocapdb[bench]'``). One process, one thread, warm kernels and warm file
cache; every figure is the median over rounds in which the readers take turns.
"""

from __future__ import annotations

import os
import statistics
import time
import warnings
from collections.abc import Callable
from functools import partial
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from mocapdb.io import find_skeleton
from mocapdb.io.acclaim import read_amc, read_asf
from mocapdb.io.bvh import read_bvh
from mocapdb.motion.kinematics import forward_kinematics

Reader: TypeAlias = Callable[[Path], Any]

ROUNDS = 15
FEWEST_ROUNDS = 3
SLOW_S = 0.2  # readers that take longer are measured in fewer rounds
FILES_PER_FOLDER = 2
PEERS = {
    "pybvh": lambda module, path: module.read_bvh_file(path),
    "bvhio": lambda module, path: module.readAsBvh(str(path)),
    "bvh": lambda module, path: module.Bvh(path.read_text()),
}


def main() -> None:
    corpus = find_corpus()
    if corpus is None:
        print("No real clips: set MOCAPDB_CORPUS to a folder of them.")
        return
    warnings.simplefilter("ignore")
    measure_amc(largest(corpus, ".amc"))
    measure_bvh(largest(corpus, ".bvh"))


def find_corpus() -> Path | None:
    named = os.environ.get("MOCAPDB_CORPUS")
    corpus = Path(named) if named else Path(__file__).parents[2] / "shared" / "corpus"
    return corpus if corpus.is_dir() else None


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


def measure_amc(paths: list[Path]) -> None:
    print("AMC, its skeleton read before (no other reader of AMC installs from PyPI)")
    skeletons = {path: read_asf(find_skeleton(path)) for path in paths}
    speeds = megabytes_per_second(paths, {"mocapdb": lambda path: read_amc(path, skeletons[path])})
    for path in paths:
        print(f"  {path.name:32} {size_mb(path):5.2f} MB  {row_of(speeds[path])}")


def measure_bvh(paths: list[Path]) -> None:
    peers = {name: import_module(name) for name in PEERS if find_spec(name)}
    absent = [name for name in PEERS if name not in peers]
    versions = ", ".join(f"{name} {version(name)}" for name in peers)
    print(f"BVH, beside {versions or 'no other reader'}", end="")
    print(f" (not installed: {', '.join(absent)})" if absent else "")
    readers: dict[str, Reader] = {"mocapdb": read_bvh}
    readers |= {name: partial(PEERS[name], module) for name, module in peers.items()}
    speeds = megabytes_per_second(paths, readers)
    for path in paths:
        print(f"  {path.name:32} {size_mb(path):5.2f} MB  {row_of(speeds[path])}")
        if peers:
            best = max(peers, key=lambda name: speeds[path][name])
            print(f"    {speeds[path]['mocapdb'] / speeds[path][best]:.1f} times as fast as {best}")
        if "pybvh" in peers:
            print(f"    positions differ by {disagreement(path, peers['pybvh']):.1e} of the height")


def megabytes_per_second(
    paths: list[Path], readers: dict[str, Reader]
) -> dict[Path, dict[str, float]]:
    """Return the median speed of each reader on each file.

    In every round each reader in turn reads all files, as it would read a folder of them.
    """
    seconds: dict[tuple[Path, str], list[float]] = {(p, r): [] for p in paths for r in readers}
    for turn in range(1 + ROUNDS):
        for name, read in readers.items():
            taken = seconds[paths[0], name]
            if len(taken) >= FEWEST_ROUNDS and statistics.median(taken) > SLOW_S:
                continue
            for path in paths:
                start = time.perf_counter()
                read(path)
                if turn > 0:  # the first turn compiles, and fills the caches
                    seconds[path, name].append(time.perf_counter() - start)
    return {
        path: {name: size_mb(path) / statistics.median(seconds[path, name]) for name in readers}
        for path in paths
    }


def row_of(speeds: dict[str, float]) -> str:
    return "  ".join(f"{name} {speed:6.1f} MB/s" for name, speed in speeds.items())


def size_mb(path: Path) -> float:
    return path.stat().st_size / 1e6


def disagreement(path: Path, pybvh: Any) -> float:
    """Return the largest distance of a joint between pybvh's positions and ours, over the height.

    Both list joints and End Sites depth-first.
    """
    clip = read_bvh(path)
    ours = forward_kinematics(clip.skeleton, clip.channels).positions
    theirs = pybvh.read_bvh_file(path).node_positions()
    return float(np.linalg.norm(ours - theirs, axis=-1).max() / clip.skeleton.height)


if __name__ == "__main__":
    main()
