"""Fit how likely hits are the same motion, each corpus left out in turn.

    python scripts/fit_probability.py CMU HDM05 BANDAI [--labels FILE] [--names PATTERN]

Each FOLDER is a corpus of its own: labelled clips of several people, as for ``fit_search.py``; FILE
says what they show. In a folder that FILE does not name, files are called after PATTERN, and other
styles count as other people. The first 15 hits of queries of 2 s, and of whole clips, among other
people are looked at. Printed are

- the distance of even odds by the log loss on each corpus alone. The lowest is the fit: it is
  better to promise too little;
- with each corpus left out of that, how many of its hits are said to be .8 and more, how many of
  these are right, and how many of those said .5 to .8;
- of what the distance alone says .8 and more, the share that is right, whatever the labels. The
  lowest is the share of what has no label.

Nothing is written: what is to be changed is changed by hand in mocapdb/indexing/tuning.py.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from fit_search import Item, middle, read_items, some_of_each

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.corpus import read_labels
from mocapdb.errors import MocapdbError
from mocapdb.indexing import MotionIndex, Query, canonical_motion
from mocapdb.indexing.search.clip_search import search_clips
from mocapdb.indexing.search.probability import LabelledHit, label_shares
from mocapdb.indexing.search.stretch_search import Stretch, search
from mocapdb.indexing.tuning import EVEN_ODDS, ODDS_POWER, UNTOLD_SHARE
from mocapdb.io import read_clip

FIRST = 15
SURE = 0.8
EVENS = np.round(np.arange(0.3, 1.21, 0.01), 2)
NAMES = "{dataset}_{label}_{style}_{take}"


class Hits(NamedTuple):
    """What was found in a corpus, (n,) each: distances, shares of labels, and whether right."""

    distances: FloatArray
    shares: FloatArray
    right: BoolArray


def named_items(folder: Path, pattern: str) -> list[Item]:
    """Return the clips of a folder whose names say what they show, and in which style."""
    fields = pattern.replace("{", "").replace("}", "").split("_")
    items = []
    for path in sorted(folder.glob("*.bvh")):
        said = dict(zip(fields, path.stem.split("_"), strict=True))
        items.append(Item(said["label"], said["style"], canonical_motion(read_clip(path))))
    return items


def found_in(items: list[Item], n_queries: int, *, whole: bool) -> Hits:
    """Return the first hits of queries among what other people do, if any of it is right."""
    index = MotionIndex.of([item.motion for item in items])
    people = np.array([item.person for item in items])
    labels = np.array([item.label for item in items])
    parts: list[tuple[float, float, bool]] = []
    for query in some_of_each(items, n_queries):
        others = people != query.person
        if not (labels[others] == query.label).any():
            continue
        hits: list[Stretch]
        if whole:
            hits = search_clips(index, Query([query.motion]), k=FIRST, clips=others)
        else:
            hits = search(index, Query([middle(query.motion)]), k=FIRST, clips=others)
        seen = [
            LabelledHit((hit.clip, hit.start), hit.distance, str(labels[hit.clip])) for hit in hits
        ]
        parts += [
            (each.distance, share, each.label == query.label)
            for each, share in zip(seen, label_shares(seen, seen), strict=True)
        ]
    distances, shares, right = zip(*parts, strict=True)
    return Hits(np.array(distances), np.array(shares), np.array(right))


def likely(hits: Hits, even: float) -> FloatArray:
    """Return how likely hits are, for a distance of even odds."""
    return np.asarray(hits.shares / (1 + (hits.distances / even) ** ODDS_POWER))


def fitted(ways: list[Hits]) -> float:
    """Return the distance of even odds with the least log loss on a corpus."""

    def loss(even: float) -> float:
        parts = []
        for hits in ways:
            said = np.clip(likely(hits, even), 1e-6, 1 - 1e-6)
            parts.append(-np.log(np.where(hits.right, said, 1 - said)))
        return float(np.concatenate(parts).mean())

    return float(min(EVENS, key=loss))


def main() -> int:
    """Run the script; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER")
    parser.add_argument("--labels", type=Path, metavar="FILE")
    parser.add_argument("--names", default=NAMES, metavar="PATTERN")
    parser.add_argument("--queries", type=int, default=8, help="queries of each class")
    parser.add_argument("--most", type=int, default=1000, help="clips of a person's class at most")
    options = parser.parse_args()
    found: dict[str, list[Hits]] = {}
    try:
        for folder in options.folders:
            named = options.labels is not None and any(
                read_labels(options.labels, folder).lookup(path.relative_to(folder))
                for path in folder.rglob("*")
            )
            items = (
                read_items(folder, options.labels, options.most)
                if named
                else named_items(folder, options.names)
            )
            found[folder.name] = [
                found_in(items, options.queries, whole=whole) for whole in (False, True)
            ]
    except MocapdbError as problem:
        print(problem, file=sys.stderr)
        return 1
    alone = {name: fitted(ways) for name, ways in found.items()}
    for name, even in alone.items():
        print(f"even odds by {name} alone: {even:.2f}")
    print(f"EVEN_ODDS      shipped {EVEN_ODDS:g}, fitted {min(alone.values()):.2f}")
    nearest = []
    for name, ways in found.items():
        even = min((each for other, each in alone.items() if other != name), default=EVEN_ODDS)
        for way, hits in zip(("stretches", "whole clips"), ways, strict=True):
            said = likely(hits, even)
            near = hits.distances < EVEN_ODDS * (1 / SURE - 1) ** (1 / ODDS_POWER)
            nearest.append(hits.right[near].mean() if near.any() else 1.0)
            print(
                f"{name} left out ({even:.2f}), {way:11}: {_right(hits, said >= SURE)} said {SURE} "
                f"and more, {_right(hits, (said >= 0.5) & (said < SURE))} said .5 to {SURE}; "
                f"Brier score {np.mean((said - hits.right) ** 2):.3f}; "
                f"as shipped {_right(hits, likely(hits, EVEN_ODDS) >= SURE)}, "
                f"by distance alone {_right(hits, near)}"
            )
    print(f"UNTOLD_SHARE   shipped {UNTOLD_SHARE:g}, fitted {min(nearest):.2f}")
    return 0


def _right(hits: Hits, some: BoolArray) -> str:
    share = f"{hits.right[some].mean():.2f}" if some.any() else "none"
    return f"{share} right of {some.sum()} of {len(some)}"


if __name__ == "__main__":
    raise SystemExit(main())
