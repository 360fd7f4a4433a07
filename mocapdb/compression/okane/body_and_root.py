"""A representation as two matrices that are coded apart: the body's poses and the root's track."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.motion.representations import (
    Representation,
    RepresentationName,
    representation_dims,
)
from mocapdb.motion.skeleton import Skeleton

__all__ = ["BodyAndRoot", "body_columns", "join_root", "root_columns", "split_root"]


@dataclass(frozen=True)
class BodyAndRoot:
    """A clip's frames as the two matrices that are coded apart.

    Attributes
    ----------
    body : (F, D)
        Poses.
    root : (F, r)
        The track of the root, angles scaled to the length of the arc that they move the body by,
        so that one threshold fits all columns. Without columns for world positions.
    """

    body: FloatArray
    root: FloatArray

    def every(self, stride: int) -> BodyAndRoot:
        """Return every so many frames."""
        return BodyAndRoot(self.body[::stride], self.root[::stride])


def split_root(skeleton: Skeleton, representation: Representation) -> BodyAndRoot:
    """Return the body and the root track of a representation."""
    values, root = representation.values, representation.root
    if representation.name == "channels":
        n_root = root_columns(skeleton, "channels")
        values, root = values[:, n_root:], values[:, :n_root]
    return BodyAndRoot(values, root * _root_scales(skeleton, representation.name))


def join_root(skeleton: Skeleton, name: RepresentationName, parts: BodyAndRoot) -> Representation:
    """Return the representation that has these parts: the inverse of `split_root`."""
    root = parts.root / _root_scales(skeleton, name)
    if name == "channels":
        return Representation(name, np.hstack([root, parts.body]), np.empty((len(root), 0)))
    return Representation(name, parts.body, root)


def root_columns(skeleton: Skeleton, name: RepresentationName) -> int:
    """Return r, the number of columns of the root track."""
    if name == "channels":
        return len(skeleton.dofs[0])
    return 0 if name == "positions" else 4


def body_columns(skeleton: Skeleton, name: RepresentationName) -> int:
    """Return D, the number of columns of the body."""
    n_columns = representation_dims(skeleton, name)
    return n_columns - root_columns(skeleton, name) if name == "channels" else n_columns


def _root_scales(skeleton: Skeleton, name: RepresentationName) -> FloatArray:
    """Return (r,) skeleton units by which a unit of each root column moves the body."""
    places = skeleton.rest_positions
    lever = float(np.sqrt((places * places).sum(axis=1).mean())) or 1.0
    if name == "channels":
        per_degree = np.deg2rad(lever)
        return np.array([1.0 if dof[0] == "t" else per_degree for dof in skeleton.dofs[0]])
    return np.array([1.0, 1.0, 1.0, lever])[: root_columns(skeleton, name)]
