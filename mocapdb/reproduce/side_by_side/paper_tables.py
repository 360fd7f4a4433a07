"""Tables, verdicts and the machine they are from, as Markdown, CSV and JSON.

The Markdown has a row of the paper's as one line, with a cell ``paper / ours`` for each column; the
CSV has a line for each cell, and everything in it, so that each file can be read alone.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import make_folder, replacing
from mocapdb.errors import FormatError
from mocapdb.reproduce._tables import Row
from mocapdb.reproduce.side_by_side.verdict import Verdict

__all__ = ["PaperTables", "SideBySide", "files_of"]

JSON_NAME = "reproduced.json"
CELLS = ("paper", "table", "row", "column", "printed", "ours", "pose_codec", "note")
CLAIMS = ("paper", "claim", "verdict", "figures")


@dataclass(frozen=True)
class PaperTables:
    """What came of one paper.

    Attributes
    ----------
    paper : str
        Such as ``"Raunio 2014"``.
    stem : str
        Of its files.
    rows : list of Row
    verdicts : list of Verdict
    conventions : list of str
    bounds : list of str
        What was left out to keep the run short, and how to have it; or why nothing came of it.
    """

    paper: str
    stem: str
    rows: list[Row]
    verdicts: list[Verdict]
    conventions: list[str]
    bounds: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class SideBySide:
    """All papers of one run.

    Attributes
    ----------
    measured_on : dict of str to str
        See `mocapdb.base.machine.measured_on`.
    papers : list of PaperTables
    """

    measured_on: dict[str, str]
    papers: list[PaperTables]

    def to_json(self) -> dict[str, Any]:
        """Return everything as what JSON can hold."""
        return asdict(self)

    @classmethod
    def from_json(cls, told: Mapping[str, Any]) -> SideBySide:
        """Return what `to_json` gave.

        Raises
        ------
        KeyError
            If it is something else.
        """
        papers = [
            PaperTables(**paper | {"verdicts": [Verdict(**own) for own in paper["verdicts"]]})
            for paper in told["papers"]
        ]
        return cls(dict(told["measured_on"]), papers)

    @classmethod
    def read(cls, folder: StrPath) -> SideBySide:
        """Return what `write` put into a folder.

        Raises
        ------
        FormatError
            If it is not there, or is something else.
        """
        path = Path(folder, JSON_NAME)
        try:
            return cls.from_json(json.loads(path.read_text(encoding="utf-8")))
        except (OSError, ValueError, KeyError, TypeError) as problem:
            raise FormatError(
                path, f"Expected what `mocapdb reproduce all` writes, but got {problem!r}."
            ) from None

    def write(self, folder: StrPath) -> list[Path]:
        """Write all files into a folder, which is made if missing; return them.

        Raises
        ------
        FormatError
            If one cannot be written.
        """
        texts = files_of(self)
        paths = [Path(folder, name) for name in texts]
        try:
            make_folder(Path(folder))
            for path, text in zip(paths, texts.values(), strict=True):
                with replacing(path) as (temporary,):
                    temporary.write_text(text, encoding="utf-8", newline="")
        except OSError as problem:
            raise FormatError(folder, f"Cannot write the tables ({problem.strerror}).") from None
        return paths


def files_of(run: SideBySide) -> dict[str, str]:
    """Return the text of every file by its name."""
    texts: dict[str, str] = {}
    for paper in run.papers:
        texts[f"{paper.stem}.md"] = _paper_markdown(paper, run.measured_on)
        texts[f"{paper.stem}.csv"] = _csv(CELLS, map(_cells(paper), paper.rows), run.measured_on)
    claims = [
        (paper.paper, verdict.claim, verdict.word, verdict.figures)
        for paper in run.papers
        for verdict in paper.verdicts
    ]
    texts["papers.md"] = _verdicts_markdown(run)
    texts["papers.csv"] = _csv(CLAIMS, claims, run.measured_on)
    texts[JSON_NAME] = json.dumps(run.to_json(), indent=1) + "\n"
    return texts


def _cells(paper: PaperTables) -> Any:
    def cells(row: Row) -> tuple[Any, ...]:
        return (
            paper.paper, row["table"], row["row"], row["column"], row["paper"], row["ours"],
            row.get("production"), row["note"],
        )  # fmt: skip

    return cells


def _csv(columns: Sequence[str], rows: Any, measured_on: Mapping[str, str]) -> str:
    """Return rows as CSV, each with the machine, versions and date."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow((*columns, *measured_on))
    for row in rows:
        writer.writerow(["" if cell is None else cell for cell in (*row, *measured_on.values())])
    return text.getvalue()


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"


def _measured(measured_on: Mapping[str, str]) -> str:
    told = {name: text for name, text in measured_on.items() if name != "date"}
    return f"Measured {measured_on['date']}: " + ", ".join(
        f"{name} {text}" for name, text in told.items()
    )


def _paper_markdown(paper: PaperTables, measured_on: Mapping[str, str]) -> str:
    lines = [f"# {paper.paper}", "", _measured(measured_on) + ".", ""]
    lines += [f"**Bounded.** {bound}" for bound in paper.bounds]
    lines += [""] if paper.bounds else []
    for table in dict.fromkeys(row["table"] for row in paper.rows):
        own = [row for row in paper.rows if row["table"] == table]
        lines += [f"## Table {table}", "", *_table(own), ""]
    lines += ["## Claims", "", *_claims(paper), "", "## Conventions", ""]
    lines += [f"- {convention}" for convention in paper.conventions]
    return "\n".join(lines) + "\n"


def _table(rows: Sequence[Row]) -> list[str]:
    """Return a table: a line for each row of the paper's."""
    columns = list(dict.fromkeys(row["column"] for row in rows))
    printed = any(row["paper"] is not None for row in rows)
    produced = any(row.get("production") is not None for row in rows)
    what = " / ".join(
        [*(["paper"] if printed else []), "ours", *(["pose codec"] if produced else [])]
    )
    lines = [_line([what, *columns, "note"]), "|---|" + "---:|" * len(columns) + "---|"]
    for name in dict.fromkeys(row["row"] for row in rows):
        own = {row["column"]: row for row in rows if row["row"] == name}
        cells = []
        for column in columns:
            row = own.get(column)
            if row is None:
                cells.append("")
                continue
            values = [row["paper"]] if printed else []
            values += [row["ours"]] + ([row.get("production")] if produced else [])
            cells.append(" / ".join(map(_number, values)))
        lines.append(_line([name, *cells, _notes(own)]))
    return lines


def _notes(own: Mapping[str, Row]) -> str:
    """Return the notes of a row: once where its cells share one, else with the columns."""
    by_note: dict[str, list[str]] = {}
    for column, row in own.items():
        if row["note"]:
            by_note.setdefault(row["note"], []).append(column)
    if len(by_note) == 1:
        return next(iter(by_note))
    return "; ".join(f"{', '.join(columns)}: {note}" for note, columns in by_note.items())


def _claims(paper: PaperTables) -> list[str]:
    lines = [_line(["claim", "verdict", "figures"]), "|---|---|---|"]
    return lines + [_line([own.claim, own.word, own.figures]) for own in paper.verdicts]


def _verdicts_markdown(run: SideBySide) -> str:
    lines = ["# The papers' claims", "", _measured(run.measured_on) + ".", ""]
    for paper in run.papers:
        cells = [row for row in paper.rows if row["paper"] is not None]
        done = sum(row["ours"] is not None for row in cells)
        lines += [f"## {paper.paper}", ""]
        lines += [f"{done} of {len(cells)} printed figures computed; `{paper.stem}.md` has all."]
        lines += [f"**Bounded.** {bound}" for bound in paper.bounds]
        lines += ["", *_claims(paper), ""]
    return "\n".join(lines)
