"""Clips of formats that say where joints are and how they are turned: glTF, SMPL, plain arrays.

Each joint has three angles, the root three positions, and so has every joint that moves against its
parent. What comes out is in metres, Y up, unless another unit and axis are said.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mocapdb.base.arrays import FloatArray
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose, channels_from_pose
from mocapdb.motion.skeleton import Convention, Skeleton, UpAxis

__all__ = ["clip_of_pose", "local_rotations", "world_positions", "world_rotations"]

SHIFTS = ("tx", "ty", "tz")
TURNS = ("rz", "ry", "rx")
STILL_M = 1e-5  # a joint that moves on its bone by less keeps its place


def clip_of_pose(
    names: Sequence[str],
    parents: ArrayLike,
    rest: FloatArray,
    pose: Pose,
    fps: float,
    convention: Convention = "bvh",
    *,
    unit_m: float = 1.0,
    up: UpAxis = "y",
    ends: Collection[int] = (),
    still: float = STILL_M,
    **about: Any,
) -> Clip:
    """Return the clip of a pose in the world.

    Parameters
    ----------
    names : sequence of str
    parents : (J,) array-like of int
        Parents before their children, -1 for the root.
    rest : (J, 3)
        Where joints are in the rest pose, in which all rotations are identity.
    pose : Pose
        Positions (F, J, 3), rotations (F, J, 3, 3) from the rest pose.
    fps : float, frames per second
    convention : {"bvh", "acclaim"}
        Whether a joint turns the bones that start in it, or the one that ends in it.
    unit_m : float, metres
        The unit of positions.
    up : {"y", "z"}
    ends : collection of int
        Joints that only say where a bone ends, and have no channels.
    still : float
        A joint that moves on its bone by no more keeps its place.
    **about
        What else a `Clip` is given.

    Raises
    ------
    SkeletonError
        If names or parents do not fit together.
    """
    above = np.asarray(parents, dtype=np.int64)
    offsets = np.array(rest, dtype=np.float64)
    offsets[1:] -= rest[np.maximum(above[1:], 0)]
    dofs: list[tuple[str, ...]] = [(*SHIFTS, *TURNS)]
    for joint, parent in enumerate(above[1:], start=1):
        away = pose.positions[:, joint] - pose.positions[:, parent]
        carrier = joint if convention == "acclaim" else parent
        kept = np.einsum("fij,j->fi", pose.rotations[:, carrier], offsets[joint])
        moves = float(np.abs(away - kept).max(initial=0.0)) > still
        turns = () if joint in ends else TURNS
        dofs.append((*SHIFTS, *turns) if moves else turns)
    skeleton = Skeleton(
        names,
        above,
        offsets,
        dofs,
        ["" if joint in ends else "ZYX" for joint in range(len(names))],
        convention=convention,
        metres_per_unit=unit_m,
        up=up,
        name=str(about.get("name", "")),
    )
    channels = channels_from_pose(skeleton, pose)
    about = {"unit_source": "file", "up_source": "file", "fps_source": "file"} | about
    return Clip(skeleton, channels, fps, **about)


def world_rotations(parents: Sequence[int], local: FloatArray) -> FloatArray:
    """Return the world rotations (F, J, 3, 3) of local ones."""
    world = np.array(local)
    for joint, parent in enumerate(parents):
        if parent >= 0:
            world[:, joint] = world[:, parent] @ local[:, joint]
    return world


def local_rotations(parents: Sequence[int], world: FloatArray) -> FloatArray:
    """Return the local rotations (F, J, 3, 3) of world ones."""
    local = np.array(world)
    for joint, parent in enumerate(parents):
        if parent >= 0:
            local[:, joint] = np.swapaxes(world[:, parent], -1, -2) @ world[:, joint]
    return local


def world_positions(
    parents: Sequence[int],
    offsets: FloatArray,
    root: FloatArray,
    world: FloatArray,
    convention: Convention = "bvh",
) -> FloatArray:
    """Return the positions (F, J, 3) of joints that keep their places on their parents' bones.

    Parameters
    ----------
    parents : sequence of int
    offsets : (J, 3)
    root : (F, 3)
        Where the root is.
    world : (F, J, 3, 3)
        World rotations.
    """
    positions = np.empty((*world.shape[:2], 3))
    positions[:, 0] = root
    for joint, parent in enumerate(parents):
        if parent >= 0:
            carrier = joint if convention == "acclaim" else parent
            positions[:, joint] = positions[:, parent] + world[:, carrier] @ offsets[joint]
    return positions
