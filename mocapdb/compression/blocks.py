"""Blocks: a stretch of frames as integers, and as bytes.

Blocks do not depend on each other, so any of them can be decoded alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocapdb._jit import jit
from mocapdb._typing import ByteArray, FloatArray, IntArray
from mocapdb.compression import spline
from mocapdb.compression.basis import Basis
from mocapdb.compression.modes import (
    MODES,
    PROFILE_LIMIT,
    SAMPLES,
    SPACINGS,
    STILL,
    bands_of,
    counts_of,
    inverse,
    mode_name,
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
    LENGTH,
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
_LENGTH_BITS = 13
_NOTHING = np.empty(0, dtype=np.int64)
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
        Of a transform's coefficients only those up to the last that is not zero.
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
            np.concatenate([_NOTHING, *self.tracks]),
            _ends([len(track) for track in self.tracks]),
            _SPACINGS[self.modes],
            steps,
            columns,
        )
        for mode in np.unique(self.modes[self.modes > STILL]):
            channels = np.flatnonzero(self.modes == mode)
            coefficients = np.zeros((counts_of(self.n_frames)[mode], len(channels)))
            for i, channel in enumerate(channels):
                track = self.tracks[channel]
                coefficients[: len(track), i] = track * steps[channel]
            columns[channels] = inverse(mode, coefficients, self.n_frames).T
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
    basis : Basis, optional
        What the blocks' values are coordinates in; of the state itself by default.
    basis_is_shared : bool
        Whether the basis is kept elsewhere, and only referred to.
    """

    skeleton: Skeleton
    block_frames: int
    blocks: tuple[Block, ...]
    basis: Basis | None = None
    basis_is_shared: bool = False

    def describe(self) -> str:
        """Return what was chosen, such as ``"pose spline 80 % dct 15 % still 5 %"``."""
        modes = np.concatenate([block.modes for block in self.blocks])
        names = [mode_name(int(mode)) for mode in modes]
        shares = {name: names.count(name) / len(names) for name in dict.fromkeys(names)}
        ordered = sorted(shares.items(), key=lambda item: -item[1])
        basis = "" if self.basis is None else " class" if self.basis_is_shared else " pca"
        return f"pose{basis} " + " ".join(f"{name} {share:.0%}" for name, share in ordered)


def write_block(block: Block, head_profile: IntArray) -> bytes:
    """Return the bytes of a block (docs/format.md)."""
    lengths = np.array([len(track) for track in block.tracks], dtype=np.int64)
    values = np.concatenate([_NOTHING, *block.tracks])
    spikes = np.zeros((len(block.modes), block.n_frames), dtype=np.int64)
    spikes[block.spikes[:, 0], block.spikes[:, 1]] = block.spikes[:, 2]
    n_numbers = len(values) + 2 * len(block.spikes) + 4 * len(block.modes) + 4
    data = np.zeros(_BYTES_A_NUMBER * n_numbers, dtype=np.uint8)
    coder = new_writer()
    code_bits(coder, data, _GAIN_BITS, block.gain + _GAIN_ZERO)
    modes = block.modes.copy()
    _code_settings(coder, data, _SETTING_MODELS.copy(), modes, block.profile - head_profile)
    _code_tracks(
        coder,
        data,
        new_track_models(),
        new_spike_models(),
        _ends(lengths),
        lengths,
        _SPACINGS[modes],
        _bands(modes, lengths, block.n_frames),
        block.n_frames,
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
    lengths = counts_of(n_frames)[modes]
    ends = _ends(lengths)
    values = np.zeros(int(ends[-1]), dtype=np.int64)
    spikes = np.zeros((len(modes), n_frames), dtype=np.int64)
    _code_tracks(
        coder,
        copy,
        new_track_models(),
        new_spike_models(),
        ends,
        lengths,
        _SPACINGS[modes],
        _bands(modes, lengths, n_frames),
        n_frames,
        values,
        spikes,
    )
    tracks = tuple(values[ends[i] : ends[i] + lengths[i]] for i in range(len(modes)))
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


def _ends(lengths: Sequence[int] | IntArray) -> IntArray:
    """Return (C + 1,) where each of some tracks ends, after where the first starts."""
    ends = np.zeros(len(lengths) + 1, dtype=np.int64)
    np.cumsum(lengths, out=ends[1:])
    return ends


def _bands(modes: IntArray, lengths: IntArray, n_frames: int) -> IntArray:
    """Return the band of each value of each track."""
    ends = _ends(lengths)
    bands = np.zeros(int(ends[-1]), dtype=np.int64)
    for i in np.flatnonzero(modes > STILL):
        bands[ends[i] : ends[i + 1]] = bands_of(int(modes[i]), n_frames)[: lengths[i]]
    return bands


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
    ends: IntArray,
    lengths: IntArray,
    spacings: IntArray,
    bands: IntArray,
    n_frames: int,
    values: IntArray,
    spikes: IntArray,
) -> None:
    activity = new_activity(n_frames)
    first_sizes = new_starts()
    for i in range(len(lengths) - 1, -1, -1):
        if spacings[i] < 0:  # of a transform's coefficients those after the last are zero
            length = code_number(coder, data, models, LENGTH, lengths[i], _LENGTH_BITS)
            lengths[i] = min(length, lengths[i]) if coder[3] else length
        first = ends[i]
        last = first + lengths[i]
        code_track(
            coder,
            data,
            models,
            activity,
            first_sizes,
            new_filters(),
            new_memory(),
            bands[first:last],
            max(spacings[i], 0),
            values[first:last],
        )
        if spacings[i] != 1:
            code_spikes(coder, data, spike_models, n_frames, spikes[i])
