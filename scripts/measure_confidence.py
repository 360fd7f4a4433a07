"""Measure how often cycles of each confidence have the right period: mocapdb/cycles.

    python scripts/measure_confidence.py FOLDER [--most 12] [--seeds 6]

FOLDER has clips and a LABELS.csv. Real walks and runs, whose truth is the period of the whole clip,
and synthetic clips of all classes, whose period is known, are cut to 1.2 to 2.6 laps, taken at
other rates, given noise, a tempo that drifts, held ends, rest before and after, and stops; single
actions have no period, so that every period of them is wrong. A period is right within 3 %,
of real clips cut to few laps within 5 %.

Prints for each band of confidence how many extractions there are and what share of them is right.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mocapdb.corpus import read_labels, synthetic
from mocapdb.cycles import extract_cycle
from mocapdb.cycles.period.autocorrelation import guess_period
from mocapdb.cycles.phase.pose_cloud import Embedding
from mocapdb.errors import MocapdbError
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip

RIGHT = 0.03
RIGHT_OF_CUT = 0.05  # of real clips cut to few laps: a person's laps differ by 2 to 4 %
BANDS = ((0.0, 0.1), (0.1, 0.3), (0.3, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1.01))
UNEVEN = ("uneven", "Start", "leap", "jump", "stairs")


class Trial(NamedTuple):
    """A clip whose period in seconds is known; None if it has none."""

    name: str
    clip: Clip
    period_s: float | None
    within: float = RIGHT


def rested(clip: Clip, at: int, frames: int) -> Clip:
    """Return a clip in which one frame is held."""
    times = np.ones(len(clip), dtype=int)
    times[at] += frames
    return clip.replace(channels=np.repeat(clip.channels, times, axis=0))


def variants(
    name: str,
    clip: Clip,
    period_s: float,
    rng: np.random.Generator,
    laps_at: np.ndarray | None = None,
) -> Iterator[Trial]:
    """Yield what is cut from a clip, thinned and disturbed; `laps_at` (F,) is its known phase."""
    period = period_s * clip.fps
    for laps in (1.2, 1.4, 1.8, 2.6):
        length = round(laps * period)
        if length <= len(clip):
            start = int(rng.integers(0, len(clip) - length + 1))
            part = clip[start : start + length]
            if laps_at is None:
                yield Trial(f"{name} cut to {laps}", part, period_s, RIGHT_OF_CUT)
            else:
                own = (length - 1) / (laps_at[start + length - 1] - laps_at[start])
                yield Trial(f"{name} cut to {laps}", part, own / clip.fps)
    if clip.fps >= 60:
        for stride in (2, 4, 5):
            thinned = clip.replace(channels=clip.channels[::stride], fps=clip.fps / stride)
            yield Trial(f"{name} at {thinned.fps:g} Hz", thinned, period_s)
    for degrees in (0.5, 1.5):
        noise = rng.normal(0.0, degrees, clip.channels.shape)
        noise[:, :3] = 0.0
        noisy = clip.replace(channels=clip.channels + noise)
        yield Trial(f"{name} noise {degrees}", noisy, period_s)
    yield Trial(f"{name} held end", rested(clip, len(clip) - 1, round(0.4 * len(clip))), period_s)
    yield Trial(f"{name} rest", rested(rested(clip, len(clip) - 1, 90), 0, 120), period_s)
    if len(clip) > 1.8 * period:
        yield Trial(f"{name} stop", rested(clip, len(clip) // 2, 80), period_s)


def trials(folder: Path, most: int, seeds: int) -> Iterator[Trial]:
    """Yield all trials."""
    rng = np.random.default_rng(0)
    rows = list(read_labels(folder / "LABELS.csv"))
    steady = [
        row
        for row in rows
        if row.label in ("walk", "run") and not any(word in row.description for word in UNEVEN)
    ]
    for row in steady[:: max(1, len(steady) // most)]:
        clip = read_clip(folder / row.path, drop_tpose=True)
        try:
            period_s = guess_period(Embedding().cloud(clip)).frames / clip.fps
        except MocapdbError:
            continue
        yield from variants(Path(row.path).stem, clip, period_s, rng)
    single = [row for row in rows if row.label.endswith("1Reps") or "lieDown" in row.label]
    for row in single[:: max(1, len(single) // (3 * most))]:
        yield Trial(Path(row.path).stem, read_clip(folder / row.path), None)
    for seed in range(seeds):
        for kind in synthetic.CLASSES:
            drift = float(rng.choice([0.0, 0.1, 0.3]))
            clip, truth = synthetic.make(
                kind, seed=seed, n_cycles=4.0, tempo_drift=drift, period_jitter=0.02,
                sensor_noise_deg=0.2,
            )  # fmt: skip
            if drift < 0.2:  # a part of a drifting clip has a period of its own
                yield from variants(
                    f"{kind} {seed}", clip, truth.period_s, rng, truth.phase / (2 * np.pi)
                )
            else:
                yield Trial(f"{kind} {seed} drift", clip, truth.period_s)
            short = clip[: round(0.8 * truth.period_frames)]
            yield Trial(f"{kind} {seed} less than a lap", short, None)


def main() -> None:
    """Extract, count, print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, help="clips and LABELS.csv")
    parser.add_argument("--most", type=int, default=12, help="real clips")
    parser.add_argument("--seeds", type=int, default=6, help="synthetic clips of each class")
    parser.add_argument("--wrong", action="store_true", help="list those that are wrong and sure")
    options = parser.parse_args()
    counts: dict[tuple[float, float], list[bool]] = defaultdict(list)
    refused = 0
    for one in trials(options.folder, options.most, options.seeds):
        try:
            found = extract_cycle(one.clip)
        except MocapdbError:
            refused += one.period_s is not None
            continue
        period_s = found.cycle.period_s
        right = one.period_s is not None and abs(period_s / one.period_s - 1) <= one.within
        band = next(each for each in BANDS if each[0] <= found.confidence < each[1])
        counts[band].append(right)
        if options.wrong and not right and found.confidence >= 0.5:
            told = {name: round(value, 2) for name, value in found.evidence.items()}
            print(f"{one.name}: {period_s:.2f} s for {one.period_s}, {found.confidence:.2f} {told}")
    for band in BANDS:
        rows = counts[band]
        share = f"{np.mean(rows):.3f}" if rows else "-"
        print(f"{band[0]:.1f} to {min(band[1], 1):.1f}: {len(rows):4} extractions, {share} right")
    print(f"{refused} that have a period were refused")


if __name__ == "__main__":
    main()
