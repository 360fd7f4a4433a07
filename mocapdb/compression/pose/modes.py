"""Modes: the ways in which a channel of a block becomes a track, and back.

=============  =====================================================================================
``spline``     a cubic B-spline with knots every 1 to 32 frames (10 modes)
``still``      one value for the whole block
``dct32``      the DCT of every 32 frames; ``dct64``: of every 64; ``dct``: of the whole block
``dwt``        a biorthogonal wavelet over the whole block
=============  =====================================================================================

The encoder takes for every channel of every block the mode that costs least, among those allowed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from mocapdb.base.arrays import ByteArray, FloatArray, IntArray
from mocapdb.compression.pose import spline
from mocapdb.compression.pose.entropy import N_BANDS
from mocapdb.compression.transforms import (
    band_lengths,
    coefficient_count,
    forward_transform,
    inverse_transform,
)

__all__ = [
    "MODES",
    "N_SPLINES",
    "SAMPLES",
    "SPACINGS",
    "STILL",
    "TRANSFORM_MODES",
    "PoseTransform",
    "forward",
    "inverse",
    "mode_name",
    "mode_steps",
    "step_sizes",
    "track_bands",
    "track_lengths",
]

PoseTransform: TypeAlias = Literal["auto", "spline", "dct32", "dct64", "dct", "dwt"]

SPACINGS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
N_SPLINES = len(SPACINGS)
SAMPLES = 0  # a spacing of one frame
STILL, DCT32, DCT64, DCT, DWT = range(N_SPLINES, N_SPLINES + 5)
MODES = N_SPLINES + 5
TRANSFORM_MODES: dict[PoseTransform, tuple[int, ...]] = {
    "auto": (*range(N_SPLINES), DCT),
    "spline": tuple(range(N_SPLINES)),
    "dct32": (DCT32,),
    "dct64": (DCT64,),
    "dct": (DCT,),
    "dwt": (DWT,),
}
_DCT_LENGTHS = {DCT32: 32, DCT64: 64}

# the format: what the numbers that set the steps count in
PROFILE_LIMIT = 500  # largest profile, either way
PROFILE_PER_OCTAVE = (
    3  # the profile: the channels' steps beside the block's, in thirds of an octave
)
QP_PER_OCTAVE = 64  # the quantisation parameter (qp): the block's step, in 1/64 octaves
_STILL_OCTAVES = -2.0  # a value that serves a whole block has a quarter of the step

_MODE_OCTAVES = np.array(
    [0.0]
    + [-0.5 * math.log2(spline.NOISE_GAIN * spacing) for spacing in SPACINGS[1:]]
    + [_STILL_OCTAVES]
    + [0.0] * (MODES - STILL - 1)
)


def mode_name(mode: int) -> str:
    """Return what a mode is called, without its spacing of knots."""
    if mode < N_SPLINES:
        return "spline"
    return ("still", "dct32", "dct64", "dct", "dwt")[mode - STILL]


def step_sizes(profile: IntArray, qp: int, modes: IntArray) -> FloatArray:
    """Return what one integer stands for, in degrees or skeleton units, track by track."""
    octaves = profile / PROFILE_PER_OCTAVE + qp / QP_PER_OCTAVE + _MODE_OCTAVES[modes]
    return np.asarray(np.exp2(octaves))


def mode_steps(profile: IntArray, qp: int) -> FloatArray:
    """Return (C, MODES) what one integer of each channel stands for in each of the modes."""
    octaves = (profile / PROFILE_PER_OCTAVE + qp / QP_PER_OCTAVE)[:, None]
    return np.asarray(np.exp2(octaves + _MODE_OCTAVES))


@lru_cache(maxsize=256)
def track_lengths(n_frames: int) -> IntArray:
    """Return how many integers a track of each of the modes has, at most."""
    counts = np.full(MODES, n_frames, dtype=np.int64)
    counts[:N_SPLINES] = [spline.coefficient_count(n_frames, spacing) for spacing in SPACINGS]
    counts[STILL] = 1
    counts[DWT] = coefficient_count("dwt", n_frames)
    return counts


@lru_cache(maxsize=256)
def track_bands(mode: int, n_frames: int) -> ByteArray:
    """Return the band of each of a track's integers."""
    n = int(track_lengths(n_frames)[mode])
    if mode <= STILL:
        return np.zeros(n, dtype=np.uint8)
    if mode == DWT:
        lengths = band_lengths(n_frames)
        bands = np.repeat(np.minimum(np.arange(len(lengths)), N_BANDS - 1), lengths)
    else:
        frequency = np.arange(n) % _DCT_LENGTHS.get(mode, n)
        half_octaves = np.floor(2.0 * np.log2(np.maximum(frequency, 1)) + 0.05)
        bands = np.where(frequency > 0, np.minimum(1 + half_octaves, N_BANDS - 1), 0)
    return np.asarray(bands.astype(np.uint8))


def forward(mode: int, values: FloatArray) -> FloatArray:
    """Return a transform's coefficients (N,) of a channel (F,)."""
    if mode == DWT:
        return forward_transform("dwt", values[:, None])[:, 0]
    from scipy.fft import dct

    parts = [dct(part, norm="ortho") for part in _split(values, mode)]
    return np.concatenate(parts)


def inverse(mode: int, coefficients: FloatArray, n_frames: int) -> FloatArray:
    """Return the channels (n, F) that have these of a transform's coefficients (n, N)."""
    if mode == DWT:
        return inverse_transform("dwt", coefficients.T, n_frames).T
    from scipy.fft import idct

    parts = [idct(part, norm="ortho") for part in _split(coefficients, mode)]
    return np.concatenate(parts, axis=1)


def _split(values: FloatArray, mode: int) -> Iterable[FloatArray]:
    n_values = int(values.shape[-1])
    length: int = _DCT_LENGTHS.get(mode, n_values)
    return (values[..., first : first + length] for first in range(0, n_values, length))
