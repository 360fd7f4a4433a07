"""Queries by example: what they find, and how fast.

python benchmarks/bench_query.py [--scale N]

The corpus part leaves out the query's own clip and everything else by its subject. A clip counts as
found by its class; where CMU's line of text leaves open whether a clip holds the class (a dance has
steps of a walk, an uneven walk has leaps) it counts neither way: see `NEUTRAL`. The speed part
repeats the corpus with perturbation up to N frames of 24 fps (850,000: all of CMU's database).
"""

from __future__ import annotations

import argparse
import csv
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
from _corpus import corpus_or_exit

from mocapdb import read_clip
from mocapdb.indexing import MotionIndex, Query, canonical_motion
from mocapdb.indexing.canonical import FPS, CanonicalMotion
from mocapdb.indexing.features import FeatureSpace
from mocapdb.indexing.search import MIN_QUERY_S, _search, search
from mocapdb.indexing.whole import whole_distances
from mocapdb.library.naming import subject_of

QUERY_S = 2.0
PER_CLASS = 16
SPEEDS = (1.0, 0.5, 0.67, 1.5, 2.0)
HDM05 = {
    "jogLeftCircle4StepsRstart": "run",
    "hopBothLegs1hops": "hop",
    "squat1Reps": "squat",
    "kickLFront1Reps": "kick",
    "rotateArmsBothBackward1Reps": "arms",
}
PLAIN_WALKS = {"walk", "slow walk", "walk/stride", "start walk stop"}
SEVERAL_ACTIONS = {"dance", "other", "playground", "salsa"}
# classes that may well hold some of the queried motion, and so are neither right nor wrong
NEUTRAL = {
    "walk": {"", "uneven walk", "sneak2StepsLStart", "throwBasketball", "depositFloorR",
             "grabHighR", "hop"},
    "run": {""}, "hop": {""}, "squat": {""}, "kick": {""}, "arms": {""},
}  # fmt: skip


@dataclass(frozen=True)
class Item:
    """A clip of the corpus: its name, class ("" where that is open), family, and motion."""

    name: str
    label: str
    hdm05_class: str
    subject: str
    family: str
    motion: CanonicalMotion


def read_items(corpus: Path) -> list[Item]:
    items = []
    for row in csv.DictReader((corpus / "LABELS.csv").open(encoding="utf-8")):
        skeleton = corpus / row["skeleton"] if row["skeleton"] else None
        fps = float(row["fps"]) if row["format"] == "amc" else None
        clip = read_clip(corpus / row["path"], skeleton=skeleton, fps=fps, drop_tpose=True)
        hdm05 = row["path"].startswith("hdm05")
        family = "hdm05" if hdm05 else row["path"].split("/")[1]
        items.append(
            Item(
                row["clip"],
                truth(row, hdm05),
                row["label"] if hdm05 else "",
                subject_of(row["clip"]),
                family,
                canonical_motion(clip),
            )
        )
    return items


def truth(row: dict[str, str], hdm05: bool) -> str:
    label, text = row["label"], row["description"].lower()
    if hdm05:
        return HDM05.get(label, label)
    if label == "walk":
        return "walk" if text in PLAIN_WALKS else "uneven walk"
    if label == "run":
        return "run" if text.startswith("run") else ""
    if label == "jump":
        return "" if "jacks" in text or "grab" in text else "hop"
    if "kick" in text:
        return "kick"
    return "" if label in SEVERAL_ACTIONS else label


# -- what is found ---------------------------------------------------------------------------------


def whole_clips(items: list[Item]) -> None:
    items = [item for item in items if item.hdm05_class]
    labels = np.array([item.hdm05_class for item in items])
    subjects = np.array([item.subject for item in items])
    index = MotionIndex.of([item.motion for item in items])
    for expand in (0, 2):
        precisions, first = [], []
        for i, item in enumerate(items):
            others = subjects != subjects[i]
            distances = whole_distances(index, item.motion, others, expand)
            right = labels[np.argsort(distances, kind="stable")[: others.sum()]] == labels[i]
            precisions.append(average_precision(right))
            first.append(right[0])
        print(
            f"whole clips, HDM05 across actors, expand {expand}: "
            f"mAP {np.mean(precisions):.3f}, nearest right {np.mean(first):.1%}"
        )


def stretches(items: list[Item]) -> None:
    index = MotionIndex.of([item.motion for item in items])
    labels = np.array([item.label for item in items])
    subjects = np.array([item.subject for item in items])
    queries = []
    rng = np.random.default_rng(0)
    for label in NEUTRAL:
        fitting = [
            i for i, item in enumerate(items)
            if item.label == label and item.family != "bvh_daz"
        ]  # fmt: skip
        queries += list(rng.permutation(fitting)[:PER_CLASS])
    print(f"stretches: {len(queries)} queries of {QUERY_S:g} s or the whole clip, every frame of")
    print(f"  {len(items)} clips; a clip's rank is that of its best stretch")
    for speed in SPEEDS:
        found: dict[str, list[tuple[float, float, float]]] = {}
        for i in queries:
            label = items[i].label
            example = liveliest(items[i].motion, label).resampled(FPS, speed)
            if len(example) < MIN_QUERY_S * FPS:
                continue
            neutral = np.isin(labels, list(NEUTRAL[label]))
            allowed = (subjects != subjects[i]) & ~neutral
            best = np.full(len(items), np.inf)
            costs = distances_of_clips(index, Query([example]))
            best[allowed] = costs[allowed]
            order = np.argsort(best, kind="stable")[: np.isfinite(best).sum()]
            right = labels[order] == label
            if right.any():
                five = right[: min(5, int(right.sum()))].mean()
                found.setdefault(label, []).append((average_precision(right), right[0], five))
        every = np.array([row for rows in found.values() for row in rows])
        print(
            f"  x{speed:<4g} AP {every[:, 0].mean():.3f}, first right {every[:, 1].mean():.3f}, "
            f"first five {every[:, 2].mean():.3f}   "
            + "  ".join(f"{k} {np.mean([r[0] for r in v]):.2f}" for k, v in found.items())
        )


def distances_of_clips(index: MotionIndex, query: Query) -> np.ndarray:
    """Return the distance of the best stretch of each clip."""
    from concurrent.futures import ThreadPoolExecutor

    from mocapdb.indexing.search import normalised_costs, with_references

    with ThreadPoolExecutor(2) as pool:
        templates = with_references(index, query.templates(index.space), pool)
    costs = normalised_costs(index, templates, 0, index.n_frames)
    return np.minimum.reduceat(costs, index.starts[:-1])


def liveliest(motion: CanonicalMotion, label: str) -> CanonicalMotion:
    """Return the 2 s of a motion to query with: the middle; of jumps and kicks, where they are."""
    n = int(QUERY_S * FPS)
    if len(motion) <= n:
        return motion
    first = (len(motion) - n) // 2
    if label in ("hop", "kick"):
        moved = np.abs(np.diff(motion.root[:, 1]))
        if label == "kick":
            moved = np.linalg.norm(np.diff(motion.pose, axis=0), axis=2).max(axis=1)
        first = int(np.convolve(moved, np.ones(n - 1), "valid").argmax())
    own = slice(first, first + n)
    return CanonicalMotion(motion.pose[own], motion.root[own], motion.yaw[own], motion.fps)


def average_precision(right: np.ndarray) -> float:
    found = np.cumsum(right)
    return float((found / np.arange(1, len(right) + 1))[right].mean())


# -- how fast --------------------------------------------------------------------------------------


def enlarged(items: list[Item], n_frames: int) -> MotionIndex:
    """Return an index of about n frames: the corpus again and again, each time a little changed."""
    rng = np.random.default_rng(1)
    motions = [item.motion for item in items]
    space = FeatureSpace.fit(motions)
    once = MotionIndex.of(motions, space)
    times = max(1, -(-n_frames // once.n_frames))
    frames = np.empty((times * once.n_frames, space.n_dims), dtype=np.float32)
    lengths = np.tile(np.diff(once.starts), times)
    for i in range(times):
        own = slice(i * once.n_frames, (i + 1) * once.n_frames)
        shift = rng.normal(0, 0.05, space.n_dims) if i else 0.0
        noise = rng.normal(0, 0.01, once.frames.shape) if i else 0.0
        frames[own] = once.frames + shift + noise
    index = MotionIndex(space, frames, np.concatenate([[0], np.cumsum(lengths)]))
    keep = int(np.searchsorted(index.starts, n_frames, side="right")) - 1
    index = MotionIndex(space, frames[: index.starts[keep]], index.starts[: keep + 1])
    _ = index.norms, index.is_start  # a library has them on disk
    return index


def timed(run, repeats: int = 9) -> float:
    run()
    seconds = []
    for _ in range(repeats):
        started = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - started)
    return median(seconds)


def speed(items: list[Item], n_frames: int) -> None:
    motion = next(item.motion for item in items if item.name == "35_17")
    n = int(1.5 * FPS)
    example = CanonicalMotion(motion.pose[:n], motion.root[:n], motion.yaw[:n], FPS)
    query = Query([example])
    sizes = [n_frames // 16, n_frames // 8, n_frames // 4, n_frames // 2, n_frames]
    times = []
    for size in sizes:
        index = enlarged(items, size)
        own = timed(lambda index=index: search(index, query, k=10, threads=2))
        times.append(own)
        print(f"search: {index.n_frames:8,} frames, 1.5 s query, two threads: {1000 * own:6.1f} ms")
    exponent = np.polyfit(np.log(sizes), np.log(times), 1)[0]
    print(f"search: time grows as frames to the power {exponent:.2f}")
    one = timed(lambda: search(index, query, k=10, threads=1))
    everything = np.ones(len(index), dtype=np.bool_)
    plain = query.templates(index.space)[:1]
    single = timed(lambda: _search(index, plain, 10, everything, np.inf, 2))
    print(f"search: one thread {1000 * one:.1f} ms; at the query's own speed only, two threads ")
    print(f"        {1000 * single:.1f} ms")
    peers(index, plain[0].frames, times[-1])


def peers(index: MotionIndex, frames: np.ndarray, ours: float) -> None:
    """Time other libraries on the same frames; they are in the extra ``bench``."""
    library = np.ascontiguousarray(index.frames.T, dtype=np.float64)
    own = np.ascontiguousarray(frames.T, dtype=np.float64)
    try:
        import stumpy
    except ImportError:
        print("stumpy is not installed")
    else:

        def sum_of_profiles() -> np.ndarray:
            squares = np.zeros(library.shape[1] - own.shape[1] + 1)
            for q, t in zip(own, library, strict=True):
                squares += stumpy.mass(q, t, normalize=False) ** 2
            return squares

        seconds = timed(sum_of_profiles, 3)
        print(f"stumpy.mass, 32 axes, no warping: {1000 * seconds:.0f} ms, {seconds / ours:.1f} x")
    try:
        from dtaidistance.subsequence.dtw import subsequence_alignment
    except ImportError:
        print("dtaidistance is not installed")
    else:
        query, series = np.ascontiguousarray(own.T), np.ascontiguousarray(library.T)

        def align() -> None:
            subsequence_alignment(query, series, use_c=True).best_match()

        seconds = timed(align, 1)
        print(f"dtaidistance subsequence DTW in C: {1000 * seconds:.0f} ms, {seconds / ours:.1f} x")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--scale", type=int, default=850_000, help="frames to time on")
    parser.add_argument("--only", choices=["find", "speed"])
    options = parser.parse_args()
    items = read_items(corpus_or_exit())
    if options.only != "speed":
        whole_clips(items)
        stretches(items)
    if options.only != "find":
        speed(items, options.scale)


if __name__ == "__main__":
    main()
