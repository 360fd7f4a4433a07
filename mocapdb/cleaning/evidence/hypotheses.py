"""Hypotheses: stretches of a joint whose edges look like those of a fault.

An *edge* is a boundary where a joint jumps far more than it does over the clip. What may stand
between edges follows from their number and shape:

=========  =======================================================================================
`noise`    edge upon edge
`offset`   two edges whose jumps cancel: the same turn comes and goes, short of a half turn
`flip`     the same, by nearly half a turn
`freeze`   the joint stands still, then jumps to where it should be
`drift`    one edge; before it the joint leaves its course at the pace that ends in that jump. The
           root may do so for long, as the heading of a sensor does
=========  =======================================================================================

A fault that eases in and out has no edge from one frame to the next, but has one at a lower rate:
the search goes over the clip's own rate and halves of it, down to 24 frames a second.

Every hypothesis carries the evidence for and against it, which `fault_confidence` weighs. Angles
and ratios are taken as logarithms:

===================  =============================================================================
`strength`           how many times the usual the joint jumps at the edges
`size`               how far it jumps, in degrees
`misfit`             how badly the kind's shape fits, 0 to 1
`background`         how restless the joint is around the stretch
`simultaneous`       how many other joints jump alike at its edges, beyond the few of a limb: a
                     cut in the take moves all of them. Hands and toes are not asked
`extra_edges`        how many edges the joint has elsewhere in the clip, a second
`low_rate`           how low the rate is at which it was seen; 0 at 120 Hz
`at_limit`           1 where the joint stands still at the end of its range, as a stretched knee may
`length`             how long the stretch is, in seconds
`low_rate_strength`  the first times the lowness of the rate: jumps mean less at a low one
`low_rate_size`      the second, likewise
`missed`             how far a joint that stands would have gone, in degrees
`isolation`          how much the edges stand out from the boundaries next to them; of noise the
                     correlation of each change of pace with the next
`release`            how far a frozen joint goes when it is let go, against the steps that follow
===================  =============================================================================
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray, quantile_of
from mocapdb.cleaning.evidence.discontinuities import Jumps, find_jumps
from mocapdb.cleaning.evidence.fault_shapes import Cue, JointShapes, Kind, Shape
from mocapdb.cleaning.evidence.quieting import quieted
from mocapdb.cleaning.joint_roles import BODY_ROLES
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import (
    ALIKE_SHARE,
    BACKGROUND_QUANTILE,
    BACKGROUND_S,
    EDGE_RATIO,
    FEW_JOINTS,
    HELD_DEG,
    JUMP_OVER_LARGE,
    JUMP_OVER_MEDIAN,
    JUMP_OVER_QUARTILE,
    LARGE_JUMP_QUANTILE,
    LARGEST_SCALE_DEG,
    LEAST_ANGLE_DEG,
    LEAST_EDGE_DEG,
    LEAST_JUMP,
    LEAST_LENGTH_S,
    LEAST_SCALE_DEG,
    LIMIT_DEG,
    LIMIT_SHARE,
    LONGEST_S,
    LONGEST_SOFT_S,
    LOWEST_EDGE_FPS,
    MOST_SEEN,
    REFERENCE_FPS,
    RELEASE_FRAMES,
    RESTLESS_S,
    RESTLESS_SHARE,
    STANDING_DEG,
)
from mocapdb.motion.frame_range import FrameRange
from mocapdb.motion.quaternions import conjugate, multiply, rotation_vectors_deg

__all__ = ["EVIDENCE", "Hypothesis", "find_hypotheses", "jump_scales"]

EVIDENCE = (
    "strength",
    "size",
    "misfit",
    "background",
    "simultaneous",
    "extra_edges",
    "low_rate",
    "at_limit",
    "length",
    "low_rate_strength",
    "low_rate_size",
    "missed",
    "isolation",
    "release",
)


@dataclass(frozen=True)
class Hypothesis(FrameRange):
    """A stretch of a joint that may be a fault.

    Attributes
    ----------
    start, end : int
        Frames ``start:end`` of the clip.
    row : int
        The joint's row of the texture.
    kind : str
    evidence : tuple of float
        In the order of `EVIDENCE` (see `hypotheses`); what is found by similarity has
        `similarity_evidence.SIMILARITY_EVIDENCE` instead.
    cue : str
        What gave it away: see `fault_shapes.Cue`.
    halvings : int
        How often the clip's rate was halved before it showed; how exact its ends are.
    """

    row: int
    kind: Kind
    evidence: tuple[float, ...]
    cue: Cue = "edges"
    halvings: int = 0

    @property
    def core(self) -> FrameRange:
        """The frames without those at either end that may be right: the middle one at least."""
        margin = int(2**self.halvings) - 1
        if len(self) > 2 * margin:
            return FrameRange(self.start + margin, self.end - margin)
        middle = (self.start + self.end - 1) // 2
        return FrameRange(middle, middle + 1)


def jump_scales(jumps: Jumps, fps: float, restless: BoolArray | None = None) -> FloatArray:
    """Return (K,) what each joint's jumps usually stay below, in degrees.

    From low quantiles, so that faults in most of a short clip do not raise it.

    Parameters
    ----------
    jumps : Jumps
    fps : float, frames per second
    restless : (K,) bool, optional
        Hands and toes. Where storing has made their quiet frames exactly quiet, low quantiles say
        nothing: so of these the large jumps of most stretches of the clip count, too.
    """
    low_rate = max(1.0, REFERENCE_FPS / fps)
    quartile, median = np.quantile(jumps.sizes_deg, [0.25, 0.5], axis=0)
    usual = np.minimum(JUMP_OVER_MEDIAN * median, JUMP_OVER_QUARTILE * quartile)
    if restless is not None and restless.any():
        sizes = jumps.sizes_deg[:, restless]
        stretches = np.array_split(sizes, max(1, round(len(sizes) / (RESTLESS_S * fps))))
        large = [np.quantile(stretch, LARGE_JUMP_QUANTILE, axis=0) for stretch in stretches]
        least = JUMP_OVER_LARGE * np.quantile(large, RESTLESS_SHARE, axis=0)
        usual[restless] = np.maximum(usual[restless], least)
    return np.asarray(np.clip(usual, LEAST_SCALE_DEG * low_rate, LARGEST_SCALE_DEG * low_rate))


def find_hypotheses(texture: Texture, quiet: Texture | None = None) -> list[Hypothesis]:
    """Return every stretch of every joint that may be a fault, the highest rate first.

    Parameters
    ----------
    texture : Texture
        Of the clip at its own rate.
    quiet : Texture, optional
        The same, as jumps are looked for in it; by default without small noise (see `quieting`).
    """
    quiet = quieted(texture) if quiet is None else quiet
    # what stands still is told by its noise
    found = _at_one_rate(texture, native=True, standing=True)
    halvings = 0
    while halvings == 0 or texture.fps / 2**halvings >= LOWEST_EDGE_FPS:
        step = 2**halvings
        captured, thinned = (
            replace(one, quat_xyzw=one.quat_xyzw[::step], fps=texture.fps / step)
            for one in (texture, quiet)
        )
        found += [
            # the first wrong frame lies within `step` frames of the edge: take all of them
            replace(
                h,
                start=max(0, (h.start - 1) * step + 1) if h.start else 0,
                end=min(len(texture), h.end * step),
                halvings=halvings,
            )
            for h in _at_one_rate(thinned, native=step == 1, standing=False, captured=captured)
        ]
        halvings += 1
    return found


def _at_one_rate(
    texture: Texture, *, native: bool, standing: bool, captured: Texture | None = None
) -> list[Hypothesis]:
    """Return the hypotheses by edges at a rate: those of a joint that stands still, or others.

    Of a texture without small noise `captured` is what it was made of.
    """
    jumps = find_jumps(texture)
    if len(jumps.sizes_deg) < 2:
        return []
    restless = np.array([role not in BODY_ROLES for role in texture.row_roles])
    scales = jump_scales(jumps, texture.fps, restless)
    is_edge = (jumps.sizes_deg > EDGE_RATIO * scales) & (jumps.sizes_deg > LEAST_EDGE_DEG)
    both = (captured, find_jumps(captured)) if captured is not None else None
    longest_s = LONGEST_S if native else LONGEST_SOFT_S
    found = []
    for row in range(len(scales)):
        edges = np.flatnonzero(is_edge[:, row]).tolist()
        n_edges = np.concatenate([[0], np.cumsum(is_edge[:, row])])  # before each boundary
        joint = JointShapes(texture, jumps, row, longest_s, both)
        for shape in joint.shapes(edges, native=native):
            if (shape.kind == "freeze") != standing:
                continue
            evidence = _evidence(jumps, scales, n_edges, row, shape, texture)
            found.append(Hypothesis(shape.start, shape.end, row, shape.kind, evidence, shape.cue))
    return found


def _evidence(
    jumps: Jumps,
    scales: FloatArray,
    n_edges: IntArray,
    row: int,
    shape: Shape,
    texture: Texture,
) -> tuple[float, ...]:
    n_boundaries, fps = len(jumps.sizes_deg), texture.fps
    around = max(2, round(BACKGROUND_S * fps))
    before = jumps.sizes_deg[max(0, shape.start - 1 - around) : max(0, shape.start - 2), row]
    after = jumps.sizes_deg[shape.end + 1 : shape.end + around, row]
    outside = np.concatenate([before, after])
    background = quantile_of(outside, BACKGROUND_QUANTILE) if len(outside) else 0.0
    ends = [t for t in shape.edges if 0 <= t < n_boundaries]
    few = FEW_JOINTS if len(ends) > 1 else 0  # a cut never returns, a fault does
    company = min((_joints_that_jump(jumps, row, t, shape, texture) for t in ends), default=0)
    others = int(n_edges[max(0, shape.start - 2)])
    others += int(n_edges[-1] - n_edges[min(shape.end + 1, n_boundaries)])
    strength = math.log(shape.jump_deg / scales[row] + LEAST_JUMP)
    size = math.log(shape.jump_deg + LEAST_JUMP)
    low_rate = math.log(REFERENCE_FPS / fps)
    at_limit = _stands(jumps, row, shape) and _is_at_limit(
        texture.quat_xyzw[:, row],
        (shape.start + shape.end - 1) // 2,
        HELD_DEG if shape.cue == "held" else LIMIT_DEG,
    )
    return (
        strength,
        size,
        shape.misfit,
        math.log1p(background / scales[row]),
        math.log1p(max(company - few, 0)),
        math.log1p(others / (n_boundaries / fps)),
        low_rate,
        float(at_limit),
        math.log(max(len(shape) / fps, LEAST_LENGTH_S)),
        low_rate * strength,
        low_rate * size,
        math.log1p(shape.missed_deg),
        _alternation(jumps, row, shape) if shape.kind == "noise" else _isolation(jumps, row, shape),
        _release(jumps, row, shape) if shape.kind == "freeze" else 0.0,
    )


def _joints_that_jump(jumps: Jumps, row: int, edge: int, shape: Shape, texture: Texture) -> int:
    """Return how many of the body's other joints jump at an edge, half as far or further."""
    asked = np.array([role in BODY_ROLES for role in texture.row_roles])
    asked[row] = False
    sizes = jumps.sizes_deg[max(0, edge - 1) : edge + 2, asked].max(axis=0)
    return int((sizes > ALIKE_SHARE * shape.jump_deg).sum())


def _isolation(jumps: Jumps, row: int, shape: Shape) -> float:
    """Return how much a shape's edges stand out from the boundaries next to them (logarithm).

    A fault makes a joint jump between two frames. A quick movement, or a foot that hits the
    floor, makes it jump in several frames in a row.
    """
    sizes, least = jumps.sizes_deg[:, row], np.inf
    for edge in (t for t in shape.edges if 0 <= t < len(sizes)):
        near = [t for t in range(max(0, edge - 2), edge + 3) if t < len(sizes)]
        beside = [sizes[t] for t in near if not min(shape.edges) <= t <= max(shape.edges)]
        least = min(
            least,
            math.log(
                (sizes[edge] + LEAST_ANGLE_DEG) / (max(beside, default=0.0) + LEAST_ANGLE_DEG)
            ),
        )
    return float(least) if least < np.inf else 0.0


def _alternation(jumps: Jumps, row: int, shape: Shape) -> float:
    """Return the correlation of a joint's changes of pace with the next: -2/3 in white noise.

    A fast movement gains speed over several frames, so that its changes have the same sign.
    """
    first, last = shape.edges
    changes = np.diff(jumps.steps_deg[max(0, first - 1) : last + 2, row], axis=0)
    total = float(np.sum(changes**2))
    return float(np.sum(changes[1:] * changes[:-1])) / total if total > 0 else 0.0


def _release(jumps: Jumps, row: int, shape: Shape) -> float:
    """Return how the first step after a freeze compares with those that follow (logarithm).

    A joint that was frozen jumps to where it really is; one that rested starts slowly.
    """
    steps = np.linalg.norm(jumps.steps_deg[shape.end - 1 : shape.end + RELEASE_FRAMES, row], axis=1)
    if len(steps) < 2:
        return 0.0
    return math.log((steps[0] + LEAST_ANGLE_DEG) / (steps[1:].max() + LEAST_ANGLE_DEG))


def _stands(jumps: Jumps, row: int, shape: Shape) -> bool:
    """Return whether a joint hardly moves in most of a stretch."""
    first = min(shape.start, len(jumps.steps_deg) - 1)
    steps = jumps.steps_deg[first : max(shape.end - 1, first + 1), row]
    return shape.cue == "held" or float(np.median(np.linalg.norm(steps, axis=1))) < STANDING_DEG


def _is_at_limit(quats: FloatArray, frame: int, limit_deg: float) -> bool:
    """Return whether a joint is in its rest pose, or hardly ever turns to one side of where it is.

    A few frames may be beyond it, since the joint may be wrong there.
    """
    some = quats[:: -(-len(quats) // MOST_SEEN)]  # of a long clip enough
    turns = rotation_vectors_deg(multiply(conjugate(quats[frame]), some))
    at_rest = np.linalg.norm(rotation_vectors_deg(quats[frame])) < limit_deg
    mean = turns.mean(axis=0)
    beyond = turns @ mean < -limit_deg * np.linalg.norm(mean)
    return bool(at_rest or beyond.mean() < LIMIT_SHARE)
