"""Fit the tuned numbers of search and recognition: those that mocapdb/indexing/tuning.py names.

    python scripts/fit_search.py FOLDER [--labels FILE] [--only weights floor course switch ...]

FOLDER holds labelled clips of several people, such as CMU's or HDM05's; FILE says what they show,
as for ``mocapdb build``. For each number, values around the one shipped are tried on all clips, and
the score of each is printed; what scores best is the fit, but where the shipped value is as good
within half a point, it stays. Nothing is written: what is to be changed is changed by hand.

weights  average precision of clips of a query's class among clips by other people
floor    share of clips given to the right class, learned from other people
course   how well an unknown class of an unknown person is told from the known ones (AUROC)
switch   share of frames given to the right class, in clips of three classes put after each other
places   share of an exact search's hits that a rough one finds, among many times the clips
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from sklearn.metrics import average_precision_score, roc_auc_score

from mocapdb.corpus import find_labels, read_labels
from mocapdb.errors import CorpusError, MocapdbError
from mocapdb.indexing import ClassIndex, MotionIndex, Query, Weights, canonical_motion
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.recognition.class_models import Moments
from mocapdb.indexing.recognition.examples import ClipShapes
from mocapdb.indexing.recognition.ppca import PPCA
from mocapdb.indexing.search import stretch_search
from mocapdb.indexing.search.features import FeatureSpace, frame_features
from mocapdb.indexing.search.frame_store import index_of
from mocapdb.indexing.search.span_scan import distances, measured
from mocapdb.indexing.tuning import (
    EXAMPLE_COURSE,
    FLOOR_M,
    FPS,
    KEPT_VARIANCE,
    OUTLINE_PLACES,
    SKETCH_PLACES,
    SWITCH_NATS,
)
from mocapdb.io import read_clip
from mocapdb.library.naming import subject_of

AS_GOOD = 0.005  # of a score: the shipped value stays
AROUND = (0.25, 0.5, 1.0, 2.0, 4.0)  # times the shipped value
QUERY_S = 2.0
NO_CLASSES = {"unknown", "other", "mixed", "calibration", "sequence"}
MOST_PAIRS = 24  # of person and class left out


@dataclass(frozen=True)
class Item:
    """A clip: what it shows, who performs it, and its motion."""

    label: str
    person: str
    motion: CanonicalMotion


def read_items(folder: Path, labels_path: Path | None, most: int) -> list[Item]:
    """Return the labelled clips of a folder, so many of each person and class at most."""
    labels_path = labels_path or find_labels(folder)
    if labels_path is None:
        raise CorpusError(f"{folder}: expected LABELS.csv in it, but found none. Use --labels.")
    labels = read_labels(labels_path, folder)
    items: dict[str, Item] = {}
    counts: dict[tuple[str, str], int] = {}
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() not in {".amc", ".bvh"} or path.stem in items:
            continue
        row = labels.lookup(path.relative_to(folder))
        if row is None or row.label in NO_CLASSES:
            continue
        person = subject_of(path.stem)
        counts[row.label, person] = counts.get((row.label, person), 0) + 1
        if counts[row.label, person] > most:
            continue
        try:
            fps = row.fps if path.suffix.lower() == ".amc" else None
            motion = canonical_motion(read_clip(path, fps=fps, drop_tpose=True))
        except MocapdbError as problem:
            print(f"skipped {problem}", file=sys.stderr)
            continue
        items[path.stem] = Item(row.label, person, motion)
    people: dict[str, set[str]] = {}
    for item in items.values():
        people.setdefault(item.label, set()).add(item.person)
    shared = [item for item in items.values() if len(people[item.label]) > 1]
    if not shared:
        raise CorpusError(f"{folder}: expected a class that two people perform, but found none.")
    return shared


def fit(
    name: str, shipped: float, values: Sequence[float], score: Callable[[float], float]
) -> float:
    """Print the score of each value of a number, and return the fit."""
    scores = {value: score(value) for value in values}
    best = max(scores, key=lambda value: scores[value])
    chosen = shipped if scores[best] - scores[shipped] <= AS_GOOD else best
    listed = "  ".join(f"{value:g}: {100 * scores[value]:.1f}" for value in values)
    print(f"{name:15} shipped {shipped:g}, fitted {chosen:g}   ({listed})", flush=True)
    return chosen


def around(shipped: float) -> list[float]:
    """Return values from a quarter of the one shipped to four times as much."""
    return [shipped * factor for factor in AROUND]


# -- search ----------------------------------------------------------------------------------------


def middle(motion: CanonicalMotion, seconds: float = QUERY_S) -> CanonicalMotion:
    """Return the middle of a motion, or all of it."""
    n = min(len(motion), int(seconds * motion.fps))
    own = slice((len(motion) - n) // 2, (len(motion) - n) // 2 + n)
    return CanonicalMotion(motion.pose[own], motion.root[own], motion.yaw[own], motion.fps)


def some_of_each(items: list[Item], n: int) -> list[Item]:
    """Return n clips of each class, by as many people as there are."""
    chosen: list[Item] = []
    for label in sorted({item.label for item in items}):
        own = [item for item in items if item.label == label]
        chosen += [own[i] for i in np.linspace(0, len(own) - 1, min(n, len(own))).astype(int)]
    return chosen


def precision(items: list[Item], weights: Weights, n_queries: int) -> float:
    """Return the mean average precision of some queries of each class."""
    motions = [item.motion for item in items]
    index = MotionIndex.of(motions, FeatureSpace.fit(motions, weights))
    everywhere = np.array([[0, len(index.frames)]])
    precisions = []
    for query in some_of_each(items, n_queries):
        costs = [
            distances(index.frames, measured(index, template), everywhere)
            for template in Query([middle(query.motion)]).templates(index.space)
        ]
        of_clips = np.minimum.reduceat(np.min(costs, axis=0), index.frames.starts[:-1])
        others = np.array([item.person != query.person for item in items]) & np.isfinite(of_clips)
        right = np.array([item.label == query.label for item in items])[others]
        if right.any():
            precisions.append(average_precision_score(right, -of_clips[others]))
    return float(np.mean(precisions))


def fit_weights(items: list[Item], n_queries: int) -> None:
    """Fit the weights of features, one after another."""
    weights = Weights()
    for name in ("velocity_s", "height", "travel_s", "turn_ms"):

        def score(value: float, name: str = name, others: Weights = weights) -> float:
            return precision(items, replace(others, **{name: value}), n_queries)

        shipped = getattr(Weights(), name)
        weights = replace(weights, **{name: fit(name.upper(), shipped, around(shipped), score)})


def fit_places(items: list[Item], n_frames: int) -> None:
    """Fit the places that a rough search looks at, in the clips repeated with perturbation."""
    rng = np.random.default_rng(1)
    space = FeatureSpace.fit([item.motion for item in items])
    once = [space.frames(item.motion) for item in items]
    clips: list[np.ndarray] = []
    total = 0
    while total < n_frames:
        if len(clips) % len(once) == 0:
            shift = rng.normal(0, 0.05, space.n_dims) * bool(clips)
        values = once[len(clips) % len(once)]
        noise = rng.normal(0, 0.01, values.shape) * (len(clips) >= len(once))
        clips.append((values + shift + noise).astype(np.float32))
        total += len(values)
    index = index_of(space, clips)
    people = np.array([items[i % len(items)].person for i in range(len(index))])
    asked = [
        (Query([middle(item.motion)]), people != item.person) for item in some_of_each(items, 1)
    ]
    exact = [stretch_search.search(index, query, clips=who, exact=True) for query, who in asked]

    def recall(outline: float, sketch: float) -> float:
        stretch_search.OUTLINE_PLACES = int(outline)  # type: ignore[attr-defined]
        stretch_search.SKETCH_PLACES = int(sketch)  # type: ignore[attr-defined]
        shares = []
        for (query, who), hits in zip(asked, exact, strict=True):
            rough = stretch_search.search(index, query, clips=who, exact=False)
            shares.append(
                np.mean(
                    [any(h.clip == r.clip and abs(h.end - r.end) <= 3 for r in rough) for h in hits]
                )
            )
        return float(np.mean(shares))

    fit(
        "OUTLINE_PLACES", OUTLINE_PLACES, around(OUTLINE_PLACES), lambda n: recall(n, SKETCH_PLACES)
    )
    fit("SKETCH_PLACES", SKETCH_PLACES, around(SKETCH_PLACES), lambda n: recall(OUTLINE_PLACES, n))


# -- recognition -----------------------------------------------------------------------------------


def fit_floor(items: list[Item]) -> None:
    """Fit how wide a class is at least."""
    scales = Weights().scales()
    values = [frame_features(item.motion) * scales for item in items]

    def score(floor_m: float) -> float:
        right = []
        for person in sorted({item.person for item in items}):
            moments: dict[str, Moments] = {}
            for item, own in zip(items, values, strict=True):
                if item.person != person:
                    moments.setdefault(item.label, Moments()).add(own)
            models = {
                label: each.model(PPCA(KEPT_VARIANCE, floor_m)) for label, each in moments.items()
            }
            for item, own in zip(items, values, strict=True):
                if item.person == person and item.label in models:
                    best = max(models, key=lambda label: models[label].score(own))
                    right.append(best == item.label)
        return float(np.mean(right))

    fit("FLOOR_M", FLOOR_M, around(FLOOR_M), score)


def learned(items: list[Item]) -> ClassIndex:
    """Return the classes of some clips."""
    return ClassIndex().fit(
        [item.motion for item in items],
        [item.label for item in items],
        groups=[item.person for item in items],
    )


def pairs_left_out(items: list[Item]) -> Iterator[tuple[str, str]]:
    """Yield some (person, class): the person performs the class, and others."""
    people = sorted({item.person for item in items})
    found = [
        (person, label)
        for person in people
        for label in sorted({item.label for item in items if item.person == person})
        if len({item.label for item in items if item.person == person}) > 1
    ]
    chosen = np.random.default_rng(0).permutation(len(found))[:MOST_PAIRS]
    yield from (found[i] for i in sorted(chosen))


def fit_course(items: list[Item]) -> None:
    """Fit what the course counts beside the frames in how far a clip is from those known."""
    evidence = []
    for person, unknown in pairs_left_out(items):
        classes = learned([i for i in items if i.person != person and i.label != unknown])
        own = [i for i in items if i.person == person and i.label in {*classes.labels, unknown}]
        is_new = np.array([item.label == unknown for item in own])
        if is_new.all():
            continue
        shapes = ClipShapes.of([item.motion for item in own], classes.space)
        frames, course = classes.examples.parts(shapes)
        evidence.append((is_new, frames, course))
    if not evidence:
        print("EXAMPLE_COURSE  cannot be fitted: nobody performs two classes that others perform")
        return

    def score(share: float) -> float:
        return float(
            np.mean(
                [
                    roc_auc_score(new, (frames + share * course).min(axis=1))
                    for new, frames, course in evidence
                ]
            )
        )

    fit("EXAMPLE_COURSE", EXAMPLE_COURSE, [0.0, *around(EXAMPLE_COURSE)], score)


def fit_switch(items: list[Item], n_sequences: int) -> None:
    """Fit what a change of class costs."""
    rng = np.random.default_rng(2)
    sequences = []
    for person in sorted({item.person for item in items}):
        classes = learned([item for item in items if item.person != person])
        own = [i for i in items if i.person == person and i.label in classes.labels]
        if len({item.label for item in own}) < 3:
            continue
        for _ in range(n_sequences):
            drawn = {own[i].label: own[i].motion for i in rng.permutation(len(own))}
            parts = {label: middle(drawn[label], 2 * QUERY_S) for label in list(drawn)[:3]}
            joined = (
                np.concatenate([getattr(part, name) for part in parts.values()])
                for name in ("pose", "root", "yaw")
            )
            truth = np.repeat(list(parts), [len(part) for part in parts.values()])
            sequences.append((classes, CanonicalMotion(*joined, FPS), truth))
    if not sequences:
        print("SWITCH_NATS     cannot be fitted: nobody performs three classes that others perform")
        return

    def score(nats: float) -> float:
        shares = []
        for classes, motion, truth in sequences:
            found = classes.segment(motion, switch_nats=nats)
            said = np.repeat([each.label for each in found], [len(each) for each in found])
            shares.append((said == truth).mean())
        return float(np.mean(shares))

    fit("SWITCH_NATS", SWITCH_NATS, around(SWITCH_NATS), score)


def main() -> int:
    """Run the script; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.add_argument("--labels", type=Path, metavar="FILE")
    parser.add_argument(
        "--only", nargs="+", choices=["weights", "floor", "course", "switch", "places"],
        default=["weights", "floor", "course", "switch", "places"],
    )  # fmt: skip
    parser.add_argument("--most", type=int, default=20, help="clips of a person's class at most")
    parser.add_argument("--queries", type=int, default=8, help="queries of each class")
    parser.add_argument("--sequences", type=int, default=5, help="of three clips, by each person")
    parser.add_argument("--frames", type=int, default=400_000, help="frames for places")
    options = parser.parse_args()
    try:
        items = read_items(options.folder, options.labels, options.most)
    except MocapdbError as problem:
        print(problem, file=sys.stderr)
        return 1
    n_classes, n_people = len({i.label for i in items}), len({i.person for i in items})
    print(f"{len(items)} clips of {n_classes} classes by {n_people} people; scores in per cent")
    if "weights" in options.only:
        fit_weights(items, options.queries)
    if "floor" in options.only:
        fit_floor(items)
    if "course" in options.only:
        fit_course(items)
    if "switch" in options.only:
        fit_switch(items, options.sequences)
    if "places" in options.only:
        fit_places(items, options.frames)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
