"""From Acclaim's convention to BVH's and back, with every joint where it was.

In Acclaim a bone ends in its joint and turns with it; in BVH a joint sits where its bones start.
So a BVH joint is an Acclaim bone seen from its other end, with the same world rotation.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import SkeletonError
from mocapdb.io._asf_text import ROOT
from mocapdb.io.tuning import LEAST_STRETCH_M
from mocapdb.motion.body import part_from_scene
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.skeleton import Skeleton, UpDirection

__all__ = ["to_acclaim_convention", "to_bvh_convention", "to_y_up", "turned_to_y_up", "unique"]

ROOT_DOFS = ("tx", "ty", "tz", "rz", "ry", "rx")
JOINT_DOFS = ("rz", "ry", "rx")
TURNS: dict[UpDirection, tuple[tuple[int, int], ...]] = {
    "z": ((0, 1), (2, -1), (1, 1)),
    "-z": ((0, 1), (2, 1), (1, -1)),
    "-y": ((0, 1), (1, -1), (2, -1)),
    "x": ((1, 1), (0, -1), (2, 1)),
    "-x": ((1, -1), (0, 1), (2, 1)),
}
"""For each direction that is up the axes that x, y and z become, with their signs, once y is."""
NOT_IN_NAMES = re.compile(r"[^\w.\-]")


def to_bvh_convention(clip: Clip) -> Clip:
    """Return the clip in BVH's convention; a clip that is in it already comes back as it is.

    Every joint has the three rotations of order ZYX, continuous over time; the root has three
    positions too. Each bone without children gets an End Site where it ends.
    """
    source = clip.skeleton
    if source.convention == "bvh":
        return clip
    leaves = [joint for joint, children in enumerate(source.children) if not children]
    names = list(source.names)
    for leaf in leaves:
        names.append(unique(f"{names[leaf]}_End", names))
    parents = np.concatenate([source.parents, np.array(leaves, dtype=np.int64)])
    above = np.maximum(parents, 0)
    # A joint sits at the end of the bone before it; the root's children sit at the root.
    offsets = np.where(above[:, None] > 0, source.offsets[above], 0.0)
    target = Skeleton(
        names=names,
        parents=parents,
        offsets=offsets,
        dofs=[ROOT_DOFS, *[JOINT_DOFS] * (source.n_joints - 1), *[()] * len(leaves)],
        rotation_orders=["ZYX"] * source.n_joints + [""] * len(leaves),
        convention="bvh",
        metres_per_unit=source.metres_per_unit,
        up=source.up,
        name=source.name,
        joint_map=_kept(source.joint_map, names),
        body_root=source.body_root,
    )
    pose = forward_kinematics(source, clip.channels)
    same_joint = np.concatenate([np.arange(source.n_joints), above[source.n_joints :]])
    starts = Pose(pose.positions[:, above], pose.rotations[:, same_joint])
    return _converted(clip, target, channels_from_pose(target, starts))


def to_acclaim_convention(clip: Clip, *, still_m: float = LEAST_STRETCH_M) -> Clip:
    """Return the clip in Acclaim's convention, Y up; one that is so already comes back as it is.

    A joint whose children all have one offset becomes the bone with that offset. Any other one
    becomes a bone of length 0, and each of its children that is further away hangs on a bone of
    its own, ``<child>_base``, without degrees of freedom; so do all children of the root. Angles
    are the same numbers.

    Positions of joints below the root become bones where they stay the same. Where a body moves
    against the scene that it hangs on, its own root becomes the root, and the scene is left out.

    Raises
    ------
    SkeletonError
        If a joint moves against its parent by `still_m` or more, a tenth of a millimetre by
        default: Acclaim's bones do not stretch.
    """
    clip = to_y_up(clip)
    source = clip.skeleton
    if source.convention == "acclaim":
        return clip
    clip = _with_fixed_bones(clip, still_m)
    source = clip.skeleton
    bones = _bones(source)
    target = Skeleton(
        names=[bone.name for bone in bones],
        parents=[bone.parent for bone in bones],
        offsets=[bone.offset for bone in bones],
        dofs=[bone.dofs for bone in bones],
        rotation_orders=[
            source.rotation_orders[bone.joint] if bone.joint is not None else "" for bone in bones
        ],
        convention="acclaim",
        metres_per_unit=source.metres_per_unit,
        up=source.up,
        name=source.name,
        joint_map=_kept(source.joint_map, [bone.name for bone in bones]),
        body_root=next(i for i, bone in enumerate(bones) if bone.joint == source.body_root),
    )
    columns = dict(zip(source.channel_names, clip.channels.T, strict=True))
    fixed = {f"{source.names[0]}.t{axis}": source.offsets[0, i] for i, axis in enumerate("xyz")}
    wanted = [f"{source.names[bone.joint or 0]}.{dof}" for bone in bones for dof in bone.dofs]
    channels = np.empty((len(clip), len(wanted)))
    for i, name in enumerate(wanted):
        if name not in columns:
            channels[:, i] = fixed[name]
        else:
            displaced = source.displaces and name in fixed
            channels[:, i] = columns[name] + (fixed[name] if displaced else 0.0)
    return _converted(clip, target, channels)


def _with_fixed_bones(clip: Clip, still_m: float) -> Clip:
    """Return a clip with position channels on its root alone: of others, bones are made.

    Raises
    ------
    SkeletonError
        If a joint moves against its parent.
    """
    if _stretches(clip, still_m):
        body, scene = part_from_scene(clip)
        if scene is not None:
            kept = set(body.skeleton.names)
            left = [repr(name) for name in clip.skeleton.names if name not in kept]
            step = f"{body.skeleton.names[0]!r} is the root, without {', '.join(left)} of the scene"
            clip = replace(body, provenance=(*clip.provenance, step))
    stretches = _stretches(clip, still_m)
    skeleton = clip.skeleton
    if stretches:
        worst = max(stretches, key=lambda joint: stretches[joint])
        others = len(stretches) - 1
        more = f", and {others} more" if others else ""
        raise SkeletonError(
            f"Expected joints that keep their places on their bones, but {skeleton.names[worst]!r} "
            f"moves by {1000 * stretches[worst]:.3g} mm{more}. Acclaim's bones have a fixed "
            "length: write a BVH or an NPZ."
        )
    offsets, columns = skeleton.offsets.copy(), _position_columns(skeleton)
    if not columns:
        return clip
    for joint, shifts in columns.items():
        for axis, column in shifts.items():
            place = float(np.median(clip.channels[:, column]))
            offsets[joint, axis] = place + (offsets[joint, axis] if skeleton.displaces else 0.0)
    gone = [column for shifts in columns.values() for column in shifts.values()]
    fixed = replace(
        skeleton,
        offsets=offsets,
        dofs=tuple(
            dofs if joint not in columns else tuple(dof for dof in dofs if dof[0] == "r")
            for joint, dofs in enumerate(skeleton.dofs)
        ),
    )
    return replace(clip, skeleton=fixed, channels=np.delete(clip.channels, gone, axis=1))


def _stretches(clip: Clip, still_m: float) -> dict[int, float]:
    """Return the joints below the root that move against their parents, and by how many metres."""
    found = {}
    for joint, shifts in _position_columns(clip.skeleton).items():
        sides = np.ptp(clip.channels[:, list(shifts.values())], axis=0)
        length_m = float(np.linalg.norm(sides)) * clip.skeleton.metres_per_unit
        if length_m >= still_m:
            found[joint] = length_m
    return found


def _position_columns(skeleton: Skeleton) -> dict[int, dict[int, int]]:
    """Return for each joint below the root that has position channels their columns by axis."""
    found: dict[int, dict[int, int]] = {}
    for joint in range(1, skeleton.n_joints):
        first = int(skeleton.channel_starts[joint])
        for i, dof in enumerate(skeleton.dofs[joint]):
            if dof[0] == "t":
                found.setdefault(joint, {})["xyz".index(dof[1])] = first + i
    return found


def to_y_up(clip: Clip) -> Clip:
    """Return the clip turned so that y is up: x stays, z becomes y, y becomes -z.

    The rest pose turns as well, so channels only change places and signs.
    """
    return clip if clip.skeleton.up == "y" else turned_to_y_up(clip, clip.skeleton.up)


def turned_to_y_up(clip: Clip, up: UpDirection) -> Clip:
    """Return the clip turned so that y is up, whatever direction was.

    The rest pose turns as well, so channels only change places and signs.
    """
    source = clip.skeleton
    if up == "y":
        return clip
    turn = TURNS[up]
    others = "".join("xyz"[axis] for axis, _ in turn)
    swap = str.maketrans("xyzXYZ", others + others.upper())
    target = replace(
        source,
        offsets=_turned(source.offsets, turn),
        dofs=tuple(tuple(dof.translate(swap) for dof in dofs) for dofs in source.dofs),
        rotation_orders=tuple(order.translate(swap) for order in source.rotation_orders),
        axis_deg=_turned_axes(source.axis_deg, turn),
        up="y",
    )
    signs = np.array([float(turn["xyz".index(dof[1])][1]) for dofs in source.dofs for dof in dofs])
    return _converted(
        clip, target, clip.channels * signs + 0.0, step=f"turned from {up} up to y up"
    )


@dataclass
class _AcclaimBone:
    """A bone to be, and the BVH joint whose rotation it takes over, if any."""

    name: str
    parent: int
    offset: FloatArray
    joint: int | None = None
    dofs: tuple[str, ...] = ()


def _bones(source: Skeleton) -> list[_AcclaimBone]:
    """Return the Acclaim bones of a BVH skeleton, the ends of which are its joints."""
    bones: list[_AcclaimBone] = []
    names: list[str] = []
    ends_at: dict[int, int] = {0: -1}  # BVH joint -> the bone that ends in it

    def add(name: str, parent: int, offset: FloatArray) -> _AcclaimBone:
        names.append(unique(NOT_IN_NAMES.sub("_", name) if bones else ROOT, names))
        bones.append(_AcclaimBone(names[-1], parent, offset))
        return bones[-1]

    for joint, children in enumerate(source.children):
        is_end_site = not children and not source.dofs[joint]
        if is_end_site and joint:
            continue
        offsets = source.offsets[list(children)]
        shared = joint > 0 and len(offsets) > 0 and bool((offsets == offsets[0]).all())
        bone = add(source.names[joint], ends_at[joint], offsets[0] if shared else np.zeros(3))
        bone.joint = joint
        bone.dofs = tuple(f"r{axis.lower()}" for axis in reversed(source.rotation_orders[joint]))
        if joint == 0:
            bone.dofs = ("tx", "ty", "tz", *bone.dofs)
        own = len(bones) - 1
        for child in children:
            ends_at[child] = own
            if not shared and source.offsets[child].any():
                is_end = not source.children[child] and not source.dofs[child]
                name = source.names[child] + ("" if is_end else "_base")
                ends_at[child] = len(bones)
                add(name, own, source.offsets[child])
    return bones


def unique(name: str, taken: Iterable[str]) -> str:
    """Return the name, with a number behind it if it is taken."""
    taken = set(taken)
    number, candidate = 1, name
    while candidate in taken:
        number += 1
        candidate = f"{name}{number}"
    return candidate


def _kept(joint_map: Mapping[str, str], names: Collection[str]) -> dict[str, str]:
    """Return what a joint map says of joints that are still there under their names."""
    return {joint: name for joint, name in joint_map.items() if name in names}


def _turned(vectors: FloatArray, turn: tuple[tuple[int, int], ...]) -> FloatArray:
    """Return vectors (..., 3) whose axes become others."""
    turned = np.empty_like(vectors)
    for own, (axis, sign) in enumerate(turn):
        turned[..., axis] = sign * vectors[..., own] + 0.0
    return turned


def _turned_axes(axis_deg: FloatArray, turn: tuple[tuple[int, int], ...]) -> FloatArray:
    """Return Acclaim axes (J, 3) of skeletons whose axes become others."""
    turned = np.zeros_like(axis_deg)
    some = axis_deg.any(axis=1)
    if some.any():
        from scipy.spatial.transform import Rotation

        # with G z = y and G y = -z: G Rz(c) Ry(b) Rx(a) G^T = Ry(c) Rz(-b) Rx(a)
        angles = axis_deg[some] * [sign for _, sign in turn]
        axes = "".join("xyz"[axis] for axis, _ in turn)
        turned[some] = Rotation.from_euler(axes, angles, degrees=True).as_euler("xyz", degrees=True)
    return turned


def _converted(clip: Clip, target: Skeleton, channels: FloatArray, step: str = "") -> Clip:
    """Return the clip with another skeleton and its channels."""
    step = step or f"converted to {target.convention} convention"
    return replace(clip, skeleton=target, channels=channels, provenance=(*clip.provenance, step))
