"""The interface to every codec: `encode` and `decode`.

A payload's header names its codec by number; what follows belongs to that codec alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Literal, TypeAlias

import numpy as np

from mocapdb._typing import FloatArray
from mocapdb.compression import okane
from mocapdb.compression.okane import Budgets
from mocapdb.compression.payload import Header, Payload, Reader, pack_array, seal, unseal
from mocapdb.compression.streams import pack_streams
from mocapdb.compression.targets import Target
from mocapdb.compression.transforms import TRANSFORMS, TransformName
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip
from mocapdb.motion.representations import REPRESENTATIONS, RepresentationName
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import MotionError, PointError, motion_error

__all__ = ["CODECS", "DEFAULT_SHARES", "CodecName", "decode", "encode"]

CodecName: TypeAlias = Literal["okane", "raw"]

RAW = 0
OKANE = 1
CODECS: dict[str, int] = {"raw": RAW, "okane": OKANE}
# measured on clips of many kinds: of joint angles PCA saves less than its axes cost, of positions
# most can be left to it, and the error of time adds to its by squares
_WITH_PCA = Budgets(root=0.2, pca=0.7, temporal=0.1)
DEFAULT_SHARES: Mapping[RepresentationName, Budgets] = {
    "channels": Budgets(root=0.4, pca=0.0, temporal=0.6),
    "positions": _WITH_PCA,
    "aligned": _WITH_PCA,
    "scaled": _WITH_PCA,
    "normalised": _WITH_PCA,
}
# the likeliest to win first, so that the others are given up early
AUTO_REPRESENTATIONS: tuple[RepresentationName, ...] = ("channels", "aligned")
AUTO_TRANSFORMS: tuple[TransformName, ...] = ("dwt", "dct")


def encode(
    clip: Clip,
    target: Target,
    *,
    codec: CodecName = "okane",
    representation: RepresentationName | Literal["auto"] = "auto",
    transform: TransformName | Literal["auto"] = "auto",
    shares: Budgets | None = None,
) -> Payload:
    """Compress a clip so that what `decode` gives is within a target.

    Parameters
    ----------
    clip : Clip
    target : Target
        Held on every clip: where a codec cannot, or where it would take more bytes, the channels
        are stored as they are.
    codec : {"okane", "raw"}
    representation : {"auto", "channels", "positions", "aligned", "scaled", "normalised"}
        What is transformed; ``"auto"`` takes of channels and aligned what needs fewer bytes.
    transform : {"auto", "dct", "dwt"}
        Over time; ``"auto"`` takes the one that needs fewer bytes.
    shares : Budgets, optional
        How the stages divide the target; by default `DEFAULT_SHARES` of the representation.

    Returns
    -------
    Payload

    Raises
    ------
    CodecError
        If an option is unknown, or the clip is too long for one payload.

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
    _check_choice("codec", codec, tuple(CODECS))
    _check_choice("representation", representation, (*REPRESENTATIONS, "auto"))
    _check_choice("transform", transform, (*TRANSFORMS, "auto"))
    best = _encode_raw(clip)
    if codec == "raw" or clip.skeleton.n_joints == 1:  # no bones, no skin: nothing to measure on
        return best
    representations = AUTO_REPRESENTATIONS if representation == "auto" else (representation,)
    transforms = AUTO_TRANSFORMS if transform == "auto" else (transform,)
    for name, over_time in product(representations, transforms):
        divided = DEFAULT_SHARES[name] if shares is None else shares
        payload = _encode_okane(clip, target, name, over_time, divided, len(best.data))
        if payload is not None and len(payload.data) < len(best.data):
            best = payload
    return best


def decode(data: bytes, skeleton: Skeleton, frames: slice | None = None) -> FloatArray:
    """Return the channels (F, C) of a payload.

    Parameters
    ----------
    data : bytes
        `Payload.data`.
    skeleton : Skeleton
        The one that the clip was encoded with; its name does not matter.
    frames : slice, optional
        Only these frames: the rows that the same slice of the whole clip has.

    Raises
    ------
    CodecError
        If the bytes are no payload, damaged, of a newer version or of another skeleton.
    """
    header, reader = unseal(data, skeleton)
    if header.codec_id == RAW:
        channels = _decode_raw(header, reader)
    elif header.codec_id == OKANE:
        channels = okane.expand(reader, skeleton, header.n_frames)
    else:
        raise CodecError(
            f"Expected a codec out of {', '.join(CODECS)}, but got number {header.codec_id}. "
            "Update mocapdb to read it."
        )
    return channels if frames is None else channels[frames]


def _encode_okane(
    clip: Clip,
    target: Target,
    representation: RepresentationName,
    transform: TransformName,
    shares: Budgets,
    below_bytes: int,
) -> Payload | None:
    """Return a payload that was decoded and found to hold the target, or None."""
    streams = okane.compress(
        clip,
        target,
        representation=representation,
        transform=transform,
        shares=shares,
        below_bytes=below_bytes,
    )
    if streams is None:
        return None
    data = seal(OKANE, clip.skeleton, len(clip), pack_streams(streams))
    error = motion_error(clip, clip.replace(channels=decode(data, clip.skeleton)))
    if not target.holds(error):
        return None
    return Payload(data, error, streams.describe(), streams.counted_bytes)


def _encode_raw(clip: Clip) -> Payload:
    body = pack_array(clip.channels, np.float64)
    return Payload(
        data=seal(RAW, clip.skeleton, len(clip), body),
        error=MotionError(0.0, PointError(0.0, 0.0, 0.0)),
        codec="raw",
        counted_bytes=len(body),
    )


def _decode_raw(header: Header, reader: Reader) -> FloatArray:
    values = reader.floats(np.float64, header.n_frames * header.n_channels, "channels")
    reader.finish()
    return values.reshape(header.n_frames, header.n_channels)


def _check_choice(what: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise CodecError(f"Expected a {what} out of {', '.join(choices)}, but got {value!r}.")
