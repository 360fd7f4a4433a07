"""Cycles on another body: what one body does, done by another one.

Bodies of one kind, whose bones also point the same ways at rest, take each other's rotations joint
by joint. Any other two have to be human, as `mocapdb.motion.body` understands it. Each segment
(pelvis, chest, head, upper arm, forearm, hand, thigh, shank, foot) then has an anatomical frame
that is fixed in the joint that turns it and found from the body's own motion: the bone's direction,
and the axis about which knee or elbow bend. A segment of the one body is turned as that of the
other. Joints between two segments, as in the spine, share what is left; all others, as fingers,
stay as they are on average.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cycles.curve.rotation_values import local_rotations
from mocapdb.cycles.cycle import Cycle, from_columns, to_columns, world_pose
from mocapdb.cycles.tuning import FLAT_SHARE, LEAST_FOLD, SAME_REST_COSINE, WEIGHTY_BONE
from mocapdb.errors import SkeletonError
from mocapdb.motion.body import Body, understand_pose
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.kinematics import Pose, channels_from_pose
from mocapdb.motion.skeleton import Skeleton

__all__ = ["is_of_one_kind", "on_body"]

LIMBS = (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))
OUTWARDS = {"hip": 1.0, "shoulder": -1.0}  # knees bend backwards and elbows forwards


def on_body(cycle: Cycle, other: Cycle) -> Cycle:
    """Return a cycle on the body of another cycle, its root's way scaled as the legs are.

    Parameters
    ----------
    cycle : Cycle
    other : Cycle
        Of the body that is wanted, from whose motion its joints are understood.

    Raises
    ------
    SkeletonError
        If the bodies differ, and one of them is no whole human body.
    """
    if cycle.skeleton == other.skeleton:
        return cycle
    if is_of_one_kind(cycle.skeleton, other.skeleton):
        return _scaled(cycle, other)
    source, target = _Anatomy.of(cycle), _Anatomy.of(other)
    facing = _level_turn(source, target)
    frames = {name: facing @ frame for name, frame in source.frames().items()}
    rotations = _turned(target, frames)
    skeleton = other.skeleton
    local = np.einsum("fjki,fjkl->fjil", rotations[:, _above(skeleton)], rotations)
    local[:, 0] = rotations[:, 0]
    ratio = target.leg_m / source.leg_m
    units = ratio * source.unit_m / target.unit_m
    middle = units * np.einsum("ij,fj->fi", facing, source.middle)
    local, pose = _reached(other, local)
    sway = middle - (target.middle_of(pose.positions) - pose.positions[:, 0])
    up = skeleton.up_index
    feet = [joint for name, joint in target.joints.items() if name.endswith(("ankle", "toe"))]
    lowest = (pose.positions[:, feet, up] - pose.positions[:, :1, up] + sway[:, None, up]).min()
    sway[:, up] += target.positions[:, feet, up].min() - lowest
    return replace(
        cycle,
        skeleton=skeleton,
        columns=to_columns(local),
        sway=sway,
        advance=units * facing @ cycle.advance,
        translations=other.translations,
        provenance=(*cycle.provenance, f"on the body of {other.name or skeleton.name}"),
    )


def is_of_one_kind(one: Skeleton, other: Skeleton) -> bool:
    """Return whether two skeletons have the same joints, and bones that point the same ways."""
    if (one.names, one.parents.tolist(), one.convention, one.up) != (
        other.names,
        other.parents.tolist(),
        other.convention,
        other.up,
    ):
        return False
    ways, shares = [], []
    for skeleton in (one, other):
        lengths = np.linalg.norm(skeleton.offsets, axis=1)
        ways.append(skeleton.offsets / np.maximum(lengths, 1e-300)[:, None])
        shares.append(lengths / max(float(lengths[1:].max(initial=0.0)), 1e-300))
    weighty = np.minimum(*shares) > WEIGHTY_BONE
    weighty[0] = False
    return bool(((ways[0] * ways[1]).sum(axis=1)[weighty] > SAME_REST_COSINE).all())


def _scaled(cycle: Cycle, other: Cycle) -> Cycle:
    ratio = other.skeleton.height / cycle.skeleton.height
    return replace(
        cycle,
        skeleton=other.skeleton,
        sway=ratio * cycle.sway,
        advance=ratio * cycle.advance,
        translations=other.translations,
        provenance=(*cycle.provenance, f"on the body of {other.name or other.skeleton.name}"),
    )


@dataclass(frozen=True)
class _Anatomy:
    """A body in motion, understood.

    Attributes
    ----------
    cycle : Cycle
    joints : mapping of str to int
        The joint that is in the place of each canonical joint.
    turns : mapping of str to int
        The joint that turns each segment, by the canonical joint in which the segment starts.
    positions : (S, J, 3)
    rotations : (S, J, 3, 3)
        Of the world, in place.
    """

    cycle: Cycle
    joints: Mapping[str, int]
    turns: Mapping[str, int]
    positions: FloatArray
    rotations: FloatArray

    @classmethod
    def of(cls, cycle: Cycle) -> _Anatomy:
        samples = len(cycle.sway)
        pose = cycle.pose(np.arange(samples) / samples, "in-place")
        body = understand_pose(cycle.skeleton, pose.positions)
        if not body.is_human:
            raise SkeletonError(
                f"Expected two bodies of one kind, or two human ones, but {cycle.name!r} on "
                f"skeleton {cycle.skeleton.name!r} is {body.refusal}. Give its joints by "
                "--joint-map, or take clips of one skeleton."
            )
        return cls(cycle, body.joints.value, _turns(body), pose.positions, pose.rotations)

    @property
    def unit_m(self) -> float:
        return self.cycle.skeleton.metres_per_unit

    @property
    def leg_m(self) -> float:
        """Mean length of a leg, in metres."""
        joints, first = self.joints, self.positions[0]
        lengths = [
            np.linalg.norm(first[joints[f"{side}_{end}"]] - first[joints[f"{side}_{start}"]])
            for side in SIDES
            for start, end in (("hip", "knee"), ("knee", "ankle"))
        ]
        return float(np.sum(lengths)) / len(SIDES) * self.unit_m

    @property
    def middle(self) -> FloatArray:
        """(S, 3) the middle of the hips."""
        return self.middle_of(self.positions)

    @property
    def across(self) -> FloatArray:
        """(S, 3) from the right hip to the left one."""
        return np.asarray(self._way("right_hip", "left_hip"))

    def middle_of(self, positions: FloatArray) -> FloatArray:
        """Return (S, 3) the middle of the hips where joints are at positions (S, J, 3)."""
        return np.asarray(positions[:, [self.joints[f"{s}_hip"] for s in SIDES]].mean(axis=1))

    def frames(self) -> dict[str, FloatArray]:
        """Return the anatomical frame (S, 3, 3) of each segment at each phase, in the world."""
        return {
            name: self.rotations[:, self.turns[name]] @ fixed
            for name, fixed in self.fixed_frames().items()
        }

    def fixed_frames(self) -> dict[str, FloatArray]:
        """Return the anatomical frame (3, 3) of each segment in the joint that turns it.

        Its columns are a first axis, a second one as far as it is across the first, and the third.
        """
        up = np.eye(3)[self.cycle.skeleton.up_index]
        ups = np.broadcast_to(up, self.across.shape)
        found = {"hips": self._fixed("hips", self.across, ups)}
        shoulders = self._way("right_shoulder", "left_shoulder")
        neck = self.positions[:, [self.joints[f"{side}_shoulder"] for side in SIDES]].mean(axis=1)
        if "chest" in self.turns:
            found["chest"] = self._fixed("chest", neck - self.middle, shoulders)
        if "head" in self.turns:
            found["head"] = self._fixed("head", ups, shoulders)
        for side in SIDES:
            for start, bend, end in LIMBS:
                upper = self._way(f"{side}_{start}", f"{side}_{bend}")
                lower = self._way(f"{side}_{bend}", f"{side}_{end}")
                hinge = np.cross(_unit(upper), _unit(lower))
                hinge = hinge + LEAST_FOLD * OUTWARDS[start] * _unit(
                    self.across if start == "hip" else shoulders
                )
                found[f"{side}_{start}"] = self._fixed(f"{side}_{start}", upper, hinge)
                found[f"{side}_{bend}"] = self._fixed(f"{side}_{bend}", lower, hinge)
                name = f"{side}_{end}"
                if name not in self.turns:
                    continue
                if end == "wrist":
                    found[name] = self._fixed(name, lower, hinge)
                else:
                    found[name] = self._fixed(name, ups, hinge, self._flat(name))
        return found

    def _way(self, start: str, end: str) -> FloatArray:
        return np.asarray(
            self.positions[:, self.joints[end]] - self.positions[:, self.joints[start]]
        )

    def _flat(self, ankle: str) -> BoolArray:
        """Return the phases at which an ankle is lowest, and its foot flat on the ground."""
        height = self.positions[:, self.joints[ankle], self.cycle.skeleton.up_index]
        return np.asarray(height <= np.quantile(height, FLAT_SHARE))

    def _fixed(
        self, name: str, first: FloatArray, second: FloatArray, when: BoolArray | None = None
    ) -> FloatArray:
        """Return the frame whose axes are, on average over some phases, along world vectors."""
        turned = self.rotations[:, self.turns[name]]
        phases = slice(None) if when is None else when

        def mean(vectors: FloatArray) -> FloatArray:
            local = np.einsum("fji,fj->fi", turned, vectors)[phases]
            return _unit(local.sum(axis=0))

        x, across = mean(first), mean(second)
        y = _unit(across - (across @ x) * x)
        return np.stack([x, y, np.cross(x, y)], axis=-1)


def _turns(body: Body) -> dict[str, int]:
    """Return the joints that turn segments, each but one segment's."""
    turns: dict[str, int] = {}
    for name in ("hips", *(f"{side}_{limb}" for side in SIDES for chain in LIMBS for limb in chain),
                 "chest", "head"):  # fmt: skip
        joint = body.turns.get(name)
        if joint is not None and joint not in turns.values():
            turns[name] = joint
    missing = [
        f"{side}_{limb}"
        for side in SIDES
        for limb in ("hip", "knee", "shoulder", "elbow")
        if f"{side}_{limb}" not in turns
    ]
    if "hips" not in turns or missing:
        raise SkeletonError(
            f"Expected joints that turn hips, thighs, shanks and arms, but {missing or 'the hips'} "
            "has none of its own."
        )
    return turns


def _level_turn(source: _Anatomy, target: _Anatomy) -> FloatArray:
    """Return the rotation (3, 3) from the one's world to the other's: up and facing the same."""
    frames = []
    for body in (source, target):
        up = np.eye(3)[body.cycle.skeleton.up_index]
        across = body.across.mean(axis=0)
        across = _unit(across - (across @ up) * up)
        frames.append(np.stack([across, up, np.cross(across, up)], axis=-1))
    return np.asarray(frames[1] @ frames[0].T)


def _turned(target: _Anatomy, frames: Mapping[str, FloatArray]) -> FloatArray:
    """Return the world rotations (S, J, 3, 3) in which the target's segments have these frames."""
    skeleton = target.cycle.skeleton
    mean = from_columns(target.cycle.columns.mean(axis=0))
    segments = {
        target.turns[name]: frames[name] @ fixed.T
        for name, fixed in target.fixed_frames().items()
        if name in frames
    }
    rotations = np.empty((len(target.positions), skeleton.n_joints, 3, 3))
    shared = _shared_joints(target, segments)
    for joint, parent in enumerate(skeleton.parents):
        if joint in shared:
            end, way = shared[joint]
            start = int(skeleton.parents[way[0]])
            straight = rotations[:, start]
            for other in way:
                straight = straight @ mean[other]
            left = segments[end] @ np.swapaxes(straight, 1, 2)
            own = rotations[:, start]
            steps = way.index(joint) + 1
            for other in way[:steps]:
                own = own @ mean[other]
            rotations[:, joint] = _share(left, steps / len(way)) @ own
        elif joint in segments:
            rotations[:, joint] = segments[joint]
        elif joint == 0:
            rotations[:, 0] = target.rotations[:, 0]
        else:
            rotations[:, joint] = rotations[:, parent] @ mean[joint]
    return rotations


def _shared_joints(
    target: _Anatomy, segments: Mapping[int, FloatArray]
) -> dict[int, tuple[int, list[int]]]:
    """Return the joints of spine and neck between two segments: what they lead to, and the way."""
    skeleton = target.cycle.skeleton
    shared: dict[int, tuple[int, list[int]]] = {}
    for name in ("chest", "head"):
        end = target.turns.get(name)
        if end is None or end not in segments:
            continue
        way = [end]
        while way[0] != 0 and int(skeleton.parents[way[0]]) not in segments:
            way.insert(0, int(skeleton.parents[way[0]]))
        if way[0] != 0:
            shared |= dict.fromkeys(way[:-1], (end, way))
    return shared


def _reached(other: Cycle, local: FloatArray) -> tuple[FloatArray, Pose]:
    """Return the rotations that the skeleton's degrees of freedom can reach, and the pose."""
    skeleton = other.skeleton
    pose = world_pose(skeleton, local, np.zeros((len(local), 3)), other.translations)
    channels = channels_from_pose(skeleton, pose)
    reached = local_rotations(skeleton, channels)
    return reached, world_pose(skeleton, reached, np.zeros((len(local), 3)), other.translations)


def _share(rotations: FloatArray, share: float) -> FloatArray:
    """Return a share of each rotation (S, 3, 3), about its own axis."""
    from scipy.spatial.transform import Rotation

    vectors = Rotation.from_matrix(rotations).as_rotvec()
    return np.asarray(Rotation.from_rotvec(share * vectors).as_matrix())


def _above(skeleton: Skeleton) -> FloatArray:
    return np.maximum(skeleton.parents, 0)


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))
