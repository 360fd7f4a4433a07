"""Tidy tables of gait, as CSV: one row a stride, and one row an angle and percent of a stride."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from mocapdb.base.files import replacing
from mocapdb.gait.gait_analysis import GaitAnalysis
from mocapdb.gait.strides import MEASURES

__all__ = ["write_angles", "write_strides"]

EVENTS = ("start", "toe_off", "opposite_toe_off", "opposite_strike", "end")


def write_strides(gaits: Sequence[GaitAnalysis], path: Path) -> None:
    """Write a row for each stride: clip, side, number, the times of its events, its measures."""
    header = ["clip", "side", "stride", *(f"{event}_s" for event in EVENTS), *MEASURES]
    _write(
        path,
        header,
        (
            [
                gait.clip.name, stride.side, stride.number,
                *(f"{getattr(stride, event) / gait.clip.fps:.4f}" for event in EVENTS),
                *(f"{getattr(stride, name):.5g}" for name in MEASURES),
            ]
            for gait in gaits
            for stride in gait.strides
        ),
    )  # fmt: skip


def write_angles(gaits: Sequence[GaitAnalysis], path: Path) -> None:
    """Write a row for each angle at each percent of each stride, in degrees."""
    _write(
        path,
        ["clip", "side", "stride", "joint", "angle", "percent", "degrees"],
        (
            [gait.clip.name, side, number, joint, angle, percent, f"{degrees:.3f}"]
            for gait in gaits
            for (side, joint, angle), laps in gait.curves.items()
            for number, lap in enumerate(laps, start=1)
            for percent, degrees in enumerate(lap.tolist())
        ),
    )


def _write(path: Path, header: list[str], rows: Iterable[list[object]]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with (
        replacing(path) as (temporary,),
        Path(temporary).open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
