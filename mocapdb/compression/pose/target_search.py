"""The search for the coarsest quantisation whose error is still within a target.

The step of a block is ``2 ** (qp / 64)`` skeleton units; ``qp`` is its quantisation parameter. A
mean is held by one step for the whole clip, a maximum by a step for every block.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.compression import tuning
from mocapdb.compression.pose.block_encoder import BlockEncoder
from mocapdb.compression.pose.blocks import Block, CodedClip, write_block
from mocapdb.compression.pose.class_basis import Basis
from mocapdb.compression.pose.modes import QP_PER_OCTAVE, SAMPLES, STILL
from mocapdb.compression.pose.skin_metric import error_points, metric_factors, point_distances
from mocapdb.compression.pose.smooth_channels import SmoothChannels
from mocapdb.compression.targets import Target
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose, forward_kinematics
from mocapdb.motion.skin import pose_error

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
    """

    ratio: float
    n_values: float
    distances: FloatArray


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
    """

    def __init__(
        self,
        clip: Clip,
        target: Target,
        modes: tuple[int, ...],
        *,
        basis: Basis | None = None,
        feedback: bool = True,
    ) -> None:
        self.smooth = SmoothChannels(clip, None if basis is None else basis.orders)
        self.target = target
        self.modes = modes
        self.basis = basis
        self.feedback = feedback
        self.fps = clip.fps
        self.points = error_points(self.smooth.skeleton, target.points)
        self.qp = self._first_qp()
        self._last_modes: IntArray | None = None
        self._kept_encoders: list[tuple[BlockEncoder, Pose]] | None = None
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
        best: list[Block] | None = None
        for round_ in range(tuning.MEAN_MOST_ROUNDS):
            is_enough = best is not None and round_ >= tuning.MEAN_ROUNDS
            if not abs(qp) < _QP_LIMIT or is_enough:
                break
            is_stuck = best is None and round_ > tuning.LEVELLING_ROUNDS
            blocks, error = self._encode_all(qp, forget_modes=is_stuck)
            ratio = error / self.target.value
            if ratio > _HELD:
                broke = min(broke, qp)
            elif qp > held:
                held, best = qp, blocks
                if ratio > tuning.MEAN_CLOSE:
                    break
            near = abs(math.log(max(ratio, 1e-9))) < tuning.TRIM_WITHIN
            if near and self._kept_encoders is not None:
                trimmed = self._trim(qp, ratio)
                if trimmed:
                    return trimmed
            if held + 1 >= broke:
                break
            qp = _next_qp(qp, ratio, held, broke)
        return best

    def _trim(self, qp: int, ratio: float) -> list[Block] | None:
        """Return blocks that come nearer to the target than the ones encoded last.

        Only the first channels are encoded anew, which are the last in the order of coding, with
        bits a little cheaper or dearer: a small change of error for little time.
        """
        n_anew = -(-self.smooth.skeleton.n_channels // tuning.TRIM_SHARE)
        best, highest = None, 0.0
        octaves = 0.0
        for _ in range(tuning.TRIM_ROUNDS):
            octaves += math.log2(tuning.TRIM_AIM / ratio) / tuning.TRIM_GAIN
            if abs(octaves) > tuning.TRIM_MOST:
                break
            blocks, error = self._encode_all(qp, explore=False, price=2.0**octaves, n_anew=n_anew)
            ratio = error / self.target.value
            if highest < ratio <= _HELD:
                best, highest = blocks, ratio
                if highest > tuning.MEAN_CLOSE:
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
    ) -> tuple[list[Block], float]:
        """Return the blocks for a step, and the mean that the target bounds.

        With `forget_modes` their modes are searched for as if nothing was known.
        """
        blocks = []
        total = 0.0
        for encoder, pose in self._encoders():
            if forget_modes:
                encoder.previous_modes = None
            block = encoder.encode(qp, explore=explore, price=price, n_anew=n_anew)
            total += block.n_frames * self._error(pose, self._decoded(block))
            blocks.append(block)
        return blocks, total / len(self.smooth)

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

        Points and frames get an emphasis, which multiplies their weights. At first, and until the
        target is held, it is levelled: those with large errors get more against those with small
        ones, until all come about as near to the maximum. From then on only what breaks the target
        gets more; where nothing does, the step grows again.
        """
        from scipy.ndimage import maximum_filter1d

        values = self.smooth.values(frames)
        pose = forward_kinematics(self.smooth.skeleton, values)
        encoder = self._encoder(frames, pose)
        emphasis = np.ones((len(values), len(self.points.joints)))
        window = 1 + 2 * round(0.5 * tuning.EMPHASIS_WINDOW_S * self.fps)
        qp = self.qp
        best, best_size = None, 0
        least, least_qp = np.inf, qp
        explore = True
        for round_ in range(tuning.MAXIMUM_ROUNDS):
            is_levelling = best is None or round_ < tuning.LEVELLING_ROUNDS
            if best is None and round_ > tuning.LEVELLING_ROUNDS:
                encoder.previous_modes = None  # no step is fine enough for knots too far apart
            block = encoder.encode(qp, explore=explore or is_levelling)
            decoded = self._decoded(block)
            ratio = self._error(pose, decoded) / self.target.value
            if ratio < least:
                least, least_qp = ratio, qp
            is_due = (round_ + 1) % tuning.ROUNDS_PER_EXPLORATION == 0
            explore = ratio < tuning.EXPLORE_BELOW or is_due
            if ratio <= _HELD:
                size = len(write_block(block, block.profile))
                if best is None or size < best_size:
                    best, best_size = block, size
            if abs(qp) >= _QP_LIMIT:
                break
            change = max(_octaves_to(1.0, ratio, tuning.STEP_EXPONENT), -QP_PER_OCTAVE)
            near = maximum_filter1d(point_distances(self.points, pose, decoded), window, axis=0)
            near /= max(float(near.max()), 1e-300)
            if is_levelling:
                qp += change
                emphasis *= np.maximum(near, tuning.LEAST_EMPHASIS)
                emphasis = np.maximum(emphasis / emphasis.mean(), 1.0 / tuning.MOST_EMPHASIS)
            elif ratio <= _HELD:
                qp += max(change, tuning.LEAST_STEP_CHANGE)
            else:
                near *= ratio
                growth = np.minimum(tuning.EMPHASIS_OVERSHOOT * near, tuning.EMPHASIS_MOST_RATIO)
                emphasis *= np.where(near > 1.0, growth**tuning.EMPHASIS_POWER, 1.0)
                emphasis = np.minimum(emphasis, tuning.MOST_EMPHASIS)
                if ratio > tuning.FINER_ABOVE:
                    qp += change // 2
            qp = int(np.clip(qp, -_QP_LIMIT, _QP_LIMIT))
            encoder.set_metric(*self._metric(values, pose, emphasis))
        return best or self._refine_until_held(encoder, pose, least_qp)

    def _refine_until_held(self, encoder: BlockEncoder, pose: Pose, qp: int) -> Block | None:
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
            if self._error(pose, self._decoded(block)) <= _HELD * self.target.value:
                return block
        return None

    # -- blocks ------------------------------------------------------------------------------------

    def _encoders(self) -> Iterator[tuple[BlockEncoder, Pose]]:
        """Yield encoder and pose of every block; those of a short clip are kept for next time."""
        if self._kept_encoders is not None:
            yield from self._kept_encoders
            return
        made = []
        for frames in self.ranges:
            pose = forward_kinematics(self.smooth.skeleton, self.smooth.values(frames))
            encoder = self._encoder(frames, pose)
            if len(self.ranges) * encoder.factors.nbytes <= tuning.METRIC_BYTES:
                made.append((encoder, pose))
            yield encoder, pose
            self._last_modes = encoder.previous_modes
        if len(made) == len(self.ranges):
            self._kept_encoders = made

    def _encoder(self, frames: slice, pose: Pose | None = None) -> BlockEncoder:
        values = self.smooth.values(frames)
        pose = pose or forward_kinematics(self.smooth.skeleton, values)
        factors, rows = self._metric(values, pose)
        if self.basis is not None:
            values = self.basis.coordinates(values)
        return BlockEncoder(values, factors, rows, self.modes, self._last_modes)

    def _metric(
        self, values: FloatArray, pose: Pose, emphasis: FloatArray | None = None
    ) -> tuple[FloatArray, IntArray]:
        """Return the metric's factors R of some frames, of as many as there is memory for.

        With the rows: which of them is that of each frame (see `_stretches`).
        """
        most = tuning.METRIC_BYTES // (8 * max(values.shape[1], 1) ** 2)
        # an emphasis is of single frames
        most_frames = 1 if self.target.is_maximum else tuning.METRIC_MOST_FRAMES
        starts = _stretches(pose, most_frames, most)
        ends = np.append(starts[1:], len(values))
        some = (starts + ends) // 2
        factors = metric_factors(
            self.smooth.skeleton,
            values[some],
            Pose(pose.positions[some], pose.rotations[some]),
            self.points,
            None if emphasis is None else np.maximum.reduceat(emphasis, starts, axis=0),
        )
        if self.basis is not None:
            factors = self.basis.transform_metric(factors)
        if not self.feedback:  # each channel as if the others were exact
            lengths = np.sqrt((factors**2).sum(axis=1))
            factors = lengths[:, :, None] * np.eye(values.shape[1])
        return factors, np.repeat(np.arange(len(starts)), ends - starts)

    def _decoded(self, block: Block) -> Pose:
        values = block.values()
        if self.basis is not None:
            values = self.basis.expand(values)
        return forward_kinematics(self.smooth.skeleton, values)

    def _error(self, pose: Pose, decoded: Pose) -> float:
        """Return the figure that the target bounds."""
        points = self.target.points
        return self.target.measure(pose_error(self.smooth.skeleton, pose, decoded, points=points))

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
        length = min(n_frames, tuning.PROBE_FRAMES)
        n_probes = 1 if n_frames <= 2 * length else tuning.PROBES
        modes = tuple(mode for mode in self.modes if mode < STILL) or self.modes
        ratio, n_values, distances = 0.0, 0.0, np.zeros(len(self.points.joints))
        for i in range(n_probes):
            first = (2 * i + 1) * (n_frames - length) // (2 * n_probes)
            frames = slice(first, first + length)
            pose = forward_kinematics(self.smooth.skeleton, self.smooth.values(frames))
            encoder = self._encoder(frames, pose)
            encoder.allowed_modes = modes
            block = encoder.encode(self.qp)
            self._last_modes = block.modes
            decoded = self._decoded(block)
            ratio += self._error(pose, decoded) / self.target.value / n_probes
            distances += point_distances(self.points, pose, decoded).mean(axis=0)
            # a curve has some integers more than knots, which do not grow with the block
            n_knots = block.lengths - (block.modes != SAMPLES)
            n_values += float(n_knots.sum()) / length / n_probes
        return _Probe(ratio, n_values, distances)

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


def _stretches(pose: Pose, most_frames: int, most: int) -> IntArray:
    """Return the first frames of stretches in which the body moves little: one metric will do.

    Parameters
    ----------
    pose : Pose
    most_frames : int
        Of a stretch.
    most : int
        How many stretches there is memory for.
    """
    n_frames = len(pose.rotations)
    moved = np.abs(np.diff(pose.rotations, axis=0)).max(axis=(1, 2, 3), initial=0.0)
    way = np.concatenate([[0.0], np.cumsum(moved)]) / tuning.METRIC_TURN
    number = way.astype(np.int64) + np.arange(n_frames) // most_frames
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    return starts[:: -(-len(starts) // max(most, 1))]


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
