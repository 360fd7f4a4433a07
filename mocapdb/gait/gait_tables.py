"""Tidy tables of gait, as CSV: a row a stride, a row an angle and percent of it, a row an event."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import make_folder, replacing
from mocapdb.errors import FormatError
from mocapdb.gait.feet import understand_walker
from mocapdb.gait.foot_events import FootContact, find_foot_contacts
from mocapdb.gait.gait_analysis import GaitAnalysis
from mocapdb.gait.strides import MEASURES
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.clip import Clip

__all__ = ["GaitEvent", "gait_events", "write_angles", "write_events", "write_strides"]

EVENTS = ("start", "toe_off", "opposite_toe_off", "opposite_strike", "end")


class GaitEvent(NamedTuple):
    """A foot that lands or leaves.

    Attributes
    ----------
    foot : {"left", "right"}
    event : {"strike", "toe_off"}
    time_s : float, seconds
    frame : float
        To a fraction of a frame.
    """

    foot: str
    event: Literal["strike", "toe_off"]
    time_s: float
    frame: float


def gait_events(clip: Clip) -> list[GaitEvent]:
    """Return when each foot lands and leaves, in order of time; no stride has to be complete.

    Parameters
    ----------
    clip : Clip
        Of any body of two legs.

    Raises
    ------
    GaitError
        If the body has not two legs.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> first, second, *_ = gait_events(synthetic.make_clip("walk", seed=1))
    >>> (first.foot, first.event), (second.foot, second.event)
    (('left', 'strike'), ('right', 'toe_off'))
    """
    return _events(clip.fps, find_foot_contacts(understand_walker(clip)))


def _events(fps: float, contacts: Sequence[Sequence[FootContact]]) -> list[GaitEvent]:
    found: list[GaitEvent] = []
    for foot, own in zip(SIDES, contacts, strict=True):
        for contact in own:
            if contact.strike is not None:
                found.append(GaitEvent(foot, "strike", contact.strike / fps, contact.strike))
            if contact.toe_off is not None:
                found.append(GaitEvent(foot, "toe_off", contact.toe_off / fps, contact.toe_off))
    return sorted(found, key=lambda event: event.frame)


def write_events(found: Iterable[GaitAnalysis | Clip], path: StrPath) -> int:
    """Write a row for each event of each clip: clip, foot, event, time and frame.

    Returns how many there are.

    Raises
    ------
    FormatError
        If the file is no ``.csv``.
    GaitError
        If a clip's body has not two legs.
    """
    if Path(path).suffix.lower() != ".csv":
        raise FormatError(path, f"Expected a .csv for events, but got {Path(path).name!r}.")
    rows: list[list[object]] = []
    for each in found:
        if isinstance(each, GaitAnalysis):
            name, events = each.clip.name, _events(each.clip.fps, each.contacts)
        else:
            name, events = each.name, gait_events(each)
        rows += [
            [name, event.foot, event.event, f"{event.time_s:.4f}", f"{event.frame:.3f}"]
            for event in events
        ]
    _write(Path(path), ["clip", "foot", "event", "time_s", "frame"], rows)
    return len(rows)


def write_strides(gaits: Sequence[GaitAnalysis], path: Path) -> None:
    """Write a row for each stride: clip, side, number, the times of its events, its measures."""
    header = ["clip", "side", "stride", *(f"{event}_s" for event in EVENTS), *MEASURES]
    _write(
        path,
        header,
        (
            [
                gait.clip.name, stride.side, stride.number,
                *(f"{getattr(stride, event) / gait.clip.fps:.4f}" for event in EVENTS),
                *(f"{getattr(stride, name):.5g}" for name in MEASURES),
            ]
            for gait in gaits
            for stride in gait.strides
        ),
    )  # fmt: skip


def write_angles(gaits: Sequence[GaitAnalysis], path: Path) -> None:
    """Write a row for each angle at each percent of each stride, in degrees."""
    _write(
        path,
        ["clip", "side", "stride", "joint", "angle", "percent", "degrees"],
        (
            [gait.clip.name, side, number, joint, angle, percent, f"{degrees:.3f}"]
            for gait in gaits
            for (side, joint, angle), laps in gait.curves.items()
            for number, lap in enumerate(laps, start=1)
            for percent, degrees in enumerate(lap.tolist())
        ),
    )


def _write(path: Path, header: list[str], rows: Iterable[list[object]]) -> None:
    make_folder(path.parent)
    with (
        replacing(path) as (temporary,),
        Path(temporary).open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
