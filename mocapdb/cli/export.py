"""``mocapdb export``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import emit_json, progress_bar
from mocapdb.cli._options import PATH, json_option, library_argument


@click.command()
@library_argument
@click.argument("clip")
@click.option(
    "-o", "--output", required=True, type=PATH,
    help="File to write: .amc (with an .asf), .bvh, .npz, .glb, or animated .gif, .mp4, .html.",
)  # fmt: skip
@json_option
def export(library: Path, clip: str, output: Path, as_json: bool) -> None:
    """Decode a clip of a library into an AMC, BVH, NPZ or GLB file, or draw it in motion.

    \b
    Example:
      mocapdb export cmu.mocapdb 07_01 -o 07_01.bvh
      mocapdb export cmu.mocapdb 07_01 -o 07_01.gif
    """
    from mocapdb.library import Library
    from mocapdb.library.library import assumed_of
    from mocapdb.scenes.animation import is_animation, write_animation

    with Library(library) as opened:
        if is_animation(output):
            record = opened.record(clip)
            with progress_bar("Drawing") as progress:
                write_animation(opened.clip(record.name), output, progress=progress)
        else:
            record = opened.export(clip, output)
    if as_json:
        emit_json(
            {
                "library": str(library),
                "clip": record.name,
                "output": str(output),
                "frames": record.frames,
                **assumed_of(record),
            }
        )
        return
    if record.name != clip:
        suffix = output.suffix.lower()
        click.echo(f"{clip} is ambiguous: took {record.name}, read from a {suffix}.", err=True)
    click.echo(f"{output}: {record.frames} frames at {record.fps:g} Hz")
