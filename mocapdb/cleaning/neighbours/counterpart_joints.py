"""Similar motion of other bodies: another actor, another rig, the AMC of a BVH.

A clip's words are compared joint by joint, so motion of another body has to be put onto the joints
of the clip's. Where two bodies have joints of the same names, and their limbs point the same ways
at rest, a joint is turned against its parent as the joint of its name is, both seen from the rest
pose: that is how a BVH and the AMC that it was made of agree, whatever axes each has. Any other two
have to be human: then the segments of the one body are turned as those of the other
(`mocapdb.motion.body.segments`). Joints that the other body has not, or that lie between two
segments, as in the spine, have no counterpart: the context says nothing of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mocapdb.base.arrays import Float32Array, FloatArray
from mocapdb.cleaning.local_rotations import Texture, motion_texture, sampling, without_heading
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary
from mocapdb.cleaning.tuning import LEAST_COUNTERPARTS, SAME_TWIST_COSINE
from mocapdb.errors import SkeletonError
from mocapdb.motion.body import understand
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.body.segments import Segments
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import axis_rotations, forward_kinematics
from mocapdb.motion.quaternions import conjugate, continuous, from_matrices, multiply, slerp
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.tuning import SAME_REST_COSINE

__all__ = ["OtherMotion", "TargetBody", "context_of"]

BONES = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))


@dataclass(frozen=True, eq=False)
class OtherMotion:
    """A clip of any body, as it can be put onto another one.

    Attributes
    ----------
    name : str
    skeleton : Skeleton
    quat_xyzw : (F, J, 4) of float32
        World rotations, against the rest pose.
    fps : float, frames per second
    root : int
        The joint that carries the body.
    fixed : dict of str to (3, 3)
        The anatomical frame of each segment in the joint that turns it; empty where it is no whole
        human body.
    turns : dict of str to int
        Those joints.
    rest_ways : dict of (str, str) to (3,)
        The directions of the limbs' bones at rest; empty likewise.
    """

    name: str
    skeleton: Skeleton
    quat_xyzw: Float32Array
    fps: float
    root: int
    fixed: dict[str, FloatArray]
    turns: dict[str, int]
    rest_ways: dict[tuple[str, str], FloatArray]

    @classmethod
    def of(cls, clip: Clip, fps: float) -> OtherMotion:
        """Return a clip's world rotations at a rate, sampled as `motion_texture` does."""
        shown, first, second, between, rate = sampling(clip, fps)
        pose = forward_kinematics(clip.skeleton, clip.channels[shown])
        quats = continuous(from_matrices(pose.rotations))
        sampled = slerp(quats[first], quats[second], between[:, None])
        body = understand(clip.skeleton, clip.channels)
        fixed, turns, ways = {}, {}, {}
        if body.is_human:
            try:
                segments = Segments.of(clip.skeleton, pose, clip.name)
            except SkeletonError:
                pass  # a limb has no joint of its own: it can be told by names at best
            else:
                fixed, turns = segments.fixed_frames(), dict(segments.turns)
            ways = _rest_ways(clip.skeleton, body.joints.value)
        return cls(clip.name, clip.skeleton, sampled.astype(np.float32), rate, body.root.value,
                   fixed, turns, ways)  # fmt: skip


class TargetBody:
    """The body of a clip, onto which motion of others is put.

    Parameters
    ----------
    clip : Clip
    """

    def __init__(self, clip: Clip) -> None:
        self.texture = motion_texture(clip)
        self._clip = clip
        self._body = understand(clip.skeleton, clip.channels)
        self._rest_ways = _rest_ways(clip.skeleton, self._body.joints.value)

    def put_on(self, other: OtherMotion) -> tuple[Texture, tuple[int, ...]]:
        """Return a motion on the joints of this body, and the rows that it shows.

        Raises
        ------
        SkeletonError
            If the bodies have too little in common.
        """
        rows = self._rows_by_name(other)
        if rows is not None:
            local = self._by_names(other, rows)
        elif other.fixed and self._segments is not None:
            local, rows = self._by_segments(other)
        else:
            raise SkeletonError(
                f"Expected {other.name!r} and {self._clip.name!r} to be two human bodies, or to "
                f"have the same joints, but on skeleton {other.skeleton.name!r} "
                f"{len(other.skeleton.names)} joints do not map to {self._clip.skeleton.name!r}. "
                "Leave it out, or give its joints by --joint-map."
            )
        return Texture(
            self._clip.skeleton, self.texture.joints, continuous(local), other.fps, other.name
        ), rows

    @cached_property
    def _segments(self) -> Segments | None:
        """The segments of this body; None where it is no whole human one."""
        if not self._body.is_human:
            return None
        shown = sampling(self._clip, self.texture.fps)[0]
        pose = forward_kinematics(self._clip.skeleton, self._clip.channels[shown])
        try:
            return Segments.of(self._clip.skeleton, pose, self._clip.name)
        except SkeletonError:
            return None

    @cached_property
    def _axes(self) -> FloatArray:
        """(K, 4) the constant axis rotations of the rows' joints."""
        return from_matrices(axis_rotations(self._clip.skeleton)[self.texture.joints])

    def _in_own_axes(self, local: FloatArray) -> FloatArray:
        """Return rotations (F, K, 4) against the rest pose in the axes of the joints' channels."""
        return multiply(multiply(conjugate(self._axes), local), self._axes)

    # -- by names ----------------------------------------------------------------------------------

    def _rows_by_name(self, other: OtherMotion) -> tuple[int, ...] | None:
        """Return the rows whose joint the other body has by name; None where it is another rig."""
        own = self._clip.skeleton.names
        named = set(own) & set(other.skeleton.names)
        rows = [row for row, joint in enumerate(self.texture.joints) if own[joint] in named]
        if len(rows) < LEAST_COUNTERPARTS or not self._rest_alike(other):
            return None
        return tuple(rows)

    def _rest_alike(self, other: OtherMotion) -> bool:
        """Return whether the limbs of two human bodies point and bend the same ways at rest."""
        both = self._rest_ways.keys() & other.rest_ways.keys()
        if not both or self._clip.skeleton.up != other.skeleton.up or self._segments is None:
            return False
        own = self._fixed
        bends = [
            # the cosine of the angle between two frames, from the trace of their turn
            (float(np.sum(own[name] * other.fixed[name])) - 1.0) / 2.0 > SAME_TWIST_COSINE
            for bone in both
            if (name := bone[0]) in own and name in other.fixed
        ]
        ways = [float(self._rest_ways[b] @ other.rest_ways[b]) > SAME_REST_COSINE for b in both]
        return all(ways) and all(bends)

    @cached_property
    def _fixed(self) -> dict[str, FloatArray]:
        return {} if self._segments is None else self._segments.fixed_frames()

    def _by_names(self, other: OtherMotion, rows: tuple[int, ...]) -> FloatArray:
        own, theirs = self._clip.skeleton, other.skeleton
        local = np.full((len(other.quat_xyzw), len(self.texture.joints), 4), np.nan)
        for row in rows:
            joint = int(self.texture.joints[row])
            turned = other.quat_xyzw[:, theirs.joint(own.names[joint])].astype(np.float64)
            above = [
                theirs.joint(own.names[each])
                for each in own.chain_to_root(joint)[1:]
                if own.names[each] in theirs.names
            ]
            if above:
                parent = other.quat_xyzw[:, above[0]].astype(np.float64)
                turned = multiply(conjugate(parent), turned)
            local[:, row] = turned
        return self._with_level_root(self._in_own_axes(local))

    # -- by segments -------------------------------------------------------------------------------

    def _by_segments(self, other: OtherMotion) -> tuple[FloatArray, tuple[int, ...]]:
        from scipy.spatial.transform import Rotation

        assert self._segments is not None
        skeleton = self._clip.skeleton
        upright = _from_up_to_up(other.skeleton, skeleton)
        frames = {
            name: upright
            @ Rotation.from_quat(other.quat_xyzw[:, other.turns[name]]).as_matrix()
            @ fixed
            for name, fixed in other.fixed.items()
        }
        turned = self._segments.turned(frames, self._means, self._segments.rotations[0, 0])
        found = {self._segments.turns[name] for name in frames if name in self._segments.turns}
        joints = self.texture.joints
        above = np.maximum(skeleton.parents[joints], 0)
        local = np.einsum("fkji,fkjl->fkil", turned[:, above], turned[:, joints])
        at_top = skeleton.parents[joints] < 0
        local[:, at_top] = turned[:, joints[at_top]]
        quats = self._in_own_axes(from_matrices(local))
        shown = np.array([joint in found for joint in joints.tolist()])
        quats[:, ~shown] = np.nan
        rows = tuple(np.flatnonzero(shown).tolist())
        return self._with_level_root(quats), rows

    @cached_property
    def _means(self) -> FloatArray:
        """(J, 3, 3) the mean rotation of each joint against its parent."""
        from scipy.spatial.transform import Rotation

        assert self._segments is not None
        rotations = self._segments.rotations
        above = np.maximum(self._clip.skeleton.parents, 0)
        local = np.einsum("fjki,fjkl->fjil", rotations[:, above], rotations)
        means = [Rotation.from_matrix(local[:, j]).mean().as_matrix() for j in range(len(above))]
        return np.stack(means)

    def _with_level_root(self, quats: FloatArray) -> FloatArray:
        """Take the heading out of the joint that carries the body."""
        root = self._body.root.value
        row = np.flatnonzero(self.texture.joints == root)
        if len(row) and np.isfinite(quats[:, row[0]]).all():
            quats[:, row[0]] = without_heading(self._clip.skeleton, root, quats[:, row[0]])
        return quats


def context_of(
    clip: Clip, others: Iterable[OtherMotion], refused: dict[str, str] | None = None
) -> list[Vocabulary]:
    """Return motion of other bodies as vocabularies of a clip's joints, one for each set of rows.

    Parameters
    ----------
    clip : Clip
    others : iterable of OtherMotion
        At the rate of the clip's texture.
    refused : dict, optional
        Takes the reason for each clip that cannot be put onto this body; by default the first is
        raised.

    Raises
    ------
    SkeletonError
        If a body has too little in common with the clip's.
    """
    target = TargetBody(clip)
    by_rows: dict[tuple[int, ...], list[Texture]] = {}
    for other in others:
        try:
            texture, rows = target.put_on(other)
        except SkeletonError as problem:
            if refused is None:
                raise
            refused[other.name] = str(problem)
        else:
            by_rows.setdefault(rows, []).append(texture)
    return [
        Vocabulary.of(textures, rows=np.array(rows)).without_copies(target.texture)
        for rows, textures in by_rows.items()
    ]


def _rest_ways(skeleton: Skeleton, joints: Mapping[str, int]) -> dict[tuple[str, str], FloatArray]:
    """Return the directions of the limbs' bones at rest, of a human body's joints."""
    rest = skeleton.rest_positions
    ways = {}
    for side in SIDES:
        for start, end in BONES:
            names = f"{side}_{start}", f"{side}_{end}"
            if not all(name in joints for name in names):
                continue
            way = rest[joints[names[1]]] - rest[joints[names[0]]]
            ways[names] = way / max(float(np.linalg.norm(way)), 1e-12)
    return ways


def _from_up_to_up(one: Skeleton, other: Skeleton) -> FloatArray:
    """Return the rotation (3, 3) that brings the one's vertical axis to the other's."""
    if one.up_index == other.up_index:
        return np.eye(3)
    quarter = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # y to z
    return quarter if one.up_index == 1 else quarter.T
