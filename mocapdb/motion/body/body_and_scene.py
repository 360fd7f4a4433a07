"""Parting a body from the scene: from the joints above it that carry no more than the stage."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.motion.body.understanding import understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import Pose, channels_from_pose, forward_kinematics
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Scene", "part_from_scene"]

SHIFTS = ("tx", "ty", "tz")


@dataclass(frozen=True)
class Scene:
    """What a body was parted from.

    Attributes
    ----------
    skeleton : Skeleton
        The whole one.
    joints : (K,)
        Which of its joints are the body's, its root first.
    channels : (C,)
        The whole one's channels in the first frame.
    """

    skeleton: Skeleton
    joints: IntArray
    channels: FloatArray

    def put_back(self, clip: Clip) -> Clip:
        """Return a clip of the body on the whole skeleton, the scene as it was in the first frame.

        A body whose root has no position channels in the whole skeleton comes back as it is.
        """
        root = int(self.joints[0])
        if not set(SHIFTS) <= set(self.skeleton.dofs[root]):
            return clip
        channels = np.tile(self.channels, (len(clip), 1))
        whole = forward_kinematics(self.skeleton, channels)
        body = forward_kinematics(clip.skeleton, clip.channels)
        whole.positions[:, self.joints] = body.positions
        whole.rotations[:, self.joints] = body.rotations
        top = channels_from_pose(self.skeleton, whole)
        own = _columns(self.skeleton, self.joints[:1])
        rest, rest_of_body = (
            _columns(self.skeleton, self.joints[1:]),
            _columns(clip.skeleton, np.arange(1, clip.skeleton.n_joints)),
        )
        channels[:, own] = top[:, own]
        channels[:, rest] = clip.channels[:, rest_of_body]
        return replace(clip, skeleton=self.skeleton, channels=channels)


def part_from_scene(clip: Clip) -> tuple[Clip, Scene | None]:
    """Return a clip whose first joint carries the body, and the scene that was left out.

    Every joint stays where it is in the world; joints that do not hang on the body's root are
    left out. A clip whose first joint carries the body comes back as it is, without a scene.
    """
    skeleton = clip.skeleton
    if skeleton.convention != "bvh":
        return clip, None
    root = skeleton.body_root or understand(skeleton, clip.channels).root.value
    if root == 0:
        return clip, None
    joints = [root]
    for joint in range(root + 1, skeleton.n_joints):
        if int(skeleton.parents[joint]) in joints:
            joints.append(joint)
    kept = np.array(joints)
    index = {joint: i for i, joint in enumerate(joints)}
    order = skeleton.rotation_orders[root]
    turns = [dof for dof in skeleton.dofs[root] if dof[0] == "r"]
    if len(order) < 3:
        order, turns = "ZXY", ["rz", "rx", "ry"]
    body = Skeleton(
        names=[skeleton.names[joint] for joint in joints],
        parents=[-1, *(index[int(skeleton.parents[joint])] for joint in joints[1:])],
        offsets=np.concatenate([np.zeros((1, 3)), skeleton.offsets[kept[1:]]]),
        dofs=[(*SHIFTS, *turns), *(skeleton.dofs[joint] for joint in joints[1:])],
        rotation_orders=[order, *(skeleton.rotation_orders[joint] for joint in joints[1:])],
        convention="bvh",
        metres_per_unit=skeleton.metres_per_unit,
        up=skeleton.up,
        name=skeleton.name,
        displaces=skeleton.displaces,
        joint_map={
            joint: name
            for joint, name in skeleton.joint_map.items()
            if skeleton.names.index(name) in index
        },
    )
    pose = forward_kinematics(skeleton, clip.channels)
    channels = np.empty((len(clip), body.n_channels))
    own = np.arange(len(body.dofs[0]))
    alone = Skeleton(
        body.names[:1], [-1], body.offsets[:1], body.dofs[:1], [order], convention="bvh"
    )
    channels[:, own] = channels_from_pose(
        alone, Pose(pose.positions[:, [root]], pose.rotations[:, [root]])
    )
    channels[:, len(own) :] = clip.channels[:, _columns(skeleton, kept[1:])]
    return (
        replace(clip, skeleton=body, channels=channels),
        Scene(skeleton, kept, clip.channels[0]),
    )


def _columns(skeleton: Skeleton, joints: IntArray) -> IntArray:
    """Return the channels of some joints, in their order."""
    starts = skeleton.channel_starts
    return np.array(
        [column for joint in joints for column in range(starts[joint], starts[joint + 1])],
        dtype=np.int64,
    )
