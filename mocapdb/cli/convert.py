"""``mocapdb convert``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import emit_json, progress_bar
from mocapdb.cli._options import PATH, json_option


@click.command()
@click.argument("source", metavar="IN", type=PATH)
@click.argument("output", metavar="OUT", type=PATH)
@click.option("--skeleton", type=PATH, help="ASF of an AMC (else found).")
@click.option("--fps", type=float, help="Frame rate, where the file states none or a wrong one.")
@click.option("--drop-tpose", is_flag=True, help="Leave out a T-pose in front of the motion.")
@click.option("--unit-m", type=float, help="Length of one unit of the file in metres.")
@click.option("--up", type=click.Choice(["y", "z"]), help="Vertical axis of the file.")
@json_option
def convert(
    source: Path,
    output: Path,
    skeleton: Path | None,
    fps: float | None,
    drop_tpose: bool,
    unit_m: float | None,
    up: str | None,
    as_json: bool,
) -> None:
    """Convert a clip between AMC (with its ASF), BVH and NPZ by the suffixes, or draw it in motion.

    A .glb (binary glTF) is for game engines and viewers of 3-D files. An animated picture is a
    .gif, an .mp4 (needs ffmpeg), or an .html that plays anywhere; 'mocapdb render' does more.

    \b
    Example:
      mocapdb convert 02_03.amc 02_03.bvh
    """
    from mocapdb.io import read_clip, write_clip
    from mocapdb.scenes.animation import is_animation, write_animation

    clip = read_clip(
        source,
        skeleton=skeleton,
        fps=fps,
        drop_tpose=drop_tpose,
        metres_per_unit=unit_m,
        up=up,  # type: ignore[arg-type] # click has checked it
    )
    if is_animation(output):
        with progress_bar("Drawing") as progress:
            write_animation(clip, output, progress=progress)
    else:
        write_clip(clip, output)
    if as_json:
        emit_json(
            {
                "input": str(source),
                "output": str(output),
                "frames": len(clip),
                "fps": clip.fps,
                "fps_source": clip.fps_source,
                "joints": clip.skeleton.n_joints,
                "provenance": list(clip.provenance),
            }
        )
        return
    click.echo(
        f"{output}: {len(clip)} frames at {clip.fps:g} Hz ({clip.fps_source}), "
        f"{clip.skeleton.n_joints} joints"
    )
    for step in clip.provenance:
        click.echo(f"  {step}", err=True)
