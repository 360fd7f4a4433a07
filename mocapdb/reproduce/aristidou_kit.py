"""The kit of faults on clips of subjects that the detector was not fitted on, beside rivals.

Beyond the paper: every recipe of `corpus.synthetic.fault_kit` is put into some clips, at 120 and at
30 Hz in turn, and found and repaired by what the clip alone tells. The same clips untouched give
the false alarms. `CONVENTIONS` states the rest.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mocapdb.base.arrays import StrPath
from mocapdb.base.progress import Progress, silent
from mocapdb.cleaning.evaluation import Trial
from mocapdb.cleaning.kit_scores import CUT, JointMotion, KitScores, joint_motion, kit_trials
from mocapdb.cleaning.map.detector import detect_faults
from mocapdb.cleaning.repair.repair import repair_spans
from mocapdb.corpus.synthetic.fault_kit import IN_METRES, RECIPES, Recipe
from mocapdb.errors import CorpusError
from mocapdb.io import find_motion_files, read_with_settings
from mocapdb.motion.clip import Clip
from mocapdb.motion.quaternions import angles_deg
from mocapdb.reproduce._tables import Job, Key, run_jobs
from mocapdb.reproduce.aristidou_rivals import RIVALS, TOLD, repaired_by_rivals

__all__ = ["CALIBRATION", "CLIPS", "CONVENTIONS", "Kit", "measure", "ways_of"]

CALIBRATION = ("01", "03", "05", "08", "11", "16", "35", "HDM")
CLIPS = 4
PIECE_S = 12.0
SECONDS_PER_FAULT = 2.5
LEAST_S = 2.0
RATES = (120.0, 30.0)
WITHOUT = "without similar motion"
CONVENTIONS = (
    "clips: drawn with a seed from those of all subjects but the calibration's, which are CMU's "
    f"{', '.join(CALIBRATION[:-1])} and HDM05's; at most {PIECE_S:g} s of each, at 120 and at "
    "30 Hz in turn, searched for similar motion by themselves",
    f"faults: one recipe a clip, one fault for every {SECONDS_PER_FAULT:g} s, on clean joints of "
    "trunk, arms and legs; one is found if flags cover half of it on its joint, and a flagged span "
    "is right if faults cover half of it; of several joints each is a fault",
    "errors: of the faults that were found, mean angle to the truth in their frames, of a jump of "
    "the root and of feet the mean distance in mm; worse: share that a repair left further off by "
    "0.5 than they were",
    f"told which frames are wrong: {', '.join(TOLD)}; over everything: "
    f"{', '.join(name for name in RIVALS if name not in TOLD)}; elsewhere: what these change where "
    "nothing is wrong, mean angle over the clean joints' frames without faults",
    "without similar motion: the same detector and repair, asked without any neighbours",
)


@dataclass
class Kit:
    """What was measured.

    Attributes
    ----------
    clips : tuple of str
        Names of the clips that were drawn.
    scores, without : KitScores
        Of the detector and the repair, and of both without similar motion.
    alarms, alarms_without : dict of float to KitScores
        Of untouched clips, by rate.
    elsewhere_deg : dict of str to list of float
        What a way to repair changes where nothing is wrong, for each trial.
    passed_over : Counter
        By recipe, the clips that cannot hold it.
    """

    clips: tuple[str, ...] = ()
    scores: KitScores = field(default_factory=KitScores)
    without: KitScores = field(default_factory=KitScores)
    alarms: dict[float, KitScores] = field(default_factory=lambda: {r: KitScores() for r in RATES})
    alarms_without: dict[float, KitScores] = field(
        default_factory=lambda: {rate: KitScores() for rate in RATES}
    )
    elsewhere_deg: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    passed_over: Counter[str] = field(default_factory=Counter)

    def add(self, other: Kit) -> None:
        """Add what was measured elsewhere."""
        self.scores.add(other.scores)
        self.without.add(other.without)
        for rate in RATES:
            self.alarms[rate].add(other.alarms[rate])
            self.alarms_without[rate].add(other.alarms_without[rate])
        for way, values in other.elsewhere_deg.items():
            self.elsewhere_deg[way] += values
        self.passed_over += other.passed_over

    def as_json(self) -> dict[str, Any]:
        """Return what the JSON contract says of the kit; NaN, where there is nothing, as None."""
        names = [r.name for r in RECIPES] + [CUT]
        return {
            "clips": list(self.clips),
            "recipes": [self._recipe(name) for name in names],
            "precision": _known(self.scores.precision),
            "false_alarms_a_minute": [
                {
                    "fps": rate,
                    "minutes": scores.untouched_min,
                    **_alarms(scores, "body", "all"),
                    **_alarms(self.alarms_without[rate], f"body {WITHOUT}", f"all {WITHOUT}"),
                }
                for rate, scores in self.alarms.items()
            ],
            "calibration": [
                {"from": low, "to": high, "spans": n, "right": share}
                for low, high, n, share in self.scores.calibration()
            ],
            "elsewhere_deg": {
                name: float(np.mean(values)) for name, values in self.elsewhere_deg.items()
            },
        }

    def _recipe(self, name: str) -> dict[str, Any]:
        tally, without = self.scores.tallies[name], self.without.tallies[name]
        unit = "mm" if any(r.name == name and r.how in IN_METRES for r in RECIPES) else "deg"
        return {
            "recipe": name,
            "faults": tally.found + tally.missed,
            "found": tally.found,
            "passed_over": self.passed_over[name],
            "recall": _known(tally.recall),
            "precision": _known(tally.precision),
            f"recall {WITHOUT}": _known(without.recall),
            f"precision {WITHOUT}": _known(without.precision),
            "unit": unit,
            "errors": {way: _known(tally.mean_error(way)) for way in ways_of(unit)},
            "worse": _known(tally.worse),
        }


def ways_of(unit: str) -> tuple[str, ...]:
    """Return the columns of the errors: before, ours, and the rivals that know the unit."""
    rivals = tuple(name for name in RIVALS if unit == "deg" or name != "low rank")
    return ("before", "repaired", WITHOUT, *rivals)


def measure(
    corpus: StrPath,
    *,
    clips: int = CLIPS,
    seed: int = 1,
    recipes: Sequence[Recipe] = RECIPES,
    jobs: int = 1,
    progress: Progress = silent,
) -> Kit:
    """Put every recipe into some clips of a corpus, find and repair, and count.

    Parameters
    ----------
    corpus : path-like
        Folder with AMC or BVH files, at any depth.
    clips : int
        Clips for each recipe.
    seed : int
        Of the choice of clips and of the faults.
    recipes : sequence of Recipe
    jobs : int
        Processes to share the work.
    progress : callable
        Called with steps done, steps in all, and what is being done.

    Raises
    ------
    CorpusError
        If the corpus has no clip of a subject that the detector was not fitted on.
    """
    paths = _held_out(Path(corpus))
    order = np.random.default_rng(seed).permutation(len(paths))
    drawn = [paths[i] for i in order[: min(len(paths), clips * len(recipes))]]
    pieces = [piece for path in drawn if (piece := _piece(path)) is not None]
    if not pieces:
        raise CorpusError(
            f"Expected clips in {corpus} of {LEAST_S:g} s and more, of subjects other than "
            f"{', '.join(CALIBRATION)}, but there is none."
        )
    todo: dict[Key, Job] = {}
    for i, recipe in enumerate(recipes):
        several = [pieces[(i * clips + n) % len(pieces)] for n in range(clips)]
        todo[recipe.name,] = partial(_try, recipe, several, seed * 1000 + i)
    for i, clip in enumerate(pieces[: max(1, clips * len(recipes) // 4)]):
        for rate in RATES:
            todo["untouched", clip.name, i, f"{rate:g} Hz"] = partial(_untouched, clip, rate)
    kit = Kit(tuple(clip.name for clip in pieces))
    for part in run_jobs(todo, n_jobs=jobs, progress=progress).values():
        kit.add(part)
    return kit


def _held_out(folder: Path) -> list[Path]:
    """Return the files to draw from, one for each clip's name: AMC rather than BVH."""
    paths: dict[str, Path] = {}
    for suffix in (".amc", ".bvh"):
        for path in find_motion_files(folder, [suffix]):
            if path.stem.split("_")[0] not in CALIBRATION:
                paths.setdefault(path.stem, path)
    return [paths[stem] for stem in sorted(paths)]


def _piece(path: Path) -> Clip | None:
    """Return the first seconds of a clip; None if it is too short to hold a fault."""
    clip = read_with_settings(path, drop_tpose=True)
    return clip[: round(PIECE_S * clip.fps)] if clip.duration_s >= LEAST_S else None


def _slower(clip: Clip, fps: float) -> Clip:
    """Return a clip at a rate, or one near it, by leaving frames out."""
    step = max(1, round(clip.fps / fps))
    return clip.replace(channels=clip.channels[::step], fps=clip.fps / step) if step > 1 else clip


def _try(recipe: Recipe, clips: Sequence[Clip], seed: int) -> Kit:
    """Put one recipe into clips and count what is found and what is left."""
    kit = Kit()
    slower = [_slower(clip, RATES[n % len(RATES)]) for n, clip in enumerate(clips)]
    trials = kit_trials(
        slower, seed=seed, recipes=[recipe], seconds_per_fault=SECONDS_PER_FAULT,
        passed_over=kit.passed_over,
    )  # fmt: skip
    for name, trial in trials:
        found = detect_faults(trial.clip)
        repaired, _ = repair_spans(trial.clip, found)
        alone = detect_faults(trial.clip, similarity=False)
        unaided, _ = repair_spans(trial.clip, replace(found, consensus=None))
        others = repaired_by_rivals(joint_motion(trial.clip), trial.faults, trial.clip.fps)
        for way, motion in ({"repaired": joint_motion(repaired)} | others).items():
            kit.elsewhere_deg[way].append(_elsewhere(trial, motion))
        others[WITHOUT] = joint_motion(unaided)
        kit.scores.add_trial(name, trial, found, repaired, others)
        kit.without.add_trial(name, trial, alone)
    return kit


def _elsewhere(trial: Trial, motion: JointMotion) -> float:
    """Return what a repair changes of clean joints where nothing is wrong: the mean angle."""
    right = joint_motion(trial.original)
    rows = [right.joints.index(joint) for joint in trial.joints.tolist()]
    untouched = ~(trial.mask | trial.ignored)[:, trial.joints]
    apart = angles_deg(right.quat_xyzw[:, rows], motion.quat_xyzw[:, rows])
    return float(apart[untouched].mean())


def _untouched(clip: Clip, rate: float) -> Kit:
    """Count what is flagged in a clip without faults."""
    kit = Kit()
    slower = _slower(clip, rate)
    kit.alarms[rate].add_untouched(slower, detect_faults(slower))
    kit.alarms_without[rate].add_untouched(slower, detect_faults(slower, similarity=False))
    return kit


def _alarms(scores: KitScores, body: str, everywhere: str) -> dict[str, float | None]:
    """Return false alarms a minute; None where no motion was untouched."""
    minutes = scores.untouched_min
    return {
        body: scores.body_alarms / minutes if minutes else None,
        everywhere: scores.all_alarms / minutes if minutes else None,
    }


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
