"""Closed curves sampled at even phases: interpolate, shift, align."""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import FloatArray

__all__ = ["best_phase_shift", "interpolate_closed", "shift_phase"]


def interpolate_closed(samples: FloatArray, phase: FloatArray) -> FloatArray:
    """Return a closed curve at any phases.

    Parameters
    ----------
    samples : (S, ...)
        At phases 0, 1/S, 2/S, ...
    phase : (F,)
        In laps.

    Returns
    -------
    (F, ...)
        The one trigonometric polynomial of least degree through the samples.
    """
    flat = samples.reshape(len(samples), -1)
    spectrum = np.fft.rfft(flat, axis=0) / len(samples)
    spectrum[1:] *= 2.0
    if len(samples) % 2 == 0:
        spectrum[-1] /= 2.0
    angles = 2.0 * np.pi * np.outer(np.asarray(phase) % 1.0, np.arange(len(spectrum)))
    values = np.cos(angles) @ spectrum.real - np.sin(angles) @ spectrum.imag
    return np.asarray(values.reshape(len(angles), *samples.shape[1:]))


def shift_phase(samples: FloatArray, start: float) -> FloatArray:
    """Return the samples of the same closed curve from another phase on."""
    return interpolate_closed(samples, start + np.arange(len(samples)) / len(samples))


def best_phase_shift(moving: FloatArray, fixed: FloatArray) -> float:
    """Return the phase at which a closed curve has to start to be nearest another.

    Parameters
    ----------
    moving, fixed : (S, ...)
        Sampled at the same phases.

    Returns
    -------
    float
        In [0, 1): ``shift_phase(moving, best_phase_shift(moving, fixed))`` is nearest to `fixed`
        in the mean square, to a fraction of a sample.
    """
    a = np.fft.rfft(moving.reshape(len(moving), -1), axis=0)
    b = np.fft.rfft(fixed.reshape(len(fixed), -1), axis=0)
    products = np.fft.irfft((a * b.conj()).sum(axis=1), len(moving))
    best = int(np.argmax(products))
    before, at, after = products[best - 1], products[best], products[(best + 1) % len(products)]
    bend = before - 2.0 * at + after
    offset = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return float((best + offset) / len(moving) % 1.0)
