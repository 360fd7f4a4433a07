"""Cleaning a library: revisions made, taken back, and what is said of them."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

from mocapdb.cli._assumed import shortened
from mocapdb.cli._console import counted, emit_json, progress_bar
from mocapdb.cli._context import context_notes

if TYPE_CHECKING:
    from mocapdb.cleaning import Vocabulary
    from mocapdb.cli._context import Context
    from mocapdb.library.building.revise_clips import CleaningReport, CleaningSettings
    from mocapdb.motion.clip import Clip

__all__ = ["apply_cleaning", "say_cleaning", "undo_cleaning"]


def apply_cleaning(
    library: Path,
    names: list[str] | None,
    settings: CleaningSettings,
    context: Context,
    jobs: int | None,
    scheduler: str | None,
    as_json: bool,
) -> None:
    """Keep the cleaned clips of a library beside those that were captured."""
    from mocapdb.library import clean_library

    notes: dict[str, None] = {}
    done = [0, 0]

    def noted(clip: Clip) -> list[Vocabulary]:
        vocabularies = context.of(clip)
        notes.update(dict.fromkeys(context_notes(vocabularies)))
        return vocabularies

    with progress_bar("Cleaning") as progress:

        def counting(n_done: int, total: int, name: str) -> None:
            done[:] = n_done, total
            progress(n_done, total, name)

        try:
            report = clean_library(
                library,
                settings,
                names=names,
                # workers of a cluster take the context along, and say in their logs what it lacks
                context=(context.of if scheduler else noted) if context.paths else None,
                jobs=jobs,
                scheduler=scheduler,
                progress=counting,
            )
        except KeyboardInterrupt:
            if done[1]:
                click.echo(
                    f"stopped: {done[0]} of {counted(done[1], 'clip')} are searched, and what was "
                    "repaired in them is kept. Run the same command again to go on.",
                    err=True,
                )
            raise
    if as_json:
        emit_json({"library": str(library), **report.to_dict(), "notes": list(notes)})
    say_cleaning(report, to_stdout=not as_json)
    for note in notes:
        click.echo(f"note: {note}", err=True)
    if report.failed:
        raise click.exceptions.Exit(1)


def undo_cleaning(library: Path, names: list[str] | None, as_json: bool) -> None:
    """Take the cleaned clips of a library back."""
    from mocapdb.library.upkeep.clean import undo_cleaning

    with progress_bar("Undoing") as progress:
        undone, stale = undo_cleaning(library, names, progress)
    if as_json:
        emit_json({"library": str(library), "undone": undone, "stale_cycles": stale})
    else:
        click.echo(
            f"{library}: {counted(len(undone), 'clip')} as captured again; "
            f"the space comes back with: mocapdb compact {quote(str(library))}"
        )
    _say_stale(stale)


def say_cleaning(report: CleaningReport, *, to_stdout: bool) -> None:
    """Say what came of cleaning, and what needs a look, on stderr."""
    if to_stdout:
        click.echo(
            f"cleaned: {counted(report.searched, 'clip')} searched, {report.skipped} were already; "
            f"{counted(report.spans, 'span')} flagged, {report.repaired} repaired in "
            f"{counted(len(report.cleaned), 'clip')}"
        )
    if report.left:
        left = [f"{name} ({n})" for name, n in report.left.items()]
        click.echo(
            f"warning: spans are flagged and as they were, for nothing was good enough: "
            f"{', '.join(shortened(left))}. These clips feed no class's cycle.",
            err=True,
        )
    if report.cut:
        click.echo(
            "note: frames that a jump of the whole body parts from the motion, such as a T-pose in "
            f"front, were not searched and are as captured: {', '.join(shortened(report.cut))}",
            err=True,
        )
    for name, reason in report.failed.items():
        click.echo(f"not searched for faults: {name}: {reason}", err=True)
    _say_stale(report.stale_cycles)


def _say_stale(classes: list[str]) -> None:
    if classes:
        click.echo(
            f"warning: the kept cycle of {', '.join(classes)} was made of clips as they were "
            "before. Make it anew: mocapdb cycle LIB --class CLASS",
            err=True,
        )
