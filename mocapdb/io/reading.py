"""What a user says of motion files, where the files themselves and their motion do not tell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, get_args

from mocapdb.base.arrays import StrPath
from mocapdb.errors import ClipError, FormatError, SkeletonError
from mocapdb.io._settings_text import read_toml
from mocapdb.motion.body.given_joints import check_canonical_names
from mocapdb.motion.skeleton import Skeleton, UpDirection

__all__ = ["ReadOptions", "read_joint_map"]


@dataclass(frozen=True)
class ReadOptions:
    """How files are to be read. What is None is found out: from the file, else from its motion.

    Parameters
    ----------
    unit_m : float, optional, metres
        Length of the file's unit.
    up : {"y", "z", "x", "-x", "-y", "-z"}, optional
        The direction that is up in the file.
    fps : float, optional, frames per second
        The file's frame rate.
    skeleton : Skeleton or path-like, optional
        Of an AMC, or the ASF that holds it.
    joint_map : mapping of str to str, optional
        Joints of the skeleton by the names of canonical joints, some of them or all.
    strict : bool
        Whether to refuse what would have to be mended.
    take : str, optional
        Which motion of a file that holds several.
    blender : path-like, optional
        The Blender that reads FBX, Collada and USD; it is nothing that is said of files.

    Raises
    ------
    ClipError
        If a unit or a rate is no positive number, or the axis is none.
    SkeletonError
        If the joint map has a name that is no canonical joint's.

    Examples
    --------
    >>> said, usual = ReadOptions(unit_m=0.01), ReadOptions(unit_m=1.0, up="z")
    >>> said.over(usual)
    ReadOptions(unit_m=0.01, up='z', fps=None, skeleton=None, joint_map=None, strict=False)
    """

    unit_m: float | None = None
    up: UpDirection | None = None
    fps: float | None = None
    skeleton: Skeleton | StrPath | None = None
    joint_map: Mapping[str, str] | None = None
    strict: bool = False
    take: str | None = field(default=None, repr=False)
    blender: StrPath | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        for value, what in ((self.unit_m, "unit in metres"), (self.fps, "frame rate")):
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ClipError(f"Expected a positive {what}, but got {value}.")
        if self.up is not None and self.up not in get_args(UpDirection):
            known = ", ".join(get_args(UpDirection))
            raise ClipError(f"Expected an up axis out of {known}, but got {self.up!r}.")
        check_canonical_names(self.joint_map or ())

    @property
    def says_nothing(self) -> bool:
        """Whether everything is left to the files."""
        return self == ReadOptions()

    def over(self, weaker: ReadOptions) -> ReadOptions:
        """Return what both say, this one first."""
        own = {each.name: getattr(self, each.name) or None for each in fields(self)}
        both = {key: getattr(weaker, key) if value is None else value for key, value in own.items()}
        return ReadOptions(**both)

    def to_dict(self) -> dict[str, Any]:
        """Return what is said of unit, axis, rate and joints, ready for JSON."""
        said = {key: getattr(self, key) for key in ("unit_m", "up", "fps")}
        said["joint_map"] = dict(self.joint_map) if self.joint_map else None
        return {key: value for key, value in said.items() if value is not None}


def read_joint_map(path: StrPath) -> dict[str, str]:
    """Read a joint map: a TOML file with lines such as ``left_knee = "LeftLeg"``.

    Raises
    ------
    FormatError
        If it is no such file, is empty, or has a name that is no canonical joint's.
    """
    table = read_toml(Path(path), lambda message: FormatError(path, message))
    if not table:
        raise FormatError(path, 'Expected joints such as left_knee = "LeftLeg", but got none.')
    try:
        return checked_joint_map(table)
    except SkeletonError as problem:
        raise FormatError(path, str(problem)) from None


def checked_joint_map(table: Mapping[str, Any]) -> dict[str, str]:
    """Return a table of TOML as a joint map.

    Raises
    ------
    SkeletonError
        If a name is no canonical joint's, or a value no name.
    """
    check_canonical_names(table)
    for joint, name in table.items():
        if not isinstance(name, str) or not name:
            raise SkeletonError(f"Expected the name of a joint as {joint}, but got {name!r}.")
    return dict(table)
