"""What a build took for granted, so that nobody has to find out later."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from mocapdb.library.catalogue import ASSUMED, Catalogue
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.outlying import outlying_clips
from mocapdb.motion.tuning import STATURES_M

__all__ = ["Assumptions", "assumptions"]

WARNING = "warning: "  # how `mocapdb.io` begins such a step of the provenance
OF_STATURE = "the body is "  # what it then says of a stature, which is asked of every clip here
Counted = list[dict[str, Any]]
"""Of each value and its source, the number of clips, the most first."""


@dataclass(frozen=True)
class Assumptions:
    """What was taken for granted of the clips of a corpus.

    Attributes
    ----------
    unit_m, up, fps, body, subject : list of dict
        ``value``, ``source`` and ``clips``, a number; the most first.
    mended : dict of list
        What was mended, by the clip's name.
    unsearchable : dict of str
        Clips that no query looks at, and why.
    outlying : list of str
        Clips that lie so far off that the axes of the search are found without them.
    left_alone : dict of int
        Files that are no motion files, by their suffix.
    warnings : list of str
        What is unlikely.
    """

    unit_m: Counted
    up: Counted
    fps: Counted
    body: Counted
    subject: Counted
    mended: dict[str, list[str]]
    unsearchable: dict[str, str]
    outlying: list[str]
    left_alone: dict[str, int]
    warnings: list[str]


def assumptions(
    catalogue: Catalogue,
    corpus: str,
    left_alone: Mapping[str, int],
    warnings: Iterable[str] = (),
) -> Assumptions:
    """Return what was taken for granted of a corpus folder's clips in a library.

    Warnings that are known already come before those of odd statures.
    """
    notable = list(catalogue.notable(corpus, *STATURES_M))
    alike = catalogue.alike(ASSUMED, corpus)
    return Assumptions(
        unit_m=_counted(alike, "unit_m", "unit_source"),
        up=_counted(alike, "up", "up_source"),
        fps=_counted(alike, "fps", "fps_source"),
        body=[
            {"value": value, "source": source, "clips": each["clips"]}
            for each in _counted(alike, "body", "body")
            for value, source in [_body(each["value"])]
        ],
        subject=_counted(alike, "subject", "subject_source"),
        mended={record.name: list(record.mended) for record in notable if record.mended},
        unsearchable=catalogue.unsearchable(corpus),
        outlying=outlying_clips(catalogue, corpus),
        left_alone=dict(left_alone),
        warnings=[*warnings, *(warning for record in notable for warning in _warned_of(record))],
    )


def _counted(alike: Iterable[tuple[Any, ...]], value: str, source: str) -> Counted:
    """Return values and sources with their clips: the most first, of as many the first by name."""
    of_value, of_source = ASSUMED.index(value), ASSUMED.index(source)
    found: dict[tuple[Any, str], tuple[int, str]] = {}
    for *columns, clips, name in alike:
        key = columns[of_value], columns[of_source]
        so_far, first = found.get(key, (0, name))
        found[key] = so_far + clips, min(first, name)
    ordered = sorted(found.items(), key=lambda each: (-each[1][0], each[1][1]))
    return [
        {"value": value, "source": source, "clips": clips}
        for (value, source), (clips, _) in ordered
    ]


def _body(body: str) -> tuple[str | None, str]:
    """Return what kind of body a clip has, and by what it was understood."""
    if body == "unknown":
        return None, "unknown"
    return ("no whole human", "names and shape") if body == "none" else ("human", body[3:])


def _warned_of(record: ClipRecord) -> list[str]:
    """Return what reading a clip warned of, and whether its body is no size for a person."""
    read = [step.removeprefix(WARNING) for step in record.provenance if step.startswith(WARNING)]
    told = [f"{record.name}: {warning}" for warning in read if not warning.startswith(OF_STATURE)]
    return [*told, *_odd_stature(record)]


def _odd_stature(record: ClipRecord) -> list[str]:
    """Return a warning where a body is no size for a person."""
    height, (least, most) = record.height_m, STATURES_M
    human = record.body not in {"none", "unknown"}
    if height is None or (height <= most and (height >= least or not human)):
        return []
    what = "a stature" if human else "an extent"
    return [
        f"{record.name}: {what} of {height:.3g} m, in units of {record.unit_m:g} m "
        f"({record.unit_source}). If that is wrong, say the unit."
    ]
