"""Clouds of poses: what of a clip is looked at when its period is searched.

`pose_cloud`        a row for each frame: joint positions, angles, or rotations
`Embedding`         the choices of both, in one place
`delay_embedding`   each row followed by later ones, so that the same pose moving back differs
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.cycles.curve.rotation_values import euler_rotations
from mocapdb.cycles.tuning import EMBEDDING_AXES
from mocapdb.errors import CycleError
from mocapdb.motion.clip import Clip
from mocapdb.motion.heading import heading_angles
from mocapdb.motion.kinematics import forward_kinematics, to_metres
from mocapdb.motion.rotations import continuous_angles, elementary
from mocapdb.motion.skeleton import Skeleton

__all__ = [
    "Embedding",
    "Features",
    "RootTreatment",
    "aligned_positions",
    "delay_embedding",
    "joint_angles",
    "pose_cloud",
    "principal_axes",
]

Features: TypeAlias = Literal["positions", "angles", "rotations"]
RootTreatment: TypeAlias = Literal["drop", "orientation", "differences"]
DEGENERATE = 1e-12  # spreads and lengths below it are zero up to rounding


def pose_cloud(
    clip: Clip,
    features: Features = "positions",
    *,
    root: RootTreatment = "drop",
    joints: Sequence[str] | None = None,
    by_bone_length: bool = False,
    normalise: bool = False,
    n_components: int | None = None,
) -> FloatArray:
    """Return one row of numbers (F, D) for each frame of a clip.

    Parameters
    ----------
    clip : Clip
    features : {"positions", "angles", "rotations"}
        Joint positions in metres, seen from the root and its heading; continuous Euler angles in
        radians; or the first two columns of each joint's rotation, which are continuous whatever
        the Euler angles do.
    root : {"drop", "orientation", "differences"}
        What is kept of the root beside positions of the other joints: nothing, its orientation
        (Raunio 2014), or the steps of its translation and orientation from frame to frame, in
        skeleton units and radians (Vejdemo-Johansson et al. 2015, section 4.1).
    joints : sequence of str, optional
        Only these joints; all by default.
    by_bone_length : bool
        Whether a joint counts by the length of its bones (Raunio 2014, chapter 4), so that a finger
        counts little: of positions the square by the bone that ends there, relative to the longest
        one; of rotations by the longest chain of bones that the joint carries, in metres.
    normalise : bool
        Whether each dimension is divided by its standard deviation, before it is weighted.
    n_components : int, optional
        Project on so many principal axes.

    Raises
    ------
    CycleError
        If a name of a feature or treatment is unknown.
    SkeletonError
        If a joint is unknown.
    """
    _expect("features", features, get_args(Features))
    _expect("root", root, get_args(RootTreatment))
    skeleton = clip.skeleton
    chosen = range(skeleton.n_joints) if joints is None else [skeleton.joint(j) for j in joints]
    if features == "positions":
        positions = aligned_positions(clip)
        blocks = [positions[:, joint] for joint in chosen]
        weights = [_length_weights(skeleton)[joint] for joint in chosen]
    else:
        chosen = [joint for joint in chosen if joint != 0 or root == "orientation"]
        blocks = [_joint_features(clip, joint, features) for joint in chosen]
        weights = [_reach_m(skeleton)[joint] for joint in chosen]
    if features == "positions" and root == "orientation":
        blocks.append(_joint_features(clip, 0, "rotations"))
    if root == "differences":
        blocks.append(_root_steps(clip))
    cloud = np.hstack(blocks) if blocks else np.empty((len(clip), 0))
    if cloud.shape[1] == 0:
        raise CycleError("Expected joints that move, but those chosen have no channels.")
    if normalise:
        spread = cloud.std(axis=0)
        cloud /= np.where(spread > DEGENERATE, spread, 1.0)
    if by_bone_length:
        weights += [1.0] * (len(blocks) - len(weights))
        cloud *= np.repeat(weights, [block.shape[1] for block in blocks])
    return cloud if n_components is None else principal_axes(cloud, n_components)


@dataclass(frozen=True)
class Embedding:
    """What of a clip is looked at when its period is searched, and how it is embedded.

    The defaults are what the automatic path uses.

    Attributes
    ----------
    features, root, joints, by_bone_length, normalise, n_components
        See `pose_cloud`.
    delays, lag : int, optional
        See `find_coordinates`; `lag` in frames.
    join_neighbours : bool
        See `CircularCoordinates`.
    """

    features: Features = "positions"
    root: RootTreatment = "drop"
    joints: tuple[str, ...] | None = None
    by_bone_length: bool = True
    normalise: bool = False
    n_components: int | None = EMBEDDING_AXES
    delays: int | None = None
    lag: int | None = None
    join_neighbours: bool = False

    def __post_init__(self) -> None:
        _expect("features", self.features, get_args(Features))
        _expect("root", self.root, get_args(RootTreatment))
        for name, least in (("n_components", 1), ("delays", 0), ("lag", 1)):
            value = getattr(self, name)
            if value is not None and value < least:
                raise CycleError(f"Expected {name} of {least} or more, but got {value}.")

    def cloud(self, clip: Clip) -> FloatArray:
        """Return one row of numbers (F, D) for each frame of a clip."""
        return pose_cloud(
            clip,
            self.features,
            root=self.root,
            joints=self.joints,
            by_bone_length=self.by_bone_length,
            normalise=self.normalise,
            n_components=self.n_components,
        )


def delay_embedding(values: FloatArray, factor: int, lag: int = 1) -> FloatArray:
    """Return rows (F - factor lag, (factor + 1) D) of each row and `factor` later ones.

    Parameters
    ----------
    values : (F, D)
    factor : int
        How many later rows are appended (Raunio 2014, eq. 3.26).
    lag : int, frames
        How far they are apart.

    Raises
    ------
    CycleError
        If nothing is left.
    """
    n_left = len(values) - factor * lag
    if factor < 0 or lag < 1 or n_left < 1:
        raise CycleError(
            f"Expected a delay shorter than the {len(values)} frames, but got {factor} times "
            f"{lag}. Use a smaller factor or lag."
        )
    return np.hstack([values[k * lag : k * lag + n_left] for k in range(factor + 1)])


def aligned_positions(clip: Clip) -> FloatArray:
    """Return joint positions (F, J, 3) in metres, Y up, seen from the root and its heading."""
    skeleton = clip.skeleton
    positions, rotations = forward_kinematics(skeleton, clip.channels)
    yaw = heading_angles(rotations[:, 0], skeleton.up_index)
    back = elementary(skeleton.up_axis, -yaw)
    local = np.einsum("fij,fkj->fki", back, positions - positions[:, :1])
    return to_metres(skeleton, local)


def joint_angles(clip: Clip) -> FloatArray:
    """Return the clip's rotation channels in radians (F, A), continuous over time.

    Where three angles have jumped to their other form, or by full turns, they are brought back.
    """
    skeleton = clip.skeleton
    radians = np.deg2rad(clip.channels)
    for joint, order in enumerate(skeleton.rotation_orders):
        if order:
            columns = skeleton.rotation_columns(joint)
            radians[:, columns] = continuous_angles(order, radians[:, columns])
    return np.asarray(radians[:, skeleton.rotation_channels])


def principal_axes(cloud: FloatArray, n_components: int) -> FloatArray:
    """Return the cloud on its first principal axes, as (F, n_components) or fewer."""
    if n_components < 1:
        raise CycleError(f"Expected 1 principal axis at least, but got {n_components}.")
    centred = cloud - cloud.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    return np.asarray(centred @ axes[:, ::-1][:, :n_components])


def _expect(what: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise CycleError(f"Expected {what} out of {', '.join(allowed)}, but got {value!r}.")


def _joint_features(clip: Clip, joint: int, features: Features) -> FloatArray:
    """Return the angles (F, n) of a joint in radians, or two columns (F, 6) of its rotation."""
    skeleton = clip.skeleton
    order = skeleton.rotation_orders[joint]
    if not order:
        return np.empty((len(clip), 0))
    columns = skeleton.rotation_columns(joint)
    angles = continuous_angles(order, np.deg2rad(clip.channels[:, columns]))
    if features == "angles":
        return angles
    return np.asarray(euler_rotations(order, angles)[:, :, :2].reshape(len(clip), 6))


def _root_steps(clip: Clip) -> FloatArray:
    """Return the steps of the root's channels (F, n): the last is repeated."""
    skeleton = clip.skeleton
    stop = int(skeleton.channel_starts[1])
    channels = clip.channels[:, :stop].copy()
    turning = [i for i, dof in enumerate(skeleton.dofs[0]) if dof[0] == "r"]
    channels[:, turning] = np.unwrap(np.deg2rad(channels[:, turning]), axis=0)
    steps = np.diff(channels, axis=0)
    if len(steps) == 0:
        return np.zeros_like(channels)
    return np.asarray(np.vstack([steps, steps[-1:]]))


def _length_weights(skeleton: Skeleton) -> FloatArray:
    """Return (J,) weights whose squares go with the length of the bone that ends in each joint."""
    lengths = np.linalg.norm(skeleton.offsets, axis=1)
    return np.asarray(np.sqrt(lengths / max(lengths[1:].max(initial=0.0), DEGENERATE)))


def _reach_m(skeleton: Skeleton) -> FloatArray:
    """Return (J,) the length in metres of the longest chain of bones that each joint carries."""
    lengths = np.linalg.norm(skeleton.offsets, axis=1) * skeleton.metres_per_unit
    own = lengths if skeleton.convention == "acclaim" else np.zeros_like(lengths)
    reach = own.copy()
    for joint in range(skeleton.n_joints - 1, 0, -1):
        parent = skeleton.parents[joint]
        below = reach[joint] + (0.0 if skeleton.convention == "acclaim" else lengths[joint])
        reach[parent] = max(reach[parent], own[parent] + below)
    return np.asarray(reach)
