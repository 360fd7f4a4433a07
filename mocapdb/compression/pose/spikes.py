"""Spikes: single frames of a channel that differ from its smooth curve.

Optical capture leaves glitches of a frame or two: a hand turned over, a toe that snaps. Knots close
enough to follow them would cost the whole block. A spike stores instead by how much a sample
differs from the curve; the curve is then fitted without that frame.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import ByteArray, FloatArray, IntArray
from mocapdb.base.kernels import jit
from mocapdb.compression.pose.range_coder import (
    N_SYMBOLS,
    ModelArray,
    code_number,
    code_signed,
    new_models,
)
from mocapdb.compression.tuning import SPIKE_BITS

__all__ = ["code_spikes", "is_spike", "new_spike_models"]

_COUNT, _GAP, _AMOUNT = 0, 2, 4


def _spike_models() -> ModelArray:
    table = np.ones((6, N_SYMBOLS))
    table[_COUNT, 0] = 64.0
    return new_models(table / table.sum(axis=1, keepdims=True))


_MODELS = _spike_models()


def new_spike_models() -> ModelArray:
    """Return the distributions of numbers of spikes, gaps between them, and their amounts."""
    return _MODELS.copy()


@jit
def is_spike(
    goal: FloatArray, samples: FloatArray, weights: FloatArray, frame: int, bit_cost: float
) -> bool:
    """Say whether a frame is cheaper as a spike than as an error of a curve.

    A spike pulls the curve towards it, so only the worst of three neighbours counts.
    """
    cost = weights[frame] * (goal[frame] - samples[frame]) ** 2
    if cost <= bit_cost * SPIKE_BITS:
        return False
    for near in range(max(frame - 1, 0), min(frame + 2, len(goal))):
        other = weights[near] * (goal[near] - samples[near]) ** 2
        if other > cost or (other == cost and near > frame):
            return False
    return True


@jit
def code_spikes(
    coder: IntArray, data: ByteArray, models: ModelArray, n_frames: int, amounts: IntArray
) -> None:
    """Write or read the spikes of a channel.

    Parameters
    ----------
    coder, data, models
        See `range_coder`.
    n_frames : int
    amounts : (F,)
        Zero but for spikes.
    """
    n_spikes = 0
    for amount in amounts:
        n_spikes += amount != 0
    n_spikes = code_number(coder, data, models, _COUNT, n_spikes, 20)
    frame = -1
    for _ in range(n_spikes):
        gap = 0
        if coder[3] == 0:
            while amounts[frame + 1 + gap] == 0:
                gap += 1
        frame += 1 + code_number(coder, data, models, _GAP, gap, 20)
        if not 0 <= frame < n_frames:  # only in damaged bytes
            return
        amounts[frame] = code_signed(coder, data, models, _AMOUNT, amounts[frame], 27)
