"""Hypotheses by self-similarity: stretches in which one joint does what it never does elsewhere.

A fault that eases in and out leaves no edge. What gives it away is that the rest of the body does
what it does in similar motion, and this joint does not. Its rotation relative to the median of the
neighbours is high-passed first: a joint that differs from its neighbours throughout, by style or by
body, is not wrong. The evidence, in logarithms:

==============  ==================================================================================
`peak`          how many times the usual the joint is apart from its neighbours at most
`size`          by how much, in degrees
`length`        for how long, in seconds
`simultaneous`  how many other joints are apart from theirs at the same time
`rest_of_body`  by how much these are apart, in the median and in times of the usual
`recurrence`    how many such stretches the joint has elsewhere, a second
`sharpness`     how sharply it turns in the stretch, against its usual turns
`spread`        how far the neighbours are from each other, in degrees
==============  ==================================================================================
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cleaning.evidence.fault_shapes import Kind
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.neighbours.similarity import Consensus
from mocapdb.cleaning.tuning import (
    FLIP_DEG,
    HIGH_PASS_S,
    LEAST_APART_DEG,
    LEAST_JUMP,
    LEAST_PEAK,
    LEAST_REST,
    LEAST_SHARPNESS_DEG,
    LEAST_USUAL_DEG,
    ONE_WAY_SHARE,
    PEAK_BASE,
    SHARPNESS_QUANTILE,
    SIMILARITY_HALVINGS,
    STEADY_SHARE,
    USUAL_FACTOR,
    USUAL_QUANTILE,
)
from mocapdb.motion.quaternions import (
    conjugate,
    from_rotation_vectors_deg,
    multiply,
    rotation_vectors_deg,
)

__all__ = ["SIMILARITY_EVIDENCE", "find_dissimilar", "kind_of_turns"]

SIMILARITY_EVIDENCE = (
    "peak",
    "size",
    "length",
    "simultaneous",
    "rest_of_body",
    "recurrence",
    "sharpness",
    "spread",
)


def find_dissimilar(
    texture: Texture, consensus: Consensus, fps: float, n_frames: int
) -> list[Hypothesis]:
    """Return stretches of joints that differ from similar motion, in frames of the clip.

    Parameters
    ----------
    texture : Texture
        As the words are cut from it.
    consensus : Consensus
    fps : float, frames per second
    n_frames : int
        Of the clip.

    Returns
    -------
    list of Hypothesis
        The evidence of each in the order of `SIMILARITY_EVIDENCE` (see the module).
    """
    if not consensus.known.any():
        return []
    apart = _apart(texture, consensus)
    size = np.linalg.norm(apart, axis=-1)
    usual = USUAL_FACTOR * np.quantile(size, USUAL_QUANTILE, axis=0)
    ratio = size / (np.maximum(usual, LEAST_USUAL_DEG) + consensus.spread_deg)
    bends = _bends(texture)
    rate = texture.fps / fps
    found = []
    for row in range(len(texture.joints)):
        stretches = _stretches(ratio[:, row], size[:, row])
        for first, last in stretches:
            peak = first + int(ratio[first:last, row].argmax())
            others = np.delete(ratio[peak], row)
            evidence = (
                math.log(ratio[peak, row]),
                math.log(size[peak, row] + LEAST_JUMP),
                math.log((last - first) / texture.fps),
                math.log1p(int((others > LEAST_PEAK).sum())),
                math.log(float(np.median(others)) + LEAST_REST),
                math.log1p((len(stretches) - 1) * texture.fps / len(texture)),
                math.log(bends[max(0, first - 1) : last + 1, row].max() + LEAST_JUMP),
                math.log(float(np.median(consensus.spread_deg[first:last, row])) + LEAST_APART_DEG),
            )
            # the fault begins between two frames of the texture: take the middle
            start = max(0, math.ceil((first - 0.5) / rate))
            end = min(n_frames, math.floor((last - 0.5) / rate) + 1)
            kind = kind_of_turns(apart[first:last, row])
            found.append(
                Hypothesis(start, end, row, kind, evidence, "similarity", SIMILARITY_HALVINGS)
            )
    return found


def _apart(texture: Texture, consensus: Consensus) -> FloatArray:
    """Return (F, K, 3) how joints are turned against their neighbours, beyond the usual."""
    from scipy.ndimage import median_filter

    turns = rotation_vectors_deg(multiply(conjugate(consensus.median_quats), texture.quat_xyzw))
    width = min(2 * round(HIGH_PASS_S * texture.fps / 2) + 1, 2 * len(turns) - 1)
    usual = from_rotation_vectors_deg(median_filter(turns, size=(width, 1, 1), mode="nearest"))
    return rotation_vectors_deg(multiply(conjugate(usual), from_rotation_vectors_deg(turns)))


def _bends(texture: Texture) -> FloatArray:
    """Return (F, K) how far a step differs from the one before, against the usual difference."""
    quats = texture.quat_xyzw
    steps = rotation_vectors_deg(multiply(conjugate(quats[:-1]), quats[1:]))
    bends = np.zeros(quats.shape[:2])
    bends[1:-1] = np.linalg.norm(np.diff(steps, axis=0), axis=-1)
    usual = np.maximum(np.quantile(bends, SHARPNESS_QUANTILE, axis=0), LEAST_SHARPNESS_DEG)
    return np.asarray(bends / usual)


def _stretches(ratio: FloatArray, size: FloatArray) -> list[tuple[int, int]]:
    """Return (first, last) of each peak of the ratio and what belongs to it, down to its base."""
    left = ratio > LEAST_PEAK
    found = []
    while left.any():
        peak = int(np.where(left, ratio, 0.0).argmax())
        inside: BoolArray = (size > PEAK_BASE * size[peak]) & (ratio > PEAK_BASE * ratio[peak])
        first = peak
        while first > 0 and inside[first - 1]:
            first -= 1
        last = peak + 1
        while last < len(size) and inside[last]:
            last += 1
        found.append((first, last))
        left[first:last] = False
    return sorted(found)


def kind_of_turns(apart: FloatArray) -> Kind:
    """Return what a stretch looks like by its turns (n, 3) away from the neighbours, in degrees."""
    size = np.linalg.norm(apart, axis=1)
    if size.max() > FLIP_DEG:
        return "flip"
    if np.linalg.norm(apart.mean(axis=0)) < ONE_WAY_SHARE * size.mean():
        return "noise"
    return "offset" if np.median(size) > STEADY_SHARE * size.max() else "drift"
