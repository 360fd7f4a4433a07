"""Where the joints of a clip are and how they turn, in the units and axes that are asked for.

What `Clip.positions`, `Clip.rotations` and `Clip.velocities` return is made here. Of a skeleton
whose vertical axis is another than the one asked for, the rest pose is turned with the motion:
x stays, and of y and z one becomes the other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.motion.kinematics import axis_rotations, forward_kinematics
from mocapdb.motion.quaternions import conjugate, continuous, from_euler_deg, multiply
from mocapdb.motion.skeleton import Skeleton

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = [
    "RotationForm",
    "RotationSpace",
    "Units",
    "VerticalAxis",
    "in_units",
    "joint_positions",
    "joint_rotations",
    "joint_velocities",
    "local_quaternions",
    "turn_to",
]

Units: TypeAlias = Literal["m", "cm", "mm", "in", "ft", "file"]
VerticalAxis: TypeAlias = Literal["y", "z", "file"]
RotationSpace: TypeAlias = Literal["local", "global"]
RotationForm: TypeAlias = Literal["quat_xyzw", "quat_wxyz", "matrix", "6d", "rotvec", "scipy"]

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
Z_TO_Y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def turn_to(skeleton: Skeleton, up: VerticalAxis) -> FloatArray | None:
    """Return the rotation (3, 3) from a skeleton's axes to those asked for; None where it is none.

    Raises
    ------
    SkeletonError
        If the vertical axis is none of y, z and file.
    """
    if up not in get_args(VerticalAxis):
        raise SkeletonError(f"Expected up 'y', 'z' or 'file', but got {up!r}.")
    if up in ("file", skeleton.up):
        return None
    return Z_TO_Y if up == "y" else Z_TO_Y.T


def in_units(
    skeleton: Skeleton, vectors: FloatArray, units: Units = "m", up: VerticalAxis = "y"
) -> FloatArray:
    """Return vectors (..., 3) of a skeleton's own units and axes in others.

    Raises
    ------
    SkeletonError
        If the unit or the axis is unknown.
    """
    if units not in get_args(Units):
        raise SkeletonError(
            f"Expected units out of {', '.join(get_args(Units))}, but got {units!r}."
        )
    turn = turn_to(skeleton, up)
    turned = vectors if turn is None else vectors @ turn.T
    if units == "file":
        return np.array(turned)
    return np.asarray(turned * (skeleton.metres_per_unit / METRES[units]))


def joint_positions(
    skeleton: Skeleton, channels: FloatArray, units: Units = "m", up: VerticalAxis = "y"
) -> FloatArray:
    """Return the positions (F, J, 3) of all joints in the world."""
    return in_units(skeleton, forward_kinematics(skeleton, channels).positions, units, up)


def joint_velocities(positions: FloatArray, fps: float) -> FloatArray:
    """Return the velocities (F, J, 3) of positions (F, J, 3), in their units a second.

    Central differences; one-sided ones in the first and the last frame.

    Raises
    ------
    ClipError
        If there is one frame only.
    """
    if len(positions) < 2:
        raise ClipError("Expected at least two frames to have a velocity, but got one.")
    return np.asarray(np.gradient(positions, 1.0 / fps, axis=0))


def local_quaternions(skeleton: Skeleton, channels: FloatArray) -> FloatArray:
    """Return (F, J, 4) the rotation of each joint in its parent's frame, xyzw, as the file has it.

    Those of a joint that does not turn are (0, 0, 0, 1).
    """
    quats = np.zeros((len(channels), skeleton.n_joints, 4))
    quats[..., 3] = 1.0
    axes = axis_rotations(skeleton)
    for joint in skeleton.rotating_joints:
        angles = channels[:, skeleton.rotation_columns(joint)]
        turns = from_euler_deg(skeleton.rotation_orders[joint], angles)
        if skeleton.axis_deg[joint].any():
            axis = _quaternion(axes[joint])
            turns = multiply(multiply(axis, turns), conjugate(axis))
        quats[:, joint] = turns
    return quats


def joint_rotations(
    skeleton: Skeleton,
    channels: FloatArray,
    space: RotationSpace = "local",
    form: RotationForm = "quat_xyzw",
    up: VerticalAxis = "y",
) -> FloatArray | Rotation:
    """Return the rotations of all joints; see `Clip.rotations`.

    Raises
    ------
    SkeletonError
        If the space, the form or the axis is unknown.
    """
    if space not in get_args(RotationSpace):
        raise SkeletonError(f"Expected space 'local' or 'global', but got {space!r}.")
    if form not in get_args(RotationForm):
        raise SkeletonError(
            f"Expected a form out of {', '.join(get_args(RotationForm))}, but got {form!r}."
        )
    quats = local_quaternions(skeleton, channels)
    if space == "global":
        for joint, parent in enumerate(skeleton.parents[1:], start=1):
            quats[:, joint] = multiply(quats[:, parent], quats[:, joint])
    turn = turn_to(skeleton, up)
    if turn is not None:
        quats[..., :3] = quats[..., :3] @ turn.T  # G R G^T turns about the axis G a
    return _in_form(continuous(quats), form)


def _in_form(quats: FloatArray, form: RotationForm) -> FloatArray | Rotation:
    """Return quaternions (F, J, 4) in another form."""
    if form == "quat_xyzw":
        return quats
    if form == "quat_wxyz":
        return quats[..., [3, 0, 1, 2]]
    from scipy.spatial.transform import Rotation

    turns: Any = Rotation.from_quat(quats.reshape(-1, 4))
    if form == "scipy":
        return turns
    shape = quats.shape[:2]
    if form == "rotvec":
        return np.asarray(turns.as_rotvec().reshape(*shape, 3))
    matrices = turns.as_matrix().reshape(*shape, 3, 3)
    if form == "matrix":
        return np.asarray(matrices)
    return np.asarray(np.swapaxes(matrices[..., :2], -1, -2).reshape(*shape, 6))


def _quaternion(matrix: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(matrix).as_quat())
