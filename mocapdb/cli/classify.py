"""``mocapdb classify``."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import counted, emit_json, print_table
from mocapdb.cli._csv import csv_option
from mocapdb.cli._named_clip import find_clip, say_unsearchable
from mocapdb.cli._options import json_option, library_argument, original_option, where_option
from mocapdb.cli._reader import Reader, reading_options

if TYPE_CHECKING:
    from mocapdb.indexing.recognition.class_models import Classification
    from mocapdb.library import Growth, Library

SHOWN = 5


def _rows(data: Any) -> list[dict[str, Any]]:
    """Return a row for each clip that was classified: its class, and the one that is nearest."""
    if "taken_back" in data:
        return [{"clip": name} for name in data["taken_back"]]
    if "opened" in data:
        return list(data["clips"])
    return [
        {name: value for name, value in each.items() if name != "ranking"}
        | {"class": None if each["rejected"] else each["ranking"][0]["class"]}
        | {"nearest": each["ranking"][0]["class"], "posterior": each["ranking"][0]["posterior"]}
        for each in data.get("clips", [data])
    ]


@click.command()
@library_argument
@click.argument("clip", required=False)
@click.option(
    "--apply", is_flag=True, help="Label the library's unlabelled clips that fit a class."
)
@click.option(
    "--grow", is_flag=True,
    help="Label every unlabelled clip: learn again until nothing moves, and open a class for what "
    "fits none.",
)  # fmt: skip
@click.option("--undo", is_flag=True, help="Take back all labels that --apply and --grow gave.")
@click.option(
    "--by", metavar="COLUMN", help="Classify by this column of the labels, or by subject, instead."
)
@where_option
@click.option("--segments", is_flag=True, help="Also say which class goes on when, or none.")
@original_option
@reading_options
@csv_option(_rows)
@json_option
def classify(
    library: Path,
    clip: str | None,
    apply: bool,
    grow: bool,
    undo: bool,
    by: str | None,
    where: dict[str, str],
    segments: bool,
    original: bool,
    as_json: bool,
    reader: Reader,
) -> None:
    """Say what a clip is: the library's classes by likelihood, or none of them.

    CLIP is a file, a folder of files, or the name of a clip of the library. Without CLIP, the
    library's clips that have no label, or are 'unknown', are classified, and with --apply labelled;
    with --by, all of them are, each by classes learned from other people, as far as they are known.

    \b
    Example:
      mocapdb classify cmu.mocapdb take.bvh
      mocapdb classify cmu.mocapdb --apply
      mocapdb classify cmu.mocapdb --grow
      mocapdb classify styles.mocapdb take.bvh --by style
      mocapdb classify styles.mocapdb --by style
    """
    from mocapdb.library import Library

    if sum((apply, grow, undo)) > 1:
        raise click.UsageError("Expected one of --apply, --grow and --undo, but got several.")
    if (grow or undo) and (clip is not None or where or by is not None):
        raise click.UsageError("Expected --grow and --undo alone: they are of the whole library.")
    if by is not None and apply:
        raise click.UsageError("Expected --by without --apply: only classes are written.")
    if by is not None and where and clip is None:
        raise click.UsageError("Expected --by without --where: all clips are classified.")
    if apply and clip is not None:
        raise click.UsageError("Expected --apply without CLIP: it labels clips of the library.")
    if where and clip is not None:
        raise click.UsageError("Expected --where without CLIP: it chooses clips of the library.")
    if clip is None or not Path(clip).exists():
        reader.expect_files("CLIP is no file")
    with Library(library, original=original) as opened:
        if original and any(each.changes for each in opened.catalogue.revisions().values()):
            click.echo(
                "note: classes are learned from the cleaned motion of clips that were cleaned; "
                "the clip that is asked about is taken as captured.",
                err=True,
            )
        if undo:
            _undo(opened, as_json)
        elif grow:
            _grow(opened, as_json)
        elif clip is None and by is not None:
            _by_column(opened, by, as_json)
        elif clip is None:
            _unlabelled(opened, apply, where, as_json)
        elif Path(clip).is_dir():
            _folder(opened, Path(clip), by, reader, as_json)
        else:
            _one(opened, clip, by, segments, reader, as_json)


def _undo(library: Library, as_json: bool) -> None:
    from mocapdb.library import take_labels_back

    names = take_labels_back(library.path)
    if as_json:
        emit_json({"taken_back": names})
    else:
        click.echo(f"{library.path}: took back the label of {counted(len(names), 'clip')}")


def _grow(library: Library, as_json: bool) -> None:
    from mocapdb.library import Retrieval, apply_labels

    growth = Retrieval(library).grow()
    apply_labels(library.path, growth.labels)
    given = Counter(growth.labels.values())
    opened = [
        {"class": label, "clips": [_grown_json(growth, name) for name in names]}
        for label, names in growth.opened.items()
    ]
    if as_json:
        labels = [_grown_json(growth, name) for name in sorted(growth.labels)]
        emit_json({"clips": labels, "opened": opened, "unsearchable": say_unsearchable(library)})
        return
    if not given:
        click.echo(f"{library.path}: every clip that can be searched has a label.")
        return
    for label, n in sorted(given.items()):
        new = "" if label in growth.known else ", opened"
        click.echo(f"{label}: {counted(n, 'clip')}{new}")
    for label, names in growth.opened.items():
        click.echo(f"{label} was opened, since these fit no class:")
        for name in names:
            click.echo(f"  {name}: {_verdict(growth.before[name])}")
    click.echo(f"take it back with: mocapdb classify {quote(str(library.path))} --undo")


def _grown_json(growth: Growth, name: str) -> dict[str, Any]:
    before = growth.before[name]
    return {
        "clip": name,
        "class": growth.labels[name],
        "novelty": before.novelty,
        "nearest": before.ranking[0].label,
    }


def _one(
    library: Library, name: str, by: str | None, segments: bool, reader: Reader, as_json: bool
) -> None:
    from mocapdb.indexing.canonical.canonical_motion import FPS, canonical_motion
    from mocapdb.library import Retrieval

    clip, _ = find_clip(library, name, reader)
    retrieval = Retrieval(library)
    classes = retrieval.classes if by is None else retrieval.classes_by(by)
    answer = classes.classify(canonical_motion(clip))
    unsearchable = say_unsearchable(library)
    found = classes.segment(canonical_motion(clip)) if segments else []
    stretches = [(each.label, each.start / FPS, each.end / FPS) for each in found]
    if as_json:
        data = _answer_json(clip.name, answer) | assumed_json(clip) | {"unsearchable": unsearchable}
        if segments:
            data["segments"] = [
                {"class": label, "start": start, "end": end} for label, start, end in stretches
            ]
        emit_json(data)
        return
    click.echo(f"{clip.name}: {_verdict(answer)}")
    print_table(
        ("class", "posterior", "share of frames"),
        (
            (score.label, f"{100 * score.posterior:.1f} %", f"{100 * score.share:.1f} %")
            for score in answer.ranking[:SHOWN]
        ),
    )
    for label, start, end in stretches:
        click.echo(f"{start:7.2f} to {end:7.2f} s  {label}")


def _folder(library: Library, folder: Path, by: str | None, reader: Reader, as_json: bool) -> None:
    from mocapdb.indexing.canonical.canonical_motion import canonical_motion
    from mocapdb.library import Retrieval
    from mocapdb.library.building.plan import Failure

    paths = reader.clips_in(folder)
    retrieval = Retrieval(library)
    classes = retrieval.classes if by is None else retrieval.classes_by(by)
    answers, failed = [], []
    assumed: dict[str, dict[str, Any]] = {}
    for path in paths:
        file = path.relative_to(folder).as_posix()
        try:
            clip = reader.read_one_of_many(path)
            answers.append((file, classes.classify(canonical_motion(clip))))
            assumed[file] = assumed_json(clip)
        except Exception as problem:  # whatever one file does, the others are classified
            failure = Failure.of(path, problem)
            failed.append({"path": failure.path, "reason": failure.reason})
            click.echo(f"skipped {failure.to_error()}", err=True)
    more = {"failed": failed, "unsearchable": say_unsearchable(library)}
    _print_many(answers, as_json, more, assumed)
    if failed:
        raise click.exceptions.Exit(1)


def _unlabelled(library: Library, apply: bool, where: dict[str, str], as_json: bool) -> None:
    from mocapdb.library import Retrieval, apply_labels
    from mocapdb.library.library import assumed_of

    found = Retrieval(library).classify_unlabelled(where)
    unsearchable = say_unsearchable(library)
    labels = {record.name: answer.label for record, answer in found if answer.label}
    if apply:
        apply_labels(library.path, labels)
    answers = [(record.name, answer) for record, answer in found]
    assumed = {record.name: assumed_of(record) for record, _ in found}
    _print_many(answers, as_json, {"applied": apply, "unsearchable": unsearchable}, assumed)
    if as_json:
        return
    if not answers:
        click.echo(f"{library.path}: every clip that can be searched has a label.")
    elif apply:
        click.echo(
            f"labelled {len(labels)} of {counted(len(answers), 'clip')}; the others fit no class. "
            f"Take it back with: mocapdb classify {quote(str(library.path))} --undo"
        )


def _by_column(library: Library, column: str, as_json: bool) -> None:
    """Print what every clip is by a column, beside what the column says of it."""
    from mocapdb.library import Retrieval
    from mocapdb.library.library import assumed_of
    from mocapdb.library.searching.retrieval import column_value

    retrieval = Retrieval(library)
    found = retrieval.classify_by(column)
    for note in retrieval.notes:
        click.echo(f"note: {note}", err=True)
    said = {record.name: column_value(record, column) or None for record, _ in found}
    assumed = {record.name: {"said": said[record.name]} | assumed_of(record) for record, _ in found}
    answers = [(record.name, answer) for record, answer in found]
    more = {"by": column, "notes": retrieval.notes, "unsearchable": say_unsearchable(library)}
    _print_many(answers, as_json, more, assumed)
    if not as_json:
        told = [(said[name], answer.label) for name, answer in answers if said[name]]
        right = sum(value == label for value, label in told)
        click.echo(f"{right} of {counted(len(told), 'clip')} are what {column} says of them")


def _print_many(
    answers: list[tuple[str, Classification]],
    as_json: bool,
    more: dict[str, Any],
    assumed: dict[str, dict[str, Any]],
) -> None:
    """Print what clips are, with what was assumed of each for machines."""
    if as_json:
        clips = [_answer_json(name, answer) | assumed[name] for name, answer in answers]
        emit_json({"clips": clips} | more)
    elif answers:
        print_table(
            ("clip", "class", "posterior", "novelty"),
            (
                (
                    name,
                    answer.label or f"none ({answer.ranking[0].label}?)",
                    f"{100 * answer.ranking[0].posterior:.1f} %",
                    f"{answer.novelty:.2f}",
                )
                for name, answer in answers
            ),
            left=2,
        )


def _verdict(answer: Classification) -> str:
    if answer.rejected:
        return (
            f"none of the classes (novelty {answer.novelty:.2f}, over 1); "
            f"the nearest is {answer.ranking[0].label}"
        )
    return f"{answer.label} (novelty {answer.novelty:.2f})"


def _answer_json(name: str, answer: Classification) -> dict[str, Any]:
    return {
        "clip": name,
        "rejected": answer.rejected,
        "novelty": answer.novelty,
        "ranking": [
            {"class": score.label, "posterior": score.posterior, "share": score.share}
            for score in answer.ranking
        ],
    }
