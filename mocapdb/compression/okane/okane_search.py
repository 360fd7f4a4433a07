"""The choice among what O'Kane's codec leaves open: representation, transform, kind of PCA."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.okane.okane_codec import Budgets, OkaneCoder, expand
from mocapdb.compression.okane.okane_layout import OkaneClip, pack_okane
from mocapdb.compression.okane.set_basis import SetBasis
from mocapdb.compression.payload import Payload, seal, unseal
from mocapdb.compression.targets import Target
from mocapdb.compression.tightening import Coded, first_that_holds
from mocapdb.compression.transforms import WAVELET, TransformName, check_wavelet
from mocapdb.compression.tuning import (
    BYTES_FALL,
    BYTES_ROUGH_ROUNDS,
    BYTES_START_MM,
    FINEST_MM,
    LARGEST_STRIDE,
    LOOSEST_MM,
    OKANE_WEIGHINGS,
    SPLIT_REACH,
)
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_errors import JointMotion, joint_errors, joint_motion
from mocapdb.motion.representations import RepresentationName

__all__ = [
    "OKANE",
    "OKANE_DECORRELATIONS",
    "OKANE_REPRESENTATION",
    "OkaneDecorrelation",
    "OkaneOptions",
    "OkaneSearch",
    "okane_representations",
]

OKANE = 1
"""The codec's number in a payload."""
OkaneDecorrelation: TypeAlias = Literal["auto", "class", "pca", "none"]
OKANE_REPRESENTATION: RepresentationName = "aligned"
"""What O'Kane's codec takes where nothing is said: of his five the one that he recommends."""
# those that win most often first, so that the others are given up early
AUTO_REPRESENTATIONS: tuple[RepresentationName, ...] = ("channels", "aligned")
AUTO_TRANSFORMS: tuple[TransformName, ...] = ("dwt", "dct")
OKANE_DECORRELATIONS: Mapping[str, tuple[str, ...]] = {
    "auto": ("class", "pca", "none"),
    "class": ("class", "pca", "none"),
    "pca": ("pca", "none"),
    "none": ("none",),
}


def okane_representations(
    asked: RepresentationName | Literal["auto"] | None,
) -> tuple[RepresentationName, ...]:
    """Return the representations that O'Kane's codec tries where one is asked for, or none."""
    if asked == "auto":
        return AUTO_REPRESENTATIONS
    return (asked or OKANE_REPRESENTATION,)


@dataclass(frozen=True)
class OkaneOptions:
    """What O'Kane's codec is told; see `mocapdb.compression.encode`."""

    representation: RepresentationName | Literal["auto"] | None
    transform: str
    wavelet: str
    decorrelation: str
    bases: Sequence[SetBasis]
    shares: Budgets | None

    @classmethod
    def checked(
        cls,
        representation: RepresentationName | Literal["auto"] | None,
        transform: str,
        wavelet: str | None,
        decorrelation: str | None,
        bases: Sequence[SetBasis],
        shares: Budgets | None,
    ) -> OkaneOptions:
        """Return the options, where nothing is said those that are usual.

        Raises
        ------
        CodecError
            If a wavelet is unknown or has no use, shares do not sum to 1, or shares and
            decorrelation contradict each other.
        """
        if wavelet is not None:
            if transform == "dct":
                raise CodecError("Expected no wavelet for a DCT. Name the transform dwt or auto.")
            check_wavelet(wavelet)
        if shares is not None:
            shares.check_shares()
        if decorrelation is None:
            decorrelation = "class" if bases else "auto"
            if shares is not None and shares.pca == 0:
                decorrelation = "none"
        if decorrelation == "class" and not bases:
            raise CodecError("Expected a basis of the clip's class for decorrelation 'class'.")
        contradicts = shares is not None and (shares.pca == 0) != (decorrelation == "none")
        if shares is not None and contradicts and decorrelation != "auto":
            needed = "of 0" if decorrelation == "none" else "over 0"
            raise CodecError(
                f"Expected a budget {needed} for the PCA with decorrelation {decorrelation!r}, but "
                f"got {shares.pca:g}."
            )
        return cls(representation, transform, wavelet or WAVELET, decorrelation, bases, shares)


class _Way(NamedTuple):
    """One of the ways that the options leave open."""

    coder: OkaneCoder
    transform: TransformName
    relation: str


class OkaneSearch:
    """The smallest payload of a clip among what its options leave open, for one target or several.

    Parameters
    ----------
    clip : Clip
    options : OkaneOptions
    is_near : bool
        Whether targets are asked for one near the other, so that the way and the shares that were
        the smallest for one will do for the next.
    """

    def __init__(self, clip: Clip, options: OkaneOptions, *, is_near: bool = False) -> None:
        self._clip = clip
        self._options = options
        names = okane_representations(options.representation)
        self._coders = [OkaneCoder(clip, name) for name in names]
        self._motion: JointMotion | None = None
        self._is_near = is_near
        self._known_way: _Way | None = None
        self._known_for = math.nan  # the target for which it was the smallest

    def smallest(self, raw: Payload, target: Target) -> Payload:
        """Return the smallest payload found; the channels as they are where nothing is smaller.

        Where the axes of a set do not hold the target, the clip's own do, or none.

        Parameters
        ----------
        raw : Payload
            The channels as they are.
        target : Target
        """
        best, chosen = raw, None
        if self._known_for / SPLIT_REACH <= target.value <= self._known_for * SPLIT_REACH:
            chosen = self._known_way
        is_new = chosen is None
        for way in self._ways() if chosen is None else [chosen]:
            is_other = chosen is not None and way.relation != chosen.relation
            if is_other and self._options.decorrelation != "auto":
                break  # these are for where the first will not do
            payload = self._encode(way, target, len(best.data))
            if payload is not None and len(payload.data) < len(best.data):
                best, chosen = payload, way
        if self._is_near and is_new:
            self._known_way, self._known_for = chosen, target.value
        return best

    def likely_mean_mm(self, n_bytes: float) -> float:
        """Return a mean distance for which a payload takes about so many bytes."""
        transform = self._options.transform
        mean_mm, limit = BYTES_START_MM, math.log(LARGEST_STRIDE)
        for _ in range(BYTES_ROUGH_ROUNDS):
            target = Target("mean_mm", mean_mm, joint_share=0)
            size = self._coders[0].rough_bytes(
                target, "dct" if transform == "dct" else "dwt", self._options.wavelet
            )
            change = BYTES_FALL * math.log(max(size, 1) / n_bytes)  # so coarse that nothing is left
            mean_mm *= math.exp(min(max(change, -limit), limit))
            mean_mm = min(max(mean_mm, FINEST_MM), LOOSEST_MM)
        return mean_mm

    def _ways(self) -> Iterator[_Way]:
        shares = self._options.shares
        for relation in OKANE_DECORRELATIONS[self._options.decorrelation]:
            if shares is not None and (relation == "none") != (shares.pca == 0):
                continue
            for coder in self._coders:
                for transform in AUTO_TRANSFORMS:
                    if self._options.transform in {"auto", transform}:
                        yield _Way(coder, transform, relation)

    def _encode(self, way: _Way, target: Target, below_bytes: int) -> Payload | None:
        """Return a payload that was decoded and found to hold the target, or None."""
        basis = None
        if way.relation == "class":
            basis = next(filter(way.coder.fits, self._options.bases), None)
            if basis is None:
                return None
        coder = way.coder
        skeleton, channels = self._clip.skeleton, self._clip.channels
        bases = {basis.digest: basis.to_bytes()} if basis is not None else {}

        def coded_to(aim: Target) -> OkaneClip | None:
            return coder.code(
                aim,
                way.transform,
                self._options.wavelet,
                shares=self._options.shares,
                with_pca=way.relation != "none",
                basis=basis,
                below_bytes=below_bytes,
            )

        def code(aim: Target) -> Coded | None:
            nonlocal coder
            for weighing in range(OKANE_WEIGHINGS + 1):
                coded = coded_to(aim)
                if coded is None:
                    break
                data = seal(OKANE, skeleton, len(channels), pack_okane(coded))
                decoded = expand(unseal(data), skeleton, len(channels), bases)
                excess = self._excess(aim, decoded)
                if weighing == OKANE_WEIGHINGS or excess.max(initial=0.0) <= 1.0:
                    return Coded(data, decoded, coded.describe(), coded.counted_bytes)
                coder = coder.weighed(excess, coded.threshold)
            return None

        return first_that_holds(self._clip, target, code)

    def _excess(self, target: Target, decoded: FloatArray) -> FloatArray:
        """Return how many times over each joint breaks its bound (2, J)."""
        skeleton, channels = self._clip.skeleton, self._clip.channels
        if not target.share:
            return np.zeros((2, skeleton.n_joints))
        self._motion = self._motion or joint_motion(skeleton, channels)
        return target.excess_by_joint(joint_errors(skeleton, channels, decoded, self._motion))
