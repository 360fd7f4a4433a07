"""Unit quaternions as arrays, xyzw as in scipy: what runs over all frames and joints at once.

`scipy.spatial.transform.Rotation` does the same for a few; these are faster on whole clips, take
any leading axes, and keep single precision where they are given it.
"""

from __future__ import annotations

import numpy as np

from mocapdb.base.arrays import Float32Array, FloatArray

__all__ = [
    "angles_deg",
    "conjugate",
    "continuous",
    "from_euler_deg",
    "from_matrices",
    "from_rotation_vectors_deg",
    "multiply",
    "rotation_vectors_deg",
    "slerp",
]


def from_euler_deg(order: str, angles_deg: FloatArray) -> FloatArray:
    """Return (F, 4) the products of rotations about axes; scipy's are the same, more slowly."""
    half = np.deg2rad(angles_deg) / 2.0
    product = np.zeros((len(half), 4))
    for i, axis in enumerate(order):
        turn = np.zeros_like(product)
        turn[:, "XYZ".index(axis)], turn[:, 3] = np.sin(half[:, i]), np.cos(half[:, i])
        product = turn if i == 0 else multiply(product, turn)
    return product


def from_matrices(matrices: FloatArray) -> FloatArray:
    """Return the unit quaternions (..., 4) of rotation matrices (..., 3, 3), w not negative.

    By the largest of the four parts, so that nothing is divided by a small number (Shepperd 1978).
    """
    m = np.moveaxis(matrices.reshape(-1, 3, 3), 0, -1)
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = m
    products = np.array(  # four times each part times each other
        [
            [1 + xx - yy - zz, yx + xy, zx + xz, zy - yz],
            [yx + xy, 1 - xx + yy - zz, zy + yz, xz - zx],
            [zx + xz, zy + yz, 1 - xx - yy + zz, yx - xy],
            [zy - yz, xz - zx, yx - xy, 1 + xx + yy + zz],
        ]
    )
    largest = np.einsum("iin->in", products).argmax(axis=0)
    quats = np.take_along_axis(products, largest[None, None], axis=0)[0].T
    quats = quats / np.linalg.norm(quats, axis=1, keepdims=True)
    quats = np.where(quats[:, 3:] < 0, -quats, quats)
    return np.asarray(quats.reshape(*matrices.shape[:-2], 4))


def slerp(
    a: FloatArray | Float32Array, b: FloatArray | Float32Array, weight: FloatArray
) -> FloatArray:
    """Return quaternions (..., 4) on the shorter arcs from `a` to `b`; weights broadcast."""
    dot = np.sum(a * b, axis=-1)
    b = np.where(dot[..., None] < 0, -b, b)
    angle = np.arccos(np.clip(np.abs(dot), 0.0, 1.0))
    sine = np.sin(angle)
    small = sine < 1e-6
    sine = np.where(small, 1.0, sine)
    first = np.where(small, 1.0 - weight, np.sin((1.0 - weight) * angle) / sine)
    second = np.where(small, weight, np.sin(weight * angle) / sine)
    mixed = first[..., None] * a + second[..., None] * b
    return np.asarray(mixed / np.linalg.norm(mixed, axis=-1, keepdims=True))


def multiply(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the products of quaternions (..., 4)."""
    ax, ay, az, aw = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bx, by, bz, bw = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    x = aw * bx + ax * bw + ay * bz - az * by
    product = np.empty((*np.shape(x), 4), dtype=x.dtype)
    product[..., 0] = x
    product[..., 1] = aw * by - ax * bz + ay * bw + az * bx
    product[..., 2] = aw * bz + ax * by - ay * bx + az * bw
    product[..., 3] = aw * bw - ax * bx - ay * by - az * bz
    return product


def conjugate(a: FloatArray) -> FloatArray:
    """Return the inverses of unit quaternions (..., 4)."""
    return np.asarray(a * np.array([-1.0, -1.0, -1.0, 1.0]))


def rotation_vectors_deg(quats: FloatArray) -> FloatArray:
    """Return the rotation vectors (..., 3) of unit quaternions, up to half a turn, in degrees."""
    quats = np.where(quats[..., 3:] < 0, -quats, quats)
    sine = np.linalg.norm(quats[..., :3], axis=-1)
    angle = 2.0 * np.arctan2(sine, quats[..., 3])
    scale = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)
    return np.asarray(np.rad2deg(scale)[..., None] * quats[..., :3])


def from_rotation_vectors_deg(vectors_deg: FloatArray) -> FloatArray:
    """Return the unit quaternions (..., 4) of rotation vectors in degrees."""
    half = np.deg2rad(vectors_deg) / 2.0
    angle = np.linalg.norm(half, axis=-1, keepdims=True)
    return np.concatenate([half * np.sinc(angle / np.pi), np.cos(angle)], axis=-1)


def angles_deg(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the angles between rotations given as quaternions (..., 4), in degrees."""
    return np.asarray(np.linalg.norm(rotation_vectors_deg(multiply(conjugate(a), b)), axis=-1))


def continuous(quats: FloatArray) -> FloatArray:
    """Return (F, K, 4) the same rotations, each in the hemisphere of the frame before."""
    turned = np.sum(quats[1:] * quats[:-1], axis=-1) < 0
    signs = np.where(np.cumsum(turned, axis=0) % 2 == 1, -1.0, 1.0)
    quats[1:] *= signs[..., None]
    return quats
