"""What storing loses that matters: joints' own motion, and the bytes for keeping it.

Over clips of the corpus, spread evenly; the number of clips may be given as an argument.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from _corpus import corpus_or_exit, motion_files

from mocapdb.compression import Payload, Target, encode
from mocapdb.errors import MocapdbError
from mocapdb.io import read_clip

PLAIN = Target("mean_mm", 1.0, joint_share=0)
PROMISE = Target("mean_mm", 1.0)
MOVES_DEG = (3.0, 10.0)
LEAST_KEPT = (0.8, 0.9)
MOST_FRAMES = 2_000


def n_broken(payload: Payload) -> int:
    """Return how many joints keep too little of their swing."""
    swing, kept = payload.joints.motion.swing[0], payload.joints.kept[0]
    broken = np.zeros(len(swing), dtype=bool)
    for moves, least in zip(MOVES_DEG, LEAST_KEPT, strict=True):
        broken |= (swing >= moves) & (kept < least * swing)
    return int(broken.sum())


def main() -> None:
    n_clips = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    files = motion_files(corpus_or_exit())
    sizes, seconds, broken = np.zeros(2), np.zeros(2), np.zeros(2, dtype=int)
    for path in files[:: max(1, len(files) // n_clips)]:
        try:
            clip = read_clip(path)[:MOST_FRAMES]
        except MocapdbError as problem:
            print(f"left out {path.name}: {problem}")
            continue
        for i, target in enumerate((PLAIN, PROMISE)):
            start = time.process_time()
            payload = encode(clip, target)
            seconds[i] += time.process_time() - start
            sizes[i] += len(payload.data)
            broken[i] += n_broken(payload)
        print(path.name, sizes, broken, file=sys.stderr, flush=True)
    print(f"bytes without and with the promise: {sizes}, {100 * (sizes[1] / sizes[0] - 1):+.1f} %")
    print(f"processor time: {seconds}, {seconds[1] / seconds[0]:.2f} times")
    print(f"joints that keep too little: {broken}")


if __name__ == "__main__":
    main()
