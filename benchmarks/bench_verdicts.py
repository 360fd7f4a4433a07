"""Whether storing changes what the commands say: clips before and after, at the default target.

Clips spread evenly over a folder are built into a library. Each is then asked about twice, as it
was read and as the library decodes it: the spans that `clean` flags, the period that `cycle` finds,
the hits of `query` in that library and the class of `classify`.

python benchmarks/bench_verdicts.py [FOLDER] [--clips 60] [--frames 2400]
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

from _corpus import corpus_or_exit, motion_files

from mocapdb.cleaning import detect_faults
from mocapdb.compression import Target
from mocapdb.cycles import extract_cycle
from mocapdb.errors import MocapdbError
from mocapdb.io import read_clip
from mocapdb.library import BuildSettings, Library, build_library
from mocapdb.library.searching.retrieval import Retrieval
from mocapdb.motion.clip import Clip

DEFAULT = Target("mean_mm", 1.0)
AGREES = 0.5  # intersection over union
SAME_PERIOD = 0.01
HITS = 5

Span = tuple[str, str, int, int]


def spans(clip: Clip) -> list[Span]:
    found = detect_faults(clip).spans
    names = clip.skeleton.names
    return [(names[span.joint], span.kind, span.start, span.end) for span in found]


def agree(span: Span, others: list[Span]) -> bool:
    """Say whether another span of the same joint covers about the same frames."""
    for joint, _, start, end in others:
        common = min(end, span[3]) - max(start, span[2])
        if joint == span[0] and common >= AGREES * (max(end, span[3]) - min(start, span[2])):
            return True
    return False


def period_s(clip: Clip) -> float | None:
    """Return the period of a clip's cycle, or None where it has none."""
    try:
        return float(extract_cycle(clip).cycle.period_s)
    except MocapdbError:
        return None


def same_period(before: float | None, after: float | None) -> bool:
    if before is None or after is None:
        return before is after
    return abs(after / before - 1.0) <= SAME_PERIOD


def answers(retrieval: Retrieval, clip: Clip) -> tuple[list[str], str | None]:
    """Return the clips that a query hits, and the class."""
    try:
        hits = [hit.record.name for hit in retrieval.query(clip, k=HITS)]
        return hits, retrieval.classify(clip).label
    except MocapdbError as problem:
        return [str(problem)], None


def build(folder: Path, files: list[Path], path: Path) -> Library:
    """Build some files of a folder, with the skeletons and settings that stand beside them."""
    with tempfile.TemporaryDirectory() as chosen:
        beside = [*folder.rglob("*.asf"), *folder.rglob("*.toml"), *folder.glob("LABELS.csv")]
        for source in (*files, *beside):
            copy = Path(chosen, source.relative_to(folder))
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, copy)
        labels = Path(chosen, "LABELS.csv")
        build_library(
            chosen, path, BuildSettings(DEFAULT), labels=labels if labels.is_file() else None
        )
    return Library(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--clips", type=int, default=60)
    parser.add_argument("--frames", type=int, default=2_400, help="how much of each is looked at")
    given = parser.parse_args()
    folder = given.folder or corpus_or_exit()
    files = motion_files(folder)
    files = files[:: max(1, len(files) // given.clips)]
    n_alike, n_asked, differences = Counter[str](), Counter[str](), list[str]()
    with tempfile.TemporaryDirectory() as scratch:
        library = build(folder, files, Path(scratch, "verdicts.mocapdb"))
        retrieval = Retrieval(library)
        sources = {Path(record.source).as_posix(): record.name for record in library.records()}
        for file in files:
            name = sources.get(file.relative_to(folder).as_posix())
            if name is None:
                print(f"left out {file.name}: it was not built", file=sys.stderr)
                continue
            decoded = library.clip(name)[: given.frames]
            clip = read_clip(file)
            clip = clip[len(clip) - library.record(name).frames :][: given.frames]
            before, after = spans(clip), spans(decoded)
            for these, others, what in ((before, after, "lost"), (after, before, "new")):
                n_asked["clean"] += len(these)
                for span in these:
                    if agree(span, others):
                        n_alike["clean"] += 1
                    else:
                        differences.append(f"{name} {what} {span}")
            hits, label = answers(retrieval, clip)
            decoded_hits, decoded_label = answers(retrieval, decoded)
            asked = {
                "cycle": same_period(period_s(clip), period_s(decoded)),
                "query": hits == decoded_hits,
                "first hit": hits[0] == decoded_hits[0],
                "classify": label == decoded_label,
            }
            for what, is_same in asked.items():
                n_asked[what] += 1
                n_alike[what] += is_same
                if not is_same:
                    differences.append(f"{name} {what}")
            print(name, dict(n_alike), dict(n_asked), file=sys.stderr, flush=True)
        library.close()
    print("\n".join(differences))
    for what, count in n_asked.items():
        print(f"{what}: {n_alike[what]} of {count} alike, {100 * n_alike[what] / count:.1f} %")


if __name__ == "__main__":
    main()
