"""The encoder's choices for one block: of every channel its mode, its track and its spikes."""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.base.kernels import jit
from mocapdb.compression.pose import quantise as lattice
from mocapdb.compression.pose import spline
from mocapdb.compression.pose.blocks import Block, sparse
from mocapdb.compression.pose.entropy import LIMIT
from mocapdb.compression.pose.modes import (
    GAIN_STEPS,
    N_SPLINES,
    PROFILE_LIMIT,
    PROFILE_STEPS,
    SAMPLES,
    SPACINGS,
    STILL,
    bands_of,
    counts_of,
    forward,
    inverse,
    mode_steps,
)
from mocapdb.compression.pose.spikes import SPIKE_BITS, is_spike

__all__ = ["BlockSearch"]

_RATE = 0.1155  # what a bit is worth in squared steps where rounding errors are uniform
_EAGERNESS = 4.0  # the steps of the trellis are half as wide; the best of 1.2, 2.4, 4 and 6
_MODE_BITS = 4.0
_LENGTH_BITS = 8.0
_SPIKE_WEIGHT = 1e-6  # what is left of a frame's weight where a spike takes care of it
_WORTHY = 0.6  # steps; what is smaller at the end of a transform is not looked at
_DOUBT = 1.04  # a transform has to earn its place: nothing after it learns from its track
_GLANCE = 2  # beginnings kept where modes are compared
_LIKELY_MODE = 5  # where the descent starts if nothing is known, besides at the samples
_NOTHING = np.empty(0, dtype=np.int64)
_KNOTS = np.array([*SPACINGS, 0], dtype=np.int64)  # of splines, and 0 for `STILL`


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

    def encode(self, gain: int, *, explore: bool = True) -> Block:
        """Return the block's integers for a step of ``2 ** (gain / 64)`` skeleton units.

        Parameters
        ----------
        gain : int
        explore : bool
            Whether to look for better modes than the likely ones.
        """
        n_channels, n_frames = self.columns.shape
        errors = np.zeros((n_frames, n_channels))
        goal, weights = np.empty(n_frames), np.empty(n_frames)
        modes = np.zeros(n_channels, dtype=np.int64)
        tracks = [_NOTHING] * n_channels
        spikes = np.zeros((n_channels, n_frames), dtype=np.int64)
        rate = _EAGERNESS * _RATE * 4.0 ** (gain / GAIN_STEPS)
        for channel in range(n_channels - 1, -1, -1):
            values = self.columns[channel]
            lattice.aim(values, self.roots, self.stride, errors, channel, goal, weights)
            steps = mode_steps(int(self.profile[channel]), gain)
            likely = -1 if self.likely is None else int(self.likely[channel])
            mode = likely
            if explore or likely < 0:
                mode = self._best_mode(goal, weights, steps, rate, likely)
            if mode <= STILL:
                tracks[channel], spikes[channel], samples, _ = _fit_curve(
                    goal, weights, _KNOTS[mode], steps[mode], steps[SAMPLES], rate, lattice.BEAM
                )
            else:
                tracks[channel], _ = _transformed(
                    goal, weights, mode, steps[mode], rate, lattice.BEAM
                )
                coefficients = np.zeros((1, counts_of(n_frames)[mode]))
                coefficients[0, : len(tracks[channel])] = tracks[channel] * steps[mode]
                samples = inverse(mode, coefficients, n_frames)[0]
            modes[channel] = mode
            errors[:, channel] = values - samples
        self.likely = modes
        lengths = np.array([len(track) for track in tracks], dtype=np.int64)
        integers = np.concatenate([_NOTHING, *tracks]).astype(np.int32)
        return Block(n_frames, gain, self.profile, modes, integers, lengths, sparse(spikes))

    def _best_mode(
        self, goal: FloatArray, weights: FloatArray, steps: FloatArray, rate: float, likely: int
    ) -> int:
        """Return the mode of least cost, by a glance at each that comes into question."""
        splines_too = SAMPLES in self.allowed
        best, least = _descend(goal, weights, steps, rate, _GLANCE, likely, splines_too)
        for mode in self.allowed:
            if mode > STILL:
                cost = _transformed(goal, weights, mode, steps[mode], rate, _GLANCE)[1]
                if _DOUBT * cost < least:
                    best, least = mode, cost
        return best


def _transformed(
    goal: FloatArray, weights: FloatArray, mode: int, step: float, rate: float, beam: int
) -> tuple[IntArray, float]:
    """Return the track of a transform's coefficients, and about what it costs.

    All frames weigh the same to it.
    """
    best = forward(mode, goal) / step
    worthy = np.flatnonzero(np.abs(best) > _WORTHY)
    n = int(worthy[-1]) + 1 if len(worthy) else 1
    weight = float(weights.mean()) * step * step
    factor = np.zeros((n, 4))
    factor[:, 0] = math.sqrt(weight)
    track, bits = lattice.search(best[:n], factor, bands_of(mode, len(goal)), rate, beam)
    missed = weight * float(((best[:n] - track) ** 2).sum() + (best[n:] ** 2).sum())
    return np.trim_zeros(track, "b"), missed + rate * (bits + _MODE_BITS + _LENGTH_BITS)


@jit
def _descend(
    goal: FloatArray,
    weights: FloatArray,
    steps: FloatArray,
    rate: float,
    beam: int,
    likely: int,
    splines_too: bool,
) -> tuple[int, float]:
    """Return the best of `STILL` and the splines and what it costs.

    Splines are found by descent from the likely one from neighbour to neighbour.
    """
    costs = np.full(N_SPLINES + 1, np.inf)
    known = np.zeros(N_SPLINES + 1, dtype=np.bool_)
    best = STILL
    likeliest = _LIKELY_MODE if likely < 0 else min(likely, N_SPLINES - 1)
    starts = (STILL, likeliest, SAMPLES if likely < 0 else likeliest)
    for start in starts:
        mode = start
        if mode != STILL and not splines_too:
            break
        while True:
            first, last = max(mode - 1, 0), min(mode + 2, N_SPLINES)
            if mode == STILL:
                first, last = STILL, STILL + 1
            for near in range(first, last):
                if not known[near]:
                    known[near] = True
                    costs[near] = _fit_curve(
                        goal, weights, _KNOTS[near], steps[near], steps[SAMPLES], rate, beam
                    )[3]
            lowest = mode
            for near in range(first, last):
                if costs[near] < costs[lowest]:
                    lowest = near
            if lowest == mode:
                break
            mode = lowest
        if costs[mode] < costs[best]:
            best = mode
    return best, costs[best]


@jit
def _fit_curve(
    goal: FloatArray,
    weights: FloatArray,
    spacing: int,
    step: float,
    sample_step: float,
    rate: float,
    beam: int,
) -> tuple[IntArray, IntArray, FloatArray, float]:
    """Return the cheaper of a curve through all frames and one with spikes left out.

    Parameters
    ----------
    goal, weights : (F,)
    spacing : int
        Frames between knots; 0 for one value for all frames.
    step, sample_step : float
        What an integer of the curve stands for, and one of a spike.
    rate : float
        What a bit is worth.
    beam : int

    Returns
    -------
    track : (N,)
    spikes : (F,)
    samples : (F,)
    float, what it costs
    """
    n_frames = len(goal)
    spikes = np.zeros(n_frames, dtype=np.int64)
    lighter = weights.copy()
    track, samples, cost = _plain_curve(goal, lighter, spacing, step, rate, beam)
    n_spikes = 0
    if spacing != 1 and n_frames > 1:
        for t in range(n_frames):
            if is_spike(goal, samples, weights, t, rate):
                lighter[t] *= _SPIKE_WEIGHT
                n_spikes += 1
    if n_spikes == 0:
        return track, spikes, samples, cost
    other, passed, other_cost = _plain_curve(goal, lighter, spacing, step, rate, beam)
    other_cost += rate * SPIKE_BITS * n_spikes
    for t in range(n_frames):
        if lighter[t] != weights[t]:
            miss = goal[t] - passed[t]
            amount = min(max(np.rint(miss / sample_step), 1 - LIMIT), LIMIT - 1)
            spikes[t] = int(amount)
            passed[t] += amount * sample_step
            other_cost += weights[t] * (goal[t] - passed[t]) ** 2 - lighter[t] * miss**2
    if other_cost < cost:
        return other, spikes, passed, other_cost
    spikes[:] = 0
    return track, spikes, samples, cost


@jit
def _plain_curve(
    goal: FloatArray, weights: FloatArray, spacing: int, step: float, rate: float, beam: int
) -> tuple[IntArray, FloatArray, float]:
    """Return a curve's track, its samples, and what they cost."""
    n_frames = len(goal)
    samples = np.empty(n_frames)
    if spacing > 0:
        n = spline.coefficient_count(n_frames, spacing)
        best, factor = spline.factorise(goal, weights, spacing, n)
    else:
        n = 1
        total, product = 0.0, 0.0
        for t in range(n_frames):
            total += weights[t]
            product += weights[t] * goal[t]
        best = np.full(1, product / total)
        factor = np.zeros((1, 4))
        factor[0, 0] = np.sqrt(total)
    for k in range(n):
        best[k] /= step
        for d in range(4):
            factor[k, d] *= step
    track, bits = lattice.search(best, factor, np.zeros(n, dtype=np.uint8), rate, beam)
    for k in range(n):
        best[k] = track[k] * step
    if spacing > 0:
        spline.evaluate(best, spacing, 0, samples)
    else:
        samples[:] = best[0]
    missed = 0.0
    for t in range(n_frames):
        missed += weights[t] * (goal[t] - samples[t]) ** 2
    return track, samples, missed + rate * (bits + _MODE_BITS)
