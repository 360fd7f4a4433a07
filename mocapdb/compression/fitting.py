"""The encoder's choices for one block: of every channel its mode, its track and its spikes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb._typing import BoolArray, FloatArray, IntArray
from mocapdb.compression import lattice
from mocapdb.compression.blocks import Block, sparse
from mocapdb.compression.modes import (
    GAIN_STEPS,
    N_SPLINES,
    PROFILE_LIMIT,
    PROFILE_STEPS,
    SAMPLES,
    STILL,
    bands_of,
    fit,
    samples_of,
    step_size,
)
from mocapdb.compression.spikes import SPIKE_BITS, find_spikes
from mocapdb.compression.track import LIMIT

__all__ = ["BlockSearch"]

_RATE = 0.1155  # what a bit is worth in squared steps where rounding errors are uniform
_EAGERNESS = 4.0  # the steps of the trellis are half as wide; the best of 1.2, 2.4, 4 and 6
_MODE_BITS = 4.0
_SPIKE_WEIGHT = 1e-6  # what is left of a frame's weight where a spike takes care of it
_GLANCE = 2  # beginnings kept where modes are compared
_LIKELY_MODES = (0, 5)  # where the descent starts if nothing is known


class BlockSearch:
    """The encoder of one block, for any step.

    Parameters
    ----------
    values : (F, C)
        The states.
    roots : (F / stride, C, C)
        The metric (see `sensitivity`), of every so many frames.
    stride : int
    modes : tuple of int
        Those allowed, besides `STILL`.
    likely : (C,) array of int, optional
        Modes to try first, such as those of the block before.
    """

    def __init__(
        self,
        values: FloatArray,
        roots: FloatArray,
        stride: int,
        modes: tuple[int, ...],
        likely: IntArray | None = None,
    ) -> None:
        self.columns = np.ascontiguousarray(values.T)
        self.allowed = modes
        self.likely = likely
        self.weigh(roots, stride)

    def weigh(self, roots: FloatArray, stride: int) -> None:
        """Take another metric."""
        self.roots = roots
        self.stride = stride
        square = (np.diagonal(roots, axis1=1, axis2=2) ** 2).mean(axis=0)
        profile = np.rint(-0.5 * PROFILE_STEPS * np.log2(square))
        self.profile = np.clip(profile, -PROFILE_LIMIT, PROFILE_LIMIT).astype(np.int64)

    def encode(self, gain: int) -> Block:
        """Return the block's integers for a step of ``2 ** (gain / 64)`` skeleton units."""
        n_channels, n_frames = self.columns.shape
        errors = np.zeros((n_frames, n_channels))
        goal, weights = np.empty(n_frames), np.empty(n_frames)
        modes = np.zeros(n_channels, dtype=np.int64)
        tracks = [np.empty(0, dtype=np.int64)] * n_channels
        spikes = np.zeros((n_channels, n_frames), dtype=np.int64)
        for channel in range(n_channels - 1, -1, -1):
            values = self.columns[channel]
            lattice.aim(values, self.roots, self.stride, errors, channel, goal, weights)
            fitting = _Fitting(goal, weights, int(self.profile[channel]), gain)
            likely = None if self.likely is None else int(self.likely[channel])
            modes[channel] = fitting.best_mode(self.allowed, likely)
            choice = fitting.finish(int(modes[channel]))
            tracks[channel] = choice.track
            if choice.spikes is not None:
                spikes[channel] = choice.spikes
            errors[:, channel] = values - choice.samples
        self.likely = modes
        return Block(n_frames, gain, self.profile, modes, tuple(tracks), sparse(spikes))


@dataclass(frozen=True)
class _Choice:
    """What a mode makes of a channel's goal, and what that costs."""

    track: IntArray
    spikes: IntArray | None
    samples: FloatArray
    cost: float


class _Fitting:
    """A channel's goal and what the modes make of it."""

    def __init__(self, goal: FloatArray, weights: FloatArray, profile: int, gain: int) -> None:
        self.goal = goal
        self.weights = weights
        self.profile = profile
        self.gain = gain
        self.rate = _EAGERNESS * _RATE * 4.0 ** (gain / GAIN_STEPS)
        self.costs: dict[int, float] = {}

    def cost(self, mode: int) -> float:
        """Return what a mode costs: the error it leaves and the bits it takes."""
        if mode not in self.costs:
            self.costs[mode] = self._choose(mode, _GLANCE).cost
        return self.costs[mode]

    def finish(self, mode: int) -> _Choice:
        """Return a mode's integers, searched for with care."""
        return self._choose(mode, lattice.BEAM)

    def _choose(self, mode: int, beam: int) -> _Choice:
        """Return the cheaper of a curve through all frames and one with spikes left out."""
        plain = self._curve(mode, beam, self.weights)
        if mode == SAMPLES or mode > STILL:
            return plain
        is_spike = find_spikes(self.goal - plain.samples, self.weights, self.rate)
        if not is_spike.any():
            return plain
        weights = np.where(is_spike, _SPIKE_WEIGHT * self.weights, self.weights)
        spiked = self._add_spikes(self._curve(mode, beam, weights), is_spike)
        return min(plain, spiked, key=lambda choice: choice.cost)

    def _curve(self, mode: int, beam: int, weights: FloatArray) -> _Choice:
        """Return a mode's best curve where frames weigh so much."""
        step = step_size(self.profile, self.gain, mode)
        best, factor = fit(self.goal, weights, mode)
        bands = bands_of(mode, len(self.goal))
        track, bits = lattice.search(best / step, factor * step, bands, self.rate, beam)
        samples = samples_of(track, mode, step, np.empty_like(self.goal))
        missed = float(weights @ (self.goal - samples) ** 2)
        return _Choice(track, None, samples, missed + self.rate * (bits + _MODE_BITS))

    def _add_spikes(self, curve: _Choice, is_spike: BoolArray) -> _Choice:
        """Return a choice whose spikes make up for what a curve misses where they are."""
        step = step_size(self.profile, self.gain, SAMPLES)
        misses = np.where(is_spike, self.goal - curve.samples, 0.0)
        spikes = np.clip(np.rint(misses / step), 1 - LIMIT, LIMIT - 1)
        left = misses - spikes * step
        cost = float(self.weights @ left**2) + self.rate * SPIKE_BITS * int(is_spike.sum())
        return _Choice(
            curve.track, spikes.astype(np.int64), curve.samples + spikes * step, curve.cost + cost
        )

    def best_mode(self, allowed: tuple[int, ...], likely: int | None) -> int:
        """Return the mode of least cost; of the splines, by descent from neighbour to neighbour."""
        for mode in (STILL, *(mode for mode in allowed if mode > STILL)):
            self.cost(mode)
        if SAMPLES in allowed:
            starts = _LIKELY_MODES if likely is None else (min(likely, N_SPLINES - 1),)
            for start in starts:
                self._descend(start)
        return min(self.costs, key=self.cost)

    def _descend(self, mode: int) -> None:
        while True:
            near = range(max(mode - 1, 0), min(mode + 2, N_SPLINES))
            best = min(near, key=self.cost)
            if best == mode:
                return
            mode = best
