"""Rotation matrices from Euler angles, and continuous Euler angles from rotation matrices.

Orders name the axes outermost first: ``"ZYX"`` is ``Rz @ Ry @ Rx`` (scipy's intrinsic notation).
"""

from __future__ import annotations

import numpy as np

from mocapdb._typing import FloatArray

__all__ = ["basis_along", "continuous_angles", "elementary", "extract_angles"]


def elementary(axis: str, angle_rad: FloatArray) -> FloatArray:
    """Return the rotations (F, 3, 3) about one coordinate axis ``"X"``, ``"Y"`` or ``"Z"``."""
    first, second = _other_axes("XYZ".index(axis))
    matrix = np.zeros((*np.shape(angle_rad), 3, 3))
    matrix[..., [0, 1, 2], [0, 1, 2]] = 1.0
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    matrix[..., first, first] = cosine
    matrix[..., second, second] = cosine
    matrix[..., first, second] = -sine
    matrix[..., second, first] = sine
    return matrix


def extract_angles(order: str, rotations: FloatArray) -> FloatArray:
    """Return angles whose elementary rotations multiply to the given rotations.

    Parameters
    ----------
    order : str
        One to three different axes, outermost first.
    rotations : (F, 3, 3)

    Returns
    -------
    (F, len(order)) radians
        In (-pi, pi]; of three, the middle one in [-pi/2, pi/2]. With one axis the nearest
        rotation about it; with two, exact where the rotation is a product of the two, else close
        to the nearest such product.
    """
    axes = ["XYZ".index(axis) for axis in order]
    if len(axes) == 1:
        return _angle_about(axes[0], rotations)[:, None]
    outer, inner = axes[0], axes[-1]
    sign = 1.0 if (inner - outer) % 3 == 1 else -1.0
    if len(axes) == 2:
        # R_a(x) R_b(y) leaves e_b turned by x alone, and its transpose leaves e_a turned by -y
        third = 3 - outer - inner
        x = np.arctan2(sign * rotations[:, third, inner], rotations[:, inner, inner])
        y = np.arctan2(sign * rotations[:, outer, third], rotations[:, outer, outer])
        return np.stack([x, y], axis=1)
    middle = axes[1]
    sign = 1.0 if (middle - outer) % 3 == 1 else -1.0
    sine = sign * rotations[:, outer, inner]
    cosine = np.hypot(rotations[:, outer, outer], rotations[:, outer, middle])
    x = np.arctan2(-sign * rotations[:, middle, inner], rotations[:, inner, inner])
    # near gimbal lock x is noise, so the inner angle is measured after undoing x and y exactly
    y = np.arctan2(sine, cosine)
    done = elementary(order[0], x) @ elementary(order[1], y)
    z = _angle_about(inner, np.swapaxes(done, -1, -2) @ rotations)
    return np.stack([x, y, z], axis=1)


def continuous_angles(order: str, angles_rad: FloatArray) -> FloatArray:
    """Return equivalent angles without jumps: each frame the ones nearest the frame before.

    Parameters
    ----------
    order : str
        The axes of the columns, outermost first.
    angles_rad : (F, len(order)) radians

    Notes
    -----
    Three angles (x, y, z) have one other form, (x + pi, pi - y, z + pi), and every angle is
    defined up to full turns. Changing both of two frames to their other form keeps their
    distance, so whether to change form between two frames does not depend on the frames before.
    """
    angles = np.array(angles_rad, dtype=np.float64)
    if angles.shape[1] == 3 and len(angles) > 1:
        other = np.stack([angles[:, 0] + np.pi, np.pi - angles[:, 1], angles[:, 2] + np.pi], 1)
        stay = np.abs(_wrapped(np.diff(angles, axis=0))).sum(axis=1)
        change = np.abs(_wrapped(other[1:] - angles[:-1])).sum(axis=1)
        in_other_form = np.cumsum(change < stay) % 2 == 1
        angles[1:][in_other_form] = other[1:][in_other_form]
    return np.unwrap(angles, axis=0)


def basis_along(direction: FloatArray) -> FloatArray:
    """Return a rotation (3, 3) whose x axis lies along a direction of any length but zero.

    The smallest such rotation for a direction in the half space of positive x; for the others,
    half a turn before that, so that nothing is ever divided by a small number.
    """
    x = direction / np.linalg.norm(direction)
    if x[0] < 0.0:
        return np.asarray(basis_along(-x) @ np.diag([-1.0, -1.0, 1.0]))
    v = np.array([0.0, -x[2], x[1]])  # e_x cross x
    cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + x[0]))


def _angle_about(axis: int, rotations: FloatArray) -> FloatArray:
    """Return the angle of the rotation about one axis that is nearest in the Frobenius norm."""
    first, second = _other_axes(axis)
    return np.asarray(
        np.arctan2(
            rotations[:, second, first] - rotations[:, first, second],
            rotations[:, first, first] + rotations[:, second, second],
        )
    )


def _other_axes(axis: int) -> tuple[int, int]:
    return (axis + 1) % 3, (axis + 2) % 3


def _wrapped(angles_rad: FloatArray) -> FloatArray:
    return np.asarray((angles_rad + np.pi) % (2 * np.pi) - np.pi)
