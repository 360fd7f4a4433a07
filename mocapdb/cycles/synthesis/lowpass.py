"""A Butterworth low-pass, forwards and backwards, so that nothing is delayed.

What scipy.signal's ``butter(4, ...)`` and ``sosfiltfilt`` compute, to the last bit: importing
scipy.signal takes longer than a short clip's whole cycle.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.base.kernels import jit

__all__ = ["lowpass", "lowpass_sections"]


def lowpass(values: FloatArray, cutoff: float, padding: int) -> FloatArray:
    """Return values (F, ...) without what is faster than a cutoff.

    Parameters
    ----------
    values : (F, ...)
    cutoff : float
        Of half the frame rate, between 0 and 1: there the amplitude is halved.
    padding : int
        Frames added at either end, by turning the values round about the first and the last; fewer
        than F.
    """
    sections = lowpass_sections(cutoff)
    state = _steady_state(sections)[..., None]
    series = np.moveaxis(values, 0, -1)  # each column is contiguous in memory
    if padding > 0:
        before = 2 * series[..., :1] - series[..., padding:0:-1]
        after = 2 * series[..., -1:] - series[..., -2 : -padding - 2 : -1]
        series = np.concatenate([before, series, after], axis=-1)
    for _ in range(2):  # forwards, then backwards
        rows = np.array(series.reshape(-1, series.shape[-1]), dtype=np.float64, order="C")
        _filter(sections, state * rows[:, 0], rows)
        series = rows.reshape(series.shape)[..., ::-1]
    return np.moveaxis(series[..., padding : series.shape[-1] - padding], -1, 0)


def lowpass_sections(cutoff: float) -> FloatArray:
    """Return (2, 6) the filter of order 4 as second-order sections: b0, b1, b2, 1, a1, a2.

    Notes
    -----
    The analog filter's poles, stretched to the cutoff, and the bilinear transform to the unit disc
    (Oppenheim and Schafer, *Discrete-Time Signal Processing*, section 7.2). The pair of poles that
    is nearer to the unit circle is the second section's.
    """
    analog = 4.0 * np.tan(np.pi * cutoff / 2.0) * -np.exp(1j * np.pi * np.arange(-3.0, 4, 2) / 8)
    gain = float(4.0 * np.tan(np.pi * cutoff / 2.0)) ** 4 * np.real(1.0 / np.prod(4.0 - analog))
    poles = (4.0 + analog) / (4.0 - analog)
    upper = poles[poles.imag > 0]
    lower = poles[poles.imag < 0]
    upper, lower = (half[np.lexsort((abs(half.imag), half.real))] for half in (upper, lower))
    pairs = (upper + lower.conj()) / 2
    sections = np.zeros((2, 6))
    for section, pole in zip(
        sections, pairs[np.argsort(np.abs(1 - np.abs(pairs)))[::-1]], strict=True
    ):
        section[:] = 1.0, 2.0, 1.0, *np.poly([pole, pole.conj()]).real
    sections[0, :3] *= gain
    return sections


def _steady_state(sections: FloatArray) -> FloatArray:
    """Return (2, 2) the sections' state after an endless row of ones."""
    states = np.empty((len(sections), 2))
    scale = 1.0
    for state, section in zip(states, sections, strict=True):
        b, a = section[:3], section[3:]
        step = np.eye(2) - np.array([[-a[1], 1.0], [-a[2], 0.0]])
        state[:] = scale * np.linalg.solve(step, b[1:] - a[1:] * b[0])
        scale *= b.sum() / a.sum()
    return states


@jit
def _filter(sections: FloatArray, states: FloatArray, rows: FloatArray) -> None:
    """Filter rows (D, F) in place, from the sections' states (2, 2, D) on."""
    for i in range(len(rows)):
        for frame in range(rows.shape[1]):
            value = rows[i, frame]
            for s in range(len(sections)):
                last = value
                value = sections[s, 0] * last + states[s, 0, i]
                states[s, 0, i] = sections[s, 1] * last - sections[s, 4] * value + states[s, 1, i]
                states[s, 1, i] = sections[s, 2] * last - sections[s, 5] * value
            rows[i, frame] = value
