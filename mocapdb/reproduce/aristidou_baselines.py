"""What the paper compares with (Aristidou 2018, section 6, table 1).

===========================  =====================================================================
`JointLimits`                (a) a joint is turned further than any clean clip turns it
`DerivativeLimits`           (b) a joint turns faster than in any clean clip
both                         (c) either of the two
`chai_hodgins_neighbours`    neighbours by joint positions and velocities (Chai and Hodgins 2005)
===========================  =====================================================================
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.cleaning.local_rotations import Texture, local_rotations, motion_texture
from mocapdb.cleaning.neighbours import _word_warping as warping
from mocapdb.cleaning.neighbours._neighbour_kernels import search_matrix
from mocapdb.cleaning.neighbours.nearest_words import Neighbours, Vocabulary, gathered
from mocapdb.cleaning.tuning import N_NEIGHBOURS, SOURCE_FRAMES, STRIDE
from mocapdb.errors import ClipError, SkeletonError
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.quaternions import angles_deg

__all__ = ["DerivativeLimits", "JointLimits", "chai_hodgins_neighbours"]

VELOCITY_WEIGHT = 0.2  # Chai and Hodgins' alpha is 0.8, of positions


@dataclass(frozen=True, eq=False)
class JointLimits:
    """The range of every angle of every joint in clean clips.

    Attributes
    ----------
    names : tuple of str
        Joints of the skeleton.
    low_deg, high_deg : (C,)
        Ranges of the channels; of translations, without limits.
    """

    names: tuple[str, ...]
    low_deg: FloatArray
    high_deg: FloatArray

    @classmethod
    def learn(cls, clips: Iterable[Clip]) -> JointLimits:
        """Take the ranges of clips of one skeleton family.

        Raises
        ------
        SkeletonError
            If there is no clip, or the clips have different joints.
        """
        several = list(clips)
        names = _common_names(several)
        n_channels = several[0].skeleton.n_channels
        low, high = np.full(n_channels, -np.inf), np.full(n_channels, np.inf)
        angles = several[0].skeleton.rotation_channels
        together = np.concatenate([_half_turns(clip.channels[:, angles]) for clip in several])
        low[angles], high[angles] = together.min(axis=0), together.max(axis=0)
        return cls(names, low, high)

    def flag(self, clip: Clip) -> BoolArray:
        """Return (F, J) whether a joint is outside its range."""
        _check_names(self.names, clip)
        skeleton = clip.skeleton
        flagged = np.zeros((len(clip), skeleton.n_joints), dtype=np.bool_)
        for joint, order in enumerate(skeleton.rotation_orders):
            if joint == 0 or not order:  # the root may face anywhere
                continue
            columns = skeleton.rotation_columns(joint)
            angles = _half_turns(clip.channels[:, columns])
            outside = (angles < self.low_deg[columns]) | (angles > self.high_deg[columns])
            flagged[:, joint] = outside.any(axis=1)
        return flagged


@dataclass(frozen=True, eq=False)
class DerivativeLimits:
    """The largest speed of every joint in clean clips.

    Attributes
    ----------
    names : tuple of str
        Joints of the skeleton.
    speeds_deg_s : (J,)
        Degrees a second; zero for joints that do not rotate.
    """

    names: tuple[str, ...]
    speeds_deg_s: FloatArray

    @classmethod
    def learn(cls, clips: Iterable[Clip]) -> DerivativeLimits:
        """Take the largest speeds of clips of one skeleton family.

        Raises
        ------
        SkeletonError
            If there is no clip, or the clips have different joints.
        """
        several = list(clips)
        names = _common_names(several)
        return cls(names, np.max([_speeds(clip).max(axis=0) for clip in several], axis=0))

    def flag(self, clip: Clip) -> BoolArray:
        """Return (F, J) whether a joint turns too fast from a frame or to it."""
        _check_names(self.names, clip)
        fast = _speeds(clip) > self.speeds_deg_s
        flagged = np.zeros((len(clip), clip.skeleton.n_joints), dtype=np.bool_)
        flagged[:-1] |= fast
        flagged[1:] |= fast
        return flagged


def chai_hodgins_neighbours(
    clip: Clip, context: Sequence[Clip] = (), *, k: int = N_NEIGHBOURS
) -> Neighbours:
    """Find the K nearest words by the time-warped distance of Chai and Hodgins (2005).

    The squared distance of two frames is that of joint positions in the root's frame, plus a
    weight times that of their changes from frame to frame.

    Parameters
    ----------
    clip : Clip
    context : sequence of Clip
        Others of the same joints; the clip itself always counts.
    k : int

    Raises
    ------
    ClipError
        If the clip is shorter than a word.
    SkeletonError
        If joints differ.
    """
    texture = motion_texture(clip)
    textures = [texture, *(motion_texture(other, texture.fps) for other in context)]
    vocabulary = Vocabulary.of(textures)
    if len(texture) < SOURCE_FRAMES:
        raise ClipError(f"Expected {clip.name!r} to have a word, but it has {len(texture)} frames.")
    poses = np.concatenate(
        [_pose_features(c, t) for c, t in zip((clip, *context), textures, strict=True)]
    )
    own = poses[: len(texture)]
    squares = (own**2).sum(axis=1)[:, None] + (poses**2).sum(axis=1) - 2.0 * own @ poses.T
    # in units of the mean distance, so that whole numbers are fine enough
    units = np.maximum(squares, 0.0) / max(float(squares.mean()), 1e-12) / warping.UNIT
    padding = vocabulary.quats.shape[2] - len(vocabulary)
    matrix = np.pad(np.minimum(units, warping.LARGEST), ((0, 0), (0, padding)), mode="edge")
    starts = np.arange(0, len(texture) - SOURCE_FRAMES + 1, STRIDE)
    targets = np.full((len(starts), k), -1, dtype=np.int64)
    distances = np.full((len(starts), k), np.inf)
    frames = np.full((len(starts), k, SOURCE_FRAMES), np.nan)
    search_matrix(matrix.astype(np.int32), starts, vocabulary.valid, 0, targets, distances, frames)
    return gathered(vocabulary, starts, targets, distances, frames)


def _pose_features(clip: Clip, texture: Texture) -> FloatArray:
    """Return (F, D) joint positions in the root's frame and their weighted changes."""
    at = np.minimum(np.round(np.arange(len(texture)) * clip.fps / texture.fps), len(clip) - 1)
    pose = forward_kinematics(clip.skeleton, clip.channels[at.astype(np.int64)])
    around = pose.positions - pose.positions[:, :1]
    local = np.einsum("fij,fki->fkj", pose.rotations[:, 0], around) * clip.skeleton.metres_per_unit
    flat = local.reshape(len(local), -1)
    steps = np.gradient(flat, axis=0) if len(flat) > 1 else np.zeros_like(flat)
    return np.concatenate(
        [np.sqrt(1.0 - VELOCITY_WEIGHT) * flat, np.sqrt(VELOCITY_WEIGHT) * steps], axis=1
    )


def _speeds(clip: Clip) -> FloatArray:
    """Return (F - 1, J) the speeds of all joints, in degrees a second."""
    texture = local_rotations(clip)
    speeds = np.zeros((len(clip) - 1, clip.skeleton.n_joints))
    quats = texture.quat_xyzw
    speeds[:, texture.joints] = angles_deg(quats[:-1], quats[1:]) * clip.fps
    return speeds


def _half_turns(angles: FloatArray) -> FloatArray:
    return np.asarray((angles + 180.0) % 360.0 - 180.0)


def _common_names(clips: list[Clip]) -> tuple[str, ...]:
    if not clips or any(clip.skeleton.names != clips[0].skeleton.names for clip in clips):
        raise SkeletonError(
            "Expected clean clips of one family of skeletons to learn from, but got "
            f"{'several families' if clips else 'none'}."
        )
    return clips[0].skeleton.names


def _check_names(names: tuple[str, ...], clip: Clip) -> None:
    if clip.skeleton.names != names:
        raise SkeletonError(
            f"Expected the joints that the limits were learnt from, but {clip.name!r} has others."
        )
