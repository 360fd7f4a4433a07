"""The skeleton: joints, their hierarchy, their rest offsets and their degrees of freedom."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.errors import SkeletonError
from mocapdb.motion.tuning import MOST_JOINTS, STANDING_SHARE, WAY_OF_STATURE

__all__ = ["Convention", "Skeleton", "UpAxis", "UpDirection"]

Convention: TypeAlias = Literal["acclaim", "bvh"]
UpAxis: TypeAlias = Literal["y", "z"]
UpDirection: TypeAlias = Literal["y", "z", "x", "-x", "-y", "-z"]
"""Of a file: what is not along y or z is turned when it is read."""

DOF_NAMES = ("tx", "ty", "tz", "rx", "ry", "rz")
HEIGHT_JOINTS = (
    "lhipjoint",
    "lfemur",
    "ltibia",
    "lowerback",
    "upperback",
    "thorax",
    "lowerneck",
    "upperneck",
    "head",
)


@dataclass(frozen=True, eq=False, repr=False)
class Skeleton:
    """A hierarchy of joints with rest offsets and degrees of freedom.

    Parameters
    ----------
    names : sequence of str
        One unique name a joint, J in all. A BVH End Site is a joint without degrees of freedom.
    parents : (J,) array-like of int
        Index of each joint's parent, -1 for the root. Parents come before their children and
        joint 0 is the only root.
    offsets : (J, 3) array-like, skeleton units
        The bone that ends in a joint, from its parent, in the rest pose.
    dofs : sequence of sequences of str
        For each joint its channels in the order of the file, from ``tx ty tz rx ry rz``.
    rotation_orders : sequence of str
        For each joint the product of its elementary rotations, outermost first: ``"ZYX"`` is
        ``Rz @ Ry @ Rx`` (scipy's intrinsic notation). Has the axes of the joint's ``r`` dofs.
    displaces : bool
        Whether BVH's position channels, the root's too, are displacements that add to the
        offset, as some exporters write them, rather than replace it.
    joint_map : mapping of str to str
        What the user says of a body's joints: names of joints by those of canonical joints (see
        `mocapdb.motion.body`). Mostly empty: they are found.
    body_root : int
        The joint that carries the body. What it hangs on is the scene's, from which no method
        looks: see `mocapdb.motion.body`, which finds it.
    axis_deg : (J, 3) array-like, optional, degrees
        Acclaim's ``axis``: ``C = Rz @ Ry @ Rx`` of these angles. Zero by default.
    convention : {"acclaim", "bvh"}
        Which rotation carries a bone. In Acclaim the bone that ends in joint j turns with j
        itself, and translation channels add to the offset; in BVH it turns with j's parent,
        and position channels replace the offset.
    metres_per_unit : float
        Length of one skeleton unit in metres.
    up : {"y", "z"}
        The vertical axis of the file.
    name : str
        Name of the source.

    Raises
    ------
    SkeletonError
        If the parts do not fit together.

    Notes
    -----
    The local rotation of a joint is ``C @ M @ C.T`` with M the product of its elementary
    rotations (O'Kane 2008, section 3.2.1, in column-vector form), and its world rotation is its
    parent's world rotation times the local one.
    """

    names: tuple[str, ...]
    parents: IntArray
    offsets: FloatArray
    dofs: tuple[tuple[str, ...], ...]
    rotation_orders: tuple[str, ...]
    axis_deg: FloatArray
    convention: Convention
    metres_per_unit: float
    up: UpAxis
    name: str
    displaces: bool
    joint_map: Mapping[str, str]
    body_root: int

    def __init__(
        self,
        names: Sequence[str],
        parents: ArrayLike,
        offsets: ArrayLike,
        dofs: Sequence[Sequence[str]],
        rotation_orders: Sequence[str],
        *,
        axis_deg: ArrayLike | None = None,
        convention: Convention,
        metres_per_unit: float = 1.0,
        up: UpAxis = "y",
        name: str = "",
        displaces: bool = False,
        joint_map: Mapping[str, str] | None = None,
        body_root: int = 0,
    ) -> None:
        n_joints = len(names)
        assign = object.__setattr__  # the dataclass is frozen
        assign(self, "names", tuple(str(joint) for joint in names))
        assign(self, "parents", _frozen(parents, np.int64, (n_joints,), "parents"))
        assign(self, "offsets", _frozen(offsets, np.float64, (n_joints, 3), "offsets"))
        assign(self, "dofs", tuple(tuple(str(d) for d in joint) for joint in dofs))
        assign(self, "rotation_orders", tuple(str(order) for order in rotation_orders))
        axes = np.zeros((n_joints, 3)) if axis_deg is None else axis_deg
        assign(self, "axis_deg", _frozen(axes, np.float64, (n_joints, 3), "axis_deg"))
        assign(self, "convention", convention)
        assign(self, "metres_per_unit", float(metres_per_unit))
        assign(self, "up", up)
        assign(self, "name", name)
        assign(self, "displaces", bool(displaces) and convention == "bvh")
        assign(self, "joint_map", dict(joint_map or {}))
        assign(self, "body_root", int(body_root))
        self._validate()

    def _validate(self) -> None:
        n_joints = len(self.names)
        if n_joints == 0:
            raise SkeletonError("Expected a skeleton to have at least one joint, but got none.")
        if n_joints > MOST_JOINTS:
            raise SkeletonError(f"Expected at most {MOST_JOINTS} joints, but got {n_joints}.")
        if len(self.dofs) != n_joints or len(self.rotation_orders) != n_joints:
            raise SkeletonError(
                f"Expected dofs and rotation_orders for {n_joints} joints, "
                f"but got {len(self.dofs)} and {len(self.rotation_orders)}."
            )
        if len(set(self.names)) != n_joints:
            twice = next(joint for joint in self.names if self.names.count(joint) > 1)
            raise SkeletonError(f"Expected unique joint names, but got {twice!r} twice.")
        if self.parents[0] != -1 or np.any(self.parents[1:] < 0):
            raise SkeletonError("Expected joint 0, and no other, to be the root (parent -1).")
        late = np.flatnonzero(self.parents >= np.arange(n_joints))
        if late.size:
            raise SkeletonError(
                f"Expected the parent of {self.names[late[0]]!r} to come before it in the order "
                "of joints. Sort the joints from the root outwards."
            )
        for joint, dofs, order in zip(self.names, self.dofs, self.rotation_orders, strict=True):
            if not set(dofs) <= set(DOF_NAMES) or len(set(dofs)) != len(dofs):
                raise SkeletonError(
                    f"Expected the degrees of freedom of {joint!r} to be different ones out of "
                    f"{' '.join(DOF_NAMES)}, but got {' '.join(dofs)}."
                )
            if sorted(order) != sorted(d[1].upper() for d in dofs if d[0] == "r"):
                raise SkeletonError(
                    f"Expected the rotation order of {joint!r} to name the axes of its rotations "
                    f"({' '.join(dofs) or 'none'}), but got {order!r}."
                )
        if self.convention not in get_args(Convention):
            raise SkeletonError(
                f"Expected convention 'acclaim' or 'bvh', but got {self.convention!r}."
            )
        if self.up not in get_args(UpAxis):
            raise SkeletonError(f"Expected up axis 'y' or 'z', but got {self.up!r}.")
        if not 0 <= self.body_root < n_joints:
            raise SkeletonError(
                f"Expected the body's root to be one of {n_joints} joints, but got "
                f"{self.body_root}."
            )
        if not (np.isfinite(self.metres_per_unit) and self.metres_per_unit > 0):
            raise SkeletonError(
                f"Expected metres_per_unit to be positive, but got {self.metres_per_unit}."
            )
        if not (np.isfinite(self.offsets).all() and np.isfinite(self.axis_deg).all()):
            raise SkeletonError("Expected finite offsets and axes, but got NaN or infinity.")

    # -- counts and indices ------------------------------------------------------------------

    @property
    def n_joints(self) -> int:
        """Number of joints J, End Sites of a BVH included."""
        return len(self.names)

    @cached_property
    def n_channels(self) -> int:
        """Number of channels C."""
        return sum(len(dofs) for dofs in self.dofs)

    @cached_property
    def channel_starts(self) -> IntArray:
        """(J + 1,) index of each joint's first channel, and C at the end."""
        starts = np.zeros(self.n_joints + 1, dtype=np.int64)
        np.cumsum([len(dofs) for dofs in self.dofs], out=starts[1:])
        return starts

    @cached_property
    def channel_names(self) -> tuple[str, ...]:
        """C names such as ``"lfemur.rx"``, in the order of the columns."""
        return tuple(
            f"{joint}.{dof}"
            for joint, dofs in zip(self.names, self.dofs, strict=True)
            for dof in dofs
        )

    @cached_property
    def rotation_channels(self) -> IntArray:
        """Indices of the channels that are angles."""
        kinds = [dof for dofs in self.dofs for dof in dofs]
        return np.array([i for i, dof in enumerate(kinds) if dof[0] == "r"], dtype=np.int64)

    @cached_property
    def rotating_joints(self) -> tuple[int, ...]:
        """The joints that have rotation channels."""
        return tuple(joint for joint, order in enumerate(self.rotation_orders) if order)

    def rotation_columns(self, joint: int) -> list[int]:
        """Return the channels of a joint's angles, in the order of its rotation product.

        Examples
        --------
        >>> from mocapdb.corpus import synthetic
        >>> skeleton = synthetic.make_clip("walk", seed=0, duration_s=1.0).skeleton
        >>> [skeleton.channel_names[i] for i in skeleton.rotation_columns(0)]
        ['root.rz', 'root.ry', 'root.rx']
        """
        first, dofs = int(self.channel_starts[joint]), self.dofs[joint]
        return [first + dofs.index(f"r{axis.lower()}") for axis in self.rotation_orders[joint]]

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """For each joint the indices of its children."""
        found: list[list[int]] = [[] for _ in self.names]
        for joint, parent in enumerate(self.parents[1:], start=1):
            found[parent].append(joint)
        return tuple(tuple(joints) for joints in found)

    @cached_property
    def scene_joints(self) -> tuple[int, ...]:
        """The joints that the body's root hangs on, the nearest first; mostly none."""
        return tuple(self.chain_to_root(self.body_root)[1:])

    @cached_property
    def bone_joints(self) -> IntArray:
        """(B,) the joint that each bone ends in: all but the body's root and the scene's joints."""
        above = {self.body_root, *self.scene_joints}
        return np.array([joint for joint in range(self.n_joints) if joint not in above], dtype=int)

    @cached_property
    def bone_carriers(self) -> IntArray:
        """(B,) the joint whose rotation turns each bone: itself in Acclaim, its parent in BVH."""
        return self.bone_joints if self.convention == "acclaim" else self.parents[self.bone_joints]

    @property
    def adds_offsets(self) -> bool:
        """Whether translation channels add to the offset of their joint, rather than replace it."""
        return self.convention == "acclaim" or self.displaces

    @cached_property
    def bone_lengths(self) -> FloatArray:
        """(B,) rest length of each bone, in skeleton units."""
        return np.asarray(np.linalg.norm(self.offsets[self.bone_joints], axis=1))

    def joint(self, name: str) -> int:
        """Return the index of a joint.

        Raises
        ------
        SkeletonError
            If no joint has that name.
        """
        try:
            return self.names.index(name)
        except ValueError:
            raise SkeletonError(
                f"Expected a joint of skeleton {self.name!r}, but got {name!r}. "
                f"It has: {', '.join(self.names)}."
            ) from None

    def chain_to_root(self, joint: int) -> list[int]:
        """Return a joint and all that it hangs on, the root last.

        Examples
        --------
        >>> from mocapdb.corpus import synthetic
        >>> skeleton = synthetic.make_skeleton()
        >>> [skeleton.names[i] for i in skeleton.chain_to_root(skeleton.joint("lfemur"))]
        ['lfemur', 'lhipjoint', 'root']
        """
        chain = [joint]
        while self.parents[chain[-1]] >= 0:
            chain.append(int(self.parents[chain[-1]]))
        return chain

    # -- size ----------------------------------------------------------------------------------

    @cached_property
    def rest_positions(self) -> FloatArray:
        """(J, 3) joint positions of the rest pose, root at the origin, in skeleton units."""
        positions = np.zeros((self.n_joints, 3))
        for joint, parent in enumerate(self.parents[1:], start=1):
            positions[joint] = positions[parent] + self.offsets[joint]
        return positions

    @cached_property
    def rest_height(self) -> float:
        """Height of the rest pose, in skeleton units, which stored representations are scaled by.

        The sum of the lengths of the leg, the spine and the head where an Acclaim skeleton has
        CMU's names (O'Kane 2008, section 3.2.1), else the vertical extent of the rest pose, the
        scene's joints left out.
        """
        if self.convention == "acclaim" and set(HEIGHT_JOINTS) <= set(self.names):
            joints = [self.names.index(name) for name in HEIGHT_JOINTS]
            return float(np.linalg.norm(self.offsets[joints], axis=1).sum())
        own = [joint for joint in range(self.n_joints) if joint not in self.scene_joints]
        return float(np.ptp(self.rest_positions[own, self.up_index]))

    @cached_property
    def height(self) -> float:
        """Height of the body in skeleton units.

        That of its rest pose, if this stands. Where it does not (below a scene's joints it extends
        twice as far along another axis), the stature of a human whose longest way, from the toes
        to the fingers of the other side, is as long.
        """
        forks = (joint for joint, below in enumerate(self.children) if len(below) > 1)
        first = self.body_root or next(forks, 0)
        extents = np.ptp(self.rest_positions[first:], axis=0)  # a scene's joints come before it
        if extents[self.up_index] >= STANDING_SHARE * extents.max():
            return self.rest_height
        return self._longest_way() / WAY_OF_STATURE

    def _longest_way(self) -> float:
        """Return the length of the longest way along bones from one leaf to another, or down."""
        lengths = np.linalg.norm(self.offsets, axis=1)
        reach = np.zeros(self.n_joints)
        longest = 0.0
        for joint in range(self.n_joints - 1, 0, -1):
            parent, below = self.parents[joint], reach[joint] + lengths[joint]
            longest = max(longest, float(reach[parent] + below)) if reach[parent] else longest
            reach[parent] = max(reach[parent], below)
        return longest or float(reach[0])

    @property
    def up_index(self) -> int:
        """Index of the vertical axis: 1 for y, 2 for z."""
        return 1 if self.up == "y" else 2

    @property
    def up_axis(self) -> str:
        """Name of the vertical axis: ``"Y"`` or ``"Z"``."""
        return self.up.upper()

    # -- value -----------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """Return plain lists, numbers and strings, ready for JSON; floats are exact."""
        fields = {
            "names": list(self.names),
            "parents": self.parents.tolist(),
            "offsets": self.offsets.tolist(),
            "dofs": [" ".join(dofs) for dofs in self.dofs],
            "rotation_orders": list(self.rotation_orders),
            "axis_deg": self.axis_deg.tolist(),
            "convention": self.convention,
            "metres_per_unit": self.metres_per_unit,
            "up": self.up,
            "name": self.name,
        }
        if self.displaces:
            fields["displaces"] = True
        if self.joint_map:
            fields["joint_map"] = dict(self.joint_map)
        if self.body_root:
            fields["body_root"] = self.body_root
        return fields

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Skeleton:
        """Rebuild what `to_dict` wrote.

        Raises
        ------
        SkeletonError
            If a field is missing or does not fit the others.
        """
        try:
            return cls(
                names=data["names"],
                parents=data["parents"],
                offsets=data["offsets"],
                dofs=[dofs.split() for dofs in data["dofs"]],
                rotation_orders=data["rotation_orders"],
                axis_deg=data["axis_deg"],
                convention=data["convention"],
                metres_per_unit=data["metres_per_unit"],
                up=data["up"],
                name=data["name"],
                displaces=data.get("displaces", False),
                joint_map=data.get("joint_map"),
                body_root=data.get("body_root", 0),
            )
        except (KeyError, TypeError, ValueError, AttributeError) as problem:
            raise SkeletonError(f"Expected a skeleton's fields, but got {problem!r}.") from None

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything but the name, in hexadecimal."""
        fields = self.to_dict()
        del fields["name"]
        return hashlib.sha256(json.dumps(fields, sort_keys=True).encode()).hexdigest()

    def renamed(self, name: str) -> Skeleton:
        """Return the same skeleton under another name."""
        return replace(self, name=name)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Skeleton):
            return NotImplemented
        return self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        height_m = self.height * self.metres_per_unit
        return (
            f"Skeleton({self.name!r}, {self.convention}: {self.n_joints} joints, "
            f"{self.n_channels} channels, {height_m:.2f} m high, {self.up} up)"
        )


def _frozen(values: ArrayLike, dtype: type, shape: tuple[int, ...], what: str) -> Any:
    """Return a read-only copy of `values` of that type and shape."""
    array: Any = np.array(values, dtype=dtype)
    if array.size == 0:
        array = array.reshape(shape) if 0 in shape else array
    if array.shape != shape:
        raise SkeletonError(f"Expected {what} to have shape {shape}, but got {array.shape}.")
    array.flags.writeable = False
    return array
