"""``mocapdb clean``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._console import emit_json, json_option, print_table, progress_bar
from mocapdb.errors import ClipError, MocapdbError

if TYPE_CHECKING:
    from mocapdb.cleaning import Cleaned
    from mocapdb.motion.clip import Clip

SUFFIXES = (".amc", ".bvh", ".npz")
MOST_CONTEXT_S = 1800.0
TEXTURE_FPS = 24.0  # as in mocapdb.cleaning, which is too heavy to import here


@click.command()
@click.argument("source", metavar="CLIP|DIR|LIB", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path),
    help="Where to write the cleaned clip (AMC, BVH or NPZ by its suffix); of several, a folder.",
)  # fmt: skip
@click.option(
    "--context", "contexts", multiple=True, type=click.Path(path_type=Path),
    help="Clip, folder or library with similar motion of the same joints; several times if need "
    "be.",
)  # fmt: skip
@click.option(
    "--map", "picture", type=click.Path(path_type=Path),
    help="Draw the movement digression map into this file; of several clips, into this folder.",
)  # fmt: skip
@click.option("--detect-only", is_flag=True, help="Only say what is wrong; write no clip.")
@click.option("--threshold", type=float, help="Confidence from which a span is flagged.")
@click.option("--clip", "name", help="Of a library, only this clip.")
@json_option
def clean(
    source: Path,
    output: Path | None,
    contexts: tuple[Path, ...],
    picture: Path | None,
    detect_only: bool,
    threshold: float | None,
    name: str | None,
    as_json: bool,
) -> None:
    """Say which joint is wrong, from when to when, how surely and in what way; repair only that.

    Without -o the clip is only looked at. Frames and joints that are not flagged stay bit for
    bit (in the format of the source).

    \b
    Example:
      mocapdb clean take.bvh -o clean.bvh --map mdm.png
      mocapdb clean takes/ -o cleaned/ --context cmu.mocapdb
    """
    if detect_only and output is not None:
        raise click.UsageError("--detect-only writes no clip: leave out -o.")
    if name is not None and not is_library(source):
        raise click.UsageError("--clip names a clip of a library.")
    context = _read_contexts(contexts)
    if source.is_dir():
        _clean_many(source, output, context, picture, threshold, name, as_json)
        return
    from mocapdb.io import read_clip

    if source.suffix.lower() not in SUFFIXES:
        raise ClipError(
            f"Expected a clip ({', '.join(SUFFIXES)}), a folder or a library, but got {source}."
        )
    report = _clean_one(read_clip(source), output, context, picture, threshold)
    if as_json:
        emit_json(report)
    else:
        _print(report)


def is_library(path: Path) -> bool:
    """Return whether a folder is a library."""
    return (path / "catalogue.db").is_file()


def _clean_many(
    source: Path,
    output: Path | None,
    context: list[Clip],
    picture: Path | None,
    threshold: float | None,
    name: str | None,
    as_json: bool,
) -> None:
    """Clean the clips of a folder or a library; a clip that fails is named and passed over."""
    from mocapdb.io import read_clip
    from mocapdb.library import Library

    reports: list[dict[str, Any]] = []
    failed: list[dict[str, Any]] = []
    with progress_bar("Cleaning") as progress:

        def one(clip: Clip, stem: str, suffix: str, done: int, total: int) -> None:
            progress(done, total, stem)
            to = output / f"{stem}{suffix}" if output else None
            drawn = picture / f"{stem}.png" if picture else None
            reports.append(_clean_one(clip, to, context, drawn, threshold))

        if is_library(source):
            with Library(source) as library:
                records = library.records() if name is None else [library.record(name)]
                for done, record in enumerate(records, start=1):
                    suffix = Path(record.source).suffix.lower()
                    try:
                        one(library.clip(record.name), record.name, suffix, done, len(records))
                    except MocapdbError as problem:
                        failed.append({"path": record.name, "reason": str(problem)})
        else:
            paths = _motion_files(source)
            if not paths:
                raise ClipError(f"Expected clips in {source}, but it has none.")
            for done, path in enumerate(paths, start=1):
                stem = path.relative_to(source).with_suffix("").as_posix()
                try:
                    one(read_clip(path), stem, path.suffix, done, len(paths))
                except MocapdbError as problem:
                    failed.append({"path": str(path), "reason": str(problem)})
    if as_json:
        emit_json({"clips": reports, "failed": failed})
    else:
        for report in reports:
            _print(report)
    for failure in failed:
        click.echo(f"{failure['path']}: {failure['reason']}", err=True)
    if failed:
        raise click.exceptions.Exit(1)


def _clean_one(
    clip: Clip,
    output: Path | None,
    context: list[Clip],
    picture: Path | None,
    threshold: float | None,
) -> dict[str, Any]:
    """Clean a clip, write what was asked for, and return what the JSON contract says of it."""
    from mocapdb.cleaning import clean_clip
    from mocapdb.io import write_clip

    used = _usable_context(clip, context)
    cleaned = clean_clip(clip, used, threshold=threshold)
    if output is not None:
        output.parent.mkdir(parents=True, exist_ok=True)
        write_clip(cleaned.clip, output)
    if picture is not None:
        picture.parent.mkdir(parents=True, exist_ok=True)
        _draw(clip, cleaned, picture)
    names, fps = clip.skeleton.names, clip.fps
    return {
        "clip": clip.name,
        "seconds": clip.duration_s,
        "fps": fps,
        "context": [other.name for other in used],
        "threshold": cleaned.detection.threshold,
        "spans": [
            {
                "joint": names[repair.span.joint],
                "start": repair.span.start / fps,
                "end": repair.span.end / fps,
                "frames": [repair.span.start, repair.span.end],
                "confidence": round(repair.span.confidence, 4),
                "kind": repair.span.kind,
                "repaired": output is not None and repair.repaired,
                "method": repair.method,
            }
            for repair in cleaned.repairs
        ],
        "output": None if output is None else str(output),
        "map": None if picture is None else str(picture),
    }


def _usable_context(clip: Clip, context: list[Clip]) -> list[Clip]:
    """Return the context's clips that have the clip's joints and another motion.

    Raises
    ------
    ClipError
        If none has the joints.
    """
    names, least_fps = clip.skeleton.names, min(clip.fps, TEXTURE_FPS)
    fitting = [c for c in context if c.skeleton.names == names and c.fps >= least_fps]
    if context and not fitting:
        raise ClipError(
            f"Expected clips with the joints of {clip.name!r}, at {least_fps:g} Hz at least, in "
            f"the context, but none of its {len(context)} clips is one. Convert them, or leave "
            "--context out."
        )
    return [other for other in fitting if not _same_motion(other, clip)]


def _same_motion(a: Clip, b: Clip) -> bool:
    import numpy as np

    return len(a) == len(b) and bool(np.allclose(a.channels, b.channels, atol=1e-3))


def _read_contexts(paths: tuple[Path, ...]) -> list[Clip]:
    """Return the clips of files, folders and libraries, as far as `MOST_CONTEXT_S` goes.

    Raises
    ------
    ClipError
        If a folder has no clips.
    """
    clips: list[Clip] = []
    seconds = 0.0
    for clip in (clip for path in paths for clip in _read_context(path)):
        if seconds > MOST_CONTEXT_S:
            click.echo(f"context: only the first {seconds / 60:.0f} minutes are used", err=True)
            break
        clips.append(clip)
        seconds += clip.duration_s
    return clips


def _read_context(path: Path) -> Iterator[Clip]:
    from mocapdb.io import read_clip
    from mocapdb.library import Library

    if is_library(path):
        with Library(path) as library:
            yield from library
    elif path.is_dir():
        files = _motion_files(path)
        if not files:
            raise ClipError(f"Expected clips in {path}, but it has none.")
        for file in files:
            yield read_clip(file)
    else:
        yield read_clip(path)


def _motion_files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)


def _draw(clip: Clip, cleaned: Cleaned, path: Path) -> None:
    from matplotlib import pyplot

    from mocapdb.io._text import replacing
    from mocapdb.plots import digression_map

    detection = cleaned.detection
    ax = digression_map(detection.scores, clip.skeleton, clip.fps, spans=detection.spans)
    ax.set_title(clip.name, fontsize=9, loc="left")
    figure: Any = ax.figure
    with replacing(path) as (partial,):
        figure.savefig(partial, dpi=120, format="png")
    pyplot.close(figure)


def _print(report: dict[str, Any]) -> None:
    spans = report["spans"]
    if not spans:
        click.echo(f"{report['clip']}: nothing flagged in {report['seconds']:.2f} s")
    else:
        print_table(
            ("joint", "kind", "from", "to", "sure", "repair"),
            [
                (
                    span["joint"], span["kind"], f"{span['start']:.3f} s", f"{span['end']:.3f} s",
                    f"{span['confidence']:.0%}", span["method"],
                )
                for span in spans
            ],
            left=2,
            title=f"{report['clip']}: {len(spans)} flagged in {report['seconds']:.2f} s",
        )  # fmt: skip
    for what in ("output", "map"):
        if report[what]:
            click.echo(f"{what}: {report[what]}")
