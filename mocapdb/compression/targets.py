"""What a compressed clip may lose, or take, at most."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from mocapdb.errors import CodecError
from mocapdb.motion.skin import MotionError, PointsName

__all__ = ["ByteBudget", "Target", "TargetKind"]

TargetKind: TypeAlias = Literal["skinned", "mean_mm", "max_mm", "shell_mean_mm", "shell_max_mm"]


@dataclass(frozen=True)
class Target:
    """An upper bound for the error of a clip.

    Parameters
    ----------
    kind : {"skinned", "mean_mm", "max_mm", "shell_mean_mm", "shell_max_mm"}
        Mean skinned error in skeleton units (O'Kane 2008, eq. 3.1); mean or maximum distance in
        millimetres of a vertex of the skin, or of a point of the shell (see `mocapdb.motion.skin`).
    value : float
        The bound.

    Raises
    ------
    CodecError
        If the kind is unknown or the bound is not a positive, finite number.

    Examples
    --------
    >>> Target("max_mm", 1.0)
    Target(kind='max_mm', value=1.0)
    """

    kind: TargetKind
    value: float

    def __post_init__(self) -> None:
        if self.kind not in get_args(TargetKind):
            raise CodecError(
                f"Expected a target out of {', '.join(get_args(TargetKind))}, "
                f"but got {self.kind!r}."
            )
        if not (math.isfinite(self.value) and self.value > 0):
            raise CodecError(
                f"Expected a positive target in {self.unit}, but got {self.value}. "
                "Clips are stored with some loss: choose how much is allowed."
            )

    @property
    def unit(self) -> str:
        """What the bound is in."""
        return "skeleton units" if self.kind == "skinned" else "mm"

    @property
    def points(self) -> PointsName:
        """The points on which an error has to be measured."""
        return "shell" if self.kind.startswith("shell") else "skin"

    @property
    def is_maximum(self) -> bool:
        """Whether one point of one frame can break it."""
        return self.kind in {"max_mm", "shell_max_mm"}

    def measure(self, error: MotionError) -> float:
        """Return the figure of an error, measured on this target's points, that it bounds."""
        if self.kind == "skinned":
            return error.skinned
        return error.vertices.max if self.is_maximum else error.vertices.mean

    def holds(self, error: MotionError) -> bool:
        """Say whether an error is within this target."""
        return self.measure(error) <= self.value

    def __str__(self) -> str:
        return f"{self.kind} <= {self.value:g} {self.unit}"


@dataclass(frozen=True)
class ByteBudget:
    """An upper bound for the bytes of a clip, within which its error is to be least.

    Parameters
    ----------
    bytes_per_frame : float
        Everything counted but the skeleton, and what a library keeps for clips that share it.

    Raises
    ------
    CodecError
        If it is not a positive, finite number.

    Examples
    --------
    >>> print(ByteBudget(12))
    at most 12 bytes a frame
    """

    bytes_per_frame: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.bytes_per_frame) and self.bytes_per_frame > 0):
            raise CodecError(
                f"Expected a positive number of bytes a frame, but got {self.bytes_per_frame}."
            )

    def __str__(self) -> str:
        return f"at most {self.bytes_per_frame:g} bytes a frame"
