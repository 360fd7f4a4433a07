"""The cycle: one lap of a motion, closed, as a curve of the phase."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.curve.closed_curves import interpolate_closed, shift_phase
from mocapdb.errors import CycleError
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.rotations import elementary
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "Cycle",
    "RootMotion",
    "from_columns",
    "joint_positions",
    "to_columns",
    "world_pose",
]

RootMotion: TypeAlias = Literal["advance", "in-place"]

NEGLIGIBLE_TURN_RAD = 1e-6  # below it the circle's centre is too far away for arithmetic


@dataclass(frozen=True, eq=False)
class Cycle:
    """One lap of a motion, sampled at even phases, that goes on into itself.

    Attributes
    ----------
    skeleton : Skeleton
    columns : (S, J, 6)
        First two columns of each joint's rotation relative to its parent, at phases 0, 1/S, ...
        The root's is relative to its heading.
    sway : (S, 3), skeleton units
        Where the root is at each phase, beside the steady advance, seen from its heading.
    advance : (3,), skeleton units
        How far the root goes in a lap, seen from its heading at every moment.
    turn_rad : float, radians
        How far a lap turns the heading.
    translations : (T,), skeleton units
        Constant values of the translation channels of joints other than the root.
    period_s : float, seconds
        Duration of a lap.
    name : str
    label : str, optional
        Class of the motion.
    provenance : tuple of str
    """

    skeleton: Skeleton
    columns: FloatArray
    sway: FloatArray
    advance: FloatArray
    turn_rad: float
    translations: FloatArray
    period_s: float
    name: str = ""
    label: str | None = None
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.columns.shape != (len(self.sway), self.skeleton.n_joints, 6):
            raise CycleError(
                f"Expected rotations of shape ({len(self.sway)}, {self.skeleton.n_joints}, 6), "
                f"but got {self.columns.shape}."
            )
        if not (math.isfinite(self.period_s) and self.period_s > 0):
            raise CycleError(f"Expected a positive period, but got {self.period_s} s.")

    def __repr__(self) -> str:
        label = f", {self.label}" if self.label else ""
        speed = np.linalg.norm(self.advance) * self.skeleton.metres_per_unit / self.period_s
        return f"Cycle({self.name!r}{label}: {self.period_s:.3f} s a lap, {speed:.2f} m/s)"

    def rotations(self, phase: FloatArray) -> FloatArray:
        """Return the rotation (F, J, 3, 3) of each joint relative to its parent at phases (F,)."""
        return from_columns(interpolate_closed(self.columns, phase))

    def root_path(self, phase: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the root's positions (F, 3) and heading (F,) at unwrapped phases, from 0 at 0.

        Notes
        -----
        A cycle that turns goes round a circle, at the same speed as seen from its heading.
        """
        path, heading = self.steady_path(phase)
        sway = interpolate_closed(self.sway, np.asarray(phase))
        return path + np.einsum(
            "fij,fj->fi", elementary(self.skeleton.up_axis, heading), sway
        ), heading

    def steady_path(self, phase: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the steady advance (F, 3) and turn (F,) at unwrapped phases, without the sway.

        See `root_path`.
        """
        phase = np.asarray(phase, dtype=np.float64)
        heading = self.turn_rad * phase
        up, axis = self.skeleton.up_index, self.skeleton.up_axis
        level = self.advance.copy()
        level[up] = 0.0
        if abs(self.turn_rad) < NEGLIGIBLE_TURN_RAD:
            path = phase[:, None] * level
        else:
            quarter = elementary(axis, np.array(math.pi / 2))
            centre = quarter @ level / self.turn_rad
            path = centre - elementary(axis, heading) @ centre
        path[:, up] = phase * self.advance[up]
        return path, heading

    def pose(self, phase: FloatArray, root: RootMotion = "advance") -> Pose:
        """Return the world pose at unwrapped phases (F,), heading along the rest pose at 0."""
        local = self.rotations(phase)
        if root == "advance":
            positions, heading = self.root_path(phase)
            local[:, 0] = elementary(self.skeleton.up_axis, heading) @ local[:, 0]
        elif root == "in-place":
            positions = interpolate_closed(self.sway, np.asarray(phase))
        else:
            raise CycleError(f"Expected root motion 'advance' or 'in-place', but got {root!r}.")
        return world_pose(self.skeleton, local, positions, self.translations)

    def rephased(self, start: float) -> Cycle:
        """Return the same cycle with phase 0 where `start` was.

        Its advance stays: every phase sees it from its own heading.
        """
        if start % 1.0 == 0.0:
            return self
        columns, sway = (shift_phase(samples, start) for samples in (self.columns, self.sway))
        return replace(self, columns=columns, sway=sway)

    def animating(self, joints: Sequence[str]) -> Cycle:
        """Return the cycle in which only these joints move; the others keep the pose at phase 0.

        Without the root it stays in place. After the pose mode of Raunio's plugin (2014, 5.3).

        Raises
        ------
        SkeletonError
            If the skeleton has no joint of that name.
        """
        moving = [self.skeleton.joint(name) for name in joints]
        columns, sway = np.repeat(self.columns[:1], len(self.columns), axis=0), self.sway
        columns[:, moving] = self.columns[:, moving]
        if 0 in moving:
            return replace(self, columns=columns)
        sway = np.repeat(sway[:1], len(sway), axis=0)
        return replace(self, columns=columns, sway=sway, advance=np.zeros(3), turn_rad=0.0)


def world_pose(
    skeleton: Skeleton, local: FloatArray, root_positions: FloatArray, translations: FloatArray
) -> Pose:
    """Return the world pose of joints with rotations (F, J, 3, 3) relative to their parents."""
    rotations = np.empty_like(local)
    positions = np.empty((len(local), skeleton.n_joints, 3))
    rotations[:, 0] = local[:, 0]
    positions[:, 0] = root_positions
    moved = _offsets(skeleton, translations)
    acclaim = skeleton.convention == "acclaim"
    for joint in range(1, skeleton.n_joints):
        parent = skeleton.parents[joint]
        rotations[:, joint] = rotations[:, parent] @ local[:, joint]
        carrier = joint if acclaim else parent
        positions[:, joint] = positions[:, parent] + rotations[:, carrier] @ moved[joint]
    return Pose(positions, rotations)


def to_columns(rotations: FloatArray) -> FloatArray:
    """Return the first two columns (..., 6) of rotations (..., 3, 3)."""
    return np.concatenate([rotations[..., 0], rotations[..., 1]], axis=-1)


def from_columns(columns: FloatArray) -> FloatArray:
    """Return the rotations (..., 3, 3) nearest to pairs of columns (..., 6), by Gram and Schmidt.

    After Zhou et al., "On the continuity of rotation representations in neural networks" (2019).
    """
    x, y = columns[..., :3], columns[..., 3:]
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    y = y - (x * y).sum(axis=-1, keepdims=True) * x
    y = y / np.linalg.norm(y, axis=-1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def translation_channels(skeleton: Skeleton) -> list[int]:
    """Return the translation channels of the joints other than the root."""
    first = int(skeleton.channel_starts[1]) if skeleton.n_joints > 1 else skeleton.n_channels
    return [first + i for i, name in enumerate(skeleton.channel_names[first:]) if ".t" in name[-3:]]


def mean_translations(clip: Clip) -> FloatArray:
    """Return (T,) the mean of the translation channels of the joints other than the root."""
    return np.asarray(clip.channels[:, translation_channels(clip.skeleton)].mean(axis=0))


def _offsets(skeleton: Skeleton, translations: FloatArray) -> FloatArray:
    """Return (J, 3) the offsets of the joints, with constant translation channels."""
    offsets = skeleton.offsets.copy()
    for channel, value in zip(translation_channels(skeleton), translations, strict=True):
        joint = int(np.searchsorted(skeleton.channel_starts, channel, side="right")) - 1
        axis = "xyz".index(skeleton.channel_names[channel][-1])
        offsets[joint, axis] = value + (offsets[joint, axis] if skeleton.adds_offsets else 0.0)
    return offsets


def joint_positions(cycle: Cycle) -> FloatArray:
    """Return joint positions (S, J, 3) relative to the root's, heading along the rest pose."""
    phase = np.arange(len(cycle.sway)) / len(cycle.sway)
    positions = cycle.pose(phase, "in-place").positions
    return positions - positions[:, :1]
