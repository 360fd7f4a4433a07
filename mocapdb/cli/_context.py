"""What ``--context`` names, as vocabularies to find similar motion in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._console import counted, progress_bar
from mocapdb.errors import ClipError
from mocapdb.io.find_files import find_motion_files
from mocapdb.library.layout import is_library

if TYPE_CHECKING:
    from mocapdb.cleaning.local_rotations import Texture
    from mocapdb.cleaning.neighbours.counterpart_joints import OtherMotion
    from mocapdb.cleaning.neighbours.nearest_words import Vocabulary
    from mocapdb.motion.clip import Clip

__all__ = ["Context", "context_json", "context_notes"]


class Context:
    """Clips, folders and libraries, read once for each rate at which they are compared.

    Only what is compared is kept: rotations at 24 frames a second, some 10 kB a second of motion,
    so that a whole library may serve.

    Parameters
    ----------
    paths : tuple of path

    Raises
    ------
    ClipError
        If there is no such path, or a folder has no clips.
    """

    def __init__(self, paths: tuple[Path, ...]) -> None:
        self.paths = paths
        self._read: dict[float, dict[tuple[str, ...], Vocabulary]] = {}
        self._bodies: dict[float, dict[tuple[str, ...], list[OtherMotion]]] = {}
        for path in paths:
            if not path.exists():
                raise ClipError(
                    "Expected a clip, a folder or a library as --context, but there is none: "
                    f"{path}."
                )
            if path.is_dir() and not is_library(path) and not find_motion_files(path):
                raise ClipError(f"Expected clips in {path}, but it has none.")

    def __reduce__(self) -> tuple[Callable[..., Context], tuple[Any, ...]]:
        """Be, in another process, the one context of these paths there: it is read only once."""
        return _shared_context, (self.paths,)

    def of(self, clip: Clip) -> list[Vocabulary]:
        """Return what a clip is compared with, without copies of its motion.

        The clips of its joints come first; those of other bodies are put onto its joints, where
        they can be.

        Raises
        ------
        ClipError
            If there are clips, but none can be compared with this one.
        """
        if not self.paths:
            return []
        from mocapdb.cleaning.local_rotations import motion_texture
        from mocapdb.cleaning.neighbours.counterpart_joints import context_of
        from mocapdb.cleaning.tuning import TEXTURE_FPS

        rate = min(clip.fps, TEXTURE_FPS)
        if rate not in self._read:
            self._read[rate] = self._vocabularies(rate)
        texture = motion_texture(clip)
        families = self._read[rate]
        found = []
        if texture.names in families:
            found.append(families[texture.names].without_copies(texture))
        refused: dict[str, str] = {}
        if families.keys() - {texture.names}:
            bodies = self._other_bodies(rate)
            others = (m for names in bodies if names != texture.names for m in bodies[names])
            found += context_of(clip, others, refused)
        if not found:
            n_clips = sum(len(family.clips) for family in families.values())
            why = f" {next(iter(refused.values()))}" if refused else ""
            raise ClipError(
                f"Expected clips to compare {clip.name!r} with, at {rate:g} Hz at least, in the "
                f"context, but {_none_of(n_clips)}.{why} Leave --context out, or "
                "name motion of such a body."
            )
        if refused:
            click.echo(
                f"context: {counted(len(refused), 'clip')} left out, of bodies that do not map to "
                f"{clip.name!r}",
                err=True,
            )
        return found

    def clips(self) -> Iterator[Clip]:
        """Yield all clips, one after another; none is kept."""
        with progress_bar("Reading context") as progress:
            for done, clip in enumerate((c for p in self.paths for c in _clips(p)), start=1):
                progress(done, done, clip.name)
                yield clip

    def _vocabularies(self, rate: float) -> dict[tuple[str, ...], Vocabulary]:
        from mocapdb.cleaning.neighbours.nearest_words import Vocabulary

        return Vocabulary.families(self._textures(rate))

    def _other_bodies(self, rate: float) -> dict[tuple[str, ...], list[OtherMotion]]:
        """Return all clips by the names of their joints, as they can be put onto other bodies."""
        from mocapdb.cleaning.local_rotations import motion_texture
        from mocapdb.cleaning.neighbours.counterpart_joints import OtherMotion
        from mocapdb.cleaning.tuning import TARGET_FRAMES

        if rate not in self._bodies:
            bodies: dict[tuple[str, ...], list[OtherMotion]] = {}
            for clip in self.clips():
                if clip.fps >= rate and clip.duration_s * rate >= TARGET_FRAMES:
                    names = motion_texture(clip[:1], rate).names
                    bodies.setdefault(names, []).append(OtherMotion.of(clip, rate))
            self._bodies[rate] = bodies
        return self._bodies[rate]

    def _textures(self, rate: float) -> Iterator[Texture]:
        """Yield the textures of clips at a rate; what is slower or too short is told and left."""
        from mocapdb.cleaning.local_rotations import motion_texture
        from mocapdb.cleaning.tuning import TARGET_FRAMES

        rates: Counter[float] = Counter()
        short = 0
        for clip in self.clips():
            rates[clip.fps] += 1
            if clip.fps < rate:
                continue
            texture = motion_texture(clip, rate)
            if len(texture) < TARGET_FRAMES:
                short += 1
            else:
                yield texture
        if short:
            click.echo(
                f"context: {counted(short, 'clip')} shorter than {TARGET_FRAMES / rate:.2f} s left "
                "out: there is nothing to compare",
                err=True,
            )
        slow = sum(n for fps, n in rates.items() if fps < rate)
        if slow:
            click.echo(
                f"context: {counted(slow, 'clip')} of less than {rate:g} Hz left out", err=True
            )
        if len(rates) > 1:
            several = ", ".join(f"{n} at {fps:g} Hz" for fps, n in sorted(rates.items()))
            click.echo(f"context: {several}; compared at {rate:g} Hz", err=True)


def _none_of(n_clips: int) -> str:
    if n_clips == 0:
        return "all of its clips are slower or too short"
    return f"none of its {n_clips} clips is one"


@cache
def _shared_context(paths: tuple[Path, ...]) -> Context:
    return Context(paths)


def _clips(path: Path) -> Iterator[Clip]:
    from mocapdb.io import read_with_settings

    if is_library(path):
        from mocapdb.library import Library

        with Library(path) as library:
            yield from library
    elif path.is_dir():
        yield from map(read_with_settings, find_motion_files(path))
    else:
        yield read_with_settings(path)


def context_json(vocabularies: Sequence[Vocabulary]) -> dict[str, Any]:
    """Return what the JSON contract says of what a clip was compared with."""
    return {
        "clips": sum(len(each.shown) for each in vocabularies),
        "seconds": sum(len(each) / each.fps for each in vocabularies),
        "other_bodies": [
            {
                "clips": len(each.shown),
                "seconds": len(each) / each.fps,
                "joints": len(each.rows),
                "without_counterpart": _without_counterpart(each),
            }
            for each in vocabularies
            if each.rows is not None
        ],
    }


def context_notes(vocabularies: Sequence[Vocabulary]) -> list[str]:
    """Return what is said of clips that are no context of themselves, and of other bodies."""
    notes = []
    for each in vocabularies:
        if each.hidden:
            notes.append(
                f"context: {counted(len(each.hidden), 'clip')} left out, of the clip's own motion"
            )
        if each.rows is None:
            continue
        missing = _without_counterpart(each)
        told = f"; no counterpart: {', '.join(missing)}" if missing else ""
        notes.append(
            f"context: {counted(len(each.shown), 'clip')} of other bodies, compared by "
            f"{len(each.rows)} of {len(each.names)} joints{told}"
        )
    return notes


def _without_counterpart(vocabulary: Vocabulary) -> list[str]:
    shown = set() if vocabulary.rows is None else set(vocabulary.rows.tolist())
    return [name for row, name in enumerate(vocabulary.names) if row not in shown]
