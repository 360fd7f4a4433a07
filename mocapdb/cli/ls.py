"""``mocapdb ls``."""

from __future__ import annotations

from pathlib import Path

import click

from mocapdb.cli._console import emit_json, print_table
from mocapdb.cli._options import json_option, library_argument


@click.command()
@library_argument
@click.option("--class", "label", help="Only clips of this class.")
@click.option("--search", help="Only clips whose name, class or description has these words.")
@json_option
def ls(library: Path, label: str | None, search: str | None, as_json: bool) -> None:
    """List the clips of a library.

    \b
    Example:
      mocapdb ls cmu.mocapdb --class walk
      mocapdb ls cmu.mocapdb --search "climb ladder"
    """
    from mocapdb.errors import LibraryError
    from mocapdb.library import Library

    with Library(library) as opened:
        if label is not None and label not in opened.classes():
            classes = ", ".join(opened.classes()) or "none"
            raise LibraryError(f"{library}: no clip has class {label!r}. It has: {classes}.")
        records = opened.records(label=label, search=search)
    if as_json:
        emit_json(
            {
                "clips": [
                    {
                        "clip": record.name,
                        "label": record.label,
                        "description": record.description,
                        "frames": record.frames,
                        "fps": record.fps,
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
    print_table(
        ("clip", "class", "seconds", "Hz", "B/frame", "mean mm", "max mm", "description"),
        (
            (
                record.name,
                record.label or "-",
                f"{record.duration_s:.2f}",
                f"{record.fps:g}",
                f"{record.bytes_per_frame:.1f}",
                f"{record.error_mean_mm:.2f}",
                f"{record.error_max_mm:.2f}",
                record.description,
            )
            for record in records
        ),
        left=2,
    )
    click.echo(f"{len(records)} clips")
