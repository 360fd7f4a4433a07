import math

import numpy as np
import pytest
import pywt
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.compression.transforms import (
    EXTENSION,
    TRANSFORMS,
    WAVELET,
    WAVELET_TAPS,
    band_lengths,
    coefficient_count,
    forward_transform,
    inverse_transform,
)


def random_columns(n_frames, n_columns=3, seed=0):
    return np.random.default_rng(seed).normal(size=(n_frames, n_columns))


@pytest.mark.parametrize("name", TRANSFORMS)
@pytest.mark.parametrize("n_columns", [0, 1, 5])
@given(n_frames=st.integers(1, 300))
def test_the_inverse_brings_the_columns_back(name, n_columns, n_frames):
    values = random_columns(n_frames, n_columns)
    coefficients = forward_transform(name, values)
    assert coefficients.shape == (coefficient_count(name, n_frames), n_columns)
    back = inverse_transform(name, coefficients, n_frames)
    np.testing.assert_allclose(back, values, atol=1e-11)


def test_dct_is_the_sum_that_defines_it():
    values = random_columns(17)
    n = len(values)
    cosines = np.cos(np.pi * np.outer(np.arange(n), 2 * np.arange(n) + 1) / (2 * n))
    scales = np.where(np.arange(n) == 0, math.sqrt(1 / n), math.sqrt(2 / n))
    np.testing.assert_allclose(
        forward_transform("dct", values), scales[:, None] * (cosines @ values), atol=1e-12
    )


def test_dct_of_its_own_cosine_is_one_coefficient():
    n, k = 64, 5
    wave = np.cos(np.pi * k * (2 * np.arange(n) + 1) / (2 * n))[:, None]
    expected = np.zeros((n, 1))
    expected[k] = math.sqrt(n / 2)
    np.testing.assert_allclose(forward_transform("dct", wave), expected, atol=1e-12)


def test_dct_keeps_energy():
    values = random_columns(101)
    assert np.sum(forward_transform("dct", values) ** 2) == pytest.approx(np.sum(values**2))


@pytest.mark.parametrize("n_frames", [16, 64, 200])
def test_a_constant_has_no_details(n_frames):
    coefficients = forward_transform("dwt", np.full((n_frames, 1), 3.0))
    levels = pywt.dwt_max_level(n_frames, "bior4.4")
    n_approximations = n_frames
    for _ in range(levels):
        n_approximations = -(-n_approximations // 2)
    np.testing.assert_allclose(coefficients[:n_approximations], 3.0 * 2 ** (levels / 2), rtol=1e-10)
    np.testing.assert_allclose(coefficients[n_approximations:], 0.0, atol=1e-10)


def test_dwt_is_the_wavelet_library_s_own():
    values = random_columns(150)
    bands = pywt.wavedec(values, "bior4.4", mode="periodization", axis=0)
    np.testing.assert_array_equal(forward_transform("dwt", values), np.concatenate(bands))


def test_clips_too_short_for_a_wavelet_stay_as_they_are():
    values = random_columns(3)
    np.testing.assert_array_equal(forward_transform("dwt", values), values)


def test_a_jump_is_cheaper_in_wavelets():
    jump = np.repeat([0.0, 1.0], 64)[:, None]
    needed = {}
    for name in TRANSFORMS:
        magnitudes = np.sort(np.abs(forward_transform(name, jump)).ravel())[::-1]
        left = 1 - np.cumsum(magnitudes**2) / np.sum(magnitudes**2)
        needed[name] = int(np.argmax(left < 1e-3))
    assert needed["dwt"] < needed["dct"]


def test_bands_are_as_long_as_pywavelets_makes_them():
    wavelet = pywt.Wavelet(WAVELET)
    assert wavelet.dec_len == WAVELET_TAPS
    for n_frames in (1, 8, 9, 10, 17, 18, 143, 144, 1000, 4097):
        level = pywt.dwt_max_level(n_frames, wavelet)
        bands = pywt.wavedec(np.zeros(n_frames), wavelet, mode=EXTENSION, level=level)
        assert band_lengths(n_frames) == [len(band) for band in bands]
