"""The search for the coarsest quantisation whose error is still within a target.

The step of a block is ``2 ** (qp / 64)`` skeleton units; ``qp`` is its quantisation parameter. A
mean is held by one step for the whole clip, a maximum by a step for every block.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.compression import tuning
from mocapdb.compression.pose.block_encoder import BlockEncoder
from mocapdb.compression.pose.blocks import Block, CodedClip, write_block
from mocapdb.compression.pose.class_basis import Basis
from mocapdb.compression.pose.modes import QP_PER_OCTAVE, SAMPLES
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
        self._kept_encoders: list[BlockEncoder] | None = None
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
        return self._coded([encoder.encode(qp) for encoder in self._encoders()])

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
            if held + 1 >= broke:
                break
            qp = _next_qp(qp, ratio, held, broke)
        return best

    def _estimate_step_and_weights(self) -> None:
        """Find from a few blocks where to begin, and how much each point should weigh.

        The metric adds squares, but a mean of distances is least where each point weighs the
        inverse of its own distance (as in iteratively reweighted least squares).
        """
        ratio, distances = 0.0, np.zeros(len(self.points.joints))
        n_probes = min(tuning.PROBE_BLOCKS, len(self.ranges))
        for i in range(n_probes):
            frames = self.ranges[(2 * i + 1) * len(self.ranges) // (2 * n_probes)]
            pose = forward_kinematics(self.smooth.skeleton, self.smooth.values(frames))
            decoded = self._decoded(self._encoder(frames, pose).encode(self.qp))
            ratio += self._error(pose, decoded) / self.target.value / n_probes
            distances += point_distances(self.points, pose, decoded).mean(axis=0)
        change = _octaves_to(tuning.MEAN_AIM, ratio)
        self.qp = int(np.clip(self.qp + change, 1 - _QP_LIMIT, _QP_LIMIT - 1))
        measured = self.points.is_measured
        mean = float(distances[measured].mean())
        if self.target.kind != "skinned" and mean > 0.0:  # that kind adds squares over the points
            weights = self.points.weights.copy()
            weights[measured] *= mean / np.maximum(
                distances[measured], tuning.LEAST_DISTANCE * mean
            )
            self.points = replace(self.points, weights=weights)

    def _encode_all(self, qp: int, *, forget_modes: bool) -> tuple[list[Block], float]:
        """Return the blocks for a step, and the mean that the target bounds.

        With `forget_modes` their modes are searched for as if nothing was known.
        """
        blocks = []
        total = 0.0
        for frames, encoder in zip(self.ranges, self._encoders(), strict=True):
            if forget_modes:
                encoder.previous_modes = None
            block = encoder.encode(qp)
            pose = forward_kinematics(self.smooth.skeleton, self.smooth.values(frames))
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

    def _encoders(self) -> Iterator[BlockEncoder]:
        """Yield the encoder of every block; those of a short clip are kept for the next time."""
        if self._kept_encoders is not None:
            yield from self._kept_encoders
            return
        made = []
        for frames in self.ranges:
            encoder = self._encoder(frames)
            if len(self.ranges) * encoder.factors.nbytes <= tuning.METRIC_BYTES:
                made.append(encoder)
            yield encoder
            self._last_modes = encoder.previous_modes
        if len(made) == len(self.ranges):
            self._kept_encoders = made

    def _encoder(self, frames: slice, pose: Pose | None = None) -> BlockEncoder:
        values = self.smooth.values(frames)
        pose = pose or forward_kinematics(self.smooth.skeleton, values)
        factors, stride = self._metric(values, pose)
        if self.basis is not None:
            values = self.basis.coordinates(values)
        return BlockEncoder(values, factors, stride, self.modes, self._last_modes)

    def _metric(
        self, values: FloatArray, pose: Pose, emphasis: FloatArray | None = None
    ) -> tuple[FloatArray, int]:
        """Return the metric's factors R of some frames, of as many as there is memory for.

        With the stride: R is that of every so many frames.
        """
        bytes_each = 8 * max(values.shape[1], 1) ** 2
        stride = -(-len(values) * bytes_each // tuning.METRIC_BYTES)
        some = slice(stride // 2 if len(values) > stride else None, None, stride)
        factors = metric_factors(
            self.smooth.skeleton,
            values[some],
            Pose(pose.positions[some], pose.rotations[some]),
            self.points,
            None if emphasis is None else emphasis[some],
        )
        if self.basis is not None:
            factors = self.basis.transform_metric(factors)
        if not self.feedback:  # each channel as if the others were exact
            lengths = np.sqrt((factors**2).sum(axis=1))
            factors = lengths[:, :, None] * np.eye(values.shape[1])
        missing = -(-len(values) // stride) - len(factors)
        if missing > 0:
            factors = np.concatenate([factors, np.repeat(factors[-1:], missing, axis=0)])
        return factors, stride

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

    def _plan_blocks(self) -> int:
        """Return how many frames a block has, so that it has about `BLOCK_VALUES` integers."""
        n_frames = len(self.smooth)
        if n_frames <= tuning.ONE_BLOCK_FRAMES:
            return n_frames
        probe = self._encoder(slice(0, min(n_frames, tuning.PROBE_FRAMES))).encode(self.qp)
        self._last_modes = probe.modes
        n_values = len(probe.integers) / probe.n_frames
        if self.target.is_maximum:  # emphasis will ask for more of them
            n_values *= tuning.INTEGERS_FOR_MAXIMUM
        wanted = np.clip(tuning.BLOCK_VALUES / max(n_values, 1e-9), *tuning.BLOCK_FRAMES_RANGE)
        n_blocks = max(1, round(n_frames / float(wanted)))
        return -(-n_frames // n_blocks)


def _octaves_to(aim: float, ratio: float, exponent: float = 1.0) -> int:
    """Return by how much qp has to change for an error ratio to come to an aim."""
    return round(exponent * QP_PER_OCTAVE * math.log2(aim / max(ratio, tuning.LEAST_ERROR_RATIO)))


def _next_qp(qp: int, ratio: float, held: int, broke: int) -> int:
    """Return the qp to try next: where the error, about linear in the step, meets the target.

    A little less is aimed at, so that a good guess holds.
    """
    guess = qp + round(QP_PER_OCTAVE * math.log2(tuning.MEAN_AIM / max(ratio, 1e-6)))
    if held < guess < broke:
        return guess
    if held == -_UNBOUNDED:
        return broke - tuning.LEAST_STEP_CHANGE
    if broke == _UNBOUNDED:
        return held + tuning.LEAST_STEP_CHANGE
    return (held + broke + 1) // 2
