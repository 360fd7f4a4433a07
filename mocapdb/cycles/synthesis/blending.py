"""Between cycles: alignment of phase, weighted means, transitions.

Vejdemo-Johansson et al. (2015), section 4.5: a convex combination of cycles at equal phase. Here
rotations are averaged as matrices and made rotations again, on one body, and phases are aligned
first: at the worst phase the midpoint of two walks keeps only half of their amplitude.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.curve.closed_curves import best_phase_shift, interpolate_closed
from mocapdb.cycles.cycle import (
    Cycle,
    from_columns,
    joint_positions,
    to_columns,
    translation_channels,
    world_pose,
)
from mocapdb.cycles.synthesis.loop import damp_harmonics, jerk, root_relative_positions
from mocapdb.cycles.synthesis.other_bodies import on_body
from mocapdb.cycles.tuning import DAMPED_HARMONICS
from mocapdb.errors import CycleError
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_contacts
from mocapdb.motion.ik import planted
from mocapdb.motion.kinematics import channels_from_pose
from mocapdb.motion.rotations import elementary

__all__ = ["aligned", "blend", "transition"]

TOLERANCE = 1e-6  # of a sum of weights, which is one up to rounding


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
    """Return a clip that goes from one cycle over into another.

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
    clip = _transition(a, b, duration_s, lead_laps, fps, hold_feet)
    if most_jerk is None:
        return clip
    for cutoff in DAMPED_HARMONICS:
        if jerk(root_relative_positions(clip), fps, closed=False) <= most_jerk:
            break
        calm_a, calm_b = (damp_harmonics(cycle, cutoff) for cycle in (a, b))
        clip = _transition(calm_a, calm_b, duration_s, lead_laps, fps, hold_feet)
    return clip


def _transition(
    a: Cycle, b: Cycle, duration_s: float, lead_laps: float, fps: float, hold_feet: bool
) -> Clip:
    """Return the clip between two cycles of one body, their phases aligned."""
    skeleton = a.skeleton
    before, during, after = (
        round(seconds * fps)
        for seconds in (lead_laps * a.period_s, duration_s, lead_laps * b.period_s)
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
    positions = path - path[:1] + np.einsum("fij,fj->fi", facing, sway)
    translations = (a.translations + b.translations) / 2
    pose = world_pose(skeleton, local, positions, translations)
    if hold_feet:
        contacts = find_contacts(skeleton, pose.positions, fps)
        pose = planted(skeleton, pose, contacts, fps)
    channels = channels_from_pose(skeleton, pose)
    channels[:, translation_channels(skeleton)] = translations
    return Clip(
        skeleton,
        channels,
        fps,
        name=f"{a.name} to {b.name}",
        provenance=(f"transition from {a.name} to {b.name} in {duration_s:g} s",),
    )


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
