"""The five representations of a clip, each with its exact inverse (O'Kane 2008, section 3.2.1).

==============  ============  =====================================================================
name            dims for CMU  what a frame holds
==============  ============  =====================================================================
``channels``    62            degrees and skeleton units, as read
``positions``   183           world joint positions, and an axis for each joint's frame
``aligned``     183           positions without the root's translation and yaw (the root track)
``scaled``      183           aligned, in units of the body's height
``normalised``  183           aligned, with every body's bones brought to one set of lengths
==============  ============  =====================================================================

A joint's frame has its x axis along a bone, so x follows from two positions; y is stored and z is
their cross product. Where no bone shows x (a bone of zero length, a joint without a child), x is
stored as well. A root that a rigid child follows needs no frame of its own.

The root is the body's (`Skeleton.body_root`). The joints above it, the scene's, stay in the world
whatever the representation, so that those that stand still cost nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, Protocol, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.base.kernels import jit
from mocapdb.errors import SkeletonError
from mocapdb.motion.heading import heading_angles
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.rotations import basis_along, elementary
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "REPRESENTATIONS",
    "UNIVERSAL_BONES_M",
    "Motion",
    "Representation",
    "RepresentationName",
    "represent",
    "representation_dims",
    "restore_channels",
    "restore_pose",
    "shown_by_columns",
]

RepresentationName: TypeAlias = Literal["channels", "positions", "aligned", "scaled", "normalised"]
REPRESENTATIONS: tuple[RepresentationName, ...] = get_args(RepresentationName)

UNIVERSAL_HEIGHT_M = 1.75
_STATURE_SHARES = {
    "hipjoint": 0.052,
    "femur": 0.245,
    "tibia": 0.246,
    "foot": 0.076,
    "toes": 0.040,
    "lowerback": 0.070,
    "upperback": 0.070,
    "thorax": 0.070,
    "lowerneck": 0.052,
    "upperneck": 0.052,
    "head": 0.060,
    "clavicle": 0.117,
    "humerus": 0.186,
    "radius": 0.146,
    "wrist": 0.036,
    "hand": 0.036,
    "fingers": 0.036,
    "thumb": 0.040,
}
UNIVERSAL_BONES_M: Mapping[str, float] = {
    side + bone: share * UNIVERSAL_HEIGHT_M
    for bone, share in _STATURE_SHARES.items()
    for side in ("", "l", "r")
}
"""Bone lengths of the universal body by CMU's joint names, in metres.

Shares of stature after Drillis and Contini (1966), as tabulated by Winter, *Biomechanics and Motor
Control of Human Movement* (2009), table 4.1; the spine, neck and hand are split evenly.
"""


class Motion(Protocol):
    """What is represented: a skeleton, and its channels over time. A `Clip` is one."""

    @property
    def skeleton(self) -> Skeleton:
        """What moves."""

    @property
    def channels(self) -> FloatArray:
        """How, (F, C)."""


@dataclass(frozen=True, eq=False)
class Representation:
    """A clip's frames in one representation.

    Attributes
    ----------
    name : str
        Which of `REPRESENTATIONS`.
    values : (F, D)
        One row a frame. Degrees and skeleton units for channels; skeleton units and unit axes
        for positions, aligned and normalised; body heights for scaled.
    root : (F, 4) or (F, 0)
        What alignment took out: translation in skeleton units and yaw in radians.
    skeleton : Skeleton
        The one that `restore_channels` needs.
    """

    name: RepresentationName
    values: FloatArray
    root: FloatArray
    skeleton: Skeleton

    @property
    def columns(self) -> tuple[str, ...]:
        """The D names of the values: ``"lfemur.x"`` of a position, ``"lfemur.y_axis.x"``."""
        return _columns(self.skeleton, self.name)[0]

    @property
    def units(self) -> tuple[str, ...]:
        """The D units: ``"deg"``, ``"1"`` of axes, ``"m"``, or a length such as ``"0.0254 m"``."""
        return _columns(self.skeleton, self.name)[1]

    @property
    def root_columns(self) -> tuple[str, ...]:
        """The names of the root track's columns."""
        return ("tx", "ty", "tz", "yaw")[: self.root.shape[1]]

    @property
    def root_units(self) -> tuple[str, ...]:
        """The units of the root track's columns."""
        length = _length_unit(self.skeleton)
        return (length, length, length, "rad")[: self.root.shape[1]]

    def restore(self) -> FloatArray:
        """Return the (F, C) channels that it came from; see `restore_channels`."""
        return restore_channels(self.skeleton, self)

    def __repr__(self) -> str:
        track = f", root track {self.root.shape}" if self.root.size else ""
        n_frames, n_columns = self.values.shape
        return f"Representation({self.name}: {n_frames} frames x {n_columns}{track})"


def represent(clip: Motion, name: RepresentationName) -> Representation:
    """Return the frames of a clip in one representation.

    Raises
    ------
    SkeletonError
        If there is no representation of that name.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> aligned = represent(synthetic.make_clip("walk", seed=1, duration_s=1.0), "aligned")
    >>> aligned
    Representation(aligned: 120 frames x 183, root track (120, 4))
    >>> aligned.columns[3:6], aligned.units[3]
    (('lhipjoint.x', 'lhipjoint.y', 'lhipjoint.z'), '0.0564444 m')
    """
    if name not in REPRESENTATIONS:
        raise SkeletonError(
            f"Expected a representation out of {', '.join(REPRESENTATIONS)}, but got {name!r}."
        )
    skeleton = clip.skeleton
    no_root = np.empty((len(clip.channels), 0))
    if name == "channels":
        return Representation(name, clip.channels, no_root, skeleton)
    positions, rotations = forward_kinematics(skeleton, clip.channels)
    if name == "positions":
        return Representation(name, _values(skeleton, positions, rotations), no_root, skeleton)

    translation = positions[:, skeleton.body_root].copy()
    yaw = heading_angles(rotations[:, skeleton.body_root], skeleton.up_index)
    back = elementary(skeleton.up_axis, -yaw)[:, None]
    world = Pose(positions, rotations)
    positions = (back @ (positions - translation[:, None])[..., None])[..., 0]
    rotations = back @ rotations
    _leave_scene(skeleton, Pose(positions, rotations), world)
    if name == "normalised":
        positions = _lengthened(skeleton, positions, _normalising_ratios(skeleton))
    values = _values(skeleton, positions, rotations)
    if name == "scaled":
        values /= _height(skeleton)
    return Representation(name, values, np.column_stack([translation, yaw]), skeleton)


def restore_channels(skeleton: Skeleton, representation: Representation) -> FloatArray:
    """Return the (F, C) channels that a representation came from.

    Exact for what `represent` made. Values that a codec has changed are first made a pose again:
    axes orthonormal, bones of the skeleton's own lengths.
    """
    if representation.name == "channels":
        return representation.values
    return channels_from_pose(skeleton, restore_pose(skeleton, representation))


def restore_pose(skeleton: Skeleton, representation: Representation) -> Pose:
    """Return world positions (F, J, 3) and rotations (F, J, 3, 3) of a representation.

    The positions are those of the values, so that after lossy coding bones may have changed
    their lengths; `restore_channels` then keeps only their directions.
    """
    name, values, root = representation.name, representation.values, representation.root
    if name == "channels":
        return forward_kinematics(skeleton, values)
    if name == "scaled":
        values = values * _height(skeleton)
    positions = values[:, : 3 * skeleton.n_joints].reshape(len(values), -1, 3)
    if name == "normalised":
        positions = _lengthened(skeleton, positions, 1.0 / _normalising_ratios(skeleton))
    rotations = _rotations(skeleton, positions, values[:, 3 * skeleton.n_joints :])
    if name != "positions":
        forth = elementary(skeleton.up_axis, root[:, 3])[:, None]
        local = Pose(positions, rotations)
        rotations = forth @ rotations
        positions = (forth @ positions[..., None])[..., 0] + root[:, None, :3]
        _leave_scene(skeleton, Pose(positions, rotations), local)
    return Pose(positions, rotations)


def _leave_scene(skeleton: Skeleton, moved: Pose, before: Pose) -> None:
    """Put the joints of the scene back to where they were before."""
    scene = list(skeleton.scene_joints)
    moved.positions[:, scene] = before.positions[:, scene]
    moved.rotations[:, scene] = before.rotations[:, scene]


def representation_dims(skeleton: Skeleton, name: RepresentationName) -> int:
    """Return D, the number of values that a frame has in a representation."""
    if name == "channels":
        return skeleton.n_channels
    return 3 * skeleton.n_joints + int(_layout(skeleton).sizes.sum())


@lru_cache(maxsize=64)
def shown_by_columns(skeleton: Skeleton, name: RepresentationName) -> BoolArray:
    """Return which columns show how each joint turns and shifts in its parent's frame.

    Returns
    -------
    (2, J, D) of bool
        Of rotations those that hold its own frame, of translations also its position and its
        parent's. What the frames above it add to its local rotation is left out.
    """
    shown = np.zeros((2, skeleton.n_joints, representation_dims(skeleton, name)), dtype=bool)
    if name == "channels":
        for joint, dofs in enumerate(skeleton.dofs):
            start = int(skeleton.channel_starts[joint])
            for i, dof in enumerate(dofs):
                shown[int(dof[0] == "t"), joint, start + i] = True
        return shown
    layout = _layout(skeleton)
    frames = np.zeros(shown.shape[1:], dtype=bool)  # what shows a joint's frame in the world
    column = 3 * skeleton.n_joints
    for joint, tail, head, size in zip(
        layout.joints, layout.tails, layout.heads, layout.sizes, strict=True
    ):
        frames[joint, column : column + size] = True
        column += int(size)
        for end in (tail, head) if tail >= 0 else ():
            frames[joint, 3 * end : 3 * end + 3] = True
    frames = frames[layout.followed]
    shown[0] = frames
    for joint, parent in enumerate(skeleton.parents):
        shown[1, joint, 3 * joint : 3 * joint + 3] = True
        if parent >= 0:
            shown[1, joint] |= frames[parent]
            shown[1, joint, 3 * parent : 3 * parent + 3] = True
    return shown


@lru_cache(maxsize=256)
def _columns(
    skeleton: Skeleton, name: RepresentationName
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names and the units of the columns of a representation."""
    length = "body heights" if name == "scaled" else _length_unit(skeleton)
    if name == "channels":
        kinds = [dof[0] for dofs in skeleton.dofs for dof in dofs]
        return skeleton.channel_names, tuple("deg" if kind == "r" else length for kind in kinds)
    columns = [f"{joint}.{axis}" for joint in skeleton.names for axis in "xyz"]
    units = [length] * len(columns)
    layout = _layout(skeleton)
    for joint, size in zip(layout.joints, layout.sizes, strict=True):
        for side in ("x_axis", "y_axis")[-(size // 3) :]:
            columns += [f"{skeleton.names[joint]}.{side}.{axis}" for axis in "xyz"]
    units += ["1"] * (len(columns) - len(units))
    return tuple(columns), tuple(units)


def _length_unit(skeleton: Skeleton) -> str:
    """Return a skeleton's unit in metres, as text."""
    metres = skeleton.metres_per_unit
    return "m" if metres == 1.0 else f"{metres:.6g} m"


# -- joint frames --------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Layout:
    """Which joints store a frame, how, and who follows whom.

    Attributes
    ----------
    joints : (N,) joints that store a frame
    tails, heads : (N,) joints that the frame's bone runs from and to; tail -1 where there is none
    sizes : (N,) 3 where x follows from the bone, 6 where x is stored too
    bases : (N, 3, 3) the frame in the joint's own coordinates
    followed : (J,) the joint whose rotation each joint shares (itself where it stores a frame)
    """

    joints: IntArray
    tails: IntArray
    heads: IntArray
    sizes: IntArray
    bases: FloatArray
    followed: IntArray


@lru_cache(maxsize=256)
def _layout(skeleton: Skeleton) -> _Layout:
    """Decide for every joint how its rotation is stored.

    A rigid joint without a bone follows its parent; a BVH's End Site has no rotation at all.
    """
    joints, tails, heads, sizes, bases = [], [], [], [], []
    followed = np.arange(skeleton.n_joints)
    for joint in range(skeleton.n_joints):
        turns = bool(skeleton.rotation_orders[joint])
        bone = _bone_of(skeleton, joint)
        if joint == 0 and bone is None:
            rigid = [
                child
                for child in skeleton.children[0]
                if not skeleton.rotation_orders[child] and _bone_of(skeleton, child)
            ]
            if rigid:
                followed[0] = rigid[0]
                continue
        scene = skeleton.scene_joints
        leaves_scene = skeleton.parents[joint] in scene and joint not in scene
        if bone is None and not turns and not leaves_scene:
            if joint > 0:
                followed[joint] = followed[skeleton.parents[joint]]
            continue
        joints.append(joint)
        tail, head = bone if bone is not None else (-1, joint)
        tails.append(tail)
        heads.append(head)
        sizes.append(6 if bone is None else 3)
        bases.append(np.eye(3) if bone is None else basis_along(skeleton.offsets[head]))
    return _Layout(
        joints=np.array(joints, dtype=np.int64),
        tails=np.array(tails, dtype=np.int64),
        heads=np.array(heads, dtype=np.int64),
        sizes=np.array(sizes, dtype=np.int64),
        bases=np.array(bases, dtype=np.float64).reshape(-1, 3, 3),
        followed=followed,
    )


def _bone_of(skeleton: Skeleton, joint: int) -> tuple[int, int] | None:
    """Return (from, to) of a rigid bone of some length that turns with a joint, if there is one.

    A bone that starts in the scene shows no direction: its ends are in different coordinates.
    """
    ends = (joint,) if skeleton.convention == "acclaim" else skeleton.children[joint]
    for end in ends:
        start = int(skeleton.parents[end])
        if start in skeleton.scene_joints:
            continue
        moves = any(dof[0] == "t" for dof in skeleton.dofs[end])
        if start >= 0 and not moves and np.linalg.norm(skeleton.offsets[end]) > 1e-9:
            return start, end
    return None


def _values(skeleton: Skeleton, positions: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return positions and stored axes as one (F, D) matrix."""
    layout = _layout(skeleton)
    n_frames = len(positions)
    frames = rotations[:, layout.joints] @ layout.bases
    columns = [positions.reshape(n_frames, -1)]
    if (layout.sizes == 3).all():
        columns.append(frames[..., 1].reshape(n_frames, -1))
    else:
        for i, size in enumerate(layout.sizes):
            if size == 6:
                columns.append(frames[:, i, :, 0])
            columns.append(frames[:, i, :, 1])
    return np.concatenate(columns, axis=1)


def _rotations(skeleton: Skeleton, positions: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the joint rotations (F, J, 3, 3) that positions and stored axes imply."""
    layout = _layout(skeleton)
    rotations = np.empty((len(positions), skeleton.n_joints, 3, 3))
    rotations[:] = np.eye(3)
    _orthonormal_rotations(
        np.ascontiguousarray(positions),
        np.ascontiguousarray(axes),
        layout.tails,
        layout.heads,
        layout.joints,
        layout.bases,
        rotations,
    )
    for joint in np.flatnonzero(layout.followed != np.arange(skeleton.n_joints)):
        rotations[:, joint] = rotations[:, layout.followed[joint]]
    return rotations


@jit
def _orthonormal_rotations(
    positions: FloatArray,
    axes: FloatArray,
    tails: IntArray,
    heads: IntArray,
    joints: IntArray,
    bases: FloatArray,
    rotations: FloatArray,
) -> None:
    """Find R of ``R @ base = (x, y, z)`` for every joint that stores a frame."""
    tiny = 1e-12
    x = np.empty(3)
    y = np.empty(3)
    z = np.empty(3)
    for f in range(len(positions)):
        column = 0
        for i in range(len(joints)):
            for r in range(3):
                if tails[i] >= 0:
                    x[r] = positions[f, heads[i], r] - positions[f, tails[i], r]
                else:
                    x[r] = axes[f, column + r]
            if tails[i] < 0:
                column += 3
            for r in range(3):
                y[r] = axes[f, column + r]
            column += 3

            length = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
            if length > tiny:
                for r in range(3):
                    x[r] /= length
            else:  # a codec may flatten a bone to nothing: any direction is as good
                x[0], x[1], x[2] = 1.0, 0.0, 0.0
            along = x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
            for r in range(3):
                y[r] -= along * x[r]
            length = np.sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2])
            if length <= tiny:  # colinear: take the coordinate axis furthest from x instead
                furthest = np.argmin(np.abs(x))
                for r in range(3):
                    y[r] = (1.0 if r == furthest else 0.0) - x[furthest] * x[r]
                length = np.sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2])
            for r in range(3):
                y[r] /= length
            z[0] = x[1] * y[2] - x[2] * y[1]
            z[1] = x[2] * y[0] - x[0] * y[2]
            z[2] = x[0] * y[1] - x[1] * y[0]
            for r in range(3):
                for c in range(3):
                    rotations[f, joints[i], r, c] = (
                        x[r] * bases[i, c, 0] + y[r] * bases[i, c, 1] + z[r] * bases[i, c, 2]
                    )


# -- bone lengths ----------------------------------------------------------------------------------


@lru_cache(maxsize=256)
def _normalising_ratios(skeleton: Skeleton) -> FloatArray:
    """Return (J,) universal bone length over the skeleton's own, 1 where a bone has no length.

    Bones that the universal body does not name are scaled with the body's height.
    """
    by_height = UNIVERSAL_HEIGHT_M / (_height(skeleton) * skeleton.metres_per_unit)
    ratios = np.ones(skeleton.n_joints)
    for joint, length in zip(skeleton.bone_joints, skeleton.bone_lengths, strict=True):
        if length > 1e-9:
            length_m = length * skeleton.metres_per_unit
            universal_m = UNIVERSAL_BONES_M.get(skeleton.names[joint], length_m * by_height)
            ratios[joint] = universal_m / length_m
    return ratios


def _height(skeleton: Skeleton) -> float:
    """Return the rest pose's height, or 1 for a skeleton without extent."""
    return skeleton.rest_height or 1.0


def _lengthened(skeleton: Skeleton, positions: FloatArray, ratios: FloatArray) -> FloatArray:
    """Return positions with every bone stretched by its ratio, children moved with their parents.

    O'Kane's single pass down the hierarchy, written as one (J, J) matrix. The body's root and the
    scene stay.
    """
    change = np.zeros((skeleton.n_joints, skeleton.n_joints))
    stay = {skeleton.body_root, *skeleton.scene_joints}
    for joint, parent in enumerate(skeleton.parents):
        if joint in stay:
            change[joint, joint] = 1.0
            continue
        change[joint] = change[parent]
        change[joint, joint] += ratios[joint]
        change[joint, parent] -= ratios[joint]
    return np.asarray(change @ positions)
