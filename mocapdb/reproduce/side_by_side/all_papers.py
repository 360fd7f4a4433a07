"""All tables of all four papers on the clips of a folder, with a verdict on each claim."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import TypeAlias

from mocapdb.base.arrays import StrPath
from mocapdb.base.machine import measured_on
from mocapdb.base.progress import Progress, silent
from mocapdb.errors import CorpusError
from mocapdb.reproduce import (
    aristidou,
    aristidou_kit,
    okane,
    okane_open_questions,
    raunio,
    recognition,
    vejdemo,
    vejdemo_walks,
)
from mocapdb.reproduce._tables import Row, corpus_folder, printed_figures, table_row
from mocapdb.reproduce.side_by_side import (
    aristidou_claims,
    okane_claims,
    raunio_claims,
    vejdemo_claims,
)
from mocapdb.reproduce.side_by_side.paper_tables import PaperTables, SideBySide

__all__ = ["CLIPS", "KIT_CLIPS", "Bar", "reproduce_all"]

CLIPS = 12
KIT_CLIPS = 2
"""What Aristidou's tables and kit are bounded to by default: a run of some minutes on one core."""

Bar: TypeAlias = Callable[[str], AbstractContextManager[Progress]]
"""Given what is done, where its progress is told."""


def _silently(_: str) -> AbstractContextManager[Progress]:
    return nullcontext(silent)


def reproduce_all(
    corpus: StrPath,
    *,
    clips: int = CLIPS,
    kit_clips: int = KIT_CLIPS,
    seed: int = 1,
    jobs: int = 1,
    bar: Bar = _silently,
) -> SideBySide:
    """Compute every table of the four papers, and judge their claims.

    Parameters
    ----------
    corpus : path-like
        A folder with CMU's and HDM05's files, at any depth, under their own names. What is not
        there is said, cell by cell.
    clips : int
        For Aristidou's tables, so many clips of each motion at most.
    kit_clips : int
        For the kit of faults, so many clips for each kind.
    seed : int
        Of the faults.
    jobs : int
        Processes that share Aristidou's.
    bar : callable, optional
        Given what is done, a context that yields where its progress is told.

    Raises
    ------
    CorpusError
        If there is no such folder.
    """
    corpus_folder(corpus, "CMU's and HDM05's clips")
    return SideBySide(
        measured_on(),
        [
            _okane(corpus, bar),
            _raunio(corpus, bar),
            _vejdemo(corpus, bar),
            _aristidou(corpus, clips, kit_clips, seed, jobs, bar),
        ],
    )


def _tried(
    compute: Callable[[], list[Row]], otherwise: Callable[[], list[Row]], bounds: list[str]
) -> list[Row]:
    """Return rows; where a corpus has nothing for any, rows without ours that say so."""
    try:
        return compute()
    except CorpusError as problem:
        bounds.append(str(problem))
        return [row | {"note": f"not computed: {problem}"} for row in otherwise()]


def _okane(corpus: StrPath, bar: Bar) -> PaperTables:
    bounds: list[str] = []

    def printed(tables: tuple[str, ...]) -> list[Row]:
        return [
            table_row(f["table"], f["row"], f["column"], float(f["value"]), None, "")
            for f in printed_figures(okane.FIGURES)
            if f["table"] in tables
        ]

    with bar("O'Kane: compression") as progress:
        rows = _tried(
            lambda: okane.reproduce(corpus, progress=progress),
            lambda: printed(okane.TABLES),
            bounds,
        )
    with bar("O'Kane: recognition") as progress:
        rows += recognition.reproduce(corpus, progress=progress)
    questions = okane_open_questions
    for name, compute in (
        ("wavelets", questions.wavelets),
        ("readings", questions.readings),
        ("variance", lambda corpus, progress: questions.variance(corpus, progress=progress)[0]),
    ):
        if bounds:  # none of CMU's clips: nothing to ask them
            break
        with bar(f"O'Kane: {name}") as progress:
            rows += compute(corpus, progress=progress)
    conventions = [*okane.CONVENTIONS, *recognition.CONVENTIONS]
    judged = okane_claims.verdicts(rows)
    return PaperTables(okane.PAPER, "okane2008", rows, judged, conventions, bounds)


def _raunio(corpus: StrPath, bar: Bar) -> PaperTables:
    bounds: list[str] = []
    with bar("Raunio") as progress:
        rows = _tried(
            lambda: raunio.reproduce(corpus, progress=progress),
            lambda: raunio.printed_rows("not computed"),
            bounds,
        )
    judged = raunio_claims.verdicts(rows)
    return PaperTables(raunio.PAPER, "raunio2014", rows, judged, list(raunio.CONVENTIONS), bounds)


def _vejdemo(corpus: StrPath, bar: Bar) -> PaperTables:
    with bar("Vejdemo-Johansson") as progress:
        rows = vejdemo.reproduce(corpus, progress=progress)
    with bar("Vejdemo-Johansson: walks") as progress:
        rows += vejdemo_walks.measure(corpus, progress=progress)
    conventions = [*vejdemo.CONVENTIONS, *vejdemo_walks.CONVENTIONS]
    judged = vejdemo_claims.verdicts(rows)
    return PaperTables(vejdemo.PAPER, "vejdemo2015", rows, judged, conventions)


def _aristidou(
    corpus: StrPath, clips: int, kit_clips: int, seed: int, jobs: int, bar: Bar
) -> PaperTables:
    bounds = [
        f"Tables 1, 2 and spans are of {clips} clips of each motion at most, the kit of "
        f"{kit_clips} for each kind of fault (--clips, --kit-clips). "
        "More clips: mocapdb reproduce aristidou --clips 40."
    ]
    with bar("Aristidou: tables") as progress:
        rows = _tried(
            lambda: aristidou.reproduce(
                corpus, clips=clips, seed=seed, jobs=jobs, progress=progress
            ),
            aristidou.printed_rows,
            bounds,
        )
    with bar("Aristidou: kit of faults") as progress:
        rows += _tried(
            lambda: aristidou_claims.kit_rows(
                aristidou_kit.measure(
                    corpus, clips=kit_clips, seed=seed, jobs=jobs, progress=progress
                ).as_json()
            ),
            list,
            bounds,
        )
    conventions = [*aristidou.CONVENTIONS, *aristidou_kit.CONVENTIONS]
    judged = aristidou_claims.verdicts(rows)
    return PaperTables(aristidou.PAPER, "aristidou2018", rows, judged, conventions, bounds)
