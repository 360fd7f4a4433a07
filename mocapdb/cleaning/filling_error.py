"""How far off joints are that `fill_joints` fills, measured on clips of which all is known.

A clip is held out, filled from the others as if only some joints had been captured, and compared
with what it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mocapdb.cleaning.local_rotations import local_rotations, motion_texture
from mocapdb.cleaning.neighbours.nearest_words import Vocabulary
from mocapdb.cleaning.repair.missing_joints import fill_with_misfit, kept_joints
from mocapdb.cleaning.tuning import LEAST_ANGLE_DEG
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.quaternions import angles_deg

__all__ = ["FillingError", "measure_filling"]


@dataclass(frozen=True)
class FillingError:
    """What filled joints are off.

    Attributes
    ----------
    clips : tuple of str
        Names of the clips that were held out.
    mean_deg : dict of str to float, degrees
        Mean angle to the truth over all frames of these, by joint; empty where there are none.
    misfit_deg : float, degrees
        Mean angle of their known joints to what similar motion shows of them; NaN likewise.
    """

    clips: tuple[str, ...]
    mean_deg: dict[str, float]
    misfit_deg: float

    @property
    def overall_deg(self) -> float:
        """The mean over joints; NaN where there are none."""
        return float(np.mean(list(self.mean_deg.values()))) if self.mean_deg else float("nan")

    def expected(self, misfit_deg: float) -> FillingError:
        """Return what is to be expected of a clip that similar motion fits less well.

        Clips that are alike fill each other better than one that is like none of them: errors grow
        as the misfit of the known joints does. They are never taken to be smaller than measured.

        Parameters
        ----------
        misfit_deg : float, degrees
            Of the clip; see `missing_joints.Filling`.
        """
        times = max(1.0, misfit_deg / max(self.misfit_deg, LEAST_ANGLE_DEG)) if self.clips else 1.0
        mean = {joint: min(180.0, times * error) for joint, error in self.mean_deg.items()}
        return FillingError(self.clips, mean, self.misfit_deg)


def measure_filling(
    known: Sequence[str],
    clips: Sequence[Clip] | Vocabulary,
    *,
    held_out: Sequence[Clip] | None = None,
    most_clips: int | None = None,
) -> FillingError:
    """Fill clips as if only some joints had been captured, each from the others, and compare.

    Parameters
    ----------
    known : sequence of str
        Names of the joints that count as captured.
    clips : sequence of Clip, or Vocabulary
        Of the same joints. With a vocabulary the clips held out are to be named.
    held_out : sequence of Clip, optional
        What is filled; by default the clips themselves. A clip is never filled from itself, nor
        from a copy of its motion.
    most_clips : int, optional
        Fill so many at most, spread evenly.

    Raises
    ------
    SkeletonError
        If a name is no joint's.

    Notes
    -----
    Clips shorter than a word, and those at another rate than the vocabulary's, are passed over.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> walks = [synthetic.make_clip("walk", seed=seed, duration_s=3) for seed in (1, 2)]
    >>> found = measure_filling(["lfemur", "rfemur", "lhumerus", "rhumerus"], walks)
    >>> len(found.clips), found.overall_deg < 10
    (2, True)
    """
    if isinstance(clips, Vocabulary):
        chosen, by_rate = list(held_out or ()), {clips.fps: clips}
    else:
        chosen, by_rate = list(clips if held_out is None else held_out), {}
    if most_clips is not None and most_clips < len(chosen):
        chosen = [chosen[i * len(chosen) // most_clips] for i in range(most_clips)]
    names: list[str] = []
    sums: dict[str, float] = {}
    frames, misfits = 0, 0.0
    for clip in chosen:
        texture = motion_texture(clip)
        if texture.fps not in by_rate:
            if isinstance(clips, Vocabulary):
                continue
            fast = [motion_texture(c, texture.fps) for c in clips if c.fps >= texture.fps]
            if not fast:
                continue
            by_rate[texture.fps] = Vocabulary.of(fast)
        try:
            filled, misfit = fill_with_misfit(
                clip, known, by_rate[texture.fps].without_copies(texture)
            )
        except ClipError:  # it is too short, or nothing is left to fill it from
            continue
        truth, made = local_rotations(clip), local_rotations(filled)
        apart = angles_deg(truth.quat_xyzw, made.quat_xyzw).sum(axis=0)
        kept = kept_joints(clip)
        for row, joint in enumerate(truth.names):
            if joint not in known and truth.joints[row] not in kept:
                sums[joint] = sums.get(joint, 0.0) + float(apart[row])
        frames += len(clip)
        misfits += misfit * len(clip)
        names.append(clip.name)
    mean = {joint: total / frames for joint, total in sums.items()} if frames else {}
    return FillingError(tuple(names), mean, misfits / frames if frames else float("nan"))
