"""Joints keep their own motion: what breaks that bound counts more in the metric.

A mean over the skin hardly notices a hand, a jaw or a fingertip. So the error of a joint's own
rotation and translation gets a row in the metric (see `skin_metric.metric_factors`): of all frames
where its root mean square is too large, and of the frames around an extreme where that is missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray
from mocapdb.compression import tuning
from mocapdb.compression.targets import Target
from mocapdb.motion.joint_errors import JointMotion, missing_swing, own_errors
from mocapdb.motion.kinematics import Pose
from mocapdb.motion.skeleton import Skeleton

__all__ = ["OwnErrors", "OwnMotion", "OwnWeights", "Posed"]

_HELD = 1.0 - 1e-6  # what `decode` gives differs in the last digits


class Posed(NamedTuple):
    """Channels (F, C) of some frames, and the poses that they bring a skeleton into."""

    values: FloatArray
    pose: Pose


@dataclass(frozen=True)
class OwnErrors:
    """Errors of the joints' own motion, as multiples of what is allowed.

    Attributes
    ----------
    n_frames : int
    rms : (2, J)
        Of rotation and translation.
    missing : (2, 2, J)
        What either end of the swing misses; 0 for ends elsewhere.
    costs : (2, J)
        What a squared error cost at the least, in squared skeleton units a squared degree or
        millimetre.
    """

    n_frames: int
    rms: FloatArray
    missing: FloatArray
    costs: FloatArray

    @property
    def highest(self) -> float:
        """The largest of a whole clip; up to 1 the bounds hold."""
        return float(max(self.rms.max(initial=0.0), self.missing.sum(axis=0).max(initial=0.0)))

    def times(self, factor: float) -> OwnErrors:
        """Return those of another step, as if errors were in proportion to it."""
        return replace(self, rms=factor * self.rms, missing=factor * self.missing)

    @property
    def alone(self) -> OwnErrors:
        """Those of a block of which the rest is not known: each end counts for both."""
        ends = self.missing.max(axis=0)
        return replace(self, missing=np.stack([ends, ends]))

    @classmethod
    def over(cls, parts: Sequence[OwnErrors]) -> OwnErrors:
        """Return those of several blocks together."""
        shares = np.array([part.n_frames for part in parts], dtype=np.float64)
        n_frames = int(shares.sum())
        shares /= n_frames
        squares = np.tensordot(shares, [part.rms**2 for part in parts], axes=1)
        costs = np.tensordot(shares, [part.costs for part in parts], axes=1)
        missing = np.sum([part.missing for part in parts], axis=0)
        return cls(n_frames, np.sqrt(squares), missing, costs)


@dataclass(frozen=True)
class OwnWeights:
    """What squared errors of the joints' own motion cost besides, in the units of `OwnErrors`.

    Attributes
    ----------
    always : (2, J)
    at_ends : (2, 2, J)
        Around the two ends of the swing, besides.
    """

    always: FloatArray
    at_ends: FloatArray

    @property
    def are_any(self) -> bool:
        """Whether one of them is not zero."""
        return bool(self.always.any() or self.at_ends.any())


class OwnMotion:
    """What the joints of a clip have to keep of their own motion.

    Parameters
    ----------
    target : Target
    skeleton : Skeleton
        With the orders of axes in which the channels are coded.
    motion : JointMotion
    fps : float
    """

    def __init__(self, target: Target, skeleton: Skeleton, motion: JointMotion, fps: float) -> None:
        self.skeleton = skeleton
        self.motion = motion
        self.allowed_rms = _HELD * target.allowed_rms(motion)
        self.allowed_loss = tuning.SWING_HELD * target.allowed_loss(motion)
        self.reach = round(0.5 * tuning.ENDS_WINDOW_S * fps)
        self.unit_mm = 1000.0 * skeleton.metres_per_unit
        letters = [dof[0] for dofs in skeleton.dofs for dof in dofs]
        joints = np.repeat(np.arange(skeleton.n_joints), np.diff(skeleton.channel_starts))
        self._places = np.array(["rt".index(each) for each in letters], dtype=np.int64), joints

    def no_weights(self) -> OwnWeights:
        """Return what the joints' own errors cost to begin with: nothing."""
        return OwnWeights(np.zeros_like(self.allowed_rms), np.zeros(self.motion.ends.shape))

    def measure(
        self, first: int, source: Posed, decoded: Posed, costs: FloatArray | None
    ) -> OwnErrors:
        """Return how near a block comes to the bounds.

        Parameters
        ----------
        first : int
            The block's first frame.
        source, decoded : Posed
            Its smooth channels, and what is decoded.
        costs : (C,), optional
            What squared errors of the channels cost, in squared skeleton units; None where it is
            not channels that were coded.
        """
        errors = own_errors(self.skeleton, *source, *decoded)
        rms = np.sqrt((errors * errors).mean(axis=1)) / self.allowed_rms
        missing = missing_swing(self.skeleton, self.motion, *decoded, first) / self.allowed_loss
        return OwnErrors(len(source.values), rms, missing, self._own_costs(costs))

    def raised(self, weights: OwnWeights, errors: OwnErrors, step: float) -> OwnWeights:
        """Return more weight on what breaks a bound.

        Parameters
        ----------
        weights : OwnWeights
            With which the errors came about.
        errors : OwnErrors
        step : float
            The step of quantisation, in skeleton units.
        """
        costs = np.maximum(errors.costs, weights.always)
        always = _raised(
            weights.always, costs, errors.rms, self.allowed_rms, step, tuning.OWN_OVERSHOOT
        )
        together = errors.missing.sum(axis=0)
        is_due = errors.missing >= 0.5 * together  # the end that misses more, or both
        at_ends = _raised(
            weights.at_ends,
            costs + weights.at_ends,
            np.where(is_due, together, 0.0),
            0.5 * self.allowed_loss,
            step,
            tuning.ENDS_OVERSHOOT,
        )
        return OwnWeights(always, at_ends)

    @staticmethod
    def changed(before: OwnWeights, now: OwnWeights) -> BoolArray:
        """Return the joints (J,) whose weights differ."""
        differ = (before.always != now.always).any(axis=0)
        is_other: BoolArray = differ | (before.at_ends != now.at_ends).any(axis=(0, 1))
        return is_other

    def rows(self, weights: OwnWeights, frames: slice) -> FloatArray:
        """Return the weights of some frames (2, F, J), in squared skeleton units (or pure)."""
        n_frames = frames.stop - frames.start
        rows = np.repeat(weights.always[:, None], n_frames, axis=1)
        for end, kind, joint in np.argwhere(weights.at_ends):
            at = int(self.motion.ends[end, kind, joint]) - frames.start
            first, stop = max(at - self.reach, 0), at + self.reach + 1
            if stop > 0 and first < n_frames:
                rows[kind, first:stop, joint] += weights.at_ends[end, kind, joint]
        rows[1] *= self.unit_mm**2
        return rows

    def _own_costs(self, costs: FloatArray | None) -> FloatArray:
        """Return what a squared error of each joint's own costs at the least (2, J)."""
        if costs is None:
            return np.zeros((2, self.skeleton.n_joints))
        own = np.full((2, self.skeleton.n_joints), np.inf)
        np.minimum.at(own, self._places, costs)
        own[np.isinf(own)] = 0.0
        own[1] /= self.unit_mm**2
        return own


def _raised(
    weights: FloatArray,
    costs: FloatArray,
    errors: FloatArray,
    allowed: FloatArray,
    step: float,
    overshoot: float,
) -> FloatArray:
    """Return weights with which errors, multiples of what is allowed, should come below 1.

    An error falls with the root of what it costs. One of a channel that was held still says too
    little: at its bound it shall cost at least a square step. Those near their bound weigh more
    too, since they may break it the next time.
    """
    wanted = costs * (overshoot * errors) ** 2
    wanted = np.maximum(wanted, (step / allowed) ** 2)
    return np.where(errors > tuning.OWN_NEAR, weights + np.maximum(wanted - costs, 0.0), weights)
