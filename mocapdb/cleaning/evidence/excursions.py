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

__all__ = ["EXCURSION_EVIDENCE", "find_excursions", "spread_of"]

EXCURSION_EVIDENCE = ("oddness", "size", "against_usual", "length", "simultaneous", "pace")


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
        for row in range(quats.shape[1]):
            odd[i, inside, row] = np.sqrt(
                np.einsum("ij,jk,ik->i", off[:, row], spread_of(off[:, row]), off[:, row])
            )
    odd[sizes < LEAST_EXCURSION_DEG] = 0.0
    body = np.array([role in BODY_ROLES for role in native.row_roles])
    crowd = odd.max(axis=0) > LEAST_ODDNESS
    paces = angles_deg(quats[:-1], quats[1:])
    fast = np.maximum(np.quantile(paces, SPREAD_QUANTILE, axis=0), SPREAD_FLOOR_DEG / fps)
    found = []
    for row in range(quats.shape[1]):
        left = odd[:, :, row].copy()
        others = body.copy()
        others[row] = False
        while True:
            peak = int(left.argmax())
            i, at = divmod(peak, left.shape[1])
            if left[i, at] < LEAST_ODDNESS:
                break
            half = halves[i]
            first, last, kind, size = _extent(quats[:, row], at, half)
            left[:, max(0, at - half) : at + half + 1] = 0.0
            together = crowd[first:last][:, others].any(axis=0).mean() if others.any() else 0.0
            evidence = (
                math.log(odd[i, at, row]),
                math.log(size + LEAST_JUMP),
                math.log(ratios[i, at, row] + LEAST_JUMP),
                math.log((last - first) / fps),
                float(together),
                math.log(paces[max(0, first - 1) : last, row].max() / fast[row] + LEAST_JUMP),
            )
            start = max(0, (first - 1) * step + 1 + step // 2)
            end = min(len(native), (last - 1) * step + 1 + step // 2)
            if end > start:
                halvings = max(1, round(math.log2(step)) + 1)
                found.append(Hypothesis(start, end, row, kind, evidence, "excursion", halvings))
    return found


def spread_of(vectors_deg: FloatArray) -> FloatArray:
    """Return (3, 3) the inverse of the covariance of vectors about 0, the largest left out.

    What is left out is at most what faults may be; a floor keeps a joint that hardly moves from
    finding everything odd.
    """
    sizes = np.linalg.norm(vectors_deg, axis=1)
    kept = vectors_deg[sizes <= np.quantile(sizes, SPREAD_QUANTILE)]
    covariance = kept.T @ kept / max(len(kept), 1) + SPREAD_FLOOR_DEG**2 * np.eye(3)
    return np.asarray(np.linalg.inv(covariance))


def _extent(quats: FloatArray, at: int, half: int) -> tuple[int, int, Kind, float]:
    """Return where an excursion begins and ends, what it looks like, and its size in degrees."""
    low, high = at - half, at + half
    share = np.arange(2 * half + 1) / (2 * half)
    off = angles_deg(slerp(quats[low][None], quats[high][None], share), quats[low : high + 1])
    inside = np.flatnonzero(off > EXCURSION_BASE * off.max())
    first, last = low + int(inside[0]), low + int(inside[-1]) + 1
    size = float(off.max())
    steady = float(np.median(off[inside])) > STEADY_SHARE * size
    kind: Kind = "flip" if size > FLIP_DEG else "offset" if steady else "drift"
    return first, last, kind, size
