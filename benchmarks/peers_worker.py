"""The side of `peers.py` that runs what others wrote, in an environment of its own.

It reads requests from stdin, a line of JSON each: ``{"call": NAME, ...}``, arrays as paths of
``.npy`` files. It answers with a line: seconds of the processor's time, and what was found; or what
is missing. Nothing of mocapdb is imported here, and nothing of this there.
"""

from __future__ import annotations

import json
import sys
import time
import warnings
import zlib
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

Packing = tuple[Callable[[], bytes], Callable[[bytes], bytes]]


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    start = time.process_time()
    found = work()
    return time.process_time() - start, found


def versions(packages: list[str]) -> dict[str, Any]:
    found = {}
    for name in packages:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    return {"versions": found, "python": sys.version.split()[0]}


# -- readers and descriptors ------------------------------------------------------------------


def read_pybvh(path: str) -> dict[str, Any]:
    import pybvh

    seconds, _ = timed(lambda: pybvh.read_bvh_file(path))
    return {"seconds": seconds}


def read_bvhio(path: str) -> dict[str, Any]:
    import bvhio

    seconds, _ = timed(lambda: bvhio.readAsBvh(path))
    return {"seconds": seconds}


def pybvh_features(path: str, what: str, out: str | None = None) -> dict[str, Any]:
    """Time a descriptor of a file; reading does not count, and nothing is kept from before."""
    import pybvh

    bvh = pybvh.read_bvh_file(path)
    seconds, found = timed(
        {
            "positions": bvh.node_positions,
            "velocities": bvh.joint_velocities,
            "contacts": bvh.foot_contacts,
            "6d": bvh.to_6d,
        }[what]
    )
    if out:
        np.save(out, found)
    return {"seconds": seconds}


# -- search -----------------------------------------------------------------------------------


def stumpy_mass(query: str, series: str) -> dict[str, Any]:
    """Add up the distance profiles of all columns, without warping."""
    import stumpy

    template, columns = np.load(query), np.ascontiguousarray(np.load(series).T)

    def profiles() -> np.ndarray:
        squares = np.zeros(columns.shape[1] - len(template) + 1)
        for own, column in zip(np.ascontiguousarray(template.T), columns, strict=True):
            squares += stumpy.mass(own, column, normalize=False) ** 2
        return squares

    seconds, _ = timed(profiles)
    return {"seconds": seconds}


def dtaidistance_search(query: str, series: str) -> dict[str, Any]:
    from dtaidistance.subsequence.dtw import subsequence_alignment

    template, values = np.load(query), np.load(series)
    seconds, _ = timed(lambda: subsequence_alignment(template, values, use_c=True).best_match())
    return {"seconds": seconds}


def plain_warping(folder: str, count: int, out: str) -> dict[str, Any]:
    """Warp every pair of clips, and keep the distance over the length of both."""
    from dtaidistance import dtw_ndim

    clips = [np.load(f"{folder}/{i}.npy") for i in range(count)]
    found = np.zeros((count, count))

    def every_pair() -> None:
        for i in range(count):
            for j in range(i):
                distance = dtw_ndim.distance_fast(clips[i], clips[j])
                found[i, j] = found[j, i] = distance / np.sqrt(len(clips[i]) + len(clips[j]))

    seconds, _ = timed(every_pair)
    np.save(out, found)
    return {"seconds": seconds}


def warp_words(
    values: str, first: list[int], second: list[int], lengths: list[int]
) -> dict[str, Any]:
    """Warp pairs of words of a motion, without constraints."""
    from dtaidistance import dtw_ndim

    columns = np.load(values)
    pairs = [
        (columns[i : i + lengths[0]].copy(), columns[j : j + lengths[1]].copy())
        for i, j in zip(first, second, strict=True)
    ]
    seconds, _ = timed(lambda: [dtw_ndim.distance_fast(*pair) for pair in pairs])
    return {"seconds": seconds}


# -- circular coordinates and cycles ----------------------------------------------------------


def dreimac_coordinates(cloud: str, out: str) -> dict[str, Any]:
    from dreimac import CircularCoords

    points = np.load(cloud)
    seconds, found = timed(
        lambda: CircularCoords(points, n_landmarks=100, prime=47).get_coordinates()
    )
    np.save(out, found)
    return {"seconds": seconds}


def autocorrelation(cloud: str, fps: float) -> dict[str, Any]:
    """Return the lag of the first peak of the autocorrelation that is about as high as any."""
    from scipy.signal import find_peaks

    values = np.load(cloud)

    def lag() -> float:
        centred = values - values.mean(axis=0)
        padded = np.fft.rfft(centred, 2 * len(centred), axis=0)
        correlation = np.fft.irfft(np.abs(padded) ** 2, axis=0)[: len(centred)].sum(axis=1)
        correlation /= np.arange(len(centred), 0, -1)
        half = correlation[: round(0.6 * len(centred))]
        peaks, _ = find_peaks(half, distance=max(1, round(0.2 * fps)))
        high = [peak for peak in peaks if half[peak] >= 0.8 * half[peaks].max()]
        return float(high[0]) if high else float("nan")

    seconds, found = timed(lag)
    return {"seconds": seconds, "period": found}


# -- codecs -----------------------------------------------------------------------------------


def _zlib(array: np.ndarray, raw: bytes) -> Packing:
    return lambda: zlib.compress(raw, 9), zlib.decompress


def _zstd(array: np.ndarray, raw: bytes) -> Packing:
    import zstandard

    packer, unpacker = zstandard.ZstdCompressor(level=19), zstandard.ZstdDecompressor()
    return lambda: packer.compress(raw), unpacker.decompress


def _blosc2(array: np.ndarray, raw: bytes) -> Packing:
    import blosc2

    how = {
        "typesize": array.itemsize, "codec": blosc2.Codec.ZSTD, "clevel": 9, "nthreads": 1,
        "filters": [blosc2.Filter.SHUFFLE],
    }  # fmt: skip
    return lambda: blosc2.compress2(raw, **how), lambda packed: blosc2.decompress2(
        packed, nthreads=1
    )


def pack(codec: str, values: str) -> dict[str, Any]:
    """Pack an array without a loss; return bytes, and the seconds of packing and unpacking."""
    array = np.load(values)
    codecs = {"zlib": _zlib, "zstd": _zstd, "blosc2": _blosc2}
    packing, unpacking = codecs[codec](array, array.tobytes())
    seconds, packed = timed(packing)
    back, _ = timed(lambda: unpacking(packed))
    return {"seconds": seconds, "unpack_seconds": back, "bytes": len(packed)}


# -- cleaning ---------------------------------------------------------------------------------


def smooth(name: str, values: str, fps: float, out: str) -> dict[str, Any]:
    """Smooth columns, as motion laboratories and animation programs do."""
    from scipy.ndimage import median_filter
    from scipy.signal import butter, savgol_filter, sosfiltfilt

    columns = np.load(values)

    def butterworth() -> np.ndarray:
        low_pass = butter(4, 6.0, fs=fps, output="sos")
        return sosfiltfilt(low_pass, columns, axis=0, padlen=min(len(columns) - 1, round(fps)))

    def savitzky_golay() -> np.ndarray:
        return savgol_filter(columns, 2 * round(0.125 * fps) + 1, 3, axis=0)

    def hampel() -> np.ndarray:
        width = (2 * max(1, round(0.125 * fps)) + 1, 1)
        middle = median_filter(columns, size=width, mode="nearest")
        spread = median_filter(np.abs(columns - middle), size=width, mode="nearest")
        return np.where(np.abs(columns - middle) > 3 * 1.4826 * spread, middle, columns)

    ways = {"Butterworth": butterworth, "Savitzky-Golay": savitzky_golay, "Hampel": hampel}
    seconds, found = timed(ways[name])
    np.save(out, found)
    return {"seconds": seconds}


CALLS: dict[str, Callable[..., dict[str, Any]]] = {
    function.__name__: function
    for function in (
        versions, read_pybvh, read_bvhio, pybvh_features, stumpy_mass, dtaidistance_search,
        plain_warping, warp_words, dreimac_coordinates, autocorrelation, pack, smooth,
    )
}  # fmt: skip


def main() -> None:
    warnings.simplefilter("ignore")
    answers = sys.stdout
    sys.stdout = sys.stderr  # what packages print is no answer
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = CALLS[request.pop("call")](**request)
        except ImportError as problem:
            answer = {"missing": str(problem)}
        except Exception as problem:
            answer = {"missing": f"{type(problem).__name__}: {problem}"}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
