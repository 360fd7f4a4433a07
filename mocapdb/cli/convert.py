"""``mocapdb convert``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import counted, emit_json, progress_bar
from mocapdb.cli._options import PATH, as_option, check_representation_file, json_option
from mocapdb.cli._reader import Reader, reading_options

if TYPE_CHECKING:
    from mocapdb.motion.representations import RepresentationName


@click.command()
@click.argument("source", metavar="IN", type=PATH)
@click.argument("output", metavar="OUT", type=PATH)
@click.option("--drop-tpose", is_flag=True, help="Leave out a T-pose in front of the motion.")
@as_option
@reading_options
@json_option
def convert(
    source: Path,
    output: Path,
    drop_tpose: bool,
    representation: RepresentationName | None,
    as_json: bool,
    reader: Reader,
) -> None:
    """Convert a clip between AMC (with its ASF), BVH and NPZ by the suffixes, or draw it in motion.

    A .glb (binary glTF) is for game engines and viewers of 3-D files. An animated picture is a
    .gif, an .mp4 (needs ffmpeg), or an .html that plays anywhere; 'mocapdb render' does more.

    \b
    Example:
      mocapdb convert 02_03.amc 02_03.bvh
      mocapdb convert 02_03.amc 02_03.csv --as positions
    """
    from mocapdb.io import write_clip, write_representation
    from mocapdb.scenes.animation import is_animation, write_animation

    if representation is not None:
        check_representation_file(output)
    clip = written = reader.read(source, drop_tpose=drop_tpose)
    if representation is not None:
        write_representation(clip, representation, output)
    elif is_animation(output):
        with progress_bar("Drawing") as progress:
            write_animation(clip, output, progress=progress)
    else:
        written = write_clip(clip, output)
    if as_json:
        emit_json(
            {
                "input": str(source),
                "output": str(output),
                **({"representation": representation} if representation else {}),
                "frames": len(clip),
                **assumed_json(clip),
                "joints": clip.skeleton.n_joints,
                "provenance": list(written.provenance),
            }
        )
        return
    click.echo(
        f"{output}: {counted(len(clip), 'frame')} at {clip.fps:g} Hz ({clip.fps_source}), "
        f"{counted(clip.skeleton.n_joints, 'joint')}"
    )
    for step in written.provenance:
        if not step.startswith("warning: "):  # said when it was read
            click.echo(f"  {step}", err=True)
