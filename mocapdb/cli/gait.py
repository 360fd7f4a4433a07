"""``mocapdb gait``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import click

from mocapdb.cli._assumed import assumed_json
from mocapdb.cli._console import counted, emit_json, print_table, progress_bar
from mocapdb.cli._csv import csv_option
from mocapdb.cli._options import (
    PATH,
    check_table_and_picture_files,
    json_option,
    original_option,
    where_option,
)
from mocapdb.cli._reader import Reader, reading_options
from mocapdb.errors import ClipError, MocapdbError
from mocapdb.io.find_files import READ_SUFFIXES
from mocapdb.library.layout import is_library

if TYPE_CHECKING:
    from mocapdb.gait import GaitAnalysis, Spread
    from mocapdb.motion.clip import Clip

ClipToRead: TypeAlias = "tuple[int, str, Callable[[], Clip]]"


def _rows(data: Any) -> list[dict[str, Any]]:
    """Return a row for each foot of each clip: its strides, mean and spread of what they are."""
    return [
        {"clip": each["clip"], "foot": foot, "strides": each["strides"][foot], **each[foot]}
        for each in data["clips"]
        for foot in ("left", "right")
    ]


@click.command()
@click.argument("source", metavar="CLIP|DIR|LIB", type=PATH)
@click.option("-o", "--output", type=PATH, help="Table of strides, .csv: one row a stride.")
@click.option(
    "--angles", type=PATH,
    help="Table of joint angles, .csv: one row an angle and percent of each stride.",
)  # fmt: skip
@click.option(
    "--plot", type=PATH, help="Picture of the angles over the stride: mean and band, each side."
)
@click.option(
    "--events", type=PATH,
    help="Table of foot strikes and toe-offs, .csv; or, of one clip, a .png of its feet with them.",
)  # fmt: skip
@click.option("--class", "label", help="Of a library: only clips of this class.")
@where_option
@click.option("--clip", "name", help="Of a library, only this clip.")
@original_option
@reading_options
@csv_option(_rows)
@json_option
def gait(
    source: Path,
    output: Path | None,
    angles: Path | None,
    plot: Path | None,
    events: Path | None,
    label: str | None,
    where: dict[str, str],
    name: str | None,
    original: bool,
    as_json: bool,
    reader: Reader,
) -> None:
    """Measure gait: foot strikes, strides, left against right, joint angles over the stride.

    From motion alone, of any body of two legs. Clips without a stride are listed with the reason
    and do not stop the others. docs/gait.md has the definitions.

    \b
    Example:
      mocapdb gait 07_01.amc -o strides.csv --angles angles.csv --plot gait.png
      mocapdb gait cmu.mocapdb --class walk -o walks.csv --json
    """
    from mocapdb.gait import analyse_gait

    if (name is not None or label is not None or where or original) and not is_library(source):
        raise click.UsageError(
            "--clip, --class, --where and --original are for clips of a library."
        )
    tables, pictures = {"--output": output, "--angles": angles}, {"--plot": plot}
    listed = events is not None and events.suffix.lower() == ".csv"
    (tables if listed else pictures)["--events"] = events
    check_table_and_picture_files(tables, pictures)
    if is_library(source):
        reader.expect_files("a library's clips are read already")
    if events is not None and not listed and source.is_dir() and name is None:
        raise click.UsageError(
            "--events draws one clip: name a file, or --clip of a library, or a .csv for a table."
        )
    many = source.is_dir() and name is None
    found: list[GaitAnalysis] = []
    without: dict[str, str] = {}
    if not source.is_dir() and source.suffix.lower() not in READ_SUFFIXES:
        raise ClipError(
            f"Expected a clip ({', '.join(READ_SUFFIXES)}), a folder or a library, "
            f"but got {source}."
        )
    with progress_bar("Measuring") as progress:
        for done, (total, path, read) in enumerate(
            _clips(source, label, where, name, original, reader), start=1
        ):
            progress(done, total, path)
            try:
                found.append(analyse_gait(read()))
            except MocapdbError as problem:
                if not many:
                    raise
                without[path] = str(problem)
    _write(found, output, angles, plot, events)
    if as_json:
        written = {"output": output, "angles": angles, "plot": plot, "events": events}
        emit_json(
            {
                "clips": [_figures(each) for each in found],
                "without_gait": without,
                **{what: None if path is None else str(path) for what, path in written.items()},
            }
        )
    else:
        _print(found)
    for path, reason in without.items():
        click.echo(f"no gait: {path}: {reason}", err=True)
    if many and not found:
        raise click.exceptions.Exit(1)


def _clips(
    source: Path,
    label: str | None,
    where: dict[str, str],
    name: str | None,
    original: bool,
    reader: Reader,
) -> Iterator[ClipToRead]:
    """Yield how many clips there are, and the name of each with what reads it."""
    if is_library(source):
        from mocapdb.library import Library

        with Library(source, original=original) as library:
            if name is not None:
                records = [library.record(name)]
            else:
                records = library.records(label=label, where=where)
            if not records:
                raise ClipError(f"{source} has no clip like that. It has: "
                                f"{', '.join(library.classes()) or 'no classes'}.")  # fmt: skip
            for record in records:
                yield len(records), record.name, partial(library.clip, record.name)
    elif source.is_dir():
        paths = reader.clips_in(source)
        for path in paths:
            yield len(paths), str(path), partial(reader.read_one_of_many, path)
    else:
        yield 1, str(source), partial(reader.read, source, drop_tpose=True)


def _write(
    found: list[GaitAnalysis],
    output: Path | None,
    angles: Path | None,
    plot: Path | None,
    events: Path | None,
) -> None:
    """Write what was asked for."""
    from mocapdb.gait.gait_tables import write_angles, write_events, write_strides

    if not found:
        return
    if output is not None:
        write_strides(found, output)
    if angles is not None:
        write_angles(found, angles)
    if plot is not None:
        from mocapdb.plots import gait_chart

        _save(gait_chart(found).figure, plot)
    if events is not None and events.suffix.lower() == ".csv":
        write_events(found, events)
    elif events is not None:
        from matplotlib import pyplot

        from mocapdb.plots import foot_events

        figure, axes = pyplot.subplots(2, 1, figsize=(9, 5.2), layout="constrained")
        for ax, side in zip(axes, ("left", "right"), strict=True):
            foot_events(found[0], side, ax=ax)
        _save(figure, events)


def _save(figure: Any, path: Path) -> None:
    from matplotlib import pyplot

    from mocapdb.base.files import make_folder, replacing

    make_folder(path.parent)
    with replacing(path) as (temporary,):
        figure.savefig(temporary, dpi=120, format="png")
    pyplot.close(figure)


def _figures(found: GaitAnalysis) -> dict[str, Any]:
    """Return what is told of a clip's gait."""
    fps = found.clip.fps
    return {
        "clip": found.clip.name,
        **assumed_json(found.clip),
        "zero": found.zero,
        "notes": list(found.notes),
        "refused_strides": list(found.refused),
        "events": {
            side: {
                "strike_s": [c.strike / fps for c in contacts if c.strike is not None],
                "toe_off_s": [c.toe_off / fps for c in contacts if c.toe_off is not None],
            }
            for side, contacts in zip(("left", "right"), found.contacts, strict=True)
        },
        "strides": {side: len(found.of_side(side)) for side in ("left", "right")},
        "all": _spreads(found.spreads()),
        "left": _spreads(found.spreads("left")),
        "right": _spreads(found.spreads("right")),
        "asymmetry_pct": found.asymmetry_pct(),
        "angles_deg": {
            f"{side} {joint} {angle}": {
                "mean": mean.round(2).tolist(),
                "sd": None if len(found.curves[side, joint, angle]) < 2 else sd.round(2).tolist(),
            }
            for (side, joint, angle), (mean, sd) in found.mean_curves().items()
        },
    }


def _spreads(spreads: dict[str, Spread]) -> dict[str, Any]:
    return {
        name: {
            "mean": each.mean,
            "sd": each.sd if each.n > 1 else None,
            "cv_pct": each.cv_pct if each.n > 1 and each.mean else None,
            "n": each.n,
        }
        for name, each in spreads.items()
    }


def _print(found: list[GaitAnalysis]) -> None:
    rows = []
    for each in found:
        for side in ("left", "right"):
            of = each.spreads(side)
            if of:
                rows.append(
                    (
                        each.clip.name, side, str(len(each.of_side(side))),
                        f"{of['speed_m_s'].mean:.2f} m/s",
                        f"{of['cadence_steps_min'].mean:.0f}",
                        f"{of['stride_length_m'].mean:.2f} m",
                        f"{of['step_length_m'].mean:.2f} m",
                        f"{of['step_width_m'].mean:.2f} m",
                        f"{of['stance_pct'].mean:.1f} %",
                        f"{of['double_support_pct'].mean:.1f} %",
                        f"{of['flight_pct'].mean:.1f} %",
                    )
                )  # fmt: skip
    if rows:
        columns = (
            "clip", "foot", "strides", "speed", "steps/min", "stride", "step", "width", "stance",
            "both feet", "flight",
        )  # fmt: skip
        print_table(columns, rows, left=2)
    zeros: dict[str, list[str]] = {}  # what zero means, and why it is not the rest pose
    for each in found:
        kind, _, why = each.zero.partition(" (")
        zeros.setdefault(kind, []).append(why.removesuffix(")"))
    for kind, reasons in zeros.items():
        why = "; ".join(dict.fromkeys(filter(None, reasons)))
        click.echo(
            f"zero angles  {kind}"
            + (f" ({why})" if why else "")
            + (f"; {counted(len(reasons), 'clip')}" if len(found) > 1 else "")
        )
    for each in found:
        for note in each.notes:
            click.echo(f"note: {each.clip.name}: {note}", err=True)
