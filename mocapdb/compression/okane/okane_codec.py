"""O'Kane's codec: PCA over the poses, a transform over time, and only the largest coefficients.

The stages (O'Kane 2008, section 3.2.3), each with a budget for the error that it may bring in:

1. **R**, the root: what alignment took out, or the root's own channels, is transformed over time
   and the largest coefficients are kept.
2. **P**, the poses: as few principal components as the budget allows, or the axes of a set that
   the clip belongs to; none of it if there is no budget.
3. **T**, time: the scores (or the poses) are transformed over time and the largest coefficients
   are kept; one threshold serves the whole matrix. This stage may use up whatever the others left.

How the stages divide a target is given, or found by minimising bytes, as he proposes. Nothing is
quantised beyond float32, and there is no entropy coding.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.okane.body_and_root import (
    BodyAndRoot,
    ErrorMeasures,
    join_root,
    parts_of,
)
from mocapdb.compression.okane.okane_layout import (
    BYTES_PER_COEFFICIENT,
    BYTES_PER_NUMBER,
    OkaneClip,
    read_okane,
)
from mocapdb.compression.okane.pca import FLOAT32_LIMIT, Components, principal_components
from mocapdb.compression.okane.root_finding import Ranking, fewest, golden_section
from mocapdb.compression.okane.set_basis import SetBasis
from mocapdb.compression.payload import Reader, check_size
from mocapdb.compression.targets import Target
from mocapdb.compression.transforms import (
    WAVELET,
    TransformName,
    forward_transform,
    inverse_transform,
)
from mocapdb.compression.tuning import (
    OKANE_MOST_WEIGHING,
    OKANE_OVERSHOOT,
    OKANE_RETRY,
    OKANE_ROOT_SLACK,
    OKANE_SHORT_FRAMES,
    OKANE_SLACK,
    OKANE_STRIDE,
    SPLIT_FRAMES,
    SPLIT_PCA_RANGE,
    SPLIT_REACH,
    SPLIT_ROOT_RANGE,
    SPLIT_ROUNDS,
    SPLIT_SLACK,
    SPLIT_START,
)
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip
from mocapdb.motion.representations import RepresentationName, restore_channels, shown_by_columns
from mocapdb.motion.skeleton import Skeleton

__all__ = ["Budgets", "OkaneCoder", "expand"]


@dataclass(frozen=True)
class Budgets:
    """How much error each stage may bring in.

    Parameters
    ----------
    root : float
        R. With 0 the root is kept exactly.
    pca : float
        P. With 0 there is no PCA.
    temporal : float
        T.

    Raises
    ------
    CodecError
        If one is negative or not finite, or all are zero.
    """

    root: float
    pca: float
    temporal: float

    def __post_init__(self) -> None:
        parts = (self.root, self.pca, self.temporal)
        if not all(np.isfinite(part) and part >= 0 for part in parts) or not any(parts):
            raise CodecError(
                "Expected budgets for root, PCA and time that are not negative and not all zero, "
                f"but got {parts}."
            )

    @property
    def total(self) -> float:
        """R + P + T."""
        return self.root + self.pca + self.temporal

    def check_shares(self) -> None:
        """Check that they divide a whole.

        Raises
        ------
        CodecError
            If they do not sum to 1.
        """
        if abs(self.total - 1.0) > 1e-6:
            raise CodecError(
                "Expected budgets for root, PCA and time that sum to 1, the whole target, but "
                f"{self.root:g} + {self.pca:g} + {self.temporal:g} is {self.total:g}."
            )

    def scaled(self, factor: float) -> Budgets:
        """Return the budgets times a factor: shares of a target become errors."""
        return Budgets(self.root * factor, self.pca * factor, self.temporal * factor)


class OkaneCoder:
    """Codes one clip in one representation, however often.

    Parameters
    ----------
    clip : Clip
    representation : {"channels", "positions", "aligned", "scaled", "normalised"}
    """

    def __init__(self, clip: Clip, representation: RepresentationName) -> None:
        self._clip = clip
        self._representation = representation
        self._parts = parts_of(clip, representation)
        check_size(len(clip), self._parts.body.shape[1])
        self._weights = np.ones(self._parts.body.shape[1])
        self._root_share = 1.0
        self._threshold = math.inf
        self._measures = ErrorMeasures(clip, representation)
        self._shares: dict[tuple[str, str, bool, bytes | None], tuple[float, Budgets]] = {}
        self._forget()

    def _forget(self) -> None:
        """Forget what was found for other weights."""
        self._pca_errors: dict[tuple[str, int, int], float] = {}
        self._roots: dict[tuple[str, str, str, float, int], tuple[FloatArray, bool]] = {}
        self._all_components: Components | None = None

    def weighed(self, excess: FloatArray, threshold: float) -> OkaneCoder:
        """Return a coder of the same clip in which joints that break their bound count more.

        One threshold serves all coefficients, and knows of no joint. But which coefficients reach
        it is up to the coder: here those of columns that show a joint are larger.

        Parameters
        ----------
        excess : (2, J)
            How many times over joints break the bounds of their turning and shifting.
        threshold : float
            What coefficients reached in the clip that was coded. It is kept, so that the other
            joints lose no more than they did.
        """
        growth = np.clip(OKANE_OVERSHOOT * excess, 1.0, OKANE_MOST_WEIGHING)
        growth[excess <= 1.0] = 1.0
        skeleton = self._clip.skeleton
        shown = shown_by_columns(skeleton, self._representation)
        other = copy(self)
        columns = np.where(shown, growth[:, :, None], 1.0).max(axis=(0, 1))
        n_root = len(columns) - len(self._weights)
        other._weights = self._weights * columns[n_root:]
        other._root_share = self._root_share / float(growth[:, skeleton.body_root].max())
        other._threshold = threshold
        other._forget()
        return other

    def fits(self, basis: SetBasis) -> bool:
        """Say whether the axes of a set are of this clip's columns."""
        is_same = basis.representation == self._representation
        return is_same and basis.fits(self._clip.skeleton)

    def code(
        self,
        target: Target,
        transform: TransformName,
        wavelet: str = WAVELET,
        *,
        shares: Budgets | None = None,
        with_pca: bool = True,
        basis: SetBasis | None = None,
        below_bytes: int | None = None,
    ) -> OkaneClip | None:
        """Return the fewest numbers found that hold the target, or None where there are none.

        There are none where float32 is too coarse for the target, where a set's axes leave too
        much, and where `below_bytes` is too few.

        Parameters
        ----------
        target : Target
            Bounds the error of the channels that `expand` gives, on every frame.
        transform : {"dct", "dwt"}
        wavelet : str
            Of the DWT.
        shares : Budgets, optional
            Of the target; 1 together. By default those that cost the fewest bytes.
        with_pca : bool
            Whether the shares that are searched for have one for the PCA.
        basis : SetBasis, optional
            Axes of the clip's set, in place of its own.
        below_bytes : int, optional
            What takes more is of no use: give up early.
        """
        if shares is not None:
            shares.check_shares()
        parts = (self._parts.body, self._parts.root)
        if max(np.abs(part).max(initial=0) for part in parts) > FLOAT32_LIMIT:
            return None
        plan = _Plan(target, transform, wavelet, with_pca, basis)
        shares = shares or self._usual_shares(plan)
        is_short = target.is_maximum or len(self._clip) < OKANE_SHORT_FRAMES
        stride = 1 if is_short else OKANE_STRIDE
        stages = self._stages(plan, shares, stride, OKANE_SLACK, below_bytes)
        if stages is None:
            return None
        return self._within(stages, shares.total * target.value, stride, below_bytes)

    def rough_bytes(self, target: Target, transform: TransformName, wavelet: str = WAVELET) -> int:
        """Return about how many bytes a target takes without PCA, in a tenth of the time."""
        stride = max(1, len(self._clip) // SPLIT_FRAMES)
        plan = _Plan(target, transform, wavelet, with_pca=False, basis=None)
        shares = Budgets(SPLIT_START[0], 0.0, 1.0 - SPLIT_START[0])
        stages = self._stages(plan, shares, stride, SPLIT_SLACK, None)
        assert stages is not None  # only a PCA may need too much
        count = stages.fewest(target.value, stride)
        return stages.size(stages.most if count is None else count)

    def _usual_shares(self, plan: _Plan) -> Budgets:
        """Return the shares that cost the fewest bytes; those of a target nearby will do."""
        digest = plan.basis.digest if plan.basis is not None else None
        kind = (plan.transform, plan.wavelet, plan.with_pca, digest)
        value, shares = self._shares.get(kind, (math.nan, None))
        if shares is None or not value / SPLIT_REACH <= plan.target.value <= value * SPLIT_REACH:
            shares = self._best_shares(plan)
            self._shares[kind] = plan.target.value, shares
        return shares

    def _best_shares(self, plan: _Plan) -> Budgets:
        """Return the shares that cost the fewest bytes, found roughly (O'Kane 2008, 3.2.3).

        First the PCA's is searched for, then the root's. The axes of a set are all used, so that
        only the root's is left.
        """
        stride = max(1, len(self._clip) // SPLIT_FRAMES)
        last: int | None = None

        @cache
        def cost(root: float, pca: float) -> float:
            nonlocal last
            shares = Budgets(root, pca, 1.0 - root - pca)
            stages = self._stages(plan, shares, stride, SPLIT_SLACK, None)
            if stages is None:
                return math.inf
            count = stages.fewest(plan.target.value, stride, guess=last)
            last = count
            return math.inf if count is None else stages.size(count)

        root, pca = SPLIT_START if plan.with_pca else (SPLIT_START[0], 0.0)
        if plan.with_pca and plan.basis is None:
            pca = _cheapest(lambda share: cost(root, share * (1.0 - root)), SPLIT_PCA_RANGE, pca)
        if self._parts.root.size:
            root = _cheapest(lambda share: cost(share, pca * (1.0 - share)), SPLIT_ROOT_RANGE, root)
        return Budgets(root, pca * (1.0 - root), (1.0 - pca) * (1.0 - root))

    def _stages(
        self, plan: _Plan, shares: Budgets, stride: int, slack: float, below_bytes: int | None
    ) -> _Stages | None:
        """Return what the first two stages make of the clip, or None where they need too much."""
        target, transform, wavelet, basis = plan.target, plan.transform, plan.wavelet, plan.basis
        budgets = shares.scaled(target.value)
        components = None
        scores, weights = self._parts.body, self._weights
        if budgets.pca:
            components = (
                self._keep_components(target, budgets.pca, stride, below_bytes)
                if basis is None
                else basis.components
            )
            if components is None:
                return None
            scores = components.project(scores)
            weights = np.linalg.norm(components.axes * weights, axis=1)
        root, root_is_exact = self._keep_root(plan, self._root_share * budgets.root, stride)
        ranking = Ranking(forward_transform(transform, scores, wavelet), weights)
        digest = basis.digest if basis is not None and components is not None else None

        def coded(count: int) -> OkaneClip:
            kept = ranking.largest(count)
            return OkaneClip(
                self._representation, transform, wavelet, components, digest, kept, root,
                root_is_exact, ranking.threshold(count),
            )  # fmt: skip

        def measure_every(stride: int) -> Callable[[BodyAndRoot], float]:
            return self._measures.every(target, stride)

        least = ranking.count(self._threshold)
        return _Stages(coded, least, len(ranking), measure_every, len(self._clip), slack)

    def _within(
        self, stages: _Stages, target: float, stride: int, below_bytes: int | None
    ) -> OkaneClip | None:
        """Return the fewest coefficients whose error on all frames is within a target."""
        most = stages.most
        if below_bytes is not None:
            spare_bytes = below_bytes - stages.size(0)
            most = min(most, spare_bytes // BYTES_PER_COEFFICIENT)
        allowed, least = target, stages.least
        while least <= most:
            count = stages.fewest(allowed, stride, least, most)
            found = stages.coded(most if count is None else count)
            error = stages.measure_every(1)(found.expand(len(self._clip)))
            if error <= target:
                return found
            if count is None:
                break
            # the frames left out have a larger error: aim lower
            allowed *= OKANE_RETRY * target / error
            least = count + 1
        return None

    def _keep_root(self, plan: _Plan, budget: float, stride: int) -> tuple[FloatArray, bool]:
        """Return the coefficients of the root track within its budget, or the track itself.

        The flag says whether it is the track, exactly: without a budget, or where all coefficients
        do not keep to it. What was found once is kept.
        """
        track = self._parts.root
        if budget == 0 or track.size == 0:
            return track, True
        transform, wavelet = plan.transform, plan.wavelet
        key = (transform, wavelet, plan.target.kind, budget, stride)
        if key not in self._roots:
            ranking = Ranking(forward_transform(transform, track, wavelet))
            body = self._parts.body[::stride]
            error_of = self._measures.every(plan.target, stride)

            def error(count: int) -> float:
                kept = inverse_transform(transform, ranking.largest(count), len(track), wavelet)
                return error_of(BodyAndRoot(body, kept[::stride]))

            count = fewest(error, budget, len(ranking), slack=OKANE_ROOT_SLACK)
            found = (track, True) if count is None else (ranking.largest(count), False)
            self._roots[key] = found
        return self._roots[key]

    def _keep_components(
        self, target: Target, budget: float, stride: int, below_bytes: int | None
    ) -> Components | None:
        """Return as few principal components of the poses as the budget allows.

        None where they alone would take more than `below_bytes`.
        """
        if self._all_components is None:
            self._all_components = principal_components(self._parts.body, self._weights)
        components = self._all_components
        most = len(components)
        if below_bytes is not None:
            n_vectors = below_bytes // (BYTES_PER_NUMBER * max(self._parts.body.shape[1], 1))
            most = min(most, n_vectors - 1)  # the mean is one
        if most < 0:
            return None

        def error(count: int) -> float:
            key = (target.kind, count, stride)
            if key not in self._pca_errors:
                chosen = components.first(count)
                some = self._parts.every(stride)
                lost = BodyAndRoot(chosen.restore(chosen.project(some.body)), some.root)
                self._pca_errors[key] = self._measures.every(target, stride)(lost)
            return self._pca_errors[key]

        count = fewest(error, budget, most)
        if count is None and most < len(components):
            return None
        return components.first(most if count is None else count)


class _Plan(NamedTuple):
    """What a clip is to be coded to, and how."""

    target: Target
    transform: TransformName
    wavelet: str
    with_pca: bool
    basis: SetBasis | None


@dataclass(frozen=True)
class _Stages:
    """What root and PCA have made of a clip: ready for the coefficients over time.

    Attributes
    ----------
    coded : callable
        The clip with so many coefficients.
    least : int
        How many coefficients are kept in any case.
    most : int
        How many there are.
    measure_every : callable
        The measure on every so many frames.
    n_frames : int
    slack : float
        To within which share the number of coefficients is searched for.
    """

    coded: Callable[[int], OkaneClip]
    least: int
    most: int
    measure_every: Callable[[int], Callable[[BodyAndRoot], float]]
    n_frames: int
    slack: float

    def size(self, count: int) -> int:
        """Return the bytes, as O'Kane counts them, with so many coefficients."""
        return self.coded(0).counted_bytes + BYTES_PER_COEFFICIENT * count

    def fewest(
        self,
        allowed: float,
        stride: int,
        least: int = 0,
        most: int | None = None,
        guess: int | None = None,
    ) -> int | None:
        """Return the fewest coefficients whose error on every so many frames is allowed."""
        error_of = self.measure_every(stride)
        return fewest(
            lambda count: error_of(self.coded(count).expand(self.n_frames, stride)),
            allowed,
            self.most if most is None else most,
            least=least,
            slack=self.slack,
            guess=guess,
        )


def _cheapest(cost_of: Callable[[float], float], among: tuple[float, float], usual: float) -> float:
    """Return the cheapest share that a golden-section search finds, or the usual one."""
    found = golden_section(cost_of, *among, SPLIT_ROUNDS)
    return min(found, usual, key=cost_of)


def expand(
    reader: Reader, skeleton: Skeleton, n_frames: int, bases: Mapping[bytes, bytes]
) -> FloatArray:
    """Return the channels (F, C) of a payload's body.

    Raises
    ------
    CodecError
        If the bytes do not fit together.
    """
    coded = read_okane(reader, skeleton, n_frames, bases)
    with np.errstate(over="ignore", invalid="ignore"):
        representation = join_root(skeleton, coded.representation, coded.expand(n_frames))
        channels = restore_channels(skeleton, representation)
    if not np.isfinite(channels).all():
        raise CodecError("Expected coefficients of a motion, but got some that are out of range.")
    return channels
