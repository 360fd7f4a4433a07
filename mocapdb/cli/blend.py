"""``mocapdb blend``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import counted, emit_json
from mocapdb.cli._options import PATH, json_option, loop_options
from mocapdb.cli._reader import Reader, out_fps_option, reading_options

if TYPE_CHECKING:
    from mocapdb.cycles import Cycle
    from mocapdb.motion.body import Scene
    from mocapdb.motion.clip import Clip


@click.command()
@click.argument("cycles", nargs=-1, required=True, type=PATH)
@click.option(
    "--weight", "weights", multiple=True, required=False, type=float,
    help="One for each cycle, summing to one; of two, the second's alone will do.",
)  # fmt: skip
@click.option(
    "--transition", "transition_s", type=float,
    help="Go from the first of two over into the second, in so many seconds.",
)  # fmt: skip
@out_fps_option("Frame rate of the result; the first clip's by default.")
@loop_options
@reading_options
@click.option("-o", "--output", required=True, type=PATH, help="Clip: .bvh, .amc or .npz.")
@json_option
def blend(
    cycles: tuple[Path, ...],
    weights: tuple[float, ...],
    transition_s: float | None,
    out_fps: float | None,
    laps: int,
    in_place: bool,
    loose_feet: bool,
    output: Path,
    as_json: bool,
    reader: Reader,
) -> None:
    """Blend cycles of one skeleton, their phases aligned, or go from one over into another.

    Each file is a loop that 'mocapdb cycle' wrote, or a clip whose cycle is found first.

    \b
    Example:
      mocapdb blend walk.bvh run.bvh --weight 0.3 -o jog.bvh
      mocapdb blend walk.bvh run.bvh --transition 1.5 -o speed-up.bvh
    """
    from mocapdb.cycles import blend as mixed
    from mocapdb.cycles import make_loop, seam_steps, transition
    from mocapdb.io import write_clip

    if bool(weights) == (transition_s is not None):
        raise click.UsageError("Give --weight or --transition, one of them.")
    if len(cycles) < 2:
        raise click.UsageError("Give two cycles or more.")
    reader.note_out_fps(out_fps)
    clips = [reader.read(path, drop_tpose=True) for path in cycles]
    found = [_cycle(clip) for clip in clips]
    parts = [cycle for cycle, _ in found]
    scene = found[0][1]
    rate = out_fps or clips[0].fps
    figures: dict[str, Any] = {
        "cycles": [str(path) for path in cycles],
        "inputs": [
            {"path": str(path), **assumed_json(clip)}
            for path, clip in zip(cycles, clips, strict=True)
        ],
        "output": str(output),
    }
    if transition_s is not None:
        if len(parts) != 2:
            raise click.UsageError("--transition takes two cycles.")
        clip = transition(
            parts[0], parts[1], duration_s=transition_s, fps=rate, hold_feet=not loose_feet
        )
        figures |= {"frames": len(clip), "fps": clip.fps, "transition_s": transition_s}
    else:
        shares = (1.0 - weights[0], weights[0]) if len(parts) == 2 == len(weights) + 1 else weights
        cycle = mixed(parts, shares)
        loop = make_loop(
            cycle,
            rate,
            n_laps=laps,
            root="in-place" if in_place else "advance",
            hold_feet=not loose_feet,
        )
        clip = loop.clip
        figures |= {
            "weights": list(shares),
            "period_s": cycle.period_s,
            "frames": len(clip),
            "fps": clip.fps,
            "seam_steps": seam_steps(clip[: len(clip) // laps]),
            "foot_slide_mm": {"before": loop.slide_before_mm, "after": loop.slide_after_mm},
        }
    write_clip(clip if scene is None else scene.put_back(clip), output)
    if as_json:
        emit_json(figures)
        return
    click.echo(
        f"{output}: {counted(len(clip), 'frame')} at {clip.fps:g} Hz, {clip.duration_s:.3f} s"
    )


def _cycle(clip: Clip) -> tuple[Cycle, Scene | None]:
    """Return the cycle of a clip, or of a loop of one lap, and what its body was parted from."""
    from mocapdb.cycles import cycle_of_loop, extract_cycle
    from mocapdb.errors import NoPeriodError
    from mocapdb.motion.body import part_from_scene

    try:
        found = extract_cycle(clip)
    except NoPeriodError:
        return cycle_of_loop(clip), part_from_scene(clip)[1]
    return found.cycle, found.scene
