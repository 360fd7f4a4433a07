"""``mocapdb blend``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import counted, emit_json
from mocapdb.cli._cycle_clips import (
    feet_figures,
    feet_warnings,
    loop_figures,
    loop_warnings,
    one_lap,
)
from mocapdb.cli._cycle_output import LoopFiles, LoopOptions, written_loop
from mocapdb.cli._options import PATH, closing_options, json_option, loop_options
from mocapdb.cli._reader import Reader, out_fps_option, reading_options

if TYPE_CHECKING:
    from mocapdb.cycles import Cycle, Loop
    from mocapdb.motion.body import Scene
    from mocapdb.motion.clip import Clip

TOLD = 4  # joints that jerk more than the parents', the worst ones


class Parent(NamedTuple):
    """One of what is blended.

    Attributes
    ----------
    cycle : Cycle
    fps : float, frames per second
    jerk : float
        How much its motion jerks, in statures a second cubed.
    scene : Scene, optional
        What its body was parted from.
    about : dict
        What is told of it.
    warnings : list of str
    """

    cycle: Cycle
    fps: float
    jerk: float
    scene: Scene | None
    about: dict[str, Any]
    warnings: Sequence[str] = ()


@click.command()
@click.argument("sources", nargs=-1, required=True, metavar="CYCLE...|LIB", type=PATH)
@click.option(
    "--weight", "weights", multiple=True, required=False, type=float,
    help="One for each cycle, summing to one; of two, the second's alone will do.",
)  # fmt: skip
@click.option(
    "--transition", "transition_s", type=float,
    help="Go from the first of two over into the second, in so many seconds.",
)  # fmt: skip
@click.option(
    "--class", "labels", multiple=True,
    help="Of a library: the cycle of this class; once for each cycle.",
)  # fmt: skip
@click.option(
    "--body", default="A", show_default=True, metavar="A|B|...",
    help="Whose body the result has: A is the first cycle's.",
)  # fmt: skip
@out_fps_option("Frame rate of the result; that of the body's clip by default.")
@closing_options
@loop_options
@reading_options
@click.option(
    "-o", "--output", required=True, type=PATH,
    help="Clip: .bvh, .amc, .npz, .glb (root motion of a loop on a bone of its own), .fbx, .gif, "
    ".mp4 or .html.",
)  # fmt: skip
@json_option
def blend(
    sources: tuple[Path, ...],
    weights: tuple[float, ...],
    transition_s: float | None,
    labels: tuple[str, ...],
    body: str,
    out_fps: float | None,
    laps: int,
    in_place: bool,
    loose_feet: bool,
    length: int | None,
    closed: bool,
    output: Path,
    as_json: bool,
    reader: Reader,
) -> None:
    """Blend cycles, their phases aligned, or go from one over into another.

    Each file is a loop that 'mocapdb cycle' wrote, or a clip whose cycle is found first. Bodies may
    differ if they are human.

    \b
    Example:
      mocapdb blend walk.bvh run.bvh --weight 0.3 -o jog.bvh
      mocapdb blend walk.bvh run.bvh --transition 1.5 -o speed-up.bvh
      mocapdb blend cmu.mocapdb --class walk --class run --weight 0.5 -o jog.glb --closed
    """
    if bool(weights) == (transition_s is not None):
        raise click.UsageError("Give --weight or --transition, one of them.")
    n_cycles = len(labels or sources)
    if n_cycles < 2:
        raise click.UsageError("Give two cycles or more.")
    if labels and len(sources) != 1:
        raise click.UsageError("--class names cycles of one library, but got several sources.")
    if transition_s is not None:
        if n_cycles != 2:
            raise click.UsageError("--transition takes two cycles.")
        if closed or length is not None or laps != 1 or in_place:
            raise click.UsageError(
                "--closed, --length, --laps and --in-place are for loops; a transition is none."
            )
    number = _numbered(body, n_cycles)
    files = LoopFiles(output, in_place, blender=reader.said.blender)
    files.check(many=False)
    if labels:
        reader.expect_files("a library's clips are read already")
    reader.note_out_fps(out_fps)
    parents = _of_classes(sources[0], labels) if labels else [_of_file(p, reader) for p in sources]
    parents = [_calmed(parent) for parent in parents]
    own = parents[number]
    rate = out_fps or own.fps
    figures: dict[str, Any] = {
        "cycles": [str(source) for source in labels or sources],
        "inputs": [parent.about for parent in parents],
        "body": "ABCDEFGHIJKLMNOPQRSTUVWXYZ"[number],
        "output": str(output),
    }
    warnings = [warning for parent in parents for warning in parent.warnings]
    if transition_s is not None:
        from mocapdb.cycles.synthesis.blending import make_transition

        made = make_transition(
            parents[0].cycle,
            parents[1].cycle,
            duration_s=transition_s,
            fps=rate,
            hold_feet=not loose_feet,
            body=number,
            most_jerk=own.cycle.skeleton.height * max(parent.jerk for parent in parents),
            root=files.root,
        )
        if own.scene is not None:
            made = made._replace(clip=own.scene.put_back(made.clip))
        files.write(made, output)
        clip, over = made.clip, made.peaks
        told = {"transition_s": transition_s, **feet_figures(made)}
        warnings += feet_warnings(made)
    else:
        from mocapdb.cycles import blend as mixed
        from mocapdb.cycles import seam_steps

        shares = (1.0 - weights[0], weights[0]) if n_cycles == 2 == len(weights) + 1 else weights
        cycle = mixed([parent.cycle for parent in parents], shares, body=number)
        jerk = sum(share * parent.jerk for share, parent in zip(shares, parents, strict=True))
        options: LoopOptions = {
            "fps": out_fps,
            "n_laps": laps,
            "root": files.root,
            "hold_feet": not loose_feet,
            "start": "auto",
            "lap_frames": length,
            "closed": closed,
            "animate": None,
        }
        loop = written_loop(
            cycle,
            options,
            files,
            output,
            fps=rate,
            most_jerk=cycle.skeleton.height * jerk,
            scene=own.scene,
        )
        clip, over = loop.clip, _peaks_of(loop, cycle, parents, number, files)
        told = {
            "weights": list(shares),
            "period_s": cycle.period_s,
            **loop_figures(loop, seam_steps(one_lap(loop))),
        }
        warnings += loop_warnings(loop)
    told["peaks_over_parents"] = over
    if over:
        joint, times = next(iter(over.items()))
        more = f", and so do {len(over) - 1} more" if len(over) > 1 else ""
        warnings.append(
            f"it jerks: {joint} has a peak acceleration of {times:.1f} times the parents'{more}"
        )
    figures |= {"frames": len(clip), "fps": clip.fps, **told, "warnings": warnings}
    if as_json:
        emit_json(figures)
        return
    click.echo(
        f"{output}: {counted(len(clip), 'frame')} at {clip.fps:g} Hz, {clip.duration_s:.3f} s"
    )
    slide = figures["foot_slide_mm"]["after"]
    pops = ", ".join(f"{joint} {times:.1f} times" for joint, times in told["pops"].items())
    worst = ", ".join(f"{joint} {times:.1f} times" for joint, times in list(over.items())[:TOLD])
    click.echo(f"feet slide {slide:.1f} mm, pops: {pops or 'none'}")
    click.echo(f"peak acceleration over the parents': {worst or 'none'}")
    for warning in warnings:
        click.echo(f"warning: {warning}", err=True)


def _calmed(parent: Parent) -> Parent:
    """Return a parent that jerks no more than its motion does, as the loop of its own would."""
    from mocapdb.cycles.synthesis.loop import calmed

    most_jerk = parent.jerk * parent.cycle.skeleton.height
    return parent._replace(cycle=calmed(parent.cycle, parent.fps, most_jerk))


def _peaks_of(
    loop: Loop, cycle: Cycle, parents: Sequence[Parent], body: int, files: LoopFiles
) -> dict[str, float]:
    """Return the joints of a blend that jerk more than in its parents, and how many times."""
    from mocapdb.cycles.synthesis.blending import aligned, loop_peaks, peaks_over_parents

    lap, n_frames = one_lap(loop), loop.lap_frames
    path, heading = loop.path[:n_frames], loop.heading_rad[:n_frames]
    if files.root == "in-place":
        path, heading = 0.0 * path, 0.0 * heading
    rate = n_frames / cycle.period_s
    on_one = aligned([parent.cycle for parent in parents], body=body)
    return peaks_over_parents(loop_peaks(lap, path, heading), on_one, [rate] * len(on_one))


def _numbered(body: str, n_cycles: int) -> int:
    """Return which cycle's body is meant by a letter."""
    letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"[:n_cycles]
    if len(body) != 1 or body.upper() not in letters:
        raise click.UsageError(
            f"Expected --body out of {', '.join(letters)}, in the order of the cycles, "
            f"but got {body!r}."
        )
    return letters.index(body.upper())


def _of_file(path: Path, reader: Reader) -> Parent:
    """Return the cycle of a clip, or of a loop of one lap."""
    from mocapdb.cycles import cycle_of_loop, extract_cycle
    from mocapdb.errors import NoPeriodError
    from mocapdb.motion.body import part_from_scene

    clip = reader.read(path, drop_tpose=True)
    about = {"path": str(path), **assumed_json(clip)}
    try:
        found = extract_cycle(clip)
    except NoPeriodError:
        body, scene = part_from_scene(clip)
        cycle = cycle_of_loop(body)
        own = _jerk_of_lap(cycle, body)
        warning = (
            f"{path}: nothing in it repeats, so it is taken whole as one lap of "
            f"{cycle.period_s:.3f} s"
        )
        return Parent(cycle, clip.fps, own, scene, about, [warning])
    own = found.source_jerk / found.cycle.skeleton.height
    return Parent(found.cycle, clip.fps, own, found.scene, about)


def _of_classes(source: Path, labels: Sequence[str]) -> list[Parent]:
    """Return the cycles of classes of a library: kept ones, or those of some of their clips."""
    from statistics import median

    from mocapdb.cycles import make_loop
    from mocapdb.library import Library
    from mocapdb.library.searching.class_cycles import class_cycle, class_scene

    parents = []
    with Library(source) as library:
        for label in labels:
            mean = class_cycle(library, label)
            cycle = mean.cycle
            fps = median(record.fps for record in library.records(label=label))
            lap = make_loop(cycle, fps, hold_feet=False).clip
            own = _jerk_of_lap(cycle, lap)
            about = {"class": label, "members": list(mean.members)}
            parents.append(Parent(cycle, fps, own, class_scene(library, mean), about))
    return parents


def _jerk_of_lap(cycle: Cycle, lap: Clip) -> float:
    """Return how much a lap jerks that walks on into the next, in statures a second cubed."""
    from mocapdb.cycles.synthesis.loop import jerk, root_relative_positions, turn_of_lap

    turn = turn_of_lap(cycle, "advance")
    return jerk(root_relative_positions(lap), lap.fps, closed=True, turn=turn) / (
        cycle.skeleton.height
    )
