"""``mocapdb clean``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing, nullcontext
from functools import partial
from pathlib import Path, PurePosixPath, PureWindowsPath
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import click

from mocapdb.base.files import keeping_inputs, make_folder
from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._cleaned_library import apply_cleaning, undo_cleaning
from mocapdb.cli._console import counted, emit_json, print_table, progress_bar
from mocapdb.cli._context import Context, context_json, context_notes
from mocapdb.cli._csv import csv_option
from mocapdb.cli._options import PATH, json_option, original_option, scheduler_option
from mocapdb.cli._reader import Reader, reading_options, warnings_of
from mocapdb.errors import ClipError, MocapdbError
from mocapdb.io.find_files import READ_SUFFIXES
from mocapdb.library.catalogue import Catalogue
from mocapdb.library.layout import CATALOGUE_FILE, is_library
from mocapdb.library.naming import file_and_take

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mocapdb.base.arrays import StrPath
    from mocapdb.cleaning import Cleaned, MovementDigressionMap, Span
    from mocapdb.cleaning.repair.contact_targets import Contact
    from mocapdb.cleaning.repair.foot_skate import Way
    from mocapdb.motion.clip import Clip
    from mocapdb.motion.frame_range import FrameRange

MOST_DRAWN = 6  # spans in a picture of before and after
LEAST_FRAMES = 4  # of a clip in which jumps can be told
LEAST_TOLD = 0.1  # confidence below the threshold that is still told, in JSON


ClipToRead: TypeAlias = "tuple[str, str, str, Callable[[], Clip]]"
"""Path and stem of a clip, its suffix, and what reads it, here or in another process."""

_drawing = Lock()  # pyplot is for one thread at a time, and workers of a cluster may have several


class ContactWish(NamedTuple):
    """A contact as the command line names it."""

    joint: str
    start_s: float
    end_s: float
    place: tuple[float, ...] | None


def _contacts(context: click.Context, option: click.Parameter, texts: Any) -> Any:
    """Return what ``JOINT@FROM-TO`` or ``JOINT@FROM-TO=X,Y,Z`` wish for."""
    wishes = []
    for text in texts:
        where, _, place = text.partition("=")
        joint, _, times = where.rpartition("@")
        try:
            start, end = (float(second) for second in times.split("-"))
            wanted = tuple(float(x) for x in place.split(",")) if place else None
        except ValueError:
            raise click.BadParameter(
                f"expected JOINT@FROM-TO or JOINT@FROM-TO=X,Y,Z in seconds, but got {text!r}"
            ) from None
        wishes.append(ContactWish(joint, start, end, wanted))
    return tuple(wishes)


class Order(NamedTuple):
    """What is to be done with each clip."""

    context: Context
    threshold: float | None
    contacts: tuple[ContactWish, ...]
    hold_feet: bool
    foot_skate: Way | None
    two_stage: bool
    literal: bool
    is_file: bool  # whether clips are read from files, whose text may be kept
    skeleton: Path | None  # that an AMC is said to have
    blender: StrPath | None  # what writes an FBX


class Places(NamedTuple):
    """Where what came of a clip, or of several, is written."""

    output: Path | None
    picture: Path | None
    comparison: Path | None

    def check(self, *, several: bool) -> None:
        """Refuse files where several clips need folders, and pictures that are no PNG."""
        options = zip(("-o", "--map", "--before-after"), self, strict=True)
        for option, path in options:
            if path is None:
                continue
            if several and (path.is_file() or path.suffix.lower() in {*READ_SUFFIXES, ".png"}):
                raise click.UsageError(
                    f"{option} is a file, but several clips need a folder: got {path}."
                )
            if not several and option != "-o" and path.suffix.lower() != ".png":
                raise click.UsageError(f"Expected a .png with {option}, but got {path.name!r}.")

    def of(self, stem: str, suffix: str) -> Places:
        """Return the files of one clip, where these are folders that its name may not leave."""
        if any(
            Pure(stem).is_absolute() or ".." in Pure(stem).parts
            for Pure in (PurePosixPath, PureWindowsPath)
        ):
            raise ClipError(f"Expected a clip's name, but {stem!r} leads out of the folder.")
        return Places(
            self.output / f"{stem}{suffix}" if self.output else None,
            self.picture / f"{stem}.png" if self.picture else None,
            self.comparison / f"{stem}.png" if self.comparison else None,
        )


def _rows(data: Any) -> list[dict[str, Any]]:
    """Return a row for each span that was flagged; of revisions kept or undone what was done."""
    reports = data.get("clips", [data])
    if not all(isinstance(each, dict) and "spans" in each for each in reports):
        return [data]
    return [{"clip": report["clip"], **span} for report in reports for span in report["spans"]]


@click.command()
@click.argument("source", metavar="CLIP|DIR|LIB", type=PATH)
@click.option(
    "-o", "--output", type=PATH,
    help="Where to write the cleaned clip (AMC, BVH or NPZ by its suffix); of several, a folder.",
)  # fmt: skip
@click.option(
    "--context", "contexts", multiple=True, type=PATH,
    help="Clip, folder or library with similar motion, of any human body or of the same joints; "
    "several times if need be.",
)  # fmt: skip
@click.option(
    "--map", "picture", type=PATH,
    help="Draw the movement digression map into this file; of several clips, into this folder.",
)  # fmt: skip
@click.option(
    "--before-after", "comparison", type=PATH,
    help="Draw the angles of repaired joints, before and after, into this file or folder.",
)  # fmt: skip
@click.option("--detect-only", is_flag=True, help="Only say what is wrong; write no clip.")
@click.option("--threshold", type=float, help="Confidence from which a span is flagged.")
@click.option(
    "--contact", "contacts", multiple=True, callback=_contacts, metavar="JOINT@FROM-TO[=X,Y,Z]",
    help="From a second to another a joint is in one place: by default where it is in those "
    "frames that are not flagged. Repairs reach it.",
)  # fmt: skip
@click.option(
    "--hold-feet/--no-hold-feet", default=True, show_default=True,
    help="Keep a foot where it is that rests before and after a repaired span.",
)  # fmt: skip
@click.option(
    "--foot-skate", type=click.Choice(["legs", "root"]),
    help="Afterwards stop resting feet from sliding, by bending the legs or by moving the root.",
)  # fmt: skip
@click.option(
    "--two-stage", is_flag=True,
    help="Search the context only for words that are unlike the rest of the clip, by halves of "
    "the body: quicker with a large context.",
)  # fmt: skip
@click.option(
    "--literal", is_flag=True,
    help="Take the map of the paper as printed, to compare with: it flags nearly everything.",
)  # fmt: skip
@click.option("--clip", "name", help="Of a library, only this clip.")
@click.option(
    "--apply", is_flag=True,
    help="Of a library: keep what is repaired beside each clip as it was captured. Export, query, "
    "classify, cycle, report and view take it from then on, unless told --original.",
)  # fmt: skip
@click.option("--undo", is_flag=True, help="Of a library: take back what --apply has kept.")
@click.option("--jobs", type=click.IntRange(min=1), help="Of --apply: worker processes.")
@scheduler_option
@original_option
@reading_options
@csv_option(_rows)
@json_option
def clean(
    source: Path,
    output: Path | None,
    contexts: tuple[Path, ...],
    picture: Path | None,
    comparison: Path | None,
    detect_only: bool,
    threshold: float | None,
    contacts: tuple[ContactWish, ...],
    hold_feet: bool,
    foot_skate: Way | None,
    two_stage: bool,
    literal: bool,
    name: str | None,
    apply: bool,
    undo: bool,
    jobs: int | None,
    scheduler: str | None,
    original: bool,
    as_json: bool,
    reader: Reader,
) -> None:
    """Say which joint is wrong, from when to when, how surely and in what way; repair only that.

    Without -o the clip is only looked at. Frames and joints that are not flagged stay bit for
    bit (in the format of the source), unless --foot-skate asks for more.

    \b
    Example:
      mocapdb clean take.bvh -o clean.bvh --map mdm.png
      mocapdb clean takes/ -o cleaned/ --context cmu.mocapdb
      mocapdb clean cmu.mocapdb --apply
      mocapdb clean take.bvh -o clean.bvh --contact RightHand@1.2-1.8 --foot-skate legs
    """
    if is_library(source):
        reader.expect_files("a library's clips are read already")
    if apply or undo:
        drawing = {"-o": output, "--map": picture, "--before-after": comparison}
        others = {"--detect-only": detect_only, "--contact": contacts, "--foot-skate": foot_skate,
                  "--literal": literal}  # fmt: skip
        _refuse_with_revisions(apply, undo, [*drawing.items(), *others.items()])
        _expect_library(source)
        names = None if name is None else [name]
        if undo:
            if scheduler is not None:
                raise click.UsageError("--undo has nothing to share out: leave out --scheduler.")
            undo_cleaning(source, names, as_json)
            return
        from mocapdb.library.building.revise_clips import CleaningSettings

        said = CleaningSettings(threshold, hold_feet, two_stage, tuple(map(str, contexts)))
        apply_cleaning(source, names, said, Context(contexts), jobs, scheduler, as_json)
        return
    if detect_only and output is not None:
        raise click.UsageError("--detect-only writes no clip: leave out -o.")
    if foot_skate and output is None:
        raise click.UsageError("--foot-skate changes the clip: say where to write it, with -o.")
    if name is not None and not is_library(source):
        raise click.UsageError("--clip names a clip of a library.")
    said_skeleton = reader.said.skeleton
    order = Order(
        Context(contexts), threshold, contacts, hold_feet, foot_skate, two_stage, literal,
        not is_library(source), said_skeleton if isinstance(said_skeleton, Path) else None,
        reader.said.blender,
    )  # fmt: skip
    places = Places(output, picture, comparison)
    places.check(several=source.is_dir())
    if source.is_dir():
        clips = _clips(source, name, reader, original)
        _clean_many(source, clips, order, places, scheduler, as_json)
        return
    if scheduler is not None:
        raise click.UsageError("Expected a folder or a library with --scheduler, but got one clip.")
    if source.suffix.lower() not in READ_SUFFIXES:
        raise ClipError(
            f"Expected a clip ({', '.join(READ_SUFFIXES)}), a folder or a library, "
            f"but got {source}."
        )
    report = _clean_one(reader.read(source), order, places)
    if as_json:
        emit_json(report)
    else:
        _print(report)


def _refuse_with_revisions(apply: bool, undo: bool, others: Sequence[tuple[str, object]]) -> None:
    """Refuse what makes no sense beside ``--apply`` or ``--undo``."""
    if apply and undo:
        raise click.UsageError(
            "--apply keeps what is repaired, and --undo takes it back: give one of them."
        )
    what = "--apply keeps repairs in the library" if apply else "--undo takes repairs back"
    given = [option for option, value in others if value not in (None, False, ())]
    if given:
        raise click.UsageError(f"{what}: leave out {', '.join(given)}.")


def _expect_library(source: Path) -> None:
    """Refuse to keep or take back revisions where there is no library."""
    if source.is_file():
        raise click.UsageError("--apply and --undo are for a library; of a clip, write -o FILE.")
    Catalogue(source).close()


def _clean_many(
    source: Path,
    clips: Sequence[ClipToRead],
    order: Order,
    to: Places,
    scheduler: str | None,
    as_json: bool,
) -> None:
    """Clean the clips of a folder or a library; a clip that fails is named and passed over."""
    from mocapdb.base.workers import marked_folders, on_workers

    reports: list[dict[str, Any]] = []
    failed: list[dict[str, Any]] = []
    written = [folder for folder in to if folder] if scheduler else []
    if scheduler and order.context.paths:
        click.echo("note: each worker reads the context; its log says what it leaves out", err=True)
    with marked_folders(*written) as marks, progress_bar("Cleaning") as progress:
        if scheduler:
            _expect_no_input_written(clips, to)
        first = [source / CATALOGUE_FILE if is_library(source) else Path(clips[0][0])]
        seen = [*marks, *first, *order.context.paths]
        orders = ((path, stem, suffix, read, order, to, scheduler is not None)
                  for path, stem, suffix, read in clips)  # fmt: skip
        with closing(
            on_workers(_clean_one_of_many, orders, jobs=1, scheduler=scheduler, seen=seen)
        ) as answers:
            for done, (clip, answer) in enumerate(zip(clips, answers, strict=True), start=1):
                report, warnings, reason = answer
                progress(done, len(clips), clip[1])
                for warning in warnings:
                    click.echo(warning, err=True)
                if reason is None:
                    reports.append(report)
                else:
                    failed.append({"path": clip[0], "reason": reason})
    if as_json:
        emit_json({"clips": reports, "failed": failed})
    else:
        for report in reports:
            _print(report)
    for failure in failed:
        click.echo(f"{failure['path']}: {failure['reason']}", err=True)
    if failed:
        raise click.exceptions.Exit(1)


def _expect_no_input_written(clips: Sequence[ClipToRead], to: Places) -> None:
    """Refuse to write over a clip that another worker may still have to read."""
    inputs = {Path(path).resolve() for path, *_ in clips}
    for _, stem, suffix, _ in clips:
        output = to.of(stem, suffix).output
        if output is not None and output.resolve() in inputs:
            raise ClipError(
                f"Expected outputs that are none of the clips to be read, but got {output}. Name "
                "another folder."
            )


def _clips(source: Path, name: str | None, reader: Reader, original: bool) -> list[ClipToRead]:
    """Return path, stem and suffix of each clip with what reads it."""
    if is_library(source):
        from mocapdb.library import Library
        from mocapdb.library.building.revise_clips import captured_clip

        with Library(source, original=original) as library:
            records = library.records() if name is None else [library.record(name)]
            return [
                (
                    record.name,
                    record.name,
                    Path(file_and_take(record.source)[0]).suffix.lower(),
                    partial(captured_clip, library.stored(record)),
                )
                for record in records
            ]
    return [
        (
            str(path),
            path.relative_to(source).with_suffix("").as_posix(),
            path.suffix,
            partial(reader.read_one_of_many, path, silently=True),
        )
        for path in reader.clips_in(source)
    ]


def _clean_one_of_many(
    path: str,
    stem: str,
    suffix: str,
    read: Callable[[], Clip],
    order: Order,
    to: Places,
    is_elsewhere: bool,
) -> tuple[dict[str, Any], list[str], str | None]:
    """Clean one clip, here or in a worker of a cluster.

    Returns
    -------
    report, warnings, reason
        What the JSON contract says of it, what its file warns of, and why it failed, if it did.
    """
    from mocapdb.library.building.plan import what_happened

    warnings: list[str] = []
    try:
        with keeping_inputs() if is_elsewhere else nullcontext():
            clip = read()
            warnings = warnings_of(clip, path)
            return _clean_one(clip, order, to.of(stem, suffix)), warnings, None
    except MocapdbError as problem:
        return {}, warnings, str(problem)
    except Exception as problem:  # whatever one file does, the others are cleaned
        return {}, warnings, what_happened(problem)


def _clean_one(clip: Clip, order: Order, to: Places) -> dict[str, Any]:
    """Clean a clip, write what was asked for, and return what the JSON contract says of it."""
    from mocapdb.cleaning import Cleaned, detect_faults, repair_spans
    from mocapdb.cleaning.repair.contact_targets import make_contact
    from mocapdb.cleaning.repair.foot_skate import remove_foot_skate
    from mocapdb.cleaning.repair.repair import as_repaired
    from mocapdb.io.source_text import write_like_source
    from mocapdb.jobs import write_clip
    from mocapdb.library.building.revise_clips import span_rows

    vocabularies = order.context.of(clip)
    found = detect_faults(
        clip, vocabularies, threshold=order.threshold, two_stage=order.two_stage,
        literal=order.literal,
    )  # fmt: skip
    contacts: list[Contact] = [
        make_contact(clip, *wish, flagged=found.mask) for wish in order.contacts
    ]
    repaired, repairs = repair_spans(clip, found, contacts=contacts, hold_feet=order.hold_feet)
    cleaned = Cleaned(repaired, as_repaired(found, repairs), repairs)
    skate = remove_foot_skate(repaired, order.foot_skate) if order.foot_skate else None
    text_kept = False
    if to.output is not None:
        make_folder(to.output.parent)
        result = skate.clip if skate else repaired
        text_kept = order.is_file and write_like_source(
            clip, result, to.output, skeleton=order.skeleton
        )
        if not text_kept:
            write_clip(result, to.output, blender=order.blender)
    with _drawing:
        if to.picture is not None:
            _draw_map(clip, cleaned, to.picture)
        if to.comparison is not None:
            _draw_comparison(clip, cleaned, to.comparison)
    notes = [
        *_short_notes(found),
        *context_notes(vocabularies),
        *(_cut_note(found, cut) for cut in found.cut_off),
    ]
    if clip.was_coded:
        notes.append(
            "a codec drew some of these curves: of small joints more or less may be flagged than "
            "as captured"
        )
    n_repaired = sum(repair.repaired for repair in repairs)
    if to.comparison is not None and n_repaired > MOST_DRAWN:
        notes.append(_drawn_note(n_repaired))
    return {
        "clip": clip.name,
        "seconds": clip.duration_s,
        **assumed_json(clip),
        "context": context_json(vocabularies),
        "threshold": found.threshold,
        "spans": [
            row | {"repaired": to.output is not None and row["repaired"]}
            for row in span_rows(clip, repaired, repairs)
        ],
        "below_threshold": below_threshold(found),
        "notes": notes,
        "foot_slide_mm": {"before": skate.slide_before_mm, "after": skate.slide_after_mm}
        if skate
        else None,
        "output": None if to.output is None else str(to.output),
        "text_kept": text_kept if to.output is not None else None,
        "map": None if to.picture is None else str(to.picture),
        "before_after": None if to.comparison is None else str(to.comparison),
    }


def _short_notes(found: MovementDigressionMap) -> list[str]:
    """Return what is said of a clip that is too short for all or some of the search."""
    from mocapdb.cleaning.tuning import SOURCE_FRAMES

    n_frames = len(found.scores) if found.searched is None else len(found.searched)
    if n_frames < LEAST_FRAMES:
        return [
            f"{counted(n_frames, 'frame')}: too short to be looked at; it takes {LEAST_FRAMES} "
            "to tell a jump from a pace"
        ]
    if found.consensus is None:
        seconds = SOURCE_FRAMES / found.texture.fps
        return [
            f"{n_frames / found.fps:.2f} s: too short to be compared with similar motion, which "
            f"takes {seconds:.2f} s with a --context and some more without; only jumps were "
            "looked for"
        ]
    return []


def _cut_note(found: MovementDigressionMap, cut: FrameRange) -> str:
    """Return what is said of frames that are cut on to the motion."""
    which = f"frame {cut.start}" if len(cut) == 1 else f"frames {cut.start} to {cut.end - 1}"
    where = "in front of" if cut.start == 0 else "behind"
    return (
        f"{which} of {len(found.scores)}, {where} a jump of the whole body (such as a T-pose that "
        "a conversion put there): not searched, and left as captured"
    )


def below_threshold(found: MovementDigressionMap) -> list[dict[str, Any]]:
    """Return stretches that look like faults but are not sure enough to be flagged.

    A row is a stretch of a joint without pause; those under `LEAST_TOLD` are left out.
    """
    from mocapdb.motion.frame_range import ranges_where

    scores = found.scores
    told = (scores >= LEAST_TOLD) & (scores < found.threshold) & ~found.mask
    rows = [
        {
            "joint": found.skeleton.names[joint],
            "start": run.start / found.fps,
            "end": run.end / found.fps,
            "frames": [run.start, run.end],
            "confidence": round(float(scores[run.frames, joint].max()), 4),
        }
        for joint in range(scores.shape[1])
        for run in ranges_where(told[:, joint])
    ]
    return sorted(rows, key=lambda row: -row["confidence"])


def _draw_map(clip: Clip, cleaned: Cleaned, path: Path) -> None:
    from mocapdb.plots import digression_map

    ax = digression_map(cleaned.digression_map)
    ax.set_title(clip.name, fontsize=9, loc="left")
    _save(ax, path)


def _draw_comparison(clip: Clip, cleaned: Cleaned, path: Path) -> None:
    """Draw those of the repaired spans that moved the most, by time, each from close by."""
    from matplotlib import pyplot

    from mocapdb.plots import before_and_after

    spans = [repair.span for repair in cleaned.repairs if repair.repaired]
    drawn = sorted(_most_moved(clip, cleaned)[:MOST_DRAWN], key=lambda span: span.start)
    _, axes = pyplot.subplots(
        max(1, len(drawn)), squeeze=False, layout="constrained",
        figsize=(9, 2.6 * max(1, len(drawn))),
    )  # fmt: skip
    for ax, span in zip(axes[:, 0], drawn, strict=False):
        before_and_after(clip, cleaned.clip, span.joint, spans=spans, around=span, ax=ax)
    if not drawn:
        axes[0, 0].set_title(f"{clip.name}: nothing was repaired", fontsize=9, loc="left")
        axes[0, 0].set_axis_off()
    if len(drawn) < len(spans):
        axes[0, 0].figure.suptitle(_drawn_note(len(spans)), fontsize=9)
    _save(axes[0, 0], path)


def _drawn_note(n_spans: int) -> str:
    return f"{MOST_DRAWN} of {n_spans} spans drawn, those that moved the most"


def _most_moved(clip: Clip, cleaned: Cleaned) -> list[Span]:
    """Return the repaired spans, jumps of the root first, then by how far the joint was turned."""
    from mocapdb.library.building.revise_clips import span_rows

    rows = span_rows(clip, cleaned.clip, cleaned.repairs)
    moved = [
        float("inf") if row["moved_mm"] is not None else row["moved_deg"] or 0.0 for row in rows
    ]
    spans = [(far, r.span) for far, r in zip(moved, cleaned.repairs, strict=True) if r.repaired]
    return [span for _, span in sorted(spans, key=lambda pair: -pair[0])]


def _save(ax: Axes, path: Path) -> None:
    from matplotlib import pyplot

    from mocapdb.base.files import replacing

    make_folder(path.parent)
    figure: Any = ax.figure
    with replacing(path) as (temporary,):
        figure.savefig(temporary, dpi=120, format="png")
    pyplot.close(figure)


def _moved(span: dict[str, Any]) -> str:
    """Return by how much a span would be, or was, moved."""
    ways = ((span["moved_deg"], "deg"), (span["moved_mm"], "mm"))
    return ", ".join(f"{moved:.1f} {unit}" for moved, unit in ways if moved is not None) or "-"


def _print(report: dict[str, Any]) -> None:
    spans = report["spans"]
    if not spans:
        click.echo(f"{report['clip']}: nothing flagged in {report['seconds']:.2f} s")
    else:
        print_table(
            ("joint", "kind", "from", "to", "sure", "repair", "moved", "may be off"),
            [
                (
                    span["joint"], span["kind"], f"{span['start']:.3f} s", f"{span['end']:.3f} s",
                    f"{span['confidence']:.0%}", span["method"], _moved(span),
                    "-" if span["expected_deg"] is None else f"{span['expected_deg']:.1f} deg",
                )
                for span in spans
            ],
            left=2,
            title=f"{report['clip']}: {len(spans)} flagged in {report['seconds']:.2f} s",
        )  # fmt: skip
    for note in report["notes"]:
        click.echo(f"note: {note}")
    slide = report["foot_slide_mm"]
    if slide:
        click.echo(f"resting feet slid {slide['before']:.1f} mm, now {slide['after']:.1f} mm")
    for what in ("output", "map", "before_after"):
        if report[what]:
            click.echo(f"{what.replace('_', ' and ')}: {report[what]}")
