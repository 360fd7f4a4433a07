"""A clip that is one lap already, such as a loop read back from a file, as a cycle."""

from __future__ import annotations

import numpy as np

from mocapdb.cycles.cycle import N_SAMPLES, Cycle, local_rotations, shift_values, to_columns
from mocapdb.cycles.harmonics import HarmonicRegression
from mocapdb.cycles.loop import seam_steps
from mocapdb.cycles.loops import trigonometric
from mocapdb.errors import NoPeriodError
from mocapdb.motion.clip import Clip
from mocapdb.motion.heading import heading_angles
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.rotations import elementary

__all__ = ["cycle_of_loop"]

WIDEST_SEAM = 3.0
PATH_HARMONICS = 8


def cycle_of_loop(clip: Clip) -> Cycle:
    """Return the cycle of a clip that is one whole lap: its last frame goes over into its first.

    Raises
    ------
    NoPeriodError
        If the step from the last frame to the first is over three times the usual one.
    """
    skeleton = clip.skeleton
    gap = seam_steps(clip) if len(clip) > 2 else np.inf
    if not gap < WIDEST_SEAM:
        raise NoPeriodError(
            f"Expected {clip.name or 'the clip'!r} to repeat or to be one closed lap, but its ends "
            f"are {gap:.1f} steps apart. Extract its cycle from a longer clip."
        )
    phase = np.arange(len(clip)) / len(clip)
    pose = forward_kinematics(skeleton, clip.channels)
    heading = heading_angles(pose.rotations[:, 0], skeleton.up_index)
    slope = np.polyfit(phase, heading, 1)[0] if len(clip) > 2 else 0.0
    turn = float(slope) if abs(slope) > 0.1 else 0.0
    facing = heading.mean() - turn * phase.mean()
    back = elementary(skeleton.up_axis, -facing - turn * phase)
    local = local_rotations(skeleton, clip.channels)
    local[:, 0] = back @ local[:, 0]
    steps = np.einsum("fij,fj->fi", back[:-1], np.diff(pose.positions[:, 0], axis=0))
    path = np.vstack([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    n_harmonics = max(0, min(PATH_HARMONICS, (len(clip) - 2) // 3))
    curve = HarmonicRegression(n_harmonics, model="m2", linear=True).fit(phase, path)
    advance = curve.coefficients_[-1].copy()
    even = np.arange(N_SAMPLES) / N_SAMPLES
    sway = curve.predict(even) - even[:, None] * advance
    up = skeleton.up_index
    level = [axis for axis in range(3) if axis != up]
    sway[:, level] -= sway[:, level].mean(axis=0)
    sway[:, up] += pose.positions[:, 0, up].mean() - sway[:, up].mean()
    return Cycle(
        skeleton=skeleton,
        columns=trigonometric(to_columns(local), even),
        sway=sway,
        advance=advance,
        turn_rad=turn,
        shifts=shift_values(clip),
        period_s=clip.duration_s,
        name=clip.name,
        label=clip.label,
        provenance=clip.provenance,
    )
