"""Rotation matrices from Euler angles, and continuous Euler angles from rotation matrices.

Orders name the axes outermost first: ``"ZYX"`` is ``Rz @ Ry @ Rx`` (scipy's intrinsic notation).
"""

from __future__ import annotations

import math

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.base.kernels import jit

__all__ = [
    "basis_along",
    "change_orders",
    "continuous_angles",
    "elementary",
    "extract_angles",
    "make_continuous",
    "nearest_angles",
]


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
    axes = np.array(["XYZ".index(axis) for axis in order])
    angles = np.empty((len(rotations), len(axes)))
    extract = (_extract_one, _extract_two, _extract_three)[len(axes) - 1]
    extract(np.ascontiguousarray(rotations), axes, angles)
    return angles


def continuous_angles(
    order: str, angles_rad: FloatArray, before: FloatArray | None = None
) -> FloatArray:
    """Return equivalent angles without jumps: each frame the ones nearest the frame before.

    Parameters
    ----------
    order : str
        The axes of the columns, outermost first.
    angles_rad : (F, len(order)) radians
    before : (len(order),) radians, optional
        The angles of the frame before the first, which by default stays as it is.

    Notes
    -----
    Three angles (x, y, z) have one other form, (x + pi, pi - y, z + pi), and every angle is
    defined up to full turns.
    """
    angles = np.array(angles_rad, dtype=np.float64)
    if len(angles):
        start = angles[0] if before is None else np.asarray(before, dtype=np.float64)
        make_continuous(angles, start.copy(), np.pi)
    return angles


@jit
def make_continuous(angles: FloatArray, before: FloatArray, half_turn: float) -> None:
    """Replace angles by equivalent ones without jumps: `continuous_angles` in place, in any unit.

    Parameters
    ----------
    angles : (F, n)
    before : (n,)
        The angles of the frame before the first; afterwards those of the last.
    half_turn : float
        Pi or 180.
    """
    turn = 2.0 * half_turn
    other = np.empty(3)
    for f in range(len(angles)):
        here = angles[f]
        if len(before) == 3:
            other[0], other[1] = here[0] + half_turn, half_turn - here[1]
            other[2] = here[2] + half_turn
            stay, change = 0.0, 0.0
            for i in range(3):
                away = here[i] - before[i]
                stay += abs(away - turn * np.rint(away / turn))
                away = other[i] - before[i]
                change += abs(away - turn * np.rint(away / turn))
            if change < stay:
                for i in range(3):  # a slice would take a second to compile
                    here[i] = other[i]
        for i in range(len(before)):
            here[i] -= turn * np.rint((here[i] - before[i]) / turn)
            before[i] = here[i]


def nearest_angles(angles_deg: FloatArray, wanted_deg: FloatArray) -> FloatArray:
    """Return of the equivalent forms of three angles (F, 3) those nearest to others, in degrees.

    Examples
    --------
    >>> nearest_angles(np.array([[-170.0, 80.0, 190.0]]), np.array([[10.0, 100.0, 370.0]])).tolist()
    [[10.0, 100.0, 370.0]]
    """
    others = np.stack(
        [angles_deg[:, 0] + 180.0, 180.0 - angles_deg[:, 1], angles_deg[:, 2] + 180.0], axis=1
    )
    forms = np.stack([angles_deg, others])
    away = forms - wanted_deg
    away -= 360.0 * np.rint(away / 360.0)
    best = np.abs(away).sum(axis=2).argmin(axis=0)
    return np.asarray(wanted_deg + away[best, np.arange(len(angles_deg))])


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


def _other_axes(axis: int) -> tuple[int, int]:
    return (axis + 1) % 3, (axis + 2) % 3


@jit
def _extract_one(rotations: FloatArray, axes: IntArray, angles: FloatArray) -> None:
    """Find the angle of the rotation about one axis that is nearest in the Frobenius norm."""
    a, b = (axes[0] + 1) % 3, (axes[0] + 2) % 3
    for f in range(len(rotations)):
        m = rotations[f]
        angles[f, 0] = math.atan2(m[b, a] - m[a, b], m[a, a] + m[b, b])


@jit
def _extract_two(rotations: FloatArray, axes: IntArray, angles: FloatArray) -> None:
    """R_a(x) R_b(y) leaves e_b turned by x alone, and its transpose leaves e_a turned by -y."""
    outer, inner = axes[0], axes[1]
    third = 3 - outer - inner
    sign = 1.0 if (inner - outer) % 3 == 1 else -1.0
    for f in range(len(rotations)):
        m = rotations[f]
        angles[f, 0] = math.atan2(sign * m[third, inner], m[inner, inner])
        angles[f, 1] = math.atan2(sign * m[outer, third], m[outer, outer])


@jit
def _extract_three(rotations: FloatArray, axes: IntArray, angles: FloatArray) -> None:
    """Near gimbal lock x is noise, so z is measured after undoing x and y exactly."""
    outer, middle, inner = axes[0], axes[1], axes[2]
    sign = 1.0 if (middle - outer) % 3 == 1 else -1.0
    for f in range(len(rotations)):
        m = rotations[f]
        sine = sign * m[outer, inner]
        cosine = math.hypot(m[outer, outer], m[outer, middle])
        x = math.atan2(-sign * m[middle, inner], m[inner, inner])
        y = math.atan2(sine, cosine)
        # of the axis that is left alone by z, only the two columns that z mixes are needed:
        # the middle row of R_a(-x) m, which y does not touch, is (sin z, cos z) in them
        cos_x, sin_x = math.cos(x), math.sin(x)
        sine_z = cos_x * m[middle, outer] + sign * sin_x * m[inner, outer]
        cosine_z = cos_x * m[middle, middle] + sign * sin_x * m[inner, middle]
        angles[f, 0] = x
        angles[f, 1] = y
        angles[f, 2] = math.atan2(sign * sine_z, cosine_z)


@jit
def change_orders(changes: IntArray, values_deg: FloatArray, changed_deg: FloatArray) -> None:
    """Write the angles of the same rotations in other orders of their three axes.

    Parameters
    ----------
    changes : (n, 4, 3)
        For each rotation the columns of its angles and their axes, outermost first; then the
        columns to write, and the axes wanted.
    values_deg, changed_deg : (F, C) degrees
        Read, and written; not the same array.
    """
    rotations = np.empty((len(values_deg), 3, 3))
    found = np.empty((len(values_deg), 3))
    for n in range(len(changes)):
        for f in range(len(values_deg)):
            m = rotations[f]
            for i in range(3):
                for j in range(3):
                    m[i, j] = 1.0 if i == j else 0.0
            for k in range(3):
                angle = math.radians(values_deg[f, changes[n, 0, k]])
                cosine, sine = math.cos(angle), math.sin(angle)
                a, b = (changes[n, 1, k] + 1) % 3, (changes[n, 1, k] + 2) % 3
                for i in range(3):
                    m[i, a], m[i, b] = (
                        cosine * m[i, a] + sine * m[i, b],
                        cosine * m[i, b] - sine * m[i, a],
                    )
        _extract_three(rotations, changes[n, 3], found)
        for f in range(len(values_deg)):
            for k in range(3):
                changed_deg[f, changes[n, 2, k]] = math.degrees(found[f, k])
