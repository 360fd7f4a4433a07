"""The interface to every codec: `encode` and `decode`.

A payload's header names its codec by number; what follows belongs to that codec alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Literal, TypeAlias, get_args

import numpy as np

from mocapdb.base.arrays import FloatArray, FrameSource
from mocapdb.compression.okane import okane_codec as okane
from mocapdb.compression.okane.okane_codec import Budgets
from mocapdb.compression.okane.okane_layout import pack_okane
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
from mocapdb.compression.targets import Target
from mocapdb.compression.transforms import TRANSFORMS, TransformName
from mocapdb.compression.tuning import SHARES_OF_CHANNELS, SHARES_OF_POSITIONS
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip
from mocapdb.motion.representations import REPRESENTATIONS, RepresentationName
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import MotionError, PointError, channels_error

__all__ = [
    "CODECS",
    "DEFAULT_SHARES",
    "CodecName",
    "PayloadReader",
    "TemporalTransform",
    "decode",
    "encode",
]

CodecName: TypeAlias = Literal["pose", "okane", "raw"]
TemporalTransform: TypeAlias = PoseTransform | TransformName

RAW = 0
OKANE = 1
POSE = 2
CODECS: dict[str, int] = {"pose": POSE, "okane": OKANE, "raw": RAW}
_WITH_PCA = Budgets(*SHARES_OF_POSITIONS)
DEFAULT_SHARES: Mapping[RepresentationName, Budgets] = {
    "channels": Budgets(*SHARES_OF_CHANNELS),
    "positions": _WITH_PCA,
    "aligned": _WITH_PCA,
    "scaled": _WITH_PCA,
    "normalised": _WITH_PCA,
}
# those that win most often first, so that the others are given up early
AUTO_REPRESENTATIONS: tuple[RepresentationName, ...] = ("channels", "aligned")
AUTO_TRANSFORMS: tuple[TransformName, ...] = ("dwt", "dct")


def encode(
    clip: Clip,
    target: Target,
    *,
    codec: CodecName | None = None,
    transform: TemporalTransform = "auto",
    decorrelation: Decorrelation = "lattice",
    basis: Basis | None = None,
    representation: RepresentationName | Literal["auto"] | None = None,
    shares: Budgets | None = None,
) -> Payload:
    """Compress a clip so that what `decode` gives is within a target.

    Parameters
    ----------
    clip : Clip
    target : Target
        Held on every clip: where a codec cannot, or where it would take more bytes, the channels
        are stored as they are.
    codec : {"pose", "okane", "raw"}, optional
        By default pose, or okane where a representation or shares are named.
    transform : str
        Over time. Pose has ``"spline"``, ``"dct32"``, ``"dct64"``, ``"dct"`` and ``"dwt"``, okane
        the last two; ``"auto"`` takes what needs the fewest bytes.
    decorrelation : {"auto", "lattice", "none", "pca", "class"}
        Of pose: see `pose_codec.compress`.
    basis : Basis, optional
        Of pose: what is known of the clip's class, and will be to whoever decodes it.
    representation : {"auto", "channels", "positions", "aligned", "scaled", "normalised"}, optional
        Of okane: what is transformed; ``"auto"``, its default, takes of channels and aligned what
        needs fewer bytes.
    shares : Budgets, optional
        Of okane: how the stages divide the target; by default `DEFAULT_SHARES`.

    Returns
    -------
    Payload

    Raises
    ------
    CodecError
        If an option is unknown or belongs to another codec, or the clip is too long for one
        payload.

    Examples
    --------
    >>> from mocapdb.corpus import synthetic
    >>> clip = synthetic.make_clip("walk", seed=1)
    >>> payload = encode(clip, Target("mean_mm", 2.0))
    >>> payload.error.vertices.mean <= 2.0
    True
    >>> decode(payload.data, clip.skeleton).shape == clip.channels.shape
    True
    """
    if codec is None:
        codec = "pose" if representation is None and shares is None else "okane"
    _check_choice("codec", codec, tuple(CODECS))
    if codec == "pose":
        if representation is not None or shares is not None:
            raise CodecError(
                "Expected no representation or shares for the pose codec, which codes channels. "
                "Name the codec okane for them."
            )
        _check_choice("transform", transform, get_args(PoseTransform))
    else:
        _check_choice("transform", transform, (*TRANSFORMS, "auto"))
        _check_choice("representation", representation or "auto", (*REPRESENTATIONS, "auto"))
    no_skin = len(clip.skeleton.bone_joints) == 0  # and so nothing to measure on
    if codec == "raw" or no_skin:
        return _encode_raw(clip)
    if codec == "pose":
        return _encode_pose(clip, target, transform, decorrelation, basis) or _encode_raw(clip)
    best = _encode_raw(clip)
    chosen = representation or "auto"
    representations = AUTO_REPRESENTATIONS if chosen == "auto" else (chosen,)
    transforms = [name for name in AUTO_TRANSFORMS if transform in {"auto", name}]
    for name, over_time in product(representations, transforms):
        divided = DEFAULT_SHARES[name] if shares is None else shares
        payload = _encode_okane(clip, target, name, over_time, divided, len(best.data))
        if payload is not None and len(payload.data) < len(best.data):
            best = payload
    return best


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
        if codec_id == POSE:
            self._pose = PoseReader(self._header, data, skeleton, bases or {})

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
            channels = okane.expand(unseal(self._data), self._skeleton, self._header.n_frames)
        return channels if frames is None else channels[frames]


def _encode_pose(
    clip: Clip,
    target: Target,
    transform: TemporalTransform,
    decorrelation: Decorrelation,
    basis: Basis | None,
) -> Payload | None:
    """Return a payload that was decoded and found to hold the target, or None."""
    header = pack_header(POSE, VERSION_WITH_BLOCK_CHECKSUMS, clip.skeleton, len(clip))
    found = pose_codec.compress(
        clip, target, header, transform=transform, decorrelation=decorrelation, basis=basis
    )
    if found is None:
        return None
    data, description = found
    bases = {basis.digest: basis.to_bytes()} if basis is not None else None
    decoded = PayloadReader(data, clip.skeleton, bases=bases)
    return _checked(clip, target, data, decoded, description, len(data))


def _encode_okane(
    clip: Clip,
    target: Target,
    representation: RepresentationName,
    transform: TransformName,
    shares: Budgets,
    below_bytes: int,
) -> Payload | None:
    """Return a payload that was decoded and found to hold the target, or None."""
    coded = okane.compress(
        clip,
        target,
        representation=representation,
        transform=transform,
        shares=shares,
        below_bytes=below_bytes,
    )
    if coded is None:
        return None
    data = seal(OKANE, clip.skeleton, len(clip), pack_okane(coded))
    decoded = decode(data, clip.skeleton)
    return _checked(clip, target, data, decoded, coded.describe(), coded.counted_bytes)


def _checked(
    clip: Clip,
    target: Target,
    data: bytes,
    decoded: FrameSource,
    description: str,
    counted_bytes: int,
) -> Payload | None:
    """Return a payload with what it loses, measured on what it decodes to; None if too much."""
    error = measured = channels_error(clip.skeleton, clip.channels, decoded)
    if target.points != "skin":
        measured = channels_error(clip.skeleton, clip.channels, decoded, points=target.points)
    if not target.holds(measured):
        return None
    return Payload(data, error, description, counted_bytes)


def _encode_raw(clip: Clip) -> Payload:
    body = pack_array(clip.channels, np.float64)
    return Payload(
        data=seal(RAW, clip.skeleton, len(clip), body),
        error=MotionError(0.0, PointError(0.0, 0.0, 0.0)),
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
