"""The gait of a clip: events, strides, joint angles over the stride, left against right."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import GaitError
from mocapdb.gait.calibration import calibrate
from mocapdb.gait.feet import Walker, understand_walker
from mocapdb.gait.foot_events import (
    FootContact,
    air_shares,
    find_foot_contacts,
    resting_speed,
    usual_resting_speed,
)
from mocapdb.gait.joint_angles import joint_angles, over_stride
from mocapdb.gait.strides import MEASURES, Stride, find_strides
from mocapdb.gait.tuning import FALL_TOLD, SLIDING_TOLD
from mocapdb.motion.body.canonical_joints import SIDES
from mocapdb.motion.clip import Clip

__all__ = ["GaitAnalysis", "Spread", "analyse_gait"]

REFUSED_TOLD = 3


@dataclass(frozen=True)
class Spread:
    """Mean and spread of something over strides.

    Attributes
    ----------
    mean, sd : float
        The standard deviation is of a sample (n - 1); NaN for a single stride.
    n : int
    """

    mean: float
    sd: float
    n: int

    @classmethod
    def of(cls, values: list[float]) -> Spread:
        """Return those of some values, one at least."""
        sd = float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")
        return cls(float(np.mean(values)), sd, len(values))

    @property
    def cv_pct(self) -> float:
        """The coefficient of variation, in percent."""
        return 100.0 * self.sd / abs(self.mean) if self.mean else float("nan")


@dataclass(frozen=True)
class GaitAnalysis:
    """The gait of a clip.

    Attributes
    ----------
    walker : Walker
    contacts : (left, right)
        Every contact of each foot.
    strides : list of Stride
        In order of time.
    curves : dict
        For each side, joint and angle (N, 101): each of its strides at 0 to 100 %, in degrees.
    zero : str
        What zero means of the angles.
    notes : tuple of str
        What was assumed, and the first few of `refused`.
    refused : tuple of str
        Which strides are none, and why.
    """

    walker: Walker
    contacts: tuple[list[FootContact], list[FootContact]]
    strides: list[Stride]
    curves: dict[tuple[str, str, str], FloatArray] = field(repr=False)
    zero: str
    notes: tuple[str, ...]
    refused: tuple[str, ...] = ()

    @property
    def clip(self) -> Clip:
        """What was looked at."""
        return self.walker.clip

    def of_side(self, side: str) -> list[Stride]:
        """Return the strides of one side."""
        return [stride for stride in self.strides if stride.side == side]

    def spreads(self, side: str | None = None) -> dict[str, Spread]:
        """Return mean and spread of each measure, of one side or of all strides."""
        strides = self.strides if side is None else self.of_side(side)
        if not strides:
            return {}
        return {
            name: Spread.of([float(getattr(stride, name)) for stride in strides])
            for name in MEASURES
        }

    def asymmetry_pct(self) -> dict[str, float]:
        """Return the symmetry index of each measure that both sides have, in percent.

        ``100 (left - right) / ((left + right) / 2)``, zero for a symmetric gait (Robinson et al.,
        J. Manipulative and Physiological Therapeutics 10, 1987).
        """
        left, right = (self.spreads(side) for side in SIDES)
        return {
            name: 200.0 * (left[name].mean - right[name].mean) / total
            for name in left.keys() & right.keys()
            if name not in ("turn_deg", "rise_m")
            and abs(total := left[name].mean + right[name].mean) > 1e-9
        }

    def mean_curves(self) -> dict[tuple[str, str, str], tuple[FloatArray, FloatArray]]:
        """Return (101,) mean and standard deviation of each curve; NaN where there is but one."""
        return {
            key: (
                laps.mean(axis=0),
                laps.std(axis=0, ddof=1) if len(laps) > 1 else np.full(101, np.nan),
            )
            for key, laps in self.curves.items()
        }


def analyse_gait(clip: Clip) -> GaitAnalysis:
    """Return the gait of a clip, from motion alone.

    Parameters
    ----------
    clip : Clip
        Of any body of two legs; what comes before and after the gait may be something else.

    Raises
    ------
    GaitError
        If the body has not two legs, or no stride is completed.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> gait = analyse_gait(synthetic.make_clip("walk", seed=1))
    >>> len(gait.strides), round(gait.spreads()["cadence_steps_min"].mean)
    (8, 110)
    """
    walker = understand_walker(clip)
    if len(clip) > 1 and not np.diff(clip.channels, axis=0).any():
        raise GaitError(
            f"Expected a gait, but nothing moves in {clip.name or 'the clip'!r}: all of its "
            f"{len(clip)} frames are one pose."
        )
    resting = resting_speed(walker)
    contacts = find_foot_contacts(walker, resting)
    strides, refused = find_strides(walker, contacts)
    if not strides:
        why = f": the {refused[0]}" if refused else ""
        counts = " and ".join(
            f"{len(found)} of the {side} foot" for side, found in zip(SIDES, contacts, strict=True)
        )
        name = clip.name or "the clip"
        raise GaitError(
            f"Expected a stride, from a strike of a foot to its next, but {name!r} completes none "
            f"in {clip.duration_s:.2f} s with {counts} on the ground{why}."
        )
    calibration = calibrate(walker)
    angles = joint_angles(walker, calibration)
    curves = {
        (side, joint, angle): np.stack(
            [
                over_stride(values, stride.start, stride.end)
                for stride in strides
                if stride.side == side
            ]
        )
        for side in SIDES
        if any(stride.side == side for stride in strides)
        for (joint, angle), values in angles[side].items()
    }
    notes = (*walker.notes, *told_of_refused(len(strides), refused))
    if resting > SLIDING_TOLD * usual_resting_speed(walker):
        notes += (
            f"feet slide as they land: up to {resting:.1f} m/s they count as on the ground, and "
            "stance is as sure as that",
        )
    flight, fall = air_shares(walker, contacts)
    if flight - fall > FALL_TOLD:
        notes += (
            f"stance may be too short: no foot is on the ground for {flight:.0%} of the time, but "
            f"the hips fall freely for {fall:.0%} only",
        )
    return GaitAnalysis(walker, contacts, strides, curves, calibration.zero, notes, tuple(refused))


def told_of_refused(n_strides: int, refused: list[str]) -> list[str]:
    """Return what is told of strides that are none: a few, and whether they are the most."""
    told = refused[:REFUSED_TOLD]
    if len(refused) > n_strides:
        told.insert(
            0,
            f"most strides are refused, {len(refused)} of {len(refused) + n_strides}: this may be "
            "no gait, and its figures are those of the few that are left",
        )
    if len(refused) > REFUSED_TOLD:
        told.append(f"{len(refused) - REFUSED_TOLD} more strides are none")
    return told
