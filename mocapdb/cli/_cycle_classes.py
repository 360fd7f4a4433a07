"""The cycle of a class of a library."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mocapdb.cli._assumed import assumed_together
from mocapdb.cli._console import counted, progress_bar
from mocapdb.cli._cycle_clips import (
    Told,
    Wanted,
    loop_figures,
    loop_lines,
    loop_warnings,
    one_lap,
    where_lines,
)

if TYPE_CHECKING:
    from mocapdb.cycles.class_cycle import MirrorMembers
    from mocapdb.library import Library

__all__ = ["Members", "of_class"]


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


def of_class(library: Library, label: str, members: Members, wanted: Wanted) -> Told:
    """Make the loop of a class, and keep its cycle; return its figures and lines of text."""
    import numpy as np

    from mocapdb.cycles import make_loop, seam_steps
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
    options = wanted.loop
    begin = start_phase(mean.cycle, options["start"])
    loop = make_loop(
        mean.cycle.rephased(begin.phase),
        options["fps"] or made.fps,
        n_laps=options["n_laps"],
        root=options["root"],
        hold_feet=options["hold_feet"],
        most_jerk=made.most_jerk,
        lap_frames=options["lap_frames"],
        closed=options["closed"],
    )
    if made.scene is not None:
        loop = loop._replace(clip=made.scene.put_back(loop.clip))
    path = wanted.files.path(label if wanted.files.is_folder else "")
    wanted.files.write(loop, path)
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
        "phase_0": begin.event,
        "spread_deg": dict(zip(mean.cycle.skeleton.names, spread_deg.tolist(), strict=True)),
        **loop_figures(loop, seam),
        "warnings": [*loop_warnings(loop), *_unsearched(library.path, made.unsearched)],
        "kept_in": kept,
        "output": output,
    }
    lines = [
        ("class", f"{label}: {counted(len(mean.members), 'clip')}, {len(left_out)} left out"),
        *(("mirrored", name) for name in mean.mirrored),
        *(
            ("cleaned", f"{name}: {counted(n, 'span')} repaired")
            for name, n in sorted(made.cleaned.items())
        ),
        *(("left out", f"{name}: {why}") for name, why in sorted(left_out.items())),
        ("period", f"{mean.cycle.period_s:.3f} s"),
        ("spread", f"{float(spread_deg.mean()):.1f} degrees over joints and phases"),
        *loop_lines(loop, seam),
    ]
    if kept is not None:
        lines.append(("kept in", kept))
    return figures, lines + where_lines(output, loop, [])


def _unsearched(library: Path, names: Sequence[str]) -> list[str]:
    """Return a warning if members of a class were never searched for faults."""
    if not names:
        return []
    return [
        f"{counted(len(names), 'member')} of the class never searched for faults: add --clean, or "
        f"once for all: mocapdb clean {library} --apply"
    ]
