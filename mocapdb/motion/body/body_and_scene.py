"""Parting a body from the scene: from the joints above it that carry no more than the stage."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.motion.body.understanding import understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_edits import SHIFTS, columns_of, only_below
from mocapdb.motion.kinematics import channels_from_pose, forward_kinematics
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Scene", "part_from_scene"]


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
        own = columns_of(self.skeleton, self.joints[:1])
        rest, rest_of_body = (
            columns_of(self.skeleton, self.joints[1:]),
            columns_of(clip.skeleton, np.arange(1, clip.skeleton.n_joints)),
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
    body, channels = only_below(skeleton, clip.channels, root)
    return (
        replace(clip, skeleton=body, channels=channels),
        Scene(skeleton, np.array(joints), clip.channels[0]),
    )
