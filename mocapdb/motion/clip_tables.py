"""A motion as a table: a row a frame, or a row a joint and frame, for pandas and for CSV files.

==============  ===========  ======================================================
group           tidy         wide
==============  ===========  ======================================================
``positions``   x y z        ``hips.x hips.y hips.z`` and so on for each joint
``rotations``   qx qy qz qw  ``hips.qx hips.qy hips.qz hips.qw``, xyzw
``velocities``  vx vy vz     ``hips.vx hips.vy hips.vz``, units of length a second
``channels``                 ``hips.tx hips.rz`` and so on, as they were read
``contacts``                 ``left.contact right.contact``: whether the foot rests
==============  ===========  ======================================================

Both begin with ``frame`` and ``time_s``; tidy ones go on with ``joint``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import ClipError, MissingExtraError
from mocapdb.motion.foot_contacts import contacts_by_foot
from mocapdb.motion.joint_tracks import (
    RotationSpace,
    Units,
    VerticalAxis,
    joint_positions,
    joint_rotations,
    joint_velocities,
)
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    import pandas

__all__ = ["ClipTable", "TableForm", "TableGroup", "clip_table", "data_frame"]

TableForm: TypeAlias = Literal["tidy", "wide"]
TableGroup: TypeAlias = Literal["positions", "rotations", "velocities", "channels", "contacts"]
ClipTable: TypeAlias = dict[str, np.ndarray]
"""Columns by name, all of one length."""

NAMES = {
    "positions": ("x", "y", "z"),
    "rotations": ("qx", "qy", "qz", "qw"),
    "velocities": ("vx", "vy", "vz"),
}


def clip_table(
    skeleton: Skeleton,
    channels: FloatArray,
    fps: float,
    form: TableForm = "tidy",
    groups: Sequence[TableGroup] = ("positions", "rotations"),
    *,
    units: Units = "m",
    up: VerticalAxis = "y",
    space: RotationSpace = "local",
) -> ClipTable:
    """Return a motion as columns.

    Parameters
    ----------
    skeleton : Skeleton
    channels : (F, C)
    fps : float, frames per second
    form : {"tidy", "wide"}
        A row for each joint of each frame, or a row for each frame.
    groups : sequence of {"positions", "rotations", "velocities", "channels", "contacts"}
        What the columns hold; the last two need a row a frame.
    units, up, space
        As of `Clip.positions` and `Clip.rotations`.

    Raises
    ------
    ClipError
        If the form or a group is unknown, or does not go into it.
    """
    if form not in get_args(TableForm):
        raise ClipError(f"Expected form 'tidy' or 'wide', but got {form!r}.")
    allowed = tuple(NAMES) if form == "tidy" else get_args(TableGroup)
    for group in groups:
        if group not in allowed:
            raise ClipError(
                f"Expected columns of a {form} table out of {', '.join(allowed)}, but got "
                f"{group!r}."
            )
    n_frames, n_joints = len(channels), skeleton.n_joints
    frames = np.arange(n_frames)
    rows = n_joints if form == "tidy" else 1
    table: ClipTable = {"frame": np.repeat(frames, rows), "time_s": np.repeat(frames / fps, rows)}
    if form == "tidy":
        table["joint"] = np.tile(np.array(skeleton.names, dtype=object), n_frames)
    for group in groups:
        if group == "channels":
            table |= dict(zip(skeleton.channel_names, channels.T, strict=True))
        elif group == "contacts":
            positions = forward_kinematics(skeleton, channels).positions
            found = contacts_by_foot(skeleton, positions, fps)
            table |= {f"{foot}.contact": flags for foot, flags in found.items()}
        else:
            values = _values(skeleton, channels, fps, group, units, up, space)
            for i, name in enumerate(NAMES[group] if form == "tidy" else ()):
                table[name] = values[..., i].ravel()
            for j, joint in enumerate(skeleton.names if form == "wide" else ()):
                for i, name in enumerate(NAMES[group]):
                    table[f"{joint}.{name}"] = values[:, j, i]
    return table


def data_frame(table: ClipTable) -> pandas.DataFrame:
    """Return a table as a pandas DataFrame.

    Raises
    ------
    MissingExtraError
        If pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise MissingExtraError("pandas", "pandas") from None
    if "joint" in table:  # a category takes a byte a row where a string takes eight and more
        joints: Any = pandas.Categorical(table["joint"], list(dict.fromkeys(table["joint"])))
        table = {**table, "joint": joints}
    return pandas.DataFrame(table)


def _values(
    skeleton: Skeleton,
    channels: FloatArray,
    fps: float,
    group: TableGroup,
    units: Units,
    up: VerticalAxis,
    space: RotationSpace,
) -> FloatArray:
    """Return what a group says of each joint, (F, J, ...)."""
    if group == "rotations":
        rotations = joint_rotations(skeleton, channels, space, "quat_xyzw", up)
        return np.asarray(rotations)
    positions = joint_positions(skeleton, channels, units, up)
    return positions if group == "positions" else joint_velocities(positions, fps)
