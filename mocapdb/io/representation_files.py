"""Clips written in one of O'Kane's representations, for other programs.

==========  ======================================================================================
``.npz``    ``values`` (F, D) and ``root`` (F, r) in float64, ``columns`` and ``units`` (D,),
            ``root_columns`` and ``root_units`` (r,), ``time_s`` (F,), and ``header`` as in
            `npz`, with the skeleton: `read_clip` makes the clip of it again
``.csv``    a row a frame: time, root track, values, to nine digits; names and units in the first
            line, such as ``lfemur.x (0.0564444 m)``
==========  ======================================================================================

``smpl``, ``smplh`` and ``smplx`` write the rotations of SMPL's bodies instead (`amass`).

Positions are x, y, z with the vertical axis of the skeleton. Aligned ones are seen from the body's
root: its place is the origin, and it heads along one direction; the root track says where that is.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import cast

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.files import replacing
from mocapdb.errors import FormatError
from mocapdb.io.amass import write_smpl
from mocapdb.io.npz import header_of
from mocapdb.io.smpl_bodies import BODY_MODELS, BodyModelName
from mocapdb.motion.clip import Clip
from mocapdb.motion.representations import RepresentationName

__all__ = ["REPRESENTATION_SUFFIXES", "write_representation"]

REPRESENTATION_SUFFIXES = (".npz", ".csv")


def write_representation(
    clip: Clip, name: RepresentationName | BodyModelName, path: StrPath
) -> Clip:
    """Write a clip in one representation as NPZ or CSV, by the suffix; return it as it was written.

    Parameters
    ----------
    clip : Clip
    name : {"channels", "positions", "aligned", "scaled", "normalised", "smpl", "smplh", "smplx"}
    path : path-like

    Raises
    ------
    FormatError
        If the suffix is neither, or the file cannot be written.
    SkeletonError
        If there is no representation of that name.
    """
    if name in BODY_MODELS:
        own = Path(clip.source)  # of which betas and gender are kept
        like = own if own.suffix.lower() == ".npz" and own.is_file() else None
        return write_smpl(clip, path, name, like=like)
    name = cast(RepresentationName, name)
    suffix = Path(path).suffix.lower()
    if suffix not in REPRESENTATION_SUFFIXES:
        raise FormatError(
            path, f"Expected a file for a representation, .npz or .csv, but got {suffix!r}."
        )
    shown = clip.represent(name)
    time_s = np.arange(len(clip)) / clip.fps
    with replacing(path) as (temporary,):
        if suffix == ".npz":
            with temporary.open("wb") as file:
                np.savez_compressed(
                    file,
                    values=shown.values,
                    root=shown.root,
                    columns=np.array(shown.columns),
                    units=np.array(shown.units),
                    root_columns=np.array(shown.root_columns, dtype=str),
                    root_units=np.array(shown.root_units, dtype=str),
                    time_s=time_s,
                    header=header_of(clip, representation=name),
                )
            return clip
        names = ["time", *(f"root.{column}" for column in shown.root_columns), *shown.columns]
        units = ["s", *shown.root_units, *shown.units]
        with temporary.open("w", encoding="utf-8", newline="") as text:
            rows = csv.writer(text)
            rows.writerow(f"{name} ({unit})" for name, unit in zip(names, units, strict=True))
            table = np.column_stack([time_s, shown.root, shown.values])
            np.savetxt(text, table, fmt="%.9g", delimiter=",")
    return clip
