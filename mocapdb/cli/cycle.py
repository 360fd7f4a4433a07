"""``mocapdb cycle``."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._console import emit_json
from mocapdb.cli._csv import csv_option, each_of
from mocapdb.cli._cycle_classes import Members, of_class, of_every_class
from mocapdb.cli._cycle_clips import Figures, Lines, Wanted, of_clip, of_clips, of_parts
from mocapdb.cli._cycle_options import cycle_settings, search_options
from mocapdb.cli._cycle_output import FORMATS, LoopFiles, LoopOptions
from mocapdb.cli._options import (
    FRAMES,
    PATH,
    as_option,
    closing_options,
    frames_of,
    json_option,
    loop_options,
    original_option,
    where_option,
)
from mocapdb.cli._reader import Reader, out_fps_option, reading_options

if TYPE_CHECKING:
    from mocapdb.cycles.class_cycle import MirrorMembers
    from mocapdb.cycles.synthesis.loop_start import Start
    from mocapdb.motion.clip import Clip


@click.command()
@click.argument("sources", nargs=-1, required=True, metavar="CLIP...|DIR|LIB", type=PATH)
@click.option(
    "-o", "--output", type=PATH,
    help="Loop: .bvh, .amc, .npz, .glb (root motion on a bone of its own), .fbx, .gif, .mp4 or "
    ".html. Of several loops loop.bvh becomes loop_1.bvh or loop_CLIP.bvh; a name without a suffix "
    "is a folder.",
)  # fmt: skip
@click.option(
    "--format", "suffix", type=click.Choice(FORMATS), default="bvh", show_default=True,
    help="Of the loops in a folder.",
)  # fmt: skip
@as_option
@click.option("--class", "label", help="Of a library: the cycle of this class, which it keeps.")
@click.option(
    "--every-class", is_flag=True,
    help="Of a library: the cycle of every class; in a folder with a table of its curves each.",
)  # fmt: skip
@click.option(
    "--curves", type=PATH,
    help="Of a class: table of its angles by phase and their spread over the clips, .csv.",
)  # fmt: skip
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
@click.option(
    "--loops", "n_loops", type=click.IntRange(1), metavar="N",
    help="Of each of the N most persistent loops that cohomology finds, as --rank 0 to N - 1, "
    "numbering the outputs by rank.",
)  # fmt: skip
@click.option(
    "--animate", metavar="JOINT,...",
    help="Only these joints are looked at and move; the rest of the body keeps its first pose.",
)  # fmt: skip
@click.option(
    "--subsample", type=click.IntRange(1), default=1, show_default=True,
    help="Look at one of so many frames only; the loop has the clip's rate all the same.",
)  # fmt: skip
@click.option("--report", type=PATH, help="Folder for pictures; of several cycles one each in it.")
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
@closing_options
@loop_options
@search_options
@reading_options
@csv_option(each_of("clips", "classes", "cycles"))
@json_option
def cycle(
    sources: tuple[Path, ...],
    output: Path | None,
    suffix: str,
    representation: str | None,
    label: str | None,
    every_class: bool,
    curves: Path | None,
    where: dict[str, str],
    mirror_members: MirrorMembers,
    name: str | None,
    frames: slice | None,
    every: bool,
    n_loops: int | None,
    animate: str | None,
    subsample: int,
    report: Path | None,
    clean: bool | None,
    original: bool,
    out_fps: float | None,
    laps: int,
    in_place: bool,
    loose_feet: bool,
    length: int | None,
    closed: bool,
    start: Start,
    as_json: bool,
    reader: Reader,
    **search: Any,
) -> None:
    """Find the cycle of clips, or of a class of a library, and write it as a clip that loops.

    Nothing needs to be set. A clip in which nothing repeats is an error; of several clips those
    are listed and do not stop the others.

    \b
    Example:
      mocapdb cycle 07_01.amc -o loop.bvh --report pictures
      mocapdb cycle 07_01.amc -o loop.glb --closed --length 32
      mocapdb cycle takes/ -o loops/ --format glb
      mocapdb cycle cmu.mocapdb --class walk -o walk.bvh
      mocapdb cycle cmu.mocapdb --every-class -o cycles/
      mocapdb cycle wave.bvh --joints RightArm,RightForeArm,RightHand
    """
    of_classes = label is not None or every_class
    if label is not None and every_class:
        raise click.UsageError("Give --class or --every-class, one of them.")
    if of_classes and (name is not None or frames is not None or report is not None):
        raise click.UsageError(
            "--class and --every-class go with none of --clip, --frames, --every, --report."
        )
    if every and of_classes:
        raise click.UsageError("--every and --class or --every-class do not go together.")
    if n_loops is not None and (every or of_classes or search["rank"]):
        raise click.UsageError("--loops goes with none of --every, --class and --rank.")
    if where and not of_classes:
        raise click.UsageError("Expected --where with --class: it chooses clips of a class.")
    if curves is not None and label is None:
        raise click.UsageError("Expected --curves with --class: it is a table of a class.")
    is_of_library = of_classes or name is not None
    if is_of_library and len(sources) > 1:
        raise click.UsageError(
            "--class, --every-class and --clip choose of one library, but got several."
        )
    if is_of_library and not sources[0].is_dir() and sources[0].exists():
        raise click.UsageError(
            f"--class, --every-class and --clip are for a library, but {sources[0]} is a file."
        )
    paths = [] if is_of_library else _clips_of(sources, reader)
    many = len(paths) > 1 or (any(source.is_dir() for source in sources) and not is_of_library)
    files = LoopFiles(output, in_place, suffix, representation, reader.said.blender)
    files.check(many=many or every or every_class or n_loops is not None)
    if is_of_library:
        reader.expect_files("a library's clips are read already")
    reader.note_out_fps(out_fps)
    moving = None if animate is None else tuple(name.strip() for name in animate.split(","))
    if search["joints"] is None:
        search["joints"] = animate
    options: LoopOptions = {
        "fps": out_fps,
        "n_laps": laps,
        "root": files.root,
        "hold_feet": not loose_feet,
        "start": start,
        "lap_frames": length,
        "closed": closed,
        "animate": moving,
    }
    settings = cycle_settings(**search)
    wanted = Wanted(settings, options, files, report, every, n_loops, subsample)
    if of_classes:
        from mocapdb.library import Library

        with Library(sources[0], original=original) as library:
            members = Members(where, mirror_members, bool(clean))
            if label is None:
                figures, lines = of_every_class(library, members, wanted)
            else:
                figures, lines = of_class(library, label, members, wanted, output, curves)
    elif many:
        reads = [
            (str(path), partial(_without_faults, path, frames, reader, bool(clean)))
            for path in paths
        ]
        figures, lines = of_clips(reads, wanted)
    else:
        clip, faults = _clip(sources[0], name, frames, reader, bool(clean), original)
        figures, lines = (of_parts if wanted.several else of_clip)(clip, wanted)
        if wanted.several:
            figures["warnings"] = _of_parts(figures)
        figures["faults"] = faults
        lines += _fault_lines(faults)
    if as_json:
        emit_json(figures)
        return
    for key, value in lines:
        click.echo(f"{key:<12}{value}")
    for warning in figures.get("warnings", ()):
        click.echo(f"warning: {warning}", err=True)


def _clips_of(sources: Sequence[Path], reader: Reader) -> list[Path]:
    """Return the files that are named, and those of the folders that are."""
    from mocapdb.library.layout import is_library

    paths: list[Path] = []
    for source in sources:
        if is_library(source):
            raise click.UsageError("A library needs --class or --clip.")
        if source.is_dir():
            paths += reader.clips_in(source)
        else:
            paths.append(source)
    return paths


def _of_parts(figures: Figures) -> list[str]:
    return [
        f"frames {part['start']}:{part['end']}: {warning}"
        for part in figures["cycles"]
        for warning in part["warnings"]
    ]


def _without_faults(path: Path, frames: slice | None, reader: Reader, clean: bool) -> Clip:
    return _clip(path, None, frames, reader, clean, original=False)[0]


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
    if name is not None:
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
    else:
        clip = reader.read(source, drop_tpose=True)
    if clean:
        from mocapdb.cleaning import clean_clip
        from mocapdb.library.building.revise_clips import span_rows

        found = clean_clip(clip)
        spans = span_rows(clip, found.clip, found.repairs)
        clip, n_repaired = found.clip, sum(span["repaired"] for span in spans)
        faults = {"spans": spans, "repaired": n_repaired, "left": len(spans) - n_repaired}
    return frames_of(clip, frames), faults


def _fault_lines(faults: Figures | None) -> Lines:
    """Return what is known of the faults of the clip that a cycle is from."""
    if faults is None:
        return []
    return [("faults", f"{faults['repaired']} repaired first, {faults['left']} flagged and left")]
