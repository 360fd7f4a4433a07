"""The cycles of clips: of one, of each range that repeats, or of many clips."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._cycle_output import LoopFiles, LoopOptions, as_file_name
from mocapdb.cycles.tuning import DOUBTFUL
from mocapdb.errors import MocapdbError, NoPeriodError

if TYPE_CHECKING:
    from mocapdb.cycles import Extraction, Loop, Settings
    from mocapdb.cycles.synthesis.blending import Transition
    from mocapdb.motion.clip import Clip

__all__ = [
    "Figures",
    "Lines",
    "Told",
    "Wanted",
    "feet_figures",
    "feet_warnings",
    "loop_figures",
    "loop_lines",
    "loop_warnings",
    "of_clip",
    "of_clips",
    "of_parts",
    "one_lap",
    "where_lines",
]

Figures: TypeAlias = dict[str, Any]
Lines: TypeAlias = list[tuple[str, str]]
Told: TypeAlias = tuple[Figures, Lines]

MODEL_NAMES = {
    "harmonic": "harmonic regression",
    "typical": "typical trajectory",
    "m1": "harmonic regression m1",
    "m2": "harmonic regression m2",
    "m3": "harmonic regression m3",
}
TOLD_TEMPO_ERROR = 0.02  # a tempo that is further off is warned of


@dataclass(frozen=True)
class Wanted:
    """What is made of clips.

    Attributes
    ----------
    settings : Settings
    loop : LoopOptions
    files : LoopFiles
    report : Path, optional
        Folder for pictures; of several cycles each has a folder in it.
    every : bool
        Whether every range that repeats is wanted.
    n_loops : int, optional
        Of how many loops, the most persistent ones, each is followed.
    subsample : int
        Of so many frames only one is looked at.
    """

    settings: Settings
    loop: LoopOptions
    files: LoopFiles
    report: Path | None
    every: bool
    n_loops: int | None = None
    subsample: int = 1

    @property
    def several(self) -> bool:
        """Whether a clip may have several cycles."""
        return self.every or self.n_loops is not None

    def cycles(self, clip: Clip) -> Iterator[tuple[str, Extraction]]:
        """Yield the cycles of a clip, each with its number; an empty one where there is one."""
        from mocapdb.cycles import extract_cycle
        from mocapdb.cycles.extract import extract_cycles

        if self.subsample > 1:
            clip = clip.replace(
                channels=clip.channels[:: self.subsample], fps=clip.fps / self.subsample
            )
        if self.n_loops is not None:
            yield from self._most_persistent(clip, self.n_loops)
        elif self.every:
            for number, found in enumerate(extract_cycles(clip, self.settings), start=1):
                yield str(number), found
        else:
            yield "", extract_cycle(clip, self.settings)

    def _most_persistent(self, clip: Clip, n_loops: int) -> Iterator[tuple[str, Extraction]]:
        """Yield the cycles of the most persistent loops; those that are none are told."""
        from mocapdb.cycles import extract_cycle

        problems = []
        for rank in range(n_loops):
            settings = replace(self.settings, rank=rank, follow=True)
            try:
                found = extract_cycle(clip, settings)
            except NoPeriodError as problem:
                problems.append(f"rank {rank}: {problem}")
                continue
            yield str(rank), found
        if len(problems) == n_loops:
            raise NoPeriodError(problems[0])
        for text in problems:
            click.echo(f"no cycle: {text}", err=True)


def of_clip(clip: Clip, wanted: Wanted) -> Told:
    """Make the loop of a clip; return its figures, and lines that say the weightiest."""
    ((_, found),) = wanted.cycles(clip)
    figures, loop = _made(clip, found, wanted, wanted.files.path(), wanted.report)
    figures["pictures"] += _clip_pictures(clip, wanted, wanted.report)
    weakest = min(figures["evidence"], key=lambda name: figures["evidence"][name])
    lines = [
        ("clip", f"{clip.name}, frames {figures['start']}:{figures['end']} of {len(clip)}"),
        ("period", f"{found.cycle.period_s:.3f} s, {figures['period_frames']:.1f} frames"),
        ("laps", f"{found.laps:.2f}"),
        (
            "confidence",
            f"{figures['confidence']:.2f}, weakest evidence: {weakest}"
            + (", doubtful" if figures["confidence"] < DOUBTFUL else ""),
        ),
        ("template", f"{found.template_error_rad:.3f} rad"),
        ("method", found.method),
        ("model", MODEL_NAMES[wanted.settings.model]),
        ("phase 0", figures["phase_0"]),
        *loop_lines(loop, figures["seam_steps"]),
        ("jerk", f"{figures['jerk_ratio']:.2f} of the clip's"),
    ]
    return figures, lines + where_lines(figures["output"], loop, figures["pictures"])


def of_parts(clip: Clip, wanted: Wanted, label: str = "") -> Told:
    """Make the loops of several cycles of a clip; with a label their files are called by it."""
    cycles, lines = [], []
    folder = wanted.report
    if folder is not None and label:
        folder /= label
    for number, found in wanted.cycles(clip):
        path = wanted.files.path(label or (clip.name if wanted.files.is_folder else ""), number)
        report = folder if folder is None or not number else folder / number
        figures, loop = _made(clip, found, wanted, path, report)
        cycles.append(figures)
        lines.append(_short_line(found, loop, figures))
    pictures = _clip_pictures(clip, wanted, folder)
    return {"clip": clip.name, "cycles": cycles, "pictures": pictures}, lines


def of_clips(reads: Sequence[tuple[str, Callable[[], Clip]]], wanted: Wanted) -> Told:
    """Make the loops of several clips; those without a cycle are listed and stop no other.

    Raises
    ------
    NoPeriodError
        If none has one.
    """
    from mocapdb.cli._console import progress_bar

    clips: list[Figures] = []
    lines: Lines = []
    without: dict[str, str] = {}
    names: set[str] = set()
    with progress_bar("Extracting") as progress:
        for done, (path, read) in enumerate(reads, start=1):
            progress(done, len(reads), path)
            try:
                clip = read()
                figures, own = of_parts(clip, wanted, as_file_name(clip.name, names))
            except MocapdbError as problem:
                without[path] = str(problem)
                click.echo(f"no cycle: {path}: {problem}", err=True)
                continue
            clips.append({"path": path, **figures})
            lines += [(clip.name, f"{frames} {text}") for frames, text in own]
    if not clips:
        raise NoPeriodError(f"Expected a motion that repeats in one of {len(reads)} clips.")
    warnings = [
        f"{figures['clip']}: {warning}"
        for each in clips
        for figures in each["cycles"]
        for warning in figures["warnings"]
    ]
    return {"clips": clips, "without_cycle": without, "warnings": warnings}, lines


def _made(
    clip: Clip, found: Extraction, wanted: Wanted, path: Path | None, report: Path | None
) -> tuple[Figures, Loop]:
    """Write the loop of a cycle, and the pictures; return what is told of them, and the loop."""
    from mocapdb.cycles import seam_steps
    from mocapdb.cycles.cycle_confidence import smoothness
    from mocapdb.cycles.synthesis.loop import jerk, root_relative_positions, turn_of_lap
    from mocapdb.cycles.synthesis.loop_start import start_phase

    options = wanted.loop.copy()
    options["fps"] = options["fps"] or clip.fps
    loop = found.loop(**options)
    evidence = found.evidence | ({"pops": smoothness(loop.pops)} if loop.pops else {})
    lap = one_lap(loop)
    rate = loop.lap_frames / found.cycle.period_s
    turn = turn_of_lap(found.cycle, options["root"])
    jerk_ratio = jerk(root_relative_positions(lap), rate, closed=True, turn=turn) / max(
        found.source_jerk, 1e-300
    )
    wanted.files.write(loop, path)
    pictures: list[str] = []
    if report is not None:
        from mocapdb.cli._cycle_report import write_report

        start = start_phase(found.cycle, options["start"]).phase
        pictures = write_report(report, found, lap, start, turn)
    every = wanted.subsample
    first, stop = (every * frame for frame in found.frames)
    figures = {
        "clip": clip.name,
        **assumed_json(clip),
        "start": first,
        "end": min(stop, len(clip)),
        "rank": None if found.topology is None else found.topology.rank,
        "period_frames": every * found.period_frames,
        "period_s": found.cycle.period_s,
        "laps": found.laps,
        "confidence": min(evidence.values()),
        "template_error_rad": found.template_error_rad,
        "method": found.method,
        "model": wanted.settings.model,
        "phase_0": _phase_0(found, wanted),
        **loop_figures(loop, seam_steps(lap)),
        "rmse_rad": found.rmse_rad,
        "evidence": evidence,
        "periods_frames": {
            "autocorrelation": every * float(found.guess.frames),
            "cohomology": (
                None if found.topology is None else every * found.topology.period_frames
            ),
        },
        "jerk_ratio": jerk_ratio,
        "warnings": [*found.warnings, *loop_warnings(loop)],
        "pictures": pictures,
        "output": None if path is None else str(path),
    }
    return figures, loop


def _clip_pictures(clip: Clip, wanted: Wanted, folder: Path | None) -> list[str]:
    """Write the pictures of a whole clip, where there is a folder for them."""
    if folder is None:
        return []
    from mocapdb.cli._cycle_report import write_clip_report

    return write_clip_report(folder, clip, wanted.settings)


def _phase_0(found: Extraction, wanted: Wanted) -> str:
    from mocapdb.cycles.synthesis.loop_start import start_phase

    event = start_phase(found.cycle, wanted.loop["start"]).event
    animate = wanted.loop["animate"]
    if animate is None or found.cycle.skeleton.names[0] in animate:
        return event
    return f"where the clip has its {event}"


def _short_line(found: Extraction, loop: Loop, figures: Figures) -> tuple[str, str]:
    """Return the frames of a cycle, and the weightiest of it in a line."""
    text = f"{found.laps:.2f} laps of {found.cycle.period_s:.3f} s"
    text += f" by {found.method}, confidence {figures['confidence']:.2f}"
    if figures["confidence"] < DOUBTFUL:
        text += " (doubtful)"
    if loop.pops:
        text += f", pops: {_pops(loop)}"
    if figures["output"] is not None:
        text += f", {figures['output']}"
    return f"{figures['start']}:{figures['end']}", text


def loop_figures(loop: Loop, seam: float) -> Figures:
    """Return what is told of every loop."""
    return {
        "lap_frames": loop.lap_frames,
        "tempo_error": loop.tempo_error,
        "seam_steps": seam,
        **feet_figures(loop),
    }


def feet_figures(loop: Loop | Transition) -> Figures:
    """Return what is told of how feet are held."""
    return {
        "foot_slide_mm": {"before": loop.slide_before_mm, "after": loop.slide_after_mm},
        "held_share": loop.held_share,
        "pops": loop.pops,
    }


def loop_lines(loop: Loop, seam: float) -> Lines:
    """Return lines that tell of a loop."""
    frames = f"{loop.lap_frames} frames a lap at {loop.clip.fps:g} Hz"
    pace = "longer" if loop.tempo_error > 0 else "shorter"
    return [
        ("tempo", f"{frames}, {abs(100 * loop.tempo_error):.2f} % {pace} than the motion"),
        ("seam", f"{seam:.2f} median steps"),
        ("feet", f"slide {loop.slide_before_mm:.1f} mm, held {loop.slide_after_mm:.1f} mm"),
        ("pops", _pops(loop) or "none"),
    ]


def where_lines(output: str | None, loop: Loop, pictures: Sequence[str]) -> Lines:
    """Return lines that tell which files were written."""
    lines = []
    if output is not None:
        lines.append(("loop", f"{output}: {len(loop.clip)} frames at {loop.clip.fps:g} Hz"))
    if pictures:
        lines.append(("pictures", ", ".join(pictures)))
    return lines


def one_lap(loop: Loop) -> Clip:
    """Return a lap of the body of a loop, without the joints above it."""
    from mocapdb.motion.body import part_from_scene

    return part_from_scene(loop.clip)[0][: loop.lap_frames]


def _pops(loop: Loop) -> str:
    return ", ".join(f"{joint} {times:.1f} times" for joint, times in loop.pops.items())


def loop_warnings(loop: Loop) -> list[str]:
    """Return a warning where the tempo is another one, where feet slip, and of joints that pop."""
    rate = loop.clip.fps * (1.0 + loop.tempo_error)  # so many frames in the motion's own time
    pace = [
        f"a lap plays {1.0 + loop.tempo_error:.3g} times as long as the motion takes: --out-fps "
        f"{rate:.4g} keeps its tempo"
    ]
    return (pace if abs(loop.tempo_error) > TOLD_TEMPO_ERROR else []) + feet_warnings(loop)


def feet_warnings(loop: Loop | Transition) -> list[str]:
    """Return a warning where feet slip, and of joints that pop."""
    held = (
        f"feet are held by {loop.held_share:.0%} only: a leg that is nearly straight would pop"
        if loop.held_share > 0.0
        else "feet are not held: a leg that is nearly straight would pop"
    )
    return ([held] if loop.held_share < 1.0 else []) + [
        f"{joint} pops where its foot is held: its peak acceleration is {times:.1f} times that "
        "with --loose-feet"
        for joint, times in loop.pops.items()
    ]
