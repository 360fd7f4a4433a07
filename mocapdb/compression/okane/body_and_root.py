"""A representation as two matrices that are coded apart: the body's poses and the root's track."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.targets import Target
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose, forward_kinematics
from mocapdb.motion.representations import (
    Representation,
    RepresentationName,
    represent,
    representation_dims,
    restore_channels,
)
from mocapdb.motion.rotations import continuous_angles
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import pose_error

__all__ = [
    "BodyAndRoot",
    "ErrorMeasures",
    "body_columns",
    "join_root",
    "parts_of",
    "root_columns",
    "split_root",
]


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


def parts_of(clip: Clip, name: RepresentationName) -> BodyAndRoot:
    """Return the parts of a clip, its Euler angles such that they do not jump to another form."""
    skeleton = clip.skeleton
    channels = clip.channels.copy()
    for joint, order in enumerate(skeleton.rotation_orders):
        if order:
            columns = skeleton.rotation_columns(joint)
            angles_rad = np.deg2rad(channels[:, columns])
            channels[:, columns] = np.rad2deg(continuous_angles(order, angles_rad))
    return split_root(skeleton, represent(clip.replace(channels=channels), name))


class ErrorMeasures:
    """Measures parts against a clip, on every so many frames; what can be kept is.

    Parameters
    ----------
    clip : Clip
    name : {"channels", "positions", "aligned", "scaled", "normalised"}
    """

    def __init__(self, clip: Clip, name: RepresentationName) -> None:
        self._clip = clip
        self._name = name
        self._originals: dict[int, Pose] = {}

    def every(self, target: Target, stride: int = 1) -> Callable[[BodyAndRoot], float]:
        """Return a function that measures parts, already of every so many frames."""
        skeleton = self._clip.skeleton
        if stride not in self._originals:
            self._originals[stride] = forward_kinematics(skeleton, self._clip.channels[::stride])
        original = self._originals[stride]

        def error_of(parts: BodyAndRoot) -> float:
            channels = restore_channels(skeleton, join_root(skeleton, self._name, parts))
            pose = forward_kinematics(skeleton, channels)
            return target.measure(pose_error(skeleton, original, pose, points=target.points))

        return error_of


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
        return Representation(
            name, np.hstack([root, parts.body]), np.empty((len(root), 0)), skeleton
        )
    return Representation(name, parts.body, root, skeleton)


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
