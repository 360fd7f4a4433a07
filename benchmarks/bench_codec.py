"""Size and speed of the codecs on real clips.

Sizes in bytes a frame, every header counted; speeds in frames a second on one core, the best of
three. With a path as argument, the curves of rate and distortion of the first clip are drawn there.

ACL is the animation compressor of that name, version 2.1, as it was measured on these clips at 31
bones, its skeleton not counted: bytes a frame and the errors of its own points, which are those of
the shell (`acl_2_1_measured.csv`).
"""

from __future__ import annotations

import csv
import os
import sys
import tempfile
import time
import tracemalloc
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # read when numpy loads

import numpy as np
from _corpus import corpus_or_exit

from mocapdb import BuildSettings, build_library
from mocapdb.compression import PayloadReader, Target, decode, encode
from mocapdb.compression.pose.modes import TRANSFORM_MODES
from mocapdb.compression.pose.pose_codec import encode_at
from mocapdb.io import read_clip, write_clip
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skin import shell_error

CLIPS = {
    "run": "cmu/asfamc/02/02_03.amc",
    "walk": "cmu/asfamc/07/07_01.amc",
    "dance": "cmu/asfamc/05/05_06.amc",
    "walk, BVH": "cmu/bvh/35_28.bvh",
    "squat, HDM05": "hdm05/cut/HDM_bd_squat1Reps_003_120.amc",
}
MAXIMUM = Target("max_mm", 10.0, joint_share=0)
TARGETS = (Target("mean_mm", 1.0, joint_share=0), MAXIMUM)
SHORT_CLIPS, SHORT_FRAMES = 100, 100
CHOICES: dict[str, dict[str, Any]] = {
    "okane channels": {"codec": "okane", "representation": "channels"},
    "okane PCA + DCT": {"codec": "okane", "representation": "aligned", "transform": "dct"},
    "okane PCA + DWT": {"codec": "okane", "representation": "aligned", "transform": "dwt"},
    "pose PCA + DCT": {"decorrelation": "pca", "transform": "dct"},
    "pose PCA + DWT": {"decorrelation": "pca", "transform": "dwt"},
    "pose none": {"decorrelation": "none"},
    **{f"pose {name}": {"transform": name} for name in TRANSFORM_MODES},
}
DRAWN = ("okane channels", "okane PCA + DCT", "pose dct64", "pose dwt", "pose auto")
LEVELS_MM = (0.1, 0.3, 1.0, 3.0, 10.0)
ACL = Path(__file__).with_name("acl_2_1_measured.csv")
REPETITIONS = 3


def print_line(name: str, cells: Iterable[object]) -> None:
    print(f"{name:24}" + "".join(f"{cell:>14}" for cell in cells), flush=True)


def bytes_a_frame(clip: Clip, target: Target, options: Mapping[str, Any]) -> float:
    return len(encode(clip, target, **options).data) / len(clip)


def print_sizes(clips: Mapping[str, Clip], target: Target) -> None:
    print(f"\nBytes a frame, {target}")
    print_line("", clips)
    print_line("float32 channels", (4 * clip.skeleton.n_channels for clip in clips.values()))
    for name, options in CHOICES.items():
        sizes = (bytes_a_frame(clip, target, options) for clip in clips.values())
        print_line(name, (f"{size:.2f}" for size in sizes))


def print_acl(corpus: Path) -> None:
    """Print how many times fewer bytes than ACL the pose codec needs at its errors."""
    print("\nAgainst ACL 2.1 at the same error of the shell, bytes a frame")
    print_line("", ("ACL at cm", "ACL", "at its max", "times", "at its mean", "times"))
    times: dict[tuple[str, str], list[float]] = defaultdict(list)
    clips: dict[str, Clip | None] = {}
    for row in measured_acl():
        name, precision = row["clip"], row["acl_precision_cm"]
        if name not in clips:
            path = corpus / f"cmu/asfamc/{name[:2]}/{name}.amc"
            clips[name] = read_clip(path) if path.is_file() else None
        clip = clips[name]
        if clip is None:
            continue
        theirs = float(row["acl_bytes_per_frame"])
        cells: list[object] = [precision, f"{theirs:.1f}"]
        for kind in ("max", "mean"):
            value_mm = 10.0 * float(row[f"{kind}_cm"])
            target = Target(f"shell_{kind}_mm", value_mm, joint_share=0)
            ours = bytes_a_frame(clip, target, {})
            times[kind, precision].append(theirs / ours)
            cells += [f"{ours:.2f}", f"{theirs / ours:.2f}"]
        print_line(name, cells)
    for (kind, precision), ratios in times.items():
        mean = float(np.exp(np.mean(np.log(ratios))))
        print(f"{precision} cm, same {kind}: {mean:.2f} times fewer, of {len(ratios)} clips")


def measured_acl() -> list[dict[str, str]]:
    with ACL.open(encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def speed(n: int, work: Callable[[], object]) -> str:
    """Return how many of n things are done in a second, of the processor's time."""
    times = []
    for _ in range(REPETITIONS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return f"{n / min(times):.0f}"


def print_speeds(clips: Mapping[str, Clip], target: Target) -> None:
    print(f"\nFrames a second of the pose codec, {target}")
    titles = ("frames", "at a step", "to a target", f"to {MAXIMUM}"[:13], "decode", "to positions")
    print_line("", (*titles, "pose ms"))
    for kind, clip in clips.items():
        skeleton = clip.skeleton
        data = encode(clip, target).data
        places = np.random.default_rng(0).integers(0, len(clip), 200)

        def poses(data: bytes = data, skeleton: Any = skeleton, places: Any = places) -> None:
            for place in places:  # a reader keeps the last block, so each pose gets a new one
                PayloadReader(data, skeleton).channels(slice(place, place + 1))

        def positions(data: bytes = data, skeleton: Any = skeleton) -> object:
            return forward_kinematics(skeleton, decode(data, skeleton))

        cells = [
            speed(len(clip), lambda clip=clip: encode_at(clip, target, -240)),
            speed(len(clip), lambda clip=clip: encode(clip, target)),
            speed(len(clip), lambda clip=clip: encode(clip, MAXIMUM)),
            speed(len(clip), lambda data=data, skeleton=skeleton: decode(data, skeleton)),
            speed(len(clip), positions),
            f"{1000.0 / float(speed(len(places), poses)):.2f}",
        ]
        print_line(kind, (len(clip), *cells))


def print_short_clips(clips: Mapping[str, Clip]) -> None:
    """Print what a clip of a folder of short ones takes to build, beyond what the first takes."""
    seconds = []
    with tempfile.TemporaryDirectory() as work:
        for n_clips in (1, SHORT_CLIPS):
            folder = Path(work) / f"{n_clips}"
            for i in range(n_clips):
                clip = list(clips.values())[i % len(clips)]
                first = 7 * i % max(len(clip) - SHORT_FRAMES, 1)
                folder.mkdir(exist_ok=True)
                write_clip(clip[first : first + SHORT_FRAMES], folder / f"short_{i}.bvh")
            start = time.process_time()
            build_library(
                folder, Path(work) / f"{n_clips}.mocapdb", BuildSettings(TARGETS[0]), jobs=1
            )
            seconds.append(time.process_time() - start)
    each = (seconds[1] - seconds[0]) / (SHORT_CLIPS - 1)
    print(f"\nA folder of clips of {SHORT_FRAMES} frames: {each:.3f} s of processor time a clip")


def print_memory(clip: Clip, target: Target) -> None:
    """Print what ten minutes of motion take besides their channels, at the most."""
    n_frames = round(600 * clip.fps)
    channels = np.tile(clip.channels, (-(-n_frames // len(clip)), 1))[:n_frames]
    long = clip.replace(channels=channels)
    tracemalloc.start()
    data = encode(long, target).data
    encoding = tracemalloc.get_traced_memory()[1]
    tracemalloc.reset_peak()
    reader = PayloadReader(data, clip.skeleton)
    for first in range(0, n_frames, 4000):
        reader.channels(slice(first, first + 4000))
    reading = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    print(
        f"\nTen minutes of {clip.fps:g} fps, {channels.nbytes / 1e6:.0f} MB of channels, {target}: "
        f"{encoding / 1e6:.0f} MB besides to encode it, {reading / 1e6:.0f} MB to read it in parts"
    )


def draw(name: str, clip: Clip, path: Path) -> None:
    """Draw rate against the mean error of the shell, with ACL's points where there are any."""
    from mocapdb.plots import rate_distortion

    curves: dict[str, list[tuple[float, float]]] = {}
    for choice in DRAWN:
        curves[choice] = []
        for level in LEVELS_MM:
            payload = encode(clip, Target("mean_mm", level, joint_share=0), **CHOICES[choice])
            if payload.codec == "raw":  # no error, no place on the axis
                continue
            decoded = clip.replace(channels=decode(payload.data, clip.skeleton))
            rate = len(payload.data) / len(clip)
            curves[choice].append((rate, shell_error(clip, decoded).mean))
    acl = [row for row in measured_acl() if row["clip"] == name]
    if acl:
        curves["ACL 2.1"] = [
            (float(row["acl_bytes_per_frame"]), 10.0 * float(row["mean_cm"])) for row in acl
        ]
    ax = rate_distortion(curves, error_label=f"mean distance of the shell's points of {name} (mm)")
    ax.figure.savefig(path, dpi=120, bbox_inches="tight")
    print(f"\n{path}")


def main() -> None:
    corpus = corpus_or_exit()
    paths = {kind: corpus / path for kind, path in CLIPS.items()}
    clips = {kind: read_clip(path)[:2000] for kind, path in paths.items() if path.is_file()}
    for clip in clips.values():
        decode(encode(clip[:70], TARGETS[0]).data, clip.skeleton)  # compiles the kernels
    if len(sys.argv) > 1:
        draw("02_03", clips["run"], Path(sys.argv[1]))
        return
    for target in TARGETS:
        print_sizes(clips, target)
    print_acl(corpus)
    print_speeds(clips, TARGETS[0])
    print_short_clips(clips)
    print_memory(clips["walk"], TARGETS[0])


if __name__ == "__main__":
    main()
