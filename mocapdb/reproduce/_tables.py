"""What the papers' tables share: printed figures, rows beside them, and where the clips are."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from mocapdb.base.arrays import StrPath
from mocapdb.base.progress import Progress
from mocapdb.errors import CorpusError

__all__ = [
    "Job", "Key", "Row", "check_tables", "corpus_folder", "printed_figures", "reported", "run_jobs",
    "table_row",
]  # fmt: skip

Row: TypeAlias = dict[str, Any]
"""``table``, ``row``, ``column``, ``paper``, ``ours`` and ``note``: one figure beside ours."""

Key: TypeAlias = tuple[str | int, ...]
Job: TypeAlias = Callable[[], Any]
"""Work that some processes share, by what is reported when it is done."""

Item = TypeVar("Item")


def printed_figures(file: str) -> list[dict[str, str]]:
    """Return the rows of a CSV file of figures as a paper prints them."""
    with files("mocapdb.reproduce").joinpath("data", file).open(encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def table_row(
    table: str, row: str, column: str, paper: float | None, ours: float | None, note: str
) -> Row:
    """Return one figure of a paper beside ours; None where there is none."""
    return {
        "table": table, "row": row, "column": column, "paper": paper, "ours": ours, "note": note,
    }  # fmt: skip


def check_tables(asked: Sequence[str], known: Sequence[str]) -> None:
    """Raise a `CorpusError` if a table is asked for that a paper does not have."""
    unknown = set(asked) - set(known)
    if unknown:
        raise CorpusError(f"Expected tables out of {', '.join(known)}, but got {min(unknown)!r}.")


def corpus_folder(corpus: StrPath, holds: str) -> Path:
    """Return the folder of a corpus; raise a `CorpusError` if it is none, and say what it holds."""
    folder = Path(corpus)
    if not folder.is_dir():
        raise CorpusError(f"{folder}: expected a folder with {holds}, but got none.")
    return folder


def reported(
    items: Sequence[Item], progress: Progress, name_of: Callable[[Item], str]
) -> Iterator[Item]:
    """Yield items, and report each before the work on it begins and the end after the last."""
    for done, item in enumerate(items):
        progress(done, len(items), name_of(item))
        yield item
    progress(len(items), len(items), "done")


def run_jobs(jobs: Mapping[Key, Job], *, n_jobs: int, progress: Progress) -> dict[Key, Any]:
    """Return what comes of jobs, which some processes share.

    Parameters
    ----------
    jobs : dict of tuple to callable
        By what is reported when one is done.
    n_jobs : int
        Processes; with 1 no other is started.
    progress : callable
    """
    from joblib import Parallel, delayed

    names = [", ".join(map(str, key)) for key in jobs]
    answers = Parallel(n_jobs=max(1, min(n_jobs, len(jobs))), return_as="generator")(
        delayed(job)() for job in jobs.values()
    )
    results = {}
    for done, (key, name) in enumerate(zip(jobs, names, strict=True)):
        progress(done, len(jobs), name)
        results[key] = next(answers)
    progress(len(jobs), len(jobs), "done")
    return results
