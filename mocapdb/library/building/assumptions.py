"""What a build took for granted, so that nobody has to find out later."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mocapdb.io.find_files import CLIP_SUFFIXES, walk_files
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.clip_record import ClipRecord
from mocapdb.library.layout import CATALOGUE_FILE
from mocapdb.library.outlying import outlying_clips
from mocapdb.motion.tuning import STATURES_M

__all__ = ["Assumptions", "assumptions"]

WARNING = "warning: "  # how `mocapdb.io` begins such a step of the provenance
OF_STATURE = "the body is "  # what it then says of a stature, which is asked of every clip here
READ_BESIDE = (".asf", ".csv", ".toml")
"""Of files that are read with the clips: skeletons, labels and settings."""

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
    catalogue: Catalogue, root: Path, library: Path, warnings: Iterable[str] = ()
) -> Assumptions:
    """Return what was taken for granted of a corpus folder's clips in a library.

    Warnings that are known already come before those of odd statures.
    """
    corpus = str(root.resolve())
    records = [record for record in catalogue.records() if record.corpus == corpus]
    unsearchable = catalogue.unsearchable()
    outlying = set(outlying_clips(library, catalogue))
    return Assumptions(
        unit_m=_counted((record.unit_m, record.unit_source) for record in records),
        up=_counted((record.up, record.up_source) for record in records),
        fps=_counted((record.fps, record.fps_source) for record in records),
        body=_counted(_body(record) for record in records),
        subject=_counted((record.subject, record.subject_source) for record in records),
        mended={record.name: list(record.mended) for record in records if record.mended},
        unsearchable={
            record.name: unsearchable[record.name]
            for record in records
            if record.name in unsearchable
        },
        outlying=sorted(outlying & {record.name for record in records}),
        left_alone=_left_alone(root),
        warnings=[
            *warnings,
            *(warning for record in records for warning in _warned_of(record)),
        ],
    )


def _counted(found: Iterable[tuple[Any, str]]) -> Counted:
    return [
        {"value": value, "source": source, "clips": clips}
        for (value, source), clips in Counter(found).most_common()
    ]


def _body(record: ClipRecord) -> tuple[str | None, str]:
    """Return what kind of body a clip has, and by what it was understood."""
    if record.body == "unknown":
        return None, "unknown"
    if record.body == "none":
        return "no whole human", "names and shape"
    return "human", record.body.removeprefix("by ")


def _left_alone(root: Path) -> dict[str, int]:
    """Return how many files there are that no clip can be read from, by suffix."""
    suffixes = Counter(
        path.suffix.lower() or "without a suffix"
        for path in walk_files(root, pass_over=CATALOGUE_FILE)
        if not path.name.startswith(".")
    )
    for known in (*CLIP_SUFFIXES, *READ_BESIDE):
        del suffixes[known]
    return dict(suffixes.most_common())


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
