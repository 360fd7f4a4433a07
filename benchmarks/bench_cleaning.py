"""How fast the neighbours of motion-words are found.

    python benchmarks/bench_cleaning.py [HOURS]
    python benchmarks/bench_cleaning.py long

In CPU seconds of one core, on synthetic motion: a clip of 20 s against itself, then all words of
600 s against 600 s, then the clip against HOURS (10) of context, exactly and among candidates: the
600 s again and again, each time by another body (constant turns) that wanders (slow turns).

``long`` cleans takes of 40 s and 600 s with a fault for every 8 s, and prints the seconds of
finding and of repairing, how they grow, and the most memory that the process took.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mocapdb.cleaning import clean_clip, detect_faults, repair_spans
from mocapdb.cleaning.local_rotations import Texture, motion_texture
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary, find_neighbours
from mocapdb.cleaning.tuning import N_CANDIDATES, TARGET_FRAMES
from mocapdb.corpus import synthetic
from mocapdb.motion.clip import Clip
from mocapdb.motion.quaternions import from_rotation_vectors_deg, multiply

CONTEXT_S = 600
LONG_TAKES_S = (40, 600)


def main() -> None:
    if sys.argv[1:] == ["long"]:
        _time_long_takes()
        return
    kinds = ("walk", "run", "hop", "box", "wave", "squat")
    clips = [
        synthetic.make_clip(
            kinds[i % len(kinds)], seed=i, duration_s=20, phase_noise=0.3, sensor_noise_deg=0.3
        )
        for i in range(CONTEXT_S // 20)
    ]
    textures = [motion_texture(clip) for clip in clips]
    find_neighbours(textures[0], textures[:1])  # compiles
    start = time.process_time()
    find_neighbours(textures[0], textures[:1])
    print(f"20 s against itself: {time.process_time() - start:.3f} s")

    n_pairs = 0
    start = time.process_time()
    for texture in textures:
        found = find_neighbours(texture, textures)
        n_pairs += len(found.starts) * sum(len(t) - TARGET_FRAMES + 1 for t in textures)
    seconds = time.process_time() - start
    print(
        f"{CONTEXT_S} s against {CONTEXT_S} s: {seconds:.1f} s for {n_pairs / 1e6:.1f} M pairs of "
        f"words ({1e9 * seconds / n_pairs:.0f} ns each)"
    )
    hours = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    if hours:
        _time_large_context(textures, hours)


def _time_long_takes() -> None:
    skeleton = synthetic.make_skeleton()
    kinds = ("walk", "run", "hop", "box", "wave", "squat")

    def take(seconds: int) -> Clip:
        """A take of several motions after each other, with faults."""
        parts = [
            synthetic.make_clip(
                kinds[i % len(kinds)], seed=i, duration_s=20, phase_noise=0.3,
                sensor_noise_deg=0.1, skeleton=skeleton,
            )
            for i in range(seconds // 20)
        ]  # fmt: skip
        whole = parts[0].replace(channels=np.concatenate([part.channels for part in parts]))
        return synthetic.inject_faults(whole, seed=1, n=seconds // 8, size_deg=(20, 90)).clip

    clean_clip(take(20)[:1200])  # compiles
    spent = []
    for seconds in LONG_TAKES_S:
        clip = take(seconds)
        start = time.process_time()
        found = detect_faults(clip)
        middle = time.process_time()
        repair_spans(clip, found)
        end = time.process_time()
        spent.append(end - start)
        megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"{seconds} s: found in {middle - start:.1f} s, repaired in {end - middle:.1f} s, "
            f"{len(found.spans)} spans, at most {megabytes:.0f} MB"
        )
    times, longer = spent[1] / spent[0], LONG_TAKES_S[1] / LONG_TAKES_S[0]
    print(f"{longer:g} times as long takes {times:.1f} times the time")


def _time_large_context(textures: list[Texture], hours: float) -> None:
    source = motion_texture(synthetic.make_clip("walk", seed=99, duration_s=20, phase_noise=0.3))
    vocabulary = Vocabulary.of(_others(textures, round(hours * 3600 / CONTEXT_S)))
    find_neighbours(source, textures[:1], n_candidates=1)  # compiles
    found, seconds = [], []
    for n_candidates in (None, N_CANDIDATES):
        start = time.process_time()
        found.append(find_neighbours(source, vocabulary, n_candidates=n_candidates))
        seconds.append(time.process_time() - start)
    pairs = zip(found[0].targets, found[1].targets, strict=True)
    recall = np.mean([len(set(exact) & set(some)) / len(exact) for exact, some in pairs])
    length_h = len(vocabulary) / source.fps / 3600
    print(
        f"20 s against {length_h:.1f} hours: exactly {seconds[0]:.1f} s, "
        f"among candidates {seconds[1]:.1f} s with recall {recall:.4f}"
    )


def _others(textures: list[Texture], n: int) -> Iterator[Texture]:
    """Yield every texture n times, each time by another body that wanders."""
    rng = np.random.default_rng(0)
    for _ in range(n):
        for texture in textures:
            shape = texture.quat_xyzw.shape[:2]
            knots = rng.normal(0, 3, (8, shape[1], 3))
            at = np.linspace(0, 6.999, shape[0])
            low, share = at.astype(int), (at % 1)[:, None, None]
            turns = rng.normal(0, 4, (shape[1], 3))
            turns = turns + (1 - share) * knots[low] + share * knots[low + 1]
            yield replace(
                texture, quat_xyzw=multiply(texture.quat_xyzw, from_rotation_vectors_deg(turns))
            )


if __name__ == "__main__":
    main()
