"""The simpler detectors that the paper compares with (Aristidou 2018, section 6, table 1).

==================  ==============================================================================
`JointLimits`       (a) a joint is turned further than any clean clip turns it
`DerivativeLimits`  (b) a joint turns faster than in any clean clip
both                (c) either of the two
==================  ==============================================================================
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mocapdb._typing import BoolArray, FloatArray
from mocapdb.cleaning.texture import angles_deg, joint_columns, local_rotations
from mocapdb.errors import SkeletonError
from mocapdb.motion.clip import Clip

__all__ = ["DerivativeLimits", "JointLimits"]


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
            columns = joint_columns(skeleton, joint)
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
