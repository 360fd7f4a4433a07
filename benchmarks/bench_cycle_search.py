"""Periods of real walks and runs that were cut, thinned and disturbed, and of what has none.

python benchmarks/bench_cycle_search.py

The truth is the period of the whole clip. Single actions (HDM05) have no period.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
from _corpus import corpus_or_exit
from bench_cycles import real_clips

from mocapdb.corpus import read_labels
from mocapdb.cycles import extract_cycle
from mocapdb.errors import NoPeriodError
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip

LAPS = (1.2, 1.3, 1.5, 1.8, 2.3)
TOLERANCE = 0.03
DOUBTFUL = 0.5
SINGLE_ACTIONS = (
    "depositFloorR",
    "grabHighR",
    "kickLFront1Reps",
    "lieDownFloor",
    "squat1Reps",
    "throwBasketball",
)


def main() -> None:
    corpus = corpus_or_exit()
    verdicts: dict[str, Counter[str]] = {}
    for clip in real_clips(corpus, "walk") + real_clips(corpus, "run"):
        whole = extract_cycle(clip)
        first, last = whole.frames
        for what, variant, period in variants(clip[first:last], whole.period_frames):
            verdicts.setdefault(what, Counter())[verdict(variant, period)] += 1
    actions = Counter(
        verdict(read_clip(corpus / row.path), None)
        for row in read_labels(corpus / "LABELS.csv")
        if row.label in SINGLE_ACTIONS
    )
    for what, counts in {**verdicts, "single actions": actions}.items():
        print(f"{what:<16}{', '.join(f'{n} {name}' for name, n in counts.most_common())}")


def variants(clip: Clip, period: float) -> Iterator[tuple[str, Clip, float]]:
    """Yield what was done to a clip, the clip, and its period in frames."""
    rng = np.random.default_rng(0)
    for laps in LAPS:
        n_frames = round(laps * period)
        if n_frames <= len(clip):
            start = int(rng.integers(0, len(clip) - n_frames + 1))
            yield f"{laps} laps", clip[start : start + n_frames], period
    for every in (2, 4, 5):
        thinned = clip.replace(channels=clip.channels[::every], fps=clip.fps / every)
        yield f"{thinned.fps:g} Hz", thinned, period / every
    turning = clip.skeleton.rotation_channels
    channels = clip.channels.copy()
    channels[:, turning] += rng.normal(0.0, 1.0, (len(clip), len(turning)))
    yield "1 degree noise", clip.replace(channels=channels), period


def verdict(clip: Clip, period: float | None) -> str:
    try:
        found = extract_cycle(clip)
    except NoPeriodError:
        return "refused"
    right = period is not None and abs(found.period_frames / period - 1) < TOLERANCE
    return f"{'right' if right else 'wrong'}{', doubtful' if found.confidence < DOUBTFUL else ''}"


if __name__ == "__main__":
    main()
