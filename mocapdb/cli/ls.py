"""``mocapdb ls``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from mocapdb.library.clip_record import ClipRecord
    from mocapdb.library.revision import Revision

from mocapdb.cli._console import counted, emit_json, print_table
from mocapdb.cli._options import json_option, library_argument, where_option


@click.command()
@library_argument
@click.option("--class", "label", help="Only clips of this class.")
@click.option("--search", help="Only clips whose name, class or description has these words.")
@where_option
@click.option("--columns", metavar="A,B", help="Further columns of the labels to show as well.")
@click.option("--unsearchable", is_flag=True, help="Only clips that no query looks at, and why.")
@json_option
def ls(
    library: Path,
    label: str | None,
    search: str | None,
    where: dict[str, str],
    columns: str | None,
    unsearchable: bool,
    as_json: bool,
) -> None:
    """List the clips of a library.

    \b
    Example:
      mocapdb ls cmu.mocapdb --class walk
      mocapdb ls cmu.mocapdb --search "climb ladder"
      mocapdb ls styles.mocapdb --where style=old --columns style,take
    """
    from mocapdb.errors import LibraryError
    from mocapdb.library import Library
    from mocapdb.library.library import assumed_of

    with Library(library) as opened:
        if label is not None and label not in opened.classes():
            classes = ", ".join(opened.classes()) or "none"
            raise LibraryError(f"{library}: no clip has class {label!r}. It has: {classes}.")
        shown = [name for name in (columns or "").split(",") if name]
        opened.catalogue.expect_columns(shown)
        records = opened.records(label=label, search=search, where=where)
        reasons = opened.catalogue.unsearchable()
        subjects = opened.catalogue.subjects()
        revisions = opened.catalogue.revisions()
    if unsearchable:
        records = [record for record in records if record.name in reasons]
    if as_json:
        emit_json(
            {
                "clips": [
                    {
                        "clip": record.name,
                        "label": record.label,
                        "description": record.description,
                        "frames": record.frames,
                        **assumed_of(record),
                        "subject": subjects[record.id] or None,
                        "columns": dict(record.columns),
                        "unsearchable": reasons.get(record.name),
                        "revision": _revision_json(revisions.get(record.id)),
                        "seconds": record.duration_s,
                        "payload_bytes": record.payload_bytes,
                        "bytes_per_frame": record.bytes_per_frame,
                        "skinned_error": record.skinned_error,
                        "error_mm": {
                            "mean": record.error_mean_mm,
                            "p95": record.error_p95_mm,
                            "max": record.error_max_mm,
                        },
                        "codec": record.codec,
                        "source": record.source,
                    }
                    for record in records
                ]
            }
        )
        return
    if unsearchable:
        print_table(
            ("clip", "class", *shown, "why"),
            (
                (
                    record.name,
                    record.label or "-",
                    *(_cell(record, name, subjects) for name in shown),
                    reasons[record.name],
                )
                for record in records
            ),
            left=3 + len(shown),
        )
        click.echo(f"{counted(len(records), 'clip')} that no query looks at")
        return
    faults = ["faults"] if revisions else []
    print_table(
        (
            "clip",
            "class",
            *shown,
            *faults,
            "seconds",
            "Hz",
            "B/frame",
            "mean mm",
            "max mm",
            "description",
        ),
        (
            (
                record.name,
                record.label or "-",
                *(_cell(record, name, subjects) for name in shown),
                *(_faults(revisions.get(record.id)) for _ in faults),
                f"{record.duration_s:.2f}",
                f"{record.fps:g}",
                f"{record.bytes_per_frame:.1f}",
                f"{record.error_mean_mm:.2f}",
                f"{record.error_max_mm:.2f}",
                record.description,
            )
            for record in records
        ),
        left=2 + len(shown) + len(faults),
    )
    click.echo(counted(len(records), "clip"))


def _revision_json(revision: Revision | None) -> dict[str, Any] | None:
    """Return what is told of a clip's revision: its spans are in ``info``."""
    if revision is None:
        return None
    return {
        "kind": revision.kind,
        "created": revision.created,
        "repaired": revision.n_repaired,
        "left": len(revision.left),
        "payload_bytes": revision.payload_bytes,
    }


def _faults(revision: Revision | None) -> str:
    """Return what cleaning found in a clip, in words for a table."""
    if revision is None:
        return "not searched"
    left = f"{len(revision.left)} left" if revision.left else ""
    repaired = f"{revision.n_repaired} repaired" if revision.n_repaired else ""
    return ", ".join(filter(None, [repaired, left])) or "none"


def _cell(record: ClipRecord, column: str, subjects: dict[int, str]) -> str:
    """Return what a further column says of a clip."""
    value = subjects[record.id] if column == "subject" else record.columns.get(column)
    return value or "-"
