"""Loops: knees and feet where feet are held, a lap left out, and the means of classes.

python benchmarks/bench_loops.py

On every walk, run and jog at hand, AMC and BVH; laps are left out of CMU's plain walks and runs,
each once. A peak acceleration is that of a knee or an ankle
in three laps, its ratio that of the held loop to the one with loose feet. A lap left out: the
curve is fitted to the other laps, and its template error taken on that lap; beside it the lap next
to it, closed by a crossfade over a tenth of it.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections import defaultdict
from collections.abc import Iterator
from statistics import mean

os.environ.setdefault("OMP_NUM_THREADS", "1")  # read when numpy loads

import numpy as np
from _corpus import corpus_or_exit

from mocapdb.base.arrays import FloatArray
from mocapdb.corpus import read_labels
from mocapdb.cycles import HarmonicRegression, average_cycles, extract_cycle
from mocapdb.cycles.curve.lap_noise import lap_smoothing
from mocapdb.cycles.curve.typical_curve import TypicalCurve
from mocapdb.cycles.cycle import Cycle
from mocapdb.cycles.extract import Extraction
from mocapdb.cycles.template_error import match_template
from mocapdb.cycles.tuning import N_HARMONICS
from mocapdb.errors import MocapdbError
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_legs
from mocapdb.motion.kinematics import forward_kinematics

WORDS = ("walk", "run", "jog")
OTHER_WORDS = ("uneven", "Start", "leap", "jump")  # neither a walk nor a run throughout
LEAST_REST = 0.98  # laps that have to be left beside the one left out
EDGE = 4  # frames without derivatives at either end
FADE = 0.1  # of a lap
ESTIMATES = ("cycle", "not smoothed", "typical trajectory", "crossfade")


def main() -> None:
    held: dict[str, float] = {}
    slides: list[tuple[float, float]] = []
    left_out: list[FloatArray] = []
    cycles: dict[str, list[Cycle]] = defaultdict(list)
    for name, kind, is_plain, found in extractions():
        ratio, slide = peak_ratio(found)
        held[name] = ratio
        slides.append(slide)
        errors = list(laps_left_out(found)) if is_plain else []
        if errors:
            left_out.append(np.mean(errors, axis=0))
        cycles[kind].append(found.cycle)
    worst = max(held, key=lambda name: held[name])
    over = sum(ratio > 1.5 for ratio in held.values())
    print(f"{len(held)} walks, runs and jogs")
    print(f"  peak acceleration   {held[worst]:.2f} times that of loose feet at most ({worst}); "
          f"over 1.5 in {over}")  # fmt: skip
    before, after = (mean(each) for each in zip(*slides, strict=True))
    print(f"  feet slide          {before:.2f} mm, held {after:.2f} mm")
    print(f"a lap left out, {len(left_out)} clips, rad")
    for what, errors in zip(ESTIMATES, np.transpose(left_out), strict=True):
        print(f"  {what:<20}mean {np.mean(errors):.3f}, median {np.median(errors):.3f}")
    print("classes: stride, cadence and knee peak off the members' means, %")
    for kind, members in cycles.items():
        if len(members) > 2:
            print(f"  {kind:<20}{class_errors(kind, members)}")


def extractions() -> Iterator[tuple[str, str, bool, Extraction]]:
    """Yield each clip's name, its class with its format, whether it is plain, and its cycle.

    Plain are CMU's walks and runs on even ground, each once, as `bench_cycles` has them.
    """
    seen: set[str] = set()
    corpus = corpus_or_exit()
    for row in read_labels(corpus / "LABELS.csv"):
        label = next((w for w in WORDS if w in f"{row.label} {row.description}".lower()), None)
        if label is None:
            continue
        try:
            found = extract_cycle(read_clip(corpus / row.path, drop_tpose=True))
        except MocapdbError as problem:
            print(f"  {row.clip}: {problem}", file=sys.stderr)
            continue
        source = "hdm05" if "hdm05" in row.path else row.path.rpartition(".")[2]
        other = any(word in row.description for word in OTHER_WORDS)
        is_plain = row.label in WORDS and source != "hdm05" and not other and row.clip not in seen
        seen.add(row.clip)
        yield f"{row.clip} ({source})", f"{label}, {source}", is_plain, found


def peak_ratio(found: Extraction) -> tuple[float, tuple[float, float]]:
    """Return the worst ratio of peak accelerations, and how far feet slide, loose and held."""
    peaks = []
    for hold in (False, True):
        loop = found.loop(n_laps=3, hold_feet=hold)
        positions = positions_of(loop.clip)
        legs = find_legs(loop.clip.skeleton, positions)
        joints = [joint for leg in legs for joint in (leg.knee, leg.ankle)]
        bends = np.linalg.norm(np.diff(positions[:, joints], n=2, axis=0), axis=2)
        peaks.append(bends.max(axis=0))
    return float((peaks[1] / peaks[0]).max()), (loop.slide_before_mm, loop.slide_after_mm)


def laps_left_out(found: Extraction) -> Iterator[list[float]]:
    """Yield the errors of `ESTIMATES` on each lap that they are made without."""
    values = found.rotation_values.encode(found.clip)
    phase, n_frames = found.timing.phase, round(found.period_frames)
    grid = np.arange(n_frames) / n_frames
    for number in range(int(found.laps)):
        lap = np.arange(number * n_frames, min((number + 1) * n_frames, len(values)))
        rest = np.setdiff1d(np.arange(EDGE, len(values) - EDGE), lap)
        if len(rest) < LEAST_REST * n_frames:
            continue
        most = min(N_HARMONICS, (len(rest) - 2) // 2, n_frames // 2 - 1)
        smoothing = lap_smoothing(phase[rest], values[rest], found.period_frames)
        curve = HarmonicRegression(most, model="m2").fit(
            phase[rest], values[rest], smoothing=smoothing
        )
        plain = HarmonicRegression(most, model="m2").fit(phase[rest], values[rest])
        typical = TypicalCurve(phase[rest], values[rest], found.period_frames)
        beside = crossfaded(values, number, n_frames)
        if beside is not None:
            laps = [each.predict(grid) for each in (curve, plain, typical)]
            yield [match_template(values[lap], each).error for each in (*laps, beside)]


def crossfaded(values: FloatArray, number: int, n_frames: int) -> FloatArray | None:
    """Return the lap before or after one, closed by a crossfade; None where there is none."""
    fade = round(FADE * n_frames)
    for start in ((number - 1) * n_frames, (number + 1) * n_frames):
        room = min(fade, len(values) - start - n_frames)
        if start < 0 or room < 0:
            continue
        lap = values[start : start + n_frames].copy()
        share = ((np.arange(room) + 0.5) / max(room, 1))[:, None]
        after = values[start + n_frames : start + n_frames + room]
        lap[:room] = share * lap[:room] + (1 - share) * after
        return lap
    return None


def class_errors(name: str, cycles: list[Cycle]) -> str:
    found = average_cycles(cycles, name)
    kept = [gait_of(cycle) for cycle in cycles if cycle.name in found.members]
    off = 100 * (gait_of(found.cycle) / np.mean(kept, axis=0) - 1)
    return f"{', '.join(f'{each:+.1f}' for each in off)} ({len(kept)} of {len(cycles)})"


def gait_of(cycle: Cycle) -> FloatArray:
    """Return stride in metres, steps a minute, and the mean of both knees' peaks in degrees."""
    skeleton = cycle.skeleton
    positions = cycle.pose(np.arange(128) / 128).positions
    peaks = []
    for leg in find_legs(skeleton, positions):
        thigh = positions[:, leg.knee] - positions[:, leg.hip]
        shank = positions[:, leg.ankle] - positions[:, leg.knee]
        lengths = np.linalg.norm(thigh, axis=1) * np.linalg.norm(shank, axis=1)
        peaks.append(np.rad2deg(np.arccos((thigh * shank).sum(axis=1) / lengths)).max())
    level = np.delete(cycle.advance, skeleton.up_index)
    stride_m = float(np.linalg.norm(level)) * skeleton.metres_per_unit
    return np.array([stride_m, 120 / cycle.period_s, np.mean(peaks)])


def positions_of(clip: Clip) -> FloatArray:
    return forward_kinematics(clip.skeleton, clip.channels).positions


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
