"""``mocapdb info``."""

from __future__ import annotations

from typing import Any

import click

from mocapdb.base.arrays import StrPath
from mocapdb.cli._assumed import SOURCES, shortened
from mocapdb.cli._console import counted, emit_json, megabytes
from mocapdb.cli._csv import csv_option, each_of
from mocapdb.cli._options import json_option, library_argument


@click.command()
@library_argument
@click.argument("clip", required=False)
@csv_option(each_of())
@json_option
def info(library: StrPath, clip: str | None, as_json: bool) -> None:
    """Show what a library, or one clip of it, holds and costs.

    \b
    Example:
      mocapdb info cmu.mocapdb
      mocapdb info cmu.mocapdb 02_03 --json
    """
    from mocapdb.library import Library

    with Library(library) as opened:
        figures = opened.info(clip)
    if as_json:
        emit_json(figures)
        return
    for name, value in _lines(library, figures):
        click.echo(f"{name:<16}{value}")


def _lines(library: StrPath, figures: dict[str, Any]) -> list[tuple[str, str]]:
    error = figures["error_mm"]
    lines = [("library", str(library))]
    if "clip" in figures:
        lines += [
            ("clip", figures["clip"]),
            ("class", figures["label"] or "-"),
            ("description", figures["description"] or "-"),
            ("source", figures["source"]),
            ("rate", f"{figures['fps']:g} frames/s, {_said(figures['fps_source'])}"),
            ("unit", f"{figures['unit_m']:g} m, {_said(figures['unit_m_source'])}"),
            ("up", f"{figures['up']}, {_said(figures['up_source'])}"),
            ("body", _body(figures)),
            ("subject", f"{figures['subject'] or '-'}, {_said(figures['subject_source'])}"),
            *figures["columns"].items(),
            *(("mended", note) for note in figures["mended"]),
            *[("not searched", figures["unsearchable"])] * (figures["unsearchable"] is not None),
            ("codec", figures["codec"]),
            *_revision_lines(figures["revision"]),
        ]
    else:
        lines.append(("clips", str(figures["clips"])))
    lines += [
        ("frames", f"{figures['frames']} ({figures['seconds']:.1f} s)"),
        (
            "size",
            f"{megabytes(figures['payload_bytes'])}, {figures['bytes_per_frame']:.1f} B/frame",
        ),
        (
            "ratio",
            f"{figures['ratio_float32']:.1f} to float32 channels, "
            f"{figures['ratio_source']:.1f} to the source files",
        ),
        (
            "skinned error",
            f"{figures['skinned_error']:.3f} mean, {figures['skinned_error_max']:.3f} worst clip "
            "(skeleton units)",
        ),
        (
            "vertex error",
            f"{error['mean']:.2f} mean, {error['p95']:.2f} p95, {error['max']:.2f} max (mm)",
        ),
    ]
    lines += _joint_lines(figures)
    if "clip" not in figures:
        codecs = [f"{name} {count}" for name, count in figures["codecs"].items()]
        lines.append(("codecs", ", ".join(codecs) or "-"))
        if figures["shared_axes"]:
            size = megabytes(figures["shared_axes_bytes"])
            sets = counted(figures["shared_axes"], "set")
            share = figures["shared_axes_bytes"] / max(figures["frames"], 1)
            lines.append(("shared axes", f"{sets}, {size}, {share:.1f} B/frame more"))
        index = megabytes(figures["index_bytes"])
        lines.append(("on disk", f"{megabytes(figures['disk_bytes'])}, {index} of it for queries"))
        classes = [f"{name} {count}" for name, count in figures["classes"].items()]
        lines.append(("classes", ", ".join(classes) or "-"))
        if figures["unsearchable"]:
            lines.append(("not searched", f"{figures['unsearchable']} (mocapdb ls --unsearchable)"))
        if figures["outlying"]:
            lines.append(("outlying", ", ".join(shortened(figures["outlying"]))))
        revised = figures["revisions"]
        if revised["searched"]:
            text = (
                f"{revised['searched']} searched for faults, {revised['cleaned']} cleaned, "
                f"{revised['left']} of {counted(revised['spans'], 'span')} left"
            )
            lines.append(("revisions", f"{text}; {megabytes(revised['payload_bytes'])} more"))
        cycles = [f"{row['class']} {row['period_s']:.2f} s" for row in figures["cycles"]]
        lines.append(("cycles", ", ".join(cycles) or "-"))
    return lines


def _revision_lines(revision: dict[str, Any] | None) -> list[tuple[str, str]]:
    """Return what was cleaned in a clip, by whom, when, and span by span."""
    if revision is None:
        return [("revision", "none: not searched for faults")]
    who = f"by mocapdb {revision['version']} on {revision['created']}"
    lines = [
        (
            "revision",
            f"{revision['kind']} {who}: {revision['repaired']} repaired, {revision['left']} left",
        )
    ]
    for span in revision["spans"]:
        ways = ((span["moved_deg"], "deg"), (span.get("moved_mm"), "mm"))
        far = ", ".join(f"{by:.1f} {unit}" for by, unit in ways if by is not None)
        moved = f", moved {far}" if far else ""
        lines.append(
            (
                "span",
                f"{span['joint']} {span['start']:.3f} to {span['end']:.3f} s: {span['kind']}, "
                f"{span['confidence']:.0%} sure, {span['method']}{moved}",
            )
        )
    return lines


def _joint_lines(figures: dict[str, Any]) -> list[tuple[str, str]]:
    """Return what joints lost of their own motion: of one clip all that move, else the most."""
    lines = []
    for name, each in (("joint", "joint"), ("worst clip", "clip")):
        for row in figures.get("joints" if each == "joint" else "worst_clips", []):
            who = [row["joint"]] if each == "joint" else [row["clip"], row["joint"]]
            if each == "joint" and "clip" in row:
                who.append(f"in {row['clip']}")
            unit = row["unit"]
            lines.append(
                (
                    name,
                    f"{' '.join(who)}: keeps {row['kept']:.1f} of {row['swing']:.1f} {unit}; error "
                    f"{row['mean']:.2f} mean, {row['worst']:.2f} worst, at {row['worst_s']:.2f} s",
                )
            )
    if figures["unmeasured"]:
        count = "" if "clip" in figures else f"of {figures['unmeasured']} clips "
        lines.append(("joints", f"{count}not measured by the version that built them: rebuild"))
    return lines


def _said(source: str) -> str:
    """Return who stated something of a clip, in words."""
    return SOURCES.get(source, source)


def _body(figures: dict[str, Any]) -> str:
    """Return how a body was understood, and how tall it is."""
    how = {"none": "no whole human", "unknown": "not kept by an earlier version"}
    words = how.get(figures["body"], f"human, joints {figures['body']}")
    return words if figures["height_m"] is None else f"{words}, {figures['height_m']:.2f} m"
