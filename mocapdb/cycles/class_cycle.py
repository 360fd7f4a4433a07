"""The cycle of a class: cycles of many clips and bodies, aligned and averaged robustly."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.curve.closed_curves import best_phase_shift, interpolate_closed, shift_phase
from mocapdb.cycles.curve.rotation_values import rotation_angles
from mocapdb.cycles.cycle import Cycle, from_columns, to_columns
from mocapdb.cycles.synthesis.other_bodies import on_body
from mocapdb.cycles.tuning import (
    ALIGNMENT_ROUNDS,
    LEAST_VARIETY,
    MIRROR_GAIN,
    MOST_UNLIKE,
    OUTLIER_DISTANCE,
)
from mocapdb.errors import CycleError, NoPeriodError, SkeletonError
from mocapdb.motion.body.joint_names import across_by_names
from mocapdb.motion.skeleton import Skeleton

__all__ = ["ClassCycle", "MirrorMembers", "average_cycles", "joint_weights", "mirror_rotations"]

MirrorMembers: TypeAlias = Literal["never", "auto"]

LEAST_DISTANCE = 1e-6  # keeps weights finite where members are equal up to rounding


@dataclass(frozen=True)
class ClassCycle:
    """The canonical cycle of a class, as `average_cycles` makes it.

    Attributes
    ----------
    cycle : Cycle
        On the body among the members' whose height is nearest to the mean.
    spread_rad : (S, J)
        Standard deviation of each joint's rotation at each phase over the members, in radians.
    members : tuple of str
        Names of the clips that were averaged.
    mirrored : tuple of str
        Those of them that were mirrored first.
    left_out : dict of str to str
        The others and why.
    """

    cycle: Cycle
    spread_rad: FloatArray
    members: tuple[str, ...]
    mirrored: tuple[str, ...] = ()
    left_out: dict[str, str] | None = None


def average_cycles(
    cycles: Sequence[Cycle],
    name: str,
    *,
    mirror_members: MirrorMembers = "never",
    people: Sequence[str] | None = None,
) -> ClassCycle:
    """Return the robust mean of cycles, aligned by phase and facing.

    Parameters
    ----------
    cycles : sequence of Cycle
        Those of the most frequent kind of body (the same joints with the same parents) stay as
        they are; others are brought on one of these bodies where they are human (`on_body`), and
        left out where not.
    name : str
        Of the class.
    mirror_members : {"never", "auto"}
        Whether a cycle that is far nearer to the others when left and right are exchanged is
        mirrored first. Good for motions of one hand or foot; it hides what is asymmetric.
    people : sequence of str, optional
        Who performs each cycle; where that is empty, cycles of one skeleton are one person's.

    Raises
    ------
    CycleError
        If there is no cycle.
    NoPeriodError
        If the cycles have nothing in common.

    Notes
    -----
    Cycles face along the rest pose already. Each is moved in phase to fit first the cycle nearest
    to all others and then the mean. The mean gives each cycle the weight
    ``1 / max(distance, median distance)``, and none to those over twice as far as the median, in
    which each person counts once, however many takes there are, or as different people are who do
    the same. In a distance each joint weighs what it moves: see
    `joint_weights`. Advance in metres and tempo are plain means over those that are kept, so that
    stride and cadence are their means; the sway is scaled by height. Cycles have nothing in common
    whose movements, postures left aside, are nearly as far from the mean's as they are large.
    """
    if not cycles:
        raise CycleError(f"Expected cycles of the class {name!r}, but got none.")
    kinds = Counter(_kind(cycle.skeleton) for cycle in cycles)
    kind = kinds.most_common(1)[0][0]
    example = _mean_body([cycle for cycle in cycles if _kind(cycle.skeleton) == kind])
    body = example.skeleton
    alike, shares, left_out = [], [], {}
    for cycle, share in zip(cycles, _shares_of_people(cycles, people), strict=True):
        try:
            alike.append(cycle if _kind(cycle.skeleton) == kind else _moved(cycle, example))
        except SkeletonError as problem:
            left_out[cycle.name] = f"another kind of skeleton: {problem}"
        else:
            shares.append(share)
    grid = np.arange(len(alike[0].sway)) / len(alike[0].sway)
    curves = np.stack([interpolate_closed(cycle.columns, grid) for cycle in alike])
    joints = joint_weights(body)
    reference = curves[_medoid(curves * np.sqrt(joints)[:, None])]
    for _ in range(ALIGNMENT_ROUNDS):
        fits = [_align(columns, reference, joints) for columns in curves]
        if mirror_members == "auto":
            images = [
                _align(mirror_rotations(columns, body), reference, joints) for columns in curves
            ]
            fits = [
                image._replace(is_mirrored=True)
                if image.distance < MIRROR_GAIN * fit.distance
                else fit
                for fit, image in zip(fits, images, strict=True)
            ]
        aligned = np.stack([fit.columns for fit in fits])
        shifts = np.array([fit.shift for fit in fits])
        flipped = np.array([fit.is_mirrored for fit in fits])
        distance = np.array([fit.distance for fit in fits])
        usual = max(_median(distance, np.array(shares)), LEAST_DISTANCE)
        variety = LEAST_VARIETY * float(_amplitude(reference, joints))
        limit = OUTLIER_DISTANCE * max(usual, variety)
        outlying = distance > limit
        weights = np.where(outlying, 0.0, 1.0 / np.maximum(distance, usual))
        weights /= weights.sum()
        reference = to_columns(from_columns(np.tensordot(weights, aligned, axes=1)))
    kept = weights > 0
    _expect_something_in_common(aligned[kept], reference, joints, name)
    for cycle, is_kept, away in zip(alike, kept, distance, strict=True):
        if not is_kept:
            left_out[cycle.name] = (
                f"too far from the others: {away / usual:.2f} times as far from their mean as the "
                f"median person, over {limit / usual:.2f}"
            )
    inside = [cycle for cycle, is_kept in zip(alike, kept, strict=True) if is_kept]
    sway, advance = _root(inside, shifts[kept], flipped[kept], body)
    cycle = replace(
        inside[0],
        skeleton=body,
        columns=reference,
        sway=sway,
        advance=advance,
        turn_rad=0.0,
        period_s=1.0 / float(np.mean([1.0 / cycle.period_s for cycle in inside])),
        name=name,
        label=name,
        provenance=(f"mean of {len(inside)} cycles of class {name}",),
    )
    return ClassCycle(
        cycle=cycle,
        spread_rad=_spread(aligned[kept], reference, weights[kept]),
        members=tuple(cycle.name for cycle in inside),
        mirrored=tuple(c.name for c, m, k in zip(alike, flipped, kept, strict=True) if m and k),
        left_out=left_out,
    )


def mirror_rotations(columns: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Return rotations (S, J, 6) mirrored along the x axis, left and right joints swapped.

    Joints are paired by their names: ``lfemur`` with ``rfemur``, ``Foot_L`` with ``Foot_R``.
    """
    swap = across_by_names(skeleton.names)
    flip = np.array([-1.0, 1.0, 1.0])
    turned = flip[:, None] * from_columns(columns[:, swap]) * flip
    return to_columns(turned)


def joint_weights(skeleton: Skeleton) -> FloatArray:
    """Return how much of the body each joint moves, as shares of one.

    Bones are taken as rods of one density. A joint's weight is the moment of inertia, about it and
    in the rest pose, of all bones that it carries. A hip weighs a thousand times as much as a
    thumb, which says little about a walk.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    (J,)

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> body = synthetic.subject(0)
    >>> weights = joint_weights(body)
    >>> bool(weights[body.joint("lfemur")] > 100 * weights[body.joint("lthumb")])
    True
    """
    ends = skeleton.rest_positions
    parents = np.maximum(skeleton.parents, 0)
    centres = ends[parents] if skeleton.convention == "acclaim" else ends  # what each turns about
    inertia = np.zeros(skeleton.n_joints)
    for bone, carrier in zip(skeleton.bone_joints, skeleton.bone_carriers, strict=True):
        length = np.linalg.norm(ends[bone] - ends[parents[bone]])
        for joint in skeleton.chain_to_root(int(carrier)):
            start, end = ends[parents[bone]] - centres[joint], ends[bone] - centres[joint]
            inertia[joint] += length * (start @ start + start @ end + end @ end) / 3.0
    return inertia / max(float(inertia.sum()), np.finfo(float).tiny)


def _shares_of_people(cycles: Sequence[Cycle], people: Sequence[str] | None) -> list[float]:
    """Return what each cycle counts where every person counts once."""
    names = people or [""] * len(cycles)
    owners = [person or cycle.skeleton for person, cycle in zip(names, cycles, strict=True)]
    takes = Counter(owners)
    return [1.0 / takes[owner] for owner in owners]


def _median(values: FloatArray, shares: FloatArray) -> float:
    """Return the median of values that count by their shares."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(shares[order])
    half = below[-1] / 2.0
    first, last = (int(np.searchsorted(below, half * (1.0 + off))) for off in (-1e-9, 1e-9))
    return float(values[order[first]] + values[order[min(last, len(order) - 1)]]) / 2.0


def _kind(skeleton: Skeleton) -> tuple[tuple[str, ...], tuple[int, ...], str]:
    return skeleton.names, tuple(skeleton.parents.tolist()), skeleton.convention


def _mean_body(cycles: Sequence[Cycle]) -> Cycle:
    """Return the cycle of the body whose height is nearest to the mean."""
    bodies = [cycle.skeleton for cycle in cycles]
    heights_m = np.array([body.height * body.metres_per_unit for body in bodies])
    return cycles[int(np.argmin(np.abs(heights_m - heights_m.mean())))]


def _moved(cycle: Cycle, example: Cycle) -> Cycle:
    """Return a cycle on the body of another one, and its advance in metres as it was."""
    moved = on_body(cycle, example)
    before, after = (
        float(np.linalg.norm(each.advance)) * each.skeleton.metres_per_unit
        for each in (cycle, moved)
    )
    return moved if after == 0.0 else replace(moved, advance=moved.advance * before / after)


def _amplitude(columns: FloatArray, joints: FloatArray) -> FloatArray:
    """Return how far cycles (..., S, J, 6) are from their mean posture, root mean square."""
    moved = columns - columns.mean(axis=-3, keepdims=True)
    return np.asarray(np.sqrt(((moved**2).sum(axis=-1) @ joints).mean(axis=-1)))


def _expect_something_in_common(
    aligned: FloatArray, reference: FloatArray, joints: FloatArray, name: str
) -> None:
    shares = _amplitude(aligned - reference, joints) / np.maximum(
        _amplitude(aligned, joints), LEAST_DISTANCE
    )
    unlike = float(np.median(shares))
    if unlike > MOST_UNLIKE:
        raise NoPeriodError(
            f"Expected clips of class {name!r} that move alike, but the {len(aligned)} in which a "
            f"motion repeats have nothing in common: they differ by {unlike:.2f} of what they "
            f"move, and {MOST_UNLIKE:g} is the most. Give them labels of their own, or, "
            "if some are the mirror images of others, --mirror-members auto."
        )


def _medoid(curves: FloatArray) -> int:
    """Return the index of the cycle that is nearest to the others, each at its best phase."""
    if len(curves) < 3:
        return 0
    spectra = np.fft.rfft(curves.reshape(*curves.shape[:2], -1), axis=1)
    power = (curves**2).sum(axis=(1, 2, 3))
    total = np.zeros(len(curves))
    for i, spectrum in enumerate(spectra):
        products = np.fft.irfft((spectra * spectrum.conj()).sum(axis=2), curves.shape[1], axis=1)
        total[i] = np.sqrt(np.maximum(power + power[i] - 2 * products.max(axis=1), 0)).sum()
    return int(np.argmin(total))


class _Fit(NamedTuple):
    """A cycle at its best phase, that phase, and its distance from the reference."""

    columns: FloatArray
    shift: float
    distance: float
    is_mirrored: bool = False


def _align(columns: FloatArray, reference: FloatArray, joints: FloatArray) -> _Fit:
    scale = np.sqrt(joints)[:, None]
    shift = best_phase_shift(columns * scale, reference * scale)
    aligned = shift_phase(columns, shift)
    squares = ((aligned - reference) ** 2).sum(axis=2) @ joints
    return _Fit(aligned, shift, float(np.sqrt(squares.mean())))


def _root(
    cycles: Sequence[Cycle],
    shifts: FloatArray,
    flipped: FloatArray,
    body: Skeleton,
) -> tuple[FloatArray, FloatArray]:
    """Return the mean sway, scaled by height, and the mean advance, in the body's units."""
    sways, advances = [], []
    for cycle, shift, is_flipped in zip(cycles, shifts, flipped, strict=True):
        scale = body.height / cycle.skeleton.height
        units = cycle.skeleton.metres_per_unit / body.metres_per_unit
        flip = np.array([-1.0 if is_flipped else 1.0, 1.0, 1.0])
        sways.append(shift_phase(cycle.sway, float(shift)) * flip * scale)
        advances.append(cycle.advance * flip * units)
    return np.mean(sways, axis=0), np.mean(advances, axis=0)


def _spread(aligned: FloatArray, reference: FloatArray, weights: FloatArray) -> FloatArray:
    angle = rotation_angles(from_columns(aligned), from_columns(reference))
    return np.asarray(np.sqrt(np.tensordot(weights, angle**2, axes=1) / weights.sum()))
