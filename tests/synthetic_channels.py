"""Positions and channels of synthetic clips, by name."""

from __future__ import annotations

import numpy as np

from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics, to_metres
from mocapdb.motion.skeleton import Skeleton


def positions_m(clip: Clip) -> np.ndarray:
    return to_metres(clip.skeleton, forward_kinematics(clip.skeleton, clip.channels).positions)


def joints(clip: Clip, *names: str) -> list[int]:
    return [clip.skeleton.joint(name) for name in names]


def channel(clip: Clip, name: str) -> np.ndarray:
    return clip.channels[:, clip.skeleton.channel_names.index(name)]


def best_lag(values: np.ndarray, longest: int) -> float:
    """The lag, to a fraction of a frame, at which values differ least from themselves."""
    lags = np.arange(longest // 3, longest)
    costs = np.array([np.mean((values[lag:] - values[:-lag]) ** 2) for lag in lags])
    k = int(np.clip(costs.argmin(), 1, len(lags) - 2))
    a, b, c = costs[k - 1 : k + 2]
    return float(lags[k] + 0.5 * (a - c) / (a - 2 * b + c))


def bvh_clip(n_frames: int = 200) -> Clip:
    """A body with other names, orders and counts, End Sites, and a joint that moves."""
    skeleton = Skeleton(
        ["Hips", "Spine", "Head", "Head_end", "Arm", "Hand", "Hand_end"],
        [-1, 0, 1, 2, 1, 4, 5],
        np.array([(0, 0, 0), (0, 9, 0), (0, 5, 0), (0, 2, 0), (3, 4, 0), (5, 0, 0), (2, 0, 0)]),
        [
            ("tx", "ty", "tz", "rz", "rx", "ry"),
            ("rz", "ry", "rx"),
            ("ry", "rx", "rz"),
            (),
            ("tx", "ty", "tz", "rx", "ry", "rz"),
            ("rz", "rx"),
            (),
        ],
        ["ZXY", "ZYX", "YXZ", "", "XYZ", "ZX", ""],
        convention="bvh",
    )
    rng = np.random.default_rng(0)
    time = np.arange(n_frames)[:, None] / 30
    rates, shifts, sizes = rng.uniform([[1], [0], [5]], [[6], [6], [50]], (3, skeleton.n_channels))
    return Clip(skeleton, sizes * np.sin(rates * time + shifts), 30.0, name="other")
