"""Temporal transforms: each column of a clip becomes a column of coefficients, and back.

=========  ========================================================================================
``dct``    the orthonormal DCT-II of the whole clip
``dwt``    a biorthogonal wavelet (bior4.4) in as many levels as the clip has room for
=========  ========================================================================================

Both nearly preserve energy, so that dropping the smallest coefficients loses the least.
"""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray

__all__ = [
    "TRANSFORMS",
    "TransformName",
    "band_lengths",
    "coefficient_count",
    "forward_transform",
    "inverse_transform",
]

TransformName: TypeAlias = Literal["dct", "dwt"]
TRANSFORMS: tuple[TransformName, ...] = get_args(TransformName)

WAVELET = "bior4.4"
WAVELET_TAPS = 10
EXTENSION = "periodization"  # the only one without redundant coefficients


def forward_transform(name: TransformName, values: FloatArray) -> FloatArray:
    """Return the coefficients (L, N) of the columns of a clip (F, N)."""
    if values.size == 0:
        return np.zeros((coefficient_count(name, len(values)), values.shape[1]))
    if name == "dct":
        from scipy.fft import dct

        return np.asarray(dct(values, axis=0, norm="ortho"))
    import pywt

    level = len(band_lengths(len(values))) - 1
    bands = pywt.wavedec(values, WAVELET, mode=EXTENSION, level=level, axis=0)
    return np.concatenate(bands, axis=0)


def inverse_transform(name: TransformName, coefficients: FloatArray, n_frames: int) -> FloatArray:
    """Return the columns (F, N) that have these coefficients (L, N)."""
    if coefficients.size == 0:
        return np.zeros((n_frames, coefficients.shape[1]))
    if name == "dct":
        from scipy.fft import idct

        return np.asarray(idct(coefficients, axis=0, norm="ortho"))
    import pywt

    ends = np.cumsum(band_lengths(n_frames))
    bands = np.split(coefficients, ends[:-1], axis=0)
    values = bands[0]
    for detail in bands[1:]:
        values = pywt.idwt(values[: len(detail)], detail, WAVELET, mode=EXTENSION, axis=0)
    return np.asarray(values[:n_frames])


def coefficient_count(name: TransformName, n_frames: int) -> int:
    """Return L, the number of coefficients that a column of F frames has.

    F for the DCT; the wavelet adds one for every level that starts with an odd length.
    """
    return n_frames if name == "dct" else sum(band_lengths(n_frames))


def band_lengths(n_frames: int) -> list[int]:
    """Return the lengths of the wavelet's bands: approximation, then details, coarsest first."""
    # as many levels as pywt.dwt_max_level allows: reading a clip without a wavelet needs no pywt
    levels = max((n_frames // (WAVELET_TAPS - 1)).bit_length() - 1, 0)
    details: list[int] = []
    approximation = n_frames
    for _ in range(levels):
        approximation = (approximation + 1) // 2
        details.append(approximation)
    return [approximation, *reversed(details)]
