"""Hypotheses: stretches of a joint whose edges look like those of a fault.

An *edge* is a boundary where a joint jumps far more than it does over the clip. What may stand
between edges follows from their number and shape:

=========  =======================================================================================
`noise`    edge upon edge
`offset`   two edges whose jumps cancel: the same turn comes and goes, short of a half turn
`flip`     the same, by nearly half a turn
`freeze`   the joint stands still, then jumps to where it should be
`drift`    one edge; before it the joint leaves its course at the pace that ends in that jump
=========  =======================================================================================

A fault that eases in and out has no edge from one frame to the next, but has one at a lower rate:
the search goes over the clip's own rate and halves of it, down to 24 frames a second.

Every hypothesis carries the evidence for and against it (`Hypothesis.evidence`), which
`detector` weighs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from mocapdb._typing import BoolArray, FloatArray
from mocapdb.cleaning.jumps import Jumps, find_jumps
from mocapdb.cleaning.texture import (
    Texture,
    conjugate,
    multiply,
    quaternions_of,
    rotation_vectors_deg,
)

__all__ = ["EVIDENCE", "KINDS", "Hypothesis", "Kind", "find_hypotheses", "jump_scales"]

Kind: TypeAlias = Literal["offset", "flip", "noise", "freeze", "drift"]
KINDS: tuple[Kind, ...] = ("offset", "flip", "noise", "freeze", "drift")
EVIDENCE = (
    "strength",
    "size",
    "misfit",
    "restlessness",
    "company",
    "extra_edges",
    "slowness",
    "at_limit",
    "length",
    "slow_strength",
    "slow_size",
    "missed",
)

LEAST_SCALE_DEG = 0.4  # what a joint may jump at 120 frames/s without notice
SCALE_TO_MEDIAN = 4.0  # of a clean joint's jumps, the 95th percentile is some 4 medians
SCALE_TO_QUARTER = 12.0
LEAST_RATIO, LEAST_EDGE_DEG = 4.0, 2.5
LONGEST_S, LONGEST_SOFT_S = 2.5, 1.25  # at the clip's own rate, and at lower ones
NOISE_GAP_S, NOISE_EDGES, NOISE_MARGIN_S = 0.03, 4, 0.012
FLIP_DEG = 150.0
OFFSET_MISFIT = 0.5
STILL_FRAMES, STILL_RATIO = 4, 0.01
MOST_STILL, LEAST_SPEED_DEG = 0.7, 1e-3  # a joint that stands more, or moves less, never moves
BACKGROUND_S = 0.3
LOWEST_FPS = 24.0
LIMIT_DEG, LIMIT_SHARE = 0.05, 0.05
LEAST_LENGTH_S = 0.1  # shorter ones tell no less


class Hypothesis(NamedTuple):
    """A stretch of a joint that may be a fault.

    Attributes
    ----------
    row : int
        The joint's row of the texture.
    start, end : int
        Frames ``start:end``.
    kind : str
    evidence : tuple of float
        In the order of `EVIDENCE`: how many times the usual its edges jump (logarithm); how far
        they jump (degrees, logarithm); how badly the kind's shape fits (0 to 1); how restless the
        joint is around it (logarithm); how many other joints jump at its edges (logarithm); how
        many edges the joint has a second elsewhere in the clip (logarithm); how low the rate is
        at which it was seen (logarithm, 0 at 120 Hz); whether the joint is at the end of its
        range there, as a stretched knee is, which may rest without fault; how long it is
        (seconds, logarithm); the first two times the lowness of the rate, as jumps mean less at a
        low one; and how far a frozen joint would have gone (degrees, logarithm). What `unlike`
        finds has its own.
    sign : {"edges", "unlike"}
        What gave it away.
    coarseness : int
        How often the clip's rate was halved before it showed; how exact its ends are.
    """

    row: int
    start: int
    end: int
    kind: Kind
    evidence: tuple[float, ...]
    sign: Literal["edges", "unlike"] = "edges"
    coarseness: int = 0

    @property
    def core(self) -> tuple[int, int]:
        """Frames without those at either end that may be right: its middle one at least."""
        margin = int(2**self.coarseness) - 1
        if self.end - self.start > 2 * margin:
            return self.start + margin, self.end - margin
        middle = (self.start + self.end - 1) // 2
        return middle, middle + 1


class _Shape(NamedTuple):
    """A hypothesis before its evidence: frames, kind, the jump that speaks for it, its misfit.

    For a freeze also how far the joint would have gone, at the pace that it has around it.
    """

    start: int
    end: int
    kind: Kind
    jump_deg: float
    misfit: float
    missed_deg: float = 0.0


def jump_scales(jumps: Jumps, fps: float) -> FloatArray:
    """Return (K,) what each joint's jumps usually stay below, in degrees.

    From low quantiles, so that faults in most of a short clip do not raise it.
    """
    floor = LEAST_SCALE_DEG * max(1.0, 120.0 / fps)
    quarter, median = np.quantile(jumps.sizes_deg, [0.25, 0.5], axis=0)
    usual = np.minimum(SCALE_TO_MEDIAN * median, SCALE_TO_QUARTER * quarter)
    return np.asarray(np.maximum(usual, floor))


def find_hypotheses(texture: Texture) -> list[Hypothesis]:
    """Return every stretch of every joint that may be a fault, the highest rate first."""
    found: list[Hypothesis] = []
    coarseness = 0
    while coarseness == 0 or texture.fps / 2**coarseness >= LOWEST_FPS:
        step = 2**coarseness
        thinned = replace(texture, quat_xyzw=texture.quat_xyzw[::step], fps=texture.fps / step)
        found += [
            # the first wrong frame lies within `step` frames of the edge: take all of them
            h._replace(
                start=max(0, (h.start - 1) * step + 1) if h.start else 0,
                end=min(len(texture), h.end * step),
                coarseness=coarseness,
            )
            for h in _at_one_rate(thinned, native=step == 1)
        ]
        coarseness += 1
    return found


def _at_one_rate(texture: Texture, *, native: bool) -> list[Hypothesis]:
    jumps = find_jumps(texture)
    if len(jumps.sizes_deg) < 2:
        return []
    scales = jump_scales(jumps, texture.fps)
    is_edge = (jumps.sizes_deg > LEAST_RATIO * scales) & (jumps.sizes_deg > LEAST_EDGE_DEG)
    found = []
    for row in range(len(scales)):
        edges = np.flatnonzero(is_edge[:, row]).tolist()
        joint = _Joint(texture, jumps, row, LONGEST_S if native else LONGEST_SOFT_S)
        for shape in joint.shapes(edges, with_freezes=native):
            evidence = _evidence(jumps, scales, is_edge, row, shape, texture)
            found.append(Hypothesis(row, shape.start, shape.end, shape.kind, evidence))
    return found


def _evidence(
    jumps: Jumps,
    scales: FloatArray,
    is_edge: BoolArray,
    row: int,
    shape: _Shape,
    texture: Texture,
) -> tuple[float, ...]:
    n_boundaries, fps = len(jumps.sizes_deg), texture.fps
    around = max(2, round(BACKGROUND_S * fps))
    before = jumps.sizes_deg[max(0, shape.start - 1 - around) : max(0, shape.start - 2), row]
    after = jumps.sizes_deg[shape.end + 1 : shape.end + around, row]
    outside = np.concatenate([before, after])
    background = float(np.quantile(outside, 0.9)) if len(outside) else 0.0
    ends = [t for t in (shape.start - 1, shape.end - 1) if 0 <= t < n_boundaries]
    company = min(int(is_edge[max(0, t - 1) : t + 2].any(axis=0).sum()) for t in ends) - 1
    others = int(is_edge[: max(0, shape.start - 2), row].sum())
    others += int(is_edge[shape.end + 1 :, row].sum())
    strength = math.log(shape.jump_deg / scales[row] + 1e-3)
    size = math.log(shape.jump_deg + 1e-3)
    slowness = math.log(120.0 / fps)
    at_limit = shape.kind == "freeze" and _is_at_limit(texture.quat_xyzw[:, row], shape.start)
    return (
        strength,
        size,
        shape.misfit,
        math.log1p(background / scales[row]),
        math.log1p(max(company, 0)),
        math.log1p(others / (n_boundaries / fps)),
        slowness,
        float(at_limit),
        math.log(max((shape.end - shape.start) / fps, LEAST_LENGTH_S)),
        slowness * strength,
        slowness * size,
        math.log1p(shape.missed_deg),
    )


def _is_at_limit(quats: FloatArray, frame: int) -> bool:
    """Return whether a joint is in its rest pose, or hardly ever turns to one side of where it is.

    Not never: where the joint is wrong elsewhere, it may turn anywhere.
    """
    turns = rotation_vectors_deg(multiply(conjugate(quats[frame]), quats))
    at_rest = np.linalg.norm(rotation_vectors_deg(quats[frame])) < LIMIT_DEG
    mean = turns.mean(axis=0)
    beyond = turns @ mean < -LIMIT_DEG * np.linalg.norm(mean)
    return bool(at_rest or beyond.mean() < LIMIT_SHARE)


class _Joint:
    """One joint's rotations and steps, and the shapes that its edges may make."""

    def __init__(self, texture: Texture, jumps: Jumps, row: int, longest_s: float) -> None:
        self.fps = texture.fps
        self.quats = texture.quat_xyzw[:, row]
        self.steps = jumps.steps_deg[:, row]
        self.sizes = jumps.sizes_deg[:, row]
        self.longest = round(longest_s * texture.fps)

    def shapes(self, edges: list[int], *, with_freezes: bool) -> Iterator[_Shape]:
        """Yield the shapes, each edge in one of them."""
        frozen = list(self._frozen_runs()) if with_freezes else []
        for start, end in frozen:
            jump = float(self.sizes[end - 1]) if end <= len(self.sizes) else 0.0
            jump = max(jump, float(self.sizes[start - 2]) if start >= 2 else 0.0)
            missed = self._pace_around(start - 1, end) * (end - start)
            yield _Shape(start, end, "freeze", jump, STILL_FRAMES / (end - start), missed)
        inside = {t for start, end in frozen for t in range(start - 1, end + 1)}
        edges = [t for t in edges if t not in inside]
        noise, edges = self._noisy_runs(edges)
        yield from noise
        pairs, edges = self._pairs(edges)
        yield from pairs
        for edge in edges:
            yield self._drift_before(edge)

    def _frozen_runs(self) -> Iterator[tuple[int, int]]:
        """Yield the frames during which a joint that moves otherwise stands still."""
        speeds = np.linalg.norm(self.steps, axis=1)
        still = speeds <= max(1e-5, STILL_RATIO * float(np.median(speeds)))
        if still.mean() > MOST_STILL or np.median(speeds[~still]) < LEAST_SPEED_DEG:
            return
        padded = np.concatenate([[False], still, [False]])
        bounds = np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2)
        for first, last in bounds.tolist():  # boundaries first:last are still
            if last - first >= STILL_FRAMES:
                # the first frame of the run is the last right one
                yield first + 1, last + 1

    def _pace_around(self, first: int, last: int) -> float:
        """Return the median step beside the boundaries ``first:last``, in degrees."""
        around = max(2, round(BACKGROUND_S * self.fps))
        before, after = self.steps[max(0, first - around) : first], self.steps[last : last + around]
        beside = np.linalg.norm(np.concatenate([before, after]), axis=1)
        return float(np.median(beside)) if len(beside) else 0.0

    def _noisy_runs(self, edges: list[int]) -> tuple[list[_Shape], list[int]]:
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
            noise.append(_Shape(start, end, "noise", float(np.median(sizes)), misfit))
        return noise, rest

    def _pairs(self, edges: list[int]) -> tuple[list[_Shape], list[int]]:
        """Pair edges whose jumps cancel, the best fitting pair first."""
        options = []
        for i, first in enumerate(edges):
            for last in edges[i + 1 :]:
                if last - first > self.longest:
                    break
                misfit, size = self._pair_misfit(first, last)
                if misfit < OFFSET_MISFIT:
                    options.append((misfit + 0.02 * (last - first) / self.fps, first, last, size))
        pairs, used = [], set[int]()
        for misfit, first, last, size in sorted(options):
            if used.isdisjoint((first, last)):
                used |= {first, last}
                kind: Kind = "flip" if size > FLIP_DEG else "offset"
                pairs.append(_Shape(first + 1, last + 1, kind, size, misfit))
        return pairs, [edge for edge in edges if edge not in used]

    def _pair_misfit(self, first: int, last: int) -> tuple[float, float]:
        """Return how much the turns at two edges differ, relative to the larger, and the smaller.

        A turn in the joint's own frame multiplies on the right, one of its outermost channel on
        the left: whichever fits better.
        """
        wrong_first, right_first = self.quats[first + 1], self._onwards(first)
        wrong_last, right_last = self.quats[last], self._backwards(last + 1)
        best = (np.inf, 0.0)
        for left in (False, True):
            a = _turn(right_first, wrong_first, left)
            b = _turn(right_last, wrong_last, left)
            sizes = np.linalg.norm(rotation_vectors_deg(np.stack([a, b])), axis=-1)
            apart = float(np.linalg.norm(rotation_vectors_deg(multiply(conjugate(a), b))))
            best = min(best, (apart / max(float(sizes.max()), 1e-9), float(sizes.min())))
        return best

    def _onwards(self, frame: int) -> FloatArray:
        """Return where the joint goes one frame after `frame`, at the pace it has there."""
        step = self.steps[frame - 1] if frame >= 1 else np.zeros(3)
        return multiply(self.quats[frame], quaternions_of(step))

    def _backwards(self, frame: int) -> FloatArray:
        """Return where the joint was one frame before `frame`, at the pace it has there."""
        step = self.steps[frame] if frame < len(self.steps) else np.zeros(3)
        return multiply(self.quats[frame], quaternions_of(-step))

    def _drift_before(self, edge: int) -> _Shape:
        """Find where the drift that ends in an edge sets in.

        Its pace, seen along the jump's axis, rises there by the jump over its length. Of all
        starts take the one at which such a rise explains the pace best, against no rise at all.
        """
        jump = -(self.steps[edge] - self._pace_beside(edge))
        size = float(np.linalg.norm(jump))
        h = max(2, round(0.05 * self.fps))
        starts = np.arange(max(h, edge - self.longest), edge - h + 1)
        if len(starts) == 0:
            return _Shape(max(0, edge - h), edge + 1, "drift", float(self.sizes[edge]), 1.0)
        sums = np.concatenate([[0.0], np.cumsum(self.steps @ (jump / max(size, 1e-9)))])
        rises = (sums[2 * h :] - 2 * sums[h:-h] + sums[: -2 * h]) / h  # rises[i] is at boundary i+h
        usual = max(1.5 * float(np.median(np.abs(rises))), 1e-3)
        rise = rises[starts - h]
        wanted = max(size, 1e-9) / (edge - starts + 1)
        gain = wanted * (2 * rise - wanted) / usual**2
        best = int(gain.argmax())
        start = int(starts[best])
        misfit = min(1.0, abs(float(rise[best] / wanted[best]) - 1.0))
        return _Shape(start + 1, edge + 1, "drift", size, misfit)

    def _pace_beside(self, edge: int) -> FloatArray:
        beside: Sequence[int] = [t for t in (edge - 1, edge + 1) if 0 <= t < len(self.steps)]
        return np.asarray(self.steps[list(beside)].mean(axis=0))


def _turn(right: FloatArray, wrong: FloatArray, left: bool) -> FloatArray:
    return multiply(wrong, conjugate(right)) if left else multiply(conjugate(right), wrong)
