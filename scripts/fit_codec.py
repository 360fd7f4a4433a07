"""Fit the tuned numbers of the codecs that were found on clips: mocapdb/compression/tuning.py.

    python scripts/fit_codec.py FOLDER
    python scripts/fit_codec.py FOLDER --clips 40 --target-mm 1

Prints each number as the clips of a folder would have it beside the one in the table; nothing is
written. The gains of the filters and the first sizes are part of the byte format: others need a
new layout version.

``FILTER_GAINS``
    Steady-state Kalman filters of a body that keeps its velocity, that loses it, or that keeps its
    acceleration, under many ratios of its noise to that of the measurement. They are chosen one by
    one, each as the one that saves most bits on the tracks of the clips.
``FIRST_SIZES``
    Medians of the first indices of tracks.
``STEP_OF_MEAN``, ``MEAN_OF_MAXIMUM``, ``INTEGERS_FOR_MAXIMUM``
    Medians of the ratios that they stand for.
the others
    Of some values that are tried, the one that takes the fewest bytes.
"""

from __future__ import annotations

import argparse
import importlib
import pkgutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mocapdb.compression
from mocapdb.base.kernels import jit
from mocapdb.compression import Target, tuning
from mocapdb.compression.pose import entropy
from mocapdb.compression.pose.blocks import Block, CodedClip
from mocapdb.compression.pose.modes import STILL, TRANSFORM_MODES
from mocapdb.compression.pose.pose_codec import encode_at
from mocapdb.compression.pose.pose_layout import pack
from mocapdb.compression.pose.skin_metric import error_points
from mocapdb.compression.pose.smooth_channels import channels_from_smooth, order_changes
from mocapdb.compression.pose.target_search import TargetSearch
from mocapdb.errors import MocapdbError
from mocapdb.io import read_clip
from mocapdb.io.find_files import find_motion_files
from mocapdb.motion.clip import Clip
from mocapdb.motion.skin import MotionError, channels_error

NOISES = np.geomspace(0.05, 200.0, 10)  # of a body's motion, beside the measurement's
DECAYS = (1.0, 0.93, 0.6, 0.35)  # what a velocity keeps of itself, frame by frame
ROUNDS_TO_STEADY = 1000
LEAST_MEASUREMENTS = 40  # values of a track that is worth predicting

TRIED: dict[str, tuple[float, ...]] = {
    "METRIC_DAMPING": (0.0, 1e-4, 1e-3, 3e-3, 1e-2),
    "BIT_PRICE": tuple(0.1155 * times for times in (1.2, 2.4, 4.0, 6.0)),
    "SHELL_WEIGHT": (1e-4, 1e-3, 1e-2),
    "LEAST_DISTANCE": (0.1, 0.2, 0.4),
    "TRANSFORM_HANDICAP": (1.0, 1.04, 1.08),
    "OWN_ORDER_ADVANTAGE": (0.8, 0.9, 1.0),
    "BLOCK_VALUES": (3_000, 6_000, 12_000),
}
TRIED_FOR_MAXIMUM: dict[str, tuple[float, ...]] = {
    "EMPHASIS_WINDOW_S": (0.05, 0.1, 0.2),
    "LEAST_EMPHASIS": (0.15, 0.3, 0.6),
    "EMPHASIS_POWER": (2.0, 4.0, 6.0),
    "STEP_EXPONENT": (0.6, 0.8, 1.0),
}

Gains = tuple[int, int, int, int]


def main() -> None:
    """Read the clips, fit, and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, help="AMC and BVH files, in folders or not")
    parser.add_argument("--clips", type=int, default=24, help="at most so many, evenly chosen")
    parser.add_argument("--frames", type=int, default=600, help="the first of each, at most")
    parser.add_argument("--target-mm", type=float, default=1.0, help="the mean distance")
    options = parser.parse_args()
    clips = list(some_clips(options.folder, options.clips, options.frames))
    if not clips:
        sys.exit(f"Expected motion files in {options.folder}, but none could be read.")
    print(f"{len(clips)} clips, {sum(map(len, clips))} frames, mean of {options.target_mm:g} mm")
    mean = Target("mean_mm", options.target_mm, joint_share=0)
    maximum = Target("max_mm", options.target_mm, joint_share=0)
    coded = [code(clip, mean) for clip in clips]
    fit_filters([track for one in coded for track in tracks_of(one)])
    fit_ratios(clips, coded, mean, maximum)
    for target, tried in ((mean, TRIED), (maximum, TRIED_FOR_MAXIMUM)):
        for name, values in tried.items():
            fit_by_bytes(clips, target, name, values)


def some_clips(folder: Path, n_clips: int, n_frames: int) -> Iterator[Clip]:
    """Yield the first frames of some clips of a folder; what cannot be read is passed over."""
    paths = find_motion_files(folder)
    for path in paths[:: max(1, -(-len(paths) // n_clips))]:
        try:
            yield read_clip(path)[:n_frames]
        except MocapdbError as problem:
            print(f"{path}: {problem}", file=sys.stderr)


def code(clip: Clip, target: Target) -> CodedClip:
    """Return a clip's integers at a target."""
    modes = TRANSFORM_MODES["spline" if target.is_maximum else "auto"]
    coded = TargetSearch(clip, target, modes).run()
    if coded is None:
        raise MocapdbError(f"Expected to hold {target} on {clip.name}, but no step does.")
    return coded


def show(name: str, fitted: object, shipped: object, note: str = "") -> None:
    """Print one number, or several, as fitted and as in the table."""
    print(f"{name:22}{fitted!s:>24}   in the table {shipped}{note}", flush=True)


# -- prediction ------------------------------------------------------------------------------------


def tracks_of(coded: CodedClip) -> Iterator[NDArray[np.int64]]:
    """Yield the tracks of splines, which the filters predict."""
    for block in coded.blocks:
        yield from (track for track in split(block) if len(track) >= LEAST_MEASUREMENTS)


def split(block: Block) -> list[NDArray[np.int64]]:
    """Return the tracks of a block's splines."""
    parts = np.split(block.integers.astype(np.int64), np.cumsum(block.lengths)[:-1])
    return [part for part, mode in zip(parts, block.modes, strict=True) if mode < STILL]


def fit_filters(tracks: Sequence[NDArray[np.int64]]) -> None:
    """Print the filters that predict tracks best, and the usual sizes of their first indices."""
    candidates = sorted({kalman(*law) for law in laws()})
    shipped = list(zip(*tuning.FILTER_GAINS, strict=True))
    everything = np.array(candidates + shipped, dtype=np.int64).T.copy()
    values = np.concatenate(tracks)
    starts = np.cumsum([0, *map(len, tracks)])
    predicted, scores = run_filters(values, starts, everything)
    chosen: list[int] = []
    for _ in shipped:
        costs = [bits(values, predicted, scores, [*chosen, i]) for i in range(len(candidates))]
        chosen.append(int(np.argmin(costs)))
    own = range(len(candidates), len(candidates) + len(shipped))
    found = bits(values, predicted, scores, chosen), bits(values, predicted, scores, list(own))
    n = len(values)
    print(
        f"\n{len(tracks)} tracks, {n} values; bits a value with the fitted filters and the table's:"
    )
    show("FILTER_GAINS", f"{found[0] / n:.4f}", f"{found[1] / n:.4f}")
    for row in range(4):
        print("   ", tuple(int(everything[row, i]) for i in chosen), " ", tuning.FILTER_GAINS[row])
    sizes = np.array([sizes_of(track, len(tuning.FIRST_SIZES)) for track in tracks])
    show("FIRST_SIZES", tuple(np.median(sizes, axis=0).astype(int).tolist()), tuning.FIRST_SIZES)


def laws() -> Iterator[tuple[float, float, bool]]:
    """Yield what bodies may do: noise, what a velocity keeps, whether acceleration goes on."""
    for noise in NOISES:
        for decay in DECAYS:
            yield float(noise), decay, False
        yield float(noise), 1.0, True


def kalman(noise: float, decay: float, accelerates: bool) -> Gains:
    """Return the gains of a steady Kalman filter of level, trend and bend, in 1/65536."""
    keeps = float(accelerates)
    move = np.array([[1.0, 1.0, 0.5 * keeps], [0.0, decay, decay * keeps], [0.0, 0.0, keeps]])
    push = np.array([1 / 6, 0.5, 1.0] if accelerates else [0.5, 1.0, 0.0])
    spread = np.eye(3)
    for _ in range(ROUNDS_TO_STEADY):
        ahead = move @ spread @ move.T + noise * np.outer(push, push)
        gain = ahead[:, 0] / (ahead[0, 0] + 1.0)
        spread = ahead - np.outer(gain, ahead[0])
    level, trend, bend = (round(65536 * float(part)) for part in gain)
    return level, trend, bend, round(65536 * decay)


@jit
def run_filters(
    values: NDArray[np.int64], starts: NDArray[np.int64], gains: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what each filter expects (N, filters), and its score then (see `entropy`)."""
    n_filters = gains.shape[1]
    predicted = np.zeros((len(values), n_filters))
    scores = np.zeros((len(values), n_filters))
    for track in range(len(starts) - 1):
        for i in range(n_filters):
            level, trend, bend, score = float(values[starts[track]]), 0.0, 0.0, 0.0
            for k in range(starts[track], starts[track + 1]):
                expected = level + trend + 0.5 * bend
                predicted[k, i], scores[k, i] = expected, score
                residual = values[k] - expected
                score += abs(residual) * 256.0 - score / 32.0
                level = expected + gains[0, i] / 65536.0 * residual
                trend = gains[3, i] / 65536.0 * (trend + bend) + gains[1, i] / 65536.0 * residual
                bend += gains[2, i] / 65536.0 * residual
    return predicted, scores


def bits(
    values: NDArray[np.int64],
    predicted: NDArray[np.float64],
    scores: NDArray[np.float64],
    bank: Sequence[int],
) -> float:
    """Return about how many bits the residuals of a bank take: the mean of its two best filters."""
    return float(_bits(values, predicted, scores, np.array(bank, dtype=np.int64)))


@jit
def _bits(
    values: NDArray[np.int64],
    predicted: NDArray[np.float64],
    scores: NDArray[np.float64],
    bank: NDArray[np.int64],
) -> float:
    total = 0.0
    for k in range(len(values)):
        best, second = bank[0], bank[0]
        for i in bank[1:]:
            if scores[k, i] < scores[k, best]:
                best, second = i, best
            elif second == best or scores[k, i] < scores[k, second]:
                second = i
        expected = 0.5 * (predicted[k, best] + predicted[k, second])
        total += np.log2(1.0 + abs(values[k] - expected))
    return total


def sizes_of(track: NDArray[np.int64], n: int) -> list[int]:
    """Return the sizes, in 1/256, of a track's first indices after its first value."""
    filters, state, sizes = entropy.new_filters(1), 0, []
    entropy.update_filters(filters, 0, int(track[0]), True)
    for value in track[1 : n + 1].tolist():
        index = entropy.index_of(value - entropy.predict(filters, 0), state >> 1)
        sizes.append(256 * abs(index))
        state = entropy.next_state(state, index)
        entropy.update_filters(filters, 0, value, False)
    return sizes


# -- ratios ----------------------------------------------------------------------------------------


def fit_ratios(
    clips: Sequence[Clip], coded: Sequence[CodedClip], mean: Target, maximum: Target
) -> None:
    """Print the ratios that tell the search where to begin."""
    steps, means, integers = [], [], []
    for clip, at_mean in zip(clips, coded, strict=True):
        qp = at_mean.blocks[0].qp
        error = error_of(clip, at_mean).vertices
        steps.append(2.0 ** (qp / 64) * 1000.0 * clip.skeleton.metres_per_unit / error.mean)
        plain = encode_at(clip, maximum, qp)
        error = error_of(clip, plain).vertices
        means.append(error.mean / error.max)
        at_maximum = code(clip, maximum)
        first = encode_at(clip, maximum, TargetSearch(clip, maximum, (0,)).qp)
        integers.append(n_integers(at_maximum) / n_integers(first))
    print("\nmedians, and the middle half of the clips")
    for name, ratios in (
        ("STEP_OF_MEAN", steps),
        ("MEAN_OF_MAXIMUM", means),
        ("INTEGERS_FOR_MAXIMUM", integers),
    ):
        low, middle, high = np.quantile(ratios, [0.25, 0.5, 0.75])
        show(name, f"{middle:.3f} ({low:.3f} to {high:.3f})", getattr(tuning, name))


def error_of(clip: Clip, coded: CodedClip) -> MotionError:
    """Return the error that a clip's integers leave."""
    smooth = np.concatenate([block.values() for block in coded.blocks])
    changes = order_changes(clip.skeleton, coded.skeleton.rotation_orders)
    return channels_error(clip.skeleton, clip.channels, channels_from_smooth(changes, smooth))


def n_integers(coded: CodedClip) -> int:
    """Return how many integers a clip has."""
    return sum(len(block.integers) for block in coded.blocks)


# -- choices by bytes ------------------------------------------------------------------------------


def fit_by_bytes(clips: Sequence[Clip], target: Target, name: str, values: Sequence[float]) -> None:
    """Print what clips take with each of some values of a number, and which is the best."""
    sizes = []
    for value in values:
        with changed(name, value):
            packed = (pack(code(clip, target), clip.skeleton, b"") for clip in clips)
            sizes.append(sum(map(len, packed)))
    tried = ", ".join(f"{v:g}: {size}" for v, size in zip(values, sizes, strict=True))
    shipped = getattr(tuning, name)
    best = min(zip(sizes, values, strict=True), key=lambda one: (one[0], one[1] != shipped))[1]
    show(name, f"{best:g}", f"{shipped:g}", f"   bytes at a {target.kind} {tried}")


@contextmanager
def changed(name: str, value: float) -> Iterator[None]:
    """Give a tuned number another value, in every module that has imported it."""
    homes = [module for module in modules() if hasattr(module, name)]
    before = getattr(tuning, name)
    try:
        for module in homes:
            setattr(module, name, value)
        error_points.cache_clear()
        yield
    finally:
        for module in homes:
            setattr(module, name, before)
        error_points.cache_clear()


def modules() -> list[Any]:
    """Return every module of the codecs."""
    found = pkgutil.walk_packages(mocapdb.compression.__path__, "mocapdb.compression.")
    return [importlib.import_module(each.name) for each in found]


if __name__ == "__main__":
    main()
