"""A folder stored at several targets: bytes, ratios, processor time and worst joints, as a table.

python benchmarks/bench_folder.py FOLDER [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

TARGETS = (("--mean-mm", "1"), ("--max-mm", "1"), ("--max-mm", "10"), ("--error", "1"))
COLUMNS = ("target", "clips", "bytes", "a frame", "float32 / bytes", "files / bytes", "processor s",
           "frames a s", "mean mm", "worst mm", "worst joint", "over", "failed")  # fmt: skip


def mocapdb(*arguments: str) -> dict[str, Any]:
    """Return what a command says as JSON; a build with bad files says it too."""
    command = [sys.executable, "-m", "mocapdb", *arguments, "--json"]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    if not found.stdout:
        raise SystemExit(found.stderr)
    said: dict[str, Any] = json.loads(found.stdout)
    return said


def measured(folder: Path, target: tuple[str, str]) -> dict[str, Any]:
    """Return what a build of a folder at a target says, and the seconds of all processes."""
    with tempfile.TemporaryDirectory() as scratch:
        library = str(Path(scratch, "bench.mocapdb"))
        before = os.times()
        built = mocapdb("build", str(folder), "-o", library, *target)
        after = os.times()
        seconds = after.children_user - before.children_user
        seconds += after.children_system - before.children_system
        return {"target": " ".join(target), "processor_s": seconds, "build": built,
                "info": mocapdb("info", library)}  # fmt: skip


def table_row(said: dict[str, Any]) -> list[str]:
    """Return the cells of one target."""
    info, error, build = said["info"], said["info"]["error_mm"], said["build"]
    joints = info["joints"]
    least = min(joints, key=lambda joint: joint["kept"] / joint["swing"], default=None)
    worst = "none moves"
    if least is not None:
        share = 100 * least["kept"] / least["swing"]
        worst = f"{least['clip']} {least['joint']}: {share:.0f} % of {least['swing']:.1f}"
    return [
        said["target"], f"{info['clips']}", f"{info['payload_bytes']:,}",
        f"{info['bytes_per_frame']:.2f}", f"{info['ratio_float32']:.1f}",
        f"{info['ratio_source']:.1f}", f"{said['processor_s']:.0f}",
        f"{info['frames'] / said['processor_s']:.0f}", f"{error['mean']:.3f}",
        f"{error['max']:.2f}", worst, f"{len(build['unheld'])}", f"{len(build['failed'])}",
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--json", type=Path, help="where all that was said goes too")
    asked = parser.parse_args()
    print("| " + " | ".join(COLUMNS) + " |")
    print("| --- " * len(COLUMNS) + "|", flush=True)
    rows = []
    for target in TARGETS:
        rows.append(measured(asked.folder, target))
        print("| " + " | ".join(table_row(rows[-1])) + " |", flush=True)
        if asked.json:
            asked.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
