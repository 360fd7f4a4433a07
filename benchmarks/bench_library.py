"""A library of the whole corpus: time, memory, size, errors; and how quickly the command starts.

python benchmarks/bench_library.py
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median

from _corpus import corpus_or_exit

from mocapdb import Library

ERROR = 1.0
START_UPS = 9


def main() -> None:
    for what, code in (
        ("python -c 'import mocapdb'", ["-c", "import mocapdb"]),
        ("mocapdb --help", ["-m", "mocapdb", "--help"]),
        ("python -c pass", ["-c", "pass"]),
    ):
        print(f"{what:<28} {start_up(code):.3f} s (median of {START_UPS})")

    corpus = corpus_or_exit()
    with tempfile.TemporaryDirectory() as work:
        library = Path(work) / "corpus.mocapdb"
        command = ["build", str(corpus), "-o", str(library), "--error", str(ERROR), "--json"]
        for what in ("first build", "second build"):
            report, seconds, peak = run(command)
            print(
                f"{what:<28} {seconds:.1f} s, {peak / 2**20:.0f} MB at most over all processes; "
                f"built {report['built']}, skipped {report['skipped']}, "
                f"failed {len(report['failed'])}"
            )
        with Library(library) as opened:
            figures = opened.info()
            over = [r.name for r in opened.records() if r.skinned_error > ERROR]
        payload, index = figures["payload_bytes"], figures["index_bytes"]
        disk = figures["disk_bytes"] - index
        print(
            f"{'size':<28} {payload:,} bytes of payload ({figures['bytes_per_frame']:.1f} a frame, "
            f"{figures['ratio_float32']:.1f} x less than float32 channels), {disk:,} on disk "
            f"({100 * (disk / payload - 1):+.1f} %), and {index:,} for queries and classes "
            f"({index / figures['frames']:.1f} a frame)"
        )
        print(
            f"{'skinned error':<28} {figures['skinned_error']:.3f} in the mean, "
            f"{figures['skinned_error_max']:.3f} at most; over {ERROR}: {over or 'none'}"
        )


def start_up(arguments: list[str]) -> float:
    seconds = []
    for _ in range(START_UPS):
        start = time.perf_counter()
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
        seconds.append(time.perf_counter() - start)
    return median(seconds)


def run(arguments: list[str]) -> tuple[dict, float, int]:
    """Run a mocapdb command; return its JSON, its seconds, and the peak of its memory in bytes."""
    start = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "mocapdb", *arguments], stdout=subprocess.PIPE, text=True
    )
    peak = 0

    def watch() -> None:
        nonlocal peak
        while process.poll() is None:
            peak = max(peak, memory_of_tree(process.pid))
            time.sleep(0.05)

    watcher = threading.Thread(target=watch)
    watcher.start()
    output, _ = process.communicate()
    watcher.join()
    return json.loads(output), time.perf_counter() - start, peak


def memory_of_tree(pid: int) -> int:
    """Proportional set size of a process and all below it, in bytes: shared pages count once."""
    total, waiting = 0, [pid]
    while waiting:
        process = Path("/proc") / str(waiting.pop())
        try:
            for line in (process / "smaps_rollup").read_text().splitlines():
                if line.startswith("Pss:"):
                    total += int(line.split()[1]) * 1024
            for task in (process / "task").iterdir():
                waiting += map(int, (task / "children").read_text().split())
        except OSError:  # it has ended meanwhile
            continue
    return total


if __name__ == "__main__":
    main()
