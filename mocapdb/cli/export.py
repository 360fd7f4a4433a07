"""``mocapdb export``."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from mocapdb.base.arrays import StrPath
from mocapdb.cli._console import emit_json, progress_bar
from mocapdb.cli._options import (
    EVENTS,
    PATH,
    as_option,
    check_representation_file,
    json_option,
    library_argument,
    original_option,
)

if TYPE_CHECKING:
    from mocapdb.motion.representations import RepresentationName


@click.command()
@library_argument
@click.argument("clip")
@click.option(
    "-o", "--output", required=True, type=PATH,
    help="File to write: .amc (with an .asf), .bvh, .npz, .fbx, .glb, or animated .gif, .mp4 or "
    ".html.",
)  # fmt: skip
@as_option
@original_option
@click.option("--blender", type=PATH, help="The Blender that writes .fbx, where it is not found.")
@json_option
def export(
    library: StrPath,
    clip: str,
    output: Path,
    representation: str | None,
    original: bool,
    blender: Path | None,
    as_json: bool,
) -> None:
    """Decode a clip of a library into an AMC, BVH, NPZ, FBX or GLB file, or draw it in motion.

    \b
    Example:
      mocapdb export cmu.mocapdb 07_01 -o 07_01.bvh
      mocapdb export cmu.mocapdb 07_01 -o 07_01.gif
      mocapdb export cmu.mocapdb 07_01 --as aligned -o 07_01.csv
      mocapdb export cmu.mocapdb 07_01 --as events -o 07_01-steps.csv
    """
    from mocapdb.library import Library
    from mocapdb.library.library import assumed_of
    from mocapdb.scenes.animation import is_animation

    if representation is not None:
        check_representation_file(output, representation)
    with Library(library, original=original) as opened:
        if representation == EVENTS:
            from mocapdb.gait import write_events

            record = opened.record(clip)
            write_events([opened.clip(record.name)], output)
        else:
            shown_as = cast("RepresentationName | None", representation)
            with progress_bar("Drawing") if is_animation(output) else nullcontext() as progress:
                record = opened.export(clip, output, shown_as, blender=blender, progress=progress)
        revision = opened.revision(record)
    is_cleaned = revision is not None and revision.changes and not original
    if as_json:
        emit_json(
            {
                "library": str(library),
                "clip": record.name,
                "output": str(output),
                **({"representation": representation} if representation else {}),
                "cleaned": is_cleaned,
                "frames": record.frames,
                **assumed_of(record),
            }
        )
        return
    if record.name != clip:
        suffix = output.suffix.lower()
        click.echo(f"{clip} is ambiguous: took {record.name}, read from a {suffix}.", err=True)
    shown = f" in {representation}" if representation else ""
    if is_cleaned:
        shown += ", as cleaned (--original: as captured)"
    click.echo(f"{output}: {record.frames} frames{shown} at {record.fps:g} Hz")
