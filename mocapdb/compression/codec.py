"""The interface to every codec: `encode` and `decode`.

A payload's header names its codec by number; what follows belongs to that codec alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Literal, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray
from mocapdb.compression.byte_search import least_error_within
from mocapdb.compression.okane import okane_codec
from mocapdb.compression.okane.okane_codec import Budgets
from mocapdb.compression.okane.okane_search import (
    OKANE,
    OKANE_DECORRELATIONS,
    OkaneOptions,
    OkaneSearch,
)
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
from mocapdb.compression.tightening import Coded, first_that_holds
from mocapdb.compression.transforms import TRANSFORMS, TransformName
from mocapdb.compression.tuning import BYTES_START_MM, LOOSEST_PROMISE_MM, MAX_OF_MEAN
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip
from mocapdb.motion.joint_errors import joint_errors, joint_motion
from mocapdb.motion.representations import REPRESENTATIONS, RepresentationName
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import VERTICES_PER_BONE, MotionError, PointError

__all__ = [
    "CODECS",
    "CodecName",
    "PayloadReader",
    "TemporalTransform",
    "decode",
    "encode",
]

CodecName: TypeAlias = Literal["pose", "okane", "raw"]
TemporalTransform: TypeAlias = PoseTransform | TransformName

RAW = 0
POSE = 2
CODECS: dict[str, int] = {"pose": POSE, "okane": OKANE, "raw": RAW}


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
    codec = codec or ("okane" if is_okane else "pose")
    _check_choice("codec", codec, tuple(CODECS))
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
    encode_to: Callable[[Target], Payload]
    start_mm = BYTES_START_MM
    if codec == "raw" or len(clip.skeleton.bone_joints) == 0:  # without a skin all holds
        encode_to = cache(lambda _: _encode_raw(clip))
    elif codec == "pose":
        known = basis if isinstance(basis, Basis) else None
        encode_to = partial(_encode_pose, clip, transform, decorrelation or "lattice", known)
    else:
        _check_choice("decorrelation", decorrelation or "auto", tuple(OKANE_DECORRELATIONS))
        bases = basis if isinstance(basis, Sequence) else [basis]
        options = OkaneOptions.checked(
            representation,
            transform,
            wavelet,
            decorrelation,
            [each for each in bases if isinstance(each, SetBasis)],
            shares,
        )
        search = OkaneSearch(clip, options, is_near=isinstance(target, ByteBudget))
        encode_to = partial(search.smallest, _encode_raw(clip))
        if isinstance(target, ByteBudget):
            start_mm = search.likely_mean_mm(target.bytes_per_frame * len(clip))
    if isinstance(target, ByteBudget):

        def encode_to_mean(mean_mm: float) -> Payload:
            return encode_to(Target("mean_mm", mean_mm, joint_share=0))

        return least_error_within(target, len(clip), encode_to_mean, start_mm)
    target = target.for_codec(codec)
    return encode_to(_searched_for(target, clip.skeleton) if codec == "pose" else target)


def _searched_for(target: Target, skeleton: Skeleton) -> Target:
    """Return a target, or the loosest that is worth a search where joints keep their own motion.

    Beyond it the promise to the joints decides, and a search that starts further from it ends with
    more bytes.
    """
    mean_mm = LOOSEST_PROMISE_MM
    most = MAX_OF_MEAN * mean_mm if target.is_maximum else mean_mm
    if target.kind == "skinned":  # as if all vertices were off by as much
        n_vertices = max(VERTICES_PER_BONE * len(skeleton.bone_joints), 1)
        most = mean_mm / (1000.0 * skeleton.metres_per_unit) * math.sqrt(n_vertices)
    is_loose = target.share > 0 and target.value > most
    return replace(target, value=most) if is_loose else target


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
            channels = okane_codec.expand(unseal(self._data), self._skeleton, n_frames, self._bases)
        return channels if frames is None else channels[frames]


def _encode_pose(
    clip: Clip,
    transform: TemporalTransform,
    decorrelation: Decorrelation,
    basis: Basis | None,
    target: Target,
) -> Payload:
    """Return a payload that holds the target when it is decoded, or the channels as they are."""
    header = pack_header(POSE, VERSION_WITH_BLOCK_CHECKSUMS, clip.skeleton, len(clip))
    bases = {basis.digest: basis.to_bytes()} if basis is not None else None
    motion = joint_motion(clip.skeleton, clip.channels)

    def code(aim: Target) -> Coded | None:
        found = pose_codec.compress(
            clip,
            aim,
            header,
            transform=transform,
            decorrelation=decorrelation,
            basis=basis,
            motion=motion,
        )
        if found is None:
            return None
        data, description = found
        return Coded(data, PayloadReader(data, clip.skeleton, bases=bases), description, len(data))

    return first_that_holds(clip, target, code, motion) or _encode_raw(clip)


def _encode_raw(clip: Clip) -> Payload:
    body = pack_array(clip.channels, np.float64)
    return Payload(
        data=seal(RAW, clip.skeleton, len(clip), body),
        error=MotionError(0.0, PointError(0.0, 0.0, 0.0)),
        joints=joint_errors(clip.skeleton, clip.channels, clip.channels),
        codec="raw",
        counted_bytes=len(body),
    )


def _decode_raw(header: Header, data: ByteSource) -> FloatArray:
    reader = unseal(data)
    values = reader.floats(np.float64, header.n_frames * header.n_channels, "channels")
    reader.finish()
    return values.reshape(header.n_frames, header.n_channels)


def _check_choice(what: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise CodecError(f"Expected a {what} out of {', '.join(choices)}, but got {value!r}.")
