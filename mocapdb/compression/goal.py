"""What the production codec holds: a statistic of how far some points are off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from mocapdb._typing import FloatArray
from mocapdb.compression.sensitivity import PointsName, error_points, point_misses
from mocapdb.errors import CodecError
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import pose_error

__all__ = ["GOAL_KINDS", "Goal", "GoalKind", "Loss", "measure"]

GoalKind: TypeAlias = Literal["skinned", "mean_mm", "max_mm", "shell_mean_mm", "shell_max_mm"]
GOAL_KINDS: tuple[GoalKind, ...] = (
    "skinned",
    "mean_mm",
    "max_mm",
    "shell_mean_mm",
    "shell_max_mm",
)


@dataclass(frozen=True)
class Goal:
    """An upper bound for the error of a clip.

    Parameters
    ----------
    kind : {"skinned", "mean_mm", "max_mm", "shell_mean_mm", "shell_max_mm"}
        Mean skinned error in skeleton units (O'Kane 2008, eq. 3.1); mean or maximum distance in
        millimetres of the vertices of the skin, or of the points of the shell.
    value : float
        The bound.
    """

    kind: GoalKind
    value: float

    def __post_init__(self) -> None:
        if self.kind not in GOAL_KINDS:
            raise CodecError(
                f"Expected a goal out of {', '.join(GOAL_KINDS)}, but got {self.kind!r}."
            )
        if not (np.isfinite(self.value) and self.value > 0):
            raise CodecError(f"Expected a positive goal, but got {self.value}.")

    @property
    def points(self) -> PointsName:
        """The points that are measured."""
        return "shell" if self.kind.startswith("shell") else "skin"

    @property
    def is_maximum(self) -> bool:
        """Whether one point of one frame can break it."""
        return self.kind in {"max_mm", "shell_max_mm"}

    def of(self, loss: Loss) -> float:
        """Return the figure of a loss that this goal bounds."""
        if self.kind == "skinned":
            return loss.skinned
        return loss.max_mm if self.is_maximum else loss.mean_mm


@dataclass(frozen=True)
class Loss:
    """What some frames lost, in the points of a goal.

    Attributes
    ----------
    n_frames : int
    skinned : float, skeleton units
        Mean over frames of the norm of the difference of all points.
    mean_mm, max_mm : float
    """

    n_frames: int
    skinned: float
    mean_mm: float
    max_mm: float

    def __add__(self, other: Loss) -> Loss:
        n_frames = self.n_frames + other.n_frames
        share = self.n_frames / n_frames
        return Loss(
            n_frames,
            share * self.skinned + (1 - share) * other.skinned,
            share * self.mean_mm + (1 - share) * other.mean_mm,
            max(self.max_mm, other.max_mm),
        )


def measure(skeleton: Skeleton, points: PointsName, pose: Pose, other: Pose) -> Loss:
    """Return what one pose over time lost against another.

    A skeleton of one joint has no skin: its shell is measured instead.
    """
    if points == "skin" and skeleton.n_joints > 1:
        error = pose_error(skeleton, pose, other)
        return Loss(len(pose.positions), error.skinned, error.vertices.mean, error.vertices.max)
    misses = point_misses(error_points(skeleton, "shell"), pose, other)
    millimetres = 1000.0 * skeleton.metres_per_unit
    norms: FloatArray = np.sqrt((misses**2).sum(axis=1))
    return Loss(
        len(misses),
        float(norms.mean()),
        float(misses.mean()) * millimetres,
        float(misses.max()) * millimetres,
    )
