"""The least error within a number of bytes: a search over the target of a codec."""

from __future__ import annotations

import math
from collections.abc import Callable

from mocapdb.compression.payload import HEADER_BYTES, Payload
from mocapdb.compression.targets import ByteBudget
from mocapdb.compression.tuning import (
    BYTES_CLOSE,
    BYTES_ROUNDS,
    BYTES_START_MM,
    FINEST_MM,
    LARGEST_STRIDE,
    LOOSEST_MM,
)
from mocapdb.errors import CodecError

__all__ = ["least_error_within"]


def least_error_within(
    budget: ByteBudget,
    n_frames: int,
    encode_to: Callable[[float], Payload],
    start_mm: float = BYTES_START_MM,
) -> Payload:
    """Return the payload of the least error found that keeps to a number of bytes.

    Parameters
    ----------
    budget : ByteBudget
    n_frames : int
    encode_to : callable
        Encodes to a mean distance in millimetres.
    start_mm : float
        The first to try.

    Raises
    ------
    CodecError
        If even the coarsest step takes more.

    Notes
    -----
    Bytes fall as a power of the error, so logarithms are interpolated. What was not exact in the
    codec's own search makes bytes jump a little: the best that was measured is what counts.
    """
    most = budget.bytes_per_frame * n_frames
    if most < HEADER_BYTES:
        raise _too_few(budget, n_frames, len(encode_to(LOOSEST_MM).data))
    fits: Payload | None = None
    fine, coarse = FINEST_MM, LOOSEST_MM  # where it takes too many bytes; where it fits
    fine_bytes, coarse_bytes = math.inf, 0.0
    target = start_mm
    for _ in range(BYTES_ROUNDS):
        payload = encode_to(target)
        size = len(payload.data)
        if size <= most:
            if fits is None or payload.error.vertices.mean <= fits.error.vertices.mean:
                fits = payload
            coarse, coarse_bytes = target, size
            if payload.error.vertices.mean == 0.0 or size >= BYTES_CLOSE * most:
                break
        else:
            fine, fine_bytes = target, size
        if coarse / fine < 1.0 + 1e-3:
            break
        target = _next_target(target, size, most, (fine, fine_bytes), (coarse, coarse_bytes))
    if fits is None:
        coarsest = encode_to(LOOSEST_MM)
        if len(coarsest.data) > most:
            raise _too_few(budget, n_frames, len(coarsest.data))
        fits = coarsest
    return fits


def _next_target(
    target: float,
    size: int,
    most: float,
    fine: tuple[float, float],
    coarse: tuple[float, float],
) -> float:
    """Return the next mean distance to try, strictly between one too fine and one that fits."""
    low, high = math.log(fine[0]), math.log(coarse[0])
    if math.isfinite(fine[1]) and coarse[1] > 0:
        aim = math.log(most * (1.0 + BYTES_CLOSE) / 2.0)
        share = (math.log(fine[1]) - aim) / max(math.log(fine[1]) - math.log(coarse[1]), 1e-9)
        wanted = low + min(max(share, 0.05), 0.95) * (high - low)
    else:  # bytes fall about as the root of the error
        step = 2.0 * math.log(size / most)
        limit = math.log(LARGEST_STRIDE)
        wanted = math.log(target) + min(max(step + math.copysign(0.05, step), -limit), limit)
    return math.exp(min(max(wanted, low), high))


def _too_few(budget: ByteBudget, n_frames: int, least: int) -> CodecError:
    frames = "1 frame" if n_frames == 1 else f"{n_frames} frames"
    needed = math.ceil(1e3 * least / n_frames) / 1e3
    return CodecError(
        f"Expected at least {needed:g} bytes a frame for a clip of {frames}, of which the "
        f"coarsest step makes {least} bytes, but got a budget of "
        f"{budget.bytes_per_frame:g}."
    )
