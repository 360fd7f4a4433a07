"""Anatomical frames: how the segments of a human body are turned, whatever axes its rig has.

Each segment (pelvis, chest, head, upper arm, forearm, hand, thigh, shank, foot) has a frame that is
fixed in the joint that turns it and found from the body's own motion: the bone's direction, and the
axis about which knee or elbow bend. Two bodies do the same where these frames are turned alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.errors import SkeletonError
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.body.findings import Body
from mocapdb.motion.body.understanding import understand_pose
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import FLAT_FOOT_SHARE, LEAST_FOLD

__all__ = ["Segments"]

LIMBS = (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))
OUTWARDS = {"hip": 1.0, "shoulder": -1.0}  # knees bend backwards and elbows forwards


@dataclass(frozen=True)
class Segments:
    """The segments of a human body in motion.

    Attributes
    ----------
    skeleton : Skeleton
    joints : mapping of str to int
        The joint that is in the place of each canonical joint.
    turns : mapping of str to int
        The joint that turns each segment, by the canonical joint in which the segment starts.
    positions : (F, J, 3), skeleton units
    rotations : (F, J, 3, 3)
        Of the world.
    """

    skeleton: Skeleton
    joints: Mapping[str, int]
    turns: Mapping[str, int]
    positions: FloatArray
    rotations: FloatArray

    @classmethod
    def of(cls, skeleton: Skeleton, pose: Pose, name: str) -> Segments:
        """Understand a body by its motion; `name` is what to call it where that fails.

        Raises
        ------
        SkeletonError
            If it is no whole human body, or a limb has no joint of its own.
        """
        body = understand_pose(skeleton, pose.positions)
        if not body.is_human:
            raise SkeletonError(
                f"Expected two bodies of one kind, or two human ones, but {name!r} on "
                f"skeleton {skeleton.name!r} is {body.refusal}. Give its joints by "
                "--joint-map, or take clips of one skeleton."
            )
        return cls(skeleton, body.joints.value, _turns(body), pose.positions, pose.rotations)

    @property
    def across(self) -> FloatArray:
        """(F, 3) from the right hip to the left one."""
        return np.asarray(self._way("right_hip", "left_hip"))

    def middle_of(self, positions: FloatArray) -> FloatArray:
        """Return (F, 3) the middle of the hips where joints are at positions (F, J, 3)."""
        return np.asarray(positions[:, [self.joints[f"{s}_hip"] for s in SIDES]].mean(axis=1))

    def frames(self) -> dict[str, FloatArray]:
        """Return the anatomical frame (F, 3, 3) of each segment over time, in the world."""
        return {
            name: self.rotations[:, self.turns[name]] @ fixed
            for name, fixed in self.fixed_frames().items()
        }

    def fixed_frames(self) -> dict[str, FloatArray]:
        """Return the anatomical frame (3, 3) of each segment in the joint that turns it.

        Its columns are a first axis, a second one as far as it is across the first, and the third.
        """
        up = np.eye(3)[self.skeleton.up_index]
        ups = np.broadcast_to(up, self.across.shape)
        found = {"hips": self._fixed("hips", self.across, ups)}
        shoulders = self._way("right_shoulder", "left_shoulder")
        neck = self.positions[:, [self.joints[f"{side}_shoulder"] for side in SIDES]].mean(axis=1)
        if "chest" in self.turns:
            middle = self.middle_of(self.positions)
            found["chest"] = self._fixed("chest", neck - middle, shoulders)
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

    def turned(
        self, frames: Mapping[str, FloatArray], means: FloatArray, first: FloatArray
    ) -> FloatArray:
        """Return the world rotations (S, J, 3, 3) in which the segments have other frames.

        Joints between two segments, as in the spine, share what is left; all others, as fingers,
        stay as they are on average.

        Parameters
        ----------
        frames : mapping of str to (S, 3, 3)
            Of segments, some or all; the hips among them.
        means : (J, 3, 3)
            Mean rotation of each joint against its parent.
        first : (S, 3, 3) or (3, 3)
            Of the first joint, where it turns no segment.
        """
        fixed_frames = self.fixed_frames()
        segments = {
            self.turns[name]: frame @ fixed_frames[name].T
            for name, frame in frames.items()
            if name in fixed_frames
        }
        rotations = np.empty((len(frames["hips"]), self.skeleton.n_joints, 3, 3))
        shared = self.between(segments)
        for joint, parent in enumerate(self.skeleton.parents):
            if joint in shared:
                end, way = shared[joint]
                start = int(self.skeleton.parents[way[0]])
                straight = rotations[:, start]
                for other in way:
                    straight = straight @ means[other]
                left = segments[end] @ np.swapaxes(straight, 1, 2)
                own = rotations[:, start]
                steps = way.index(joint) + 1
                for other in way[:steps]:
                    own = own @ means[other]
                rotations[:, joint] = _share(left, steps / len(way)) @ own
            elif joint in segments:
                rotations[:, joint] = segments[joint]
            elif joint == 0:
                rotations[:, 0] = first
            else:
                rotations[:, joint] = rotations[:, parent] @ means[joint]
        return rotations

    def between(self, segments: Mapping[int, FloatArray]) -> dict[int, tuple[int, list[int]]]:
        """Return the joints of spine and neck between two segments: what ends them, and the way."""
        skeleton = self.skeleton
        shared: dict[int, tuple[int, list[int]]] = {}
        for name in ("chest", "head"):
            end = self.turns.get(name)
            if end is None or end not in segments:
                continue
            way = [end]
            while way[0] != 0 and int(skeleton.parents[way[0]]) not in segments:
                way.insert(0, int(skeleton.parents[way[0]]))
            if way[0] != 0:
                shared |= dict.fromkeys(way[:-1], (end, way))
        return shared

    def _way(self, start: str, end: str) -> FloatArray:
        return np.asarray(
            self.positions[:, self.joints[end]] - self.positions[:, self.joints[start]]
        )

    def _flat(self, ankle: str) -> BoolArray:
        """Return the frames in which an ankle is lowest, and its foot flat on the ground."""
        height = self.positions[:, self.joints[ankle], self.skeleton.up_index]
        return np.asarray(height <= np.quantile(height, FLAT_FOOT_SHARE))

    def _fixed(
        self, name: str, first: FloatArray, second: FloatArray, when: BoolArray | None = None
    ) -> FloatArray:
        """Return the frame whose axes are, on average over some frames, along world vectors."""
        turned = self.rotations[:, self.turns[name]]
        chosen = slice(None) if when is None else when

        def mean(vectors: FloatArray) -> FloatArray:
            local = np.einsum("fji,fj->fi", turned, vectors)[chosen]
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


def _share(rotations: FloatArray, share: float) -> FloatArray:
    """Return a share of each rotation (F, 3, 3), about its own axis."""
    from scipy.spatial.transform import Rotation

    vectors = Rotation.from_matrix(rotations).as_rotvec()
    return np.asarray(Rotation.from_rotvec(share * vectors).as_matrix())


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))
