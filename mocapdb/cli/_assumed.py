"""What a build took for granted, as lines to read."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from mocapdb.cli._console import counted

if TYPE_CHECKING:
    from mocapdb.library import Assumptions
    from mocapdb.library.clip_record import ClipRecord
    from mocapdb.motion.clip import Clip

__all__ = ["SOURCES", "assumed_json", "assumption_lines", "shortened"]

CLIP_ONLY = re.compile(r"^Cannot map skeleton .* to the canonical body: | \(its names have no .*\)")
"""The part of a reason that names one clip: without it, clips with one reason are put together."""

SHOWN = 6  # values, reasons or warnings of one kind; the others are only counted
SOURCES = {
    "file": "stated by the file",
    "labels": "from the labels",
    "manifest": "from the manifest",
    "settings": "from the settings",
    "caller": "as you said",
    "inferred": "inferred from the motion",
    "default": "assumed, for nothing tells",
    "name": "guessed from the file's name",
    "nobody": "for nothing tells",
    "names": "joints by names",
    "shape": "joints by shape",
    "names and shape": "by names and shape",
    "unknown": "not kept by an earlier version: build it anew in another folder",
}


def assumed_json(clip: Clip) -> dict[str, Any]:
    """Return unit, vertical axis and rate of a clip and who stated them, for ``--json``."""
    return {
        "fps": clip.fps,
        "fps_source": clip.fps_source,
        "unit_m": clip.skeleton.metres_per_unit,
        "unit_m_source": clip.unit_source,
        "up": clip.skeleton.up,
        "up_source": clip.up_source,
    }


def assumed_together(records: Sequence[ClipRecord]) -> dict[str, Any]:
    """Return unit, vertical axis and rate that some clips have, for ``--json``.

    A value that they do not share is None; every source is listed.
    """
    from mocapdb.library.library import assumed_of

    every = [assumed_of(record) for record in records]
    shared: dict[str, Any] = {}
    for key in ("fps", "unit_m", "up"):
        values = {each[key] for each in every}
        sources = sorted({each[f"{key}_source"] for each in every})
        shared[key] = values.pop() if len(values) == 1 else None
        shared[f"{key}_source"] = ", ".join(sources)
    return shared


def assumption_lines(assumed: Assumptions, *, shortly: bool = False) -> Iterator[str]:
    """Yield what a build took for granted, what it mended, and what it cannot use.

    The short form leaves out what was mended, the reasons, and the files that were not read.
    """
    kinds: tuple[tuple[str, list[dict[str, Any]], Callable[[Any], str]], ...] = (
        ("unit", assumed.unit_m, lambda value: f"{value:g} m"),
        ("up", assumed.up, str),
        ("rate", assumed.fps, lambda value: f"{value:.6g} frames/s"),
        ("body", assumed.body, lambda value: value or "not looked at"),
        ("subject", assumed.subject, lambda value: value or "none"),
    )
    for name, rows, spell in kinds:
        for source, values in _by_source(rows, spell).items():
            yield f"{name:<14}{', '.join(shortened(values))}, {SOURCES.get(source, source)}"
    if assumed.mended and not shortly:
        notes = Counter(note for notes in assumed.mended.values() for note in notes)
        told = "; ".join(shortened(_most(notes)))
        yield f"{'mended':<14}{counted(len(assumed.mended), 'clip')}: {told}"
    if assumed.unsearchable:
        clips = counted(len(assumed.unsearchable), "clip")
        yield f"{'cannot search':<14}{clips}; mocapdb ls --unsearchable"
        reasons = defaultdict(list)
        for clip, reason in assumed.unsearchable.items():
            reasons[CLIP_ONLY.sub("", reason)].append(clip)
        several = sorted(reasons.items(), key=lambda each: -len(each[1]))
        shown = 0 if shortly else SHOWN
        for reason, refused in several[:shown]:
            more = f" and {len(refused) - 1} more" if len(refused) > 1 else ""
            yield f"{'':<14}{refused[0]}{more}: {reason}"
        if len(several) > shown and not shortly:
            yield f"{'':<14}and {counted(len(several) - shown, 'more reason')}"
    if assumed.outlying:
        far = ", ".join(shortened(assumed.outlying))
        yield f"{'outlying':<14}{far}: too far off to count in the axes of the search"
    if assumed.left_alone and not shortly:
        left = [f"{count} {suffix}" for suffix, count in assumed.left_alone.items()]
        yield f"{'left alone':<14}{', '.join(left)}"


def _by_source(
    counted: Iterable[dict[str, Any]], spell: Callable[[Any], str]
) -> dict[str, list[str]]:
    """Return for each source the values with their numbers of clips, the most first."""
    values = defaultdict(list)
    for row in counted:
        values[row["source"]].append(f"{spell(row['value'])} ({row['clips']})")
    return values


def _most(notes: Counter[str]) -> list[str]:
    return [f"{note} ({count})" if count > 1 else note for note, count in notes.most_common()]


def shortened(values: list[str]) -> list[str]:
    """Return the first few of some texts, and how many more there are."""
    more = len(values) - SHOWN
    return values if more <= 0 else [*values[:SHOWN], f"and {more} more"]
