"""Repair: new rotations for the flagged stretches, everything else bit for bit.

======================  ==========================================================================
`line`                  a spherical line from edge to edge, bent a little towards the paces there
`bridged`               a curve from edge to edge that keeps the pace at both
`neighbours`            the median of the neighbours (Aristidou 2018, section 4), or the same moved
                        to meet the edges
`smoothed`              of jitter, what is slow in it, on top of a fill
`undone`                an offset, a flip or a drift taken back: what the capture saw stays
`swapped back`          an exchange of left and right taken back, of whole limbs at once
                        (`exchanged_limbs`)
`held`                  a foot that slides or sinks held where it was (`held_feet`)
`neighbour at contact`  the neighbour that comes nearest to a contact, moved to meet the edges
======================  ==========================================================================

All ways are tried on gaps of the same length elsewhere in the same joint, where the truth is known;
how badly one fits the frames beside the span counts, too; and the way with the least error is
taken. Similar motion has to beat interpolation clearly. Where even the best errs by more than 30
degrees, or by more than it would move the joint, the span is left as it is, and so is a gap that a
program has filled, unless it can be filled clearly better. Where the root's translation has jumped,
it is taken back or bridged. Where there is a contact (`contact_targets`), an inverse kinematics
solve then brings the joint there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.cleaning.evidence.foot_faults import FOOT_KINDS
from mocapdb.cleaning.evidence.root_jumps import root_columns
from mocapdb.cleaning.local_rotations import Texture, local_rotations
from mocapdb.cleaning.map.detector import Context, detect_faults
from mocapdb.cleaning.map.digression_map import MovementDigressionMap, Span, shifted
from mocapdb.cleaning.repair.contact_targets import (
    Contact,
    contact_distance,
    find_resting_feet,
    reach_contacts,
    touching,
)
from mocapdb.cleaning.repair.exchanged_limbs import find_swaps
from mocapdb.cleaning.repair.gaps import Gap, Method, usual_step
from mocapdb.cleaning.repair.held_feet import hold_foot
from mocapdb.errors import ClipError
from mocapdb.motion.body.joint_names import across_by_names
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange
from mocapdb.motion.rotations import continuous_angles, extract_angles
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Cleaned", "Repair", "as_repaired", "clean_clip", "repair_spans", "write_rotations"]


class Repair(NamedTuple):
    """What was done about a span.

    Attributes
    ----------
    span : Span
        What was flagged; where left and right were swapped back its kind is ``"exchange"``.
    method : str
        See the module; ``"left"`` where nothing was good enough.
    expected_deg : float
        Mean error of the method on other gaps of this joint, or how badly it fits the frames beside
        the span; NaN where a translation was repaired.
    contact_mm : float
        Mean distance from its contacts that was left; NaN where it has none.
    """

    span: Span
    method: Method
    expected_deg: float
    contact_mm: float = float("nan")

    @property
    def repaired(self) -> bool:
        """Whether the span has new values."""
        return self.method != "left"

    @property
    def has_contact(self) -> bool:
        """Whether a contact touches the span."""
        return not math.isnan(self.contact_mm)


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A cleaned clip.

    Attributes
    ----------
    clip : Clip
    digression_map : MovementDigressionMap
        Of the clip as it came.
    repairs : tuple of Repair
        One for each span of the map, in its order.
    """

    clip: Clip
    digression_map: MovementDigressionMap
    repairs: tuple[Repair, ...]


def clean_clip(
    clip: Clip,
    context: Context = (),
    *,
    threshold: float | None = None,
    contacts: Sequence[Contact] = (),
    hold_feet: bool = True,
) -> Cleaned:
    """Find the faults of a clip and repair them; see `detect_faults` and `repair_spans`.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> take = synthetic.inject_faults(synthetic.make_clip("walk", seed=1), seed=1, n=1).clip
    >>> len(clean_clip(take).repairs)
    1
    """
    found = detect_faults(clip, context, threshold=threshold)
    repaired, repairs = repair_spans(clip, found, contacts=contacts, hold_feet=hold_feet)
    return Cleaned(repaired, as_repaired(found, repairs), repairs)


def as_repaired(found: MovementDigressionMap, repairs: Sequence[Repair]) -> MovementDigressionMap:
    """Return a map whose spans are called what their repairs have shown them to be."""
    return replace(found, spans=tuple(repair.span for repair in repairs))


def repair_spans(
    clip: Clip,
    digression_map: MovementDigressionMap,
    spans: Sequence[Span] | None = None,
    *,
    contacts: Sequence[Contact] = (),
    hold_feet: bool = True,
) -> tuple[Clip, tuple[Repair, ...]]:
    """Give spans of joints new rotations.

    Parameters
    ----------
    clip : Clip
        The one that the map is of.
    digression_map : MovementDigressionMap
    spans : sequence of Span, optional
        What to repair; by default all that were flagged.
    contacts : sequence of Contact
        Where joints have to be (see `contact_targets.make_contact`).
    hold_feet : bool
        Whether feet that rest beside a span, at the same place, are kept there within it.

    Returns
    -------
    clip : Clip
        Only the rotation channels of repaired spans have changed, and the root's translation where
        it had jumped; where a foot is held, those of its hip, knee and ankle.
    repairs : tuple of Repair

    Raises
    ------
    ClipError
        If a span is not within the clip, or its joint does not rotate.
    """
    chosen = digression_map.spans if spans is None else tuple(spans)
    searched = digression_map.searched
    if searched is None:
        return _repair_spans(clip, digression_map, chosen, contacts, hold_feet)
    outside = [s for s in chosen if s.start < searched.start or s.end > searched.end]
    if outside:
        raise ClipError(
            f"Expected spans within the frames {searched.start}:{searched.end} of {clip.name!r}, "
            "which is cut there, but got "
            f"{', '.join(f'{span.start}:{span.end}' for span in outside)}."
        )
    inner = shifted(chosen, -searched.start)
    part, repairs = _repair_spans(
        clip[searched.frames], digression_map, inner, _contacts_within(contacts, searched),
        hold_feet,
    )  # fmt: skip
    spans_here = shifted([repair.span for repair in repairs], searched.start)
    told = tuple(
        repair._replace(span=span) for repair, span in zip(repairs, spans_here, strict=True)
    )
    if not any(repair.repaired for repair in told):
        return clip, told
    channels = clip.channels.copy()
    channels[searched.frames] = part.channels
    return clip.replace(channels=channels, step=part.provenance[-1]), told


def _contacts_within(contacts: Sequence[Contact], searched: FrameRange) -> list[Contact]:
    """Return contacts as those of a part of the clip see them; without those beside it."""
    within = []
    for contact in contacts:
        start, end = max(contact.start, searched.start), min(contact.end, searched.end)
        if start < end:
            places = contact.places[start - contact.start : end - contact.start]
            first = start - searched.start
            within.append(Contact(first, first + end - start, contact.joint, places))
    return within


def _repair_spans(
    clip: Clip,
    digression_map: MovementDigressionMap,
    chosen: Sequence[Span],
    contacts: Sequence[Contact],
    hold_feet: bool,
) -> tuple[Clip, tuple[Repair, ...]]:
    """Repair spans of a clip all of whose frames were searched; see `repair_spans`."""
    texture = local_rotations(clip)
    rows = {joint: row for row, joint in enumerate(texture.joints.tolist())}
    for span in chosen:
        if span.joint not in rows or not 0 <= span.start < span.end <= len(clip):
            raise ClipError(
                f"Expected spans of joints that rotate, within the {len(clip)} frames of "
                f"{clip.name!r}, but got joint {span.joint}, frames {span.start}:{span.end}."
            )
    flagged = np.zeros((len(clip), clip.skeleton.n_joints), dtype=np.bool_)
    for span in (span for span in chosen if span.kind not in ("pop", *FOOT_KINDS)):
        flagged[span.frames, span.joint] = True
    wanted = [*contacts, *(find_resting_feet(clip, flagged) if hold_feet else ())]
    channels = clip.channels.copy()
    movable = np.zeros_like(flagged)
    repairs = []
    across = across_by_names(clip.skeleton.names)
    gaps = _gaps(texture, chosen, flagged, digression_map, across)
    swaps = find_swaps(clip.skeleton, across, gaps)
    for span in chosen:
        if span.kind == "pop":
            repairs.append(_put_back(clip, channels, span))
            continue
        if span.kind in FOOT_KINDS:
            repairs.append(Repair(span, "left", float("nan")))
            continue
        held = touching(clip.skeleton, wanted, span.joint, span)

        def from_contact(
            values: FloatArray, span: Span = span, held: list[Contact] = held
        ) -> float:
            trial = channels[: span.end].copy()
            write_rotations(clip.skeleton, trial, span.joint, span.start, values)
            return contact_distance(clip.skeleton, trial, held, span)

        method: Method
        gap, swap = gaps[span], swaps.get(span)
        if swap is not None:
            values, method, expected = gap.swapped(swap.mirror), "swapped back", swap.misfit_deg
        else:
            values, method, expected = gap.repaired(from_contact if held else None)
        if method != "left":
            write_rotations(clip.skeleton, channels, span.joint, span.start, values)
            movable[span.frames, span.joint] = True
        kind = "exchange" if method == "swapped back" else span.kind
        repairs.append(Repair(replace(span, kind=kind), method, expected))
    channels = reach_contacts(clip.skeleton, channels, wanted, movable)
    repairs = [
        _with_foot_held(clip, channels, repair)
        if repair.span.kind in FOOT_KINDS
        else _with_contact(clip.skeleton, channels, wanted, repair)
        for repair in repairs
    ]
    n_repaired = sum(repair.repaired for repair in repairs)
    if n_repaired == 0:
        return clip, tuple(repairs)
    step = f"repaired {n_repaired} of {len(repairs)} flagged spans"
    return clip.replace(channels=channels, step=step), tuple(repairs)


def _gaps(
    texture: Texture,
    chosen: Sequence[Span],
    flagged: BoolArray,
    digression_map: MovementDigressionMap,
    across: IntArray,
) -> dict[Span, Gap]:
    """Return the spans whose rotations are to be found anew, as gaps."""
    rows = {joint: row for row, joint in enumerate(texture.joints.tolist())}
    usual: dict[int, float] = {}
    gaps = {}
    for span in chosen:
        if span.kind in ("pop", *FOOT_KINDS):
            continue
        row, wrong = rows[span.joint], flagged[:, span.joint]
        if row not in usual:
            usual[row] = usual_step(texture.quat_xyzw[:, row], wrong)
        other = int(across[span.joint])
        opposite = rows.get(other) if other != span.joint else None
        gaps[span] = Gap(texture, row, span, wrong, usual[row], digression_map, opposite)
    return gaps


def _put_back(clip: Clip, channels: FloatArray, span: Span) -> Repair:
    """Take back a jump of a joint's translation; write it into the channels.

    What was captured is moved to meet the frames beside the span, at their pace; what would still
    be rough is bridged by a straight line.
    """
    columns = root_columns(clip, span.joint)
    places = channels[:, columns]
    start, end = span.start, span.end
    if start < 1 or end >= len(places):
        return Repair(span, "left", float("nan"))
    pace_in = places[start - 1] - places[start - 2] if start > 1 else 0.0 * places[0]
    pace_out = places[end + 1] - places[end] if end + 1 < len(places) else 0.0 * places[0]
    share = ((np.arange(start, end) - start + 1) / (end - start + 1))[:, None]
    first = places[start] - (places[start - 1] + pace_in)
    last = places[end - 1] - (places[end] - pace_out)
    moved = places[start:end] - ((1.0 - share) * first + share * last)
    line = (1.0 - share) * places[start - 1] + share * places[end]
    near = [places[max(0, start - 2) : start], places[end : end + 2]]
    rough = [
        float(np.abs(np.diff(np.concatenate([near[0], values, near[1]]), 2, axis=0)).max())
        for values in (moved, line)
    ]
    undone = rough[0] <= 2.0 * rough[1]
    channels[start:end, columns] = moved if undone else line
    return Repair(span, "undone" if undone else "bridged", float("nan"))


def _with_foot_held(clip: Clip, channels: FloatArray, repair: Repair) -> Repair:
    """Hold a foot that slides or sinks; write it into the channels."""
    left_mm = hold_foot(clip, channels, repair.span)
    return repair if left_mm is None else repair._replace(method="held", contact_mm=left_mm)


def _with_contact(
    skeleton: Skeleton, channels: FloatArray, contacts: Sequence[Contact], repair: Repair
) -> Repair:
    span = repair.span
    held = touching(skeleton, contacts, span.joint, span)
    if not held:
        return repair
    apart = contact_distance(skeleton, channels, held, span)
    return repair._replace(contact_mm=apart * skeleton.metres_per_unit * 1000.0)


def write_rotations(
    skeleton: Skeleton, channels: FloatArray, joint: int, start: int, quats: FloatArray
) -> None:
    """Write rotations into a joint's channels from a frame on, near the angles of the one before.

    Parameters
    ----------
    skeleton : Skeleton
    channels : (F, C)
        Changed in place.
    joint, start : int
    quats : (n, 4)
        Of a joint with fewer than three angles, the nearest rotation is written.
    """
    from scipy.spatial.transform import Rotation

    order = skeleton.rotation_orders[joint]
    columns = skeleton.rotation_columns(joint)
    angles = extract_angles(order, Rotation.from_quat(quats).as_matrix())
    before = np.deg2rad(channels[start - 1, columns]) if start > 0 else None
    angles = continuous_angles(order, angles, before)
    channels[start : start + len(quats), columns] = np.rad2deg(angles)
