"""The search for the coarsest quantisation whose error is still within a target.

The step of a block is ``2 ** (qp / 64)`` skeleton units; ``qp`` is its quantisation parameter. A
mean is held by one step for the whole clip, a maximum by a step for every block. What else a target
promises, of the joints' own motion and of the largest distance beside a mean, is held by more
weight in the metric on what breaks it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.compression import tuning
from mocapdb.compression.pose.block_encoder import BlockEncoder
from mocapdb.compression.pose.block_metric import BlockMetric
from mocapdb.compression.pose.blocks import Block, CodedClip, write_block
from mocapdb.compression.pose.class_basis import Basis
from mocapdb.compression.pose.modes import QP_PER_OCTAVE, SAMPLES, STILL
from mocapdb.compression.pose.own_motion import OwnErrors, OwnMotion, OwnWeights, Posed
from mocapdb.compression.pose.skin_metric import error_points, point_distances
from mocapdb.compression.pose.smooth_channels import SmoothChannels
from mocapdb.compression.targets import Target
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_errors import JointMotion, joint_motion
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skin import (
    VERTICES_PER_BONE,
    MotionError,
    error_of_squares,
    squared_distances,
)

__all__ = ["TargetSearch"]

_HELD = 1.0 - 1e-9  # what `decode` gives differs in the last digits
_QP_LIMIT = 7500  # the format holds +-8192
_FIRST_QP_LIMIT = 7000
_UNBOUNDED = 1 << 30


@dataclass(frozen=True)
class _Probe:
    """What a few stretches of a clip became at the first step.

    Attributes
    ----------
    ratio : float
        Their error, over the target.
    n_values : float
        How many integers a frame needs.
    distances : (P,)
        How far the points were off, in the mean.
    own : list of OwnErrors
        What the joints lost of their own motion.
    """

    ratio: float
    n_values: float
    distances: FloatArray
    own: list[OwnErrors]


@dataclass(frozen=True)
class _CodedMean:
    """The blocks of a clip at one step, and what they lose.

    Attributes
    ----------
    blocks : list of Block
    error : float
        The mean that the target bounds.
    own : OwnErrors, optional
        What the joints lose of their own motion, if that is bounded.
    near : dict of int to (F, P)
        Of the blocks, by their first frame, that exceed the bound for single points: how near each
        point comes to it.
    """

    blocks: list[Block]
    error: float
    own: OwnErrors | None
    near: dict[int, FloatArray]

    @property
    def peaks_hold(self) -> bool:
        """Whether all that is bounded besides the mean is within its bounds."""
        return not self.near and (self.own is None or self.own.highest <= 1.0)


@dataclass(frozen=True)
class _CodedBlock:
    """A block, and what it loses.

    Attributes
    ----------
    block : Block
    squares : (F, P)
        How far each of the points is off that the target names, squared.
    ratio : float
        Its error, over the target.
    own : OwnErrors, optional
        What the joints lose of their own motion, if that is bounded: each end of a swing counts
        for both, since the rest of the clip is not known.
    """

    block: Block
    squares: FloatArray
    ratio: float
    own: OwnErrors | None

    @property
    def joints_hold(self) -> bool:
        """Whether the joints keep their own motion."""
        return self.own is None or self.own.highest <= 1.0

    @property
    def holds(self) -> bool:
        """Whether all bounds hold."""
        return self.ratio <= _HELD and self.joints_hold


class TargetSearch:
    """The blocks of a clip, and the search for the step that holds a target.

    Parameters
    ----------
    clip : Clip
    target : Target
    modes : tuple of int
        Those allowed for channels that move.
    basis : Basis, optional
        The directions that are coded, in place of the channels.
    feedback : bool
        Whether each channel makes up for the errors of those coded before it.
    motion : JointMotion, optional
        The joints' own motion, where it is known.
    """

    def __init__(
        self,
        clip: Clip,
        target: Target,
        modes: tuple[int, ...],
        *,
        basis: Basis | None = None,
        feedback: bool = True,
        motion: JointMotion | None = None,
    ) -> None:
        self.smooth = SmoothChannels(clip, None if basis is None else basis.orders)
        self.target = target
        self.modes = modes
        self.basis = basis
        self.feedback = feedback
        self.fps = clip.fps
        self.points = error_points(self.smooth.skeleton, target.points)
        self.own_motion: OwnMotion | None = None
        self.own_weights: OwnWeights | None = None
        if target.share:
            motion = motion or joint_motion(clip.skeleton, clip.channels)
            self.own_motion = OwnMotion(target, self.smooth.skeleton, motion, clip.fps)
            self.own_weights = self.own_motion.no_weights()
        self.emphases: dict[int, FloatArray] = {}  # of blocks, by their first frame
        self.qp = self._first_qp()
        self._last_modes: IntArray | None = None
        self._usual_emphasis: FloatArray | None = None  # (P,), of the block before
        self._kept_encoders: list[tuple[BlockEncoder, Posed]] | None = None
        # of blocks whose metric has changed, by their first frame: the channels that it concerns
        self._outdated: dict[int, BoolArray] = {}
        self.block_frames = self._plan_blocks()
        self.ranges = [
            slice(first, min(first + self.block_frames, len(clip)))
            for first in range(0, len(clip), self.block_frames)
        ]

    def run(self, *, basis_is_shared: bool = False) -> CodedClip | None:
        """Return the shortest integers found that hold the target, or None where none do."""
        blocks = self._hold_maximum() if self.target.is_maximum else self._hold_mean()
        return None if blocks is None else self._coded(blocks, basis_is_shared)

    def encode_at(self, qp: int) -> CodedClip:
        """Return the integers for a step, whatever the error."""
        return self._coded([encoder.encode(qp) for encoder, _ in self._encoders()])

    def _coded(self, blocks: list[Block], basis_is_shared: bool = False) -> CodedClip:
        return CodedClip(
            self.smooth.skeleton, self.block_frames, tuple(blocks), self.basis, basis_is_shared
        )

    # -- a mean ------------------------------------------------------------------------------------

    def _hold_mean(self) -> list[Block] | None:
        """Return blocks of one step, about as large as holds the target over the clip."""
        self._estimate_step_and_weights()
        qp, held, broke = self.qp, -_UNBOUNDED, _UNBOUNDED
        least = math.inf  # of the ratios so far
        best: list[Block] | None = None
        for round_ in range(tuning.MEAN_MOST_ROUNDS):
            is_enough = best is not None and round_ >= tuning.MEAN_ROUNDS
            if not abs(qp) < _QP_LIMIT or is_enough:
                break
            is_stuck = least > _HELD and round_ > tuning.LEVELLING_ROUNDS
            is_stuck |= best is None and round_ >= tuning.MEAN_ROUNDS
            coded = self._encode_all(qp, forget_modes=is_stuck)
            ratio = coded.error / self.target.value
            least = min(least, ratio)
            if ratio > _HELD:
                broke = min(broke, qp)
            elif coded.peaks_hold and qp > held:
                held, best = qp, coded.blocks
                if ratio > self._close:
                    break
            near = abs(math.log(max(ratio, 1e-9))) < tuning.TRIM_WITHIN
            if near and coded.peaks_hold and self._kept_encoders is not None:
                trimmed = self._trim(qp, ratio)
                if trimmed:
                    return trimmed
            if coded.peaks_hold and held + 1 >= broke:
                break
            self._weigh_peaks(coded, qp)
            following = _next_qp(qp, ratio, held, broke)
            if best is None and not coded.peaks_hold and round_ >= tuning.MEAN_ROUNDS:
                following = min(following, qp - tuning.REFINEMENT)  # weights alone do not do it
            qp = following
        return best

    @property
    def _close(self) -> float:
        """The share of the target from which on a mean is near enough to it."""
        weighed = self.own_weights is not None and self.own_weights.are_any
        return tuning.OWN_CLOSE if weighed else tuning.MEAN_CLOSE

    def _trim(self, qp: int, ratio: float) -> list[Block] | None:
        """Return blocks that come nearer to the target than the ones encoded last.

        Only the first channels are encoded anew, which are the last in the order of coding, with
        bits a little cheaper or dearer: a small change of error for little time.
        """
        n_anew = -(-self.smooth.skeleton.n_channels // tuning.TRIM_SHARE)
        aim = min(0.5 * (1.0 + self._close), tuning.TRIM_AIM)
        best, highest = None, 0.0
        octaves = 0.0
        for _ in range(tuning.TRIM_ROUNDS):
            octaves += math.log2(aim / ratio) / tuning.TRIM_GAIN
            if abs(octaves) > tuning.TRIM_MOST:
                break
            coded = self._encode_all(qp, explore=False, price=2.0**octaves, n_anew=n_anew)
            ratio = coded.error / self.target.value
            if highest < ratio <= _HELD and coded.peaks_hold:
                best, highest = coded.blocks, ratio
                if highest > self._close:
                    break
        return best

    def _estimate_step_and_weights(self) -> None:
        """Find from a few blocks where to begin, and how much each point should weigh.

        The metric adds squares, but a mean of distances is least where each point weighs the
        inverse of its own distance (as in iteratively reweighted least squares).
        """
        ratio, distances = self._probed.ratio, self._probed.distances
        aim = tuning.MEAN_AIM
        if self.target.kind != "skinned":
            aim /= tuning.MEAN_AFTER_WEIGHTS
        change = _octaves_to(aim, ratio, tuning.MEAN_EXPONENT)
        self.qp = int(np.clip(self.qp + change, 1 - _QP_LIMIT, _QP_LIMIT - 1))
        if self._probed.own:
            errors = OwnErrors.over(self._probed.own).times(_step(change))
            self._weigh_own_motion(errors, self.qp)
        measured = self.points.is_measured
        mean = float(distances[measured].mean())
        if self.target.kind != "skinned" and mean > 0.0:  # that kind adds squares over the points
            weights = self.points.weights.copy()
            weights[measured] *= mean / np.maximum(
                distances[measured], tuning.LEAST_DISTANCE * mean
            )
            self.points = replace(self.points, weights=weights)

    def _encode_all(
        self,
        qp: int,
        *,
        forget_modes: bool = False,
        explore: bool = True,
        price: float = 1.0,
        n_anew: int | None = None,
    ) -> _CodedMean:
        """Return the blocks for a step, and what they lose.

        With `forget_modes` their modes are searched for as if nothing was known. Where joints'
        weights change from round to round, modes are chosen anew only where that or the step asks
        for it; else in every round, of which there are few.
        """
        blocks: list[Block] = []
        own: list[OwnErrors] = []
        near: dict[int, FloatArray] = {}
        total = 0.0
        for frames, (encoder, source) in zip(self.ranges, self._encoders(), strict=True):
            if forget_modes:
                encoder.previous_modes = None
            if self.own_motion is None:
                encoder.seek_modes()
            block = encoder.encode(qp, explore=explore, price=price, n_anew=n_anew)
            decoded = self._decoded(block)
            squares = self._squares(source, decoded)
            error = self._error(squares)
            total += block.n_frames * self.target.measure(error)
            excess = error.vertices.max / self.target.largest_mm
            if excess > _HELD:
                near[frames.start] = excess * self._nearness(squares)
            if self.own_motion is not None:
                costs = None if self.basis is not None else encoder.costs
                own.append(self.own_motion.measure(frames.start, source, decoded, costs))
            blocks.append(block)
        together = OwnErrors.over(own) if own else None
        return _CodedMean(blocks, total / len(self.smooth), together, near)

    def _weigh_peaks(self, coded: _CodedMean, qp: int) -> None:
        """Let points and joints that break a bound weigh more from now on."""
        for first, near in coded.near.items():
            self.emphases[first] = _raised(self.emphases.get(first, 1.0), near)
            self._outdated[first] = np.ones(self.smooth.skeleton.n_channels, dtype=np.bool_)
        if coded.own is not None and coded.own.highest > 1.0:
            columns = self._weigh_own_motion(coded.own, qp)
            for frames in self.ranges:
                known = self._outdated.get(frames.start, np.zeros_like(columns))
                self._outdated[frames.start] = known | columns

    def _weigh_own_motion(self, errors: OwnErrors, qp: int) -> BoolArray:
        """Let joints that break a bound weigh more; return the channels that this concerns."""
        assert self.own_motion is not None and self.own_weights is not None
        before = self.own_weights
        self.own_weights = self.own_motion.raised(before, errors, _step(qp))
        return self._channels_between(before, self.own_weights)

    def _channels_between(self, before: OwnWeights, now: OwnWeights) -> BoolArray:
        """Return the channels (C,) that a change of weights concerns: with a basis all."""
        assert self.own_motion is not None
        joints = self.own_motion.changed(before, now)
        if self.basis is not None:
            joints[:] = joints.any()
        return np.repeat(joints, np.diff(self.smooth.skeleton.channel_starts))

    # -- a maximum ---------------------------------------------------------------------------------

    def _hold_maximum(self) -> list[Block] | None:
        """Return blocks each of which holds the target, with a step and emphasis of its own."""
        blocks = []
        for frames in self.ranges:
            block = self._hold_maximum_in(frames)
            if block is None:
                return None
            blocks.append(block)
        return blocks

    def _hold_maximum_in(self, frames: slice) -> Block | None:
        """Return a block that holds a maximum.

        Points and frames get an emphasis, which multiplies their weights. In the first rounds it is
        levelled: those with large errors get more against those with small ones, until all come
        about as near to the maximum; the step stays near its first guess, since one point that
        breaks the target by far says little of it. From then on only what breaks the target gets
        more; where nothing does, the step grows. The next block begins where this one ends.
        """
        source = self._source(frames)
        emphasis = np.ones((len(source.values), len(self.points.joints)))
        n_rounds, n_levelling = tuning.MAXIMUM_ROUNDS, tuning.LEVELLING_ROUNDS
        if self._usual_emphasis is not None:
            emphasis *= self._usual_emphasis
            n_rounds, n_levelling = n_rounds - 1, n_levelling - 1
        encoder = self._encoder(frames, source, emphasis)
        own_weights, qp = self.own_weights, self.qp
        best, best_size = None, 0
        least, least_qp = np.inf, qp
        for round_ in range(n_rounds):
            if best is None and round_ > tuning.LEVELLING_ROUNDS:
                encoder.previous_modes = None  # no step is fine enough for knots too far apart
            is_rough = round_ < n_levelling
            width = tuning.NARROW_BEAM_WIDTH if is_rough else tuning.BEAM_WIDTH
            block = encoder.encode(qp, beam_width=width)
            coded = self._measured(frames, source, encoder, block)
            if not is_rough:
                coded, emphasis = self._trim_maximum(
                    frames, source, encoder, coded, emphasis, own_weights
                )
            if coded.ratio < least:
                least, least_qp = coded.ratio, qp
            if coded.holds:
                size = len(write_block(coded.block, coded.block.profile))
                if best is None or size < best_size:
                    best, best_size = coded.block, size
            if abs(qp) >= _QP_LIMIT or round_ + 1 == n_rounds:
                break
            if coded.own is not None and self.own_motion is not None and own_weights is not None:
                before = own_weights
                own_weights = self.own_motion.raised(before, coded.own, _step(qp))
                encoder.seek_modes(self._channels_between(before, own_weights))
            if is_rough:
                qp += _octaves_to(1.0, coded.ratio, tuning.LEVELLING_EXPONENT)
                near = self._nearness(coded.squares)
                emphasis *= np.maximum(near, tuning.LEAST_EMPHASIS)
                emphasis = np.maximum(emphasis / emphasis.mean(), 1.0 / tuning.MOST_EMPHASIS)
            elif coded.ratio <= _HELD:
                change = _octaves_to(1.0, coded.ratio, tuning.STEP_EXPONENT)
                qp += max(change, tuning.LEAST_STEP_CHANGE)
            else:
                near = self._nearness(coded.squares)
                emphasis = _raised(emphasis, coded.ratio * near)
            qp = int(np.clip(qp, -_QP_LIMIT, _QP_LIMIT))
            self._weigh(encoder, frames, emphasis, own_weights)
            encoder.set_steps()
        if best is None:
            return self._refine_until_held(encoder, frames, source, least_qp)
        self.qp = best.qp - tuning.LEAST_STEP_CHANGE
        self._last_modes = best.modes
        self._usual_emphasis = np.exp(np.log(emphasis).mean(axis=0))
        return best

    def _trim_maximum(
        self,
        frames: slice,
        source: Posed,
        encoder: BlockEncoder,
        coded: _CodedBlock,
        emphasis: FloatArray,
        own_weights: OwnWeights | None,
    ) -> tuple[_CodedBlock, FloatArray]:
        """Return a block that breaks the maximum by less, where it hardly does, and its emphasis.

        As in `_trim` only the first channels are encoded anew, with more weight on what breaks it.
        """
        n_anew = -(-self.smooth.skeleton.n_channels // tuning.TRIM_SHARE)
        for _ in range(tuning.TRIM_MAXIMUM_ROUNDS):
            if not (coded.joints_hold and _HELD < coded.ratio < tuning.TRIM_MAXIMUM_WITHIN):
                break
            near = self._nearness(coded.squares)
            emphasis = _raised(emphasis, coded.ratio * near)
            self._weigh(encoder, frames, emphasis, own_weights)
            block = encoder.encode(coded.block.qp, explore=False, n_anew=n_anew)
            coded = self._measured(frames, source, encoder, block)
        return coded, emphasis

    def _refine_until_held(
        self, encoder: BlockEncoder, frames: slice, source: Posed, qp: int
    ) -> Block | None:
        """Return a block that holds a maximum by finer and finer steps, at last frame by frame."""
        for i in range(tuning.REFINEMENT_ROUNDS):
            qp -= tuning.REFINEMENT
            if qp <= -_QP_LIMIT:
                break
            frame_by_frame = i >= tuning.REFINEMENT_CURVE_ROUNDS
            encoder.previous_modes = (
                np.full_like(encoder.profile, SAMPLES) if frame_by_frame else None
            )
            block = encoder.encode(qp, explore=not frame_by_frame)
            if self._measured(frames, source, encoder, block).holds:
                return block
        return None

    def _measured(
        self, frames: slice, source: Posed, encoder: BlockEncoder, block: Block
    ) -> _CodedBlock:
        decoded = self._decoded(block)
        squares = self._squares(source, decoded)
        ratio = self.target.measure(self._error(squares)) / self.target.value
        own = None
        if self.own_motion is not None:
            costs = None if self.basis is not None else encoder.costs
            own = self.own_motion.measure(frames.start, source, decoded, costs).alone
        return _CodedBlock(block, squares, ratio, own)

    # -- blocks ------------------------------------------------------------------------------------

    def _encoders(self) -> Iterator[tuple[BlockEncoder, Posed]]:
        """Yield encoder and frames of every block; those of a short clip are kept for next time."""
        if self._kept_encoders is not None:
            for frames, (encoder, source) in zip(self.ranges, self._kept_encoders, strict=True):
                columns = self._outdated.get(frames.start)
                if columns is not None:
                    self._weigh(encoder, frames, self.emphases.get(frames.start), self.own_weights)
                    encoder.set_steps()
                    encoder.seek_modes(columns)
                yield encoder, source
            self._outdated.clear()
            return
        made = []
        for frames in self.ranges:
            source = self._source(frames)
            encoder = self._encoder(frames, source, self.emphases.get(frames.start))
            if len(self.ranges) * encoder.metric.factors.nbytes <= tuning.METRIC_BYTES:
                made.append((encoder, source))
            yield encoder, source
            self._last_modes = encoder.previous_modes
        self._outdated.clear()
        if len(made) == len(self.ranges):
            self._kept_encoders = made

    def _encoder(
        self, frames: slice, source: Posed, emphasis: FloatArray | None = None
    ) -> BlockEncoder:
        most_frames = tuning.METRIC_MOST_FRAMES
        if self.target.is_maximum:  # an emphasis differs from frame to frame
            most_frames = tuning.MAXIMUM_METRIC_FRAMES
        skeleton, basis = self.smooth.skeleton, self.basis
        metric = BlockMetric(skeleton, source, most_frames, basis, self.feedback)
        values = source.values if basis is None else basis.coordinates(source.values)
        encoder = BlockEncoder(values, metric, self.modes, self._last_modes)
        self._weigh(encoder, frames, emphasis, self.own_weights)
        encoder.set_steps()
        return encoder

    def _weigh(
        self,
        encoder: BlockEncoder,
        frames: slice,
        emphasis: FloatArray | None,
        own_weights: OwnWeights | None,
    ) -> None:
        """Let an encoder weigh errors anew."""
        own = None
        if self.own_motion is not None and own_weights is not None and own_weights.are_any:
            own = self.own_motion.rows(own_weights, frames)
        encoder.metric.update(self.points, emphasis, own)

    def _source(self, frames: slice) -> Posed:
        values = self.smooth.values(frames)
        return Posed(values, forward_kinematics(self.smooth.skeleton, values))

    def _decoded(self, block: Block) -> Posed:
        values = block.values()
        if self.basis is not None:
            values = self.basis.expand(values)
        return Posed(values, forward_kinematics(self.smooth.skeleton, values))

    def _squares(self, source: Posed, decoded: Posed) -> FloatArray:
        """Return how far each of the points is off that the target names, squared."""
        return squared_distances(
            self.smooth.skeleton, source.pose, decoded.pose, points=self.target.points
        )

    def _error(self, squares: FloatArray) -> MotionError:
        """Return what a block loses whose points are so far off."""
        return error_of_squares(squares, self.smooth.skeleton.metres_per_unit, with_p95=False)

    def _nearness(self, squares: FloatArray) -> FloatArray:
        """Return how near each point (F, P) comes to the largest error, within a few frames.

        Zero for points that no error is measured on.
        """
        reach = round(0.5 * tuning.EMPHASIS_WINDOW_S * self.fps)
        distances = _largest_within(np.sqrt(squares), reach)
        distances /= max(float(distances.max()), 1e-300)
        if self.target.points == "skin":  # in the order of `error_points`: a vertex of every bone
            by_bone = distances.reshape(len(distances), -1, VERTICES_PER_BONE)
            distances = by_bone.transpose(0, 2, 1).reshape(distances.shape)
        near = np.zeros((len(distances), len(self.points.joints)))
        near[:, self.points.is_measured] = distances
        return near

    def _first_qp(self) -> int:
        """Return a step that is likely to come near the target."""
        value = self.target.value
        if self.target.kind == "skinned":
            distance = value / np.sqrt(max(6 * len(self.smooth.skeleton.bone_joints), 1))
        else:
            distance = value / (1000.0 * self.smooth.skeleton.metres_per_unit)
        if self.target.is_maximum:
            distance *= tuning.MEAN_OF_MAXIMUM
        qp = QP_PER_OCTAVE * np.log2(tuning.STEP_OF_MEAN * distance)
        return int(np.clip(qp, -_FIRST_QP_LIMIT, _FIRST_QP_LIMIT))

    def _probe(self) -> _Probe:
        """Return what a few stretches of the clip become at the first step."""
        n_frames = len(self.smooth)
        most_frames = tuning.PROBE_FRAMES
        if self.target.is_maximum:
            most_frames = tuning.MAXIMUM_PROBE_FRAMES
        length = min(n_frames, most_frames)
        n_probes = 1 if n_frames <= 2 * length else tuning.PROBES
        modes = tuple(mode for mode in self.modes if mode < STILL) or self.modes
        ratio, n_values, distances = 0.0, 0.0, np.zeros(len(self.points.joints))
        own: list[OwnErrors] = []
        for i in range(n_probes):
            first = (2 * i + 1) * (n_frames - length) // (2 * n_probes)
            frames = slice(first, first + length)
            source = self._source(frames)
            encoder = self._encoder(frames, source)
            encoder.allowed_modes = modes
            block = encoder.encode(self.qp)
            self._last_modes = block.modes
            decoded = self._decoded(block)
            figure = self.target.measure(self._error(self._squares(source, decoded)))
            ratio += figure / self.target.value / n_probes
            distances += point_distances(self.points, source.pose, decoded.pose).mean(axis=0)
            if self.own_motion is not None:
                costs = None if self.basis is not None else encoder.costs
                own.append(self.own_motion.measure(first, source, decoded, costs))
            # a curve has some integers more than knots, which do not grow with the block
            n_knots = block.lengths - (block.modes != SAMPLES)
            n_values += float(n_knots.sum()) / length / n_probes
        return _Probe(ratio, n_values, distances, own)

    def _plan_blocks(self) -> int:
        """Return how many frames a block has, so that it has about `BLOCK_VALUES` integers."""
        n_frames = len(self.smooth)
        if n_frames <= tuning.ONE_BLOCK_FRAMES and self.target.is_maximum:
            return n_frames
        self._probed = self._probe()
        if n_frames <= tuning.ONE_BLOCK_FRAMES:
            return n_frames
        n_values = self._probed.n_values
        if self.target.is_maximum:  # emphasis will ask for more of them
            n_values *= tuning.INTEGERS_FOR_MAXIMUM
        wanted = np.clip(tuning.BLOCK_VALUES / max(n_values, 1e-9), *tuning.BLOCK_FRAMES_RANGE)
        n_blocks = max(1, round(n_frames / float(wanted)))
        return -(-n_frames // n_blocks)


def _step(qp: int) -> float:
    """Return a step in skeleton units."""
    return math.exp2(qp / QP_PER_OCTAVE)


def _raised(emphasis: FloatArray | float, near: FloatArray) -> FloatArray:
    """Return more emphasis for points that come to so many times the maximum, where above 1."""
    raised: FloatArray = np.broadcast_to(emphasis, near.shape).copy()
    beyond = near > 1.0
    growth = np.minimum(tuning.EMPHASIS_OVERSHOOT * near[beyond], tuning.EMPHASIS_MOST_RATIO)
    raised[beyond] *= growth**tuning.EMPHASIS_POWER
    np.minimum(raised, tuning.MOST_EMPHASIS, out=raised)
    return raised


def _largest_within(distances: FloatArray, reach: int) -> FloatArray:
    """Return the largest distance of each point (F, P) within so many frames either way."""
    largest: FloatArray = np.pad(distances, ((reach, reach), (0, 0)))
    length, whole = 1, 2 * reach + 1
    while length < whole:
        more = min(length, whole - length)
        largest = np.maximum(largest[:-more], largest[more:])
        length += more
    return largest


def _octaves_to(aim: float, ratio: float, exponent: float = 1.0) -> int:
    """Return by how much qp has to change for an error ratio to come to an aim."""
    return round(exponent * QP_PER_OCTAVE * math.log2(aim / max(ratio, tuning.LEAST_ERROR_RATIO)))


def _next_qp(qp: int, ratio: float, held: int, broke: int) -> int:
    """Return the qp to try next: where the error, about linear in the step, meets the target.

    A little less is aimed at, so that a good guess holds.
    """
    guess = qp + _octaves_to(tuning.MEAN_AIM, ratio, tuning.MEAN_EXPONENT)
    if held < guess < broke:
        return guess
    if held == -_UNBOUNDED:
        return broke - tuning.LEAST_STEP_CHANGE
    if broke == _UNBOUNDED:
        return held + tuning.LEAST_STEP_CHANGE
    return (held + broke + 1) // 2
