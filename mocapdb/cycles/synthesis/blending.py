"""Between cycles: alignment of phase, weighted means, transitions.

Vejdemo-Johansson et al. (2015), section 4.5: a convex combination of cycles at equal phase. Here
rotations are averaged as matrices and made rotations again, on one body, and phases are aligned
first: at the worst phase the midpoint of two walks keeps only half of their amplitude.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.curve.closed_curves import best_phase_shift, interpolate_closed
from mocapdb.cycles.cycle import (
    Cycle,
    RootMotion,
    from_columns,
    joint_positions,
    to_columns,
    translation_channels,
    world_pose,
)
from mocapdb.cycles.synthesis.loop import (
    Held,
    damp_harmonics,
    hold,
    jerk,
    root_relative_positions,
)
from mocapdb.cycles.synthesis.other_bodies import on_body
from mocapdb.cycles.tuning import DAMPED_HARMONICS, POP_TIMES
from mocapdb.errors import CycleError
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_contacts, foot_slide_mm
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.rotations import elementary

__all__ = [
    "Transition",
    "aligned",
    "blend",
    "loop_peaks",
    "make_transition",
    "peaks_over_parents",
    "transition",
]

TOLERANCE = 1e-6  # of a sum of weights, which is one up to rounding


class Transition(NamedTuple):
    """A clip that goes from one cycle over into another, and how well its feet stay.

    Attributes
    ----------
    clip : Clip
    slide_before_mm, slide_after_mm, pops, held_share
        See `loop.Loop`.
    path : (F, 3), skeleton units
        The advance of the root, without its sway: where a bone that carries the clip has to be.
    heading_rad : (F,) radians
    peaks : dict of str to float
        Joints that jerk more than in either cycle, and how many times; see `peaks_over_parents`.
    """

    clip: Clip
    slide_before_mm: float
    slide_after_mm: float
    pops: dict[str, float]
    path: FloatArray
    heading_rad: FloatArray
    held_share: float
    peaks: dict[str, float]


def aligned(cycles: Sequence[Cycle], *, body: int = 0) -> list[Cycle]:
    """Return the cycles on one body, the phases of all but the first moved to fit the first.

    Parameters
    ----------
    cycles : sequence of Cycle
        Of one skeleton, of skeletons of one kind, or of human bodies (see `other_bodies.on_body`).
    body : int
        Whose body: which of the cycles.

    Raises
    ------
    SkeletonError
        If a cycle cannot be brought on that body.
    CycleError
        If there is no cycle, or none of that number.
    """
    alike = _on_one_body(cycles, body)
    first = joint_positions(alike[0])
    return [
        alike[0],
        *(cycle.rephased(best_phase_shift(joint_positions(cycle), first)) for cycle in alike[1:]),
    ]


def blend(
    cycles: Sequence[Cycle], weights: Sequence[float], *, align: bool = True, body: int = 0
) -> Cycle:
    """Return the weighted mean of cycles.

    Parameters
    ----------
    cycles : sequence of Cycle
        See `aligned`.
    weights : sequence of float
        One for each cycle, none negative, which sum to one.
    align : bool
        Whether phases are aligned first.
    body : int
        Whose body the blend has: which of the cycles.

    Raises
    ------
    SkeletonError
        If a cycle cannot be brought on that body.
    CycleError
        If the weights do not fit, or there is no cycle of that number.
    """
    shares = _checked(weights, len(cycles))
    moved = aligned(cycles, body=body) if align else _on_one_body(cycles, body)
    first = moved[0]
    named = ", ".join(
        f"{share:g} {cycle.name}" for share, cycle in zip(shares, cycles, strict=True)
    )
    columns = np.tensordot(shares, np.stack([cycle.columns for cycle in moved]), axes=1)
    return replace(
        first,
        columns=to_columns(from_columns(columns)),
        sway=np.tensordot(shares, np.stack([cycle.sway for cycle in moved]), axes=1),
        advance=shares @ np.stack([cycle.advance for cycle in moved]),
        turn_rad=float(shares @ [cycle.turn_rad for cycle in moved]),
        translations=shares @ np.stack([cycle.translations for cycle in moved]),
        period_s=float(shares @ [cycle.period_s for cycle in moved]),
        label=first.label if all(cycle.label == first.label for cycle in cycles) else None,
        name=" + ".join(cycle.name for cycle in cycles),
        provenance=(*first.provenance, f"blend: {named}"),
    )


def loop_peaks(clip: Clip, path: FloatArray, heading_rad: FloatArray) -> FloatArray:
    """Return (J,) the peak acceleration of each joint of a lap that goes on into the next.

    Parameters
    ----------
    clip : Clip
        One lap, with its advance.
    path : (F, 3), skeleton units
        The steady advance.
    heading_rad : (F,) radians
        The steady turn.

    Returns
    -------
    (J,)
        In skeleton units a frame squared, beside the steady advance.
    """
    positions = forward_kinematics(clip.skeleton, clip.channels).positions - path[:, None]
    back = elementary(clip.skeleton.up_axis, -heading_rad)
    still = np.einsum("fij,fkj->fki", back, positions)
    return _peaks(np.concatenate([still[-1:], still, still[:1]]))


def peaks_over_parents(
    peaks: FloatArray, parents: Sequence[Cycle], rates: Sequence[float]
) -> dict[str, float]:
    """Return the joints whose peak acceleration is well over that in all of the parents.

    Parameters
    ----------
    peaks : (J,)
        Of what was made of the parents, in skeleton units a frame squared.
    parents : sequence of Cycle
        All on the body of what was made.
    rates : sequence of float, frames per second
        At which each parent is played.

    Returns
    -------
    dict of str to float
        How many times the parents' peak (see `POP_TIMES`), the worst first. Joints that hardly move
        in any of the parents are measured by half of what the median joint has.
    """
    own = []
    for cycle, rate in zip(parents, rates, strict=True):
        n_frames = max(2, round(cycle.period_s * rate))
        phase = np.arange(-1, n_frames + 1) / n_frames
        own.append(_peaks(cycle.pose(phase, "in-place").positions))
    most = np.max(own, axis=0)
    times = peaks / np.maximum(most, max(float(np.median(most)) / 2.0, 1e-300))
    names = parents[0].skeleton.names
    worst = np.argsort(-times, kind="stable")
    return {names[j]: float(times[j]) for j in worst if times[j] > POP_TIMES}


def transition(
    a: Cycle,
    b: Cycle,
    *,
    duration_s: float,
    lead_laps: float = 1.0,
    fps: float = 120.0,
    hold_feet: bool = True,
    body: int = 0,
    most_jerk: float | None = None,
) -> Clip:
    """Return a clip that goes from one cycle over into another; see `make_transition`."""
    return make_transition(
        a,
        b,
        duration_s=duration_s,
        lead_laps=lead_laps,
        fps=fps,
        hold_feet=hold_feet,
        body=body,
        most_jerk=most_jerk,
    ).clip


def make_transition(
    a: Cycle,
    b: Cycle,
    *,
    duration_s: float,
    lead_laps: float = 1.0,
    fps: float = 120.0,
    hold_feet: bool = True,
    body: int = 0,
    most_jerk: float | None = None,
    root: RootMotion = "advance",
) -> Transition:
    """Return a clip that goes from one cycle over into another, and how well its feet stay.

    Parameters
    ----------
    a, b : Cycle
        See `aligned`.
    duration_s : float, seconds
        How long the weight takes from 0 to 1, smoothly.
    lead_laps : float
        Laps of each cycle alone, before and after.
    fps : float, frames per second
    hold_feet : bool
        Whether feet are kept where they rest.
    body : int
        Whose body the clip has: 0 for that of `a`, 1 for that of `b`.
    most_jerk : float, optional
        Fine harmonics of both are damped until the clip's `jerk` is no more than this.
    root : {"advance", "in-place"}
        Whether the root travels.

    Raises
    ------
    SkeletonError, CycleError
        If the cycles do not fit, or a number is out of range.

    Notes
    -----
    Tempo and speed go over with the weight, so that neither phase nor root jumps.
    """
    if not (math.isfinite(duration_s) and duration_s > 0 and lead_laps >= 0 and fps > 0):
        raise CycleError(
            f"Expected a positive duration and frame rate and no negative laps, but got "
            f"{duration_s} s, {fps} Hz and {lead_laps} laps."
        )
    a, b = aligned([a, b], body=body)
    plan = _Plan(duration_s, lead_laps, fps, hold_feet, root)
    made = _transition(a, b, plan)
    if most_jerk is None:
        return made
    for cutoff in DAMPED_HARMONICS:
        if jerk(root_relative_positions(made.clip), fps, closed=False) <= most_jerk:
            break
        calm_a, calm_b = (damp_harmonics(cycle, cutoff) for cycle in (a, b))
        made = _transition(calm_a, calm_b, plan)
    return made


class _Plan(NamedTuple):
    """What is made of two cycles."""

    duration_s: float
    lead_laps: float
    fps: float
    hold_feet: bool
    root: RootMotion


def _transition(a: Cycle, b: Cycle, plan: _Plan) -> Transition:
    """Return the clip between two cycles of one body, their phases aligned."""
    skeleton, fps = a.skeleton, plan.fps
    before, during, after = (
        round(seconds * fps)
        for seconds in (
            plan.lead_laps * a.period_s,
            plan.duration_s,
            plan.lead_laps * b.period_s,
        )
    )
    ramp = (np.arange(during) + 0.5) / max(during, 1)
    weight = np.concatenate([np.zeros(before), ramp**2 * (3 - 2 * ramp), np.ones(after)])
    period = (1 - weight) * a.period_s + weight * b.period_s
    step = 1.0 / (period * fps)
    phase = np.cumsum(step) - step

    def mixed(of_a: FloatArray, of_b: FloatArray) -> FloatArray:
        share = weight.reshape(-1, *[1] * (of_a.ndim - 1))
        return (1 - share) * of_a + share * of_b

    columns = mixed(interpolate_closed(a.columns, phase), interpolate_closed(b.columns, phase))
    local = from_columns(columns)
    sway = mixed(interpolate_closed(a.sway, phase), interpolate_closed(b.sway, phase))
    frames = np.zeros((len(phase), 3))
    advance = mixed(frames + a.advance, frames + b.advance) * step[:, None]
    turn = ((1 - weight) * a.turn_rad + weight * b.turn_rad) * step
    heading = np.cumsum(turn) - turn
    facing = elementary(skeleton.up_axis, heading)
    path = np.cumsum(np.einsum("fij,fj->fi", facing, advance), axis=0)
    local[:, 0] = facing @ local[:, 0]
    path = path - path[:1]
    positions = path + np.einsum("fij,fj->fi", facing, sway)
    translations = (a.translations + b.translations) / 2
    pose = world_pose(skeleton, local, positions, translations)
    contacts = find_contacts(skeleton, pose.positions, fps)
    slide = foot_slide_mm(skeleton, pose.positions, contacts)
    held, whole = Held(pose, slide, {}, 1.0), slice(None)
    if plan.hold_feet and contacts.any():
        middle = replace(a, translations=translations)
        held = hold(middle, pose, contacts, fps, whole, whole)
    pose = held.pose
    world = pose.positions
    if plan.root == "in-place":
        back = np.swapaxes(facing, 1, 2)
        around = np.einsum("fij,fkj->fki", back, pose.positions - path[:, None])
        pose = Pose(around, back[:, None] @ pose.rotations)
    channels = channels_from_pose(skeleton, pose)
    channels[:, translation_channels(skeleton)] = translations
    clip = Clip(
        skeleton,
        channels,
        fps,
        name=f"{a.name} to {b.name}",
        provenance=(f"transition from {a.name} to {b.name} in {plan.duration_s:g} s",),
    )
    peaks = peaks_over_parents(_peaks(world), (a, b), (fps, fps))
    return Transition(clip, slide, held.slide_mm, held.pops, path, heading, held.share, peaks)


def _peaks(positions: FloatArray) -> FloatArray:
    """Return (J,) the largest second difference of each joint's positions (F, J, 3)."""
    bends = np.linalg.norm(np.diff(positions, n=2, axis=0), axis=2)
    return np.asarray(bends.max(axis=0, initial=0.0))


def _on_one_body(cycles: Sequence[Cycle], body: int) -> list[Cycle]:
    if not 0 <= body < len(cycles):
        raise CycleError(f"Expected the body of one of {len(cycles)} cycles, but got {body}.")
    return [on_body(cycle, cycles[body]) for cycle in cycles]


def _checked(weights: Sequence[float], n_cycles: int) -> FloatArray:
    shares = np.asarray(weights, dtype=np.float64)
    if n_cycles == 0:
        raise CycleError("Expected cycles, but got none.")
    if shares.shape != (n_cycles,):
        raise CycleError(f"Expected {n_cycles} weights, but got {shares.size}.")
    if not np.isfinite(shares).all() or shares.min() < 0 or abs(shares.sum() - 1.0) > TOLERANCE:
        raise CycleError(
            f"Expected weights of 0 or more that sum to one, but got "
            f"{', '.join(f'{share:g}' for share in shares)}, which sum to {shares.sum():g}."
        )
    return shares
