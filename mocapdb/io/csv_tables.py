"""Clips as CSV, for spreadsheets and for those who read nothing else: a row a frame.

Columns are those of a wide table of `mocapdb.motion.clip_tables`: ``frame``, ``time_s``, for each
joint ``hips.x hips.y hips.z`` in metres, Y up, and ``hips.qx`` to ``hips.qw``, its rotation in its
parent's frame; ``left.contact`` and ``right.contact`` are 1 while the foot rests.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import replacing
from mocapdb.motion.clip import Clip
from mocapdb.motion.clip_tables import TableGroup, clip_table

__all__ = ["write_csv"]

USUAL: tuple[TableGroup, ...] = ("positions", "rotations", "contacts")


def write_csv(clip: Clip, path: StrPath, columns: Sequence[TableGroup] = USUAL) -> None:
    """Write a clip as CSV, to nine digits.

    Parameters
    ----------
    clip : Clip
    path : path-like
    columns : sequence of {"positions", "rotations", "velocities", "channels", "contacts"}
        What it holds.

    Raises
    ------
    ClipError
        If a group of columns is unknown.
    FormatError
        If the file cannot be written.
    """
    table = clip_table(clip.skeleton, clip.channels, clip.fps, "wide", columns)
    rows = np.column_stack([np.asarray(column, dtype=np.float64) for column in table.values()])
    with replacing(path) as (temporary,), temporary.open("w", encoding="utf-8", newline="") as text:
        csv.writer(text).writerow(table)
        np.savetxt(text, rows, fmt="%.9g", delimiter=",")
