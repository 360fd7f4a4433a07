"""Jitter: a joint that trembles for a while as it does not elsewhere.

Jitter that was smoothed has no edges from one frame to the next. What is left when the slow part of
a joint's motion is taken away, and the noise of single frames, is its *tremble*. It is measured in
its own spread over the clip (Mahalanobis distance), so that a knee that trembles to the side is
odder than one that bends quickly. The evidence, in logarithms but for three:

===============  =================================================================================
`contrast`       how many times the usual the joint trembles at most
`size`           how far, in degrees (root mean square)
`length`         in seconds
`turns`          how often it changes its direction, a second
`simultaneous`   share of the body's other joints that tremble at the same time (no logarithm)
`one_way`        the share of its tremble that is about one axis: of smoothed noise a third or more
                 (no logarithm)
`agitation`      how far it trembles for the pace at which it moves, against the usual
`unrest`         how much the others tremble at the same time, in the median
===============  =================================================================================
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.evidence.excursions import oddness_of
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.joint_roles import BODY_ROLES
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import (
    JITTER_BASE,
    JITTER_FINE_S,
    JITTER_FPS,
    JITTER_SMOOTHING_S,
    JITTER_WINDOW_S,
    LEAST_ANGLE_DEG,
    LEAST_CONTRAST,
    LEAST_JITTER_S,
    LEAST_REST,
    LEAST_TREMBLE_DEG,
    USUAL_QUANTILE,
)
from mocapdb.motion.frame_range import ranges_where
from mocapdb.motion.quaternions import conjugate, multiply, rotation_vectors_deg

__all__ = ["JITTER_EVIDENCE", "find_jitter"]

JITTER_EVIDENCE = (
    "contrast",
    "size",
    "length",
    "turns",
    "simultaneous",
    "one_way",
    "agitation",
    "unrest",
)


def find_jitter(native: Texture) -> list[Hypothesis]:
    """Return the stretches in which joints tremble, in frames of the clip at its own rate."""
    step = max(1, round(native.fps / JITTER_FPS))
    quats, fps = native.quat_xyzw[::step], native.fps / step
    window = max(3, round(JITTER_WINDOW_S * fps))
    if len(quats) < 2 * window:
        return []
    smooth = _smoothed(quats, JITTER_SMOOTHING_S * fps)
    tremble = rotation_vectors_deg(
        multiply(conjugate(smooth), _smoothed(quats, JITTER_FINE_S * fps))
    )
    odd = oddness_of(tremble, USUAL_QUANTILE, LEAST_TREMBLE_DEG / math.sqrt(3.0))
    contrast = np.sqrt(_over_windows(odd**2, window) / 3.0)
    contrast /= np.maximum(np.quantile(contrast, USUAL_QUANTILE, axis=0), 1.0)
    sizes = np.sqrt(_over_windows(np.sum(tremble**2, axis=-1), window))
    paces = np.gradient(smooth, axis=0)
    paces = 2.0 * np.rad2deg(np.sqrt(_over_windows(np.sum(paces**2, axis=-1), window))) * fps
    agitation = np.log((sizes + LEAST_ANGLE_DEG) / (paces * JITTER_SMOOTHING_S + LEAST_TREMBLE_DEG))
    agitation -= np.median(agitation, axis=0)
    body = np.array([role in BODY_ROLES for role in native.row_roles])
    found = []
    for row in range(quats.shape[1]):
        others = body.copy()
        others[row] = False
        for run in ranges_where(contrast[:, row] > LEAST_CONTRAST):
            peak = float(contrast[run.frames, row].max())
            strong = np.flatnonzero(contrast[run.frames, row] > JITTER_BASE * peak)
            first = run.start + int(strong[0])
            last = run.start + int(strong[-1]) + 1
            # the window reaches beyond the tremble by half of itself
            shrink = min(window // 2, (last - first - 1) // 2)
            first += shrink if first > 0 else 0
            last -= shrink if last < len(quats) else 0
            if last - first < LEAST_JITTER_S * fps:  # a single jump
                continue
            inside = tremble[first:last, row]
            moments = np.linalg.eigh(inside.T @ inside)
            along = inside @ moments[1][:, -1]
            turns = int((np.diff(np.sign(np.diff(along))) != 0).sum()) if len(along) > 2 else 0
            together = (contrast[first:last][:, others].max(axis=0) > LEAST_CONTRAST).mean()
            evidence = (
                math.log(peak),
                math.log(float(sizes[run.frames, row].max())),
                math.log((last - first) / fps),
                math.log1p(turns * fps / (last - first)),
                float(together) if others.any() else 0.0,
                float(moments[0][-1] / max(moments[0].sum(), 1e-12)),
                float(agitation[first:last, row].mean()),
                math.log(float(np.median(contrast[first:last][:, others])) + LEAST_REST)
                if others.any()
                else 0.0,
            )
            halvings = max(1, round(math.log2(step)))
            found.append(
                Hypothesis(
                    first * step, min(len(native), last * step), row, "noise", evidence, "jitter",
                    halvings,
                )
            )  # fmt: skip
    return found


def _smoothed(quats: FloatArray, sigma: float) -> FloatArray:
    """Return rotations (F, K, 4) smoothed over time."""
    from scipy.ndimage import gaussian_filter1d

    smooth = gaussian_filter1d(quats, sigma, axis=0, mode="nearest")
    return np.asarray(smooth / np.linalg.norm(smooth, axis=-1, keepdims=True))


def _over_windows(values: FloatArray, window: int) -> FloatArray:
    """Return the mean over a window around each frame, of values that are not negative."""
    from scipy.ndimage import uniform_filter1d

    mean = uniform_filter1d(values, window, axis=0, mode="nearest")
    return np.asarray(np.maximum(mean, 0.0))  # the filter's running sum may fall below 0
