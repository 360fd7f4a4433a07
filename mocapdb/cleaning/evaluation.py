"""Evaluation: faults put into clean clips, and what a detector finds of them.

A clip counts joint by joint: a joint that itself jumps by `CLEAN_JUMP_DEG` anywhere is not clean
(many a captured toe, hand or thumb is not), gets no fault, and what is flagged on it is counted
neither for nor against.

=============  ===================================================================================
words          of 0.625 s, every 0.21 s, as in the paper: one is wrong if any clean joint has 2
               frames of fault in it, and flagged if any clean joint has 2 flagged frames
joint words    the same for each joint by itself: the fault must be found on the right joint
spans          a fault is found if flagged spans cover half of it; a flagged span is right if
               faults cover half of it
frames         of each joint
=============  ===================================================================================
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, get_args

import numpy as np

from mocapdb.base.arrays import BoolArray, FloatArray, IntArray
from mocapdb.cleaning.evidence.discontinuities import find_jumps
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.cleaning.tuning import (
    CLEAN_JUMP_DEG,
    FOUND_SHARE,
    LEAST_WRONG_FRAMES,
    SECONDS_PER_FAULT,
    SOURCE_FRAMES,
    STRIDE,
    TEXTURE_FPS,
)
from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic.faults import Fault, FaultKind
from mocapdb.errors import ClipError
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import ranges_where
from mocapdb.motion.quaternions import angles_deg, slerp

__all__ = [
    "Counts",
    "Trial",
    "clean_joints",
    "cut_trial",
    "make_trials",
    "repair_errors",
    "score",
]

WORD_S, STRIDE_S = SOURCE_FRAMES / TEXTURE_FPS, STRIDE / TEXTURE_FPS


class Trial(NamedTuple):
    """A clip with faults.

    Attributes
    ----------
    original, clip : Clip
        Without and with the faults.
    joints : (n,)
        The clean joints: those that count.
    mask : (F, J)
        Where faults are that count.
    faults : tuple of Fault
    ignored : (F, J)
        Where faults are that turned out smaller than asked for, which count neither way.
    """

    original: Clip
    clip: Clip
    joints: IntArray
    mask: BoolArray
    faults: tuple[Fault, ...]
    ignored: BoolArray


@dataclass
class Counts:
    """Hits, misses and false alarms, which add up over trials."""

    hits: int = 0
    misses: int = 0
    false_alarms: int = 0
    right_alarms: int = 0
    missed: list[str] = field(default_factory=list)

    @property
    def recall(self) -> float:
        """Share of what is wrong that was found; NaN where nothing is wrong."""
        wrong = self.hits + self.misses
        return self.hits / wrong if wrong else float("nan")

    @property
    def precision(self) -> float:
        """Share of what was flagged that is wrong; NaN where nothing was flagged."""
        flagged = self.right_alarms + self.false_alarms
        return self.right_alarms / flagged if flagged else float("nan")

    def add(self, wrong: BoolArray, flagged: BoolArray) -> None:
        """Count elements that are wrong or flagged."""
        self.hits += int((wrong & flagged).sum())
        self.right_alarms += int((wrong & flagged).sum())
        self.misses += int((wrong & ~flagged).sum())
        self.false_alarms += int((~wrong & flagged).sum())


def clean_joints(clip: Clip, *, largest_jump_deg: float = CLEAN_JUMP_DEG) -> IntArray:
    """Return the joints that rotate and never jump by more than so much; without the root."""
    texture = local_rotations(clip)
    clean = find_jumps(texture).sizes_deg.max(axis=0, initial=0.0) < largest_jump_deg
    joints = texture.joints[clean]
    return np.asarray(joints[joints > 0])


def make_trials(
    clips: Iterable[Clip],
    *,
    seed: int,
    size_deg: tuple[float, float] = (20.0, 90.0),
    length_s: tuple[float, float] = (0.15, 1.0),
    kinds: Sequence[FaultKind] = get_args(FaultKind),
    seconds_per_fault: float = SECONDS_PER_FAULT,
    ease_s: float | tuple[float, float] = 0.0,
    tremble_deg: float | tuple[float, float] = 0.0,
) -> list[Trial]:
    """Return clips with faults, one for every so many seconds; kinds go round the clips.

    For the other parameters see `synthetic.inject_faults`.

    A clip without clean joints, or too short for a fault, is left out. A freeze that turned out
    smaller than the least size is put into `Trial.ignored`.
    """
    trials: list[Trial] = []
    turn = seed
    for number, clip in enumerate(clips):
        joints = clean_joints(clip)
        n = max(1, round(clip.duration_s / seconds_per_fault))
        try:
            injection = synthetic.inject_faults(
                clip, seed=1000 * seed + number, kinds=[kinds[(turn + i) % len(kinds)]
                for i in range(n)], size_deg=size_deg, length_s=length_s, n=n,
                joints=joints.tolist(), ease_s=ease_s, tremble_deg=tremble_deg,
            )  # fmt: skip
        except (ClipError, ValueError):
            continue
        turn += n
        mask, ignored = np.zeros_like(injection.mask), np.zeros_like(injection.mask)
        counted = []
        for fault in injection.faults:
            small = fault.size_deg < size_deg[0]
            (ignored if small else mask)[fault.start : fault.end, fault.joint] = True
            if not small:
                counted.append(fault)
        trials.append(Trial(clip, injection.clip, joints, mask, tuple(counted), ignored))
    return trials


def cut_trial(trial: Trial, *, at_end: bool) -> Trial:
    """Return a trial that ends in the middle of its last fault, or begins in that of its first.

    A trial without faults is returned as it is.
    """
    if not trial.faults:
        return trial
    fault = trial.faults[-1 if at_end else 0]
    middle = (fault.start + fault.end) // 2
    kept = slice(0, middle) if at_end else slice(middle, len(trial.clip))
    faults = tuple(
        f._replace(start=max(f.start - kept.start, 0), end=min(f.end, kept.stop) - kept.start)
        for f in trial.faults
        if f.start < kept.stop and f.end > kept.start
    )
    return Trial(
        trial.original[kept], trial.clip[kept], trial.joints, trial.mask[kept], faults,
        trial.ignored[kept],
    )  # fmt: skip


def score(trials: Iterable[Trial], flag: Callable[[Clip], BoolArray]) -> dict[str, Counts]:
    """Return counts by unit (see the module), and of spans by kind, size and length of the fault.

    Parameters
    ----------
    trials : iterable of Trial
    flag : callable
        Takes a clip and returns (F, J) whether each joint's frame is flagged.

    Returns
    -------
    dict
        ``"words"``, ``"joint words"``, ``"spans"``, ``"frames"``, and of spans, recall only,
        ``"spans: offset"`` ..., ``"spans: up to 45 deg"`` ... and ``"spans: up to 0.3 s"`` ...
    """
    counts: dict[str, Counts] = {}

    def of(name: str) -> Counts:
        return counts.setdefault(name, Counts())

    for trial in trials:
        flagged = flag(trial.clip) & ~trial.ignored
        wrong, flagged = trial.mask[:, trial.joints], flagged[:, trial.joints]
        of("frames").add(wrong, flagged)
        wrong_words, flagged_words = _words(wrong, trial.clip.fps), _words(flagged, trial.clip.fps)
        of("joint words").add(wrong_words, flagged_words)
        of("words").add(wrong_words.max(axis=1), flagged_words.max(axis=1))
        columns = {joint: column for column, joint in enumerate(trial.joints.tolist())}
        for fault in trial.faults:
            found = flagged[fault.start : fault.end, columns[fault.joint]].mean() >= FOUND_SHARE
            size = next(high for high in (20, 45, 90, 180) if fault.size_deg <= high)
            length = (fault.end - fault.start) / trial.clip.fps
            longest = next(high for high in (0.15, 0.3, 0.6, np.inf) if length <= high + 1e-9)
            names = (
                "spans", f"spans: {fault.kind}", f"spans: up to {size} deg",
                f"spans: up to {longest:g} s" if longest < np.inf else "spans: longer",
            )  # fmt: skip
            for name in names:
                of(name).hits += int(found)
                of(name).misses += int(not found)
            if not found:
                where = trial.clip.skeleton.names[fault.joint]
                of("spans").missed.append(
                    f"{trial.clip.name} {where} {fault.start}:{fault.end} {fault.kind} "
                    f"{fault.size_deg:.0f} deg"
                )
        for column in range(flagged.shape[1]):
            for run in ranges_where(flagged[:, column]):
                right = wrong[run.frames, column].mean() >= FOUND_SHARE
                of("spans").right_alarms += int(right)
                of("spans").false_alarms += int(not right)
    return counts


def repair_errors(
    trials: Iterable[Trial], clean: Callable[[Clip], tuple[Clip, BoolArray]]
) -> FloatArray:
    """Return the mean angles to the truth of the faulty joint in the faulty frames.

    Parameters
    ----------
    trials : iterable of Trial
    clean : callable
        Takes a clip and returns it repaired, and (F, J) where.

    Returns
    -------
    (faults, 2) degrees
        Repaired, and with a straight spherical line across the same stretches instead. What was
        not found is as wrong as before in both.
    """
    errors = []
    for trial in trials:
        right, wrong = local_rotations(trial.original), local_rotations(trial.clip)
        repaired_clip, where = clean(trial.clip)
        repaired = local_rotations(repaired_clip)
        rows = right.joints.tolist()
        for fault in trial.faults:
            row, frames = rows.index(fault.joint), slice(fault.start, fault.end)
            line = wrong.quat_xyzw[:, row].copy()
            for run in ranges_where(where[:, fault.joint]):
                first, last = max(0, run.start - 1), min(len(line) - 1, run.end)
                weight = (np.arange(run.start, run.end) - first) / max(last - first, 1)
                line[run.frames] = slerp(line[first][None], line[last][None], weight)
            truth = right.quat_xyzw[frames, row]
            errors.append(
                [
                    angles_deg(truth, repaired.quat_xyzw[frames, row]).mean(),
                    angles_deg(truth, line[frames]).mean(),
                ]
            )
    return np.array(errors).reshape(-1, 2)


def _words(mask: BoolArray, fps: float) -> BoolArray:
    """Return (W, n) whether each word has `LEAST_WRONG_FRAMES` True frames, by joint."""
    length = max(LEAST_WRONG_FRAMES, round(WORD_S * fps))
    stride = max(1, round(STRIDE_S * fps))
    last = max(0, len(mask) - length)
    sums = np.concatenate([np.zeros((1, mask.shape[1]), int), np.cumsum(mask, axis=0)])
    starts = np.arange(0, last + 1, stride)
    counts = sums[np.minimum(starts + length, len(mask))] - sums[starts]
    return np.asarray(counts >= LEAST_WRONG_FRAMES)
