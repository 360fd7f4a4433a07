"""What a compressed clip may lose, or take, at most."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.tuning import (
    JOINT_FLOOR_DEG,
    JOINT_FLOOR_MM,
    JOINT_RMS,
    JOINT_SHARE,
    MAX_OF_MEAN,
)
from mocapdb.errors import CodecError
from mocapdb.motion.joint_errors import JointErrors, JointMotion
from mocapdb.motion.skin import MotionError, PointsName

__all__ = ["ByteBudget", "Target", "TargetKind"]

TargetKind: TypeAlias = Literal["skinned", "mean_mm", "max_mm", "shell_mean_mm", "shell_max_mm"]

_FLOORS: FloatArray = np.array([[JOINT_FLOOR_DEG], [JOINT_FLOOR_MM]])


@dataclass(frozen=True)
class Target:
    """Upper bounds for the error of a clip.

    Parameters
    ----------
    kind : {"skinned", "mean_mm", "max_mm", "shell_mean_mm", "shell_max_mm"}
        Mean skinned error in skeleton units (O'Kane 2008, eq. 3.1); mean or maximum distance in
        millimetres of a vertex of the skin, or of a point of the shell (see `mocapdb.motion.skin`).
    value : float
        The bound.
    joint_share : float, optional
        Each joint keeps its own motion (see `mocapdb.motion.joint_errors`): of its swing at most
        this share is missing, and the root mean square error of its rotation is at most 3 times
        this share of its spread; or .6 and .3 degrees where that is more. Translations likewise,
        but for the root's, with .4 and .2 mm. 0 for no such bound. By default `JOINT_SHARE`, and
        0 with O'Kane's codec, whose coefficients know of no joint.
    max_mm : float, optional
        A bound for every vertex besides that for their mean. By default `MAX_OF_MEAN` times a mean
        in millimetres as long as there is a `joint_share`, and none otherwise.

    Raises
    ------
    CodecError
        If the kind is unknown, a bound is not a positive, finite number, the share is not between
        0 and 1, or the maximum is below the mean or comes beside another maximum.

    Examples
    --------
    >>> print(Target("max_mm", 1.0))
    max_mm <= 1 mm, joints keep 90 %
    >>> print(Target("mean_mm", 1.0, joint_share=0, max_mm=10))
    mean_mm <= 1 mm, max_mm <= 10 mm
    """

    kind: TargetKind
    value: float
    joint_share: float | None = None
    max_mm: float | None = None

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
        if not 0.0 <= self.share <= 1.0:
            raise CodecError(
                f"Expected a joint share from 0 (none) to 1, but got {self.share}. It is the "
                "part of its own motion by which each joint may be off."
            )
        for name in ("value", "joint_share", "max_mm"):  # equal targets give equal text
            if getattr(self, name) is not None:
                object.__setattr__(self, name, float(getattr(self, name)))
        if self.max_mm is None:
            return
        if self.is_maximum:
            raise CodecError(f"Expected one maximum, but got max_mm besides {self.kind}.")
        if not (math.isfinite(self.max_mm) and self.max_mm > 0):
            raise CodecError(f"Expected a positive maximum in mm, but got {self.max_mm}.")
        if self.kind != "skinned" and self.max_mm < self.value:
            raise CodecError(
                f"Expected a maximum of at least the mean, {self.value:g} mm, but got "
                f"{self.max_mm:g} mm. Leave the mean out: the maximum holds it."
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
    def share(self) -> float:
        """Of its own motion how much each joint may lose; where nothing was said, the default."""
        return JOINT_SHARE if self.joint_share is None else self.joint_share

    def for_codec(self, codec: str) -> Target:
        """Return this target with the codec's default where nothing was said of joints."""
        if self.joint_share is not None:
            return self
        return replace(self, joint_share=JOINT_SHARE if codec == "pose" else 0.0)

    @property
    def is_maximum(self) -> bool:
        """Whether one point of one frame can break it."""
        return self.kind in {"max_mm", "shell_max_mm"}

    @property
    def largest_mm(self) -> float:
        """What no point may exceed besides; infinite where the bound itself is all there is."""
        if self.max_mm is not None:
            return self.max_mm
        is_default = self.share > 0 and self.kind in {"mean_mm", "shell_mean_mm"}
        return MAX_OF_MEAN * self.value if is_default else math.inf

    def allowed_loss(self, motion: JointMotion) -> FloatArray:
        """Return how much of the swing of each joint (2, J) may be missing."""
        return np.maximum(self.share * motion.swing, 2.0 * _FLOORS)

    def allowed_rms(self, motion: JointMotion) -> FloatArray:
        """Return the root mean square by which each joint (2, J) may be off."""
        return np.maximum(JOINT_RMS * self.share * motion.spread, _FLOORS)

    def tighter(self, share: float) -> Target:
        """Return this target with a share of its bound and of what joints may lose."""
        most = self.largest_mm if math.isfinite(self.largest_mm) else None
        lost = None if self.joint_share is None else share * self.joint_share
        return replace(self, value=share * self.value, joint_share=lost, max_mm=most)

    def measure(self, error: MotionError) -> float:
        """Return the figure of an error, measured on this target's points, that it bounds."""
        if self.kind == "skinned":
            return error.skinned
        return error.vertices.max if self.is_maximum else error.vertices.mean

    def holds(self, error: MotionError, joints: JointErrors | None = None) -> bool:
        """Say whether an error, and those of the joints where they are given, are within it."""
        return self.broken(error, joints) <= 1.0

    def broken(self, error: MotionError, joints: JointErrors | None = None) -> float:
        """Return how many times over the bound that is broken most is broken; up to 1 all hold."""
        ratio = max(self.measure(error) / self.value, error.vertices.max / self.largest_mm)
        return ratio if joints is None else max(ratio, self.excess(joints))

    def excess(self, joints: JointErrors) -> float:
        """Return how many times over the worst joint breaks its bound; up to 1 all hold."""
        return float(self.excess_by_joint(joints).max(initial=0.0))

    def excess_by_joint(self, joints: JointErrors) -> FloatArray:
        """Return how many times over each joint breaks its bound, (2, J): turning, and shifting."""
        if self.share == 0:
            return np.zeros_like(joints.rms)
        missing = (joints.motion.swing - joints.kept) / self.allowed_loss(joints.motion)
        return np.maximum(missing, joints.rms / self.allowed_rms(joints.motion))

    def __str__(self) -> str:
        parts = [f"{self.kind} <= {self.value:g} {self.unit}"]
        if math.isfinite(self.largest_mm):
            parts.append(f"max_mm <= {self.largest_mm:g} mm")
        if self.share:
            parts.append(f"joints keep {100 * (1 - self.share):g} %")
        return ", ".join(parts)


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
