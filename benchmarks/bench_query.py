"""Queries by example: what they find, and how fast.

python benchmarks/bench_query.py [--scale N] [--only find|exercises|speed] [--plot FILE]

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
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np
from _corpus import corpus_or_exit
from sklearn.metrics import average_precision_score

from mocapdb import read_clip
from mocapdb.indexing import MotionIndex, Query, Weights, canonical_motion
from mocapdb.indexing.canonical.canonical_motion import FPS, CanonicalMotion
from mocapdb.indexing.search.body_parts import index_of_part, part_joints
from mocapdb.indexing.search.clip_search import whole_distances
from mocapdb.indexing.search.features import FeatureSpace
from mocapdb.indexing.search.frame_store import index_of
from mocapdb.indexing.search.span_scan import distances, measured
from mocapdb.indexing.search.stretch_search import Stretch, search
from mocapdb.indexing.tuning import MIN_QUERY_S
from mocapdb.library.naming import subject_of

QUERY_S = 2.0
N_QUERIES = 8
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
EXERCISES = {
    "13_29": {"jacks": [(0, 96)], "twist": [(100, 228)], "arms": [(240, 384)],
              "bend": [(384, 528)], "knee": [(562, 756)], "squat": [(756, 900)]},
    "13_30": {"jacks": [(0, 48)], "twist": [(48, 156)], "knee": [(166, 280)],
              "squat": [(288, 388)], "jog": [(390, 478)]},
    "13_31": {"twist": [(8, 84), (280, 318)], "knee": [(84, 192)], "bend": [(194, 272)],
              "jog": [(320, 420)], "arms": [(424, 528)], "jacks": [(544, 604)]},
}  # fmt: skip
"""Frames at 24 fps, from where to where: read by eye from heights of hands, feet and hips."""

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
    named = [item for item in items if item.hdm05_class]
    whole_clips_of("HDM05 across actors", named, [item.hdm05_class for item in named])
    named = [item for item in items if item.family != "hdm05" and item.label]
    whole_clips_of("CMU across subjects", named, [item.label for item in named])


def whole_clips_of(where: str, items: list[Item], classes: list[str]) -> None:
    labels, subjects = np.array(classes), np.array([item.subject for item in items])
    index = MotionIndex.of([item.motion for item in items])
    for expand in (0, 2):
        precisions, first = [], []
        for i, item in enumerate(items):
            others = subjects != subjects[i]
            if labels[i] not in labels[others]:
                continue
            distances = whole_distances(index, item.motion, others, expand)
            right = labels[np.argsort(distances, kind="stable")[: others.sum()]] == labels[i]
            precisions.append(average_precision(right))
            first.append(right[0])
        print(
            f"whole clips, {where}, expand {expand}: mAP {np.mean(precisions):.3f}, "
            f"nearest right {np.mean(first):.1%} of {len(first)}"
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
    for speed, strict in [*((speed, False) for speed in SPEEDS), (1.0, True)]:
        found: dict[str, list[tuple[float, float, float]]] = {}
        for i in queries:
            label = items[i].label
            example = liveliest(items[i].motion, label).resampled(FPS, speed)
            if len(example) < MIN_QUERY_S * FPS:
                continue
            neutral = np.isin(labels, [""] if strict else list(NEUTRAL[label]))
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
            f"  x{speed:<4g} {'no class neutral, ' if strict else ''}"
            f"AP {every[:, 0].mean():.3f}, first right {every[:, 1].mean():.3f}, "
            f"first five {every[:, 2].mean():.3f}   "
            + "  ".join(f"{k} {np.mean([r[0] for r in v]):.2f}" for k, v in found.items())
        )


def exercises(items: list[Item]) -> None:
    """Print how well frames of three clips of exercises are found by 2 s of another of them.

    In the index of the whole corpus. A frame is as far as the nearest hit that holds it; frames
    between exercises are not asked for. Beside it the same hits of plain warping on positions.
    """
    motions = [item.motion for item in items]
    names = [item.name for item in items]
    spaces = {
        "as shipped": FeatureSpace.fit(motions),
        "warping on positions": FeatureSpace.fit(motions, Weights(0, 0, 0, 0)),
    }
    for way, space in spaces.items():
        index = MotionIndex.of(motions, space)
        for factor in (1.0, 0.5, 2.0):
            asked = [found_frames(index, names, motions, *each, factor, way)
                     for each in exercise_queries()]  # fmt: skip
            asked = [each for each in asked if each[0].any()]
            precision = [average_precision_score(right, -far) for right, far in asked]
            far = np.concatenate([far for _, far in asked])
            levels = np.quantile(far[np.isfinite(far)], np.linspace(0, 1, 200))
            scores = np.array([[f1(right, far <= level) for level in levels]
                               for right, far in asked])  # fmt: skip
            print(
                f"exercises x{factor:<4g} {way}: AP of frames {np.mean(precision):.3f}, F1 at one "
                f"distance for all ({levels[scores.mean(axis=0).argmax()]:.2f}) "
                f"{scores.mean(axis=0).max():.3f}, at the best for each "
                f"{scores.max(axis=1).mean():.3f} ({len(asked)} queries)"
            )


def exercise_queries() -> list[tuple[str, str, int]]:
    """Return clip, exercise and first frame of 2 s in the middle of each exercise that lasts so."""
    n = int(QUERY_S * FPS)
    return [
        (clip, exercise, (first + end - n) // 2)
        for clip, parts in EXERCISES.items()
        for exercise, spans in parts.items()
        for first, end in spans[:1]
        if end - first >= n
    ]


def found_frames(
    index: MotionIndex,
    names: list[str],
    motions: list[CanonicalMotion],
    clip: str,
    exercise: str,
    first: int,
    factor: float,
    way: str,
) -> tuple[np.ndarray, np.ndarray]:
    """Return which labelled frames of the other clips are of an exercise, and how far each is."""
    n = int(QUERY_S * FPS)
    others = [each for each in EXERCISES if each != clip]
    allowed = np.zeros(len(index), bool)
    allowed[[names.index(each) for each in others]] = True
    example = part(motions[names.index(clip)], first, n).resampled(FPS, factor)
    hits = search(index, Query([example]), k=400, clips=allowed, exact=True)
    right, far = [], []
    for other in others:
        row = names.index(other)
        nearest = np.full(len(motions[row]), np.inf)
        for hit in (hit for hit in hits if hit.clip == row):
            held = nearest[hit.start : hit.end]
            held[:] = np.minimum(held, hit.distance if way == "as shipped" else hit.warped)
        for label, spans in EXERCISES[other].items():
            for start, end in spans:
                far.append(nearest[start:end])
                right.append(np.full(len(far[-1]), label == exercise))
    far_of_all = np.concatenate(far)
    return np.concatenate(right), np.where(np.isfinite(far_of_all), far_of_all, 1e3)


def f1(right: np.ndarray, found: np.ndarray) -> float:
    """Return the harmonic mean of precision and recall."""
    return float(2 * (right & found).sum() / max(right.sum() + found.sum(), 1))


def distances_of_clips(index: MotionIndex, query: Query) -> np.ndarray:
    """Return the distance of the best stretch of each clip."""
    everywhere = np.array([[0, len(index.frames)]])
    costs = [
        distances(index.frames, measured(index, template), everywhere)
        for template in query.templates(index.space)
    ]
    return np.minimum.reduceat(np.min(costs, axis=0), index.frames.starts[:-1])


def part(motion: CanonicalMotion, first: int, n: int) -> CanonicalMotion:
    own = slice(first, first + n)
    return CanonicalMotion(motion.pose[own], motion.root[own], motion.yaw[own], motion.fps)


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
    return part(motion, first, n)


def average_precision(right: np.ndarray) -> float:
    found = np.cumsum(right)
    return float((found / np.arange(1, len(right) + 1))[right].mean())


# -- how fast --------------------------------------------------------------------------------------


def enlarged(items: list[Item], n_frames: int) -> MotionIndex:
    """Return an index of about n frames: the corpus again and again, each time a little changed."""
    rng = np.random.default_rng(1)
    space = FeatureSpace.fit([item.motion for item in items])
    once = [space.frames(item.motion) for item in items]
    clips, total = [], 0
    while total < n_frames:
        values = once[len(clips) % len(once)]
        if len(clips) % len(once) == 0:
            shift = rng.normal(0, 0.05, space.n_dims) if clips else np.zeros(space.n_dims)
        noise = rng.normal(0, 0.01, values.shape) if len(clips) >= len(once) else 0.0
        clips.append((values + shift + noise).astype(np.float32))
        total += len(values)
    return index_of(space, clips)


def some_queries(items: list[Item]) -> list[tuple[str, Query]]:
    """Return 1.5 s of the middle of some clips, each by somebody else, and by whom."""
    n, found = int(1.5 * FPS), {}
    for item in items:
        if len(item.motion) > 2 * n and item.subject not in found:
            first = (len(item.motion) - n) // 2
            found[item.subject] = Query([part(item.motion, first, n)])
    step = max(1, len(found) // N_QUERIES)
    return list(found.items())[::step][:N_QUERIES]


def timed(run, repeats: int = 5) -> float:
    run()
    seconds = []
    for _ in range(repeats):
        started = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - started)
    return median(seconds)


def speed(items: list[Item], n_frames: int, picture: Path | None) -> None:
    queries = some_queries(items)
    sizes = [n_frames // 16, n_frames // 8, n_frames // 4, n_frames // 2, n_frames]
    ways = {"exact": True, "rough": False}
    times = {way: [] for way in ways}
    for size in sizes:
        index = enlarged(items, size)
        for way, exact in ways.items():
            own = [timed(partial(search, index, q, exact=exact, threads=2)) for _, q in queries]
            times[way].append(median(own))
            print(
                f"{way}: {len(index.frames):8,} frames, {len(queries)} queries of 1.5 s, two "
                f"threads: {1000 * times[way][-1]:6.1f} ms (slowest {1000 * max(own):.1f})"
            )
    rough, whole_body, arm = [], [], []
    of_arm = index_of_part(index, part_joints(["right-arm"]))
    for _, query in queries:  # in turns, on one thread: by what else runs, both are slowed alike
        for found, part_index, exact in (
            (whole_body, index, True), (arm, of_arm, True), (rough, index, False)
        ):  # fmt: skip
            search(part_index, query, exact=exact, threads=1)
            started = time.process_time()
            search(part_index, query, exact=exact, threads=1)
            found.append(time.process_time() - started)
    whole_ms, arm_ms, rough_ms = (1000 * median(each) for each in (whole_body, arm, rough))
    print(
        f"processor, {len(index.frames):,} frames, exact: whole body {whole_ms:.1f} ms, --joints "
        f"right-arm {arm_ms:.1f} ms ({arm_ms / whole_ms:.2f} times; the slowest "
        f"{max(arm) / max(whole_body):.2f}); rough, whole body {rough_ms:.1f} ms"
    )
    for way, seconds in times.items():
        exponent = np.polyfit(np.log(sizes), np.log(seconds), 1)[0]
        per_million = 1e3 * np.polyfit(np.array(sizes) / 1e6, seconds, 1)[0]
        print(f"{way}: grows as frames to the power {exponent:.2f}, {per_million:.0f} ms a million")
    for who, subjects in (("anybody", None), ("others", [item.subject for item in items])):
        recalls, cpu = [], {way: [] for way in ways}
        for subject, query in queries:
            clips = None
            if subjects:
                clips = np.array([subjects[i % len(items)] != subject for i in range(len(index))])
            hits = {}
            for way, exact in ways.items():
                started = time.process_time()
                hits[way] = search(index, query, exact=exact, clips=clips, threads=1)
                cpu[way].append(time.process_time() - started)
            recalls.append(recall(hits["exact"], hits["rough"]))
        print(
            f"rough, hits by {who}: {np.mean(recalls):.3f} of the exact ten are found; processor "
            + ", ".join(f"{way} {1000 * median(cpu[way]):.1f} ms" for way in ways)
        )
    if picture:
        from matplotlib import pyplot

        from mocapdb.plots import search_growth

        pyplot.sca(search_growth(sizes, {way: 1000 * np.array(t) for way, t in times.items()}))
        pyplot.savefig(picture, dpi=80, bbox_inches="tight")


def recall(exact: list[Stretch], rough: list[Stretch]) -> float:
    """Return the share of hits that are found, to an eighth of a second."""
    found = [
        any(hit.clip == other.clip and abs(hit.end - other.end) <= 3 for other in rough)
        for hit in exact
    ]
    return float(np.mean(found))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--scale", type=int, default=850_000, help="frames to time on")
    parser.add_argument("--only", choices=["find", "exercises", "speed"])
    parser.add_argument("--plot", type=Path, help="picture of how time grows")
    options = parser.parse_args()
    items = read_items(corpus_or_exit())
    if options.only in (None, "find"):
        whole_clips(items)
        stretches(items)
    if options.only in (None, "exercises"):
        exercises(items)
    if options.only in (None, "speed"):
        speed(items, options.scale, options.plot)


if __name__ == "__main__":
    main()
