"""Fit the thresholds of periods and of timing again: mocapdb/cycles/tuning.py.

    python scripts/fit_cycles.py FOLDER [--most 40] [--only NAME ...]

FOLDER has clips and a LABELS.csv (see `mocapdb.corpus.read_labels`). Its laps are known where a
label tells them, as HDM05's do (``jogLeftCircle4StepsRstart`` is two laps, ``squat1Reps`` is none
that repeats), and for clips labelled walk or run: the truth of what is cut from them, thinned or
disturbed is the period of the whole. Synthetic clips, whose phase is known, come on top.

Each threshold of the period is tried with the others as shipped. What it is worth is the mean mark
of the trials: 1 for the right period and frames, less the farther they are off, 0 from 3 % of the
period on; 1 for refusing a clip in which nothing repeats. Each threshold of the timing is judged by
the error of the phase of synthetic clips, steady and drifting. The fitted value is the middle of
those that are worth the most; it is printed beside the shipped one, and a person changes the table.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mocapdb.corpus import read_labels, synthetic
from mocapdb.cycles import tuning
from mocapdb.cycles.curve.flips import bridge_flips
from mocapdb.cycles.curve.rotation_values import choose_rotation_values
from mocapdb.cycles.period.autocorrelation import guess_period
from mocapdb.cycles.period.periodic_ranges import repeating_ranges
from mocapdb.cycles.phase.circular_coordinates import find_coordinates
from mocapdb.cycles.phase.pose_cloud import Embedding, principal_axes
from mocapdb.cycles.phase.timing import time_phases
from mocapdb.errors import NoPeriodError
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange

OF_PERIOD = (
    "CLEAR_DIFFERENCE", "NEAR_LOWEST", "UNRELATED_DIFFERENCE", "WINDOW_LAPS", "TEMPO_CHANGE",
    "POSTURE_WEIGHT", "SIMILAR_DIFFERENCE", "SHARE_REPEATED", "LEAST_VARIANCE", "COMPARABLE_PATH",
    "LAG_REACH", "LEAST_LAPS_OF_RANGE", "LAPS_BEYOND_DOUBT", "SHORTER_PERIOD",
    "SHORTER_PERIOD_PATH", "CLEAR_PERIOD", "END_WINDOW_LAPS", "END_TEMPO", "END_VARIANCE",
    "END_TOLERANCE", "END_DIFFERENCE",
)  # fmt: skip
OF_TIMING = (
    "STEADY_LAPS",
    "DRIFT_GAIN",
    "DRIFT_DEVIATION",
    "LAPS_BETWEEN_KNOTS",
    "TEMPO_STIFFNESS",
)
BOUNDS = {  # beyond them not even the best lag or range would do
    "NEAR_LOWEST": (1.0, np.inf),
    "UNRELATED_DIFFERENCE": (0.0, 0.99),
    "SHARE_REPEATED": (0.0, 1.0),
    "COMPARABLE_PATH": (0.0, 1.0),
}
FACTORS = (0.5, 0.65, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0)
RIGHT = 0.03
AS_GOOD = 0.003  # of the mean mark
AS_NEAR = 1.02  # times the least error of the phase
COUNTED = re.compile(r"(\d+)(Reps|Steps|hops)")
LAPS_OF = {"Reps": 1.0, "Steps": 0.5, "hops": 1.0}  # two steps are a lap
UNEVEN = ("uneven", "Start", "leap", "jump")  # descriptions of walks that are not walks throughout
CUT_LAPS = (1.2, 1.3, 1.8, 2.3)


class Trial(NamedTuple):
    """Poses whose period is known; None if nothing repeats in them.

    `frames` are those that repeat, all by default.
    """

    cloud: np.ndarray
    fps: float
    period_frames: float | None
    frames: FrameRange | None = None


class Timed(NamedTuple):
    """Values (F, D) whose phase in laps is known, and what cohomology makes of them."""

    values: np.ndarray
    period_frames: float
    coordinates: np.ndarray | None
    phase: np.ndarray


def trial(clip: Clip, period_frames: float | None) -> Trial:
    """Return a clip's poses as the search for periods sees them."""
    cloud = Embedding().cloud(bridge_flips(clip).clip)[:, : tuning.PERIOD_AXES]
    return Trial(cloud, clip.fps, period_frames)


def labelled_trials(folder: Path, most: int) -> Iterator[Trial]:
    """Yield trials of at most so many clips of each kind of label."""
    rows = read_labels(folder / "LABELS.csv")
    counted = [(row, COUNTED.search(row.label)) for row in rows]
    several = [(row.path, match) for row, match in counted if match]
    steady = [
        row.path
        for row in rows
        if row.label in ("walk", "run") and not any(word in row.description for word in UNEVEN)
    ]
    for path, match in several[:: max(1, len(several) // most)]:
        clip = read_clip(folder / path)
        laps = int(match[1]) * LAPS_OF[match[2]]
        if laps <= 1:
            yield trial(clip, None)
        else:
            yield trial(clip, len(clip) / laps)
    for path in steady[:: max(1, len(steady) // most)]:
        yield from variants(read_clip(folder / path, drop_tpose=True))


def variants(clip: Clip) -> Iterator[Trial]:
    """Yield what is cut from a clip, thinned and disturbed, with the period of the whole."""
    whole = trial(clip, None)
    try:
        period = guess_period(whole.cloud).frames
    except NoPeriodError:
        return
    yield whole._replace(period_frames=period)
    for laps in CUT_LAPS:
        start = (len(clip) - round(laps * period)) // 2
        if start >= 0:
            yield trial(clip[start : start + round(laps * period)], period)
    yield trial(clip.replace(channels=clip.channels[::4], fps=clip.fps / 4), period / 4)
    noise = np.random.default_rng(0).normal(0.0, 1.0, clip.channels.shape)
    noise[:, :3] = 0.0
    yield trial(clip.replace(channels=clip.channels + noise), period)


def synthetic_trials(seeds: Sequence[int]) -> Iterator[Trial]:
    """Yield clips of known period: short, long, drifting, and with rest before and after."""
    for seed in seeds:
        for kind in synthetic.CLASSES:
            for n_cycles, drift in ((1.3, 0.0), (2.4, 0.0), (5.0, 0.2)):
                clip, truth = synthetic.make(
                    kind, seed=seed, n_cycles=n_cycles, tempo_drift=drift, sensor_noise_deg=0.3
                )
                yield trial(clip, truth.period_frames)
            rest = 150 + 50 * (seed % 5)
            ends = [np.repeat(clip.channels[[i]], rest, axis=0) for i in (0, -1)]
            padded = clip.replace(channels=np.vstack([ends[0], clip.channels, ends[1]]))
            moving = FrameRange(rest, rest + len(clip))
            yield trial(padded, truth.period_frames)._replace(frames=moving)
            yield trial(clip[: round(0.8 * truth.period_frames)], None)


def timed_clips(seeds: Sequence[int]) -> Iterator[Timed]:
    """Yield synthetic clips of known phase, from steady to strongly drifting."""
    for seed in seeds:
        for kind in ("walk", "run", "wave"):
            for n_cycles, drift in (
                (3, 0.0),
                (4, 0.15),
                (6, 0.05),
                (6, 0.4),
                (10, 0.02),
                (12, 0.2),
            ):
                clip, truth = synthetic.make(
                    kind, seed=seed, n_cycles=n_cycles, tempo_drift=drift, sensor_noise_deg=0.3
                )
                values = choose_rotation_values(clip).encode(clip)
                period = float(truth.period_frames)
                coordinates = None
                try:
                    found = find_coordinates(Embedding().cloud(clip), period, clip.fps)
                    if abs(found.period_frames / period - 1.0) < tuning.AGREEMENT:
                        coordinates = found.phase(len(clip))
                except NoPeriodError:
                    pass  # time is then told without coordinates, as extractions do
                axes = principal_axes(values, tuning.PERIOD_AXES)
                yield Timed(axes, period, coordinates, truth.phase / (2 * np.pi))


def mark(one: Trial) -> float:
    """Return how right the likeliest range of a trial is, from 0 to 1."""
    try:
        found = repeating_ranges(one.cloud, one.fps)[0]
    except NoPeriodError:
        return float(one.period_frames is None)
    if one.period_frames is None:
        return 0.0
    off = abs(found.period_frames / one.period_frames - 1.0)
    frames = one.frames or FrameRange(0, len(one.cloud))
    shared = found.overlap(frames)
    return max(0.0, 1.0 - off / RIGHT) * shared / (len(found) + len(frames) - shared)


def mean_mark(trials: Sequence[Trial]) -> float:
    """Return the mean mark of trials."""
    return float(np.mean([mark(one) for one in trials]))


def phase_error(clips: Sequence[Timed]) -> float:
    """Return the mean over clips of the phase's standard error, in laps."""
    errors = []
    for one in clips:
        off = time_phases(one.values, one.period_frames, one.coordinates).phase - one.phase
        errors.append(float(np.std(off)))
    return float(np.mean(errors))


@contextmanager
def constant(name: str, value: float) -> Iterator[None]:
    """Give a constant another value in every module that has imported it."""
    modules = [
        module
        for key, module in list(sys.modules.items())
        if key.startswith("mocapdb.cycles") and name in vars(module)
    ]
    shipped = getattr(tuning, name)
    try:
        for module in modules:
            setattr(module, name, value)
        yield
    finally:
        for module in modules:
            setattr(module, name, shipped)


def fit(name: str, worth: Callable[[], float], as_good: Callable[[float, float], bool]) -> None:
    """Try values of a constant; print the middle one of the best beside the shipped one."""
    shipped = getattr(tuning, name)
    least, most = BOUNDS.get(name, (0.0, np.inf))
    values = [shipped * factor for factor in FACTORS if least <= shipped * factor <= most]
    found = []
    for value in values:
        with constant(name, value):
            found.append(worth())
    best = max(found)
    good = [value for value, own in zip(values, found, strict=True) if as_good(own, best)]
    fitted = good[(len(good) - 1) // 2]
    now = found[values.index(shipped)]
    print(
        f"{name:<22}{shipped:>9.4g}{fitted:>9.4g}   {good[0]:.4g} to {good[-1]:.4g}"
        f"   {abs(now):.4f} -> {abs(best):.4f}",
        flush=True,
    )


def main() -> None:
    """Gather trials, try the thresholds, print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, help="clips and LABELS.csv")
    parser.add_argument("--most", type=int, default=40, help="clips of each kind of label")
    parser.add_argument("--seeds", type=int, default=3, help="synthetic clips of each class")
    parser.add_argument("--only", nargs="*", default=[*OF_PERIOD, *OF_TIMING])
    options = parser.parse_args()
    seeds = range(options.seeds)
    wanted = [name for name in OF_PERIOD if name in options.only]
    if wanted:
        trials = [*labelled_trials(options.folder, options.most), *synthetic_trials(seeds)]
        print(f"{len(trials)} trials; mean mark, shipped -> fitted")
        print(f"{'constant':<22}{'shipped':>9}{'fitted':>9}   as good")
        for name in wanted:
            fit(name, lambda: mean_mark(trials), lambda own, best: own >= best - AS_GOOD)
    wanted = [name for name in OF_TIMING if name in options.only]
    if wanted:
        clips = list(timed_clips(seeds))
        print(f"{len(clips)} synthetic clips; error of the phase in laps, shipped -> fitted")
        for name in wanted:
            fit(name, lambda: -phase_error(clips), lambda own, best: own >= AS_NEAR * best)


if __name__ == "__main__":
    main()
