"""Holding a target: the search for the largest step whose error is still within it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.compression.pose.block_encoder import BlockSearch
from mocapdb.compression.pose.blocks import Block, CodedClip, write_block
from mocapdb.compression.pose.class_basis import Basis
from mocapdb.compression.pose.modes import GAIN_STEPS, SAMPLES
from mocapdb.compression.pose.skin_metric import error_points, metric_roots, point_misses
from mocapdb.compression.pose.smooth_channels import State
from mocapdb.compression.targets import Target
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose, forward_kinematics
from mocapdb.motion.skin import pose_error

__all__ = ["Holding"]

_ROOTS_BYTES = 48 << 20  # of memory for the metric
_SHORT_FRAMES = 192  # of a clip that is one block
_PROBE_FRAMES = 256
_LEAST_FRAMES, _MOST_FRAMES = 64, 2048  # of a block
_STEP_OF_MEAN = 0.45  # the step that leaves a mean distance of 1, on most clips
_MEAN_OF_MAXIMUM = 0.15  # the mean distance where the maximum is 1, before any emphasis
_MORE_FOR_MAXIMUM = 1.6
_ALMOST = 1.0 - 1e-9  # what `decode` gives differs in the last digits
_GAIN_LIMIT = 7500
_FAR = 1 << 30
_CLOSE, _AIM = 0.995, 0.998  # of a mean: near enough, and what to aim at
_ROUNDS_OF_MEAN, _MAX_ROUNDS = 8, 40
_MOST_PROBES = 2  # blocks
_LEAST_MISS = 0.2  # of the usual: what a point counts as missing by, at the least
_ROUNDS_OF_MAXIMUM = 13
_INSISTING_ROUNDS, _CURVE_ROUNDS, _INSISTENCE = 40, 6, 24
_EVENING_ROUNDS = 3
_EXPLORE_EVERY = 3  # rounds
_CAUTION = 0.8
_LEAST_SHARE = 1e-3
_SLACK = 0.85  # of the target: so far from it, other modes may do
_EMPHASIS_WINDOW_S = 0.1
_LEAST_EMPHASIS = 0.3
_OVERSHOOT, _MENDING_POWER, _MOST_MENDING = 1.05, 4.0, 2.0
_MOST_EMPHASIS = 256.0
_FAR_OFF = 1.3  # of the target: more than mending can do
_GROWTH = 8  # of the gain at least, where nothing breaks the target


class Holding:
    """The blocks of a clip, and the search for the step that holds a target.

    Parameters
    ----------
    clip : Clip
    target : Target
    modes : tuple of int
        Those allowed for channels that move.
    block_values : int
        About how many integers a block has.
    basis : Basis, optional
        The directions that are coded, in place of the channels.
    feedback : bool
        Whether channels make up for what those before them missed.
    """

    def __init__(
        self,
        clip: Clip,
        target: Target,
        modes: tuple[int, ...],
        block_values: int,
        *,
        basis: Basis | None = None,
        feedback: bool = True,
    ) -> None:
        self.state = State(clip, None if basis is None else basis.orders)
        self.target = target
        self.modes = modes
        self.basis = basis
        self.feedback = feedback
        self.fps = clip.fps
        self.points = error_points(self.state.skeleton, target.points)
        self.gain = self._first_gain()
        self._likely: IntArray | None = None
        self._kept: list[BlockSearch] | None = None
        self.block_frames = self._plan_blocks(block_values)
        self.stretches = [
            slice(first, min(first + self.block_frames, len(clip)))
            for first in range(0, len(clip), self.block_frames)
        ]

    def hold(self, *, basis_is_shared: bool = False) -> CodedClip | None:
        """Return the shortest integers found that hold the target, or None where none do."""
        blocks = self._hold_maximum() if self.target.is_maximum else self._hold_mean()
        return None if blocks is None else self._coded(blocks, basis_is_shared)

    def encode_at(self, gain: int) -> CodedClip:
        """Return the integers for a step, whatever is lost."""
        return self._coded([search.encode(gain) for search in self._searches()])

    def _coded(self, blocks: list[Block], basis_is_shared: bool = False) -> CodedClip:
        return CodedClip(
            self.state.skeleton, self.block_frames, tuple(blocks), self.basis, basis_is_shared
        )

    def _searches(self) -> Iterator[BlockSearch]:
        """Yield the search of every block; those of a short clip are kept for the next time."""
        if self._kept is not None:
            yield from self._kept
            return
        made = []
        for stretch in self.stretches:
            search = self._search(stretch)
            if len(self.stretches) * search.roots.nbytes <= _ROOTS_BYTES:
                made.append(search)
            yield search
            self._likely = search.likely
        if len(made) == len(self.stretches):
            self._kept = made

    def _hold_mean(self) -> list[Block] | None:
        """Return blocks of one step, about as large as holds the target over the clip."""
        self._probe()
        gain, held, broke = self.gain, -_FAR, _FAR
        best: list[Block] | None = None
        for round_ in range(_MAX_ROUNDS):
            if not abs(gain) < _GAIN_LIMIT or (best is not None and round_ >= _ROUNDS_OF_MEAN):
                break
            stuck = best is None and round_ > _EVENING_ROUNDS
            blocks, lost = self._encode_all(gain, afresh=stuck)
            share = lost / self.target.value
            if share > _ALMOST:
                broke = min(broke, gain)
            elif gain > held:
                held, best = gain, blocks
                if share > _CLOSE:
                    break
            if held + 1 >= broke:
                break
            gain = _next_gain(gain, share, held, broke)
        return best

    def _probe(self) -> None:
        """Find from a few blocks where to begin, and how much each point should weigh.

        The metric adds squares, but a mean of distances is least where each point weighs the
        inverse of its own (as in iteratively reweighted least squares).
        """
        share, misses = 0.0, np.zeros(len(self.points.joints))
        n_probes = min(_MOST_PROBES, len(self.stretches))
        for i in range(n_probes):
            stretch = self.stretches[(2 * i + 1) * len(self.stretches) // (2 * n_probes)]
            pose = forward_kinematics(self.state.skeleton, self.state.values(stretch))
            decoded = self._decoded(self._search(stretch, pose).encode(self.gain))
            share += self._lost(pose, decoded) / self.target.value / n_probes
            misses += point_misses(self.points, pose, decoded).mean(axis=0)
        more = round(GAIN_STEPS * math.log2(_AIM / max(share, _LEAST_SHARE)))
        self.gain = int(np.clip(self.gain + more, 1 - _GAIN_LIMIT, _GAIN_LIMIT - 1))
        measured = self.points.is_measured
        usual = float(misses[measured].mean())
        if self.target.kind != "skinned" and usual > 0.0:  # that one adds squares over the points
            weights = self.points.weights.copy()
            weights[measured] *= usual / np.maximum(misses[measured], _LEAST_MISS * usual)
            self.points = replace(self.points, weights=weights)

    def _hold_maximum(self) -> list[Block] | None:
        """Return blocks each of which holds the target, with a step and emphasis of its own."""
        blocks = []
        for stretch in self.stretches:
            block = self._hold_maximum_in(stretch)
            if block is None:
                return None
            blocks.append(block)
        return blocks

    def _hold_maximum_in(self, stretch: slice) -> Block | None:
        """Return a block that holds a maximum.

        At first, and until the target is held, points and frames that miss by much get more weight
        against those that miss by little, until all come about as near to breaking it. From then
        on only what breaks it gets more weight; where nothing does, the step grows again.
        """
        values = self.state.values(stretch)
        pose = forward_kinematics(self.state.skeleton, values)
        search = self._search(stretch, pose)
        emphasis = np.ones((len(values), len(self.points.joints)))
        window = 1 + 2 * round(0.5 * _EMPHASIS_WINDOW_S * self.fps)
        gain = self.gain
        best, best_size = None, 0
        least, least_gain = np.inf, gain
        explore = True
        for round_ in range(_ROUNDS_OF_MAXIMUM):
            evening = best is None or round_ < _EVENING_ROUNDS
            if best is None and round_ > _EVENING_ROUNDS:
                search.likely = None  # no step is fine enough for knots that are too far apart
            block = search.encode(gain, explore=explore or evening)
            decoded = self._decoded(block)
            share = self._lost(pose, decoded) / self.target.value
            if share < least:
                least, least_gain = share, gain
            explore = share < _SLACK or (round_ + 1) % _EXPLORE_EVERY == 0
            if share <= _ALMOST:
                size = len(write_block(block, block.profile))
                if best is None or size < best_size:
                    best, best_size = block, size
            if abs(gain) >= _GAIN_LIMIT:
                break
            room = round(-_CAUTION * GAIN_STEPS * math.log2(max(share, _LEAST_SHARE)))
            room = max(room, -GAIN_STEPS)  # finer steps may not help
            near = maximum_filter1d(point_misses(self.points, pose, decoded), window, axis=0)
            near /= max(float(near.max()), 1e-300)
            if evening:
                gain += room
                emphasis *= np.maximum(near, _LEAST_EMPHASIS)
                emphasis = np.maximum(emphasis / emphasis.mean(), 1.0 / _MOST_EMPHASIS)
            elif share <= _ALMOST:
                gain += max(room, _GROWTH)
            else:
                near *= share
                more = np.minimum(_OVERSHOOT * near, _MOST_MENDING) ** _MENDING_POWER
                emphasis *= np.where(near > 1.0, more, 1.0)
                emphasis = np.minimum(emphasis, _MOST_EMPHASIS)
                if share > _FAR_OFF:
                    gain += room // 2
            gain = int(np.clip(gain, -_GAIN_LIMIT, _GAIN_LIMIT))
            search.weigh(*self._roots(values, pose, emphasis))
        return best or self._insist(search, pose, least_gain)

    def _insist(self, search: BlockSearch, pose: Pose, gain: int) -> Block | None:
        """Return a block that holds a maximum by finer and finer steps, at last frame by frame."""
        for i in range(_INSISTING_ROUNDS):
            gain -= _INSISTENCE
            if gain <= -_GAIN_LIMIT:
                break
            is_last_resort = i >= _CURVE_ROUNDS
            search.likely = np.zeros_like(search.profile) + SAMPLES if is_last_resort else None
            block = search.encode(gain, explore=not is_last_resort)
            if self._lost(pose, self._decoded(block)) <= _ALMOST * self.target.value:
                return block
        return None

    def _encode_all(self, gain: int, *, afresh: bool) -> tuple[list[Block], float]:
        """Return the blocks for a step, and the mean that the target bounds.

        With `afresh` their modes are looked for as if nothing was known.
        """
        blocks = []
        total = 0.0
        for stretch, search in zip(self.stretches, self._searches(), strict=True):
            if afresh:
                search.likely = None
            block = search.encode(gain)
            pose = forward_kinematics(self.state.skeleton, self.state.values(stretch))
            total += block.n_frames * self._lost(pose, self._decoded(block))
            blocks.append(block)
        return blocks, total / len(self.state)

    def _decoded(self, block: Block) -> Pose:
        values = block.values()
        if self.basis is not None:
            values = self.basis.expand(values)
        return forward_kinematics(self.state.skeleton, values)

    def _lost(self, pose: Pose, decoded: Pose) -> float:
        """Return the figure that the target bounds."""
        points = self.target.points
        return self.target.measure(pose_error(self.state.skeleton, pose, decoded, points=points))

    def _search(self, stretch: slice, pose: Pose | None = None) -> BlockSearch:
        values = self.state.values(stretch)
        pose = pose or forward_kinematics(self.state.skeleton, values)
        roots, stride = self._roots(values, pose)
        if self.basis is not None:
            values = self.basis.coordinates(values)
        return BlockSearch(values, roots, stride, self.modes, self._likely)

    def _roots(
        self, values: FloatArray, pose: Pose, emphasis: FloatArray | None = None
    ) -> tuple[FloatArray, int]:
        """Return the metric of some frames, of as many as there is memory for."""
        bytes_each = 8 * max(values.shape[1], 1) ** 2
        stride = -(-len(values) * bytes_each // _ROOTS_BYTES)
        some = (
            slice(stride // 2, None, stride) if len(values) > stride else slice(None, None, stride)
        )
        roots = metric_roots(
            self.state.skeleton,
            values[some],
            Pose(pose.positions[some], pose.rotations[some]),
            self.points,
            None if emphasis is None else emphasis[some],
        )
        if self.basis is not None:
            roots = self.basis.turn(roots)
        if not self.feedback:  # each channel as if the others were exact
            lengths = np.sqrt((roots**2).sum(axis=1))
            roots = lengths[:, :, None] * np.eye(values.shape[1])
        missing = -(-len(values) // stride) - len(roots)
        if missing > 0:
            roots = np.concatenate([roots, np.repeat(roots[-1:], missing, axis=0)])
        return roots, stride

    def _first_gain(self) -> int:
        """Return a step that is likely to come near the goal."""
        value = self.target.value
        if self.target.kind == "skinned":
            distance = value / np.sqrt(max(6 * (self.state.skeleton.n_joints - 1), 1))
        else:
            distance = value / (1000.0 * self.state.skeleton.metres_per_unit)
        if self.target.is_maximum:
            distance *= _MEAN_OF_MAXIMUM
        return int(np.clip(GAIN_STEPS * np.log2(_STEP_OF_MEAN * distance), -7000, 7000))

    def _plan_blocks(self, block_values: int) -> int:
        """Return how many frames a block has, so that it has about so many integers."""
        n_frames = len(self.state)
        if n_frames <= _SHORT_FRAMES:
            return n_frames
        probe = self._search(slice(0, min(n_frames, _PROBE_FRAMES))).encode(self.gain)
        self._likely = probe.modes
        n_values = len(probe.integers) / probe.n_frames
        if self.target.is_maximum:  # emphasis will ask for more of them
            n_values *= _MORE_FOR_MAXIMUM
        wanted = np.clip(block_values / max(n_values, 1e-9), _LEAST_FRAMES, _MOST_FRAMES)
        n_blocks = max(1, round(n_frames / float(wanted)))
        return -(-n_frames // n_blocks)


def _next_gain(gain: int, share: float, held: int, broke: int) -> int:
    """Return the gain to try next: where the error, about linear in the step, meets the target.

    A little less is aimed at, so that a good guess holds.
    """
    guess = gain + round(GAIN_STEPS * math.log2(_AIM / max(share, 1e-6)))
    if held < guess < broke:
        return guess
    if held == -_FAR:
        return broke - 8
    if broke == _FAR:
        return held + 8
    return (held + broke + 1) // 2
