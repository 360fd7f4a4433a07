"""Excursions: a joint leaves its course and comes back, with edges that are soft.

A fault that eases in and out makes no jump. The joint is compared with the middle of the way
between where it is a little earlier and a little later, over several such times: that is its
*excursion*. Captured joints make excursions all the time; those of a fault go where the joint's own
never do, a knee to the side, a spine by a right angle. So an excursion is measured in the spread of
the joint's other excursions over the same time (Mahalanobis distance). The evidence, in logarithms:

===============  =================================================================================
`oddness`        the largest Mahalanobis distance of the excursion
`size`           how far the joint is off the chord between the ends, in degrees
`against_usual`  the same, against the joint's usual excursions over the same time
`length`         in seconds
`simultaneous`   share of the body's other joints that make an odd excursion at the same time
`pace`           the joint's fastest step in it, against its fast steps elsewhere
`kink`           the sharpest change of its pace in it, against the sharp ones elsewhere
`one_axis`       the share of it that is about one axis (no logarithm)
===============  =================================================================================
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.evidence.fault_shapes import Kind
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.joint_roles import BODY_ROLES
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import (
    EXCURSION_BASE,
    EXCURSION_FPS,
    EXCURSION_HALF_S,
    FLIP_DEG,
    LEAST_EXCURSION_DEG,
    LEAST_JUMP,
    LEAST_ODDNESS,
    SPREAD_FLOOR_DEG,
    SPREAD_QUANTILE,
    STEADY_SHARE,
)
from mocapdb.motion.quaternions import angles_deg, conjugate, multiply, rotation_vectors_deg, slerp

__all__ = ["EXCURSION_EVIDENCE", "find_excursions", "oddness_of"]

EXCURSION_EVIDENCE = (
    "oddness",
    "size",
    "against_usual",
    "length",
    "simultaneous",
    "pace",
    "kink",
    "one_axis",
)


def find_excursions(native: Texture) -> list[Hypothesis]:
    """Return the odd excursions of every joint, in frames of the clip.

    Parameters
    ----------
    native : Texture
        At the clip's own rate.
    """
    step = max(1, round(native.fps / EXCURSION_FPS))
    quats, fps = native.quat_xyzw[::step], native.fps / step
    halves = sorted({max(1, round(half * fps)) for half in EXCURSION_HALF_S})
    halves = [half for half in halves if 4 * half < len(quats)]
    if not halves:
        return []
    shape = (len(halves), *quats.shape[:2])
    odd, sizes, ratios = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for i, half in enumerate(halves):
        middle = slerp(quats[: -2 * half], quats[2 * half :], np.full((1, 1), 0.5))
        off = rotation_vectors_deg(multiply(conjugate(middle), quats[half:-half]))
        inside = slice(half, len(quats) - half)
        sizes[i, inside] = np.linalg.norm(off, axis=-1)
        usual = np.maximum(np.quantile(sizes[i, inside], SPREAD_QUANTILE, axis=0), SPREAD_FLOOR_DEG)
        ratios[i] = sizes[i] / usual
        odd[i, inside] = oddness_of(off, SPREAD_QUANTILE, SPREAD_FLOOR_DEG)
    odd[sizes < LEAST_EXCURSION_DEG] = 0.0
    body = np.array([role in BODY_ROLES for role in native.row_roles])
    crowd = odd.max(axis=0) > LEAST_ODDNESS
    paces = angles_deg(quats[:-1], quats[1:])
    fast = np.maximum(np.quantile(paces, SPREAD_QUANTILE, axis=0), SPREAD_FLOOR_DEG / fps)
    bends = np.zeros_like(paces)
    steps = rotation_vectors_deg(multiply(conjugate(quats[:-1]), quats[1:]))
    bends[1:] = np.linalg.norm(np.diff(steps, axis=0), axis=-1)
    sharp = np.maximum(np.quantile(bends, SPREAD_QUANTILE, axis=0), SPREAD_FLOOR_DEG / fps)
    found = []
    for row in np.flatnonzero(native.joints != native.root).tolist():  # the root moves the body
        left = odd[:, :, row].copy()
        others = body.copy()
        others[row] = False
        while True:
            peak = int(left.argmax())
            i, at = divmod(peak, left.shape[1])
            if left[i, at] < LEAST_ODDNESS:
                break
            half = halves[i]
            first, last, kind, size, one_axis = _extent(quats[:, row], at, half)
            left[:, max(0, at - half) : at + half + 1] = 0.0
            together = crowd[first:last][:, others].any(axis=0).mean() if others.any() else 0.0
            evidence = (
                math.log(odd[i, at, row]),
                math.log(size + LEAST_JUMP),
                math.log(ratios[i, at, row] + LEAST_JUMP),
                math.log((last - first) / fps),
                float(together),
                math.log(paces[max(0, first - 1) : last, row].max() / fast[row] + LEAST_JUMP),
                math.log(bends[max(0, first - 1) : last + 1, row].max() / sharp[row] + LEAST_JUMP),
                one_axis,
            )
            start = max(0, (first - 1) * step + 1 + step // 2)
            end = min(len(native), (last - 1) * step + 1 + step // 2)
            if end > start:
                halvings = max(1, round(math.log2(step)) + 1)
                found.append(Hypothesis(start, end, row, kind, evidence, "excursion", halvings))
    return found


def oddness_of(vectors_deg: FloatArray, quantile: float, floor_deg: float) -> FloatArray:
    """Return (F, K) Mahalanobis distances of vectors (F, K, 3) about 0.

    The spread is that of each joint's vectors up to a quantile of their sizes: what is left out is
    at most what faults may be. A floor keeps a joint that hardly moves from finding everything odd.
    """
    sizes = np.linalg.norm(vectors_deg, axis=-1)
    is_kept = sizes <= np.quantile(sizes, quantile, axis=0)
    by_joint = np.moveaxis(vectors_deg, 1, 0)  # (K, F, 3)
    kept = by_joint * is_kept.T[..., None]
    spreads = np.swapaxes(kept, 1, 2) @ kept / np.maximum(is_kept.sum(axis=0), 1)[:, None, None]
    inverse = np.linalg.inv(spreads + floor_deg**2 * np.eye(3))
    return np.asarray(np.sqrt(np.sum((by_joint @ inverse) * by_joint, axis=-1)).T)


def _extent(quats: FloatArray, at: int, half: int) -> tuple[int, int, Kind, float, float]:
    """Return an excursion's first and last frame, kind, size in degrees, and how flat it is."""
    low, high = at - half, at + half
    share = np.arange(2 * half + 1) / (2 * half)
    chord = slerp(quats[low][None], quats[high][None], share)
    turns = rotation_vectors_deg(multiply(conjugate(chord), quats[low : high + 1]))
    off = np.linalg.norm(turns, axis=1)
    inside = np.flatnonzero(off > EXCURSION_BASE * off.max())
    first, last = low + int(inside[0]), low + int(inside[-1]) + 1
    size = float(off.max())
    steady = float(np.median(off[inside])) > STEADY_SHARE * size
    kind: Kind = "flip" if size > FLIP_DEG else "offset" if steady else "drift"
    energy = np.linalg.eigvalsh(turns.T @ turns)
    return first, last, kind, size, float(energy[-1] / max(float(energy.sum()), 1e-12))
