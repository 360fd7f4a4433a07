"""What a library costs as it grows: opening, listing, building with nothing to do, adding one clip.

python benchmarks/bench_growth.py [--clips 300 1000 3000 10000 30000 100000]

A few synthetic clips of 30 frames are built, and their rows, payloads, features and places in the
index repeated under other names, each with a file of its own: what is measured does not depend on
what moves in a clip. Times are processor time, user and system, of a command from its start to its
end; memory is the most that it held at once.
"""

from __future__ import annotations

import argparse
import hashlib
import math
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from mocapdb import BuildSettings, Target, build_library
from mocapdb.corpus import synthetic
from mocapdb.io import write_clip
from mocapdb.library import Library
from mocapdb.library.building.file_states import FileStates
from mocapdb.library.index_pieces import PARTS, stored_index
from mocapdb.library.layout import FEATURES_FOLDER, SHARDS_FOLDER
from mocapdb.library.searching.canonical_shards import FeatureReader, commit_features
from mocapdb.library.shard_entries import clip_entry
from mocapdb.library.writing.catalogue_writer import CatalogueWriter
from mocapdb.library.writing.index_writer import append_clips, next_number
from mocapdb.library.writing.open_for_writing import open_for_writing
from mocapdb.library.writing.pack_shards import Stored, packed_shard

KINDS = ("walk", "run", "hop", "box", "wave", "squat")
SUBJECTS = 4
AT_ONCE = 500
A_FOLDER = 1000  # files
LABEL = "mixed"  # which no class is learned from: that takes 3 ms a clip, whenever it is done
SETTINGS = BuildSettings(Target("mean_mm", 2.0))
OPEN = "import sys, mocapdb; mocapdb.Library(sys.argv[1]).close()"
SEARCHABLE = """
import sys
from mocapdb.library import Library, Retrieval
with Library(sys.argv[1]) as library:
    Retrieval(library)
"""
CHECK = "import sys, mocapdb; assert not mocapdb.Library(sys.argv[1]).catalogue.check()"
BUILD = """
import sys
from mocapdb import BuildSettings, Target, build_library
settings = BuildSettings(Target("mean_mm", 2.0))
rehash = sys.argv[3] == "rehash"
report = build_library(sys.argv[1], sys.argv[2], settings, jobs=1, rehash=rehash)
assert report.built <= 1 and not report.failed, (report.built, report.failed[:3])
assert rehash or report.hashed <= 1, report.hashed
print(open("/proc/self/status").read().split("VmHWM:")[1].split()[0])  # the most memory, kB
"""


def write_seeds(corpus: Path) -> list[Path]:
    """Write the clips that all others repeat, in folders of their classes."""
    files = []
    for kind in KINDS:
        for subject in range(SUBJECTS):
            path = corpus / kind / f"s{subject:02d}_{kind}_0.bvh"
            path.parent.mkdir(parents=True, exist_ok=True)
            skeleton = synthetic.make_skeleton(1.6 + subject / 20)
            clip = synthetic.make_clip(kind, seed=subject, skeleton=skeleton, duration_s=0.5)
            write_clip(clip[:30], path)
            files.append(path)
    return files


def repeat(corpus: Path, seed: Path, number: int) -> Path:
    """Write a file again under another name; it differs in the white space at its end."""
    path = corpus / f"{number // A_FOLDER:03d}" / LABEL / f"{seed.stem[:-1]}{number}.bvh"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(seed.read_bytes() + f"\n{number:b}".translate({48: " ", 49: "\n"}).encode())
    return path


def grow(library: Path, corpus: Path, seeds: list[Path], n_clips: int) -> None:
    """Repeat clips of a library, and their files, until it has so many."""
    with Library(library) as opened, open_for_writing(library) as catalogue:
        records = {record.source: record for record in opened.records()}
        own = [records[path.relative_to(corpus).as_posix()] for path in seeds]
        rows = [catalogue.row("clips", record.id) for record in own]
        payloads = [opened.stored_payload(record) for record in own]
        skeletons = [opened.skeleton(record) for record in own]
        bones = {row[0]: row[1] for row in catalogue.columns(["clips.id", "bones"])}
        places = {clip: (file, row) for clip, file, row in catalogue.feature_places()}
        features = []
        for record in own:
            file, place = places[record.id]
            features.append(FeatureReader(library / FEATURES_FOLDER / file).packed(place))
        facets, errors = catalogue.facets(), catalogue.joint_errors()
        have = len(records)
        of_seed = {record.id: record.id for record in own}
        sources = {record.id: record.source for record in own}
        while have < n_clips:
            count = min(AT_ONCE, n_clips - have)
            chosen = [(have + i) % len(seeds) for i in range(count)]
            stored, new = [], []
            for i, seed in enumerate(chosen):
                path = repeat(corpus, seeds[seed], have + i)
                digest = hashlib.sha256(hashlib.sha256(path.read_bytes()).digest()).hexdigest()
                row = rows[seed] | {
                    "name": path.stem,
                    "stem": path.stem,
                    "label": LABEL,
                    "source": path.relative_to(corpus).as_posix(),
                    "source_bytes": path.stat().st_size,
                    "source_sha256": digest,
                }
                entry = clip_entry(row, skeletons[seed].digest, errors[own[seed].id])
                stored.append(Stored(payloads[seed], digest, entry, skeletons[seed]))
                new.append(row)
            measured = [(facets.get(own[seed].id), errors[own[seed].id]) for seed in chosen]
            ids = _commit(catalogue, stored, new, [features[seed] for seed in chosen], measured)
            for clip_id, seed, row in zip(ids, chosen, new, strict=True):
                of_seed[clip_id] = own[seed].id
                sources[clip_id] = row["source"]
            have += count
        time.sleep(2.5)  # files that were just written are not trusted to look as they do
        states = FileStates(corpus)
        with catalogue.transaction():
            catalogue.keep_seen(
                {
                    clip_id: (states.of(source, None)[0], bones[of_seed[clip_id]])
                    for clip_id, source in sources.items()
                }
            )
            catalogue.keep_learned()
        _repeat_index(catalogue, of_seed, n_clips)


def _repeat_index(catalogue: CatalogueWriter, of_seed: dict[int, int], n_clips: int) -> None:
    """Give each new clip the place in the index that its seed has."""
    index = stored_index(catalogue)
    entries = index.entries()
    frames = np.concatenate([[0], np.cumsum(entries["frames"].astype(int))])
    sketch = np.concatenate([[0], np.cumsum(-(-entries["frames"].astype(int) // 3))])
    clips = np.arange(len(entries) + 1)
    starts = dict.fromkeys(PARTS, clips) | {"frames": frames, "turns": frames, "sketch": sketch}
    mapped = {part: np.array(index.mapped(part)) for part in PARTS}
    place = {int(clip): i for i, clip in enumerate(entries["clip"])}

    def of_clip(clip: int, seed: int) -> dict[str, np.ndarray]:
        i = place[seed]
        own = {part: mapped[part][slice(*starts[part][i : i + 2])] for part in PARTS}
        entry = entries[i : i + 1].copy()
        entry["clip"] = clip
        return own | {"clips": entry}

    every = {int(clip): int(clip) for clip in entries["clip"]} | of_seed
    anew = replace(index, number=next_number(catalogue), fitted=n_clips, pieces=())
    append_clips(catalogue, anew, (of_clip(*pair) for pair in sorted(every.items())))


def _commit(catalogue: CatalogueWriter, stored, rows, features, measured) -> list[int]:
    with catalogue.transaction():
        shard_id = catalogue.add_shard(SHARDS_FOLDER, packed_shard(catalogue, stored))
        ids = []
        for place, row in enumerate(rows):
            own = {name: value for name, value in row.items() if name != "id"}
            ids.append(catalogue.insert("clips", own | {"shard_id": shard_id, "shard_row": place}))
        commit_features(catalogue, [(i, own, None) for i, own in zip(ids, features, strict=True)])
        for clip_id, (facets, errors) in zip(ids, measured, strict=True):
            catalogue.add_joint_errors(clip_id, errors)
            if facets is not None:
                catalogue.add_facets({clip_id: facets})
    return ids


def cost(arguments: list[object]) -> tuple[float, str]:
    """Run Python; return the seconds of processor time that it took, and what it printed."""
    with (
        tempfile.TemporaryFile() as printed,
        subprocess.Popen(
            [sys.executable, *map(str, arguments)], stdout=printed, stderr=subprocess.PIPE
        ) as process,
    ):
        errors = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0, errors.decode()
        printed.seek(0)
        return usage.ru_utime + usage.ru_stime, printed.read().decode()


def exponent(sizes: list[int], values: list[float]) -> float:
    """Return the power of the size that values grow by, from the larger half of the sizes."""
    half = slice(len(sizes) // 2 - 1, None)
    x, y = np.log(sizes[half]), np.log(np.maximum(values[half], 1e-3))
    return float(np.polyfit(x, y, 1)[0]) if len(x) > 1 else math.nan


def main() -> None:
    parser = argparse.ArgumentParser()
    sizes = [300, 1000, 3000, 10000, 30000, 100000]
    parser.add_argument("--clips", type=int, nargs="+", default=sizes)
    asked = parser.parse_args()
    told: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as work:
        corpus, library, alone = (Path(work, name) for name in ("corpus", "l.mocapdb", "alone"))
        seeds = write_seeds(corpus)
        build_library(corpus, library, SETTINGS, jobs=1)
        for number, n_clips in enumerate(asked.clips):
            started = time.process_time()
            grow(library, corpus, seeds, n_clips)
            # which plans all of them: what follows has a build before it, as it has in use
            build_library(corpus, library, SETTINGS, jobs=1)
            print(f"{n_clips:7} made in {time.process_time() - started:6.1f} s", flush=True)
            clip = synthetic.make_clip("walk", seed=1000 + n_clips, duration_s=0.25)
            (alone / str(number)).mkdir(parents=True)
            write_clip(clip, alone / str(number) / "new.bvh")
            commands = {
                "import": ["-c", "import mocapdb.cli, mocapdb.library.library"],
                "open": ["-c", OPEN, library],
                "open to search": ["-c", SEARCHABLE, library],
                "info": ["-m", "mocapdb", "info", library],
                "ls": ["-m", "mocapdb", "ls", library],
                "build nothing": ["-c", BUILD, corpus, library, ""],
                "build rehash": ["-c", BUILD, corpus, library, "rehash"],
                "one clip alone": ["-c", BUILD, alone / str(number), Path(work, f"{number}.l"), ""],
                "build one": ["-c", BUILD, corpus, library, ""],
                "check catalogue": ["-c", CHECK, library],
            }
            for what, arguments in commands.items():
                if what == "build one":
                    write_clip(clip, corpus / "000" / LABEL / f"s99_walk_{n_clips}.bvh")
                seconds, printed = cost(arguments)
                told.setdefault(what, []).append(seconds)
                if what in ("build nothing", "build one"):
                    told.setdefault(f"{what}, MB", []).append(int(printed) / 1024)
                print(f"{n_clips:7} {what:16} {seconds:6.2f} s", flush=True)
        print(f"\n{'':20}" + "".join(f"{n:>9}" for n in asked.clips) + "   exponent")
        for what, values in told.items():
            cells = "".join(f"{value:9.2f}" for value in values)
            print(f"{what:20}{cells} {exponent(asked.clips, values):10.2f}")


if __name__ == "__main__":
    main()
