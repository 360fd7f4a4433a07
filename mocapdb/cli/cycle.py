"""``mocapdb cycle``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._console import emit_json, json_option, progress_bar
from mocapdb.cli._frames import FRAMES

if TYPE_CHECKING:
    from mocapdb.cycles import Cycle, Extraction, Loop
    from mocapdb.motion.clip import Clip

LEAST_CONFIDENCE = 0.5


@click.command()
@click.argument("source", metavar="CLIP|LIB", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Loop: .bvh, .amc or .npz.")
@click.option("--class", "label", help="Of a library: the cycle of this class, which it keeps.")
@click.option("--clip", "name", help="Of a library: the cycle of this clip.")
@click.option("--frames", type=FRAMES, help="Only frames A:B of the clip, end-exclusive.")
@click.option(
    "--model", type=click.Choice(["m1", "m2", "m3"]), default="m1", show_default=True,
    help="Harmonic regression: weighted, of poses alone, unweighted.",
)  # fmt: skip
@click.option("--harmonics", type=click.IntRange(1), default=30, show_default=True)
@click.option(
    "--timing", type=click.Choice(["linear", "drift", "whole-laps", "uniform", "mixture"]),
    help="How phase becomes time; chosen from the clip by default.",
)  # fmt: skip
@click.option("--prime", type=int, default=47, show_default=True, help="Of the cohomology.")
@click.option("--fps", type=float, help="Frame rate of the loop; the clip's by default.")
@click.option("--laps", type=click.IntRange(1), default=1, show_default=True)
@click.option("--in-place", is_flag=True, help="Leave out the steady advance of the root.")
@click.option("--loose-feet", is_flag=True, help="Do not hold feet where they rest.")
@click.option("--every", is_flag=True, help="Of every range that repeats, numbering the outputs.")
@click.option("--report", type=click.Path(path_type=Path), help="Folder for pictures.")
@json_option
def cycle(
    source: Path,
    output: Path | None,
    label: str | None,
    name: str | None,
    frames: slice | None,
    model: str,
    harmonics: int,
    timing: str | None,
    prime: int,
    fps: float | None,
    laps: int,
    in_place: bool,
    loose_feet: bool,
    every: bool,
    report: Path | None,
    as_json: bool,
) -> None:
    """Find the cycle of a clip, or of a class of a library, and write it as a clip that loops.

    Nothing needs to be set. A clip in which nothing repeats is an error.

    \b
    Example:
      mocapdb cycle 07_01.amc -o loop.bvh --report pictures
      mocapdb cycle cmu.mocapdb --class walk -o walk.bvh
    """
    from mocapdb.cycles.extract import Settings

    settings = Settings(
        model=model,  # type: ignore[arg-type] # click has checked it
        n_harmonics=harmonics,
        timing=timing,  # type: ignore[arg-type]
        prime=prime,
    )

    def loop_of(found: Cycle, rate: float, most_jerk: float | None) -> Loop:
        from mocapdb.cycles.loop import make_loop

        return make_loop(
            found,
            fps or rate,
            n_laps=laps,
            root="in-place" if in_place else "advance",
            hold_feet=not loose_feet,
            most_jerk=most_jerk,
        )

    if label is not None:
        if name is not None or frames is not None or report is not None or every:
            raise click.UsageError("--class goes with none of --clip, --frames, --every, --report.")
        figures, lines = _of_class(source, label, settings, output, loop_of)
    elif every:
        if report is not None:
            raise click.UsageError("--every and --report do not go together.")
        clip = _clip(source, name, frames)
        figures, lines = _of_every_range(clip, settings, output, loop_of)
    else:
        clip = _clip(source, name, frames)
        figures, lines = _of_clip(clip, settings, output, report, loop_of)
    if as_json:
        emit_json(figures)
        return
    for key, value in lines:
        click.echo(f"{key:<12}{value}")
    for warning in figures.get("warnings", ()):
        click.echo(f"warning: {warning}", err=True)


def _clip(source: Path, name: str | None, frames: slice | None) -> Clip:
    from mocapdb.io import read_clip

    if source.is_dir():
        if name is None:
            raise click.UsageError("A library needs --class or --clip.")
        from mocapdb.library import Library

        with Library(source) as library:
            clip = library.clip(name)
    elif name is not None:
        raise click.UsageError("--clip names a clip of a library.")
    else:
        clip = read_clip(source, drop_tpose=True)
    return clip if frames is None else clip[frames]


def _of_clip(
    clip: Clip,
    settings: Any,
    output: Path | None,
    report: Path | None,
    loop_of: Callable[[Cycle, float, float | None], Loop],
) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    from dataclasses import replace

    from mocapdb.cycles.extract import extract_cycle
    from mocapdb.cycles.loop import around_root, calmest_phase, jerk, seam_steps
    from mocapdb.io import write_clip

    found = extract_cycle(clip, settings)
    most_jerk = jerk(around_root(found.clip), clip.fps, closed=False)
    calm = found.cycle.rephased(calmest_phase(found.cycle))
    loop = loop_of(calm, clip.fps, most_jerk)
    one_lap = loop.clip[: round(found.cycle.period_s * loop.clip.fps)]
    jerk_ratio = jerk(around_root(loop.clip), loop.clip.fps, closed=True) / max(most_jerk, 1e-300)
    if output is not None:
        write_clip(loop.clip, output)
    pictures: list[str] = []
    if report is not None:
        from mocapdb.cli._cycle_report import write_report

        pictures = write_report(report, replace(found, cycle=calm), one_lap)
    start, stop = found.frames
    figures = {
        "clip": clip.name,
        "period_frames": found.period_frames,
        "period_s": found.cycle.period_s,
        "laps": found.laps,
        "confidence": found.confidence,
        "template_error_rad": found.template_error_rad,
        "seam_steps": seam_steps(one_lap),
        "method": found.method,
        "output": None if output is None else str(output),
        "rmse_rad": found.rmse_rad,
        "start": start,
        "end": stop,
        "evidence": found.evidence,
        "periods_frames": _periods(found),
        "foot_slide_mm": {"before": loop.slide_before_mm, "after": loop.slide_after_mm},
        "jerk_ratio": jerk_ratio,
        "warnings": list(found.warnings),
        "pictures": pictures,
    }
    weakest = min(found.evidence, key=lambda name: found.evidence[name])
    lines = [
        ("clip", f"{clip.name}, frames {start}:{stop} of {len(clip)}"),
        ("period", f"{found.cycle.period_s:.3f} s, {found.period_frames:.1f} frames"),
        ("laps", f"{found.laps:.2f}"),
        ("confidence", f"{found.confidence:.2f}, weakest evidence: {weakest}"),
        ("template", f"{found.template_error_rad:.3f} rad"),
        ("method", found.method),
        ("seam", f"{figures['seam_steps']:.2f} median steps"),
        ("feet", f"slide {loop.slide_before_mm:.1f} mm, held {loop.slide_after_mm:.1f} mm"),
        ("jerk", f"{jerk_ratio:.2f} of the clip's"),
    ]
    return figures, lines + _where(output, loop, pictures)


def _of_every_range(
    clip: Clip,
    settings: Any,
    output: Path | None,
    loop_of: Callable[[Cycle, float, float | None], Loop],
) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    from mocapdb.cycles.extract import extract_cycles
    from mocapdb.cycles.loop import around_root, calmest_phase, jerk
    from mocapdb.io import write_clip

    cycles, lines = [], []
    for number, found in enumerate(extract_cycles(clip, settings), start=1):
        path = None
        if output is not None:
            path = output.with_name(f"{output.stem}_{number}{output.suffix}")
            most_jerk = jerk(around_root(found.clip), clip.fps, closed=False)
            calm = found.cycle.rephased(calmest_phase(found.cycle))
            write_clip(loop_of(calm, clip.fps, most_jerk).clip, path)
        start, stop = found.frames
        cycles.append(
            {
                "start": start,
                "end": stop,
                "period_frames": found.period_frames,
                "period_s": found.cycle.period_s,
                "laps": found.laps,
                "confidence": found.confidence,
                "template_error_rad": found.template_error_rad,
                "method": found.method,
                "output": None if path is None else str(path),
            }
        )
        written = "" if path is None else f", {path}"
        text = f"{found.laps:.2f} laps of {found.cycle.period_s:.3f} s"
        lines.append((f"{start}:{stop}", f"{text}, confidence {found.confidence:.2f}{written}"))
    return {"clip": clip.name, "cycles": cycles}, lines


def _periods(found: Extraction) -> dict[str, float | None]:
    topology = None if found.topology is None else found.topology.period_frames
    return {"autocorrelation": float(found.guess.frames), "cohomology": topology}


def _of_class(
    source: Path,
    label: str,
    settings: Any,
    output: Path | None,
    loop_of: Callable[[Cycle, float, float | None], Loop],
) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    import numpy as np

    from mocapdb.cycles.classes import average_cycles
    from mocapdb.cycles.extract import extract_cycle
    from mocapdb.cycles.loop import calmest_phase, seam_steps
    from mocapdb.errors import LibraryError, NoPeriodError
    from mocapdb.io import write_clip
    from mocapdb.library import Library
    from mocapdb.library.cycles import write_cycle

    cycles, left_out, rates = [], {}, []
    with Library(source) as library, progress_bar("Extracting") as progress:
        records = library.records(label=label)
        if not records:
            known = ", ".join(sorted(library.classes())) or "none"
            raise LibraryError(f"{source}: expected a class out of {known}, but got {label!r}.")
        for done, record in enumerate(records, start=1):
            try:
                found = extract_cycle(library.clip(record.name), settings)
            except NoPeriodError as problem:
                left_out[record.name] = str(problem)
            else:
                if found.confidence < LEAST_CONFIDENCE:
                    left_out[record.name] = f"doubtful: confidence {found.confidence:.2f}"
                else:
                    cycles.append(found.cycle)
                    rates.append(record.fps)
            progress(done, len(records), record.name)
    if not cycles:
        raise NoPeriodError(
            f"Expected clips of class {label!r} in which a motion repeats, but none of "
            f"{len(records)} does: {next(iter(left_out.values()))}"
        )
    mean = average_cycles(cycles, label)
    kept = write_cycle(source, mean)
    loop = loop_of(mean.cycle.rephased(calmest_phase(mean.cycle)), float(np.median(rates)), None)
    if output is not None:
        write_clip(loop.clip, output)
    one_lap = loop.clip[: round(mean.cycle.period_s * loop.clip.fps)]
    spread_deg = np.rad2deg(np.sqrt((mean.spread_rad**2).mean(axis=0)))
    left_out |= mean.left_out or {}
    figures = {
        "library": str(source),
        "class": label,
        "members": list(mean.members),
        "mirrored": list(mean.mirrored),
        "left_out": left_out,
        "period_s": mean.cycle.period_s,
        "spread_deg": dict(zip(mean.cycle.skeleton.names, spread_deg.tolist(), strict=True)),
        "seam_steps": seam_steps(one_lap),
        "foot_slide_mm": {"before": loop.slide_before_mm, "after": loop.slide_after_mm},
        "kept_in": str(kept),
        "output": None if output is None else str(output),
    }
    lines = [
        ("class", f"{label}: {len(mean.members)} clips, {len(left_out)} left out"),
        ("period", f"{mean.cycle.period_s:.3f} s"),
        ("spread", f"{float(spread_deg.mean()):.1f} degrees over joints and phases"),
        ("feet", f"slide {loop.slide_before_mm:.1f} mm, held {loop.slide_after_mm:.1f} mm"),
        ("kept in", str(kept)),
    ]
    return figures, lines + _where(output, loop, [])


def _where(output: Path | None, loop: Loop, pictures: list[str]) -> list[tuple[str, str]]:
    lines = []
    if output is not None:
        lines.append(("loop", f"{output}: {len(loop.clip)} frames at {loop.clip.fps:g} Hz"))
    if pictures:
        lines.append(("pictures", ", ".join(pictures)))
    return lines
