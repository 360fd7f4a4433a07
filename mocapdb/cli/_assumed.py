"""What a build took for granted, as lines to read."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.library import Assumptions
    from mocapdb.motion.clip import Clip

__all__ = ["SOURCES", "assumed_json", "assumption_lines", "shortened"]

CLIP_ONLY = re.compile(r"^Cannot map skeleton .* to the canonical body: | \(its names have no .*\)")
"""What a reason says of one clip alone: clips are told together that are refused for the same."""

SHOWN = 6  # values, reasons or warnings of one kind; of the others the number is told
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


def assumption_lines(assumed: Assumptions) -> Iterator[str]:
    """Yield what a build took for granted, what it mended, and what it cannot use."""
    kinds: tuple[tuple[str, list[dict[str, Any]], Callable[[Any], str]], ...] = (
        ("unit", assumed.unit_m, lambda value: f"{value:g} m"),
        ("up", assumed.up, str),
        ("rate", assumed.fps, lambda value: f"{value:.6g} frames/s"),
        ("body", assumed.body, lambda value: value or "not looked at"),
        ("subject", assumed.subject, lambda value: value or "none"),
    )
    for name, counted, spell in kinds:
        for source, values in _by_source(counted, spell).items():
            yield f"{name:<14}{', '.join(shortened(values))}, {SOURCES.get(source, source)}"
    if assumed.mended:
        notes = Counter(note for notes in assumed.mended.values() for note in notes)
        yield f"{'mended':<14}{_clips(len(assumed.mended))}: {'; '.join(shortened(_most(notes)))}"
    if assumed.unsearchable:
        yield f"{'cannot search':<14}{_clips(len(assumed.unsearchable))}; mocapdb ls --unsearchable"
        reasons = defaultdict(list)
        for clip, reason in assumed.unsearchable.items():
            reasons[CLIP_ONLY.sub("", reason)].append(clip)
        several = sorted(reasons.items(), key=lambda each: -len(each[1]))
        for reason, clips in several[:SHOWN]:
            more = f" and {len(clips) - 1} more" if len(clips) > 1 else ""
            yield f"{'':<14}{clips[0]}{more}: {reason}"
        if len(several) > SHOWN:
            yield f"{'':<14}and {len(several) - SHOWN} more reasons"
    if assumed.left_alone:
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


def _clips(count: int) -> str:
    return "1 clip" if count == 1 else f"{count} clips"
