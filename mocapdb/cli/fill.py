"""``mocapdb fill``."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._assumed import assumed_json, shortened
from mocapdb.cli._console import counted, emit_json, print_table
from mocapdb.cli._context import Context
from mocapdb.cli._options import PATH, json_option
from mocapdb.cli._reader import Reader, reading_options
from mocapdb.errors import ClipError, SkeletonError

if TYPE_CHECKING:
    from mocapdb.cleaning.filling_error import FillingError
    from mocapdb.motion.clip import Clip

MOST_HELD_OUT = 6  # clips of the context from which the error is measured


@click.command()
@click.argument("source", metavar="CLIP", type=PATH)
@click.option(
    "--joints", required=True, metavar="A,B,...",
    help="The joints that were captured; the one that carries the body always is.",
)  # fmt: skip
@click.option(
    "--context", "contexts", multiple=True, required=True, type=PATH,
    help="Clip, folder or library with similar motion of the whole body; several times if need be.",
)  # fmt: skip
@click.option("-o", "--output", required=True, type=PATH, help="Clip to write: .bvh, .amc or .npz.")
@click.option(
    "--error/--no-error", "measure", default=True, show_default=True,
    help="Say by how much each filled joint may be off: clips of the context are filled as well, "
    "each from the others, and compared with what they are. Where the context fits the clip less "
    "well than these fit each other, more is expected.",
)  # fmt: skip
@reading_options
@json_option
def fill(
    source: Path,
    joints: str,
    contexts: tuple[Path, ...],
    output: Path,
    measure: bool,
    as_json: bool,
    reader: Reader,
) -> None:
    """Make a whole body from a few joints: the others do what they do in similar motion.

    What the clip holds of the other joints is ignored; that of the joints at hand, of the one that
    carries the body, and of those above it stays as it is.

    \b
    Example:
      mocapdb fill take.bvh --joints LeftUpLeg,RightUpLeg,Neck --context walks -o whole.bvh
    """
    from mocapdb.cleaning.filling_error import measure_filling
    from mocapdb.cleaning.repair.missing_joints import fill_with_misfit, kept_joints
    from mocapdb.jobs import write_clip

    clip = reader.read(source)
    known = _known(clip, [name.strip() for name in joints.split(",") if name.strip()])
    context = list(_context(clip, contexts, source))
    filled, misfit = fill_with_misfit(clip, known, context)
    error = measure_filling(known, context, most_clips=MOST_HELD_OUT) if measure else None
    expected = None if error is None else error.expected(misfit)
    from mocapdb.base.files import make_folder

    make_folder(output.parent)
    write_clip(filled, output, blender=reader.said.blender)
    kept = [clip.skeleton.names[joint] for joint in kept_joints(clip)]
    at_hand = {*known, *kept}
    names = [clip.skeleton.names[joint] for joint in clip.skeleton.rotating_joints]
    missing = [name for name in names if name not in at_hand]
    if as_json:
        emit_json(
            {
                "clip": clip.name,
                **assumed_json(clip),
                "known": known,
                "filled": missing,
                "context": {
                    "clips": len(context),
                    "seconds": sum(other.duration_s for other in context),
                },
                "kept": kept,
                "expected_deg": None if expected is None else _error_json(expected, missing),
                "measured_deg": None if error is None else _error_json(error, missing),
                "held_out": [] if error is None else list(error.clips),
                "misfit_deg": {
                    "clip": round(misfit, 2),
                    "held_out": round(error.misfit_deg, 2) if error and error.clips else None,
                },
                "output": str(output),
            }
        )
        return
    click.echo(
        f"{output}: {counted(len(missing), 'joint')} filled from {counted(len(context), 'clip')}"
    )
    if error is None or expected is None:
        return
    if not error.clips:
        click.echo(
            "expected error: not known, since it takes two clips in the context, of "
            "some seconds each"
        )
        return
    print_table(
        ("joint", "measured", "expected error"),
        [
            (name, f"{error.mean_deg[name]:.1f} deg", f"{expected.mean_deg[name]:.1f} deg")
            for name in missing
        ],
        left=1,
        title=f"measured on {counted(len(error.clips), 'clip')} of the context, each filled from "
        "the others",
    )
    click.echo(f"measured on: {', '.join(shortened(list(error.clips)))}")
    known_to_be = f"the joints at hand are {misfit:.1f} deg from the motion that is most alike"
    if misfit > error.misfit_deg:
        click.echo(
            f"note: {known_to_be}, those of the clips that were measured {error.misfit_deg:.1f}: "
            "errors are expected to be larger by as much, and what the joints at hand do not show, "
            "such as how another actor holds the hands, may be off by more"
        )
    else:
        click.echo(f"{known_to_be}, no more than in the clips that were measured")


def _error_json(error: FillingError, names: Sequence[str]) -> dict[str, float]:
    return {name: round(error.mean_deg[name], 2) for name in names if name in error.mean_deg}


def _known(clip: Clip, names: Sequence[str]) -> list[str]:
    """Return the names of joints, each once, or say which is none's and what is near."""
    known = list(dict.fromkeys(names))
    if not known:
        raise click.UsageError("Expected --joints with names such as Neck,LeftArm.")
    for name in known:
        if name not in clip.skeleton.names:
            lower = {joint.lower(): joint for joint in clip.skeleton.names}
            near = difflib.get_close_matches(name.lower(), lower, n=3, cutoff=0.5)
            hint = (
                f"Did you mean {', '.join(repr(lower[each]) for each in near)}?"
                if near
                else f"It has {', '.join(clip.skeleton.names)}."
            )
            raise SkeletonError(f"Expected joints of {clip.name!r}, but got {name!r}. {hint}")
    return known


def _context(clip: Clip, paths: tuple[Path, ...], source: Path) -> list[Clip]:
    """Return the clips of the context that have the joints of a clip, but not the clip itself."""
    names = _turning(clip)
    same, others, own = [], 0, 0
    for other in Context(paths).clips():
        if Path(other.source).is_file() and Path(other.source).samefile(source):
            own += 1
            continue
        if _turning(other) == names:
            same.append(other)
        else:
            others += 1
    if not same:
        held = f"none of its {counted(others, 'clip')} is one" if others else "there is no clip"
        if own:
            held = f"it holds {source.name} itself, and {held if others else 'nothing else'}"
        raise ClipError(
            f"Expected clips with the joints of {clip.name!r} in the context, but {held}. Name "
            "other motion of the same body, or convert it."
        )
    if own:
        click.echo(f"context: {source.name} itself left out", err=True)
    if others:
        click.echo(f"context: {counted(others, 'clip')} of other joints left out", err=True)
    slow = [other for other in same if other.fps < min(clip.fps, _texture_fps())]
    if slow:
        click.echo(
            f"context: {counted(len(slow), 'clip')} of a lower rate than the clip left out",
            err=True,
        )
    kept = [other for other in same if other not in slow]
    if not kept:
        raise ClipError(
            f"Expected clips of {min(clip.fps, _texture_fps()):g} Hz or more in the context, but "
            f"all are slower."
        )
    return kept


def _texture_fps() -> float:
    from mocapdb.cleaning.tuning import TEXTURE_FPS

    return TEXTURE_FPS


def _turning(clip: Clip) -> tuple[Any, ...]:
    skeleton = clip.skeleton
    return tuple(skeleton.names[joint] for joint in skeleton.rotating_joints)
