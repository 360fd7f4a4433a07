"""Cycles: errors and speed on real walks and runs, and ten minutes of walking.

python benchmarks/bench_cycles.py [PICTURE]

Times are those of the processor, on one core. With a file's name it draws the period counts there
(docs/pictures/period_counts.png).
"""

from __future__ import annotations

import os
import resource
import sys
import time
from pathlib import Path
from statistics import mean, median

os.environ.setdefault("OMP_NUM_THREADS", "1")  # read when numpy loads

import numpy as np
from _corpus import corpus_or_exit

from mocapdb.corpus import read_labels, synthetic
from mocapdb.cycles import extract_cycle, seam_steps
from mocapdb.cycles.extract import Extraction
from mocapdb.cycles.synthesis.loop import jerk, root_relative_positions
from mocapdb.errors import CycleError
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip

REPEATS = 3
HANDS = ("lhand", "RightHand")
OTHER_WORDS = ("uneven", "Start", "leap", "jump")  # neither a walk nor a run throughout


def main() -> None:
    corpus = corpus_or_exit()
    found: dict[str, dict[str, Extraction]] = {}
    clips: dict[str, list[Clip]] = {}
    for label in ("walk", "run"):
        clips[label] = real_clips(corpus, label)
        found[label] = measure(label, clips[label])
    jumping_hands(clips["walk"])
    ten_minutes()
    if len(sys.argv) > 1:
        draw_counts(found, Path(sys.argv[1]))


def real_clips(corpus: Path, label: str) -> list[Clip]:
    """Return CMU's clips of a class, an AMC rather than a BVH, without their T-pose."""
    paths: dict[str, Path] = {}
    for row in read_labels(corpus / "LABELS.csv"):
        plain = not any(word in row.description for word in OTHER_WORDS)
        if row.label == label and plain and row.path.startswith("cmu/"):
            paths.setdefault(row.clip, corpus / row.path)
    return [read_clip(path, drop_tpose=True) for path in paths.values()]


def measure(label: str, clips: list[Clip]) -> dict[str, Extraction]:
    extract_cycle(clips[0])  # compiles
    found, speeds, seams, jerks, before, after = {}, [], [], [], [], []
    for clip in clips:
        seconds = []
        for _ in range(REPEATS):
            start = time.process_time()
            own = extract_cycle(clip)
            seconds.append(time.process_time() - start)
        speeds.append(len(clip) / min(seconds))
        found[clip.name] = own
        loop = own.loop()
        seams.append(seam_steps(loop.clip))
        jerks.append(
            jerk(root_relative_positions(loop.clip), clip.fps, closed=True) / own.source_jerk
        )
        before.append(loop.slide_before_mm)
        after.append(loop.slide_after_mm)
    errors = [own.template_error_rad for own in found.values()]
    apart = [abs(own.period_frames / own.guess.frames - 1) for own in found.values()]
    print(f"{len(clips)} clips of class {label}")
    print(f"  template error      mean {mean(errors):.3f}, median {median(errors):.3f} rad")
    print(f"  period              off the autocorrelation's by {100 * max(apart):.1f} % at most")
    print(f"  seam, jerk          {max(seams):.2f} median steps, {max(jerks):.2f}, at most")
    print(f"  feet slide          {mean(before):.1f} mm, held {mean(after):.1f} mm")
    print(f"  speed               median {median(speeds):,.0f} frames/s, one core")
    return found


def jumping_hands(clips: list[Clip]) -> None:
    """Let a hand jump by 1, 2 and 3 rad in a third of the frames: each third, and scattered."""
    rng = np.random.default_rng(0)
    laps_off, period_off = [], []
    for clip in clips:
        skeleton = clip.skeleton
        hand = next(skeleton.joint(name) for name in HANDS if name in skeleton.names)
        usual = extract_cycle(clip)
        order = np.arange(len(clip))
        for frames in (*np.array_split(order, 3), rng.permutation(order)[: len(clip) // 3]):
            for radians in (1.0, 2.0, 3.0):
                channels = clip.channels.copy()
                channels[frames, skeleton.channel_starts[hand]] += np.rad2deg(radians)
                own = extract_cycle(clip.replace(channels=channels))
                laps_off.append(abs(own.laps / usual.laps - 1))
                period_off.append(abs(own.period_frames / usual.period_frames - 1))
    print(f"a hand that jumps, {len(laps_off)} times")
    print(f"  laps, period        {100 * max(laps_off):.1f}, {100 * max(period_off):.1f} % off")


def ten_minutes() -> None:
    clip = synthetic.make_clip(
        "walk", seed=3, duration_s=600, period_jitter=0.02, sensor_noise_deg=0.15
    )
    start = time.process_time()
    own = extract_cycle(clip)
    seconds = time.process_time() - start
    peak_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"ten minutes of walking, {len(clip)} frames, {own.laps:.0f} laps")
    print(f"  {seconds:.1f} s, {peak_gb:.2f} GB at most in this process")


def draw_counts(found: dict[str, dict[str, Extraction]], path: Path) -> None:
    """Draw the laps that were counted over those by autocorrelation, and where they repeat."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4.2), layout="constrained")
    counts, clarity = figure.subplots(1, 2, width_ratios=(1, 2.2))
    names = []
    for (label, own), colour in zip(found.items(), ("#0072B2", "#D55E00"), strict=False):
        guesses = [len(e.clip) / e.guess.frames for e in own.values()]
        counts.plot(guesses, [e.laps for e in own.values()], "o", ms=4, color=colour, label=label)
        for name, e in own.items():
            clarity.plot([len(names)], [len(e.clip) / e.guess.frames], "_", ms=11, color="0.4")
            clarity.plot([len(names)], [e.laps], "o", ms=3.5, color=colour)
            if e.topology is not None:
                topological = len(e.clip) / e.topology.period_frames
                clarity.plot([len(names)], [topological], "x", ms=4, color="#009E73")
            names.append(name)
    most = 1.05 * max(e.laps for own in found.values() for e in own.values())
    counts.plot([1, most], [1, most], color="0.7", lw=1, zorder=0)
    counts.set_xlabel("laps by autocorrelation")
    counts.set_ylabel("laps counted")
    counts.legend(frameon=False)
    clarity.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
    clarity.set_ylabel("laps: dot counted, dash autocorrelation,\ncross cohomology")
    for axes in (counts, clarity):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    try:
        main()
    except CycleError as problem:
        sys.exit(str(problem))
