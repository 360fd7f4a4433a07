"""The frames of many clips as a query goes over them.

A number is kept in a byte, in steps of a sixteenth of its axis's standard deviation: distances
change by 2 % of the distance of two frames taken at random, and a whole corpus fits into memory.

A rough search goes over two coarser copies first. The *sketch* has the means of three frames along
sixteen axes, the *outline* of two frames of the sketch along eight.

`Frames`        the frames of many clips, one after another
`MotionIndex`   what is searched: all frames, and a sketch of them
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mocapdb.base.arrays import BoolArray, Float32Array, IntArray
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.search.features import FeatureSpace
from mocapdb.indexing.search.signature import clip_signature
from mocapdb.indexing.tuning import (
    OUTLINE_AXES,
    OUTLINE_FRAMES,
    SKETCH_AXES,
    SKETCH_FRAMES,
    STEPS_PER_DEVIATION,
)

__all__ = [
    "OUTLINE_FRAMES",
    "SKETCH_AXES",
    "SKETCH_FRAMES",
    "TURN_STEPS",
    "CodedClip",
    "Frames",
    "MotionIndex",
    "code_clip",
    "coded_turns",
    "index_of",
    "outline_of",
    "sketch_of",
    "steps_of",
]

TURN_STEPS = 128.0
"""A radian, in the unit of an index's turns: 24 radians a second still fit into a byte."""

LARGEST = 127  # of a signed byte, as far below zero as above

Codes = NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class Frames:
    """The frames of many clips, one after another.

    Parameters
    ----------
    codes : (N, D) int8
        May be memory-mapped; D is a multiple of 4.
    steps : (D,) float32, metres
        What one step of each axis stands for.
    starts : (n + 1,)
        First frame of each clip, and N at the end.
    """

    codes: Codes
    steps: Float32Array
    starts: IntArray

    def __len__(self) -> int:
        return len(self.codes)

    def values(self, rows: slice | IntArray) -> Float32Array:
        """Return some of the frames in metres, (F, D)."""
        return np.asarray(self.codes[rows] * self.steps)

    def of_clips(self, first: int, last: int) -> Codes:
        """Return the codes of a range of clips, the last included."""
        return self.codes[self.starts[first] : self.starts[last + 1]]

    def clip_of(self, frame: int) -> int:
        """Return the clip that a frame belongs to."""
        return int(np.searchsorted(self.starts, frame, side="right")) - 1


def steps_of(space: FeatureSpace) -> Float32Array:
    """Return (D,) metres that one step of each axis of a space stands for."""
    steps = np.maximum(space.deviations, 1e-9) / STEPS_PER_DEVIATION
    return np.asarray(steps, dtype=np.float32)


@dataclass(frozen=True, eq=False)
class CodedClip:
    """What an index keeps of one clip."""

    frames: Codes
    sketch: Codes
    signature: Float32Array


def code_clip(space: FeatureSpace, values: Float32Array) -> CodedClip:
    """Return what an index keeps of a clip with frames (F, D)."""
    steps = steps_of(space)
    return CodedClip(
        _codes(values, steps),
        _codes(sketch_of(values), steps[:SKETCH_AXES]),
        clip_signature(values),
    )


def coded_turns(motion: CanonicalMotion) -> Codes:
    """Return (F,) by how much each frame faces elsewhere than the one before; they add up."""
    steps = np.diff(np.rint(motion.yaw * TURN_STEPS), prepend=np.rint(motion.yaw[:1] * TURN_STEPS))
    return np.asarray(np.clip(steps, -LARGEST, LARGEST), dtype=np.int8)


def sketch_of(values: Float32Array) -> Float32Array:
    """Return the mean of every three frames along the first sixteen axes, (ceil(F / 3), 16)."""
    return _means_of(values[:, :SKETCH_AXES], SKETCH_FRAMES)


def outline_of(values: Float32Array) -> Float32Array:
    """Return the mean of every two frames of a sketch along its first eight axes."""
    return _means_of(values[:, :OUTLINE_AXES], OUTLINE_FRAMES)


def _means_of(values: Float32Array, n: int) -> Float32Array:
    firsts = np.arange(0, len(values), n)
    counts = np.minimum(n, len(values) - firsts).astype(np.float32)
    return np.asarray(np.add.reduceat(values, firsts, axis=0) / counts[:, None])


def _codes(values: Float32Array, steps: Float32Array) -> Codes:
    return np.asarray(np.clip(np.rint(values / steps), -LARGEST, LARGEST), dtype=np.int8)


@dataclass(frozen=True, eq=False)
class MotionIndex:
    """The frames of many clips, in a space where distances mean something.

    Parameters
    ----------
    space : FeatureSpace
    frames : Frames
    sketch : Frames
        The same clips at a third of the rate, along the first sixteen axes.
    signatures : (n, 2 D)
        Mean and deviation of each clip's frames.
    usual : (n,) of bool
        Which clips lie where clips do: see `features.outlying`.
    turns : (N,) int8, optional
        By how much each frame faces elsewhere than the one before, in 1/128 radian; None where
        that does not count, or an earlier version has not kept it.
    """

    space: FeatureSpace
    frames: Frames
    sketch: Frames
    signatures: Float32Array
    usual: BoolArray
    turns: Codes | None = None

    @classmethod
    def of(
        cls, motions: Sequence[CanonicalMotion], space: FeatureSpace | None = None
    ) -> MotionIndex:
        """Return the index of motions held in memory; the space is fitted to them by default."""
        space = space or FeatureSpace.fit(motions)
        usual = np.array([not space.is_outlying(motion) for motion in motions], dtype=np.bool_)
        turns = np.concatenate([np.zeros(0, np.int8), *map(coded_turns, motions)])
        return index_of(space, [space.frames(motion) for motion in motions], usual, turns)

    def __len__(self) -> int:
        return len(self.frames.starts) - 1

    @cached_property
    def outline(self) -> Frames:
        """The sketch at half its rate, along its first eight axes."""
        codes, starts = self.sketch.codes[:, :OUTLINE_AXES], self.sketch.starts
        counts = -(-np.diff(starts) // OUTLINE_FRAMES)
        own_starts = np.concatenate([[0], np.cumsum(counts)])
        of_clip = np.arange(own_starts[-1]) - np.repeat(own_starts[:-1], counts)
        firsts = np.repeat(starts[:-1], counts) + OUTLINE_FRAMES * of_clip
        lasts = np.repeat(starts[1:], counts) - 1
        sums = np.zeros((len(firsts), OUTLINE_AXES), dtype=np.int16)
        for i in range(OUTLINE_FRAMES):  # the last frame of a clip may stand for one that is not
            sums += codes[np.minimum(firsts + i, lasts)]
        means = np.asarray(sums // OUTLINE_FRAMES, dtype=np.int8)
        return Frames(means, self.sketch.steps[:OUTLINE_AXES], own_starts)


def index_of(
    space: FeatureSpace,
    clips: Iterable[Float32Array],
    usual: BoolArray | None = None,
    turns: Codes | None = None,
) -> MotionIndex:
    """Return the index of clips whose frames (F, D) are given; all are usual by default."""
    coded = [code_clip(space, values) for values in clips]
    steps = steps_of(space)
    return MotionIndex(
        space,
        _joined([clip.frames for clip in coded], steps),
        _joined([clip.sketch for clip in coded], steps[:SKETCH_AXES]),
        np.array([clip.signature for clip in coded]),
        np.ones(len(coded), dtype=np.bool_) if usual is None else usual,
        turns,
    )


def _joined(clips: Sequence[Codes], steps: Float32Array) -> Frames:
    starts = np.zeros(len(clips) + 1, dtype=np.int64)
    np.cumsum([len(codes) for codes in clips], out=starts[1:])
    return Frames(np.concatenate([np.zeros((0, len(steps)), np.int8), *clips]), steps, starts)
