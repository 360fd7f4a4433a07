"""How a detector does on the whole kit of faults: recall by kind, false alarms, calibration.

A fault is found if flags cover half of it, on its own joint; a flagged span is right if faults
cover half of it. Repairs are judged on the faults that were found, against a spherical line between
the fault's true edges.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mocapdb.cleaning.evaluation import Trial, clean_joints, cut_trial
from mocapdb.cleaning.evidence.fault_confidence import line_across
from mocapdb.cleaning.joint_roles import BODY_ROLES, joint_roles
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.cleaning.map.digression_map import MovementDigressionMap
from mocapdb.cleaning.tuning import FOUND_SHARE, WORSE_DEG
from mocapdb.corpus.synthetic.fault_kit import RECIPES, Recipe, inject_recipe
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange
from mocapdb.motion.quaternions import angles_deg

__all__ = ["CUT", "KitScores", "RepairError", "Tally", "kit_trials", "repair_error"]

CUT = "cut off by an end"
SURE = (0.8, 0.9, 0.95, 1.0)


class RepairError(NamedTuple):
    """Mean angles to the truth in a fault's frames, in degrees."""

    before: float
    repaired: float
    line: float


@dataclass
class Tally:
    """Faults of one kind: how many, how many found, and what repairing left of these."""

    found: int = 0
    missed: int = 0
    errors: list[RepairError] = field(default_factory=list)

    @property
    def recall(self) -> float:
        """Share that was found; NaN where there is none."""
        n = self.found + self.missed
        return self.found / n if n else float("nan")

    @property
    def mean_error(self) -> RepairError:
        """Mean over the faults found."""
        nothing = RepairError(*[float("nan")] * 3)
        return RepairError(*np.mean(self.errors, axis=0).tolist()) if self.errors else nothing

    @property
    def worse(self) -> float:
        """Share of the faults found that repairing made worse by over `WORSE_DEG`."""
        if not self.errors:
            return float("nan")
        return float(np.mean([e.repaired > e.before + WORSE_DEG for e in self.errors]))


@dataclass
class KitScores:
    """What a detector did on faulty and on untouched clips.

    Attributes
    ----------
    tallies : dict of str to Tally
        By recipe.
    sure : list of (float, bool)
        Of each span flagged in a faulty clip, on clean joints: its confidence and whether it is
        right.
    untouched_min : float, minutes
        How much untouched motion there was.
    body_alarms, all_alarms : int
        Spans flagged in it: on joints other than hands and toes, and on all.
    """

    tallies: dict[str, Tally] = field(default_factory=lambda: defaultdict(Tally))
    sure: list[tuple[float, bool]] = field(default_factory=list)
    untouched_min: float = 0.0
    body_alarms: int = 0
    all_alarms: int = 0

    @property
    def precision(self) -> float:
        """Share of the spans flagged in faulty clips that is right."""
        return float(np.mean([right for _, right in self.sure])) if self.sure else float("nan")

    def calibration(self) -> Iterator[tuple[float, float, int, float]]:
        """Yield (low, high, spans, share right) by confidence."""
        for low, high in pairwise(SURE):
            rights = [right for sure, right in self.sure if low <= sure < high or sure == high == 1]
            if rights:
                yield low, high, len(rights), float(np.mean(rights))

    def add_trial(
        self,
        name: str,
        trial: Trial,
        found: MovementDigressionMap,
        repaired: Clip | None = None,
    ) -> None:
        """Count a faulty clip."""
        mask = found.mask
        for fault in trial.faults:
            here = slice(fault.start, fault.end)
            hit = bool(mask[here, fault.joint].mean() >= FOUND_SHARE)
            tally = self.tallies[name]
            tally.found += hit
            tally.missed += not hit
            if hit and repaired is not None and fault.kind != "root jump":
                tally.errors.append(repair_error(trial, fault.joint, here, repaired))
        counted = set(trial.joints.tolist()) | {fault.joint for fault in trial.faults}
        for span in found.spans:
            if span.joint in counted and not trial.ignored[span.frames, span.joint].any():
                right = bool(trial.mask[span.frames, span.joint].mean() >= FOUND_SHARE)
                self.sure.append((span.confidence, right))

    def add_untouched(self, clip: Clip, found: MovementDigressionMap) -> None:
        """Count a clip without faults."""
        roles = joint_roles(clip)
        self.untouched_min += clip.duration_s / 60.0
        self.all_alarms += len(found.spans)
        self.body_alarms += sum(roles[span.joint] in BODY_ROLES for span in found.spans)


def repair_error(trial: Trial, joint: int, here: slice, repaired: Clip) -> RepairError:
    """Return what a repair left of a fault, beside a line between its true edges."""
    textures = [local_rotations(clip) for clip in (trial.original, trial.clip, repaired)]
    row = textures[0].joints.tolist().index(joint)
    right, wrong, mended = (texture.quat_xyzw[:, row] for texture in textures)
    line = line_across(right, FrameRange(here.start, here.stop))
    return RepairError(
        *(float(angles_deg(right[here], q).mean()) for q in (wrong[here], mended[here], line))
    )


def kit_trials(
    clips: Iterable[Clip],
    *,
    seed: int,
    recipes: Sequence[Recipe] = RECIPES,
    seconds_per_fault: float = 8.0,
) -> Iterator[tuple[str, Trial]]:
    """Yield each clip with faults of one recipe after the other, on its clean joints, and cut off.

    Recipes go round the clips, so that each clip comes once; call it with several seeds for more.
    Every seventh clip with a fault of one joint is cut in its middle (`CUT`).
    """
    for number, clip in enumerate(clips):
        recipe = recipes[(number + seed) % len(recipes)]
        yield from _trial(clip, recipe, 1000 * seed + number, seconds_per_fault)


def _trial(
    clip: Clip, recipe: Recipe, seed: int, seconds_per_fault: float
) -> Iterator[tuple[str, Trial]]:
    roles = joint_roles(clip)
    joints = clean_joints(clip)
    body = [j for j in joints.tolist() if roles[j] in BODY_ROLES]
    n = max(1, round(clip.duration_s / seconds_per_fault))
    try:
        injection = inject_recipe(clip, recipe, seed=seed, n=n, joints=body or joints.tolist())
    except (ClipError, ValueError):
        return
    mask, ignored = np.zeros_like(injection.mask), injection.mask.copy()
    for fault in injection.faults:
        mask[fault.start : fault.end, fault.joint] = True
    ignored &= ~mask
    if injection.faults:
        trial = Trial(clip, injection.clip, joints, mask, injection.faults, ignored)
        yield recipe.name, trial
        if seed % 7 == 0 and recipe.where == "one joint":
            cut = cut_trial(trial, at_end=seed % 2 == 0)
            ends = [f for f in cut.faults if f.start == 0 or f.end == len(cut.clip)]
            if ends and len(cut.clip) > clip.fps:
                yield CUT, cut._replace(faults=tuple(ends), mask=cut.mask)
