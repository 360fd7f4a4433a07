"""Speed of forward kinematics and of the representations, and their round trips on every clip.

python benchmarks/bench_motion.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median

import numpy as np
from _corpus import corpus_or_exit, motion_files

from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.representations import REPRESENTATIONS, represent, restore_channels
from mocapdb.motion.skin import motion_error

REPEATS = 7


def main() -> None:
    corpus = corpus_or_exit()
    clips = [read_clip(path) for path in motion_files(corpus)]
    longest = max((c for c in clips if c.skeleton.n_channels == 62), key=len)
    print(f"forward kinematics and representations, {longest}, one core, median of {REPEATS}")
    skeleton = longest.skeleton
    speed("forward kinematics", lambda: forward_kinematics(skeleton, longest.channels), longest)
    speed("skinned error of two clips", lambda: motion_error(longest, longest), longest)
    for name in REPRESENTATIONS[1:]:
        made = represent(longest, name)
        speed(f"to {name}", lambda name=name: represent(longest, name), longest)
        speed(f"from {name}", lambda made=made: restore_channels(skeleton, made), longest)

    print(f"\nround trips of all {len(clips)} clips: largest error")
    for name in REPRESENTATIONS:
        distance_m, angle_deg = np.max([round_trip(clip, name) for clip in clips], axis=0)
        print(f"  {name:<12} {distance_m:.1e} m   {angle_deg:.1e} degrees")


def speed(what: str, run: Callable[[], object], clip: Clip) -> None:
    run()
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - start)
    print(f"  {what:<28} {len(clip) / median(seconds):>10,.0f} frames/s")


def round_trip(clip: Clip, name: str) -> tuple[float, float]:
    """Largest distance of a joint in metres, and largest angle of a rotation in degrees."""
    before = forward_kinematics(clip.skeleton, clip.channels)
    channels = restore_channels(clip.skeleton, represent(clip, name))
    after = forward_kinematics(clip.skeleton, channels)
    distance = np.abs(after.positions - before.positions).max() * clip.skeleton.metres_per_unit
    relative = np.swapaxes(before.rotations, -1, -2) @ after.rotations
    skew = relative - np.swapaxes(relative, -1, -2)
    sine = np.linalg.norm(skew, axis=(-2, -1)) / np.sqrt(8)
    cosine = (np.trace(relative, axis1=-2, axis2=-1) - 1) / 2
    return distance, np.rad2deg(np.arctan2(sine, cosine)).max()


if __name__ == "__main__":
    main()
