"""Motions that repeat, as plain numbers: circles, waves and noise."""

import numpy as np


def circling(n_frames, period, radius=1.0, at=(0.0, 0.0, 0.0, 0.0)):
    """Go round a circle in four dimensions, once in so many frames."""
    angle = 2 * np.pi * np.arange(n_frames) / period
    ring = np.zeros((n_frames, 4))
    ring[:, 0], ring[:, 1] = radius * np.cos(angle), radius * np.sin(angle)
    return ring + at


def wave(phase):
    """Return a closed curve (F, 3) with a second harmonic at phases in laps."""
    angle = 2 * np.pi * np.asarray(phase)
    return np.column_stack([np.sin(angle), np.cos(angle), 0.4 * np.sin(2 * angle + 1)])


def noise(n_frames, seed=0):
    """Return (F, 4) of little noise."""
    return 0.02 * np.random.default_rng(seed).normal(size=(n_frames, 4))
