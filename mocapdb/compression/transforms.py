"""Temporal transforms: each column of a clip becomes a column of coefficients, and back.

=========  ========================================================================================
``dct``    the orthonormal DCT-II of the whole clip
``dwt``    a wavelet in as many levels as the clip has room for: by default bior4.4, a biorthogonal
           one, else any discrete wavelet of PyWavelets
=========  ========================================================================================

Both nearly preserve energy, so that dropping the smallest coefficients loses the least.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import CodecError

__all__ = [
    "TRANSFORMS",
    "WAVELET",
    "TransformName",
    "band_lengths",
    "check_wavelet",
    "coefficient_count",
    "forward_transform",
    "inverse_transform",
]

TransformName: TypeAlias = Literal["dct", "dwt"]
TRANSFORMS: tuple[TransformName, ...] = get_args(TransformName)

WAVELET = "bior4.4"
WAVELET_TAPS = 10
EXTENSION = "periodization"  # the only one without redundant coefficients


def check_wavelet(name: str) -> None:
    """Check the name of a wavelet.

    Raises
    ------
    CodecError
        If PyWavelets has no discrete wavelet of that name; it names one that is spelt alike.

    Examples
    --------
    >>> check_wavelet("db4")
    >>> check_wavelet("daubechies4")
    Traceback (most recent call last):
    ...
    mocapdb.errors.CodecError: Expected a discrete wavelet of PyWavelets, such as db4, sym8 or \
bior4.4, but got 'daubechies4'. Did you mean db4?
    """
    if name == WAVELET:  # known without its library
        return
    import pywt

    known = pywt.wavelist(kind="discrete")
    if name not in known:
        nearest = _nearest_wavelet(name, known)
        hint = f" Did you mean {nearest}?" if nearest else ""
        raise CodecError(
            "Expected a discrete wavelet of PyWavelets, such as db4, sym8 or bior4.4, but got "
            f"{name!r}.{hint}"
        )


def forward_transform(
    name: TransformName, values: FloatArray, wavelet: str = WAVELET
) -> FloatArray:
    """Return the coefficients (L, N) of the columns of a clip (F, N)."""
    if values.size == 0:
        return np.zeros((coefficient_count(name, len(values), wavelet), values.shape[1]))
    if name == "dct":
        from scipy.fft import dct

        return np.asarray(dct(values, axis=0, norm="ortho"))
    import pywt

    level = len(band_lengths(len(values), wavelet)) - 1
    bands = pywt.wavedec(values, wavelet, mode=EXTENSION, level=level, axis=0)
    return np.concatenate(bands, axis=0)


def inverse_transform(
    name: TransformName, coefficients: FloatArray, n_frames: int, wavelet: str = WAVELET
) -> FloatArray:
    """Return the columns (F, N) that have these coefficients (L, N)."""
    if coefficients.size == 0:
        return np.zeros((n_frames, coefficients.shape[1]))
    if name == "dct":
        from scipy.fft import idct

        return np.asarray(idct(coefficients, axis=0, norm="ortho"))
    import pywt

    ends = np.cumsum(band_lengths(n_frames, wavelet))
    bands = np.split(coefficients, ends[:-1], axis=0)
    values = bands[0]
    for detail in bands[1:]:
        values = pywt.idwt(values[: len(detail)], detail, wavelet, mode=EXTENSION, axis=0)
    return np.asarray(values[:n_frames])


def coefficient_count(name: TransformName, n_frames: int, wavelet: str = WAVELET) -> int:
    """Return L, the number of coefficients that a column of F frames has.

    F for the DCT; the wavelet adds one for every level that starts with an odd length.
    """
    return n_frames if name == "dct" else sum(band_lengths(n_frames, wavelet))


def band_lengths(n_frames: int, wavelet: str = WAVELET) -> list[int]:
    """Return the lengths of the wavelet's bands: approximation, then details, coarsest first."""
    # as many levels as pywt.dwt_max_level allows: reading a clip without a wavelet needs no pywt
    levels = max((n_frames // max(_taps(wavelet) - 1, 1)).bit_length() - 1, 0)
    details: list[int] = []
    approximation = n_frames
    for _ in range(levels):
        approximation = (approximation + 1) // 2
        details.append(approximation)
    return [approximation, *reversed(details)]


@lru_cache(maxsize=128)
def _taps(wavelet: str) -> int:
    """Return the length of a wavelet's filter."""
    if wavelet == WAVELET:
        return WAVELET_TAPS
    import pywt

    return int(pywt.Wavelet(wavelet).dec_len)


def _nearest_wavelet(name: str, known: list[str]) -> str | None:
    """Return the name that is most like what somebody wrote, families by their long names too.

    None where nothing is like it.
    """
    from difflib import get_close_matches

    import pywt

    spelt = {short: short for short in known}
    for short in known:
        family = pywt.Wavelet(short).family_name.lower()
        number = short.lstrip("abcdefghijklmnopqrstuvwxyz")
        spelt.setdefault(family + number, short)
    nearest = get_close_matches(name.strip().lower().replace("-", ""), spelt, n=1)
    return spelt[nearest[0]] if nearest else None
