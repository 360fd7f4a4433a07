"""``mocapdb render``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import counted, emit_json, progress_bar
from mocapdb.cli._options import FRAMES, PATH, SIZE, json_option, original_option
from mocapdb.cli._reader import Reader, out_fps_option, reading_options

if TYPE_CHECKING:
    from mocapdb.motion.clip import Clip


@click.command()
@click.argument("clips", nargs=-1, required=True, metavar="CLIP...")
@click.option(
    "-o", "--output", required=True, type=PATH,
    help="Picture to write: .gif, .mp4 (needs ffmpeg) or .html, one file that plays anywhere.",
)  # fmt: skip
@click.option("--library", type=PATH, help="Where to look for CLIP if it is no file.")
@click.option("--frames", type=FRAMES, help="Only frames A:B, end-exclusive.")
@out_fps_option("Frames a second (25 in a GIF, else 30).", click.FloatRange(1, 120))
@click.option("--size", type=SIZE, default="640x480", show_default=True, help="In pixels.")
@click.option("--over", is_flag=True, help="Put several clips over each other, not side by side.")
@click.option(
    "--error", "as_error", is_flag=True,
    help="Colour all but the first by how far each bone is from where it is in the first.",
)  # fmt: skip
@original_option
@reading_options
@json_option
def render(
    clips: tuple[str, ...],
    output: Path,
    library: Path | None,
    frames: slice | None,
    out_fps: float | None,
    size: tuple[int, int],
    over: bool,
    as_error: bool,
    original: bool,
    as_json: bool,
    reader: Reader,
) -> None:
    """Draw clips in motion: several, of any skeletons, are put side by side.

    \b
    Example:
      mocapdb render take.bvh -o take.gif
      mocapdb render take.bvh clean.bvh --error -o repair.html
      mocapdb render 07_01 --library cmu.mocapdb -o walk.mp4 --size 1280x720
    """
    from mocapdb.scenes.animation import usual_rate, write_stage
    from mocapdb.scenes.stage import ACTOR_COLOURS, Actor, Stage

    if not any(Path(name).is_file() for name in clips):
        reader.expect_files("none of these is a file")
    reader.note_out_fps(out_fps)
    named = [_clip(name, library, reader, original) for name in clips]
    shown = named if frames is None else [clip[frames] for clip in named]
    rate = out_fps or usual_rate(output)
    actors = [
        Actor.of(
            clip,
            colour=ACTOR_COLOURS[i % len(ACTOR_COLOURS)],
            fps=rate,
            against=shown[0] if as_error and i else None,
        )
        for i, clip in enumerate(shown)
    ]
    stage = Stage.together(actors) if over else Stage.side_by_side(actors)
    with progress_bar("Drawing") as progress:
        write_stage(stage, output, size=size, progress=progress)
    if as_json:
        emit_json(
            {
                "clips": [clip.name for clip in shown],
                "inputs": [{"clip": clip.name, **assumed_json(clip)} for clip in shown],
                "output": str(output),
                "frames": stage.n_frames,
                "fps": stage.fps,
                "bytes": output.stat().st_size,
            }
        )
        return
    click.echo(f"{output}: {counted(stage.n_frames, 'frame')} at {stage.fps:g} Hz")


def _clip(name: str, library: Path | None, reader: Reader, original: bool) -> Clip:
    from mocapdb.errors import ClipError

    if library is None or Path(name).is_file():
        if not Path(name).is_file():
            raise ClipError(
                f"Expected a motion file, but {name!r} is none. "
                "A clip of a library needs --library."
            )
        return reader.read(Path(name))
    from mocapdb.library import Library

    with Library(library, original=original) as opened:
        return opened.clip(name)
