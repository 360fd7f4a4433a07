"""``mocapdb ls``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from mocapdb.base.arrays import StrPath

if TYPE_CHECKING:
    from mocapdb.library import Hit, Library
    from mocapdb.library.clip_record import ClipLine, ClipRecord
    from mocapdb.library.facets import FacetRange, Facets
    from mocapdb.library.revision import Revision

from mocapdb.cli._console import counted, emit_json, print_table
from mocapdb.cli._csv import csv_option, each_of
from mocapdb.cli._named_clip import say_unmeasured
from mocapdb.cli._options import (
    FACET_HELP,
    facet_options,
    json_option,
    library_argument,
    where_option,
)

FACETS = ("root_speed_ms", "turn_deg", "contacts")
REVISION = ("kind", "created", "repaired", "left", "payload_bytes")
EVERY_DISTANCE = 1e9  # with a saved query: no cut, as JSON has it


def _csv_rows(data: Any) -> Iterable[Mapping[str, Any]]:
    """Return a row for each clip, of the same columns whether or not it was measured or cleaned."""
    whole = {"facets": dict.fromkeys(FACETS), "revision": dict.fromkeys(REVISION)}
    for row in each_of("clips")(data):
        yield {
            name: whole[name] if name in whole and value is None else value
            for name, value in row.items()
        }


@click.command()
@library_argument
@click.option("--class", "label", help="Only clips of this class.")
@click.option("--subject", help="Only clips by this subject, such as 35.")
@click.option(
    "--search", help="Only clips whose name, class or description has these words, their stems or "
    "beginnings, or words for the same; the best first.",
)  # fmt: skip
@where_option
@facet_options
@click.option(
    "--columns", metavar="A,B",
    help="Columns to show as well: of the labels, or root-speed, turn, height, contacts.",
)  # fmt: skip
@click.option(
    "--query", "saved", metavar="NAME", help="Only clips that a saved query finds; where."
)
@click.option("--queries", is_flag=True, help="List the saved queries instead.")
@click.option("--unsearchable", is_flag=True, help="Only clips that no query looks at, and why.")
@csv_option(_csv_rows)
@json_option
def ls(
    library: StrPath,
    label: str | None,
    subject: str | None,
    search: str | None,
    where: dict[str, str],
    facets: dict[str, FacetRange],
    flagged: bool | None,
    columns: str | None,
    saved: str | None,
    queries: bool,
    unsearchable: bool,
    as_json: bool,
) -> None:
    """List the clips of a library.

    \b
    Example:
      mocapdb ls cmu.mocapdb --class walk
      mocapdb ls cmu.mocapdb --search "climb ladder"
      mocapdb ls styles.mocapdb --where style=old --columns style,take
      mocapdb ls cmu.mocapdb --query jumps
      mocapdb ls cmu.mocapdb --queries
      mocapdb ls cmu.mocapdb --root-speed 1.0:1.6 --turn -30:30 --columns root-speed
    """
    from mocapdb.library import Library
    from mocapdb.library.catalogue import Chosen

    with Library(library) as opened:
        if queries:
            _print_queries(opened, as_json)
            return
        if label is not None:
            opened.catalogue.expect_class(label)
        if subject is not None:
            where = {"subject": subject} | where
        shown = [name for name in (columns or "").split(",") if name]
        opened.catalogue.expect_columns(name for name in shown if not _is_facet(name))
        catalogue = opened.catalogue
        chosen = Chosen(label, search, where, facets, flagged)
        in_full = as_json or bool(shown)
        is_plain = not (in_full or unsearchable or saved is not None)
        lines = catalogue.lines(chosen) if is_plain else iter(())
        records = iter(()) if is_plain else catalogue.records(chosen)
        hits = {} if saved is None else _hits(opened, saved)
        if saved is not None:
            known = {record.name: record for record in records}
            records = iter([known[name] for name in hits if name in known])
        say_unmeasured(opened, facets, flagged)
        missing = catalogue.missing_value(where) if where else None
        if missing is not None:
            click.echo(f"note: {missing}", err=True)
        further = _Further(
            catalogue.facets() if in_full else {},
            catalogue.subjects() if in_full else {},
            catalogue.unsearchable() if as_json or unsearchable else {},
            catalogue.revisions(),
            hits,
        )
        if unsearchable:
            records = (record for record in records if record.name in further.reasons)
        if as_json:
            emit_json({"clips": [_json(record, further, saved) for record in records]})
            return
        found = ""
        if unsearchable:
            n_clips = _print_unsearchable(records, shown, further)
            found = " that no query looks at"
        elif saved is not None:
            n_clips = _print_found(records, shown, further)
            found = f" that {saved!r} finds"
        elif shown:
            cells = ((record, _cells(record, shown, further)) for record in records)
            n_clips = _print_clips(cells, shown, further)
        else:
            n_clips = _print_clips(((line, ()) for line in lines), shown, further)
    click.echo(counted(n_clips, "clip") + found)


def _print_queries(library: Library, as_json: bool) -> None:
    """Print the names of the saved queries, when they were saved, and their cuts."""
    from mocapdb.library import SavedQuery

    catalogue = library.catalogue
    kept = {
        name: SavedQuery.of_json(name, catalogue.saved_query(name))
        for name in catalogue.saved_queries()
    }
    if as_json:
        emit_json(
            {
                "queries": [
                    {"query": name, "created": each.created, "options": dict(each.options)}
                    for name, each in kept.items()
                ]
            }
        )
        return
    if kept:
        lines = [
            (name, each.created, str(len(each.examples)), cut_of(each.options))
            for name, each in kept.items()
        ]
        print_table(("query", "saved", "examples", "cut"), lines, left=2)
    click.echo(f"{len(kept)} saved {'query' if len(kept) == 1 else 'queries'}")


def cut_of(options: Mapping[str, Any]) -> str:
    """Say where a saved query cuts."""
    cuts = []
    if options.get("probability"):
        cuts.append(f"--probability {options['probability']:g}")
    if options.get("max_distance", EVERY_DISTANCE) < EVERY_DISTANCE:
        cuts.append(f"--max-distance {options['max_distance']:g}")
    return ", ".join([*cuts, f"{options['k']} hits at most"])


class _Further(NamedTuple):
    """What there is to say of clips beside their records, by their rows, or by their names.

    Attributes
    ----------
    measured, subjects, revisions
        By row.
    reasons, hits
        By name: why no query looks at a clip, and where a saved query finds it.
    """

    measured: dict[int, Facets]
    subjects: dict[int, str]
    reasons: dict[str, str]
    revisions: dict[int, Revision]
    hits: dict[str, list[Hit]]


def _json(record: ClipRecord, further: _Further, saved: str | None) -> dict[str, Any]:
    from mocapdb.library.library import assumed_of

    measured = further.measured.get(record.id)
    return {
        "clip": record.name,
        "label": record.label,
        "description": record.description,
        "frames": record.frames,
        **assumed_of(record),
        "subject": further.subjects[record.id] or None,
        "columns": dict(record.columns),
        **({} if saved is None else {"hits": [*map(_hit, further.hits[record.name])]}),
        "facets": None if measured is None else asdict(measured),
        "unsearchable": further.reasons.get(record.name),
        "revision": _revision_json(further.revisions.get(record.id)),
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


def _print_unsearchable(
    records: Iterable[ClipRecord], shown: Sequence[str], further: _Further
) -> int:
    """Print why no query looks at clips; return how many they are."""
    lines = [
        (
            record.name,
            record.label or "-",
            *_cells(record, shown, further),
            further.reasons[record.name],
        )
        for record in records
    ]
    print_table(("clip", "class", *shown, "why"), lines, left=3 + len(shown))
    return len(lines)


def _print_found(records: Iterable[ClipRecord], shown: Sequence[str], further: _Further) -> int:
    """Print where a saved query finds clips; return how many they are."""
    found = list(records)
    print_table(
        ("clip", "class", *shown, "from s", "to s", "distance", "likely", "speed", "description"),
        (
            (
                record.name,
                record.label or "-",
                *_cells(record, shown, further),
                f"{hit.start_s:.2f}",
                f"{hit.end_s:.2f}",
                f"{hit.distance:.3f}",
                f"{100 * hit.probability:.0f} %",
                f"x{1 / hit.time_scale:.2f}",
                record.description,
            )
            for record in found
            for hit in further.hits[record.name]
        ),
        left=2 + len(shown),
    )
    return len(found)


def _print_clips(
    clips: Iterable[tuple[ClipRecord | ClipLine, tuple[str, ...]]],
    shown: Sequence[str],
    further: _Further,
) -> int:
    """Print clips, each with its further cells; return how many they are."""
    faults = ["faults"] if further.revisions else []
    lines = [
        (
            clip.name,
            clip.label or "-",
            *cells,
            *(_faults(further.revisions.get(clip.id)) for _ in faults),
            f"{clip.duration_s:.2f}",
            f"{clip.fps:g}",
            f"{clip.bytes_per_frame:.1f}",
            f"{clip.error_mean_mm:.2f}",
            f"{clip.error_max_mm:.2f}",
            clip.description,
        )
        for clip, cells in clips
    ]
    measures = ("seconds", "Hz", "B/frame", "mean mm", "max mm", "description")
    columns = ("clip", "class", *shown, *faults, *measures)
    print_table(columns, lines, left=2 + len(shown) + len(faults))
    return len(lines)


def _cells(record: ClipRecord, shown: Sequence[str], further: _Further) -> tuple[str, ...]:
    """Return what the further columns of a clip say."""
    return tuple(_cell(record, name, further) for name in shown)


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


def _hits(library: Library, saved: str) -> dict[str, list[Hit]]:
    """Return the hits of a saved query by clip, the clip of the nearest first."""
    from mocapdb.library import Retrieval

    found: dict[str, list[Hit]] = {}
    for hit in Retrieval(library).saved(saved):
        found.setdefault(hit.record.name, []).append(hit)
    return found


def _hit(hit: Hit) -> dict[str, float]:
    return {
        "start": hit.start_s,
        "end": hit.end_s,
        "distance": hit.distance,
        "probability": hit.probability,
    }


def _is_facet(name: str) -> bool:
    return name.replace("-", "_") in FACET_HELP


def _cell(record: ClipRecord, column: str, further: _Further) -> str:
    """Return what a further column says of a clip, or what was measured of it."""
    if column == "subject":
        return further.subjects[record.id] or "-"
    if column in record.columns or not _is_facet(column):
        return record.columns.get(column) or "-"
    own = further.measured.get(record.id)
    if column == "height":
        return "-" if record.height_m is None else f"{record.height_m:.2f} m"
    if column == "duration":
        return f"{record.duration_s:.2f} s"
    if own is None:
        return "-"
    return {
        "root-speed": f"{own.root_speed_ms:.2f} m/s",
        "turn": f"{round(own.turn_deg)} deg",
        "contacts": f"{own.contacts}",
    }[column.replace("_", "-")]
