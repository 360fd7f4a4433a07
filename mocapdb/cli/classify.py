"""``mocapdb classify``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import emit_json, print_table
from mocapdb.cli._named_clip import find_clip, say_unsearchable
from mocapdb.cli._options import json_option, library_argument, original_option, where_option
from mocapdb.cli._reader import Reader, reading_options

if TYPE_CHECKING:
    from mocapdb.indexing.recognition.class_models import Classification
    from mocapdb.library import Library

SHOWN = 5


@click.command()
@library_argument
@click.argument("clip", required=False)
@click.option(
    "--apply", is_flag=True, help="Label the library's unlabelled clips that fit a class."
)
@where_option
@click.option("--segments", is_flag=True, help="Also say which class goes on when.")
@original_option
@reading_options
@json_option
def classify(
    library: Path,
    clip: str | None,
    apply: bool,
    where: dict[str, str],
    segments: bool,
    original: bool,
    as_json: bool,
    reader: Reader,
) -> None:
    """Say what a clip is: the library's classes by likelihood, or none of them.

    CLIP is a file, a folder of files, or the name of a clip of the library. Without CLIP, the
    library's clips that have no label are classified, and with --apply labelled.

    \b
    Example:
      mocapdb classify cmu.mocapdb take.bvh
      mocapdb classify cmu.mocapdb --apply
    """
    from mocapdb.library import Library

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
        if clip is None:
            _unlabelled(opened, apply, where, as_json)
        elif Path(clip).is_dir():
            _folder(opened, Path(clip), reader, as_json)
        else:
            _one(opened, clip, segments, reader, as_json)


def _one(library: Library, name: str, segments: bool, reader: Reader, as_json: bool) -> None:
    from mocapdb.indexing.canonical.canonical_motion import FPS, canonical_motion
    from mocapdb.library import Retrieval

    clip, _ = find_clip(library, name, reader)
    retrieval = Retrieval(library)
    answer = retrieval.classify(clip)
    unsearchable = say_unsearchable(library)
    found = retrieval.classes.segment(canonical_motion(clip)) if segments else []
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


def _folder(library: Library, folder: Path, reader: Reader, as_json: bool) -> None:
    from mocapdb.library import Retrieval
    from mocapdb.library.building.plan import Failure, corpus_files

    files = corpus_files(folder)
    retrieval = Retrieval(library)
    answers, failed = [], []
    assumed: dict[str, dict[str, Any]] = {}
    for file in files:
        try:
            clip = reader.read_one_of_many(folder / file)
            answers.append((file, retrieval.classify(clip)))
            assumed[file] = assumed_json(clip)
        except Exception as problem:  # whatever one file does, the others are classified
            failure = Failure.of(folder / file, problem)
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
    if apply:
        labels = {record.name: answer.label for record, answer in found if answer.label}
        apply_labels(library.path, labels)
    answers = [(record.name, answer) for record, answer in found]
    assumed = {record.name: assumed_of(record) for record, _ in found}
    _print_many(answers, as_json, {"applied": apply, "unsearchable": unsearchable}, assumed)
    if not as_json and not answers:
        click.echo(f"{library.path}: every clip that can be searched has a label.")


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
