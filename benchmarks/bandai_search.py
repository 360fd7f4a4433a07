"""Search among Bandai's clips: across styles, and with clips of another corpus.

`bench_bodies.py` prints both. What is found across styles is held against plain dynamic time
warping on positions, with the tests' own table of joints.
"""

from __future__ import annotations

import csv
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit
from zoo_names import LIMBS, names_of

from mocapdb import read_clip
from mocapdb.compression import Target
from mocapdb.indexing import Weights, canonical_motion
from mocapdb.indexing.search.features import frame_features
from mocapdb.io import ReadOptions
from mocapdb.library import BuildSettings, Filter, Library, Retrieval, build_library
from mocapdb.library.building.folder_bodies import bodies_of_folders
from mocapdb.motion.body import understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics, to_metres

NAMES = "{dataset}_{label}_{style}_{take}"
QUICK = BuildSettings(
    Target("mean_mm", 2.0), {"codec": "okane", "representation": "channels", "transform": "dct"}
)
WARPED_FPS = 10
QUERY_S = 2.0
N_QUERIES = 30
PLAIN = {"walk": ("walk", "slow walk", "walk/stride"), "run": ("run", "run/jog")}
"""What CMU says of clips that hold nothing else, by its label."""

RIGHT = {"walk": ("walk", "walk-"), "run": ("run", "dash")}
"""Beginnings of Bandai's labels that are right for CMU's: a dash is a run."""


class Item(NamedTuple):
    """A clip of Bandai."""

    name: str
    label: str
    style: str
    clip: Clip
    positions: np.ndarray


def build(bandai: Path, library: Path) -> None:
    """Build Bandai's clips, and print what it costs that they agree on unit and axis."""
    files = [(path.name, ReadOptions()) for path in sorted(bandai.glob("*.bvh"))]
    start = time.process_time()
    bodies = bodies_of_folders(bandai, [file for file, _ in files], files)
    agreeing_s = time.process_time() - start
    report = build_library(bandai, library, QUICK, names=NAMES, jobs=1, index=True)
    print(
        f"{'clips of Bandai that agree on unit and axis':44} {len(bodies):4d} of {len(files)}: "
        f"{agreeing_s:.2f} s of a build of {report.seconds:.1f} s"
    )


def across_styles(bandai: Path, library: Path) -> None:
    """Query with every clip, its own style left out, as many hits as there are right ones."""
    items = read_items(bandai)
    found: dict[str, list[tuple[float, float]]] = {}
    motions = [canonical_motion(item.clip) for item in items]
    features = [frame_features(motion) * Weights().scales() for motion in motions]
    spread = dict(zip((item.name for item in items),
                      (np.r_[each.mean(axis=0), each.std(axis=0)] for each in features),
                      strict=True))  # fmt: skip
    exchanged, looked_at = 0, 0
    with Library(library) as built:
        retrieval = Retrieval(built)
        for item in items:
            others = [other for other in items if other.style != item.style]
            n_right = sum(other.label == item.label for other in others)
            if n_right == 0:
                continue
            left_out = [each.name for each in items if each.style == item.style]
            for way, whole in (("stretches", False), ("whole clips", True)):
                hits = retrieval.query(
                    item.clip, k=n_right, whole=whole, only=Filter(not_clips=left_out)
                )
                right = [hit.record.label == item.label for hit in hits]
                found.setdefault(way, []).append(scores(right, n_right))
                if not whole and exchange(item.label) != item.label:
                    wrong = exchange(item.label)
                    exchanged += sum(hit.record.label == wrong for hit in hits[:5])
                    looked_at += len(hits[:5])
            away = [np.linalg.norm(spread[item.name] - spread[other.name]) for other in others]
            order = np.argsort(away, kind="stable")[:n_right]
            right = [others[i].label == item.label for i in order]
            found.setdefault("mean and spread of features", []).append(scores(right, n_right))
            costs = [warped(item.positions, other.positions) for other in others]
            order = np.argsort(costs, kind="stable")[:n_right]
            right = [others[i].label == item.label for i in order]
            found.setdefault("plain warping", []).append(scores(right, n_right))
    for way, each in found.items():
        precision, average = np.mean(each, axis=0)
        print(
            f"{'across styles, ' + way:44} P@5 {precision:.3f}, mAP {average:.3f}"
            f" ({len(each)} queries)"
        )
    print(f"{'across styles, left and right exchanged':44} {exchanged} of {looked_at} hits")


def exchange(label: str) -> str:
    """Return a label with left and right exchanged."""
    return "right".join(part.replace("right", "left") for part in label.split("left"))


def from_cmu(corpus: Path, library: Path) -> None:
    """Query with the 2 s of walks and runs of CMU in which they get furthest."""
    first, precision = [], []
    with Library(library) as built:
        retrieval = Retrieval(built)
        for label, texts in PLAIN.items():
            rows = [
                row
                for row in csv.DictReader((corpus / "LABELS.csv").open(encoding="utf-8"))
                if row["path"].startswith("cmu") and row["label"] == label
                if row["description"].lower() in texts
            ]
            for row in rows[:: -(-len(rows) // N_QUERIES)]:
                skeleton = corpus / row["skeleton"] if row["skeleton"] else None
                clip = read_clip(corpus / row["path"], skeleton=skeleton)
                hits = retrieval.query(clip[furthest(clip)], k=5)
                right = [hit.record.label.startswith(RIGHT[label]) for hit in hits]
                first.append(right[0])
                precision.append(np.mean(right))
    print(
        f"{'2 s of CMU in Bandai':44} first hit right {np.mean(first):.3f}, "
        f"P@5 {np.mean(precision):.3f} ({len(first)} queries)"
    )


def furthest(clip: Clip) -> slice:
    """Return the frames of the 2 s in which the hips get furthest: a walk may stand and turn."""
    n_frames = min(len(clip), round(QUERY_S * clip.fps))
    root = understand(clip.skeleton, clip.channels).root.value
    hips = to_metres(
        clip.skeleton, forward_kinematics(clip.skeleton, clip.channels).positions[:, [root]]
    )[:, 0]
    away = np.linalg.norm(
        (hips[n_frames - 1 :] - hips[: len(hips) - n_frames + 1])[:, [0, 2]], axis=1
    )
    start = int(np.argmax(away))
    return slice(start, start + n_frames)


def read_items(bandai: Path) -> list[Item]:
    items = []
    for path in sorted(bandai.glob("*.bvh")):
        _, label, style, _ = path.stem.split("_")
        clip = read_clip(path)
        items.append(Item(path.stem, label, style, clip, limb_positions(clip, path)))
    return items


def limb_positions(clip: Clip, path: Path) -> np.ndarray:
    """Return (F, D) limbs and head from the middle of the hips, which faces the same way always."""
    named = names_of(path) or {}
    positions = to_metres(clip.skeleton, forward_kinematics(clip.skeleton, clip.channels).positions)
    wanted = ["head", *(f"{side}_{limb}" for side in ("left", "right") for limb in LIMBS)]
    at = {joint: clip.skeleton.names.index(named[joint]) for joint in wanted}
    positions = positions[:: max(1, round(clip.fps / WARPED_FPS))]
    left, right = (positions[:, at[f"{side}_hip"]] for side in ("left", "right"))
    points = positions[:, list(at.values())] - ((left + right) / 2)[:, None]
    across = left - right
    angle = np.arctan2(across[:, 2], across[:, 0])
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y, z = np.moveaxis(points, 2, 0)
    turned = np.stack([c * x + s * z, y, c * z - s * x], axis=2)
    return turned.reshape(len(turned), -1)


@njit
def warped(a: np.ndarray, b: np.ndarray) -> float:
    """Return the cost of warping one onto the other, for each frame of both."""
    cost = np.full((len(a) + 1, len(b) + 1), np.inf)
    cost[0, 0] = 0.0
    for i in range(len(a)):
        for j in range(len(b)):
            d = np.sqrt(((a[i] - b[j]) ** 2).sum())
            cost[i + 1, j + 1] = min(cost[i, j] + 2 * d, cost[i, j + 1] + d, cost[i + 1, j] + d)
    return cost[len(a), len(b)] / (len(a) + len(b))


def scores(right: list[bool], n_right: int) -> tuple[float, float]:
    """Return precision of the first five, or as many as there are right ones, and average."""
    flags = np.array(right + [False] * (n_right - len(right)), dtype=float)
    precisions = np.cumsum(flags) / np.arange(1, n_right + 1)
    return float(flags[:5].mean()), float((precisions * flags).sum() / n_right)
