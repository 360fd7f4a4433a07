"""The byte format of a compressed clip (docs/format.md, "Clip payloads").

All numbers are little-endian. A payload is a header and what its codec wrote. In version 1 a CRC-32
of all bytes before it comes last; in version 2 the codec has checksums of its own, so that a part
can be read and checked alone. The skeleton is not inside: the header holds the first bytes of its
digest.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import DTypeLike, NDArray

from mocapdb.base.arrays import FloatArray
from mocapdb.errors import CodecError
from mocapdb.motion.joint_errors import JointErrors
from mocapdb.motion.skeleton import Skeleton
from mocapdb.motion.skin import MotionError

__all__ = [
    "HEADER_BYTES",
    "MAX_VALUES",
    "ByteSource",
    "Header",
    "Payload",
    "Reader",
    "pack_array",
    "pack_header",
    "pack_sparse",
    "read_header",
    "read_sparse",
    "seal",
    "unseal",
]

MAGIC = b"MCDP"
VERSION = 1
VERSION_WITH_BLOCK_CHECKSUMS = 2  # the codec checks what it reads
MAX_VALUES = 2**27  # of one matrix: a gibibyte of float64, an hour of a 300-value body at 120 Hz
_HEADER = struct.Struct("<4sBBHI8s")
HEADER_BYTES = _HEADER.size
_CRC = struct.Struct("<I")
_SHORT_LENGTH = 0xFFFF  # columns up to this long have 16-bit indices


class ByteSource(Protocol):
    """Bytes, or what reads the bytes of a slice when it is asked for them."""

    def __len__(self) -> int: ...

    def __getitem__(self, part: slice, /) -> bytes: ...


@dataclass(frozen=True)
class Payload:
    """A clip as bytes.

    Attributes
    ----------
    data : bytes
        Self-contained but for the skeleton; what `decode` reads.
    error : MotionError
        What the clip lost, measured on every frame of what `decode` gives.
    joints : JointErrors
        What each joint lost of its own motion.
    codec : str
        What was chosen, such as ``"okane aligned dct pca=17"``.
    counted_bytes : int
        The size as O'Kane counts it: 4 + 2 bytes a coefficient, 4 bytes a number of the PCA.
    """

    data: bytes
    error: MotionError
    joints: JointErrors
    codec: str
    counted_bytes: int

    def __repr__(self) -> str:
        return f"Payload({self.codec}: {len(self.data)} bytes, {self.error})"


@dataclass(frozen=True)
class Header:
    """What every payload says first.

    Attributes
    ----------
    codec_id : int
        Which codec wrote the rest.
    is_whole : bool
        Whether a checksum of the whole comes last.
    n_channels, n_frames : int
        Shape of the channels that come out.
    """

    codec_id: int
    is_whole: bool
    n_channels: int
    n_frames: int


def pack_header(codec_id: int, version: int, skeleton: Skeleton, n_frames: int) -> bytes:
    """Return the header of a payload."""
    reference = _reference(skeleton)
    return _HEADER.pack(MAGIC, version, codec_id, skeleton.n_channels, n_frames, reference)


def read_header(data: ByteSource, skeleton: Skeleton) -> Header:
    """Return the header of a payload.

    Raises
    ------
    CodecError
        If the bytes are no payload, of a newer version, or of another skeleton.
    """
    start = bytes(data[:HEADER_BYTES])
    if len(data) < HEADER_BYTES + _CRC.size or start[:4] != MAGIC:
        raise CodecError(
            f"Expected a clip payload starting with {MAGIC!r}, but got {len(data)} bytes "
            f"starting with {start[:4]!r}."
        )
    _, version, codec_id, n_channels, n_frames, reference = _HEADER.unpack(start)
    if version not in {VERSION, VERSION_WITH_BLOCK_CHECKSUMS}:
        raise CodecError(
            f"Expected a clip payload of version {VERSION_WITH_BLOCK_CHECKSUMS} or older, but got "
            f"version {version}. Update mocapdb to read it."
        )
    if reference != _reference(skeleton) or n_channels != skeleton.n_channels:
        raise CodecError(
            f"Expected the skeleton with digest {reference.hex()}... and {n_channels} channels, "
            f"but got {skeleton!r} with {skeleton.digest[:16]}... and {skeleton.n_channels}."
        )
    check_size(n_frames, n_channels)
    if n_frames == 0:
        raise CodecError("Expected a clip payload to have frames, but it says 0.")
    return Header(codec_id, version == VERSION, n_channels, n_frames)


def seal(codec_id: int, skeleton: Skeleton, n_frames: int, body: bytes) -> bytes:
    """Return a payload of version 1: header, body and checksum."""
    header = pack_header(codec_id, VERSION, skeleton, n_frames)
    return header + body + _CRC.pack(zlib.crc32(body, zlib.crc32(header)))


def unseal(data: ByteSource) -> Reader:
    """Return a reader at the start of the body of a payload of version 1.

    Raises
    ------
    CodecError
        If the bytes are damaged.
    """
    whole = memoryview(data[: len(data)])
    content = whole[: -_CRC.size]
    (stored,) = _CRC.unpack_from(whole, len(content))
    found = zlib.crc32(content)
    if stored != found:
        raise CodecError(
            f"Expected a clip payload with checksum {stored:08x}, but its bytes have "
            f"{found:08x}. It is damaged: build it again or restore a copy."
        )
    return Reader(content[HEADER_BYTES:])


def check_size(n_frames: int, n_columns: int) -> None:
    """Refuse matrices that no sensible clip needs, before anything is allocated for them.

    Raises
    ------
    CodecError
        If there are more than `MAX_VALUES` values.
    """
    if n_frames * n_columns > MAX_VALUES:
        raise CodecError(
            f"Expected a clip of at most {MAX_VALUES} values, but got {n_frames} frames of "
            f"{n_columns}. Split the clip."
        )


class Reader:
    """Takes arrays off the front of some bytes, and never more than there are.

    Attributes
    ----------
    at : int
        How many bytes it has taken.
    """

    def __init__(self, content: memoryview) -> None:
        self._content = content
        self.at = 0

    def array(self, dtype: DTypeLike, count: int, what: str) -> NDArray[np.generic]:
        """Return the next `count` numbers as a read-only view.

        Raises
        ------
        CodecError
            If there are not as many.
        """
        kind = np.dtype(dtype).newbyteorder("<")
        end = self.at + count * kind.itemsize
        if end > len(self._content):
            raise CodecError(
                f"Expected {count} x {kind.itemsize} bytes of {what} at byte {self.at} of the "
                f"payload's body, but it has {len(self._content)}. It is damaged: build it again."
            )
        values = np.frombuffer(self._content, kind, count, self.at)
        self.at = end
        return values

    def floats(self, dtype: DTypeLike, count: int, what: str) -> FloatArray:
        """Return the next `count` floating-point numbers as float64.

        Raises
        ------
        CodecError
            If there are not as many, or one is not finite.
        """
        values = self.array(dtype, count, what).astype(np.float64)
        if not np.isfinite(values).all():
            raise CodecError(f"Expected finite {what}, but got NaN or infinity.")
        return values

    def finish(self) -> None:
        """Check that everything was read.

        Raises
        ------
        CodecError
            If bytes are left over.
        """
        left = len(self._content) - self.at
        if left:
            raise CodecError(f"Expected the payload's body to end, but {left} bytes are left.")


def pack_array(values: NDArray[np.generic], dtype: DTypeLike) -> bytes:
    """Return numbers as little-endian bytes of one type."""
    return values.astype(np.dtype(dtype).newbyteorder("<")).tobytes()


def pack_sparse(coefficients: FloatArray) -> bytes:
    """Return the nonzero coefficients of a matrix (L, N), column by column.

    The number in each column, then every index within its column, then every value.
    """
    columns, rows = np.nonzero(coefficients.T)
    index_type = _index_type(len(coefficients))
    counts = np.bincount(columns, minlength=coefficients.shape[1])
    return (
        pack_array(counts, index_type)
        + pack_array(rows, index_type)
        + pack_array(coefficients[rows, columns], np.float32)
    )


def read_sparse(reader: Reader, length: int, n_columns: int) -> FloatArray:
    """Return the matrix (L, N) that `pack_sparse` wrote.

    Raises
    ------
    CodecError
        If counts or indices do not fit the matrix.
    """
    check_size(length, n_columns)
    index_type = _index_type(length)
    counts = reader.array(index_type, n_columns, "coefficient counts").astype(np.int64)
    if n_columns and counts.max() > length:
        raise CodecError(
            f"Expected at most {length} coefficients in a column, but got {counts.max()}."
        )
    total = int(counts.sum())
    rows = reader.array(index_type, total, "coefficient indices").astype(np.int64)
    values = reader.floats(np.float32, total, "coefficients")
    if total and rows.max() >= length:
        raise CodecError(f"Expected coefficient indices below {length}, but got {rows.max()}.")
    coefficients = np.zeros((length, n_columns))
    coefficients[rows, np.repeat(np.arange(n_columns), counts)] = values
    return coefficients


def _index_type(length: int) -> DTypeLike:
    return np.uint16 if length <= _SHORT_LENGTH else np.uint32


def _reference(skeleton: Skeleton) -> bytes:
    return bytes.fromhex(skeleton.digest[:16])
