"""The encoder of one block: for every channel it chooses a mode, a track and spikes.

Choices are made by rate-distortion cost: weighted squared error, plus bits times what a bit costs.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mocapdb.base.arrays import BoolArray, ByteArray, FloatArray, IntArray
from mocapdb.base.kernels import jit
from mocapdb.compression.pose import spline
from mocapdb.compression.pose.block_metric import BlockMetric
from mocapdb.compression.pose.blocks import Block, list_spikes
from mocapdb.compression.pose.entropy import VALUE_LIMIT
from mocapdb.compression.pose.modes import (
    N_SPLINES,
    PROFILE_LIMIT,
    PROFILE_PER_OCTAVE,
    QP_PER_OCTAVE,
    SAMPLES,
    SPACINGS,
    STILL,
    forward,
    inverse,
    mode_steps,
    track_bands,
    track_lengths,
)
from mocapdb.compression.pose.quantise import beam_search, feed_back_errors
from mocapdb.compression.pose.spikes import is_spike
from mocapdb.compression.tuning import (
    BEAM_WIDTH,
    BIT_PRICE,
    COEFFICIENT_BITS,
    EXPLORE_AFTER,
    FIRST_MODE,
    LAST_COEFFICIENT,
    LEAST_BITS,
    MODE_BITS,
    NARROW_BEAM_WIDTH,
    SPIKE_BITS,
    SPIKE_WEIGHT,
    TRANSFORM_BITS,
    TRANSFORM_DOUBT,
    TRANSFORM_HANDICAP,
    TRANSFORM_SCALE,
)

__all__ = ["BlockEncoder"]

_KNOTS = np.array([*SPACINGS, 0], dtype=np.int64)  # of splines, and 0 for `STILL`


class BlockEncoder:
    """The encoder of one block, for any step.

    Parameters
    ----------
    values : (F, C)
        The smooth channels, or their coordinates in a basis.
    metric : BlockMetric
    modes : tuple of int
        Those allowed, besides `STILL`.
    previous_modes : (C,) array of int, optional
        Modes to try first, such as those of the block before.
    """

    def __init__(
        self,
        values: FloatArray,
        metric: BlockMetric,
        modes: tuple[int, ...],
        previous_modes: IntArray | None = None,
    ) -> None:
        self.columns = np.ascontiguousarray(values.T)
        self.metric = metric
        self.allowed_modes = modes
        self.previous_modes = previous_modes
        self._explored_at = np.full(len(self.columns), np.inf)  # the steps' octaves

    def set_steps(self) -> None:
        """Give each channel the step that suits the metric as it is now."""
        diagonals = np.diagonal(self.metric.factors, axis1=1, axis2=2)
        n_frames = np.bincount(self.metric.rows)  # of each factor
        square = n_frames @ diagonals**2 / len(self.metric.rows)
        profile = np.rint(-0.5 * PROFILE_PER_OCTAVE * np.log2(square))
        self.profile = np.clip(profile, -PROFILE_LIMIT, PROFILE_LIMIT).astype(np.int64)

    def seek_modes(self, columns: BoolArray | slice = slice(None)) -> None:
        """Let the modes of some channels (C,), or of all, be chosen anew the next time."""
        self._explored_at[columns] = np.inf

    @property
    def costs(self) -> FloatArray:
        """What a squared error of each channel (C,) costs, on average and about."""
        costs: FloatArray = np.exp2(-2.0 / PROFILE_PER_OCTAVE * self.profile)
        return costs

    def encode(
        self,
        qp: int,
        *,
        explore: bool = True,
        price: float = 1.0,
        n_anew: int | None = None,
        beam_width: int = BEAM_WIDTH,
    ) -> Block:
        """Return the block's integers for a step of ``2 ** (qp / 64)`` skeleton units.

        Parameters
        ----------
        qp : int
            The quantisation parameter.
        explore : bool
            Whether to look for better modes, of the channels whose step has changed since that was
            done last, and of those that `seek_modes` named.
        price : float
            How many times its usual price a bit costs.
        n_anew : int, optional
            Only so many first channels are encoded, those that come last in the order of coding;
            the others stay as they were encoded last, at the same step.
        beam_width : int
            How many paths the search for integers keeps.
        """
        n_channels, n_frames = self.columns.shape
        if n_anew is None:
            n_anew = n_channels
            self._errors = np.zeros((n_frames, n_channels))
            longest = max(int(track_lengths(n_frames).max()), len(_one_band(n_frames)))
            self._tracks = np.zeros((n_channels, longest), dtype=np.int64)
            self._lengths = np.zeros(n_channels, dtype=np.int64)
            self._spikes = np.zeros((n_channels, n_frames), dtype=np.int64)
        goal, weights = np.empty(n_frames), np.empty(n_frames)
        modes = np.full(n_channels, -1, dtype=np.int64)
        if self.previous_modes is not None:
            modes[:] = self.previous_modes
        bit_cost = price * BIT_PRICE * 4.0 ** (qp / QP_PER_OCTAVE)
        steps = mode_steps(self.profile, qp)
        octaves = self.profile / PROFILE_PER_OCTAVE + qp / QP_PER_OCTAVE
        is_due = np.abs(octaves - self._explored_at) >= EXPLORE_AFTER
        is_due = (explore & is_due) | (modes < 0)
        self._explored_at[is_due] = octaves[is_due]
        channel = n_anew
        while channel > 0:
            channel, least = _code_curves(
                self.columns,
                self.metric.factors,
                self.metric.rows,
                channel,
                modes,
                is_due,
                SAMPLES in self.allowed_modes,
                max(self.allowed_modes) > STILL,
                steps,
                _one_band(n_frames),
                bit_cost,
                beam_width,
                goal,
                weights,
                self._errors,
                self._spikes,
                self._tracks,
                self._lengths,
            )
            if channel == 0:
                break
            own = channel - 1  # a transform may be best for it
            track = None
            if is_due[own]:
                is_due[own] = False
                modes[own], track = self._best_mode(
                    goal, weights, steps[own], bit_cost, int(modes[own]), least
                )
            mode = int(modes[own])
            if mode > STILL:
                step = steps[own, mode]
                if track is None:
                    asked = _transformed(goal, weights, mode, step, bit_cost)
                    track, _ = _encode_transform(*asked)
                self._keep_transform(own, track, mode, step)
                channel = own
        self.previous_modes = modes
        is_used = np.arange(self._tracks.shape[1]) < self._lengths[:, None]
        integers = self._tracks[is_used].astype(np.int32)
        spikes = list_spikes(self._spikes)
        return Block(n_frames, qp, self.profile, modes, integers, self._lengths.copy(), spikes)

    def _best_mode(
        self,
        goal: FloatArray,
        weights: FloatArray,
        steps: FloatArray,
        bit_cost: float,
        best: int,
        least: float,
    ) -> tuple[int, IntArray | None]:
        """Return the mode of least cost, the best curve or a transform, and that one's track.

        What a transform costs is estimated, and where this leaves doubt, found: its track is known
        then.
        """
        known = None
        for mode in self.allowed_modes:
            if mode > STILL and least > LEAST_BITS * bit_cost:
                asked = _transformed(goal, weights, mode, steps[mode], bit_cost)
                cost, track = _transform_cost(*asked), None
                if least / TRANSFORM_DOUBT < TRANSFORM_HANDICAP * cost < TRANSFORM_DOUBT * least:
                    track, cost = _encode_transform(*asked)
                if TRANSFORM_HANDICAP * cost < least:
                    best, least, known = mode, cost, track
        return best, known

    def _keep_transform(self, channel: int, track: IntArray, mode: int, step: float) -> None:
        """Write the track and the errors of a channel that becomes a transform's coefficients."""
        n_frames = len(self._errors)
        coefficients = np.zeros((1, track_lengths(n_frames)[mode]))
        coefficients[0, : len(track)] = track * step
        self._errors[:, channel] = self.columns[channel] - inverse(mode, coefficients, n_frames)[0]
        self._spikes[channel] = 0
        self._tracks[channel, : len(track)] = track
        self._lengths[channel] = len(track)


@lru_cache(maxsize=64)
def _one_band(n_frames: int) -> ByteArray:
    """Return bands for as many integers as a spline over so many frames can have: all in band 0."""
    return np.zeros(n_frames + 3, dtype=np.uint8)


def _transformed(
    goal: FloatArray, weights: FloatArray, mode: int, step: float, bit_cost: float
) -> tuple[FloatArray, float, ByteArray, float]:
    """Return a transform's coefficients in steps, what a squared error of one costs, their bands.

    Every frame gets the mean of the weights. The last is what a bit costs, as it was given.
    """
    weight = float(weights.sum()) / len(weights) * step * step
    return forward(mode, goal) / step, weight, track_bands(mode, len(goal)), bit_cost


@jit
def _encode_transform(
    sizes: FloatArray, weight: float, bands: ByteArray, bit_cost: float
) -> tuple[IntArray, float]:
    """Return the track of a transform's coefficients, and what it costs.

    Parameters
    ----------
    sizes : (N,)
        The coefficients, in steps.
    weight : float
        What a squared error of one costs.
    bands : (N,)
    bit_cost : float
    """
    n = 1
    for k in range(len(sizes) - 1, -1, -1):
        if abs(sizes[k]) > LAST_COEFFICIENT:
            n = k + 1
            break
    factor = np.zeros((n, 4))
    factor[:, 0] = np.sqrt(weight)
    track, bits = beam_search(sizes[:n], factor, bands, bit_cost, BEAM_WIDTH)
    error, length = 0.0, 0
    for k in range(len(sizes)):
        miss = sizes[k]
        if k < n:
            miss -= track[k]
            if track[k] != 0:
                length = k + 1
        error += miss * miss
    return track[:length], weight * error + bit_cost * (bits + MODE_BITS)


@jit
def _transform_cost(sizes: FloatArray, weight: float, bands: ByteArray, bit_cost: float) -> float:
    """Return about what a transform costs: see `_encode_transform`.

    A coefficient is left out, at the cost of its square, or takes bits by its magnitude.
    """
    bits = 0.0
    for size in sizes:
        left_out = weight / bit_cost * size * size
        bits += min(left_out, COEFFICIENT_BITS + np.log2(1.0 + abs(size)))
    return bit_cost * (TRANSFORM_BITS + TRANSFORM_SCALE * bits)


@jit
def _find_curve(
    goal: FloatArray,
    weights: FloatArray,
    bands: ByteArray,
    steps: FloatArray,
    bit_cost: float,
    previous: int,
    splines_too: bool,
) -> tuple[int, float]:
    """Return the best of `STILL` and the splines, and what it costs.

    Splines are searched by descent: from the previous mode to the better of its neighbours, and so
    on; from two other starts where there is no previous mode.
    """
    costs = np.full(N_SPLINES, np.inf)  # of the splines tried so far
    best = STILL
    least = _curve_cost(goal, weights, bands, STILL, steps, bit_cost)
    if not splines_too or least <= LEAST_BITS * bit_cost:
        return best, least
    mode = FIRST_MODE if previous < 0 else min(previous, N_SPLINES - 1)
    n_starts = 2 if previous < 0 else 1
    for _ in range(n_starts):
        while True:
            lowest = mode
            for each in range(mode - 1, mode + 2):
                if each < 0 or each >= N_SPLINES:
                    continue
                if costs[each] == np.inf:
                    costs[each] = _curve_cost(goal, weights, bands, each, steps, bit_cost)
            for each in range(max(mode - 1, 0), min(mode + 2, N_SPLINES)):
                if costs[each] < costs[lowest]:
                    lowest = each
            if lowest == mode:
                break
            mode = lowest
        if costs[mode] < least:
            best, least = mode, costs[mode]
        mode = SAMPLES
    return best, least


@jit
def _curve_cost(
    goal: FloatArray,
    weights: FloatArray,
    bands: ByteArray,
    mode: int,
    steps: FloatArray,
    bit_cost: float,
) -> float:
    """Return what `STILL` or a spline costs, as a narrow beam finds it."""
    step, sample_step = steps[mode], steps[SAMPLES]
    return _fit_curve(
        goal, weights, bands, _KNOTS[mode], step, sample_step, bit_cost, NARROW_BEAM_WIDTH
    )[3]


@jit
def _code_curves(
    columns: FloatArray,
    factors: FloatArray,
    rows: IntArray,
    n_anew: int,
    modes: IntArray,
    is_due: BoolArray,
    splines_too: bool,
    transforms_too: bool,
    steps: FloatArray,
    bands: ByteArray,
    bit_cost: float,
    beam_width: int,
    goal: FloatArray,
    weights: FloatArray,
    errors: FloatArray,
    spikes: IntArray,
    tracks: IntArray,
    lengths: IntArray,
) -> tuple[int, float]:
    """Encode the first `n_anew` channels, the last of them first, as long as they are curves.

    Parameters
    ----------
    columns : (C, F), factors : (N, C, C), rows : (F,)
        See `quantise.feed_back_errors`.
    n_anew : int
    modes : (C,)
        Written where `is_due`.
    is_due : (C,)
        Whether a channel's mode is to be chosen.
    splines_too, transforms_too : bool
        Whether splines and transforms are allowed.
    steps : (C, MODES)
    bands : (N,) or more
    bit_cost : float
    beam_width : int
    goal, weights : (F,)
        Written: those of the channel at which this ends.
    errors : (F, C), spikes : (C, F), tracks : (C, N), lengths : (C,)
        Written, of the channels that are encoded.

    Returns
    -------
    int
        How many channels are left: 0, or the last of them is a transform, or may become one.
    float
        What that one costs as a curve.
    """
    for channel in range(n_anew - 1, -1, -1):
        feed_back_errors(columns, factors, rows, errors, channel, goal, weights)
        own = steps[channel]
        if is_due[channel]:
            mode, cost = _find_curve(
                goal, weights, bands, own, bit_cost, modes[channel], splines_too
            )
            modes[channel] = mode
            if transforms_too:
                return channel + 1, cost
        mode = modes[channel]
        if mode > STILL:
            return channel + 1, np.inf
        track, own_spikes, samples, _ = _fit_curve(
            goal, weights, bands, _KNOTS[mode], own[mode], own[SAMPLES], bit_cost, beam_width
        )
        for t in range(len(goal)):
            errors[t, channel] = columns[channel, t] - samples[t]
            spikes[channel, t] = own_spikes[t]
        for k in range(len(track)):
            tracks[channel, k] = track[k]
        lengths[channel] = len(track)
    return 0, 0.0


@jit
def _fit_curve(
    goal: FloatArray,
    weights: FloatArray,
    bands: ByteArray,
    spacing: int,
    step: float,
    sample_step: float,
    bit_cost: float,
    beam_width: int,
) -> tuple[IntArray, IntArray, FloatArray, float]:
    """Return the cheaper of a curve through all frames and one without the frames of spikes.

    Parameters
    ----------
    goal, weights : (F,)
    bands : (N,) or more
        The band of every integer (see `entropy`).
    spacing : int
        Frames between knots; 0 for one value for all frames.
    step, sample_step : float
        What an integer of the curve stands for, and one of a spike.
    bit_cost : float
        What a bit costs, in weighted squared error.
    beam_width : int
        How many paths the search for integers keeps.

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
    track, samples, cost = _plain_curve(goal, lighter, bands, spacing, step, bit_cost, beam_width)
    n_spikes = 0
    if spacing != 1 and n_frames > 1:
        for t in range(n_frames):
            if is_spike(goal, samples, weights, t, bit_cost):
                lighter[t] *= SPIKE_WEIGHT
                n_spikes += 1
    if n_spikes == 0:
        return track, spikes, samples, cost
    other, passed, other_cost = _plain_curve(
        goal, lighter, bands, spacing, step, bit_cost, beam_width
    )
    other_cost += bit_cost * SPIKE_BITS * n_spikes
    for t in range(n_frames):
        if lighter[t] != weights[t]:
            miss = goal[t] - passed[t]
            amount = min(max(np.rint(miss / sample_step), 1 - VALUE_LIMIT), VALUE_LIMIT - 1)
            spikes[t] = int(amount)
            passed[t] += amount * sample_step
            other_cost += weights[t] * (goal[t] - passed[t]) ** 2 - lighter[t] * miss**2
    if other_cost < cost:
        return other, spikes, passed, other_cost
    spikes[:] = 0
    return track, spikes, samples, cost


@jit
def _plain_curve(
    goal: FloatArray,
    weights: FloatArray,
    bands: ByteArray,
    spacing: int,
    step: float,
    bit_cost: float,
    beam_width: int,
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
    track, bits = beam_search(best, factor, bands, bit_cost, beam_width)
    for k in range(n):
        best[k] = track[k] * step
    if spacing > 0:
        spline.evaluate(best, spacing, 0, samples)
    else:
        samples[:] = best[0]
    error = 0.0
    for t in range(n_frames):
        error += weights[t] * (goal[t] - samples[t]) ** 2
    return track, samples, error + bit_cost * (bits + MODE_BITS)
