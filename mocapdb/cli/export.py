"""``mocapdb export``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mocapdb.cli._console import emit_json, progress_bar
from mocapdb.cli._options import (
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
    help="File to write: .amc (with an .asf), .bvh, .npz, .glb, or animated .gif, .mp4, .html.",
)  # fmt: skip
@as_option
@original_option
@json_option
def export(
    library: Path,
    clip: str,
    output: Path,
    representation: RepresentationName | None,
    original: bool,
    as_json: bool,
) -> None:
    """Decode a clip of a library into an AMC, BVH, NPZ or GLB file, or draw it in motion.

    \b
    Example:
      mocapdb export cmu.mocapdb 07_01 -o 07_01.bvh
      mocapdb export cmu.mocapdb 07_01 -o 07_01.gif
      mocapdb export cmu.mocapdb 07_01 --as aligned -o 07_01.csv
    """
    from mocapdb.library import Library
    from mocapdb.library.library import assumed_of
    from mocapdb.scenes.animation import is_animation, write_animation

    if representation is not None:
        check_representation_file(output)
    with Library(library, original=original) as opened:
        if is_animation(output):
            record = opened.record(clip)
            with progress_bar("Drawing") as progress:
                write_animation(opened.clip(record.name), output, progress=progress)
        else:
            record = opened.export(clip, output, representation)
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
