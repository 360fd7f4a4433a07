"""Flip single bits all over a library and see whether each is found, or harmless.

    python tests/flips.py --flips 2000

Every file of a small library is divided into regions, and they take turns. After a flip `verify`
looks; where it says nothing, everything that the library can be asked is asked, and has to be
answered as before. A refusal in plain words counts as found; any other error as a fault.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from mocapdb.corpus import synthetic
from mocapdb.cycles.class_cycle import average_cycles
from mocapdb.cycles.extract import extract_cycle
from mocapdb.errors import MocapdbError
from mocapdb.io import write_clip
from mocapdb.library import (
    BuildSettings,
    Library,
    Retrieval,
    build_library,
    verify_library,
)
from mocapdb.library.cycles_file import list_cycles, read_cycle, write_cycle

REGIONS = 40
"""Of each file."""


def make_library(folder: Path) -> Path:
    """Build a library with all that a library can have: index, classes, and a kept cycle."""
    from mocapdb.compression import Target

    corpus, library = folder / "corpus", folder / "l.mocapdb"
    for kind in ("walk", "run"):
        for subject in (1, 2):
            path = corpus / kind / f"{subject:02d}_{kind}.bvh"
            path.parent.mkdir(parents=True, exist_ok=True)
            skeleton = synthetic.make_skeleton(1.6 + subject / 10)
            clip = synthetic.make_clip(kind, seed=subject, skeleton=skeleton, duration_s=3.0)
            write_clip(clip, path)
    build_library(corpus, library, BuildSettings(Target("mean_mm", 2.0)), jobs=1)
    with Library(library) as opened:
        cycle = extract_cycle(opened.clip("01_walk")).cycle
    write_cycle(library, average_cycles([cycle], "walk"))
    return library


def answers(library: Path) -> str:
    """Return all that a library says of itself and its clips."""
    told: list[object] = []
    with Library(library) as opened:
        told.append([sorted(vars(record).items()) for record in opened.records()])
        told.append(opened.info())
        told.append([opened.info(record.name) for record in opened.records()])
        told.append([hash(clip.channels.tobytes()) for clip in opened])
        told.append([record.name for record in opened.records(search="walk")])
        retrieval = Retrieval(opened)
        hits = retrieval.query(["01_walk"], k=3)
        told.append([(hit.record.name, hit.start, hit.end, hit.distance) for hit in hits])
        found = retrieval.classify(opened.clip("02_run"))
        told.append(sorted((key, str(value)) for key, value in vars(found).items()))
        for row in list_cycles(library):
            kept = read_cycle(library, row["class"])
            told.append([vars(kept.cycle), kept.members, kept.spread_rad.tolist()])
    return repr(told)


def outcome(library: Path, before: str) -> str:
    """Return ``found``, ``harmless``, ``WRONG``, or the error that is none of ours."""
    try:
        with Library(library) as opened:
            report = verify_library(opened)
        if report["bad"] or report["shards"]:
            return "found"
        return "harmless" if answers(library) == before else "WRONG"
    except MocapdbError:
        return "found"
    except Exception as problem:
        return f"FAULT {type(problem).__name__}: {problem}"


def flips(library: Path, count: int, seed: int) -> Iterator[tuple[str, int, str]]:
    """Flip bits, one at a time; yield the file, the place in bits, and what came of it."""
    chance = random.Random(seed)
    before = answers(library)
    files = sorted(path for path in library.rglob("*") if path.is_file() and path.stat().st_size)
    content = {path: path.read_bytes() for path in files}
    regions = [(path, region) for region in range(REGIONS) for path in files]
    for i in range(count):
        path, region = regions[i % len(regions)]
        whole = content[path]
        first, end = (len(whole) * n // REGIONS for n in (region, region + 1))
        bit = chance.randrange(8 * first, max(8 * end, 8 * first + 1))
        changed = bytearray(whole)
        changed[bit // 8] ^= 1 << bit % 8
        path.write_bytes(changed)
        found = outcome(library, before)
        for log in library.glob("catalogue.db-*"):
            with suppress(FileNotFoundError):
                log.unlink()
        for each, kept in content.items():
            if each.read_bytes() != kept:
                each.write_bytes(kept)
        yield path.relative_to(library).as_posix(), bit, found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--flips", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    started = time.process_time()
    counts: dict[str, Counter[str]] = {}
    with tempfile.TemporaryDirectory() as folder:
        library = make_library(Path(folder))
        for file, bit, found in flips(library, asked.flips, asked.seed):
            if found not in ("found", "harmless"):
                print(f"{file}, bit {bit}: {found}", flush=True)
            counts.setdefault(file, Counter())[found.split()[0]] += 1
    total: Counter[str] = Counter()
    for file, own in sorted(counts.items()):
        print(f"{file:22}", ", ".join(f"{count} {what}" for what, count in own.most_common()))
        total += own
    print("all", dict(total), f"in {time.process_time() - started:.0f} s of processor time")
    return int(set(total) > {"found", "harmless"})


if __name__ == "__main__":
    sys.exit(main())
