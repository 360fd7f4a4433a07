"""A walking person in plain BVH, and what exporters make of one: for tests of understanding.

Every change keeps each joint where it is in the world, but for the turn or the unit it is about,
so the right answers are known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.skeleton import Skeleton

TURNS = ("rz", "rx", "ry")
SHIFTS = ("tx", "ty", "tz")
# (joint, parent, offset in metres); limbs are those of the left side
TRUNK = [
    ("hips", "", (0.0, 0.0, 0.0)),
    ("spine", "hips", (0.0, 0.11, -0.01)),
    ("spine2", "spine", (0.0, 0.13, 0.0)),
    ("chest", "spine2", (0.0, 0.13, 0.0)),
    ("neck", "chest", (0.0, 0.15, 0.0)),
    ("head", "neck", (0.0, 0.09, 0.01)),
    ("head_end", "head", (0.0, 0.19, 0.0)),
]
LIMBS = [
    ("collar", "chest", (0.04, 0.1, 0.0)),
    ("shoulder", "collar", (0.15, 0.0, 0.0)),
    ("elbow", "shoulder", (0.31, 0.0, 0.0)),
    ("wrist", "elbow", (0.25, 0.0, 0.0)),
    ("hand_end", "wrist", (0.17, 0.0, 0.0)),
    ("hip", "hips", (0.09, -0.05, 0.0)),
    ("knee", "hip", (0.0, -0.42, 0.0)),
    ("ankle", "knee", (0.0, -0.42, 0.0)),
    ("toe", "ankle", (0.0, -0.07, 0.14)),
    ("toe_end", "toe", (0.0, 0.0, 0.07)),
]
SIDES = ("left", "right")
CANONICAL = {"hips": "hips", "spine": "spine", "chest": "chest", "head": "head"} | {
    f"{side}_{limb}": f"{side}_{limb}"
    for side in SIDES
    for limb in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "toe")
}
"""The joint of the body below that each canonical joint is."""


@dataclass(frozen=True)
class Made:
    """A body in motion, and the right answers.

    Attributes
    ----------
    roles : tuple of str
        What each joint is, whatever its name.
    """

    skeleton: Skeleton
    channels: np.ndarray
    roles: tuple[str, ...]
    unit_m: float = 1.0
    up: str = "y"

    @property
    def pose(self) -> Pose:
        return forward_kinematics(self.skeleton, self.channels)


def make_walk(n_frames: int = 60, *, legs: float = 1.0) -> Made:
    """Return a person of 1.71 m who walks along z, swings the arms and turns the trunk a little."""
    parts = list(TRUNK)
    for side, mirror in zip(SIDES, (1.0, -1.0), strict=True):
        for name, parent, (x, y, z) in LIMBS:
            above = parent if parent in ("chest", "hips") else f"{side}_{parent}"
            size = legs if name in ("knee", "ankle") else 1.0
            parts.append((f"{side}_{name}", above, (mirror * x * size, y * size, z * size)))
    roles = [name for name, _, _ in parts]
    dofs = [
        () if role.endswith("_end") else (*SHIFTS, *TURNS) if role == "hips" else TURNS
        for role in roles
    ]
    skeleton = Skeleton(
        roles,
        [roles.index(parent) if parent else -1 for _, parent, _ in parts],
        [offset for _, _, offset in parts],
        dofs,
        ["".join(dof[1].upper() for dof in joint if dof[0] == "r") for joint in dofs],
        convention="bvh",
        name="made",
    )
    channels = np.zeros((n_frames, skeleton.n_channels))
    columns = {name: i for i, name in enumerate(skeleton.channel_names)}
    phase = 2 * np.pi * np.arange(n_frames) / 30.0
    channels[:, columns["hips.ty"]] = 0.94 + 0.84 * (legs - 1) + 0.02 * np.cos(2 * phase)
    channels[:, columns["hips.tz"]] = 0.04 * np.arange(n_frames)
    channels[:, columns["spine2.ry"]] = 8 * np.sin(phase)
    channels[:, columns["neck.rx"]] = 5 * np.sin(phase)
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        swing = sign * np.sin(phase)
        channels[:, columns[f"{side}_hip.rx"]] = -25 * swing
        channels[:, columns[f"{side}_knee.rx"]] = 25 + 22 * np.cos(phase) * sign
        channels[:, columns[f"{side}_ankle.rx"]] = -10 * swing
        channels[:, columns[f"{side}_shoulder.rz"]] = -sign * 75
        channels[:, columns[f"{side}_shoulder.ry"]] = 20 * np.sin(phase)
        channels[:, columns[f"{side}_elbow.ry"]] = -sign * (25 + 10 * np.sin(phase))
    return Made(skeleton, channels, tuple(roles))


def _posed(made: Made, skeleton: Skeleton, pose: Pose, roles=None, **answers) -> Made:
    channels = channels_from_pose(skeleton, pose)
    return replace(
        made, skeleton=skeleton, channels=channels, roles=tuple(roles or made.roles), **answers
    )


def with_rest(made: Made, bases: np.ndarray) -> Made:
    """Return the same motion on joints whose rest frames are turned by (J, 3, 3) rotations."""
    skeleton, pose = made.skeleton, made.pose
    offsets = skeleton.offsets.copy()
    offsets[1:] = np.einsum("jba,jb->ja", bases[skeleton.parents[1:]], skeleton.offsets[1:])
    turned = Pose(pose.positions, pose.rotations @ bases)
    return _posed(made, replace(skeleton, offsets=offsets), turned)


def along_x(made: Made) -> Made:
    """Return the same motion with every bone that is alone on its joint along x at rest."""
    skeleton = made.skeleton
    bases = np.tile(np.eye(3), (skeleton.n_joints, 1, 1))
    for joint, below in enumerate(skeleton.children):
        if below:
            bone = skeleton.offsets[below[0]]
            bases[joint] = Rotation.align_vectors([bone], [[1.0, 0.0, 0.0]])[0].as_matrix()
    return with_rest(made, bases)


def turned_up(made: Made) -> Made:
    """Return the same motion with z up; the rest pose stays as it is."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    pose = made.pose
    return _posed(made, made.skeleton, Pose(pose.positions @ turn.T, turn @ pose.rotations), up="z")


def in_units(made: Made, unit_m: float) -> Made:
    """Return the same motion in another unit of length."""
    shifts = [name[-2] == "t" for name in made.skeleton.channel_names]
    channels = made.channels.copy()
    channels[:, shifts] /= unit_m
    skeleton = replace(made.skeleton, offsets=made.skeleton.offsets / unit_m)
    return replace(made, skeleton=skeleton, channels=channels, unit_m=unit_m)


def with_positions(made: Made, meaning: str) -> Made:
    """Return the same motion with position channels on every joint.

    They are ``"places"`` that repeat the OFFSETs, ``"replacing"`` ones of OFFSETs that are zero,
    or ``"displacements"``, tiny ones, that are added to them.
    """
    skeleton = made.skeleton
    dofs = [(*SHIFTS, *TURNS) if joint else () for joint in skeleton.dofs]
    every = replace(skeleton, dofs=dofs)
    if meaning == "replacing":
        every = replace(every, offsets=np.where([[bool(d)] for d in dofs], 0.0, skeleton.offsets))
    if meaning == "displacements":
        every = replace(every, displaces=True)
    made = _posed(made, every, made.pose)
    if meaning == "displacements":  # as the file has it: nothing says so
        made = replace(made, skeleton=replace(every, displaces=False))
    return made


def under_scene(made: Made, *, moving: bool = False) -> Made:
    """Return the same motion under a root that stands still, or that follows on the ground."""
    skeleton, pose = made.skeleton, made.pose
    at = np.zeros((len(pose.positions), 1, 3))
    if moving:
        at[:, 0, [0, 2]] = pose.positions[:, 0, [0, 2]]
    still = np.tile(np.eye(3), (len(at), 1, 1, 1))
    target = replace(
        skeleton,
        names=("scene", *skeleton.names),
        parents=[-1, *(skeleton.parents + 1)],
        offsets=[np.zeros(3), pose.positions[0, 0] - at[0, 0], *skeleton.offsets[1:]],
        dofs=((*SHIFTS, *TURNS), *skeleton.dofs),
        rotation_orders=("ZXY", *skeleton.rotation_orders),
        axis_deg=np.zeros((skeleton.n_joints + 1, 3)),
    )
    whole = Pose(
        np.concatenate([at, pose.positions], axis=1),
        np.concatenate([still, pose.rotations], axis=1),
    )
    return _posed(made, target, whole, roles=("scene", *made.roles))


def without(made: Made, *roles: str) -> Made:
    """Return the same motion without some joints and all below them; an end for each of them.

    Where a joint loses its only child, that child's place stays as an End Site.
    """
    skeleton = made.skeleton
    gone = {joint for joint, role in enumerate(made.roles) if role in roles}
    for joint in range(skeleton.n_joints):
        if skeleton.parents[joint] in gone:
            gone.add(joint)
    tops = [joint for joint in sorted(gone) if skeleton.parents[joint] not in gone]
    ends = [joint for joint in tops if len(skeleton.children[skeleton.parents[joint]]) == 1]
    kept = [joint for joint in range(skeleton.n_joints) if joint not in gone or joint in ends]
    target = replace(
        skeleton,
        names=[skeleton.names[joint] for joint in kept],
        parents=[kept.index(p) if (p := skeleton.parents[joint]) >= 0 else -1 for joint in kept],
        offsets=skeleton.offsets[kept],
        dofs=[() if joint in ends else skeleton.dofs[joint] for joint in kept],
        rotation_orders=["" if j in ends else skeleton.rotation_orders[j] for j in kept],
        axis_deg=skeleton.axis_deg[kept],
    )
    pose = Pose(made.pose.positions[:, kept], made.pose.rotations[:, kept])
    return _posed(made, target, pose, roles=[made.roles[joint] for joint in kept])


def permuted(made: Made, order: np.random.Generator) -> Made:
    """Return the same motion with every joint's children in another order."""
    skeleton = made.skeleton
    found, waiting = [], [0]
    while waiting:
        joint = waiting.pop()
        found.append(joint)
        waiting.extend(order.permutation(skeleton.children[joint]).tolist())
    target = replace(
        skeleton,
        names=[skeleton.names[joint] for joint in found],
        parents=[found.index(p) if (p := skeleton.parents[joint]) >= 0 else -1 for joint in found],
        offsets=skeleton.offsets[found],
        dofs=[skeleton.dofs[joint] for joint in found],
        rotation_orders=[skeleton.rotation_orders[joint] for joint in found],
        axis_deg=skeleton.axis_deg[found],
    )
    pose = Pose(made.pose.positions[:, found], made.pose.rotations[:, found])
    return _posed(made, target, pose, roles=[made.roles[joint] for joint in found])


def renamed(made: Made, names: dict[str, str] | None = None) -> Made:
    """Return the body under other names, by role; under names that say nothing without any."""
    if names is None:
        told = [f"node{7 * i % 101}" for i in range(len(made.roles))]
    else:
        told = [names.get(role, f"{role}-site") for role in made.roles]
    return replace(made, skeleton=replace(made.skeleton, names=told))


def make_dog() -> Made:
    """Return an animal that trots: a level trunk, four legs of one length, a tail."""
    made = make_walk()
    skeleton = made.skeleton
    offsets = skeleton.offsets.copy()
    for joint, role in enumerate(made.roles):
        if role in ("spine", "spine2", "chest"):
            offsets[joint] = (0.0, 0.0, 0.3)
        if role == "neck":
            offsets[joint] = (0.0, 0.1, 0.15)
        if role == "head":
            offsets[joint] = (0.0, 0.15, 0.15)
        side = 1.0 if role.startswith("left") else -1.0
        arm = {
            "collar": (side * 0.08, 0.0, 0.0),
            "shoulder": (side * 0.02, -0.05, 0.0),
            "elbow": (0.0, -0.37, 0.0),
            "wrist": (0.0, -0.37, 0.0),
            "hand_end": (0.0, -0.05, 0.08),
        }
        part = role.partition("_")[2]
        if part in arm:
            offsets[joint] = arm[part]
    channels = made.channels.copy()
    for i, name in enumerate(skeleton.channel_names):
        if "shoulder" in name or "elbow" in name:
            channels[:, i] = 0.0
    columns = {name: i for i, name in enumerate(skeleton.channel_names)}
    for side in SIDES:
        hip = channels[:, columns[f"{side}_hip.rx"]]
        channels[:, columns[f"{side}_shoulder.rx"]] = -hip
        channels[:, columns[f"{side}_elbow.rx"]] = -15 + hip / 2
    return replace(made, skeleton=replace(skeleton, offsets=offsets), channels=channels)


def with_more_limbs(made: Made, times: int) -> Made:
    """Return the body with so many more pairs of legs on its hips."""
    skeleton, pose = made.skeleton, made.pose
    legs = [
        joint
        for joint, role in enumerate(made.roles)
        if role.partition("_")[2] in ("hip", "knee", "ankle", "toe", "toe_end")
    ]
    sources = list(range(skeleton.n_joints))
    parents = skeleton.parents.tolist()
    for _ in range(times):
        new = {joint: len(sources) + i for i, joint in enumerate(legs)}
        sources += legs
        parents += [new.get(int(skeleton.parents[joint]), 0) for joint in legs]
    target = replace(
        skeleton,
        names=[f"{skeleton.names[joint]}{i}" for i, joint in enumerate(sources)],
        parents=parents,
        offsets=skeleton.offsets[sources],
        dofs=[skeleton.dofs[joint] for joint in sources],
        rotation_orders=[skeleton.rotation_orders[joint] for joint in sources],
        axis_deg=skeleton.axis_deg[sources],
    )
    many = Pose(pose.positions[:, sources], pose.rotations[:, sources])
    return _posed(made, target, many, roles=[made.roles[joint] for joint in sources])
