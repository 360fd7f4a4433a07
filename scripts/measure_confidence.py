"""Measure how often cycles of each confidence have the right period: mocapdb/cycles.

    python scripts/measure_confidence.py FOLDER [--most 12] [--seeds 6]
    python scripts/measure_confidence.py FOLDER --others [--also FILE...]

FOLDER has clips and a LABELS.csv. Real walks and runs, whose truth is the period of the whole clip,
and synthetic clips of all classes, whose period is known, are cut to 1.2 to 2.6 laps, taken at
other rates, given noise, a tempo that drifts, held ends, rest before and after, and stops; single
actions have no period, so that every period of them is wrong. A period is right within 3 %,
of real clips cut to few laps within 5 %.

The first line has the trials that the evidence was set on. ``--others`` has trials that nothing was
set on: other clips, other people, other cuts, rates, noise, drift, rests and stops.

Prints for each band of confidence how many extractions there are and what share of them is right.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mocapdb.corpus import read_labels, synthetic
from mocapdb.corpus.labels import LabelRow
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


class Disturbances(NamedTuple):
    """What trials are made by."""

    laps: tuple[float, ...]
    strides: tuple[int, ...]
    noise_deg: tuple[float, ...]
    held_share: float
    rest_frames: tuple[int, int]
    stop_frames: int
    drifts: tuple[float, ...]
    first_seed: int


SET_ON = Disturbances(
    (1.2, 1.4, 1.8, 2.6), (2, 4, 5), (0.5, 1.5), 0.4, (120, 90), 80, (0.0, 0.1, 0.3), 0
)
OTHERS = Disturbances(
    (1.3, 1.6, 2.2, 3.0), (3, 6), (0.3, 1.0, 2.0), 0.25, (40, 200), 130, (0.05, 0.15, 0.25), 500
)


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
    by: Disturbances,
    laps_at: np.ndarray | None = None,
) -> Iterator[Trial]:
    """Yield what is cut from a clip, thinned and disturbed; `laps_at` (F,) is its known phase."""
    period = period_s * clip.fps
    for laps in by.laps:
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
        for stride in by.strides:
            thinned = clip.replace(channels=clip.channels[::stride], fps=clip.fps / stride)
            yield Trial(f"{name} at {thinned.fps:g} Hz", thinned, period_s)
    for degrees in by.noise_deg:
        noise = rng.normal(0.0, degrees, clip.channels.shape)
        noise[:, :3] = 0.0
        noisy = clip.replace(channels=clip.channels + noise)
        yield Trial(f"{name} noise {degrees}", noisy, period_s)
    last = len(clip) - 1
    yield Trial(f"{name} held end", rested(clip, last, round(by.held_share * len(clip))), period_s)
    before, after = by.rest_frames
    yield Trial(f"{name} rest", rested(rested(clip, last, after), 0, before), period_s)
    if len(clip) > 1.8 * period:
        yield Trial(f"{name} stop", rested(clip, len(clip) // 2, by.stop_frames), period_s)


def spread(rows: Sequence[LabelRow], count: int, *, others: bool) -> list[LabelRow]:
    """Return every so many rows; or, of those that are not among these, as many."""
    step = max(1, len(rows) // count)
    if not others:
        return list(rows[::step])
    left = [row for number, row in enumerate(rows) if number % step]
    return left[:: max(1, len(left) // count)]


def trials(
    folder: Path, most: int, seeds: int, *, others: bool, also: Sequence[Path]
) -> Iterator[Trial]:
    """Yield all trials."""
    by = OTHERS if others else SET_ON
    rng = np.random.default_rng(by.first_seed)
    rows = list(read_labels(folder / "LABELS.csv"))
    steady = [
        row
        for row in rows
        if row.label in ("walk", "run") and not any(word in row.description for word in UNEVEN)
    ]
    chosen = spread(steady, most, others=others)
    for path in [*(folder / row.path for row in chosen), *also]:
        clip = read_clip(path, drop_tpose=True)
        try:
            period_s = guess_period(Embedding().cloud(clip)).frames / clip.fps
        except MocapdbError:
            continue
        yield from variants(path.stem, clip, period_s, rng, by)
    single = [row for row in rows if row.label.endswith("1Reps") or "lieDown" in row.label]
    for row in spread(single, 3 * most, others=others):
        yield Trial(Path(row.path).stem, read_clip(folder / row.path), None)
    for seed in range(by.first_seed, by.first_seed + seeds):
        for kind in synthetic.CLASSES:
            drift = float(rng.choice(by.drifts))
            clip, truth = synthetic.make(
                kind, seed=seed, n_cycles=4.0, tempo_drift=drift, period_jitter=0.02,
                sensor_noise_deg=0.2,
            )  # fmt: skip
            if drift < 0.2:  # a part of a drifting clip has a period of its own
                laps_at = truth.phase / (2 * np.pi)
                yield from variants(f"{kind} {seed}", clip, truth.period_s, rng, by, laps_at)
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
    parser.add_argument("--others", action="store_true", help="trials that nothing was set on")
    parser.add_argument(
        "--also", type=Path, nargs="*", default=[], metavar="FILE", help="more walks and runs"
    )
    options = parser.parse_args()
    counts: dict[tuple[float, float], list[bool]] = defaultdict(list)
    refused = 0
    for one in trials(
        options.folder, options.most, options.seeds, others=options.others, also=options.also
    ):
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
