"""``mocapdb segment``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import emit_json, print_table
from mocapdb.cli._options import (
    FRAMES,
    PATH,
    check_table_and_picture_files,
    frames_of,
    json_option,
    original_option,
)
from mocapdb.cli._reader import Reader, reading_options
from mocapdb.library.layout import is_library

if TYPE_CHECKING:
    from mocapdb.motion.clip import Clip
    from mocapdb.segmentation.motion_segments import CutMethod, Segmentation


@click.command()
@click.argument("source", metavar="CLIP|LIB", type=PATH)
@click.option("--clip", "name", help="Of a library: this clip.")
@click.option("--frames", type=FRAMES, help="Only frames A:B of the clip, end-exclusive.")
@click.option(
    "--method",
    type=click.Choice(["partition", "pca", "ppca", "mixture"]),
    default="partition",
    show_default=True,
    help="How it is cut: at the cuts that make the whole take likeliest, or one of the three ways "
    "of Barbic et al. (2004).",
)
@click.option("--plot", type=PATH, help="Picture: poses, and under them the motions.")
@original_option
@reading_options
@json_option
def segment(
    source: Path,
    name: str | None,
    frames: slice | None,
    method: CutMethod,
    plot: Path | None,
    original: bool,
    as_json: bool,
    reader: Reader,
) -> None:
    """Cut a long take into motions: where each begins and ends, which repeat, which are alike.

    No labels are needed. Segments with the same letter are the same motion.

    \b
    Example:
      mocapdb segment 13_29.amc --plot segments.png
      mocapdb segment studio.mocapdb --clip 13_29 --json
    """
    from mocapdb.segmentation import segment_clip

    check_table_and_picture_files({}, {"--plot": plot})
    clip = frames_of(_clip(source, name, original, reader), frames)
    offset = 0 if frames is None else frames.start or 0
    found = segment_clip(clip, method)
    if plot is not None:
        from mocapdb.base.files import make_folder, replacing
        from mocapdb.plots import segmentation_chart

        make_folder(plot.parent)
        with replacing(plot) as (temporary,):
            segmentation_chart(clip, found).savefig(temporary, dpi=80, format="png")
    if as_json:
        emit_json(_figures(clip, found, offset, plot))
        return
    print_table(
        ("motion", "start", "end", "seconds", "kind", "period"), _rows(clip, found, offset), left=1
    )
    if plot is not None:
        click.echo(f"picture  {plot}")


def _clip(source: Path, name: str | None, original: bool, reader: Reader) -> Clip:
    """Return the clip, of a library or read from a file."""
    if source.is_dir() and not is_library(source):
        raise click.UsageError(
            f"Expected a clip or a library, but {source} is a folder: name one of its clips."
        )
    if source.is_dir():
        reader.expect_files("a library's clips are read already")
        if name is None:
            raise click.UsageError("A library needs --clip.")
        from mocapdb.library import Library

        with Library(source, original=original) as library:
            return library.clip(library.record(name).name)
    if name is not None or original:
        raise click.UsageError("--clip and --original are for clips of a library.")
    return reader.read(source, drop_tpose=True)


def _rows(clip: Clip, found: Segmentation, offset: int) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for part in found.segments:
        period = part.period_frames
        kind = "single" if period is None else "periodic"
        if part.repeats is not None:
            inner = part.repeats
            kind += f", frames {inner.start + offset}:{inner.end + offset}"
        rows.append(
            (
                part.motion,
                f"{(part.start + offset) / clip.fps:.2f} s",
                f"{(part.end + offset) / clip.fps:.2f} s",
                f"{len(part) / clip.fps:.2f}",
                kind,
                "" if period is None else f"{period / clip.fps:.2f} s",
            )
        )
    return rows


def _figures(clip: Clip, found: Segmentation, offset: int, plot: Path | None) -> dict[str, Any]:
    fps = clip.fps
    return {
        "clip": clip.name,
        **assumed_json(clip),
        "method": found.method,
        "segments": [
            {
                "motion": part.motion,
                "start": part.start + offset,
                "end": part.end + offset,
                "start_s": (part.start + offset) / fps,
                "end_s": (part.end + offset) / fps,
                "seconds": len(part) / fps,
                "kind": "single" if part.period_frames is None else "periodic",
                "period_frames": part.period_frames,
                "period_s": None if part.period_frames is None else part.period_frames / fps,
                "repeats": None
                if part.repeats is None
                else [part.repeats.start + offset, part.repeats.end + offset],
            }
            for part in found.segments
        ],
        "differences": found.differences.round(3).tolist(),
        "plot": None if plot is None else str(plot),
    }
