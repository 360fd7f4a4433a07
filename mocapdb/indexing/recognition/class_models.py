"""Classes of motion: what a clip is, whether it is any of them, and where each goes on in it.

A class is a Gaussian over frames (`PPCA`). Frames do not know their order, and a class that is wide
explains anything: whether a clip is none of the classes is decided by the distance to the nearest
clip that they were learned from (`Examples`), and so is which of some classes it is where the
frames leave that open.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass
from itertools import pairwise
from typing import Any, Literal, TypeAlias

import numpy as np

from mocapdb.base.arrays import Float32Array, FloatArray, IntArray
from mocapdb.errors import ClipError
from mocapdb.indexing.canonical.canonical_motion import CanonicalMotion
from mocapdb.indexing.recognition.examples import ClipShapes, Examples, people_share
from mocapdb.indexing.recognition.ppca import PPCA
from mocapdb.indexing.search.features import N_FEATURES, FeatureSpace, Weights, frame_features
from mocapdb.indexing.tuning import (
    ALIKE_EXAMPLES,
    ALIKE_NATS,
    ASSIGN_ROUNDS,
    CALIBRATION_CLIPS,
    CLASS_POWER,
    FLOOR_M,
    KEPT_VARIANCE,
    MOST_STRICTER,
    NONE_SPREADS,
    SPREAD_QUANTILES,
    STRICTNESS,
    SWITCH_NATS,
)
from mocapdb.motion.frame_range import Segment

__all__ = ["ARRAYS", "NONE", "ClassIndex", "ClassScore", "Classification", "Moments", "Noise"]

Noise: TypeAlias = Literal["floored", "shared", "own"]
NEW_CLASS = "new {}"
NONE = "none"
"""What stretches are called that are none of the classes."""
ARRAYS: Mapping[str, tuple[str, str]] = {
    "class_mean": ("metre", "class,feature"),
    "class_axes": ("1", "axis,feature"),
    "class_variance": ("metre^2", "axis"),
    "class_axis_starts": ("1", "class+1"),
    "class_noise": ("metre^2", "class"),
    "signatures": ("metre", "clip,axis"),
    "example_frames": ("metre", "clip,frame,axis"),
    "example_shares": ("1", "clip,feature"),
    "example_class": ("1", "clip"),
    "whitening": ("1/metre", "axis,axis"),
    "usual_distances": ("1", "scale"),
    "class_strictness": ("1", "class"),
    "scales": ("1", "scale"),
    "space_weights": ("1", "weight"),
    "space_mean": ("metre", "feature"),
    "space_axes": ("1", "feature,axis"),
    "space_deviations": ("metre", "axis"),
}
"""Units and dimensions of what `ClassIndex.to_arrays` returns."""


@dataclass(frozen=True)
class ClassScore:
    """How well a class explains a clip.

    Attributes
    ----------
    label : str
    log_density : float
        Mean over the frames, in nats.
    posterior : float
        Of an average frame; over all classes they sum to 1.
    share : float
        Of the frames, those that this class explains best.
    """

    label: str
    log_density: float
    posterior: float
    share: float


@dataclass(frozen=True)
class Classification:
    """What a clip is.

    Attributes
    ----------
    ranking : tuple of ClassScore
        The likeliest class first: by the density of the frames, and where that leaves several open,
        by how near the nearest clip of each is, in the order of time.
    novelty : float
        How unlike all that was learned the clip is; over 1 it is rejected.
    """

    ranking: tuple[ClassScore, ...]
    novelty: float

    @property
    def rejected(self) -> bool:
        """Whether the clip is none of the classes."""
        return self.novelty > 1.0

    @property
    def label(self) -> str | None:
        """The likeliest class, or None if the clip is rejected."""
        return None if self.rejected else self.ranking[0].label


class Moments:
    """Count, sum and products of the frames of a class: all that its model is fitted from."""

    def __init__(self) -> None:
        self.count = 0
        self.total = np.zeros(N_FEATURES)
        self.products = np.zeros((N_FEATURES, N_FEATURES))

    def add(self, values: FloatArray) -> None:
        """Add rows (F, 107)."""
        self.count += len(values)
        self.total += values.sum(axis=0)
        self.products += values.T @ values

    def model(self, model: PPCA) -> PPCA:
        """Fit a model to what was added."""
        mean = self.total / self.count
        return model.fit_moments(mean, self.products / self.count - np.outer(mean, mean))


class ClassIndex:
    """Classes learned from labelled clips.

    Parameters
    ----------
    noise : {"floored", "shared", "own"}
        The variance that a model gives to what its axes leave out: its own but at least `floor_m`
        squared, the mean over the classes, or its own as in the thesis.
    floor_m : float, metres
        By how much people who do the same differ in a coordinate.
    variance : float
        Share of the variance that the axes keep.

    Attributes
    ----------
    labels : tuple of str
        The classes, sorted.
    models : tuple of PPCA
    """

    def __init__(
        self, *, noise: Noise = "floored", floor_m: float = FLOOR_M, variance: float = KEPT_VARIANCE
    ) -> None:
        if noise not in ("floored", "shared", "own"):
            raise ClipError(f"Expected noise 'floored', 'shared' or 'own', but got {noise!r}.")
        self.noise: Noise = noise
        self.floor_m = floor_m
        self.variance = variance
        self.labels: tuple[str, ...] = ()
        self.models: tuple[PPCA, ...] = ()
        # the row in labels of each example, and what distances to a class's are multiplied by
        self.example_class: IntArray = np.zeros(0, dtype=np.int64)
        self.class_strictness: FloatArray = np.zeros(0)
        # median and spread of the distance and of the density of what was learned from, and the cut
        self.scales: FloatArray = np.zeros(5)

    def settings(self) -> dict[str, Any]:
        """Return the arguments that the index was made with."""
        return {"noise": self.noise, "floor_m": self.floor_m, "variance": self.variance}

    def to_arrays(self) -> dict[str, np.ndarray[Any, Any]]:
        """Return all that was learned as plain arrays; none if nothing was."""
        if not self.models:
            return {}
        counts = [len(model.components_) for model in self.models]
        return {
            "class_mean": np.stack([model.mean_ for model in self.models]),
            "class_axes": np.concatenate([model.components_ for model in self.models], dtype="f4"),
            "class_variance": np.concatenate([m.explained_variance_ for m in self.models]),
            "class_axis_starts": np.cumsum([0, *counts]),
            "class_noise": np.array([model.noise_variance_ for model in self.models]),
            "signatures": self.examples.shapes.signatures,
            "example_frames": self.examples.shapes.frames,
            "example_shares": self.examples.shapes.shares,
            "example_class": self.example_class,
            "whitening": self.examples.whitening,
            "usual_distances": self.examples.usual,
            "class_strictness": self.class_strictness,
            "scales": self.scales,
            "space_weights": np.array(astuple(self.space.weights)),
            "space_mean": self.space.mean,
            "space_axes": self.space.axes,
            "space_deviations": self.space.deviations,
        }

    @classmethod
    def from_arrays(
        cls,
        labels: Sequence[str],
        settings: Mapping[str, Any],
        arrays: Mapping[str, np.ndarray[Any, Any]],
    ) -> ClassIndex:
        """Rebuild what `settings` and `to_arrays` returned."""
        index = cls(**settings)
        if not labels:
            return index
        index.labels = tuple(labels)
        edges = arrays["class_axis_starts"]
        models = []
        for row, (first, end) in enumerate(pairwise(edges)):
            model = PPCA(index.variance)
            model.mean_ = arrays["class_mean"][row]
            model.components_ = arrays["class_axes"][first:end]
            model.explained_variance_ = arrays["class_variance"][first:end]
            model.noise_variance_ = float(arrays["class_noise"][row])
            model.n_features_in_ = len(model.mean_)
            models.append(model)
        index.models = tuple(models)
        shapes = (arrays[name] for name in ("signatures", "example_frames", "example_shares"))
        index.examples = Examples(
            ClipShapes(*shapes), arrays["whitening"], arrays["usual_distances"]
        )
        index.example_class = arrays["example_class"]
        index.class_strictness = arrays["class_strictness"]
        index.scales = arrays["scales"]
        index.space = FeatureSpace(
            Weights(*map(float, arrays["space_weights"])),
            arrays["space_mean"],
            arrays["space_axes"],
            arrays["space_deviations"],
        )
        return index

    # -- learning ------------------------------------------------------------------------------

    def fit(
        self,
        motions: Iterable[CanonicalMotion],
        labels: Sequence[str],
        *,
        groups: Sequence[str] | None = None,
        space: FeatureSpace | None = None,
    ) -> ClassIndex:
        """Learn the classes of labelled motions.

        Motions with a frame that lies out of all proportion shape no class that has others.

        Parameters
        ----------
        motions : iterable of CanonicalMotion
            Read three times, four times if no space is given.
        labels : sequence of str
        groups : sequence of str, optional
            Who performs each motion: how unlike other people's motion may be is learned from
            pairs of different people.
        space : FeatureSpace, optional
            Fitted to the motions by default.

        Raises
        ------
        ClipError
            If there is nothing to learn from.
        """
        motions = motions if isinstance(motions, Sequence) else list(motions)
        if not labels or len(motions) != len(labels):
            raise ClipError(
                f"Expected as many labels as clips, one at least, but got {len(labels)} labels "
                f"and {len(motions)} clips."
            )
        self.space = space or FeatureSpace.fit(motions)
        scales = self.space.weights.scales()
        moments = {label: Moments() for label in sorted(set(labels))}
        usual = np.ones(len(motions), dtype=np.bool_)
        for i, label in enumerate(labels):
            values = frame_features(motions[i]) * scales
            usual[i] = not self.space.is_outlying(motions[i])
            if usual[i]:
                moments[label].add(values)
        for i in np.flatnonzero(~usual).tolist():
            if not moments[labels[i]].count:  # a class of such motions alone is still a class
                moments[labels[i]].add(frame_features(motions[i]) * scales)
        self._set_models(moments)
        rows = {label: row for row, label in enumerate(self.labels)}
        self.example_class = np.array([rows[label] for label in labels])
        known = np.flatnonzero(usual) if usual.any() else np.arange(len(labels))
        some = known[np.linspace(0, len(known) - 1, min(len(known), CALIBRATION_CLIPS)).astype(int)]
        scores = np.array([self._log_densities(motions[i]).max() for i in some])
        _, who = np.unique(groups or range(len(labels)), return_inverse=True)
        if not people_share(self.example_class, who):  # go by other clips of the same person
            who = np.arange(len(labels))
        shapes = ClipShapes.of(motions, self.space)
        self.examples = Examples.fit(shapes, self.example_class, who, some)
        reach = self.examples.distances(shapes[some])
        reach[who[some, None] == who] = np.inf
        left_out = Examples.left_out_distances(shapes, self.example_class, who, some)
        self._calibrate(some, scores, reach, left_out)
        return self

    def _set_models(self, moments: dict[str, Moments]) -> None:
        self.labels = tuple(moments)
        floor = self.floor_m if self.noise == "floored" else 0.0
        fitted = [each.model(PPCA(self.variance, floor)) for each in moments.values()]
        if self.noise == "shared":
            rho = float(np.mean([model.noise_variance_ for model in fitted]))
            fitted = [
                each.model(PPCA(self.variance, noise_variance=rho)) for each in moments.values()
            ]
        self.models = tuple(fitted)

    def _calibrate(
        self, rows: IntArray, scores: FloatArray, reach: Float32Array, left_out: Float32Array
    ) -> None:
        """Learn how far motion of a known class by someone else is from what is known.

        Asked of some of the clips, `rows`, with their largest mean log density, `scores`, and their
        distances to those by others, infinite to their own: `reach` as they are, which says how
        wide each class is, and `left_out` as if they were new, which says where to cut.
        """
        is_own = self.example_class[rows, None] == self.example_class
        if not np.isfinite(np.where(is_own, reach, np.inf)).any():
            is_own = np.ones_like(is_own)  # every class has one clip
        own = np.where(is_own, reach, np.inf).min(axis=1)
        some = np.isfinite(own)
        self._set_strictness(self.example_class[rows][some], own[some])
        nearest = (left_out * self._strictness()).min(axis=1)[some]
        nearest = nearest[np.isfinite(nearest)]
        if not len(nearest):
            nearest = np.ones(1)
        density = scores[some] if some.any() else scores
        self.scales = np.array([*_middle(nearest), *_middle(density), 1.0])
        raw = self._raw_novelty(nearest)
        share = min(STRICTNESS * (1 + 1 / len(raw)), 1.0)  # one more clip, which is not yet known
        self.scales[4] = max(float(np.quantile(raw, share)), 1e-3)

    def _set_strictness(self, classes: IntArray, own: FloatArray) -> None:
        """Learn how much nearer than usual a clip has to be to each class.

        Where people do a class alike, what is far from them is not of it; where they differ, it may
        be. A class of which nobody else's clip is known is taken as usual.

        Parameters
        ----------
        classes : (m,)
            Of some clips.
        own : (m,)
            How far each is from the nearest clip of its class by someone else.
        """
        self.class_strictness = np.ones(len(self.labels))
        usual = float(np.median(own)) if len(own) else 1.0
        for row in np.unique(classes):
            reach = max(float(np.median(own[classes == row])), 1e-6)
            stricter = (max(usual, 1e-6) / reach) ** CLASS_POWER
            self.class_strictness[row] = np.clip(stricter, 1 / MOST_STRICTER, MOST_STRICTER)

    def _strictness(self) -> FloatArray:
        """Return what the distance to each example is multiplied by, (n,)."""
        return self.class_strictness[self.example_class]

    # -- asking ---------------------------------------------------------------------------------

    def log_densities(self, motion: CanonicalMotion) -> FloatArray:
        """Return the (F, K) log density of each frame under each class."""
        if not self.models:
            raise ClipError("Expected classes that were learned, but got none. Call fit first.")
        values = frame_features(motion) * self.space.weights.scales()
        return np.column_stack([model.score_samples(values) for model in self.models])

    def classify(self, motion: CanonicalMotion) -> Classification:
        """Return what a motion is: its classes by likelihood, and whether it is any of them."""
        return self._classified(motion)

    def _classified(self, motion: CanonicalMotion, without: int | None = None) -> Classification:
        """Return what a motion is; one of those that were learned from may be left out."""
        frames = self.log_densities(motion)
        mean = frames.mean(axis=0)
        posterior = np.exp(mean - mean.max())
        posterior /= posterior.sum()
        share = np.bincount(frames.argmax(axis=1), minlength=len(mean)) / len(frames)
        shape = ClipShapes.of([motion], self.space)
        distances = self.examples.distances(shape)[0] * self._strictness()
        if without is not None:
            distances[without] = np.inf
        ranking = tuple(
            ClassScore(self.labels[i], float(mean[i]), float(posterior[i]), float(share[i]))
            for i in self._ranked(mean, shape, distances)
        )
        novelty = self._raw_novelty(distances.min(keepdims=True, initial=np.inf)) / self.scales[4]
        return Classification(ranking, float(max(novelty[0], 0.0)))

    def _ranked(self, density: FloatArray, shape: ClipShapes, distances: FloatArray) -> list[int]:
        """Return the rows of the classes, the likeliest first.

        By the density of the frames; those that it leaves open by the nearest example of each.
        """
        order = [int(row) for row in np.argsort(-density, kind="stable")]
        alike = [row for row in order if density[row] >= density[order[0]] - ALIKE_NATS]
        if len(alike) == 1:
            return order
        nearest = {}
        for row in alike:
            own = np.flatnonzero((self.example_class == row) & np.isfinite(distances))
            own = own[np.argsort(distances[own], kind="stable")[:ALIKE_EXAMPLES]]
            warped = self.examples.warped_distances(shape, own) * self.class_strictness[row]
            nearest[row] = warped.min(initial=np.inf)
        return sorted(alike, key=lambda row: nearest[row]) + order[len(alike) :]

    def segment(
        self, motion: CanonicalMotion, *, switch_nats: float = SWITCH_NATS
    ) -> list[Segment]:
        """Return which class goes on when, as the likeliest course with few changes (Viterbi).

        Stretches that no class explains as well as known clips are explained are `NONE`.

        Parameters
        ----------
        motion : CanonicalMotion
        switch_nats : float, nats
            How much likelier the frames after a change of class must be in all.

        Returns
        -------
        list of Segment
            In frames at the rate of the index.
        """
        known = self.log_densities(motion)
        level = self.scales[2] - NONE_SPREADS * self.scales[3]
        frames = np.column_stack([known, np.full(len(known), level)])
        names = (*self.labels, NONE)
        total = frames[0].copy()
        came_from = np.zeros(frames.shape, dtype=np.int64)
        for i in range(1, len(frames)):
            best = int(total.argmax())
            changes = total[best] - switch_nats > total
            came_from[i] = np.where(changes, best, np.arange(len(total)))
            total = np.maximum(total, total[best] - switch_nats) + frames[i]
        course = np.empty(len(frames), dtype=np.int64)
        course[-1] = total.argmax()
        for i in range(len(frames) - 1, 0, -1):
            course[i - 1] = came_from[i, course[i]]
        edges = [0, *(np.flatnonzero(np.diff(course)) + 1), len(course)]
        return [
            Segment(int(start), int(end), names[course[start]]) for start, end in pairwise(edges)
        ]

    # -- growing --------------------------------------------------------------------------------

    def assign(
        self,
        motions: Sequence[CanonicalMotion],
        labels: Sequence[str | None],
        *,
        groups: Sequence[str] | None = None,
        rounds: int = ASSIGN_ROUNDS,
    ) -> list[str]:
        """Give every motion a class: of those known, or a new one where it fits none.

        Classes are fitted, motions without a label assigned, and the classes fitted again with
        them until nothing moves (O'Kane's future work, chapter 5). What fits no class opens one,
        ``"new 1"`` and so on, with what is near it.

        Parameters
        ----------
        motions : sequence of CanonicalMotion
        labels : sequence of str or None
            None where the class is wanted. One motion at least has a label.
        groups : sequence of str, optional
        rounds : int
            Give up after as many.
        """
        found = list(labels)
        free = [i for i, label in enumerate(labels) if label is None]
        groups = groups or [str(i) for i in range(len(motions))]
        space = FeatureSpace.fit(motions)
        for _ in range(rounds):
            members = [i for i, label in enumerate(found) if label is not None]
            self.fit(
                [motions[i] for i in members],
                [label for label in found if label is not None],
                groups=[groups[i] for i in members],
                space=space,
            )
            before = list(found)
            for i in free:
                own = members.index(i) if i in members else None
                found[i] = self._classified(motions[i], own).label
            self._open_class(motions, found)
            if found == before:
                break
        return [label or NEW_CLASS.format("?") for label in found]

    def _open_class(self, motions: Sequence[CanonicalMotion], found: list[str | None]) -> None:
        """Make a class of the motion without one that has the nearest company, and of those."""
        left = [i for i, label in enumerate(found) if label is None]
        if not left:
            return
        shapes = ClipShapes.of([motions[i] for i in left], self.space)
        known = self.examples
        distances = Examples(shapes, known.whitening, known.usual).distances(shapes)
        reach = self.scales[0] + self.scales[4] * self.scales[1]
        near = distances <= reach
        seed = int(near.sum(axis=1).argmax())
        numbers = (number for number in range(1, len(found) + 1))
        name = next(NEW_CLASS.format(n) for n in numbers if NEW_CLASS.format(n) not in found)
        for row in np.flatnonzero(near[seed]):
            found[left[row]] = name

    # -- inside ----------------------------------------------------------------------------------

    def _log_densities(self, motion: CanonicalMotion) -> FloatArray:
        return np.asarray(self.log_densities(motion).mean(axis=0))

    def _raw_novelty(self, distance: FloatArray) -> FloatArray:
        return np.asarray((distance - self.scales[0]) / self.scales[1])


def _middle(values: FloatArray) -> tuple[float, float]:
    """Return the median, and the spread: the width of the middle four fifths."""
    low, middle, high = np.quantile(values, [SPREAD_QUANTILES[0], 0.5, SPREAD_QUANTILES[1]])
    return float(middle), max(float(high - low), 1e-6)
