"""The clip that is open alone, beside its original, or beside its repair: each as a stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.errors import ClipError
from mocapdb.library.naming import file_and_take
from mocapdb.motion.clip import Clip
from mocapdb.scenes.stage import ACTOR_COLOURS, Actor, Stage

if TYPE_CHECKING:
    from mocapdb.library.clip_record import ClipRecord

__all__ = ["COMPARISONS", "comparison"]

COMPARISONS = ALONE, ORIGINAL, REPAIRED = (
    "decoded",
    "original beside decoded",
    "before beside repaired",
)


def comparison(
    how: str, clip: Clip, record: ClipRecord, repaired: Callable[[], tuple[Clip, Clip]]
) -> Stage:
    """Return a clip beside what it is compared with.

    Parameters
    ----------
    how : str
        One of `COMPARISONS`.
    clip : Clip
    record : ClipRecord
        Its row in the library, which says where its original is.
    repaired : callable
        Returns the clip as captured and cleaned; called only if these are to be compared.

    Raises
    ------
    ClipError
        If there is no such comparison, the original is not there any more, or its file has changed.
    """
    if how == ALONE:
        return Stage.together([Actor.of(clip)])
    if how == ORIGINAL:
        original = _original(record, len(clip))
        return Stage.side_by_side(
            [Actor.of(original, name="original"), Actor.of(clip, name="decoded", against=original)]
        )
    if how == REPAIRED:
        before, after = repaired()
        return Stage.side_by_side(
            [
                Actor.of(before, name="before", colour=ACTOR_COLOURS[1]),
                Actor.of(after, name="repaired", against=before, error_is="moved by"),
            ]
        )
    raise ClipError(f"Expected a comparison out of {COMPARISONS}, but got {how!r}.")


def _original(record: ClipRecord, n_frames: int) -> Clip:
    """Return a clip as it was before it was encoded, from the corpus."""
    from mocapdb.io import read_with_settings
    from mocapdb.library.building.settings import reading_of

    file, take = file_and_take(record.source)
    path = Path(record.corpus) / file
    if not path.is_file():
        raise ClipError(f"{path}: the original is not there any more.")
    reading = replace(reading_of(record.settings), fps=record.fps, take=take or None)
    original = read_with_settings(path, reading)
    return original[max(len(original) - n_frames, 0) :]  # a T-pose in front was left out
