"""Blocks: a range of frames as integers, and as bytes.

Blocks do not depend on each other, so any of them can be decoded alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import ByteArray, FloatArray, Int32Array, IntArray
from mocapdb.base.kernels import jit
from mocapdb.compression.pose import spline
from mocapdb.compression.pose.class_basis import Basis
from mocapdb.compression.pose.entropy import (
    LENGTH_CONTEXT,
    code_track,
    new_activity,
    new_filters,
    new_first_sizes,
    new_size_memory,
    new_track_models,
)
from mocapdb.compression.pose.modes import (
    MODES,
    PROFILE_LIMIT,
    SAMPLES,
    SPACINGS,
    STILL,
    inverse,
    mode_name,
    step_sizes,
    track_bands,
    track_lengths,
)
from mocapdb.compression.pose.range_coder import (
    N_SYMBOLS,
    ModelArray,
    code_bits,
    code_number,
    code_signed,
    code_symbol,
    finish_writer,
    new_models,
    new_reader,
    new_writer,
)
from mocapdb.compression.pose.spikes import code_spikes, new_spike_models
from mocapdb.errors import CodecError
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Block", "CodedClip", "list_spikes", "read_block", "write_block"]

_QP_BITS = 14
_QP_ZERO = 1 << (_QP_BITS - 1)
_CHANGE_BITS = 12
_LENGTH_BITS = 13
_SAMPLES = np.array([SAMPLES])
_BYTES_A_NUMBER = 16  # more than any number takes: its length, bits and sign, all unlikely
_SPACINGS = np.array([*SPACINGS, 0] + [-1] * (MODES - STILL - 1), dtype=np.int64)


@dataclass(frozen=True)
class Block:
    """A block of frames as integers.

    Attributes
    ----------
    n_frames : int
    qp : int
        The quantisation parameter: the block's step is ``2 ** (qp / 64)`` skeleton units.
    profile : (C,)
        The channels' steps beside the block's, in 1/3 octaves.
    modes : (C,)
    integers : (N,) int32
        The tracks of the channels, one after the other.
    lengths : (C,)
        Of each track. Of a transform's coefficients there are only those up to the last that is
        not zero.
    spikes : (S, 3)
        Channel, frame and amount of samples that differ from what the tracks stand for.
    """

    n_frames: int
    qp: int
    profile: IntArray
    modes: IntArray
    integers: Int32Array
    lengths: IntArray
    spikes: IntArray

    def values(self, first: int = 0, end: int | None = None) -> FloatArray:
        """Return the values (F, C) that the integers stand for, of all frames or of a range."""
        end = self.n_frames if end is None else end
        columns = np.empty((len(self.modes), end - first))
        steps = step_sizes(self.profile, self.qp, self.modes)
        starts = _track_ends(self.lengths)
        spline.evaluate_all(self.integers, starts, _SPACINGS[self.modes], steps, first, columns)
        for mode in set(self.modes[self.modes > STILL].tolist()):
            own = self.modes == mode
            coefficients = np.zeros((own.sum(), track_lengths(self.n_frames)[mode]))
            is_there = np.arange(coefficients.shape[1]) < self.lengths[own, None]
            coefficients[is_there] = self.integers[np.repeat(own, self.lengths)]
            coefficients *= steps[own, None]
            columns[own] = inverse(mode, coefficients, self.n_frames)[:, first:end]
        frames = self.spikes[:, 1]
        channels, frames, amounts = self.spikes[(frames >= first) & (frames < end)].T
        sample_steps = step_sizes(self.profile[channels], self.qp, _SAMPLES)
        columns[channels, frames - first] += amounts * sample_steps
        return np.ascontiguousarray(columns.T)


@dataclass(frozen=True)
class CodedClip:
    """A clip as integers.

    Attributes
    ----------
    skeleton : Skeleton
        The one that the smooth channels belong to.
    block_frames : int
        Frames of every block; the last may have fewer.
    blocks : tuple of Block
    basis : Basis, optional
        What the blocks' values are coordinates in; by default they are the smooth channels.
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
    spikes = np.zeros((len(block.modes), block.n_frames), dtype=np.int64)
    spikes[block.spikes[:, 0], block.spikes[:, 1]] = block.spikes[:, 2]
    n_numbers = len(block.integers) + 2 * len(block.spikes) + 4 * len(block.modes) + 4
    data = np.zeros(_BYTES_A_NUMBER * n_numbers, dtype=np.uint8)
    coder = new_writer()
    modes = block.modes.copy()
    changes = block.profile - head_profile
    _code_settings(coder, data, _SETTING_MODELS.copy(), block.qp, modes, changes)
    _code_tracks(
        coder,
        data,
        new_track_models(),
        new_spike_models(),
        _track_ends(block.lengths),
        block.lengths.copy(),
        modes,
        _bands(modes, block.n_frames),
        block.n_frames,
        block.integers.astype(np.int64),
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
    modes = np.zeros(len(head_profile), dtype=np.int64)
    changes = np.zeros(len(head_profile), dtype=np.int64)
    qp = _code_settings(coder, copy, _SETTING_MODELS.copy(), 0, modes, changes)
    profile = head_profile + changes
    if len(modes) and (modes.max() >= MODES or np.abs(profile).max() > PROFILE_LIMIT):
        raise CodecError("Expected modes and step sizes of a block, but got nonsense.")
    counts = track_lengths(n_frames)[modes]
    lengths = counts.copy()
    ends = _track_ends(counts)
    integers = np.zeros(int(ends[-1]), dtype=np.int64)
    spikes = np.zeros((len(modes), n_frames), dtype=np.int64)
    _code_tracks(
        coder,
        copy,
        new_track_models(),
        new_spike_models(),
        ends,
        lengths,
        modes,
        _bands(modes, n_frames),
        n_frames,
        integers,
        spikes,
    )
    if (lengths < counts).any():  # zeros were left out
        integers = integers[np.arange(len(integers)) < np.repeat(ends[:-1] + lengths, counts)]
    kept = integers.astype(np.int32)
    return Block(n_frames, qp, profile, modes, kept, lengths, list_spikes(spikes))


def list_spikes(spikes: IntArray) -> IntArray:
    """Return channel, frame and amount of the nonzero entries of (C, F) amounts."""
    found = np.empty((np.count_nonzero(spikes), 3), dtype=np.int64)
    _fill_spikes(spikes, found)
    return found


@jit
def _fill_spikes(spikes: IntArray, found: IntArray) -> None:
    n = 0
    for channel in range(len(spikes)):
        if n == len(found):
            return
        for frame in range(spikes.shape[1]):
            if spikes[channel, frame] != 0:
                found[n, 0], found[n, 1], found[n, 2] = channel, frame, spikes[channel, frame]
                n += 1


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


def _track_ends(lengths: Sequence[int] | IntArray) -> IntArray:
    """Return (C + 1,) where each of some tracks ends, after where the first starts."""
    ends = np.zeros(len(lengths) + 1, dtype=np.int64)
    np.cumsum(lengths, out=ends[1:])
    return ends


def _bands(modes: IntArray, n_frames: int) -> ByteArray:
    """Return (MODES, N) the bands of a track's integers, of those modes that occur."""
    bands = np.zeros((MODES, int(track_lengths(n_frames).max())), dtype=np.uint8)
    for mode in set(modes[modes > STILL].tolist()):
        own = track_bands(mode, n_frames)
        bands[mode, : len(own)] = own
    return bands


@jit
def _code_settings(
    coder: IntArray,
    data: ByteArray,
    models: ModelArray,
    qp: int,
    modes: IntArray,
    changes: IntArray,
) -> int:
    """Write the settings of a block, or read them; return its quantisation parameter."""
    qp = code_bits(coder, data, _QP_BITS, qp + _QP_ZERO) - _QP_ZERO
    previous = 5
    for i in range(len(modes) - 1, -1, -1):
        modes[i] = code_symbol(coder, data, models, previous, modes[i])
        previous = modes[i]
    for i in range(len(modes) - 1, -1, -1):
        changes[i] = code_signed(coder, data, models, N_SYMBOLS, changes[i], _CHANGE_BITS)
    return qp


@jit
def _code_tracks(
    coder: IntArray,
    data: ByteArray,
    models: ModelArray,
    spike_models: ModelArray,
    ends: IntArray,
    lengths: IntArray,
    modes: IntArray,
    bands: ByteArray,
    n_frames: int,
    integers: IntArray,
    spikes: IntArray,
) -> None:
    activity = new_activity(n_frames)
    first_sizes = new_first_sizes()
    for i in range(len(lengths) - 1, -1, -1):
        spacing = _SPACINGS[modes[i]]
        if spacing < 0:  # of a transform's coefficients those after the last are zero
            length = code_number(coder, data, models, LENGTH_CONTEXT, lengths[i], _LENGTH_BITS)
            lengths[i] = min(length, lengths[i]) if coder[3] else length
        first = ends[i]
        last = first + lengths[i]
        code_track(
            coder,
            data,
            models,
            activity,
            first_sizes,
            new_filters(1),
            new_size_memory(1),
            bands[modes[i]],
            max(spacing, 0),
            integers[first:last],
        )
        if spacing != 1:
            code_spikes(coder, data, spike_models, n_frames, spikes[i])
