"""``mocapdb cycle``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import click

from mocapdb.cli._assumed import assumed_json, assumed_together
from mocapdb.cli._console import counted, emit_json, progress_bar
from mocapdb.cli._cycle_options import cycle_settings, search_options
from mocapdb.cli._options import (
    FRAMES,
    PATH,
    json_option,
    loop_options,
    original_option,
    where_option,
)
from mocapdb.cli._reader import Reader, out_fps_option, reading_options

if TYPE_CHECKING:
    from mocapdb.cycles import Extraction, Loop, Settings
    from mocapdb.cycles.class_cycle import MirrorMembers
    from mocapdb.cycles.cycle import RootMotion
    from mocapdb.cycles.synthesis.loop_start import Start
    from mocapdb.motion.clip import Clip

Figures = dict[str, Any]
Lines = list[tuple[str, str]]


class LoopOptions(TypedDict):
    """What `make_loop` is told, but for the cycle."""

    fps: float | None
    n_laps: int
    root: RootMotion
    hold_feet: bool
    start: Start


@click.command()
@click.argument("source", metavar="CLIP|LIB", type=PATH)
@click.option("-o", "--output", type=PATH, help="Loop: .bvh, .amc or .npz.")
@click.option("--class", "label", help="Of a library: the cycle of this class, which it keeps.")
@where_option
@click.option(
    "--mirror-members",
    type=click.Choice(["never", "auto"]),
    default="never",
    show_default=True,
    help="Of a class: whether clips that fit far better with left and right exchanged are "
    "mirrored. Good for motions of one hand; never for work on asymmetry.",
)
@click.option("--clip", "name", help="Of a library: the cycle of this clip.")
@click.option("--frames", type=FRAMES, help="Only frames A:B of the clip, end-exclusive.")
@click.option("--every", is_flag=True, help="Of every range that repeats, numbering the outputs.")
@click.option("--report", type=PATH, help="Folder for pictures.")
@click.option(
    "--clean/--no-clean", default=None,
    help="Search for faults and repair them first; of a class, the clips that nobody has searched. "
    "With neither it is said how many these are.",
)  # fmt: skip
@original_option
@out_fps_option("Frame rate of the loop; the clip's by default.")
@click.option(
    "--start",
    type=click.Choice(["auto", "left-contact", "calmest"]),
    default="auto",
    show_default=True,
    help="Where the loop starts, phase 0: at a strike of the left foot, or where the body moves "
    "least; by default at the strike where feet take turns.",
)
@loop_options
@search_options
@reading_options
@json_option
def cycle(
    source: Path,
    output: Path | None,
    label: str | None,
    where: dict[str, str],
    mirror_members: MirrorMembers,
    name: str | None,
    frames: slice | None,
    every: bool,
    report: Path | None,
    clean: bool | None,
    original: bool,
    out_fps: float | None,
    laps: int,
    in_place: bool,
    loose_feet: bool,
    start: Start,
    as_json: bool,
    reader: Reader,
    **search: Any,
) -> None:
    """Find the cycle of a clip, or of a class of a library, and write it as a clip that loops.

    Nothing needs to be set. A clip in which nothing repeats is an error.

    \b
    Example:
      mocapdb cycle 07_01.amc -o loop.bvh --report pictures
      mocapdb cycle cmu.mocapdb --class walk -o walk.bvh
      mocapdb cycle wave.bvh --joints RightArm,RightForeArm,RightHand
    """
    if label is not None and (name is not None or frames is not None or report is not None):
        raise click.UsageError("--class goes with none of --clip, --frames, --every, --report.")
    if every and (label is not None or report is not None):
        raise click.UsageError("--every and --report or --class do not go together.")
    if where and label is None:
        raise click.UsageError("Expected --where with --class: it chooses clips of a class.")
    if source.is_dir():
        reader.expect_files("a library's clips are read already")
    reader.note_out_fps(out_fps)
    settings = cycle_settings(**search)
    options: LoopOptions = {
        "fps": out_fps,
        "n_laps": laps,
        "root": "in-place" if in_place else "advance",
        "hold_feet": not loose_feet,
        "start": start,
    }
    if label is not None:
        figures, lines = _of_class(
            source, label, where, mirror_members, settings, output, bool(clean), original, **options
        )
    else:
        clip, faults = _clip(source, name, frames, reader, bool(clean), original)
        if every:
            figures, lines = _of_every_range(clip, settings, output, **options)
        else:
            figures, lines = _of_clip(clip, settings, output, report, **options)
        figures["faults"] = faults
        lines += _fault_lines(faults)
    if as_json:
        emit_json(figures)
        return
    for key, value in lines:
        click.echo(f"{key:<12}{value}")
    for warning in figures.get("warnings", ()):
        click.echo(f"warning: {warning}", err=True)


def _clip(
    source: Path,
    name: str | None,
    frames: slice | None,
    reader: Reader,
    clean: bool,
    original: bool,
) -> tuple[Clip, Figures | None]:
    """Return the clip, and what is known of its faults; None where nobody has searched it."""
    faults: Figures | None = None
    if source.is_dir():
        if name is None:
            raise click.UsageError("A library needs --class or --clip.")
        from mocapdb.library import Library

        with Library(source, original=original) as library:
            record = library.record(name)
            clip, revision = library.decode(record), library.revision(record)
        if revision is not None:
            taken = () if original else revision.spans
            n_repaired = sum(bool(span["repaired"]) for span in taken)
            faults = {
                "spans": [dict(span) for span in revision.spans],
                "repaired": n_repaired,
                "left": len(revision.spans) - n_repaired,
            }
            clean = False
    elif name is not None:
        raise click.UsageError("--clip names a clip of a library.")
    else:
        clip = reader.read(source, drop_tpose=True)
    if clean:
        from mocapdb.cleaning import clean_clip
        from mocapdb.library.building.revise_clips import span_rows

        found = clean_clip(clip)
        spans = span_rows(clip, found.clip, found.repairs)
        clip, n_repaired = found.clip, sum(span["repaired"] for span in spans)
        faults = {"spans": spans, "repaired": n_repaired, "left": len(spans) - n_repaired}
    return clip if frames is None else clip[frames], faults


def _fault_lines(faults: Figures | None) -> Lines:
    """Return what is known of the faults of the clip that a cycle is from."""
    if faults is None:
        return []
    return [("faults", f"{faults['repaired']} repaired first, {faults['left']} flagged and left")]


def _of_clip(
    clip: Clip,
    settings: Settings,
    output: Path | None,
    report: Path | None,
    **options: Unpack[LoopOptions],
) -> tuple[Figures, Lines]:
    from mocapdb.cycles import extract_cycle, seam_steps
    from mocapdb.cycles.synthesis.loop import jerk, root_relative_positions

    found = extract_cycle(clip, settings)
    loop = found.loop(**options)
    _write(loop, output)
    lap = _one_lap(loop, options)
    jerk_ratio = jerk(root_relative_positions(_body(loop)), loop.clip.fps, closed=True) / max(
        found.source_jerk, 1e-300
    )
    pictures: list[str] = []
    if report is not None:
        from mocapdb.cli._cycle_report import write_report

        pictures = write_report(report, found, lap)
    figures = {
        **_figures(clip, found, options["start"], output),
        "seam_steps": seam_steps(lap),
        "rmse_rad": found.rmse_rad,
        "evidence": found.evidence,
        "periods_frames": {
            "autocorrelation": float(found.guess.frames),
            "cohomology": None if found.topology is None else found.topology.period_frames,
        },
        "foot_slide_mm": _slide(loop),
        "jerk_ratio": jerk_ratio,
        "pops": loop.pops,
        "warnings": [*found.warnings, *_pop_warnings(loop)],
        "pictures": pictures,
    }
    weakest = min(found.evidence, key=lambda name: found.evidence[name])
    lines = [
        ("clip", f"{clip.name}, frames {found.frames[0]}:{found.frames[1]} of {len(clip)}"),
        ("period", f"{found.cycle.period_s:.3f} s, {found.period_frames:.1f} frames"),
        ("laps", f"{found.laps:.2f}"),
        ("confidence", f"{found.confidence:.2f}, weakest evidence: {weakest}"),
        ("template", f"{found.template_error_rad:.3f} rad"),
        ("method", found.method),
        ("phase 0", figures["phase_0"]),
        ("seam", f"{figures['seam_steps']:.2f} median steps"),
        ("feet", f"slide {loop.slide_before_mm:.1f} mm, held {loop.slide_after_mm:.1f} mm"),
        ("jerk", f"{jerk_ratio:.2f} of the clip's"),
    ]
    return figures, lines + _where(output, loop, pictures)


def _of_every_range(
    clip: Clip, settings: Settings, output: Path | None, **options: Unpack[LoopOptions]
) -> tuple[Figures, Lines]:
    from mocapdb.cycles.extract import extract_cycles

    cycles, lines = [], []
    for number, found in enumerate(extract_cycles(clip, settings), start=1):
        path = None
        if output is not None:
            path = output.with_name(f"{output.stem}_{number}{output.suffix}")
            _write(found.loop(**options), path)
        cycles.append(_figures(clip, found, options["start"], path))
        written = "" if path is None else f", {path}"
        text = f"{found.laps:.2f} laps of {found.cycle.period_s:.3f} s"
        start, stop = found.frames
        lines.append((f"{start}:{stop}", f"{text}, confidence {found.confidence:.2f}{written}"))
    return {"clip": clip.name, "cycles": cycles}, lines


def _of_class(
    source: Path,
    label: str,
    where: dict[str, str],
    mirror_members: MirrorMembers,
    settings: Settings,
    output: Path | None,
    clean: bool,
    original: bool,
    **options: Unpack[LoopOptions],
) -> tuple[Figures, Lines]:
    import numpy as np

    from mocapdb.cycles import make_loop, seam_steps
    from mocapdb.cycles.synthesis.loop_start import start_phase
    from mocapdb.library import Library
    from mocapdb.library.cycles_file import write_cycle
    from mocapdb.library.searching.class_cycles import make_cycle

    with Library(source, original=original) as library, progress_bar("Extracting") as progress:
        made = make_cycle(
            library,
            label,
            settings,
            where=where,
            mirror_members=mirror_members,
            clean=clean,
            progress=progress,
        )
    mean = made.mean
    # what is kept as the cycle of a class is that of all its clips, at their best
    kept = None if where or original else str(write_cycle(source, mean))
    begin = start_phase(mean.cycle, options["start"])
    loop = make_loop(
        mean.cycle.rephased(begin.phase),
        options["fps"] or made.fps,
        n_laps=options["n_laps"],
        root=options["root"],
        hold_feet=options["hold_feet"],
        most_jerk=made.most_jerk,
    )
    if made.scene is not None:
        loop = loop._replace(clip=made.scene.put_back(loop.clip))
    _write(loop, output)
    spread_deg = np.rad2deg(np.sqrt((mean.spread_rad**2).mean(axis=0)))
    left_out = mean.left_out or {}
    figures = {
        "library": str(source),
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
        "seam_steps": seam_steps(_one_lap(loop, options)),
        "foot_slide_mm": _slide(loop),
        "pops": loop.pops,
        "warnings": [*_pop_warnings(loop), *_unsearched(source, made.unsearched)],
        "kept_in": kept,
        "output": None if output is None else str(output),
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
        ("feet", f"slide {loop.slide_before_mm:.1f} mm, held {loop.slide_after_mm:.1f} mm"),
    ]
    if kept is not None:
        lines.append(("kept in", kept))
    return figures, lines + _where(output, loop, [])


def _figures(clip: Clip, found: Extraction, start: Start, output: Path | None) -> Figures:
    """Return what is told of every cycle that was found."""
    from mocapdb.cycles.synthesis.loop_start import start_phase

    first, stop = found.frames
    return {
        "clip": clip.name,
        **assumed_json(clip),
        "start": first,
        "end": stop,
        "period_frames": found.period_frames,
        "period_s": found.cycle.period_s,
        "laps": found.laps,
        "confidence": found.confidence,
        "template_error_rad": found.template_error_rad,
        "method": found.method,
        "phase_0": start_phase(found.cycle, start).event,
        "output": None if output is None else str(output),
    }


def _write(loop: Loop, output: Path | None) -> None:
    from mocapdb.io import write_clip

    if output is not None:
        write_clip(loop.clip, output)


def _body(loop: Loop) -> Clip:
    """Return a loop without the joints above the body, from which nothing is looked at."""
    from mocapdb.motion.body import part_from_scene

    return part_from_scene(loop.clip)[0]


def _one_lap(loop: Loop, options: LoopOptions) -> Clip:
    return _body(loop)[: len(loop.clip) // options["n_laps"]]


def _slide(loop: Loop) -> dict[str, float]:
    return {"before": loop.slide_before_mm, "after": loop.slide_after_mm}


def _pop_warnings(loop: Loop) -> list[str]:
    return [
        f"{joint} pops where its foot is held: its peak acceleration is {times:.1f} times that "
        "with --loose-feet"
        for joint, times in loop.pops.items()
    ]


def _unsearched(library: Path, names: Sequence[str]) -> list[str]:
    """Return a warning if members of a class were never searched for faults."""
    if not names:
        return []
    return [
        f"{counted(len(names), 'member')} of the class never searched for faults: add --clean, or "
        f"once for all: mocapdb clean {library} --apply"
    ]


def _where(output: Path | None, loop: Loop, pictures: list[str]) -> Lines:
    lines = []
    if output is not None:
        lines.append(("loop", f"{output}: {len(loop.clip)} frames at {loop.clip.fps:g} Hz"))
    if pictures:
        lines.append(("pictures", ", ".join(pictures)))
    return lines
