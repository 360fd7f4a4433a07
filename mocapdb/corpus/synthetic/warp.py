"""Clips at another speed, with the mapping of time known."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip

__all__ = ["tempo_curve", "warp"]


def warp(clip: Clip, speed: float | ArrayLike) -> tuple[Clip, FloatArray]:
    """Return a clip at another speed and where each of its frames comes from.

    Parameters
    ----------
    clip : Clip
        Its angles must be continuous, as those of synthetic clips are.
    speed : float or (F',) array-like
        A factor, 2 is twice as fast; or for each new frame the old frame that it shows, whole or
        fractional, never decreasing, such as from `tempo_curve`.

    Returns
    -------
    clip : Clip
        F' frames at the same rate.
    frames : (F',)
        Old frame shown by each new one. ``np.interp(frames, range(F), truth.phase)`` is the
        phase of the new clip.

    Raises
    ------
    ClipError
        If the factor is not positive, or the curve leaves the clip or runs backwards.
    """
    last = len(clip) - 1
    if np.ndim(speed) == 0:
        factor = float(np.asarray(speed))
        if not (np.isfinite(factor) and factor > 0):
            raise ClipError(f"Expected a positive speed, but got {factor}.")
        # 1e-9 is added because rounding could drop the last frame
        frames = np.minimum(np.arange(int(last / factor + 1e-9) + 1) * factor, last)
        step = f"speed x {factor:g}"
    else:
        frames = np.array(speed, dtype=np.float64)
        step = "warped"
        inside = frames.ndim == 1 and frames.size and frames.min() >= 0 and frames.max() <= last
        if not inside or np.any(np.diff(frames) < 0):
            raise ClipError(
                f"Expected old frames from 0 to {last} that never decrease, but got an array of "
                f"shape {frames.shape} that does not."
            )
    return clip.replace(channels=_interpolated(clip.channels, frames), step=step), frames


def tempo_curve(n_frames: int, *, seed: int, strength: float = 0.3) -> FloatArray:
    """Return a smooth monotone curve from frame 0 to the last, for `warp`.

    Parameters
    ----------
    n_frames : int
    seed : int
    strength : float
        How much the speed varies, in [0, 1): between ``1 - strength`` and ``1 + strength`` of
        the mean at most (before the ends are met).

    Returns
    -------
    (n_frames,)

    Raises
    ------
    ClipError
        If the strength is out of range or there is no frame.
    """
    if not 0 <= strength < 1 or n_frames < 1:
        raise ClipError(
            f"Expected a strength in [0, 1) and a frame at least, but got {strength} and "
            f"{n_frames} frames."
        )
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, 1.0, n_frames)
    waves = np.arange(1, 4)
    weights = rng.dirichlet(np.ones(3))
    shifts = rng.uniform(0.0, 2 * np.pi, 3)
    speed = 1 + strength * np.cos(2 * np.pi * np.outer(x, waves) + shifts) @ weights
    way = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2)])
    last = n_frames - 1
    return np.asarray(np.minimum(way * (last / max(way[-1], 1e-9)), last))


def _interpolated(channels: FloatArray, frames: FloatArray) -> FloatArray:
    if len(channels) == 1:
        return np.repeat(channels, len(frames), axis=0)
    from scipy.interpolate import CubicSpline

    values = CubicSpline(np.arange(len(channels)), channels)(frames)
    whole = frames == np.rint(frames)
    values[whole] = channels[frames[whole].astype(np.int64)]  # exact where nothing is between
    return np.asarray(values)
