"""Corroboration: what else speaks for a hypothesis, or explains the same edge.

Each sort of hypothesis looks for one sign. A fault shows several: what eases in goes where the
joint never goes, is unlike similar motion, and bends the joint's course. What is merely unusual
shows one of them. And an edge that stands alone has explanations that exclude each other: the joint
has drifted up to it, or is wrong from there to an end of the clip. So hypotheses by edges, by
similarity, of excursions and of jitter are weighed once more, by a second regression for each kind.
The evidence, of which the first seven are log-odds between `FLOOR` and `CEILING`:

===============  =================================================================================
`own`            what the first regression says of the hypothesis (up to `OWN_CEILING`)
`similarity`     the best that it says of a hypothesis of this sort about the same stretch: of
`excursion`      similar motion, of excursions, of jitter, of edges at a lower rate, or of edges at
`jitter`         the clip's own. Not asked of the sort that the hypothesis itself is of
`soft`
`edges`
`rival`          of a single edge: the best that it says of what lies on the other side of the edge
`shared`         of a single edge: the same of another hypothesis on this side
`near_end`       of a single edge: how far it is from the nearer end of the clip (logarithm of
                 seconds)
`odd_pose`       how odd the joint's rotations are in the stretch, and ...
`odd_move`       ... its way, among its own elsewhere and the opposite joint's (`pooled_spread`)
`odd_beside`     of a single edge: how odd its rotations are on the other side of it
`length`         logarithm of seconds
`rate`           how low the clip's rate is; 0 at 120 Hz
===============  =================================================================================

`scripts/fit_cleaning.py` fits the regressions, as it does the first ones.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from mocapdb.base.arrays import FloatArray, IntArray
from mocapdb.cleaning.evidence.fault_confidence import Model, model_of
from mocapdb.cleaning.evidence.hypotheses import Hypothesis
from mocapdb.cleaning.evidence.pooled_spread import PooledSpread
from mocapdb.cleaning.tuning import (
    CEILING,
    CORROBORATION_MODELS,
    FLOOR,
    LEAST_OWN,
    LEAST_SPIKE_S,
    MOST_DOUBT,
    OWN_CEILING,
    REFERENCE_FPS,
    SAME_STRETCH_SHARE,
)

__all__ = ["SECOND_FEATURES", "SECOND_MODELS", "corroborated", "corroboration"]

SORTS = ("similarity", "excursion", "jitter", "soft", "edges")
ONE_EDGE = ("drift", "cut offset", "held")
OF_ONE_EDGE = ("rival", "shared", "near_end", "odd_beside")
NO_EDGE = -9
LEAST_NEAR_S = 0.1


def _sort_of(name: str) -> str:
    """Return the sort of hypotheses that a kind belongs to; "" for what does not count."""
    if name in SORTS:
        return name
    if name.startswith("soft "):
        return "soft"
    return "edges" if name in ("offset", "noise", "freeze") else ""


def _features_of(name: str) -> tuple[str, ...]:
    others = (sort for sort in SORTS if sort != _sort_of(name))
    of_edge = OF_ONE_EDGE if name in ONE_EDGE else ()
    return ("own", *others, *of_edge, "odd_pose", "odd_move", "length", "rate")


SECOND_FEATURES = {name: _features_of(name) for name in CORROBORATION_MODELS}
SECOND_MODELS = {
    name: Model(entry["constant"], np.array([entry[feature] for feature in SECOND_FEATURES[name]]))
    for name, entry in CORROBORATION_MODELS.items()
}


def corroborated(
    hypotheses: Sequence[Hypothesis],
    log_odds: FloatArray,
    spread: PooledSpread,
    n_frames: int,
    fps: float,
    models: Mapping[str, Model] = SECOND_MODELS,
) -> FloatArray:
    """Return (n,) log-odds of hypotheses in the light of all others.

    Those of other kinds, and those that the first regression finds most unlikely, stay as they are.
    No more than `MOST_DOUBT` is taken from any: one sign may be clear.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        All of a clip.
    log_odds : (n,)
        What the first regressions say.
    spread : PooledSpread
        Of the clip's texture.
    n_frames : int
        Of the clip.
    fps : float, frames per second
        The clip's.
    models : dict of str to Model
        By kind, with one weight for each of its `SECOND_FEATURES`.
    """
    again = log_odds.copy()
    for place, evidence in corroboration(hypotheses, log_odds, spread, n_frames, fps):
        constant, weights = models[model_of(hypotheses[place])]
        weighed = constant + float(weights @ np.array(evidence))
        again[place] = max(weighed, log_odds[place] - MOST_DOUBT)
    return again


def corroboration(
    hypotheses: Sequence[Hypothesis],
    log_odds: FloatArray,
    spread: PooledSpread,
    n_frames: int,
    fps: float,
) -> Iterator[tuple[int, tuple[float, ...]]]:
    """Yield the place of each hypothesis that is weighed again, and its evidence.

    The evidence is in the order of its kind's `SECOND_FEATURES`. For the parameters see
    `corroborated`.
    """
    names = [model_of(h) for h in hypotheses]
    by_row: dict[int, list[int]] = {}
    for place, h in enumerate(hypotheses):
        by_row.setdefault(h.row, []).append(place)
    for places in by_row.values():
        of_joint = _OfJoint(
            [hypotheses[i] for i in places], [names[i] for i in places],
            log_odds[places], spread, n_frames, fps,
        )  # fmt: skip
        for i, place in enumerate(places):
            if names[place] in SECOND_FEATURES and log_odds[place] > LEAST_OWN:
                said = of_joint.evidence(i)
                yield place, tuple(said[feature] for feature in SECOND_FEATURES[names[place]])


class _OfJoint:
    """All hypotheses about one joint."""

    def __init__(
        self,
        hypotheses: Sequence[Hypothesis],
        names: Sequence[str],
        log_odds: FloatArray,
        spread: PooledSpread,
        n_frames: int,
        fps: float,
    ) -> None:
        self.hypotheses, self.names, self.log_odds = hypotheses, names, log_odds
        self.spread, self.n_frames, self.fps = spread, n_frames, fps
        self.starts = np.array([h.start for h in hypotheses])
        self.ends = np.array([h.end for h in hypotheses])
        self.sorts = np.array([_sort_of(name) for name in names])
        self.clipped = np.clip(log_odds, FLOOR, CEILING)
        single = np.array([name in ONE_EDGE for name in names])
        # what an end of the clip cuts off begins at its edge, all else ends at it
        self.after = single & (self.ends == n_frames) & np.array([n == "cut offset" for n in names])
        self.edges = np.where(single, np.where(self.after, self.starts, self.ends), NO_EDGE)
        self.by_start = np.argsort(self.starts, kind="stable")
        self.longest = int((self.ends - self.starts).max())

    def evidence(self, i: int) -> dict[str, float]:
        """Return what is asked of a hypothesis."""
        h = self.hypotheses[i]
        # all others that overlap or touch it
        low, high = np.searchsorted(
            self.starts[self.by_start], [h.start - self.longest - 1, h.end + 2]
        )
        near = self.by_start[low:high]
        shared = np.minimum(self.ends[near], h.end) - np.maximum(self.starts[near], h.start)
        whole = np.maximum(self.ends[near], h.end) - np.minimum(self.starts[near], h.start)
        same = near[shared > SAME_STRETCH_SHARE * whole]
        seconds = len(h) / self.fps
        said = {
            "own": float(np.clip(self.log_odds[i], FLOOR, OWN_CEILING)),
            "length": math.log(max(seconds, LEAST_SPIKE_S)),
            "rate": math.log(REFERENCE_FPS / self.fps),
        }
        said |= {sort: self._best(same[self.sorts[same] == sort]) for sort in SORTS}
        first, last = self._texture_frames(h.start, h.end)
        said["odd_pose"] = self.spread.pose(h.row, first, last)
        said["odd_move"] = self.spread.move(h.row, first, last)
        if self.edges[i] != NO_EDGE:
            said |= self._of_edge(i, near, last - first)
        return said

    def _of_edge(self, i: int, near: IntArray, n_texture: int) -> dict[str, float]:
        """Return what is asked of a single edge; the stretch has so many frames of the texture."""
        edge, after = int(self.edges[i]), bool(self.after[i])
        at = near[np.abs(self.edges[near] - edge) <= 1]
        middle = round(edge * self.spread.fps / self.fps)
        width = max(2, n_texture)
        if after:
            beside = (max(0, middle - width), middle)
        else:
            beside = (middle, min(self.spread.n_frames, middle + width))
        return {
            "rival": self._best(at[self.after[at] != after]),
            "shared": self._best(at[(self.after[at] == after) & (at != i)]),
            "near_end": math.log(min(edge, self.n_frames - edge) / self.fps + LEAST_NEAR_S),
            "odd_beside": self.spread.pose(self.hypotheses[i].row, *beside),
        }

    def _best(self, places: IntArray) -> float:
        return float(self.clipped[places].max(initial=FLOOR))

    def _texture_frames(self, start: int, end: int) -> tuple[int, int]:
        rate, n = self.spread.fps / self.fps, self.spread.n_frames
        first = min(math.ceil(start * rate - 1e-9), n - 1)
        return first, max(first + 1, min(math.ceil(end * rate - 1e-9), n))
