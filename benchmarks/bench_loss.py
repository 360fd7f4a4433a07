"""What storing loses that matters: joints' own motion, bytes for keeping it, verdicts of `clean`.

Over clips of the corpus, spread evenly; the number of clips may be given as an argument.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from _corpus import corpus_or_exit, motion_files

from mocapdb.cleaning import detect_faults
from mocapdb.compression import Payload, Target, decode, encode
from mocapdb.errors import MocapdbError
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip

PLAIN = Target("mean_mm", 1.0, joint_share=0)
PROMISE = Target("mean_mm", 1.0)
MOVES_DEG = (3.0, 10.0)
LEAST_KEPT = (0.8, 0.9)
MOST_FRAMES = 2_000
AGREES = 0.5  # intersection over union


def n_broken(payload: Payload) -> int:
    """Return how many joints keep too little of their swing."""
    swing, kept = payload.joints.motion.swing[0], payload.joints.kept[0]
    broken = np.zeros(len(swing), dtype=bool)
    for moves, least in zip(MOVES_DEG, LEAST_KEPT, strict=True):
        broken |= (swing >= moves) & (kept < least * swing)
    return int(broken.sum())


def flags(clip: Clip) -> list[tuple[str, str, int, int]]:
    found = detect_faults(clip).spans
    return [(span.joint, span.kind, span.start, span.end) for span in found]


def agree(span: tuple[str, str, int, int], others: list[tuple[str, str, int, int]]) -> bool:
    """Say whether another span of the same joint covers about the same frames."""
    for joint, _, start, end in others:
        common = min(end, span[3]) - max(start, span[2])
        if joint == span[0] and common >= AGREES * (max(end, span[3]) - min(start, span[2])):
            return True
    return False


def main() -> None:
    n_clips = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    files = motion_files(corpus_or_exit())
    sizes, seconds, broken = np.zeros(2), np.zeros(2), np.zeros(2, dtype=int)
    n_spans, n_alike = np.zeros(2, dtype=int), np.zeros(2, dtype=int)
    frozen: list[str] = []
    for path in files[:: max(1, len(files) // n_clips)]:
        try:
            clip = read_clip(path)[:MOST_FRAMES]
        except MocapdbError as problem:
            print(f"left out {path.name}: {problem}")
            continue
        before = flags(clip)
        for i, target in enumerate((PLAIN, PROMISE)):
            start = time.process_time()
            payload = encode(clip, target)
            seconds[i] += time.process_time() - start
            sizes[i] += len(payload.data)
            broken[i] += n_broken(payload)
            after = flags(clip.replace(channels=decode(payload.data, clip.skeleton)))
            n_spans[i] += len(before) + len(after)
            n_alike[i] += sum(agree(span, after) for span in before)
            n_alike[i] += sum(agree(span, before) for span in after)
            if i == 1:
                known = {span[0] for span in before if span[1] == "freeze"}
                new = {span[0] for span in after if span[1] == "freeze"} - known
                frozen += [f"{path.name}: {joint}" for joint in sorted(new)]
        print(path.name, sizes, broken, n_alike, n_spans, frozen[-2:], file=sys.stderr, flush=True)
    print(f"bytes without and with the promise: {sizes}, {100 * (sizes[1] / sizes[0] - 1):+.1f} %")
    print(f"processor time: {seconds}, {seconds[1] / seconds[0]:.2f} times")
    print(f"joints that keep too little: {broken}")
    print(f"spans of clean that agree: {n_alike} of {n_spans}")
    print(f"joints frozen by storing: {', '.join(frozen) or 'none'}")


if __name__ == "__main__":
    main()
