"""How a detector does on the whole kit of faults: recall by kind, false alarms, calibration.

A fault is found if flags cover half of it, on its own joint; a flagged span is right if faults
cover half of it. Repairs are judged on the faults that were found: by the mean angle to the truth
in a fault's frames, of a jump of the root by the mean distance in millimetres. What else is to be
judged beside our own repair is handed in.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.base.kept_answers import kept_with_first
from mocapdb.cleaning.evaluation import Trial, clean_joints, cut_trial
from mocapdb.cleaning.evidence.fault_confidence import line_across
from mocapdb.cleaning.evidence.foot_faults import foot_paths
from mocapdb.cleaning.evidence.root_jumps import root_columns
from mocapdb.cleaning.joint_roles import BODY_ROLES, joint_roles
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.cleaning.map.digression_map import MovementDigressionMap
from mocapdb.cleaning.tuning import FOUND_SHARE, LEAST_SWING_DEG, WORSE_DEG
from mocapdb.corpus.synthetic.fault_kit import RECIPES, Recipe, inject_recipe
from mocapdb.corpus.synthetic.faults import Fault
from mocapdb.errors import ClipError, MocapdbError
from mocapdb.motion.body import understand
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange
from mocapdb.motion.quaternions import angles_deg

__all__ = [
    "CUT",
    "JointMotion",
    "KitScores",
    "Tally",
    "joint_motion",
    "kit_trials",
    "line_between_edges",
]

CUT = "cut off by an end"
SURE = (0.8, 0.9, 1.0)
ROOT_JUMP = "root jump"
FOOT_FAULTS = ("foot slide", "foot sink")
"""The kind of fault that is wrong in place and not in rotation."""


class JointMotion(NamedTuple):
    """What faults and repairs change.

    Attributes
    ----------
    joints : (K,)
        Those that rotate.
    quat_xyzw : (F, K, 4)
        Their rotations.
    places_mm : (F, 3)
        Translation of the joint that carries the body; no columns where it has none.
    feet_mm : dict of int to (F, 3)
        Where the ball of each foot is, by the joint that turns the foot.
    """

    joints: tuple[int, ...]
    quat_xyzw: FloatArray
    places_mm: FloatArray
    feet_mm: Mapping[int, FloatArray]

    def error(self, other: JointMotion, fault: Fault) -> float:
        """Return how far two motions are apart in a fault's frames, in degrees or millimetres."""
        here = slice(fault.start, fault.end)
        if fault.kind == ROOT_JUMP:
            apart = np.linalg.norm(self.places_mm[here] - other.places_mm[here], axis=1)
        elif fault.kind in FOOT_FAULTS:
            apart = np.linalg.norm(
                self.feet_mm[fault.joint][here] - other.feet_mm[fault.joint][here], axis=1
            )
        else:
            row = self.joints.index(fault.joint)
            apart = angles_deg(self.quat_xyzw[here, row], other.quat_xyzw[here, row])
        return float(apart.mean())


@kept_with_first
def joint_motion(clip: Clip) -> JointMotion:
    """Return what faults and repairs change of a clip; kept with it, for each rival asks."""
    texture, body = local_rotations(clip), understand(clip.skeleton, clip.channels)
    places = clip.channels[:, root_columns(clip, body.root.value)] * body.unit_m.value * 1000.0
    try:
        legs, paths = foot_paths(clip)
    except MocapdbError:  # it has no legs
        legs, paths = (), []
    feet = {leg.foot: path[:, 0] * 1000.0 for leg, path in zip(legs, paths, strict=True)}
    return JointMotion(tuple(texture.joints.tolist()), texture.quat_xyzw, places, feet)


@dataclass
class Tally:
    """Faults of one kind, and what was flagged in the clips that have them.

    Attributes
    ----------
    found, missed : int
        Faults.
    flagged, right : int
        Spans.
    errors : list of dict
        For each fault that was found how far off it was ``"before"``, how far it is
        ``"repaired"``, and what others leave: degrees, of a jump of the root millimetres.
    """

    found: int = 0
    missed: int = 0
    flagged: int = 0
    right: int = 0
    errors: list[dict[str, float]] = field(default_factory=list)

    @property
    def recall(self) -> float:
        """Share that was found; NaN where there is none."""
        n = self.found + self.missed
        return self.found / n if n else float("nan")

    @property
    def precision(self) -> float:
        """Share of the flagged spans that is right; NaN where there is none."""
        return self.right / self.flagged if self.flagged else float("nan")

    def mean_error(self, way: str) -> float:
        """Return what one way leaves of the faults that were found; NaN where there is none."""
        return float(np.mean([e[way] for e in self.errors])) if self.errors else float("nan")

    def add(self, other: Tally) -> None:
        """Add what was counted elsewhere."""
        self.found += other.found
        self.missed += other.missed
        self.flagged += other.flagged
        self.right += other.right
        self.errors += other.errors

    @property
    def worse(self) -> float:
        """Share of the faults found that repairing made worse by over `WORSE_DEG`."""
        if not self.errors:
            return float("nan")
        return float(np.mean([e["repaired"] > e["before"] + WORSE_DEG for e in self.errors]))


def _tallies() -> dict[str, Tally]:
    return defaultdict(Tally)


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

    tallies: dict[str, Tally] = field(default_factory=_tallies)
    sure: list[tuple[float, bool]] = field(default_factory=list)
    untouched_min: float = 0.0
    body_alarms: int = 0
    all_alarms: int = 0

    @property
    def precision(self) -> float:
        """Share of the spans flagged in faulty clips that is right."""
        return float(np.mean([right for _, right in self.sure])) if self.sure else float("nan")

    def calibration(self) -> Iterator[tuple[float, float, int, float]]:
        """Yield (low, high, spans, share right) by confidence; below `SURE` is one range, too."""
        for low, high in pairwise((0.0, *SURE)):
            rights = [right for sure, right in self.sure if low <= sure < high or sure == high == 1]
            if rights:
                yield low, high, len(rights), float(np.mean(rights))

    def add(self, other: KitScores) -> None:
        """Add what was counted elsewhere."""
        for name, tally in other.tallies.items():
            self.tallies[name].add(tally)
        self.sure += other.sure
        self.untouched_min += other.untouched_min
        self.body_alarms += other.body_alarms
        self.all_alarms += other.all_alarms

    def add_trial(
        self,
        name: str,
        trial: Trial,
        found: MovementDigressionMap,
        repaired: Clip | None = None,
        others: Mapping[str, JointMotion] | None = None,
    ) -> None:
        """Count a faulty clip.

        Parameters
        ----------
        name : str
            Of the recipe.
        trial : Trial
        found : MovementDigressionMap
        repaired : Clip, optional
            Without it no errors are counted.
        others : dict of str to JointMotion, optional
            The trial's clip as others repair it.
        """
        mask, tally = found.mask, self.tallies[name]
        ways: dict[str, JointMotion] = {}
        if repaired is not None:
            ways = {"before": joint_motion(trial.clip), "repaired": joint_motion(repaired)}
            ways |= dict(others or {})
        truth = joint_motion(trial.original) if ways else None
        for fault in trial.faults:
            hit = bool(mask[fault.start : fault.end, fault.joint].mean() >= FOUND_SHARE)
            tally.found += hit
            tally.missed += not hit
            if hit and truth is not None:
                errors = {way: truth.error(motion, fault) for way, motion in ways.items()}
                tally.errors.append(errors)
        counted = set(trial.joints.tolist()) | {fault.joint for fault in trial.faults}
        for span in found.spans:
            if span.joint in counted and not trial.ignored[span.frames, span.joint].any():
                right = bool(trial.mask[span.frames, span.joint].mean() >= FOUND_SHARE)
                self.sure.append((span.confidence, right))
                tally.flagged += 1
                tally.right += right

    def add_untouched(self, clip: Clip, found: MovementDigressionMap) -> None:
        """Count a clip without faults."""
        roles = joint_roles(clip)
        self.untouched_min += clip.duration_s / 60.0
        self.all_alarms += len(found.spans)
        self.body_alarms += sum(roles[span.joint] in BODY_ROLES for span in found.spans)


def line_between_edges(wrong: JointMotion, faults: Sequence[Fault]) -> JointMotion:
    """Return a motion with a line, on the sphere or in space, between each fault's true edges."""
    quats, places = wrong.quat_xyzw.copy(), wrong.places_mm.copy()
    feet = {joint: path.copy() for joint, path in wrong.feet_mm.items()}
    for fault in faults:
        stretch = FrameRange(fault.start, fault.end)
        if fault.kind == ROOT_JUMP or fault.kind in FOOT_FAULTS:
            path = places if fault.kind == ROOT_JUMP else feet[fault.joint]
            beside = np.setdiff1d(
                np.clip([fault.start - 1, fault.end], 0, len(path) - 1),
                np.arange(fault.start, fault.end),
            )
            for axis in range(path.shape[1]):
                at = np.arange(fault.start, fault.end)
                path[at, axis] = np.interp(at, beside, path[beside, axis])
        else:
            row = wrong.joints.index(fault.joint)
            quats[stretch.frames, row] = line_across(wrong.quat_xyzw[:, row], stretch)
    return wrong._replace(quat_xyzw=quats, places_mm=places, feet_mm=feet)


def kit_trials(
    clips: Iterable[Clip],
    *,
    seed: int,
    recipes: Sequence[Recipe] = RECIPES,
    seconds_per_fault: float = 8.0,
    passed_over: Counter[str] | None = None,
) -> Iterator[tuple[str, Trial]]:
    """Yield each clip with faults of one recipe after the other, on its clean joints, and cut off.

    Recipes go round the clips, so that each clip comes once; call it with several seeds for more.
    Every seventh clip with a fault of one joint is cut in its middle (`CUT`).

    Parameters
    ----------
    clips : iterable of Clip
    seed : int
    recipes : sequence of Recipe
    seconds_per_fault : float, seconds
    passed_over : Counter, optional
        Counts, by recipe, the clips that cannot hold it: they have no room or no joints for it, or
        nothing in them comes out wrong by enough.
    """
    for number, clip in enumerate(clips):
        recipe = recipes[(number + seed) % len(recipes)]
        trials = list(_trial(clip, recipe, 1000 * seed + number, seconds_per_fault))
        if not trials and passed_over is not None:
            passed_over[recipe.name] += 1
        yield from trials


def _trial(
    clip: Clip, recipe: Recipe, seed: int, seconds_per_fault: float
) -> Iterator[tuple[str, Trial]]:
    roles = joint_roles(clip)
    joints = clean_joints(clip)
    moving = _moving(clip, joints)
    body = [j for j in moving if roles[j] in BODY_ROLES]
    if not moving:
        return  # a fault of what does not move is no test
    n = max(1, round(clip.duration_s / seconds_per_fault))
    try:
        injection = inject_recipe(clip, recipe, seed=seed, n=n, joints=body or moving)
    except ClipError:
        return  # it has no room for them: see `passed_over`
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


def _moving(clip: Clip, joints: IntArray) -> list[int]:
    """Return those of some joints that turn by `LEAST_SWING_DEG` from where they begin."""
    texture = local_rotations(clip)
    turned = angles_deg(texture.quat_xyzw[:1], texture.quat_xyzw).max(axis=0)
    swinging = set(texture.joints[turned >= LEAST_SWING_DEG].tolist())
    return [joint for joint in joints.tolist() if joint in swinging]
