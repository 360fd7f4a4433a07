"""``mocapdb convert``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import counted, emit_json, progress_bar
from mocapdb.cli._options import EVENTS, PATH, as_option, check_representation_file, json_option
from mocapdb.cli._reader import Reader, reading_options

if TYPE_CHECKING:
    from mocapdb.motion.clip_tables import TableGroup
    from mocapdb.motion.representations import RepresentationName


def _groups(
    context: click.Context, option: click.Parameter, given: str | None
) -> tuple[str, ...] | None:
    return None if given is None else tuple(name.strip() for name in given.split(","))


@click.command()
@click.argument("source", metavar="IN", type=PATH)
@click.argument("output", metavar="OUT", type=PATH)
@click.option("--drop-tpose", is_flag=True, help="Leave out a T-pose in front of the motion.")
@as_option
@click.option(
    "--columns", callback=_groups, metavar="GROUPS",
    help="Of a .csv: positions, rotations, velocities, channels and contacts, some of them.",
)  # fmt: skip
@reading_options
@json_option
def convert(
    source: Path,
    output: Path,
    drop_tpose: bool,
    representation: str | None,
    columns: tuple[TableGroup, ...] | None,
    as_json: bool,
    reader: Reader,
) -> None:
    """Convert a clip to AMC (with its ASF), BVH, NPZ, CSV, FBX or glTF, or draw it in motion.

    The suffixes say what is what. Read are AMASS's .npz, too, the skins of .glb and .gltf, and by
    way of Blender .fbx, .dae and .usd. A .csv is written only; it has a row a frame: positions
    in metres, local rotations as quaternions xyzw, and which foot rests. A .glb (binary glTF) is
    for game engines and viewers of 3-D files. An animated picture is a
    .gif, an .mp4 (needs ffmpeg), or an .html that plays anywhere; 'mocapdb render' does more.

    \b
    Example:
      mocapdb convert 02_03.amc 02_03.bvh
      mocapdb convert 02_03.amc 02_03.csv
      mocapdb convert takes.fbx run.bvh --take Run
      mocapdb convert amass_poses.npz walk.bvh --skeleton SMPLH_MALE.npz
      mocapdb convert 02_03.amc 02_03.csv --as positions
      mocapdb convert 02_03.amc 02_03.npz --as smplh
      mocapdb convert 02_03.amc steps.csv --as events
    """
    from mocapdb.io import write_clip, write_csv, write_representation
    from mocapdb.scenes.animation import is_animation, write_animation

    if representation is not None:
        check_representation_file(output, representation)
    if columns is not None and (output.suffix.lower() != ".csv" or representation is not None):
        raise click.UsageError("--columns says what is in a .csv without --as.")
    events: int | None = None
    clip = written = reader.read(source, drop_tpose=drop_tpose)
    if representation == EVENTS:
        from mocapdb.gait import write_events

        events = write_events([clip], output)
    elif representation is not None:
        written = write_representation(clip, cast("RepresentationName", representation), output)
    elif columns is not None:
        write_csv(clip, output, columns)
    elif is_animation(output):
        with progress_bar("Drawing") as progress:
            write_animation(clip, output, progress=progress)
    else:
        written = write_clip(clip, output, blender=reader.said.blender)
    if as_json:
        emit_json(
            {
                "input": str(source),
                "output": str(output),
                **({"representation": representation} if representation else {}),
                **({} if events is None else {"events": events}),
                "frames": len(clip),
                **assumed_json(clip),
                "joints": clip.skeleton.n_joints,
                "provenance": list(written.provenance),
            }
        )
        return
    held = "" if events is None else f"{counted(events, 'event')} of "
    click.echo(
        f"{output}: {held}{counted(len(clip), 'frame')} at {clip.fps:g} Hz ({clip.fps_source}), "
        f"{counted(clip.skeleton.n_joints, 'joint')}"
    )
    for step in written.provenance:
        if not step.startswith("warning: "):  # said when it was read
            click.echo(f"  {step}", err=True)
