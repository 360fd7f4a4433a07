"""``mocapdb edit``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.base.arrays import StrPath
from mocapdb.cli._console import counted, emit_json, progress_bar
from mocapdb.cli._options import FRAMES, PATH, frames_of, json_option
from mocapdb.cli._reader import Reader, reading_options

if TYPE_CHECKING:
    from mocapdb.motion.clip import Clip


def _seconds(
    context: click.Context, option: click.Parameter, given: str | None
) -> tuple[float, float | None] | None:
    """Return what ``--cut A:B`` says; either may be left out."""
    if given is None:
        return None
    number = r"(\d+\.?\d*|\.\d+)?"
    parts = re.fullmatch(f"{number}:{number}", given)
    if not parts or given == ":":
        raise click.BadParameter(
            f"expected seconds such as 1.0:4.5, 1.0: or :4.5, but got {given!r}"
        )
    start, end = parts.groups()
    return float(start or 0.0), None if end is None else float(end)


def _pairs(
    context: click.Context, option: click.Parameter, given: tuple[str, ...]
) -> dict[str, str]:
    """Return what ``--rename OLD=NEW`` says."""
    found: dict[str, str] = {}
    for text in given:
        for part in text.split(","):
            old, equals, new = part.partition("=")
            if not (old and equals and new) or old in found:
                raise click.BadParameter(f"expected OLD=NEW, each joint once, but got {text!r}")
            found[old] = new
    return found


def _names(
    context: click.Context, option: click.Parameter, given: tuple[str, ...]
) -> tuple[str, ...]:
    return tuple(name.strip() for text in given for name in text.split(",") if name.strip())


def _place(
    context: click.Context, option: click.Parameter, given: str | None
) -> tuple[float, float] | None:
    """Return what ``--at X,Z`` says."""
    if given is None:
        return None
    try:
        x, z = (float(part) for part in given.split(","))
    except ValueError:
        raise click.BadParameter(f"expected metres such as 0,0, but got {given!r}") from None
    return x, z


@click.command()
@click.argument("source", metavar="IN", type=PATH)
@click.option(
    "-o", "--output", required=True, type=PATH,
    help="File to write: .bvh, .amc (with an .asf), .npz, .csv, .fbx, .glb, or animated .gif, "
    ".mp4, .html.",
)  # fmt: skip
@click.option(
    "--cut", metavar="A:B", callback=_seconds,
    help="Only this stretch, in seconds: 1.0:4.5, 1.0: or :4.5.",
)  # fmt: skip
@click.option("--frames", type=FRAMES, metavar="A:B", help="Only these frames, end-exclusive.")
@click.option(
    "--append", "appended", type=PATH, multiple=True,
    help="Put this clip behind, of the same skeleton; may be repeated.",
)  # fmt: skip
@click.option(
    "--align", is_flag=True,
    help="Turn and move what is appended, level, so that its root begins at the place and in the "
    "heading in which the clip before ends. Height and pose are not fitted.",
)  # fmt: skip
@click.option("--root", metavar="JOINT", help="Make this joint the root; leave out what is above.")
@click.option(
    "--drop", multiple=True, callback=_names, metavar="JOINTS",
    help="Leave out joints, and what hangs on them: names or patterns, 'LeftHand,*Thumb*'.",
)  # fmt: skip
@click.option(
    "--rename", multiple=True, callback=_pairs, metavar="OLD=NEW",
    help="Call a joint otherwise; may be repeated.",
)  # fmt: skip
@click.option("--mirror", is_flag=True, help="Exchange left and right.")
@click.option("--in-place", is_flag=True, help="Keep the body over its first place.")
@click.option(
    "--at", metavar="X,Z", callback=_place,
    help="Begin at this place on the ground, in metres: 0,0 is the origin.",
)  # fmt: skip
@click.option("--face", type=float, metavar="DEG", help="Look this way first: 0 is z, 90 is x.")
@click.option("--speed", type=float, help="Move so many times as fast, at the same frame rate.")
@click.option("--duration", type=float, help="Take so many seconds, at the same frame rate.")
@click.option("--resample", type=float, metavar="FPS", help="Frames a second to write.")
@reading_options
@json_option
def edit(
    source: Path,
    output: Path,
    cut: tuple[float, float | None] | None,
    frames: slice | None,
    appended: tuple[Path, ...],
    align: bool,
    root: str | None,
    drop: tuple[str, ...],
    rename: dict[str, str],
    mirror: bool,
    in_place: bool,
    at: tuple[float, float] | None,
    face: float | None,
    speed: float | None,
    duration: float | None,
    resample: float | None,
    as_json: bool,
    reader: Reader,
) -> None:
    """Cut, join, mirror, place and resample a clip, drop and rename joints; write it by its suffix.

    Whatever the order they are given in, edits are done in the order of this list: first the
    stretch, then joints, sides and places, then speed and rate. Rotations between frames are
    those on the shortest arc.

    \b
    Example:
      mocapdb edit take.bvh --cut 1.0:4.5 --resample 30 --mirror -o out.bvh
      mocapdb edit walk.bvh --append run.bvh --align --at 0,0 --face 0 -o both.bvh
      mocapdb edit take.bvh --drop '*Thumb*,*Index*' --rename Hips=pelvis -o game.glb
    """
    if cut is not None and frames is not None:
        raise click.UsageError("--cut and --frames both say which stretch: give one of them.")
    if speed is not None and duration is not None:
        raise click.UsageError("--speed and --duration both say how fast: give one of them.")
    if align and not appended:
        raise click.UsageError("--align is of --append: say what to put behind.")
    clip = reader.read(source)
    done = len(clip.provenance)
    clip = frames_of(clip, frames)
    if cut is not None:
        clip = clip.cut(*cut)
    clip = clip.concat(*(reader.read(path) for path in appended), align=align)
    if root is not None:
        clip = clip.with_root(root)
    clip = clip.drop_joints(*drop)
    if rename:
        clip = clip.rename_joints(rename)
    if mirror:
        clip = clip.mirror()
    if at is not None or face is not None:
        clip = clip.place(at, face)
    if in_place:
        clip = clip.in_place()
    if speed is not None or duration is not None:
        clip = clip.retime(speed, duration_s=duration)
    if resample is not None:
        clip = clip.resample(resample)
    written = _write(clip, output, reader.said.blender)
    if as_json:
        emit_json(_figures(source, output, written, written.provenance[done:]))
        return
    click.echo(
        f"{output}: {counted(len(written), 'frame')} at {written.fps:g} Hz, "
        f"{counted(written.skeleton.n_joints, 'joint')}"
    )
    for step in written.provenance[done:]:
        click.echo(f"  {step}", err=True)


def _write(clip: Clip, output: Path, blender: StrPath | None) -> Clip:
    """Write a clip in the format that the suffix names, and return it as it was written."""
    from mocapdb.io import write_clip
    from mocapdb.scenes.animation import is_animation, write_animation

    if not is_animation(output):
        return write_clip(clip, output, blender=blender)
    with progress_bar("Drawing") as progress:
        write_animation(clip, output, progress=progress)
    return clip


def _figures(source: Path, output: Path, clip: Clip, steps: tuple[str, ...]) -> dict[str, Any]:
    return {
        "input": str(source),
        "output": str(output),
        "frames": len(clip),
        "fps": clip.fps,
        "seconds": clip.duration_s,
        "joints": clip.skeleton.n_joints,
        "steps": list(steps),
    }
