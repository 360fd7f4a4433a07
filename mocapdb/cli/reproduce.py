"""``mocapdb reproduce``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mocapdb.cli._console import emit_json, print_table, progress_bar
from mocapdb.cli._options import PATH, Command, json_option

if TYPE_CHECKING:
    from mocapdb.base.arrays import FloatArray
    from mocapdb.reproduce._tables import Row


def _corpus_option(formats: str) -> Callable[[Command], Command]:
    """Add ``--corpus``, a folder of CMU's clips in some formats."""
    return click.option(
        "--corpus", required=True, type=PATH,
        help=f"Folder with CMU's {formats} files, at any depth.",
    )  # fmt: skip


@click.group()
def reproduce() -> None:
    """Compute the papers' tables beside their figures.

    \b
    Example:
      mocapdb reproduce okane --corpus cmu/ --table 4.1
      mocapdb reproduce all --corpus cmu/ -o tables/
    """


@reproduce.command("all", short_help="All four papers, written as Markdown and CSV.")
@_corpus_option("and HDM05's")
@click.option(
    "-o", "--output", type=PATH, required=True,
    help="Folder for the tables: .md and .csv of each paper and of all verdicts (papers), .json.",
)  # fmt: skip
@click.option(
    "--clips", type=click.IntRange(1), default=12, show_default=True,
    help="For Aristidou's tables, clips of each motion at most.",
)  # fmt: skip
@click.option(
    "--kit-clips", type=click.IntRange(1), default=2, show_default=True,
    help="For Aristidou's kit, clips for each kind of fault.",
)  # fmt: skip
@click.option("--seed", type=int, default=1, show_default=True, help="Of clips and faults drawn.")
@click.option("--jobs", type=click.IntRange(1), help="Processes; by default as many as processors.")
@json_option
def all_papers(
    corpus: Path, output: Path, clips: int, kit_clips: int, seed: int, jobs: int | None,
    as_json: bool,
) -> None:  # fmt: skip
    """Compute the tables of all four papers beside theirs, and judge each of their claims.

    Every file names the kind of machine, the versions and the date. A cell that cannot be computed
    says why; what was bounded to keep the run short is said too. It takes some minutes.

    \b
    Example:
      mocapdb reproduce all --corpus cmu/ -o tables/
      mocapdb reproduce all --corpus cmu/ -o tables/ --clips 20 --kit-clips 8
    """
    import os

    from mocapdb.reproduce.side_by_side.all_papers import reproduce_all

    if output.exists() and not output.is_dir():  # before minutes are spent
        raise click.UsageError(f"Expected a folder with --output, but {output} is a file.")
    run = reproduce_all(
        corpus, clips=clips, kit_clips=kit_clips, seed=seed, jobs=jobs or os.cpu_count() or 1,
        bar=progress_bar,
    )  # fmt: skip
    written = run.write(output)
    if as_json:
        emit_json(run.to_json() | {"files": [str(path) for path in written]})
        return
    for paper in run.papers:
        click.echo(paper.paper)
        for verdict in paper.verdicts:
            click.echo(f"  - {verdict}")
        for bound in paper.bounds:
            click.echo(f"  bounded: {bound}")
    click.echo(f"{len(written)} files in {output}")


@reproduce.command(short_help="O'Kane (2008): compression and recognition.")
@_corpus_option("AMC or BVH")
@click.option(
    "--table", "tables", multiple=True,
    type=click.Choice(
        ["4.1", "4.2", "4.3", "4.4", "4.5", "4.6", "4.7", "4.8", "wavelets", "readings", "variance"]
    ),
    help="Only this table; may be given several times. wavelets: 4.3 with several; readings: his "
    "text read in other ways; variance: the proportion held by the first dimensions.",
)  # fmt: skip
@click.option(
    "--picture", type=PATH, help="Draw the proportion of variance into a .png, .svg or .pdf."
)
@json_option
def okane(corpus: Path, tables: tuple[str, ...], picture: Path | None, as_json: bool) -> None:
    """Compute O'Kane's (2008) tables of compression and recognition on the clips at hand.

    The thesis does not name its clips: where those at hand have other frames, a row is computed
    on a stand-in and says so, or says why it cannot be computed. At the end stands a verdict on
    each of his claims. All tables take a few minutes.

    \b
    Example:
      mocapdb reproduce okane --corpus cmu/ --table 4.1
      mocapdb reproduce okane --corpus cmu/ --table variance --picture variance.png
    """
    from mocapdb.reproduce import okane as thesis
    from mocapdb.reproduce import okane_open_questions as questions
    from mocapdb.reproduce import recognition
    from mocapdb.reproduce.side_by_side.okane_claims import verdicts

    if picture is not None and picture.suffix.lower() not in {".png", ".svg", ".pdf"}:
        raise click.UsageError(f"Expected a .png, .svg or .pdf, but got {picture.name!r}.")

    def wanted(known: Sequence[str]) -> list[str]:
        return [table for table in known if not tables or table in tables]

    rows: list[Row] = []
    recognised: list[Row] = []
    tried: list[Row] = []
    if compressing := wanted(thesis.TABLES):
        with progress_bar("Compressing") as progress:
            rows = thesis.reproduce(corpus, tables=compressing, progress=progress)
    if recognising := wanted(recognition.TABLES):
        with progress_bar("Recognising") as progress:
            recognised = recognition.reproduce(corpus, tables=recognising, progress=progress)
    for name, compute in (("wavelets", questions.wavelets), ("readings", questions.readings)):
        if wanted([name]):
            with progress_bar(name.capitalize()) as progress:
                tried += compute(corpus, progress=progress)
    if wanted(["variance"]) or picture is not None:
        with progress_bar("Variance") as progress:
            spread, shares = questions.variance(corpus, progress=progress)
        tried += spread
        if picture is not None:
            _save_variance(shares, picture)
    judged = verdicts(rows + recognised + tried)
    if as_json:
        told = [{"claim": v.claim, "holds": v.holds, "figures": v.figures} for v in judged]
        emit_json({"paper": thesis.PAPER, "rows": rows + recognised + tried, "verdicts": told})
        return
    if recognised:
        _report(thesis.PAPER, recognised, recognition.CONVENTIONS, as_json)
    if rows:
        _print_compression(rows, thesis.CONVENTIONS)
    for table, own in _by_table(tried):
        if table == "variance":
            _print_tables(own, "{:g}", "{:g}")
        else:
            _print_grid(table, own)
    click.echo("\nHis claims")
    for verdict in judged:
        if verdict.holds is not None or not tables:
            click.echo(f"  - {verdict}")


def _print_compression(rows: list[Row], conventions: Sequence[str]) -> None:
    """Print his tables of compression beside ours and the pose codec's."""
    for table, own in _by_table(rows):
        unit = "ratio to 62 doubles a frame" if table == "4.4" else "bytes a frame"
        print_table(
            ("row", "column", "paper", "ours", "difference", "pose codec", "times"),
            [_line(row) for row in own],
            left=2,
            title=f"Table {table}, {unit}",
        )
    click.echo("* on a stand-in: not his clips, but of their kind, number and length; ** and of")
    click.echo("another length\n\nClips")
    for name, note in _notes(rows).items():
        click.echo(f"  {name}: {note}")
    click.echo()
    _list_conventions(conventions)
    click.echo()


def _print_grid(table: str, rows: list[Row]) -> None:
    """Print what was tried in one way and another, bytes a frame: a row for each, his first."""
    columns = list(dict.fromkeys(row["column"] for row in rows))
    lines = []
    if table == "readings":
        his = {row["column"]: row["paper"] for row in rows}
        lines.append(("thesis", *(f"{his[column]:.2f}" for column in columns)))
    for name in dict.fromkeys(row["row"] for row in rows):
        own = {row["column"]: row for row in rows if row["row"] == name}
        printed = ""
        if table == "wavelets" and own["dct"]["paper"] is not None:
            printed = f" (his: DCT {own['dct']['paper']:g}, DWT {own['haar']['paper']:g})"
        cells = (f"{own[column]['ours']:.2f}" if column in own else "-" for column in columns)
        lines.append((name + printed, *cells))
    print_table(("row", *columns), lines, left=1, title=f"{table.capitalize()}, bytes a frame")


def _save_variance(shares: Mapping[str, FloatArray], path: Path) -> None:
    """Draw the proportion of variance, as the format that the suffix names."""
    from matplotlib.figure import Figure

    from mocapdb.base.files import replacing
    from mocapdb.plots import variance_by_dimension

    figure = Figure(figsize=(7, 4.5), layout="constrained")
    variance_by_dimension(shares, ax=figure.add_subplot())
    with replacing(path) as (temporary,):
        figure.savefig(temporary, format=path.suffix.lstrip(".") or "png", dpi=150)


@reproduce.command(short_help="Raunio (2014): errors of templates, counts of periods.")
@_corpus_option("AMC or BVH")
@click.option("--clip", "clips", multiple=True, help="Only this clip; may be given several times.")
@json_option
def raunio(corpus: Path, clips: tuple[str, ...], as_json: bool) -> None:
    """Compute Raunio's (2014) template errors and period counts on the clips at hand.

    \b
    Example:
      mocapdb reproduce raunio --corpus cmu/ --clip 07_01
    """
    from mocapdb.reproduce import raunio as thesis

    with progress_bar("Extracting") as progress:
        rows = thesis.reproduce(corpus, clips=list(clips) or None, progress=progress)
    _report(thesis.PAPER, rows, thesis.CONVENTIONS, as_json)


@reproduce.command(short_help="Vejdemo-Johansson et al. (2015): births of loops, and times.")
@_corpus_option("AMC")
@json_option
def vejdemo(corpus: Path, as_json: bool) -> None:
    """Compute table 1 of Vejdemo-Johansson et al. (2015) on the clips at hand.

    \b
    Example:
      mocapdb reproduce vejdemo --corpus cmu/
    """
    from mocapdb.reproduce import vejdemo as paper

    with progress_bar("Extracting") as progress:
        rows = paper.reproduce(corpus, progress=progress)
    _report(paper.PAPER, rows, paper.CONVENTIONS, as_json)


@reproduce.command(short_help="Aristidou et al. (2018): faults found and repaired.")
@_corpus_option("AMC or BVH")
@click.option(
    "--table", "tables", multiple=True, type=click.Choice(["1", "2", "spans", "text", "kit"]),
    help="Only this table, the spans, the seconds of the text, or the kit of faults; may be given "
    "several times.",
)  # fmt: skip
@click.option(
    "--clips", type=click.IntRange(1),
    help="Clips of each motion in the tables (12 by default), and for each kind of fault in the "
    "kit (4 by default); more take longer.",
)  # fmt: skip
@click.option("--seed", type=int, default=1, show_default=True, help="Of clips and faults drawn.")
@click.option("--jobs", type=click.IntRange(1), help="Processes; by default as many as processors.")
@json_option
def aristidou(
    corpus: Path, tables: tuple[str, ...], clips: int | None, seed: int, jobs: int | None,
    as_json: bool,
) -> None:  # fmt: skip
    """Compute the detection and repair tables of Aristidou et al. (2018) on the clips at hand.

    Beyond the paper, every kind of fault that captures have is put into some clips of subjects that
    the detector was not fitted on: what is found, how surely, and what repairing leaves, beside
    other ways to repair. All of it takes two to three minutes on two processors.

    \b
    Example:
      mocapdb reproduce aristidou --corpus cmu/ --table 1
      mocapdb reproduce aristidou --corpus cmu/ --table kit --clips 20
    """
    import os

    from mocapdb.reproduce import aristidou as paper
    from mocapdb.reproduce import aristidou_kit

    processes = jobs or os.cpu_count() or 1
    printed = [table for table in paper.TABLES if not tables or table in tables]
    rows: list[Row] = []
    kit = None
    if printed:
        with progress_bar("Cleaning") as progress:
            rows = paper.reproduce(
                corpus, tables=printed, clips=clips or paper.CLIPS, seed=seed, jobs=processes,
                progress=progress,
            )  # fmt: skip
    if not tables or "kit" in tables:
        with progress_bar("Kit of faults") as progress:
            kit = aristidou_kit.measure(
                corpus, clips=clips or aristidou_kit.CLIPS, seed=seed, jobs=processes,
                progress=progress,
            ).as_json()  # fmt: skip
    if as_json:
        emit_json({"paper": paper.PAPER, "rows": rows, "kit": kit})
        return
    if rows:
        _print_tables(rows, "{:.3g}", "{:.3g}")
        _list_conventions(paper.CONVENTIONS)
    if kit is not None:
        _print_kit(kit)
        _list_conventions(aristidou_kit.CONVENTIONS)


def _print_kit(kit: dict[str, Any]) -> None:
    """Print what is found of every kind of fault, what is left of it, and how sure is sure."""
    from mocapdb.reproduce.aristidou_kit import WITHOUT, ways_of

    def text(value: float | None, form: str = "{:.2f}") -> str:
        return "-" if value is None else form.format(value)

    rows = kit["recipes"]
    print_table(
        (
            "fault", "faults", "recall", "precision", "recall without", "precision without",
            "no room",
        ),
        [
            (
                row["recipe"], str(row["faults"]), text(row["recall"]), text(row["precision"]),
                text(row[f"recall {WITHOUT}"]), text(row[f"precision {WITHOUT}"]),
                str(row["passed_over"] or "-"),
            )
            for row in rows
        ],
        title=f"Kit of faults in {len(kit['clips'])} clips: found; without: {WITHOUT}; no room: "
        "clips that cannot hold it",
    )  # fmt: skip
    ways = ways_of("deg")
    print_table(
        ("fault", "found", *ways, "worse"),
        [
            (
                row["recipe"] + (", mm" if row["unit"] == "mm" else ""), str(row["found"]),
                *(text(row["errors"].get(way), "{:.1f}") for way in ways),
                text(row["worse"], "{:.1%}"),
            )
            for row in rows
        ],
        title="Kit of faults: mean error of what was found, in degrees",
    )  # fmt: skip
    elsewhere = kit["elsewhere_deg"]
    print_table(
        tuple(elsewhere), [tuple(text(value, "{:.3f}") for value in elsewhere.values())], left=0,
        title="Changed where nothing is wrong, in degrees",
    )  # fmt: skip
    print_table(
        ("rate", "minutes", "body", "all", "body without", "all without"),
        [
            (
                f"{row['fps']:g} Hz", text(row["minutes"], "{:.1f}"), text(row["body"]),
                text(row["all"]), text(row[f"body {WITHOUT}"]), text(row[f"all {WITHOUT}"]),
            )
            for row in kit["false_alarms_a_minute"]
        ],
        title="False alarms a minute, untouched clips",
    )  # fmt: skip
    print_table(
        ("said", "spans", "right"),
        [
            (f"{row['from']:g} to {row['to']:g}", str(row["spans"]), text(row["right"]))
            for row in kit["calibration"]
        ],
        title="Of spans flagged in faulty clips",
    )


def _report(paper: str, rows: list[Row], conventions: Sequence[str], as_json: bool) -> None:
    """Print the rows of the clips at hand table by table, and name those that are not."""
    if as_json:
        emit_json({"paper": paper, "rows": rows})
        return
    missing = sorted({row["row"] for row in rows if row["note"].endswith("not at hand")})
    _print_tables([row for row in rows if row["row"] not in missing], "{:g}", "{:.5g}")
    click.echo(f"Not at hand: {', '.join(missing) or 'none'}\n")
    _list_conventions(conventions)


def _print_tables(rows: list[Row], paper: str, ours: str) -> None:
    """Print the figures of a paper, in a format, beside ours, in another."""

    def text(value: float | None, form: str) -> str:
        return "-" if value is None else form.format(value)

    for table, own in _by_table(rows):
        lines = [
            (row["row"], row["column"], text(row["paper"], paper), text(row["ours"], ours),
             row["note"])
            for row in own
        ]  # fmt: skip
        columns = ("row", "column", "paper", "ours", "note")
        print_table(columns, lines, left=2, title=f"Table {table}")


def _by_table(rows: list[Row]) -> Iterator[tuple[str, list[Row]]]:
    """Yield each table's name and rows."""
    for table in sorted({row["table"] for row in rows}):
        yield table, [row for row in rows if row["table"] == table]


def _list_conventions(conventions: Sequence[str]) -> None:
    click.echo("Conventions")
    for convention in conventions:
        click.echo(f"  - {convention}")


def _line(row: Row) -> tuple[str, ...]:
    """Return a figure of O'Kane's, ours, and the pose codec's with how many times fewer bytes."""
    paper, ours, production = row["paper"], row["ours"], row["production"]
    if ours is None:
        return row["row"], row["column"], f"{paper:.2f}", *["-"] * 4
    stars = {"stand-in": " *", "far stand-in": " **"}
    stand_in = stars.get(row["note"].partition(":")[0], "")
    difference = f"{100 * (ours / paper - 1):+.1f} %{stand_in}"
    times = production / paper if row["table"] == "4.4" else paper / production
    figures = (f"{paper:.2f}", f"{ours:.2f}", difference, f"{production:.2f}", f"{times:.1f}")
    return row["row"], row["column"], *figures


def _notes(rows: list[Row]) -> dict[str, str]:
    """Return what is to be said about each row's clips, once."""
    return {row["row"]: row["note"].split(";")[0] for row in reversed(rows)}
