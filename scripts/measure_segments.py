"""Measure the cuts of mocapdb/segmentation on takes put together of labelled clips.

    python scripts/measure_segments.py FOLDER [--subjects HDM_bk 02] [--styled FOLDER --sets 1]

FOLDER has clips and a LABELS.csv. Of each subject (how its clips' names begin) takes are made: six
blocks, no two neighbours of one class, each of one or several clips of its class, 3 to 7 s in all,
each clip faded into the next within a quarter of a second. ``--styled`` is a folder of clips named
``dataset-N_CLASS_STYLE_NUMBER``, as Bandai Namco Research's are; their normal style is taken.

For each method: the share of the found cuts that are within half a second of a true one
(precision), that of the true ones that are found (recall), and the same of pairs of frames that
have the same letter. Clips of one label may hold several motions ("sword"), and different labels
may be alike ("walk" and "walk-left"), so none of them comes to 1.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mocapdb.corpus import read_labels
from mocapdb.cycles.phase.pose_cloud import pose_cloud
from mocapdb.io import read_clip
from mocapdb.motion.body import part_from_scene
from mocapdb.segmentation import segment_poses
from mocapdb.segmentation.motion_segments import METHODS

FPS = 30.0
BLOCKS = 6
BLOCK_S = (3.0, 7.0)
LONGEST_CLIP_S = 8.0
FADE_S = 0.25
WITHIN_S = 0.5
SEVERAL = ("dance", "jumping jacks", "salsa", "playground", "Stop")  # clips of many motions


class Take(NamedTuple):
    """Poses (F, D) put together of blocks, each of one class, and where each block begins."""

    poses: np.ndarray
    starts: list[int]
    labels: list[str]


def poses_of(path: Path) -> np.ndarray:
    """Return what segmentation looks at of a clip, at 30 Hz."""
    clip = part_from_scene(read_clip(path, drop_tpose=True))[0]
    return pose_cloud(clip, by_bone_length=True)[:: max(1, round(clip.fps / FPS))]


def labelled(folder: Path, subject: str) -> dict[str, list[np.ndarray]]:
    """Return the clips of a subject by class."""
    found = defaultdict(list)
    for row in read_labels(folder / "LABELS.csv"):
        named = Path(row.path).stem
        if named.startswith(f"{subject}_") and not any(w in row.description for w in SEVERAL):
            found[row.description or row.label].append(poses_of(folder / row.path))
    # a subject may be there as AMC and as BVH, whose skeletons differ
    widths = [part.shape[1] for parts in found.values() for part in parts]
    width = max(set(widths), key=widths.count)
    kept = {label: [p for p in parts if p.shape[1] == width] for label, parts in found.items()}
    return {label: parts for label, parts in kept.items() if parts}


def styled(folder: Path, number: int) -> dict[str, list[np.ndarray]]:
    """Return the clips of a set of normal style by class."""
    found = defaultdict(list)
    for path in sorted(folder.glob(f"dataset-{number}_*_normal_*.bvh")):
        found[path.stem.split("_")[1]].append(poses_of(path))
    return found


def make_take(clips: dict[str, list[np.ndarray]], rng: np.random.Generator) -> Take:
    """Return a take of blocks, each of another class than the one before."""
    poses = np.empty((0, next(iter(clips.values()))[0].shape[1]))
    starts, labels = [], []
    longest = round(LONGEST_CLIP_S * FPS)
    while len(labels) < BLOCKS:
        label = str(rng.choice([each for each in clips if labels[-1:] != [each]]))
        wanted, length = rng.uniform(*BLOCK_S) * FPS, 0
        starts.append(max(0, len(poses) - round(FADE_S * FPS / 2)))
        labels.append(label)
        while length < wanted:
            part = clips[label][rng.integers(len(clips[label]))]
            part = part[:longest] if rng.random() < 0.5 else part[-longest:]
            length += len(part)
            poses = faded(poses, part)
    return Take(poses, starts, labels)


def faded(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return poses after each other, the last ones of the first faded into those that follow."""
    n = min(round(FADE_S * FPS), len(before) // 3, len(after) // 3)
    if n == 0:
        return np.vstack([before, after])
    share = np.linspace(0.0, 1.0, n + 2)[1:-1, None]
    mixed = before[-n:] * (1 - share) + after[:n] * share
    return np.vstack([before[:-n], mixed, after[n:]])


def hits(found: list[int], true: list[int]) -> int:
    """Return how many true cuts have a found one near, each found one serving once."""
    left, count = sorted(found), 0
    for cut in true:
        near = [each for each in left if abs(each - cut) <= WITHIN_S * FPS]
        if near:
            left.remove(min(near, key=lambda each: abs(each - cut)))
            count += 1
    return count


def measure(takes: list[Take], method: str) -> str:
    """Return precision and recall of cuts and of letters, as a line."""
    right = found = true = 0
    pairs = np.zeros(3)
    for take in takes:
        segments = segment_poses(take.poses, FPS, method).segments
        cuts = [segment.start for segment in segments[1:]]
        right += hits(cuts, take.starts[1:])
        found += len(cuts)
        true += len(take.starts) - 1
        bounds = pairwise([*take.starts, len(take.poses)])
        labels = np.concatenate(
            [np.full(b - a, i) for i, (a, b) in zip(take.labels, bounds, strict=True)]
        )
        letters = np.concatenate([np.full(len(part), part.motion) for part in segments])
        same, alike = (each[::10, None] == each[::10] for each in (labels, letters))
        pairs += [(same & alike).sum(), alike.sum(), same.sum()]
    return (
        f"cuts {right / max(found, 1):.2f} {right / true:.2f}   "
        f"letters {pairs[0] / pairs[1]:.2f} {pairs[0] / pairs[2]:.2f}"
    )


def sources(options: argparse.Namespace) -> Iterator[tuple[str, dict[str, list[np.ndarray]]]]:
    """Yield subjects and sets with their clips."""
    for subject in options.subjects:
        yield subject, labelled(options.folder, subject)
    if options.styled is not None:
        for number in options.sets:
            yield f"set {number}", styled(options.styled, number)


def main() -> None:
    """Make takes, cut them, print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, help="clips and LABELS.csv")
    parser.add_argument("--subjects", nargs="*", default=["HDM_bk", "02"])
    parser.add_argument("--styled", type=Path, help="clips named dataset-N_CLASS_STYLE_NUMBER")
    parser.add_argument("--sets", nargs="*", type=int, default=[1])
    parser.add_argument("--takes", type=int, default=8, help="of each subject")
    parser.add_argument("--methods", nargs="*", default=METHODS)
    options = parser.parse_args()
    everyone = []
    for name, clips in sources(options):
        takes = [make_take(clips, np.random.default_rng([7, i])) for i in range(options.takes)]
        everyone += takes
        print(f"{name:<10}{measure(takes, options.methods[0])}", flush=True)
    print("precision and recall, all of them")
    for method in options.methods:
        print(f"{method:<10}{measure(everyone, method)}", flush=True)


if __name__ == "__main__":
    main()
