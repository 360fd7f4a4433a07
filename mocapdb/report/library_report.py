"""The report of a library as one page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import write_whole
from mocapdb.base.progress import Progress, silent
from mocapdb.errors import LibraryError
from mocapdb.report import sections
from mocapdb.report.library_findings import (
    confusion_across_subjects,
    cycles_of_classes,
    find_faults,
    rate_curves,
)
from mocapdb.report.page import escape, page
from mocapdb.report.tuning import ALL_CYCLE_CLIPS, CURVES, FAULT_SECONDS, RECOGNISED_CLIPS

if TYPE_CHECKING:
    from mocapdb.library import Library

__all__ = ["Effort", "write_report"]

CONTENTS = {
    "contents": "Contents",
    "size": "Size and error",
    "classes": "Classes",
    "faults": "Flagged joints",
    "cycles": "Cycles",
    "clips": "Clips",
}


@dataclass(frozen=True)
class Effort:
    """How much of a library a report looks at, beyond what the catalogue says already.

    Attributes
    ----------
    curves : int
        Clips of which a stretch is encoded again at several targets.
    recognised : int
        Clips that are recognised by what other people perform.
    fault_seconds : float
        Motion that is searched for faults.
    cycle_clips : int
        Clips that the cycles of all classes are averaged from, where the library keeps none.
    """

    curves: int = CURVES
    recognised: int = RECOGNISED_CLIPS
    fault_seconds: float = FAULT_SECONDS
    cycle_clips: int = ALL_CYCLE_CLIPS


def write_report(
    library: Library,
    path: StrPath,
    *,
    effort: Effort | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Write a page that shows what a library holds, what it costs and what is in doubt.

    Parameters
    ----------
    library : Library
    path : path-like
        The page; it appears whole or not at all, and asks for nothing from outside.
    effort : Effort, optional
        How much is looked at.
    progress : callable, optional
        Called with parts done, parts in all, and what is at work.

    Returns
    -------
    dict
        ``output``, ``bytes``, and what was found: ``clips``, ``recognised`` (a share, or None),
        ``flagged`` spans, ``cleaned`` clips, ``cycles`` by class.

    Raises
    ------
    LibraryError
        If the library is empty.
    FormatError
        If the page cannot be written.
    """
    effort = Effort() if effort is None else effort
    records = library.records()
    if not records:
        raise LibraryError(f"{library.path}: the library is empty. Build clips into it first.")

    def step(done: int, what: str) -> Callable[[str], None]:
        return lambda name: (progress or silent)(done, 5, f"{what}: {name}")

    curves = rate_curves(library, effort.curves, step(0, "encoding"))
    step(1, "classes")("recognising")
    confusion = confusion_across_subjects(library, effort.recognised)
    faults = find_faults(library, effort.fault_seconds, step(2, "faults"))
    cycles = cycles_of_classes(library, effort.cycle_clips, step(3, "cycles"))
    step(4, "page")("writing")
    info = library.info()
    name = Path(library.address or library.path.resolve()).name
    links = "".join(f'<a href="#{key}">{text}</a>' for key, text in CONTENTS.items())
    body = "\n".join(
        [
            f"<header><h1>{escape(name)}</h1><p>A motion library, as of {date.today():%d %B %Y}."
            f"</p><nav>{links}</nav></header>",
            sections.overview(info, records),
            sections.costs(info, records, curves),
            sections.recognition(confusion, library.place),
            sections.faults(faults),
            sections.cycles(cycles),
            sections.clips(records, library.catalogue.facets()),
        ]
    )
    path = Path(path)
    write_whole(path, page(f"{name}: a motion library", body).encode())
    return {
        "output": str(path),
        "bytes": path.stat().st_size,
        "clips": len(records),
        "recognised": None if confusion is None else confusion.right,
        "flagged": faults.spans,
        "cleaned": faults.cleaned,
        "cycles": [each.cycle.name for each in cycles.found],
    }
