"""Blocks: a stretch of frames as integers, and as bytes.

Blocks do not depend on each other, so any of them can be decoded alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb._jit import jit
from mocapdb._typing import ByteArray, FloatArray, IntArray
from mocapdb.compression import spline
from mocapdb.compression.modes import (
    MODES,
    PROFILE_LIMIT,
    SAMPLES,
    SPACINGS,
    STILL,
    bands_of,
    count_of,
    samples_of,
    step_sizes,
)
from mocapdb.compression.rangecoder import (
    N_SYMBOLS,
    ModelArray,
    code_bits,
    code_number,
    code_symbol,
    finish_writer,
    new_models,
    new_reader,
    new_writer,
)
from mocapdb.compression.spikes import code_spikes, new_spike_models
from mocapdb.compression.track import (
    code_track,
    new_activity,
    new_filters,
    new_memory,
    new_starts,
    new_track_models,
)
from mocapdb.errors import CodecError
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Block", "CodedClip", "read_block", "sparse", "unzigzag", "write_block", "zigzag"]

_GAIN_BITS = 14
_GAIN_ZERO = 1 << (_GAIN_BITS - 1)
_CHANGE_BITS = 12
_BYTES_A_NUMBER = 16  # more than any number takes: its length, bits and sign, all unlikely
_SPACINGS = np.array([*SPACINGS, 0] + [-1] * (MODES - STILL - 1), dtype=np.int64)


@dataclass(frozen=True)
class Block:
    """A block of frames as integers.

    Attributes
    ----------
    n_frames : int
    gain : int
        The step, in 1/64 octaves.
    profile : (C,)
        The channels' steps, in 1/3 octaves of the block's.
    modes : (C,)
    tracks : C arrays
    spikes : (S, 3)
        Channel, frame and amount of samples that differ from what the tracks stand for.
    """

    n_frames: int
    gain: int
    profile: IntArray
    modes: IntArray
    tracks: tuple[IntArray, ...]
    spikes: IntArray

    def values(self) -> FloatArray:
        """Return the states (F, C) that the integers stand for."""
        columns = np.empty((len(self.modes), self.n_frames))
        steps = step_sizes(self.profile, self.gain, self.modes)
        spline.evaluate_all(
            _joined(self.tracks),
            _starts(self.modes, self.n_frames),
            _SPACINGS[self.modes],
            steps,
            columns,
        )
        for channel in np.flatnonzero(self.modes > STILL):
            samples_of(
                self.tracks[channel], int(self.modes[channel]), steps[channel], columns[channel]
            )
        if len(self.spikes):
            channels, frames, amounts = self.spikes.T
            sample_steps = step_sizes(self.profile, self.gain, np.full_like(self.modes, SAMPLES))
            columns[channels, frames] += amounts * sample_steps[channels]
        return np.ascontiguousarray(columns.T)


@dataclass(frozen=True)
class CodedClip:
    """A clip as integers.

    Attributes
    ----------
    skeleton : Skeleton
        The one that the states are channels of.
    block_frames : int
        Frames of every block; the last may have fewer.
    blocks : tuple of Block
    """

    skeleton: Skeleton
    block_frames: int
    blocks: tuple[Block, ...]


def write_block(block: Block, head_profile: IntArray) -> bytes:
    """Return the bytes of a block (docs/format-motion-codec.md)."""
    values = _joined(block.tracks)
    spikes = np.zeros((len(block.modes), block.n_frames), dtype=np.int64)
    spikes[block.spikes[:, 0], block.spikes[:, 1]] = block.spikes[:, 2]
    n_numbers = len(values) + 2 * len(block.spikes) + 3 * len(block.modes) + 4
    data = np.zeros(_BYTES_A_NUMBER * n_numbers, dtype=np.uint8)
    coder = new_writer()
    code_bits(coder, data, _GAIN_BITS, block.gain + _GAIN_ZERO)
    modes = block.modes.copy()
    changes = block.profile - head_profile
    _code_settings(coder, data, _SETTING_MODELS.copy(), modes, changes)
    _code_tracks(
        coder,
        data,
        new_track_models(),
        new_spike_models(),
        *_layout(modes, block.n_frames),
        values,
        spikes,
    )
    return finish_writer(coder, data)


def read_block(data: ByteArray, head_profile: IntArray, n_frames: int) -> Block:
    """Return the block that `write_block` wrote.

    Raises
    ------
    CodecError
        If the bytes make no sense.
    """
    copy = data.copy()
    coder = new_reader(copy)
    gain = code_bits(coder, copy, _GAIN_BITS, 0) - _GAIN_ZERO
    modes = np.zeros(len(head_profile), dtype=np.int64)
    changes = np.zeros(len(head_profile), dtype=np.int64)
    _code_settings(coder, copy, _SETTING_MODELS.copy(), modes, changes)
    profile = head_profile + changes
    if len(modes) and (modes.max() >= MODES or np.abs(profile).max() > PROFILE_LIMIT):
        raise CodecError("Expected modes and step sizes of a block, but got nonsense.")
    layout = _layout(modes, n_frames)
    starts = layout[0]
    values = np.zeros(int(starts[-1]), dtype=np.int64)
    spikes = np.zeros((len(modes), n_frames), dtype=np.int64)
    _code_tracks(coder, copy, new_track_models(), new_spike_models(), *layout, values, spikes)
    tracks = tuple(values[starts[i] : starts[i + 1]] for i in range(len(modes)))
    return Block(n_frames, gain, profile, modes, tracks, sparse(spikes))


def sparse(spikes: IntArray) -> IntArray:
    """Return channel, frame and amount of the nonzero entries of (C, F) amounts."""
    channels, frames = np.nonzero(spikes)
    return np.stack([channels, frames, spikes[channels, frames]], axis=1)


@jit
def zigzag(value: int) -> int:
    """Return 0, 1, 2, 3, 4... for 0, -1, 1, -2, 2..."""
    return 2 * value if value >= 0 else -2 * value - 1


@jit
def unzigzag(number: int) -> int:
    """Return the value that `zigzag` made a number of."""
    return -((number + 1) >> 1) if number & 1 else number >> 1


def _setting_models() -> ModelArray:
    """Return models of a mode after each other mode, and (last two) of changes of profile."""
    table = np.empty((N_SYMBOLS + 2, N_SYMBOLS))
    for i in range(N_SYMBOLS):
        for j in range(N_SYMBOLS):
            table[i, j] = 1.0 / (1 << abs(i - j))
    table[N_SYMBOLS:] = 1.0
    table[N_SYMBOLS, 0] = 64.0
    return new_models(table / table.sum(axis=1, keepdims=True))


_SETTING_MODELS = _setting_models()


def _joined(tracks: tuple[IntArray, ...]) -> IntArray:
    return np.concatenate([np.empty(0, dtype=np.int64), *tracks])


def _starts(modes: IntArray, n_frames: int) -> IntArray:
    """Return (C + 1,) where each track starts, and where the last one ends."""
    counts = np.array([count_of(mode, n_frames) for mode in range(MODES)])
    starts = np.zeros(len(modes) + 1, dtype=np.int64)
    np.cumsum(counts[modes], out=starts[1:])
    return starts


def _layout(modes: IntArray, n_frames: int) -> tuple[IntArray, IntArray, IntArray, int]:
    """Return where each track starts, the spacing of each, the band of each value, and F."""
    starts = _starts(modes, n_frames)
    bands = np.zeros(int(starts[-1]), dtype=np.int64)
    for i in np.flatnonzero(modes > STILL):
        bands[starts[i] : starts[i + 1]] = bands_of(int(modes[i]), n_frames)
    return starts, np.maximum(_SPACINGS[modes], 0), bands, n_frames


@jit
def _code_settings(
    coder: IntArray, data: ByteArray, models: ModelArray, modes: IntArray, changes: IntArray
) -> None:
    previous = 5
    for i in range(len(modes) - 1, -1, -1):
        modes[i] = code_symbol(coder, data, models, previous, modes[i])
        previous = modes[i]
    for i in range(len(modes) - 1, -1, -1):
        change = code_number(coder, data, models, N_SYMBOLS, zigzag(changes[i]), _CHANGE_BITS)
        changes[i] = unzigzag(change)


@jit
def _code_tracks(
    coder: IntArray,
    data: ByteArray,
    models: ModelArray,
    spike_models: ModelArray,
    starts: IntArray,
    spacings: IntArray,
    bands: IntArray,
    n_frames: int,
    values: IntArray,
    spikes: IntArray,
) -> None:
    activity = new_activity(n_frames)
    first_sizes = new_starts()
    for i in range(len(starts) - 2, -1, -1):
        first, last = starts[i], starts[i + 1]
        code_track(
            coder,
            data,
            models,
            activity,
            first_sizes,
            new_filters(),
            new_memory(),
            bands[first:last],
            spacings[i],
            values[first:last],
        )
        if spacings[i] != 1:
            code_spikes(coder, data, spike_models, n_frames, spikes[i])
