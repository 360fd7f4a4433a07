"""Between cycles: alignment of phase, weighted means, transitions.

Vejdemo-Johansson et al. (2015), section 4.5: a convex combination of cycles at equal phase. Here
rotations are averaged as matrices and made rotations again, and phases are aligned first: at the
worst phase the midpoint of two walks keeps only half of their amplitude.
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
from mocapdb.errors import CycleError, SkeletonError
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_contacts
from mocapdb.motion.ik import planted
from mocapdb.motion.kinematics import channels_from_pose
from mocapdb.motion.rotations import elementary

__all__ = ["aligned", "blend", "transition"]

TOLERANCE = 1e-6  # of a sum of weights, which is one up to rounding


def aligned(cycles: Sequence[Cycle]) -> list[Cycle]:
    """Return the cycles with the phases of all but the first moved to fit the first.

    Raises
    ------
    SkeletonError
        If the skeletons differ.
    CycleError
        If there is no cycle.
    """
    _expect_one_skeleton(cycles)
    first = joint_positions(cycles[0])
    return [
        cycles[0],
        *(cycle.rephased(best_phase_shift(joint_positions(cycle), first)) for cycle in cycles[1:]),
    ]


def blend(cycles: Sequence[Cycle], weights: Sequence[float], *, align: bool = True) -> Cycle:
    """Return the weighted mean of cycles.

    Parameters
    ----------
    cycles : sequence of Cycle
        Of one skeleton.
    weights : sequence of float
        One for each cycle, none negative, which sum to one.
    align : bool
        Whether phases are aligned first.

    Raises
    ------
    SkeletonError
        If the skeletons differ.
    CycleError
        If the weights do not fit.
    """
    _expect_one_skeleton(cycles)
    shares = _checked(weights, len(cycles))
    moved = aligned(cycles) if align else list(cycles)
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
) -> Clip:
    """Return a clip that goes from one cycle over into another.

    Parameters
    ----------
    a, b : Cycle
        Of one skeleton.
    duration_s : float, seconds
        How long the weight takes from 0 to 1, smoothly.
    lead_laps : float
        Laps of each cycle alone, before and after.
    fps : float, frames per second
    hold_feet : bool
        Whether feet are kept where they rest.

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
    a, b = aligned([a, b])
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


def _expect_one_skeleton(cycles: Sequence[Cycle]) -> None:
    if not cycles:
        raise CycleError("Expected cycles, but got none.")
    for cycle in cycles[1:]:
        if cycle.skeleton != cycles[0].skeleton:
            raise SkeletonError(
                f"Expected cycles of one skeleton, but {cycles[0].name!r} has "
                f"{cycles[0].skeleton.name!r} and {cycle.name!r} has {cycle.skeleton.name!r}. "
                "Take cycles of one subject, or a class's cycle."
            )


def _checked(weights: Sequence[float], n_cycles: int) -> FloatArray:
    shares = np.asarray(weights, dtype=np.float64)
    if shares.shape != (n_cycles,):
        raise CycleError(f"Expected {n_cycles} weights, but got {shares.size}.")
    if not np.isfinite(shares).all() or shares.min() < 0 or abs(shares.sum() - 1.0) > TOLERANCE:
        raise CycleError(
            f"Expected weights of 0 or more that sum to one, but got "
            f"{', '.join(f'{share:g}' for share in shares)}, which sum to {shares.sum():g}."
        )
    return shares
