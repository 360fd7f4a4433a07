"""``mocapdb query``."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import astuple
from functools import partial
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any, TypeAlias

import click

from mocapdb.base.arrays import IntArray, StrPath
from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import counted, emit_json, print_table
from mocapdb.cli._csv import csv_option, each_of
from mocapdb.cli._named_clip import (
    find_clip,
    say_not_looked_at,
    say_unknown_subjects,
    say_unmeasured,
)
from mocapdb.cli._options import (
    LIBRARY,
    PATH,
    facet_options,
    json_option,
    library_argument,
    original_option,
    scheduler_option,
    where_option,
)
from mocapdb.cli._reader import Reader, reading_options
from mocapdb.cli.ls import EVERY_DISTANCE, cut_of

if TYPE_CHECKING:
    from mocapdb.indexing import Agreement
    from mocapdb.library import FacetRange, Hit, Library
    from mocapdb.library.searching.many_libraries import FoundHit, LibraryHits
    from mocapdb.motion.clip import Clip


ClipOfHit: TypeAlias = "Callable[[FoundHit, slice | None], Clip]"

EVERY_HIT = 1000  # of a saved query with a cut: as many as there are, within reason

DRAWN = 5  # hits in a picture, which are told apart without turning the page


@click.command()
@library_argument
@click.argument("clips", metavar="CLIP...", nargs=-1)
@click.option(
    "--also", multiple=True, type=LIBRARY, metavar="LIB",
    help="Search this library as well, and rank the hits of all together; may be repeated.",
)  # fmt: skip
@click.option("--from", "from_s", type=float, metavar="S", help="Start of the query in seconds.")
@click.option("--to", "to_s", type=float, metavar="S", help="End of the query in seconds.")
@click.option("--frames", metavar="A:B", help="The query in frames instead, B excluded.")
@click.option("-k", default=10, show_default=True, type=click.IntRange(min=1), help="Hits to show.")
@click.option("--class", "label", help="Only search clips of this class.")
@click.option("--subject", help="Only search clips by this subject, such as 35.")
@click.option(
    "--search",
    "text",
    help="Only search clips with these words, their stems or beginnings, or words for the same.",
)
@where_option
@facet_options
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
    "--probability", type=float, metavar="P",
    help="Leave out what is less likely the same motion, such as .8.",
)  # fmt: skip
@click.option(
    "--save", metavar="NAME",
    help="Keep the query in the library with its choices and cut: mocapdb ls LIB --query NAME asks "
    "it again. With --probability or --max-distance it finds all within the cut, else -k.",
)  # fmt: skip
@click.option("--forget", metavar="NAME", help="Remove a saved query; without CLIP.")
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
@click.option("--plot", type=PATH, help="Picture of the query, its hits, and where they agree.")
@scheduler_option
@original_option
@csv_option(each_of("hits", without=("why",)))
@json_option
def query(
    library: StrPath,
    clips: tuple[str, ...],
    also: tuple[StrPath, ...],
    from_s: float | None,
    to_s: float | None,
    frames: str | None,
    k: int,
    label: str | None,
    subject: str | None,
    text: str | None,
    where: dict[str, str],
    facets: dict[str, FacetRange],
    flagged: bool | None,
    not_subject: tuple[str, ...],
    joints: str | None,
    unlike: tuple[str, ...],
    whole: bool,
    mirror: bool,
    expand: int | None,
    max_distance: float | None,
    probability: float | None,
    save: str | None,
    forget: str | None,
    weights: str | None,
    exact: bool | None,
    output: Path | None,
    plot: Path | None,
    scheduler: str | None,
    original: bool,
    as_json: bool,
    reader: Reader,
) -> None:
    """Find the stretches of a library that are the motion of a clip, by anybody, at any speed.

    CLIP is a file, or the name of a clip of the library, which is then not searched itself. Of
    several clips, each hit is like one. A distance of 0 is the same motion; about 1 is what a
    stretch taken at random has. A speed of x2 is twice as fast as the query.

    \b
    Example:
      mocapdb query cmu.mocapdb take.bvh --from 2.0 --to 3.5
      mocapdb query cmu.mocapdb 35_17 --not-subject 35 -o hits/
      mocapdb query cmu.mocapdb wave.bvh --joints right-arm --unlike punch.bvh
      mocapdb query cmu.mocapdb hop.bvh --probability .8 --save hops
      mocapdb query cmu.mocapdb hop.bvh --also studio.mocapdb --also s3://bucket/old.mocapdb
    """
    import time

    from mocapdb.library import Filter, Library, query_libraries

    if forget is not None:
        _forget(library, forget, clips, save)
        return
    if not clips:
        raise click.UsageError("Missing argument 'CLIP...'.")
    if frames is not None and (from_s is not None or to_s is not None):
        raise click.UsageError("Expected --frames or --from and --to, but got both.")
    if len(clips) > 1 and (frames or from_s is not None or to_s is not None):
        raise click.UsageError("Expected one clip for a range, but got several clips.")
    if not any(Path(clip).is_file() for clip in (*clips, *unlike)):
        reader.expect_files("no CLIP is a file")
    chosen_weights = _weights(weights)
    if also:
        _refuse_with_many({"--expand": expand, "--save": save})
    with Library(library, original=original) as opened:
        named = [find_clip(opened, clip, reader) for clip in clips]
        examples = [_range(clip, frames, from_s, to_s) for clip, _ in named]
        not_meant = [find_clip(opened, clip, reader) for clip in unlike]
        left_out = [record for _, record in named + not_meant if record]
        only = Filter(label, subject, text, left_out, not_subject, where, facets, flagged)
        say_unmeasured(opened, facets, flagged)
        if not also:
            say_unknown_subjects(opened, not_subject)
        started = time.perf_counter()
        asked_for: dict[str, Any] = {
            "k": k,
            "only": only,
            "unlike": [clip for clip, _ in not_meant],
            "joints": [] if joints is None else joints.split(","),
            "whole": whole,
            "mirror": mirror,
            "expand": expand,
            "weights": chosen_weights,
            "max_distance": math.inf if max_distance is None else max_distance,
            "probability": probability or 0.0,
            "exact": exact,
        }
        parts = [clip for clip, _, _ in examples]
        explain = bool(as_json or plot)
        if also or scheduler:
            found = query_libraries(
                [library, *also], parts, **asked_for, original=original, explain=explain,
                scheduler=scheduler,
            )  # fmt: skip
        else:
            found = _query_one(opened, parts, explain, asked_for)
        seconds = time.perf_counter() - started
        hits = [each.hit for each in found.hits]
        if len(parts) == 1 and len(parts[0]) < len(named[0][0]) and set(clips) & set(unlike):
            found.notes.append(
                f"{clips[0]} is asked for and not meant as well: all that is nearer to the whole "
                "clip than to its part is left out"
            )
        if joints or weights:
            found.notes.append(
                "how likely a hit is was measured with all joints and the usual weights: with "
                "others it is a rough guess"
            )
        for note in found.notes:
            click.echo(f"note: {note}", err=True)
        for place, count in found.unsearchable.items():
            say_not_looked_at(place, count)
        clips_of_hits = partial(_clip_of, opened, library, original)
        outputs = _export(found.hits, clips_of_hits, output) if output else []
        if plot:
            _draw(found.hits, clips_of_hits, *examples[0][:2], plot, several=bool(also))
    if save is not None:
        _save(
            library,
            save,
            [clip for clip, _, _ in examples],
            [clip for clip, _ in not_meant],
            {
                "k": k if max_distance is None and probability is None else max(k, EVERY_HIT),
                "only": {
                    "label": label,
                    "subject": subject,
                    "text": text,
                    "not_subjects": list(not_subject),
                    "where": where,
                    "facets": {name: [*map(_finite, ends)] for name, ends in facets.items()},
                    "flagged": flagged,
                },
                "joints": [] if joints is None else joints.split(","),
                "whole": whole,
                "mirror": mirror,
                "expand": expand,
                "weights": None if chosen_weights is None else [*astuple(chosen_weights)],
                "max_distance": EVERY_DISTANCE if max_distance is None else max_distance,
                "probability": probability or 0.0,
                "exact": exact,
            },
        )
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
                "libraries": found.libraries,
                "hits": [_hit_json(each) for each in found.hits],
                "unsearchable": sum(found.unsearchable.values()),
                "cleaned": found.cleaned,
                "original": original,
                "outputs": [str(path) for path in outputs],
                "notes": found.notes,
                "seconds": seconds,
            }
        )
        return
    if not hits:
        click.echo("no stretch is that near")
        return
    print_table(
        (
            *(["library"] if also else []),
            "clip", "class", "from s", "to s", "distance", "likely", "speed", "description",
        ),
        (
            (
                *([each.library] if also else []),
                hit.record.name,
                hit.record.label or "-",
                f"{hit.start_s:.2f}",
                f"{hit.end_s:.2f}",
                f"{hit.distance:.3f}",
                f"{100 * hit.probability:.0f} %",
                f"x{1 / hit.time_scale:.2f}",
                hit.record.description,
            )
            for each in found.hits
            for hit in [each.hit]
        ),
        left=3 if also else 2,
    )  # fmt: skip
    click.echo(f"{counted(len(hits), 'hit')} in {1000 * seconds:.0f} ms")
    for path in outputs:
        click.echo(f"wrote {path}")
    if plot:
        click.echo(f"wrote {plot}: {_drawn(len(hits))}")


def _finite(end: float) -> float | None:
    """Return an end of a range as JSON has it."""
    return end if math.isfinite(end) else None


def _forget(library: StrPath, name: str, clips: tuple[str, ...], save: str | None) -> None:
    from mocapdb.library import forget_query

    if clips or save is not None:
        raise click.UsageError("Expected --forget alone, without CLIP and --save.")
    forget_query(library, name)
    click.echo(f"{library}: forgot the query {name!r}")


def _save(
    library: StrPath, name: str, examples: list[Clip], unlike: list[Clip], options: dict[str, Any]
) -> None:
    from mocapdb.indexing import canonical_motion
    from mocapdb.library import SavedQuery, save_query

    motions, others = (tuple(map(canonical_motion, clips)) for clips in (examples, unlike))
    replaced = save_query(library, name, SavedQuery(motions, others, options))
    known = ", in place of the one of that name" if replaced else ""
    command = f"mocapdb ls {quote(str(library))} --query {quote(name)}"
    click.echo(f"saved as {name!r} ({cut_of(options)}){known}: {command}", err=True)


def _range(
    clip: Clip, frames: str | None, from_s: float | None, to_s: float | None
) -> tuple[Clip, float, float]:
    """Return the part of a clip that is asked for, and its start and end in seconds."""
    from mocapdb.errors import ClipError

    start, end = 0, len(clip)
    for option, value in (("--from", from_s), ("--to", to_s)):
        if value is not None and not math.isfinite(value):
            raise click.UsageError(f"Expected seconds with {option}, but got {value}.")
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


def _hit_json(found: FoundHit) -> dict[str, Any]:
    hit, why = found.hit, found.why
    told = {} if why is None else {"why": _why_json(why)}
    return {
        "clip": hit.record.name,
        "start": hit.start_s,
        "end": hit.end_s,
        "start_frame": hit.start,
        "end_frame": hit.end,
        "distance": hit.distance,
        "probability": hit.probability,
        "class": hit.record.label,
        "time_scale": hit.time_scale,
        "library": found.library,
        **told,
    }


def _why_json(why: Agreement) -> dict[str, Any]:
    return {
        "parts": _apart_json(why.of_parts()),
        "joints": _apart_json(why.of_joints()),
        "moments": {
            "query_s": why.query_s.round(3).tolist(),
            "clip_s": why.clip_s.round(3).tolist(),
            "apart": why.of_moments().round(3).tolist(),
        },
    }


def _apart_json(apart: dict[str, tuple[float, float]]) -> dict[str, dict[str, float]]:
    return {
        name: {"apart": round(share, 3), "apart_cm": round(100 * metres, 2)}
        for name, (share, metres) in apart.items()
    }


def _query_one(
    library: Library, examples: list[Clip], explain: bool, options: dict[str, Any]
) -> LibraryHits:
    """Return the hits of one library, which is open."""
    from mocapdb.library import Retrieval
    from mocapdb.library.searching.many_libraries import FoundHit, LibraryHits

    retrieval = Retrieval(library)
    hits = retrieval.query(examples, **options)
    place = library.place
    return LibraryHits(
        [FoundHit(place, hit, retrieval.agreement(hit) if explain else None) for hit in hits],
        [place],
        {place: len(library.catalogue.unsearchable())},
        sum(each.changes for each in library.catalogue.revisions().values()),
        retrieval.notes,
    )


def _refuse_with_many(options: dict[str, object]) -> None:
    """Refuse what is for one library, searched by this process."""
    given = [option for option, value in options.items() if value not in (None, False)]
    if given:
        raise click.UsageError(
            f"Expected no {', '.join(given)} with --also: it is for one library."
        )


def _clip_of(
    opened: Library, library: StrPath, original: bool, found: FoundHit, frames: slice | None
) -> Clip:
    """Return the clip of a hit, or some of its frames; of the library that is open, or another."""
    from mocapdb.library import Library

    name = found.hit.record.name
    if found.library in (str(library), opened.place):
        return opened.clip(name, frames)
    with Library(found.library, original=original) as other:
        return other.clip(name, frames)


def _export(hits: list[FoundHit], clip_of: ClipOfHit, folder: Path) -> list[Path]:
    from mocapdb.base.files import make_folder, plain_file_name
    from mocapdb.io import write_clip

    make_folder(folder)
    paths = []
    for number, found in enumerate(hits, start=1):
        hit = found.hit
        name = plain_file_name(hit.record.name)
        path = folder / f"{number:02d}_{name}_{hit.start}-{hit.end}.bvh"
        write_clip(clip_of(found, slice(hit.start, hit.end)), path)
        paths.append(path)
    return paths


def _matched(clip: Clip, hit: Hit) -> IntArray:
    """Return the frames of a hit's clip that those of the query were matched with."""
    import numpy as np

    from mocapdb.indexing.canonical.canonical_motion import FPS

    matched = np.rint(hit.stretch.path * clip.fps / FPS).astype(np.int64)
    return np.asarray(np.minimum(matched, len(clip) - 1))


def _draw(
    hits: list[FoundHit],
    clip_of: ClipOfHit,
    example: Clip,
    start_s: float,
    path: Path,
    *,
    several: bool,
) -> None:
    """Draw an example, which begins at some second of its clip, and its first hits."""
    import numpy as np

    from mocapdb.plots import query_hits

    shown = hits[:DRAWN]
    from_s, to_s = shown[0].hit.sought_s(example) if shown else (0.0, example.duration_s)
    told = f"query: {example.name}  {start_s + from_s:.2f} to {start_s + to_s:.2f} s"
    example = example[round(from_s * example.fps) : round(to_s * example.fps)]
    start_s += round(from_s * example.fps) / example.fps
    clips, times = [], [start_s + np.arange(len(example)) / example.fps]
    for each in shown:
        clip = clip_of(each, None)
        frames = _matched(clip, each.hit)
        clips.append(clip.replace(channels=clip.channels[frames]))
        times.append(frames / clip.fps)
    titles = [
        f"{Path(each.library).stem + ': ' if several else ''}{each.hit.record.name}  "
        f"{each.hit.start_s:.2f} to {each.hit.end_s:.2f} s  d = {each.hit.distance:.2f}"
        for each in shown
    ]
    reasons = [each.why for each in shown if each.why is not None]
    from matplotlib import pyplot

    drawn = query_hits(
        example, clips, titles, agreements=reasons, times_s=times,
        query_title=f"{told}   ({_drawn(len(hits))})",
    )  # fmt: skip
    pyplot.sca(drawn)
    pyplot.savefig(path, dpi=150)


def _drawn(n_hits: int) -> str:
    """Say how many hits a picture shows."""
    return f"the first {DRAWN} of {n_hits} hits" if n_hits > DRAWN else counted(n_hits, "hit")
