"""Curves made cycles: poses of known phase are fitted, and the root's path is split.

`fit_curve`       the harmonics of a motion whose phase is known
`close_curve`     that curve as a cycle
`cycle_of_loop`   a clip that is one lap already, such as a loop read back from a file
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.curve.closed_curves import interpolate_closed
from mocapdb.cycles.curve.harmonics import STENCIL_REACH, HarmonicRegression, finite_differences
from mocapdb.cycles.curve.lap_noise import lap_smoothing
from mocapdb.cycles.curve.rotation_values import local_rotations
from mocapdb.cycles.curve.unroll_path import UnrolledClip
from mocapdb.cycles.cycle import Cycle, mean_translations, to_columns
from mocapdb.cycles.phase.timing import Timing
from mocapdb.cycles.synthesis.loop import seam_steps
from mocapdb.cycles.tuning import (
    CLOSING_STEP,
    LEAST_CLIMB,
    LEAST_TRAVEL,
    LEAST_TURN_RAD,
    N_SAMPLES,
    PATH_HARMONICS,
    SLOWEST_TEMPO,
    WIDEST_SEAM,
)
from mocapdb.errors import CycleError, NoPeriodError
from mocapdb.motion.body import part_from_scene
from mocapdb.motion.clip import Clip
from mocapdb.motion.heading import heading_angles
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.rotations import elementary
from mocapdb.motion.skeleton import Skeleton

__all__ = ["PeriodicCurve", "RootFit", "close_curve", "cycle_of_loop", "fit_curve"]


class PeriodicCurve(Protocol):
    """A closed curve of the phase."""

    def predict(self, phase: FloatArray) -> FloatArray:
        """Return the curve at phases (F,) in laps, as (F, D)."""


@dataclass(frozen=True)
class RootFit:
    """How the root's translation is fitted (Raunio 2014, section 3.9, and his plugin's options).

    Attributes
    ----------
    n_harmonics : int, optional
        K of the translation; that of the rotations by default.
    axes : str
        The axes of the file along which the root moves, seen from its heading: some of ``"xyz"``.
        Along the others it stays.
    linear : str
        Those along which it may advance: eq. 3.27 has a linear term, eq. 3.6 has none.

    Raises
    ------
    CycleError
        If one of them is out of range.
    """

    n_harmonics: int | None = None
    axes: str = "xyz"
    linear: str = "xyz"

    def __post_init__(self) -> None:
        if self.n_harmonics is not None and self.n_harmonics < 1:
            raise CycleError(
                f"Expected 1 harmonic of the root at least, but got {self.n_harmonics}."
            )
        for name, letters in (("axes", self.axes), ("linear", self.linear)):
            if not set(letters) <= set("xyz"):
                raise CycleError(
                    f"Expected {name} of the root out of the letters xyz, but got {letters!r}."
                )


def fit_curve(
    values: FloatArray,
    timing: Timing,
    like: HarmonicRegression,
    *,
    linear: bool = False,
    smooth: bool = False,
) -> HarmonicRegression:
    """Fit harmonics of the phase to the frames (F, D) that have derivatives, all but four each end.

    Parameters
    ----------
    values : (F, D)
    timing : Timing
    like : HarmonicRegression
        The model, its ridge, and how many harmonics at most.
    linear : bool
        Whether a term linear in the phase is added, for translations.
    smooth : bool
        Whether each channel is smoothed as much as its laps differ (see `lap_smoothing`); for the
        model m2.
    """
    fitted = slice(STENCIL_REACH, len(values) - STENCIL_REACH)
    n_fitted = len(values) - 2 * STENCIL_REACH
    most = max(1, min(int(timing.period_frames) // 2 - 1, (n_fitted - 2) // 2))
    regression = HarmonicRegression(
        min(like.n_harmonics, most),
        model=like.model,
        linear=linear,
        ridge=like.ridge,
        use_velocities=like.use_velocities,
        use_accelerations=like.use_accelerations,
    )
    if like.model == "m2":
        phase, poses = timing.phase[fitted], values[fitted]
        if not smooth:
            return regression.fit(phase, poses)
        steady = np.zeros(values.shape[1])
        if linear:  # laps differ beside how far each goes
            steady = copy(regression).fit(phase, poses).coefficients_[-1]
        beside = poses - phase[:, None] * steady
        smoothing = lap_smoothing(phase, beside, timing.period_frames)
        return regression.fit(phase, poses, smoothing=smoothing)
    velocities, accelerations = finite_differences(values, 1.0 / timing.period_frames)
    if timing.name == "drift":  # the derivatives are by phase, and a lap's tempo is its own
        pace = np.maximum(np.gradient(timing.phase) * timing.period_frames, SLOWEST_TEMPO)[:, None]
        velocities, accelerations = velocities / pace, accelerations / pace**2
    return regression.fit(
        timing.phase[fitted], values[fitted], velocities[fitted], accelerations[fitted]
    )


def close_curve(
    unrolled: UnrolledClip,
    decode: Callable[[FloatArray], FloatArray],
    curve: PeriodicCurve,
    timing: Timing,
    like: HarmonicRegression,
    root: RootFit | None = None,
    *,
    smooth: bool = False,
) -> Cycle:
    """Return a curve as a cycle.

    Parameters
    ----------
    unrolled : UnrolledClip
        The clip that was fitted.
    decode : callable
        From values (F, D) to rotations (F, J, 3, 3) relative to the parents.
    curve : PeriodicCurve
        Of the values.
    timing : Timing
    like : HarmonicRegression
        How the root's path is fitted.
    root : RootFit, optional
        What else is wanted of the root's path.
    smooth : bool
        Whether the root's path is smoothed as much as its laps differ, as poses are: where only
        one lap has a phase and two have the next, the path would else jump from one lap to their
        mean.

    Notes
    -----
    The root's path is a harmonic regression with a linear term (Raunio 2014, eq. 3.27).
    """
    root = root or RootFit()
    clip, skeleton = unrolled.clip, unrolled.clip.skeleton
    rotations = decode(curve.predict(np.arange(N_SAMPLES) / N_SAMPLES))
    back = elementary(skeleton.up_axis, np.array(-unrolled.heading_rad))
    rotations[:, 0] = back @ rotations[:, 0]
    path = forward_kinematics(skeleton, clip.channels).positions[:, 0] @ back.T
    if root.n_harmonics is not None:
        like = copy(like)
        like.n_harmonics = root.n_harmonics
    height = path[:, skeleton.up_index]
    sway, advance = _split_root_path(
        skeleton, fit_curve(path, timing, like, linear=True, smooth=smooth), height
    )
    periodic, _ = _split_root_path(skeleton, fit_curve(path, timing, like, smooth=smooth), height)
    for axis, letter in enumerate("xyz"):
        if letter not in root.axes:
            sway[:, axis] = sway[:, axis].mean()
        elif letter not in root.linear:
            sway[:, axis] = periodic[:, axis]
        if letter not in root.axes or letter not in root.linear:
            advance[axis] = 0.0
    level = [axis for axis in range(3) if axis != skeleton.up_index]
    if np.linalg.norm(advance[level]) < LEAST_TRAVEL * skeleton.height:
        advance[level] = 0.0
    if abs(advance[skeleton.up_index]) < LEAST_CLIMB * skeleton.height:
        advance[skeleton.up_index] = 0.0
    return Cycle(
        skeleton=skeleton,
        columns=to_columns(rotations),
        sway=sway,
        advance=advance,
        turn_rad=unrolled.turn_rad,
        translations=mean_translations(clip),
        period_s=timing.period_frames / clip.fps,
        name=clip.name,
        label=clip.label,
        provenance=(*clip.provenance, f"cycle of {timing.period_frames:.2f} frames"),
    )


def cycle_of_loop(clip: Clip) -> Cycle:
    """Return the cycle of a clip that is one whole lap: its last frame goes over into its first.

    It is the body's, parted from its scene, as cycles that are found are. A last frame that is
    the first again, as ``mocapdb cycle --closed`` adds it, is left out.

    Raises
    ------
    NoPeriodError
        If nothing moves, or the step from the last frame to the first is over three times the
        median one.
    """
    clip, _ = part_from_scene(clip)
    skeleton = clip.skeleton
    if len(clip) > 1 and not np.diff(clip.channels, axis=0).any():
        raise NoPeriodError(
            f"Expected a motion that repeats, but {clip.name or 'the clip'!r} is one pose in all "
            f"of its {len(clip)} frames."
        )
    gap = seam_steps(clip) if len(clip) > 2 else np.inf
    if gap < CLOSING_STEP:
        clip = clip[:-1]
    if not gap < WIDEST_SEAM:
        raise NoPeriodError(
            f"Expected {clip.name or 'the clip'!r} to repeat or to be one closed lap, but its ends "
            f"are {gap:.1f} steps apart. Extract its cycle from a longer clip."
        )
    phase = np.arange(len(clip)) / len(clip)
    pose = forward_kinematics(skeleton, clip.channels)
    heading = heading_angles(pose.rotations[:, 0], skeleton.up_index)
    slope = float(np.polyfit(phase, heading, 1)[0])
    turn = slope if abs(slope) > LEAST_TURN_RAD else 0.0
    back = elementary(skeleton.up_axis, -heading.mean() - turn * (phase - phase.mean()))
    local = local_rotations(skeleton, clip.channels)
    local[:, 0] = back @ local[:, 0]
    steps = np.einsum("fij,fj->fi", back[:-1], np.diff(pose.positions[:, 0], axis=0))
    path = np.vstack([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    n_harmonics = max(0, min(PATH_HARMONICS, (len(clip) - 2) // 3))
    curve = HarmonicRegression(n_harmonics, model="m2", linear=True).fit(phase, path)
    sway, advance = _split_root_path(skeleton, curve, pose.positions[:, 0, skeleton.up_index])
    return Cycle(
        skeleton=skeleton,
        columns=interpolate_closed(to_columns(local), np.arange(N_SAMPLES) / N_SAMPLES),
        sway=sway,
        advance=advance,
        turn_rad=turn,
        translations=mean_translations(clip),
        period_s=clip.duration_s,
        name=clip.name,
        label=clip.label,
        provenance=clip.provenance,
    )


def _split_root_path(
    skeleton: Skeleton, path: HarmonicRegression, height: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the sway (S, 3) about the level middle of the root's path, and its advance (3,).

    `height` is the root's, whose mean the sway keeps.
    """
    phase = np.arange(N_SAMPLES) / N_SAMPLES
    advance = path.coefficients_[-1].copy() if path.linear else np.zeros(3)
    sway = path.predict(phase) - phase[:, None] * advance
    sway -= sway.mean(axis=0)
    sway[:, skeleton.up_index] += height.mean()
    return sway, advance
