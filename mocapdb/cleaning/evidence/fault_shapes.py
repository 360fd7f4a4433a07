"""What may stand between the edges of one joint; `hypotheses` says which shapes there are."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal, TypeAlias

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.cleaning.evidence.discontinuities import Jumps
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import (
    ALIKE_MISFIT,
    BACKGROUND_S,
    FLIP_DEG,
    FROZEN_FRAMES,
    HELD_DEG,
    HELD_S,
    LARGEST_CUT_SHARE,
    LEAST_RELEASE_DEG,
    LEAST_STEP_DEG,
    MISFIT_PER_S,
    MOST_STILL,
    NOISE_EDGES,
    NOISE_GAP_S,
    NOISE_MARGIN_S,
    OFFSET_MISFIT,
    ONSET_OF_LONG_S,
    ONSET_PARTS,
    ONSET_S,
    SLOW_DRIFT_S,
    STILL_RATIO,
)
from mocapdb.motion.frame_range import FrameRange, ranges_where
from mocapdb.motion.quaternions import (
    angles_deg,
    conjugate,
    from_rotation_vectors_deg,
    multiply,
    rotation_vectors_deg,
)

__all__ = ["KINDS", "Cue", "JointShapes", "Kind", "Shape", "turn_between"]

Kind: TypeAlias = Literal[
    "offset", "flip", "noise", "freeze", "drift", "filled", "exchange", "pop", "slide", "sink"
]
KINDS: tuple[Kind, ...] = ("offset", "flip", "noise", "freeze", "drift")

Cue: TypeAlias = Literal[
    "edges",
    "cut off",
    "held",
    "slow drift",
    "similarity",
    "excursion",
    "jitter",
    "straight line",
    "exchange",
    "root",
]
"""What gave a hypothesis away.

`edges` of its kind; one edge, the other being `cut off` by the clip's end; one edge before which
the joint hardly moves (`held`), or the root drifts for long (`slow drift`); or `similarity` to
other motion, which the joint lacks. The others are named after the modules that look for them:
`excursions`, `jitter`, `straight_lines`, `exchanges` and `root_jumps`.
"""


@dataclass(frozen=True)
class Shape(FrameRange):
    """A hypothesis before its evidence.

    Attributes
    ----------
    start, end : int
        Frames ``start:end``.
    kind : str
    jump_deg : float
        The jump that speaks for it.
    misfit : float
        How badly the kind's shape fits, 0 to 1.
    edges : tuple of int
        Boundaries that it rests on; of noise the first and the last.
    missed_deg : float
        How far a joint that stands still would have gone, at the pace that it has around.
    cue : {"edges", "cut off", "held", "slow drift"}
    """

    kind: Kind
    jump_deg: float
    misfit: float
    edges: tuple[int, ...]
    missed_deg: float = 0.0
    cue: Cue = "edges"


class JointShapes:
    """One joint's rotations and steps, and the shapes that its edges may make.

    Parameters
    ----------
    texture : Texture
        In which edges were looked for.
    jumps : Jumps
        Of the texture.
    row : int
    longest_s : float, seconds
    captured : (Texture, Jumps), optional
        The same as it was captured, and its jumps. A joint that moves is pulled apart at an edge
        where its noise is taken away, by other angles at one end of a fault than at the other; so
        whether two edges belong together is asked here, too.
    """

    def __init__(
        self,
        texture: Texture,
        jumps: Jumps,
        row: int,
        longest_s: float,
        captured: tuple[Texture, Jumps] | None = None,
    ) -> None:
        self.fps = texture.fps
        self.quats = texture.quat_xyzw[:, row]
        self.steps = jumps.steps_deg[:, row]
        self.sizes = jumps.sizes_deg[:, row]
        self.courses = [(self.quats, self.steps)]
        if captured is not None:
            self.courses.append((captured[0].quat_xyzw[:, row], captured[1].steps_deg[:, row]))
        self.longest = round(longest_s * texture.fps)
        seconds = SLOW_DRIFT_S if texture.joints[row] == texture.root else (0.0, 0.0)
        self.slow = (round(seconds[0] * texture.fps), round(seconds[1] * texture.fps))

    def shapes(self, edges: list[int], *, native: bool) -> Iterator[Shape]:
        """Yield the shapes; an edge that stands alone is in all that may explain it."""
        frozen = self._frozen() if native else []
        yield from frozen
        inside = {t for shape in frozen for t in range(shape.start - 1, shape.end + 1)}
        edges = [t for t in edges if t not in inside]
        noise, edges = self._noisy_runs(edges)
        yield from noise
        pairs, edges = self._pairs(edges)
        yield from pairs
        for edge in edges:
            if edge > 0:  # a first frame alone has no course to leave: many a file begins so
                yield self._drift_before(edge)
            if native:
                if self.slow[0]:
                    yield from self._slow_drift_before(edge)
                yield from self._held_before(edge)
                yield from self._cut_off(edge)

    def _frozen(self) -> list[Shape]:
        """Return the stretches in which a joint that moves otherwise stands exactly still.

        One that goes on from where it stood, without a jump, was not held: it rested.
        """
        sizes = np.linalg.norm(self.steps, axis=1)
        still = sizes <= max(1e-5, STILL_RATIO * float(np.median(sizes)))  # nothing but rounding
        if still.mean() > MOST_STILL or np.median(sizes[~still]) < LEAST_STEP_DEG:
            return []
        frozen = []
        for run in ranges_where(still):  # of boundaries
            if len(run) < FROZEN_FRAMES:
                continue
            start, end = run.start + 1, run.end + 1  # the frame before them is the last right one
            jump = float(self.sizes[end - 1]) if end <= len(self.sizes) else 0.0
            jump = max(jump, float(self.sizes[start - 2]) if start >= 2 else 0.0)
            if jump < LEAST_RELEASE_DEG:  # it rests, or storing has taken its noise away
                continue
            misfit = FROZEN_FRAMES / len(run)
            missed = self._pace_around(start - 1, end) * len(run)
            edges = (start - 2, end - 1)
            frozen.append(Shape(start, end, "freeze", jump, misfit, edges, missed))
        return frozen

    def _pace_around(self, first: int, last: int) -> float:
        """Return the median step beside the boundaries ``first:last``, in degrees."""
        around = max(2, round(BACKGROUND_S * self.fps))
        before, after = self.steps[max(0, first - around) : first], self.steps[last : last + around]
        beside = np.linalg.norm(np.concatenate([before, after]), axis=1)
        return float(np.median(beside)) if len(beside) else 0.0

    def _noisy_runs(self, edges: list[int]) -> tuple[list[Shape], list[int]]:
        gap = max(2, math.ceil(NOISE_GAP_S * self.fps))
        runs: list[list[int]] = []
        for edge in edges:
            if runs and edge - runs[-1][-1] <= gap:
                runs[-1].append(edge)
            else:
                runs.append([edge])
        noise, rest = [], []
        margin = math.ceil(NOISE_MARGIN_S * self.fps)
        for run in runs:
            if len(run) < NOISE_EDGES:
                rest += run
                continue
            sizes = self.sizes[run[0] : run[-1] + 1]
            misfit = 1.0 - len(run) / len(sizes)
            # noise may be small at first and at last: a little more on both sides
            start, end = max(0, run[0] + 1 - margin), min(len(self.quats), run[-1] + 1 + margin)
            noise.append(
                Shape(start, end, "noise", float(np.median(sizes)), misfit, (run[0], run[-1]))
            )
        return noise, rest

    def _pairs(self, edges: list[int]) -> tuple[list[Shape], list[int]]:
        """Pair edges whose jumps cancel, the best fitting pair first; of several the shortest."""
        near = [
            (first, last)
            for i, first in enumerate(edges)
            for last in edges[i + 1 : bisect_right(edges, first + self.longest)]
        ]
        if not near:
            return [], edges
        firsts, lasts = np.array(near).T
        options = [
            (
                max(misfit, ALIKE_MISFIT) + MISFIT_PER_S * (last - first) / self.fps,
                first,
                last,
                misfit + MISFIT_PER_S * (last - first) / self.fps,
                size,
            )
            for (first, last), misfit, size in zip(
                near, *(some.tolist() for some in self._pair_misfits(firsts, lasts)), strict=True
            )
            if misfit < OFFSET_MISFIT
        ]
        pairs, used = [], set[int]()
        for _, first, last, misfit, size in sorted(options):
            if used.isdisjoint((first, last)):
                used |= {first, last}
                kind: Kind = "flip" if size > FLIP_DEG else "offset"
                pairs.append(Shape(first + 1, last + 1, kind, size, misfit, (first, last)))
        return pairs, [edge for edge in edges if edge not in used]

    def _pair_misfits(self, firsts: IntArray, lasts: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return how much the turns at pairs of edges differ, relative to the larger; the smaller.

        A turn in the joint's own frame multiplies on the right, one of its outermost channel on
        the left; with small noise or without: whichever fits better.
        """
        misfits, sizes = np.full(len(firsts), np.inf), np.zeros(len(firsts))
        for (quats, steps), left in product(self.courses, (False, True)):
            n_frames, n_steps = len(quats), len(steps)
            # where the joint goes on from an edge, at the pace it has before it, and after it
            pace_in = np.where((firsts > 0)[:, None], steps[np.maximum(firsts - 1, 0)], 0.0)
            after = np.minimum(lasts + 1, n_steps - 1)
            pace_out = np.where((lasts + 1 < n_steps)[:, None], steps[after], 0.0)
            right_first = multiply(quats[firsts], from_rotation_vectors_deg(pace_in))
            right_last = multiply(
                quats[np.minimum(lasts + 1, n_frames - 1)], from_rotation_vectors_deg(-pace_out)
            )
            a = turn_between(right_first, quats[firsts + 1], left)
            b = turn_between(right_last, quats[lasts], left)
            apart = np.linalg.norm(rotation_vectors_deg(multiply(conjugate(a), b)), axis=-1)
            both = np.linalg.norm(rotation_vectors_deg(np.stack([a, b])), axis=-1)
            misfit = apart / np.maximum(both.max(axis=0), 1e-9)
            better = misfit < misfits
            misfits = np.where(better, misfit, misfits)
            sizes = np.where(better, both.min(axis=0), sizes)
        return misfits, sizes

    def _slow_drift_before(self, edge: int) -> Iterator[Shape]:
        """Yield the slow drift that ends in an edge, if there is room for one."""
        if edge > self.slow[0]:
            shape = self._drift_before(edge, *self.slow)
            yield replace(shape, cue="slow drift")

    def _drift_before(self, edge: int, shortest: int = 0, longest: int | None = None) -> Shape:
        """Find where the drift that ends in an edge sets in.

        Its pace, seen along the jump's axis, rises there by the jump over its length. Of all
        starts take the one at which such a rise explains the pace best, against no rise at all.
        """
        jump = -(self.steps[edge] - self._pace_beside(edge))
        size = float(np.linalg.norm(jump))
        h = max(2, round(ONSET_S * self.fps))
        starts = np.arange(max(h, edge - (longest or self.longest)), edge - max(h, shortest) + 1)
        if len(starts) == 0:
            jump_deg = float(self.sizes[edge])
            return Shape(max(0, edge - h), edge + 1, "drift", jump_deg, 1.0, (edge,))
        if shortest:  # a long drift is slow: its pace shows over a longer time
            most = max(h, round(ONSET_OF_LONG_S * self.fps))
            around = np.minimum(np.clip((edge - starts + 1) // ONSET_PARTS, h, most), starts)
        else:
            around = np.full(len(starts), h)
        low = int((starts - around).min())
        along = self.steps[low : int((starts + around).max())] @ (jump / max(size, 1e-9))
        sums = np.concatenate([[0.0], np.cumsum(along)])
        at = starts - low
        rise = (sums[at + around] - 2 * sums[at] + sums[at - around]) / around
        wanted = max(size, 1e-9) / (edge - starts + 1)
        best = int((wanted * (2 * rise - wanted)).argmax())
        start = int(starts[best])
        misfit = min(1.0, abs(float(rise[best] / wanted[best]) - 1.0))
        return Shape(start + 1, edge + 1, "drift", size, misfit, (edge,))

    def _held_before(self, edge: int) -> Iterator[Shape]:
        """Yield the stretch up to an edge in which the joint only trembles, if it does."""
        least = max(FROZEN_FRAMES, math.ceil(HELD_S * self.fps))
        if edge + 1 < least:
            return
        middle = self.quats[edge + 1 - least : edge + 1].copy()
        middle[np.sum(middle * middle[-1], axis=1) < 0] *= -1.0
        mean = middle.mean(axis=0)
        low = max(0, edge - self.longest)  # one frame more than it may last
        apart = angles_deg(mean / np.linalg.norm(mean), self.quats[low : edge + 1])
        outside = np.flatnonzero(apart > HELD_DEG)
        start = low + int(outside[-1]) + 1 if len(outside) else low
        if not least <= edge + 1 - start <= self.longest:
            return
        missed = self._pace_around(start, edge + 1) * (edge + 1 - start)
        misfit = float(apart[start - low :].mean()) / HELD_DEG
        size = float(self.sizes[edge])
        yield Shape(start, edge + 1, "freeze", size, misfit, (edge,), missed, "held")

    def _cut_off(self, edge: int) -> Iterator[Shape]:
        """Yield the offsets that one edge begins or ends, where the clip cuts off the other.

        Their misfit is the share of the clip that they would be.
        """
        size, n_frames = float(self.sizes[edge]), len(self.quats)
        kind: Kind = "flip" if size > FLIP_DEG else "offset"
        for start, end in ((0, edge + 1), (edge + 1, n_frames)):
            share = (end - start) / n_frames
            if end - start <= self.longest and share < LARGEST_CUT_SHARE:
                yield Shape(start, end, kind, size, share, (edge,), cue="cut off")

    def _pace_beside(self, edge: int) -> FloatArray:
        beside = [t for t in (edge - 1, edge + 1) if 0 <= t < len(self.steps)]
        return np.asarray(self.steps[beside].mean(axis=0))


def turn_between(right: FloatArray, wrong: FloatArray, left: bool) -> FloatArray:
    """Return the turn that leads from the right rotation to the wrong one, on the left or right."""
    return multiply(wrong, conjugate(right)) if left else multiply(conjugate(right), wrong)
