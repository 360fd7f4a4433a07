"""Straight lines: gaps that a program filled from one edge to the other.

A body never turns a joint by exactly the same angle from frame to frame. Where the angles of the
file, or the rotation itself, go on in a straight line for five frames or more, nothing was
captured. A joint that rests is none of these, nor one of a clip that is straight all over, as one
that was sampled up is. A clip from a library has lines that the codec drew: there nothing is
looked for. The evidence, in logarithms but for the last:

============  ====================================================================================
`frames`      how many frames it lasts
`contrast`    how far the joint usually is from a straight line, against what rounding explains
`turn`        how far the joint turns in it, in degrees
`kink`        how sharply its course bends at the ends, against the usual
`elsewhere`   share of the joint's frames outside of lines that are straight: by chance, or by
              a program that samples
============  ====================================================================================
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.cleaning.tuning import (
    LEAST_CONTRAST_OF_LINE,
    LEAST_JUMP,
    LEAST_LINE_TURN_DEG,
    LINE_FRAMES,
    MOST_STRAIGHT,
    ROUNDING_OF_LINE,
    TURN_OVER_ROUNDING,
)
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import ranges_where
from mocapdb.motion.quaternions import conjugate, multiply, rotation_vectors_deg

__all__ = ["LINE_EVIDENCE", "find_straight_lines"]

LINE_EVIDENCE = ("frames", "contrast", "turn", "kink", "elsewhere")
MOST_DECIMALS = 7  # more than any file has


def find_straight_lines(clip: Clip, native: Texture) -> list[Hypothesis]:
    """Return the stretches of joints that are filled by straight lines.

    Parameters
    ----------
    clip : Clip
    native : Texture
        Of the clip, at its own rate.
    """
    if len(clip) < LINE_FRAMES + 2 or clip.was_coded:
        return []
    rounding = ROUNDING_OF_LINE * _quantum(clip)
    quats = native.quat_xyzw
    steps = rotation_vectors_deg(multiply(conjugate(quats[:-1]), quats[1:]))
    on_sphere = np.linalg.norm(np.diff(steps, axis=0), axis=-1)
    pace = np.linalg.norm(steps, axis=-1)
    found = []
    for row, joint in enumerate(native.joints.tolist()):
        angles = clip.channels[:, clip.skeleton.rotation_columns(joint)]
        bends = np.abs(np.diff(angles, 2, axis=0)).max(axis=1)
        straight = (bends <= rounding) | (on_sphere[:, row] <= rounding)
        usual = float(np.median(bends[~straight])) if not straight.all() else 0.0
        moves = np.maximum(pace[:-1, row], pace[1:, row]) > rounding
        straight &= moves
        contrast = usual / rounding
        if contrast < LEAST_CONTRAST_OF_LINE or straight.mean() > MOST_STRAIGHT:
            continue
        runs = ranges_where(straight)
        lines = [run for run in runs if len(run) >= LINE_FRAMES]
        n_within = sum(len(run) for run in lines)
        elsewhere = (int(straight.sum()) - n_within) / max(len(straight) - n_within, 1)
        for run in lines:
            start, end = run.start + 1, run.end + 1
            turn = float(pace[start - 1 : end, row].sum())
            if turn < max(LEAST_LINE_TURN_DEG, TURN_OVER_ROUNDING * rounding):
                continue
            beside = [t for t in (run.start - 1, run.end) if 0 <= t < len(bends)]
            kink = max((float(on_sphere[t, row]) for t in beside), default=0.0)
            evidence = (
                math.log(len(run)),
                math.log(contrast),
                math.log(turn),
                math.log((kink + LEAST_JUMP) / (usual + LEAST_JUMP)),
                elsewhere,
            )
            found.append(Hypothesis(start, end, row, "filled", evidence, "straight line"))
    return found


def _quantum(clip: Clip) -> float:
    """Return the step between the numbers that the file can say, in degrees."""
    some = clip.channels[:: max(1, len(clip) // 50), clip.skeleton.rotation_channels]
    for decimals in range(MOST_DECIMALS):
        if _is_rounded(some, decimals):
            return float(10.0**-decimals)
    return float(10.0**-MOST_DECIMALS)


def _is_rounded(values: FloatArray, decimals: int) -> bool:
    scaled = values * 10.0**decimals
    return bool(np.abs(scaled - np.round(scaled)).max() < 1e-6 * 10.0**decimals / 10 + 1e-9)
