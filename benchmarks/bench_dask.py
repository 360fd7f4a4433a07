"""A build by one process against one by a Dask cluster of two local workers, and their ratio.

python benchmarks/bench_dask.py [FOLDER] [--clips N] [--workers N] [--rounds N]

Both build the same clips, spread evenly over the folder, by turns. Beside the ratio of the times
stands that of the processor time: what one process takes over what the busiest worker takes, and
the client and scheduler after it, as if nothing of theirs went on at the same time. On a machine
that is busy with other work the first says little: two processes get twice one's share.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from _corpus import corpus_or_exit, motion_files

from mocapdb import BuildSettings, Library, Target, build_library

SETTINGS = BuildSettings(Target("mean_mm", 1.0))


def build(folder: Path, names: set[str], scheduler: str | None) -> dict[str, bytes]:
    """Return the clips of a library of some files, decoded."""
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch, "bench.mocapdb")
        jobs = None if scheduler else 1
        report = build_library(
            folder, path, SETTINGS, jobs=jobs, scheduler=scheduler, only=names.__contains__
        )
        if report.failed:
            sys.exit(f"{len(report.failed)} files cannot be built: {report.failed[0]}")
        with Library(path) as library:
            return {record.name: library.payload(record) for record in library.records()}


def timed(work: Callable[[], dict[str, bytes]]) -> tuple[dict[str, bytes], float, float]:
    """Return what some work gives, its seconds, and this process's processor seconds."""
    wall, own = time.perf_counter(), time.process_time()
    found = work()
    return found, time.perf_counter() - wall, time.process_time() - own


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--clips", type=int, default=80)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=1)
    options = parser.parse_args()
    folder = options.folder or corpus_or_exit()
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        print("no distributed: pip install 'mocapdb[distributed]'")
        return
    files = [path.relative_to(folder).as_posix() for path in motion_files(folder)]
    names = set(files[:: max(1, len(files) // options.clips)][: options.clips])
    few = set(sorted(names)[: 2 * options.workers])
    seconds = [0.0, 0.0]
    one = client_s = busiest_s = 0.0
    with (
        LocalCluster(
            n_workers=options.workers,
            threads_per_worker=1,
            dashboard_address=":0",
            env={"PYTHONPATH": os.pathsep.join(sys.path)},
        ) as cluster,
        Client(cluster) as client,
    ):
        address = cluster.scheduler_address
        for scheduler in (None, address):  # load what is compiled
            build(folder, few, scheduler)
        for _ in range(options.rounds):
            ours, wall, own = timed(lambda: build(folder, names, None))
            seconds[0] += wall
            one += own
            before = client.run(time.process_time)
            theirs, wall, own = timed(lambda: build(folder, names, address))
            after = client.run(time.process_time)
            seconds[1] += wall
            client_s += own
            busiest_s += max(after[worker] - before[worker] for worker in after)
            if ours != theirs:
                sys.exit("the two libraries differ")
    load = "/".join(f"{each:.1f}" for each in os.getloadavg())
    print(f"{len(names)} clips, {os.cpu_count()} processors, load {load}")
    print(f"one process       {seconds[0]:6.1f} s; processor {one:.1f} s")
    print(
        f"Dask, {options.workers} workers   {seconds[1]:6.1f} s; processor {busiest_s:.1f} s of "
        f"the busiest worker, {client_s:.1f} s of client and scheduler"
    )
    print(
        f"ratio {seconds[0] / seconds[1]:.2f} by time, {one / (busiest_s + client_s):.2f} by "
        "processor time; the payloads are equal to the byte"
    )


if __name__ == "__main__":
    main()
