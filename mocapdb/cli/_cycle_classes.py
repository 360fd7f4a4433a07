"""The cycles of classes of a library: of one, or of all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

from mocapdb.cli._assumed import assumed_together
from mocapdb.cli._console import counted, progress_bar
from mocapdb.cli._cycle_clips import (
    Figures,
    Lines,
    Told,
    Wanted,
    loop_figures,
    loop_lines,
    loop_warnings,
    one_lap,
    where_lines,
)
from mocapdb.cli._cycle_output import written_loop
from mocapdb.errors import LibraryError, NoPeriodError

if TYPE_CHECKING:
    from mocapdb.cycles.class_cycle import MirrorMembers
    from mocapdb.library import Library

__all__ = ["Members", "of_class", "of_every_class"]


@dataclass(frozen=True)
class Members:
    """Which clips of a class are averaged.

    Attributes
    ----------
    where : dict of str to str
        Only those whose further columns of the labels have these values.
    mirror : {"never", "auto"}
    clean : bool
        Whether clips that nobody has searched for faults are cleaned first.
    """

    where: dict[str, str]
    mirror: MirrorMembers
    clean: bool


def of_every_class(library: Library, members: Members, wanted: Wanted) -> Told:
    """Make the loop of every class; those that have none are listed and stop no other.

    With a folder as output, each class's curves are beside its loop.

    Raises
    ------
    NoPeriodError
        If no class has one.
    """
    classes: list[Figures] = []
    lines: Lines = []
    without: dict[str, str] = {}
    if not library.classes():
        raise NoPeriodError(
            f"Expected clips with labels, but no clip of {library.path} has one. Build it with "
            "--labels, or use --clip."
        )
    for label in sorted(library.classes()):
        path = wanted.files.path(label)
        curves = path.with_suffix(".csv") if path and wanted.files.is_folder else None
        try:
            figures, _ = of_class(library, label, members, wanted, path, curves)
        except (NoPeriodError, LibraryError) as problem:
            without[label] = str(problem)
            click.echo(f"no cycle: {label}: {problem}", err=True)
            continue
        classes.append(figures)
        text = f"{counted(len(figures['members']), 'clip')}, {len(figures['left_out'])} left out, "
        text += f"{figures['period_s']:.3f} s"
        if figures["pops"]:
            text += f", pops: {', '.join(figures['pops'])}"
        lines.append((label, text if path is None else f"{text}, {path}"))
        lines += [("", f"mirrored: {name}") for name in figures["mirrored"]]
        lines += [("", f"left out: {text}") for text in _left_out(figures["left_out"])]
    if not classes:
        raise NoPeriodError(
            f"Expected a class in which a motion repeats, but none of {len(without)} has one."
        )
    warnings = [f"{each['class']}: {text}" for each in classes for text in each["warnings"]]
    return {"classes": classes, "without_cycle": without, "warnings": warnings}, lines


def of_class(
    library: Library,
    label: str,
    members: Members,
    wanted: Wanted,
    path: Path | None,
    curves: Path | None,
) -> Told:
    """Make the loop of a class, and keep its cycle; return its figures and lines of text.

    The loop goes to `path`, and a table of its curves to `curves`.
    """
    import numpy as np

    from mocapdb.cycles import seam_steps
    from mocapdb.cycles.class_curves import write_curves
    from mocapdb.cycles.synthesis.loop_start import start_phase
    from mocapdb.library.cycles_file import write_cycle
    from mocapdb.library.searching.class_cycles import make_cycle

    with progress_bar("Extracting") as progress:
        made = make_cycle(
            library,
            label,
            wanted.settings,
            where=members.where,
            mirror_members=members.mirror,
            clean=members.clean,
            progress=progress,
        )
    mean = made.mean
    # what is kept as the cycle of a class is that of all its clips, at their best
    is_kept = not members.where and not library.original
    kept = str(write_cycle(library.path, mean)) if is_kept else None
    begin = start_phase(mean.cycle, wanted.loop["start"])
    loop = written_loop(
        mean.cycle.rephased(begin.phase),
        wanted.loop,
        wanted.files,
        path,
        fps=made.fps,
        most_jerk=made.most_jerk,
        scene=made.scene,
    )
    if curves is not None:
        from mocapdb.base.files import make_folder

        make_folder(curves.parent)
        write_curves(mean, curves, begin.phase)
    output = None if path is None else str(path)
    spread_deg = np.rad2deg(np.sqrt((mean.spread_rad**2).mean(axis=0)))
    left_out = mean.left_out or {}
    seam = seam_steps(one_lap(loop))
    figures = {
        "library": str(library.path),
        "class": label,
        "members": list(mean.members),
        **assumed_together(made.clips),
        "mirrored": list(mean.mirrored),
        "left_out": left_out,
        "cleaned": made.cleaned,
        "unsearched": list(made.unsearched),
        "period_s": mean.cycle.period_s,
        "model": wanted.settings.model,
        "phase_0": begin.event,
        "spread_deg": dict(zip(mean.cycle.skeleton.names, spread_deg.tolist(), strict=True)),
        **loop_figures(loop, seam),
        "warnings": [*loop_warnings(loop), *_unsearched(library.path, made.unsearched)],
        "kept_in": kept,
        "curves": None if curves is None else str(curves),
        "output": output,
    }
    lines = [
        ("class", f"{label}: {counted(len(mean.members), 'clip')}, {len(left_out)} left out"),
        *(("mirrored", name) for name in mean.mirrored),
        *(
            ("cleaned", f"{name}: {counted(n, 'span')} repaired")
            for name, n in sorted(made.cleaned.items())
        ),
        *(("left out", text) for text in _left_out(left_out)),
        ("period", f"{mean.cycle.period_s:.3f} s"),
        ("spread", f"{float(spread_deg.mean()):.1f} degrees over joints and phases"),
        *loop_lines(loop, seam),
    ]
    if kept is not None:
        lines.append(("kept in", kept))
    if curves is not None:
        lines.append(("curves", str(curves)))
    return figures, lines + where_lines(output, loop, [])


def _left_out(left_out: Mapping[str, str]) -> list[str]:
    """Return which clips were left out and why; the reason may name the clip already."""
    return [f"{name}: {why.removeprefix(f'{name}: ')}" for name, why in sorted(left_out.items())]


def _unsearched(library: Path, names: Sequence[str]) -> list[str]:
    """Return a warning if members of a class were never searched for faults."""
    if not names:
        return []
    return [
        f"{counted(len(names), 'member')} of the class never searched for faults: add --clean, or "
        f"once for all: mocapdb clean {quote(str(library))} --apply"
    ]
