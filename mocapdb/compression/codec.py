"""The interface to every codec: `encode` and `decode`.

A payload's header names its codec by number; what follows belongs to that codec alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray, FrameSource
from mocapdb.compression.byte_search import least_error_within
from mocapdb.compression.okane import okane_codec as okane
from mocapdb.compression.okane.okane_codec import Budgets, OkaneCoder
from mocapdb.compression.okane.okane_layout import pack_okane
from mocapdb.compression.okane.set_basis import SetBasis
from mocapdb.compression.payload import (
    VERSION_WITH_BLOCK_CHECKSUMS,
    ByteSource,
    Header,
    Payload,
    pack_array,
    pack_header,
    read_header,
    seal,
    unseal,
)
from mocapdb.compression.pose import pose_codec
from mocapdb.compression.pose.class_basis import Basis
from mocapdb.compression.pose.modes import PoseTransform
from mocapdb.compression.pose.pose_codec import Decorrelation
from mocapdb.compression.pose.pose_layout import PoseReader
from mocapdb.compression.targets import ByteBudget, Target
from mocapdb.compression.transforms import TRANSFORMS, WAVELET, TransformName, check_wavelet
from mocapdb.compression.tuning import OKANE_TIGHTENINGS, OKANE_TIGHTER, TIGHTENED
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_errors import JointErrors, joint_errors
from mocapdb.motion.representations import REPRESENTATIONS, RepresentationName
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import MotionError, PointError, channels_error

__all__ = [
    "CODECS",
    "OKANE_REPRESENTATION",
    "CodecName",
    "PayloadReader",
    "TemporalTransform",
    "decode",
    "encode",
    "okane_representations",
]

CodecName: TypeAlias = Literal["pose", "okane", "raw"]
TemporalTransform: TypeAlias = PoseTransform | TransformName

RAW = 0
OKANE = 1
POSE = 2
CODECS: dict[str, int] = {"pose": POSE, "okane": OKANE, "raw": RAW}
OKANE_REPRESENTATION: RepresentationName = "aligned"
"""What O'Kane's codec takes where nothing is said: of his five the one that he recommends."""
# those that win most often first, so that the others are given up early
AUTO_REPRESENTATIONS: tuple[RepresentationName, ...] = ("channels", "aligned")
OKANE_DECORRELATIONS: Mapping[str, tuple[Decorrelation, ...]] = {
    "auto": ("class", "pca", "none"),
    "class": ("class", "pca", "none"),
    "pca": ("pca", "none"),
    "none": ("none",),
}
AUTO_TRANSFORMS: tuple[TransformName, ...] = ("dwt", "dct")


def okane_representations(
    asked: RepresentationName | Literal["auto"] | None,
) -> tuple[RepresentationName, ...]:
    """Return the representations that O'Kane's codec tries where one is asked for, or none."""
    if asked == "auto":
        return AUTO_REPRESENTATIONS
    return (asked or OKANE_REPRESENTATION,)


@dataclass(frozen=True)
class _OkaneOptions:
    """What O'Kane's codec is told; see `encode`."""

    representation: RepresentationName | Literal["auto"] | None
    transform: TemporalTransform
    wavelet: str
    decorrelation: Decorrelation
    bases: Sequence[SetBasis]
    shares: Budgets | None


def encode(
    clip: Clip,
    target: Target | ByteBudget,
    *,
    codec: CodecName | None = None,
    transform: TemporalTransform = "auto",
    decorrelation: Decorrelation | None = None,
    basis: Basis | SetBasis | Sequence[SetBasis] | None = None,
    representation: RepresentationName | Literal["auto"] | None = None,
    shares: Budgets | None = None,
    wavelet: str | None = None,
) -> Payload:
    """Compress a clip so that what `decode` gives is within a target.

    Parameters
    ----------
    clip : Clip
    target : Target or ByteBudget
        An error, held on every clip with what it says of the joints' own motion: where a codec
        cannot, or where it would take more bytes, the channels are stored as they are. Or a number
        of bytes a frame: then the error is the least mean distance that is found within it,
        whatever single joints lose, and the codec is run some ten times.
    codec : {"pose", "okane", "raw"}, optional
        By default pose, or okane where a representation, shares, a wavelet or a set's axes
        are named.
    transform : str
        Over time. Pose has ``"spline"``, ``"dct32"``, ``"dct64"``, ``"dct"`` and ``"dwt"``, and
        with ``"auto"`` takes for each channel of a block what is cheapest of splines and ``"dct"``.
        Okane has the last two; ``"auto"`` takes of both what needs fewer bytes.
    decorrelation : {"auto", "lattice", "none", "pca", "class"}, optional
        Of pose: see `pose_codec.compress`; lattice by default. Of okane: ``"pca"``, axes of the
        clip's own; ``"class"``, the axes of `basis`; ``"none"``; ``"auto"``, the smallest of these.
        By default the axes of `basis`, and where there is none, or they will not do, the smaller
        of ``"pca"`` and ``"none"``.
    basis : Basis, SetBasis or several of these, optional
        What is known of the clip's class, and will be to whoever decodes it: of the codec's kind,
        and for O'Kane's one of each representation.
    representation : {"auto", "channels", "positions", "aligned", "scaled", "normalised"}, optional
        Of okane: what is transformed, aligned by default; ``"auto"`` takes of channels and aligned
        what needs fewer bytes.
    shares : Budgets, optional
        Of okane: how the stages divide the target, 1 together. By default those that need the
        fewest bytes are searched for.
    wavelet : str, optional
        Of okane: the wavelet of ``"dwt"``, by PyWavelets' names; bior4.4 by default.

    Returns
    -------
    Payload

    Raises
    ------
    CodecError
        If an option is unknown or belongs to another codec, the clip is too long for one payload,
        or no step of the codec keeps to a number of bytes.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> clip = synthetic.make_clip("walk", seed=1)
    >>> payload = encode(clip, Target("mean_mm", 2.0))
    >>> payload.error.vertices.mean <= 2.0
    True
    >>> decode(payload.data, clip.skeleton).shape == clip.channels.shape
    True
    >>> len(encode(clip, ByteBudget(4.0)).data) <= 4 * len(clip)
    True
    """
    is_okane = (representation, shares, wavelet) != (None, None, None)
    is_okane |= isinstance(basis, SetBasis | Sequence)
    if codec is None:
        codec = "okane" if is_okane else "pose"
    _check_choice("codec", codec, tuple(CODECS))
    no_skin = len(clip.skeleton.bone_joints) == 0  # and so nothing to measure on
    if isinstance(target, ByteBudget) and codec != "raw" and not no_skin:

        def encode_to(mean_mm: float) -> Payload:
            return encode(
                clip, Target("mean_mm", mean_mm, joint_share=0), codec=codec, transform=transform,
                decorrelation=decorrelation, basis=basis, representation=representation,
                shares=shares, wavelet=wavelet,
            )  # fmt: skip

        return least_error_within(target, len(clip), encode_to)
    if codec == "pose":
        if is_okane:
            raise CodecError(
                "Expected no representation, shares or wavelet for the pose codec, which codes "
                "channels. Name the codec okane for them."
            )
        _check_choice("transform", transform, get_args(PoseTransform))
    else:
        _check_choice("transform", transform, (*TRANSFORMS, "auto"))
        _check_choice("representation", representation or "auto", (*REPRESENTATIONS, "auto"))
    if codec == "raw" or no_skin:
        return _within_bytes(target, len(clip), _encode_raw(clip))
    assert isinstance(target, Target)
    target = target.for_codec(codec)
    if codec == "pose":
        known = basis if isinstance(basis, Basis) else None
        relation = decorrelation or "lattice"
        return _encode_pose(clip, target, transform, relation, known) or _encode_raw(clip)
    options = _okane_options(transform, wavelet, decorrelation, basis, representation, shares)
    return _smallest_okane(clip, target, options)


def decode(
    data: ByteSource,
    skeleton: Skeleton,
    frames: slice | None = None,
    *,
    bases: Mapping[bytes, bytes] | None = None,
) -> FloatArray:
    """Return the channels (F, C) of a payload.

    Parameters
    ----------
    data : bytes, or what gives the bytes of a slice
        `Payload.data`. Of a pose payload only the blocks that hold the frames are read.
    skeleton : Skeleton
        The one that the clip was encoded with; its name does not matter.
    frames : slice, optional
        Only these frames: the rows that the same slice of the whole clip has.
    bases : mapping of bytes to bytes, optional
        What the payload may refer to: bases by their digests.

    Raises
    ------
    CodecError
        If the bytes are no payload, damaged, of a newer version or of another skeleton.
    """
    return PayloadReader(data, skeleton, bases=bases).channels(frames)


class PayloadReader:
    """An open payload, from which frames can be had again and again.

    Parameters
    ----------
    data, skeleton, bases
        As for `decode`.

    Raises
    ------
    CodecError
        As `decode` does.
    """

    def __init__(
        self,
        data: ByteSource,
        skeleton: Skeleton,
        *,
        bases: Mapping[bytes, bytes] | None = None,
    ) -> None:
        self._data = data
        self._skeleton = skeleton
        self._header = read_header(data, skeleton)
        self._pose: PoseReader | None = None
        codec_id = self._header.codec_id
        if codec_id not in CODECS.values() or self._header.is_whole != (codec_id != POSE):
            raise CodecError(
                f"Expected a codec out of {', '.join(CODECS)}, but got number {codec_id}. "
                "Update mocapdb to read it."
            )
        self._bases = bases or {}
        if codec_id == POSE:
            self._pose = PoseReader(self._header, data, skeleton, self._bases)

    def __getitem__(self, frames: slice) -> FloatArray:
        """Return the channels (F, C) of some frames."""
        return self.channels(frames)

    def channels(self, frames: slice | None = None) -> FloatArray:
        """Return the channels (F, C), of all frames or of some.

        Raises
        ------
        CodecError
            If bytes are damaged.
        """
        if self._pose is not None:
            return self._pose.channels(frames)
        if self._header.codec_id == RAW:
            channels = _decode_raw(self._header, self._data)
        else:
            n_frames = self._header.n_frames
            channels = okane.expand(unseal(self._data), self._skeleton, n_frames, self._bases)
        return channels if frames is None else channels[frames]


def _encode_pose(
    clip: Clip,
    target: Target,
    transform: TemporalTransform,
    decorrelation: Decorrelation,
    basis: Basis | None,
) -> Payload | None:
    """Return a payload that was decoded and found to hold the target, or None.

    What the search holds block by block may break over the whole clip by a hair, as where a joint's
    swing is between two blocks: then a somewhat tighter target is asked for.
    """
    header = pack_header(POSE, VERSION_WITH_BLOCK_CHECKSUMS, clip.skeleton, len(clip))
    bases = {basis.digest: basis.to_bytes()} if basis is not None else None
    for share in TIGHTENED:
        aim = replace(target.tighter(share), joint_share=share * target.share)
        found = pose_codec.compress(
            clip, aim, header, transform=transform, decorrelation=decorrelation, basis=basis
        )
        if found is None:
            return None
        data, description = found
        decoded = PayloadReader(data, clip.skeleton, bases=bases)
        payload = _checked(clip, target, data, decoded, description, len(data))
        if payload is not None:
            return payload
    return None


def _okane_options(
    transform: TemporalTransform,
    wavelet: str | None,
    decorrelation: Decorrelation | None,
    basis: Basis | SetBasis | Sequence[SetBasis] | None,
    representation: RepresentationName | Literal["auto"] | None,
    shares: Budgets | None,
) -> _OkaneOptions:
    """Return what O'Kane's codec is told, or raise a `CodecError` where it does not fit together.

    Raises
    ------
    CodecError
        If a wavelet is unknown or has no use, or budget and decorrelation contradict each other.
    """
    if wavelet is not None:
        if transform == "dct":
            raise CodecError("Expected no wavelet for a DCT. Name the transform dwt or auto.")
        check_wavelet(wavelet)
    bases = [basis] if isinstance(basis, SetBasis) else []
    if isinstance(basis, Sequence):
        bases = list(basis)
    if decorrelation is None:
        decorrelation = "class" if bases else "auto"
        if shares is not None and shares.pca == 0:
            decorrelation = "none"
    _check_choice("decorrelation", decorrelation, tuple(OKANE_DECORRELATIONS))
    if decorrelation == "class" and not bases:
        raise CodecError("Expected a basis of the clip's class for decorrelation 'class'.")
    contradicts = shares is not None and (shares.pca == 0) != (decorrelation == "none")
    if shares is not None and contradicts and decorrelation != "auto":
        needed = "of 0" if decorrelation == "none" else "over 0"
        raise CodecError(
            f"Expected a budget {needed} for the PCA with decorrelation {decorrelation!r}, but got "
            f"{shares.pca:g}."
        )
    return _OkaneOptions(
        representation,
        transform,
        wavelet or WAVELET,
        decorrelation,
        bases,
        shares,
    )


def _smallest_okane(clip: Clip, target: Target, options: _OkaneOptions) -> Payload:
    """Return the smallest payload that was found among what the options leave open.

    The channels as they are where nothing is smaller. Where the axes of a set do not hold the
    target, its own do, or none.
    """
    best = raw = _encode_raw(clip)
    shares = options.shares
    names = okane_representations(options.representation)
    coders = [OkaneCoder(clip, target, name) for name in names]
    for relation in OKANE_DECORRELATIONS[options.decorrelation]:
        if shares is not None and (relation == "none") != (shares.pca == 0):
            continue
        if options.decorrelation != "auto" and best is not raw:
            break  # the others are for where the first will not do
        for coder in coders:
            for transform in AUTO_TRANSFORMS:
                if options.transform not in {"auto", transform}:
                    continue
                payload = _encode_okane(coder, clip, target, transform, relation, options, best)
                if payload is not None and len(payload.data) < len(best.data):
                    best = payload
    return best


def _encode_okane(
    coder: OkaneCoder,
    clip: Clip,
    target: Target,
    transform: TransformName,
    relation: Decorrelation,
    options: _OkaneOptions,
    best: Payload,
) -> Payload | None:
    """Return a payload that was decoded and found to hold the target, or None."""
    basis = next(filter(coder.fits, options.bases), None) if relation == "class" else None
    if relation == "class" and basis is None:
        return None
    bases = {basis.digest: basis.to_bytes()} if basis is not None else None
    allowed = target.value
    for _ in range(OKANE_TIGHTENINGS):
        coded = coder.code(
            transform,
            options.wavelet,
            shares=options.shares,
            with_pca=relation != "none",
            basis=basis,
            below_bytes=len(best.data),
        )
        if coded is None:
            break
        data = seal(OKANE, clip.skeleton, len(clip), pack_okane(coded))
        decoded = decode(data, clip.skeleton, bases=bases)
        lost = _lost(clip, target, decoded)
        if target.holds(lost.measured, lost.joints):
            described, counted_bytes = coded.describe(), coded.counted_bytes
            return Payload(data, lost.error, lost.joints, described, counted_bytes)
        # its coefficients know of no single joint; what is held anyway need not be tried
        share, reached = OKANE_TIGHTER, target.measure(lost.measured) / allowed
        while share >= reached > 0.0:
            share *= OKANE_TIGHTER
        allowed *= share
        coder = coder.tighter(share)
    return None


class _Lost(NamedTuple):
    """What a decoded clip lost: of the skin, of the target's points, and of its joints."""

    error: MotionError
    measured: MotionError
    joints: JointErrors


def _lost(clip: Clip, target: Target, decoded: FrameSource) -> _Lost:
    error = measured = channels_error(clip.skeleton, clip.channels, decoded)
    if target.points != "skin":
        measured = channels_error(clip.skeleton, clip.channels, decoded, points=target.points)
    return _Lost(error, measured, joint_errors(clip.skeleton, clip.channels, decoded))


def _checked(
    clip: Clip,
    target: Target,
    data: bytes,
    decoded: FrameSource,
    description: str,
    counted_bytes: int,
) -> Payload | None:
    """Return a payload with what it loses, measured on what it decodes to; None if too much."""
    lost = _lost(clip, target, decoded)
    if not target.holds(lost.measured, lost.joints):
        return None
    return Payload(data, lost.error, lost.joints, description, counted_bytes)


def _encode_raw(clip: Clip) -> Payload:
    body = pack_array(clip.channels, np.float64)
    return Payload(
        data=seal(RAW, clip.skeleton, len(clip), body),
        error=MotionError(0.0, PointError(0.0, 0.0, 0.0)),
        joints=joint_errors(clip.skeleton, clip.channels, clip.channels),
        codec="raw",
        counted_bytes=len(body),
    )


def _within_bytes(target: Target | ByteBudget, n_frames: int, raw: Payload) -> Payload:
    """Return the channels as they are, unless that takes more bytes than there are."""
    if isinstance(target, ByteBudget):
        return least_error_within(target, n_frames, lambda _: raw)
    return raw


def _decode_raw(header: Header, data: ByteSource) -> FloatArray:
    reader = unseal(data)
    values = reader.floats(np.float64, header.n_frames * header.n_channels, "channels")
    reader.finish()
    return values.reshape(header.n_frames, header.n_channels)


def _check_choice(what: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise CodecError(f"Expected a {what} out of {', '.join(choices)}, but got {value!r}.")
