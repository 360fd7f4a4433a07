"""Speed and size of the codec on real clips.

Sizes in bytes a frame, every header counted; speeds on one core, the best of three, with the
measuring of the error.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from itertools import product
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # read when numpy loads

from _corpus import corpus_or_exit

from mocapdb.compression import Budgets, Payload, Target, decode, encode
from mocapdb.compression.transforms import TRANSFORMS
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip

CLIPS = {
    "run": "cmu/asfamc/02/02_03.amc",
    "walk": "cmu/asfamc/07/07_01.amc",
    "dance": "cmu/asfamc/05/05_06.amc",
    "playground": "cmu/asfamc/01/01_01.amc",
    "walk, BVH": "cmu/bvh/35_28.bvh",
    "squat, HDM05": "hdm05/cut/HDM_bd_squat1Reps_003_120.amc",
}
TARGETS = (Target("mean_mm", 2.0), Target("max_mm", 10.0))
REPRESENTATIONS = ("channels", "positions", "aligned", "normalised")
SHARES = {
    "": Budgets(root=0.4, pca=0.0, temporal=0.6),
    "PCA + ": Budgets(root=0.2, pca=0.7, temporal=0.1),
}
REPETITIONS = 3


def print_line(name: str, cells: Iterable[object]) -> None:
    print(f"{name:24}" + "".join(f"{cell:>14}" for cell in cells))


def size(payload: Payload, clip: Clip) -> str:
    return "raw" if payload.codec == "raw" else f"{len(payload.data) / len(clip):.1f}"


def print_sizes(clips: dict[str, Clip], target: Target) -> None:
    print(f"\nBytes a frame, {target}")
    print_line("", clips)
    print_line("float32 channels", (4 * clip.skeleton.n_channels for clip in clips.values()))
    for name, transform, (stage, shares) in product(REPRESENTATIONS, TRANSFORMS, SHARES.items()):
        options: Any = {"representation": name, "transform": transform, "shares": shares}
        sizes = [size(encode(clip, target, **options), clip) for clip in clips.values()]
        print_line(f"{name} {stage}{transform}", sizes)
    for label, options in (("channels auto", {"representation": "channels"}), ("auto", {})):
        payloads = {clip: encode(clip, target, **options) for clip in clips.values()}
        print_line(label, (size(payload, clip) for clip, payload in payloads.items()))
        print_line("", (" ".join(p.codec.split()[1:3]) for p in payloads.values()))


def speed(clip: Clip, work: Callable[[], object]) -> str:
    """Return frames a second."""
    times = []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return f"{len(clip) / min(times):.0f}"


def print_speeds(clips: dict[str, Clip], target: Target) -> None:
    print(f"\nFrames a second, {target}")
    print_line(
        "", ("frames", "auto", "channels", "aligned dct", "decode", "aligned dct", "overhead")
    )
    quick: Any = {"representation": "channels"}
    plain: Any = {"representation": "aligned", "transform": "dct"}
    for kind, clip in clips.items():
        payload, aligned = encode(clip, target, **quick), encode(clip, target, **plain)
        speeds = [
            speed(clip, work)
            for work in (
                lambda clip=clip: encode(clip, target),
                lambda clip=clip: encode(clip, target, **quick),
                lambda clip=clip: encode(clip, target, **plain),
                lambda clip=clip, data=payload.data: decode(data, clip.skeleton),
                lambda clip=clip, data=aligned.data: decode(data, clip.skeleton),
            )
        ]
        overhead = len(payload.data) / payload.counted_bytes - 1
        print_line(kind, (len(clip), *speeds, f"{overhead:.1%}"))


def main() -> None:
    corpus = corpus_or_exit()
    paths = {kind: corpus / path for kind, path in CLIPS.items()}
    clips = {kind: read_clip(path) for kind, path in paths.items() if path.is_file()}
    for clip, representation in product(clips.values(), ("channels", "aligned")):
        encode(clip[:70], TARGETS[0], representation=representation)  # compiles the kernels
    for target in TARGETS:
        print_sizes(clips, target)
    for target in TARGETS:
        print_speeds(clips, target)


if __name__ == "__main__":
    main()
