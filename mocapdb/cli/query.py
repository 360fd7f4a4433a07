"""``mocapdb query``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import counted, emit_json, print_table
from mocapdb.cli._named_clip import find_clip, say_unsearchable
from mocapdb.cli._options import PATH, json_option, library_argument, original_option, where_option
from mocapdb.cli._reader import Reader, reading_options

if TYPE_CHECKING:
    from mocapdb.library import Hit, Library
    from mocapdb.motion.clip import Clip


@click.command()
@library_argument
@click.argument("clips", metavar="CLIP...", nargs=-1, required=True)
@click.option("--from", "from_s", type=float, metavar="S", help="Start of the query in seconds.")
@click.option("--to", "to_s", type=float, metavar="S", help="End of the query in seconds.")
@click.option("--frames", metavar="A:B", help="The query in frames instead, B excluded.")
@click.option("-k", default=10, show_default=True, type=click.IntRange(min=1), help="Hits to show.")
@click.option("--class", "label", help="Only search clips of this class.")
@click.option("--subject", help="Only search clips by this subject, such as 35.")
@click.option("--search", "text", help="Only search clips with these words, as in mocapdb ls.")
@where_option
@click.option("--not-subject", multiple=True, help="Leave a subject out; may be repeated.")
@click.option(
    "--joints", metavar="PART,...",
    help="Only these count: left-arm, right-arm, arms, left-leg, right-leg, legs, trunk, "
    "upper-body, lower-body, or joints such as head or left-wrist.",
)  # fmt: skip
@click.option(
    "--unlike", multiple=True, metavar="CLIP",
    help="Leave out what is nearer to this file or clip of the library; may be repeated.",
)  # fmt: skip
@click.option("--whole", is_flag=True, help="Compare whole clips from beginning to end.")
@click.option("--mirror", is_flag=True, help="Let left and right change places.")
@click.option(
    "--expand", type=click.IntRange(min=0),
    help="Search again with the query averaged with its N best hits (default 2 with --whole).",
)  # fmt: skip
@click.option("--max-distance", type=float, help="Leave out what is further away.")
@click.option(
    "--weights", metavar="V,H,T,R",
    help="What velocity (s), height, travel (s) and turn (m s) count (default 0.1,1,0.5,0.1).",
)  # fmt: skip
@click.option(
    "--exact/--rough", default=None,
    help="Miss nothing, or look only where a sketch is like the query, ten times as fast (default:"
    " exact up to 3 million frames of 24 fps, a day and a half).",
)  # fmt: skip
@reading_options
@click.option("-o", "--output", type=PATH, help="Folder for the hits as BVH.")
@click.option("--plot", type=PATH, help="Picture of the query and its hits.")
@original_option
@json_option
def query(
    library: Path,
    clips: tuple[str, ...],
    from_s: float | None,
    to_s: float | None,
    frames: str | None,
    k: int,
    label: str | None,
    subject: str | None,
    text: str | None,
    where: dict[str, str],
    not_subject: tuple[str, ...],
    joints: str | None,
    unlike: tuple[str, ...],
    whole: bool,
    mirror: bool,
    expand: int | None,
    max_distance: float | None,
    weights: str | None,
    exact: bool | None,
    output: Path | None,
    plot: Path | None,
    original: bool,
    as_json: bool,
    reader: Reader,
) -> None:
    """Find the stretches of a library that are the motion of a clip, by anybody, at any speed.

    CLIP is a file, or the name of a clip of the library, which is then not searched itself. Of
    several clips, each hit is like one. Distance 0 is the same motion, 1 is any motion. A speed
    of x2 is twice as fast as the query.

    \b
    Example:
      mocapdb query cmu.mocapdb take.bvh --from 2.0 --to 3.5
      mocapdb query cmu.mocapdb 35_17 --not-subject 35 -o hits/
      mocapdb query cmu.mocapdb wave.bvh --joints right-arm --unlike punch.bvh
    """
    import math
    import time

    from mocapdb.library import Filter, Library, Retrieval

    if frames is not None and (from_s is not None or to_s is not None):
        raise click.UsageError("Expected --frames or --from and --to, but got both.")
    if len(clips) > 1 and (frames or from_s is not None or to_s is not None):
        raise click.UsageError("Expected one clip for a range, but got several clips.")
    if not any(Path(clip).is_file() for clip in (*clips, *unlike)):
        reader.expect_files("no CLIP is a file")
    chosen_weights = _weights(weights)
    with Library(library, original=original) as opened:
        named = [find_clip(opened, clip, reader) for clip in clips]
        examples = [_range(clip, frames, from_s, to_s) for clip, _ in named]
        not_meant = [find_clip(opened, clip, reader) for clip in unlike]
        left_out = [record for _, record in named + not_meant if record]
        only = Filter(label, subject, text, left_out, not_subject, where)
        started = time.perf_counter()
        hits = Retrieval(opened).query(
            [clip for clip, _, _ in examples],
            k=k,
            only=only,
            unlike=[clip for clip, _ in not_meant],
            joints=[] if joints is None else joints.split(","),
            whole=whole,
            mirror=mirror,
            expand=expand,
            weights=chosen_weights,
            max_distance=math.inf if max_distance is None else max_distance,
            exact=exact,
        )
        seconds = time.perf_counter() - started
        unsearchable = say_unsearchable(opened)
        n_cleaned = sum(each.changes for each in opened.catalogue.revisions().values())
        outputs = _export(opened, hits, output) if output else []
        if plot:
            _draw(opened, examples[0][0], hits, plot)
    if as_json:
        asked = [
            {"clip": clip.name, "start": start, "end": end}
            for (clip, _), (_, start, end) in zip(named, examples, strict=True)
        ]
        emit_json(
            {
                "query": asked[0],
                "examples": [
                    each | assumed_json(clip) for each, (clip, _) in zip(asked, named, strict=True)
                ],
                **assumed_json(named[0][0]),
                "joints": [] if joints is None else joints.split(","),
                "unlike": [clip.name for clip, _ in not_meant],
                "hits": [_hit_json(hit) for hit in hits],
                "unsearchable": unsearchable,
                "cleaned": n_cleaned,
                "original": original,
                "outputs": [str(path) for path in outputs],
                "seconds": seconds,
            }
        )
        return
    if not hits:
        click.echo("no stretch is that near")
        return
    print_table(
        ("clip", "class", "from s", "to s", "distance", "speed", "description"),
        (
            (
                hit.record.name,
                hit.record.label or "-",
                f"{hit.start_s:.2f}",
                f"{hit.end_s:.2f}",
                f"{hit.distance:.3f}",
                f"x{1 / hit.time_scale:.2f}",
                hit.record.description,
            )
            for hit in hits
        ),
        left=2,
    )
    click.echo(f"{counted(len(hits), 'hit')} in {1000 * seconds:.0f} ms")
    for path in outputs:
        click.echo(f"wrote {path}")
    if plot:
        click.echo(f"wrote {plot}")


def _range(
    clip: Clip, frames: str | None, from_s: float | None, to_s: float | None
) -> tuple[Clip, float, float]:
    """Return the part of a clip that is asked for, and its start and end in seconds."""
    from mocapdb.errors import ClipError

    start, end = 0, len(clip)
    if frames is not None:
        first, colon, last = frames.partition(":")
        try:
            start, end = int(first or 0), int(last or len(clip))
        except ValueError:
            colon = ""
        if not colon:
            raise click.UsageError(f"Expected --frames A:B, but got {frames!r}.")
    else:
        start = start if from_s is None else round(from_s * clip.fps)
        end = end if to_s is None else round(to_s * clip.fps)
    if not 0 <= start < end <= len(clip):
        raise ClipError(
            f"Expected a range within the {clip.duration_s:.2f} s ({len(clip)} frames) of "
            f"{clip.name!r}, but got {start / clip.fps:.2f} to {end / clip.fps:.2f} s "
            f"(frames {start}:{end})."
        )
    return clip[start:end], start / clip.fps, end / clip.fps


def _weights(text: str | None) -> Any:
    from mocapdb.indexing import Weights

    if text is None:
        return None
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 4:
        raise click.UsageError(f"Expected --weights with four numbers, but got {text!r}.")
    return Weights(*values)


def _hit_json(hit: Hit) -> dict[str, Any]:
    return {
        "clip": hit.record.name,
        "start": hit.start_s,
        "end": hit.end_s,
        "start_frame": hit.start,
        "end_frame": hit.end,
        "distance": hit.distance,
        "class": hit.record.label,
        "time_scale": hit.time_scale,
    }


def _export(library: Library, hits: list[Hit], folder: Path) -> list[Path]:
    from mocapdb.io import write_clip

    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for number, hit in enumerate(hits, start=1):
        name = hit.record.name.replace("/", "-")
        path = folder / f"{number:02d}_{name}_{hit.start}-{hit.end}.bvh"
        write_clip(library.clip(hit.record.name, slice(hit.start, hit.end)), path)
        paths.append(path)
    return paths


def _aligned(clip: Clip, hit: Hit, duration_s: float) -> Clip:
    """Return the frames of a hit that the query's were matched with, in the query's time."""
    import numpy as np

    from mocapdb.indexing.canonical.canonical_motion import FPS

    matched = np.rint(hit.stretch.path * clip.fps / FPS).astype(int)
    channels = clip.channels[np.minimum(matched, len(clip) - 1)]
    return clip.replace(channels=channels, fps=len(channels) / duration_s)


def _draw(library: Library, example: Clip, hits: list[Hit], path: Path) -> None:
    from mocapdb.plots import query_hits

    shown = hits[:5]
    clips = [_aligned(library.clip(hit.record.name), hit, example.duration_s) for hit in shown]
    titles = [f"{hit.record.name}  {hit.start_s:.2f} s  d = {hit.distance:.2f}" for hit in shown]
    from matplotlib import pyplot

    pyplot.sca(query_hits(example, clips, titles))
    pyplot.savefig(path, dpi=150)
