"""The bytes of the pose codec: an index and a head in front, then blocks that stand alone.

A frame is decoded from the front and the one block that it is in. Every block is followed by a
checksum of itself and of the front, so that a reader of a few frames checks all that it used.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping

import numpy as np

from mocapdb.base.arrays import ByteArray, FloatArray, IntArray
from mocapdb.base.kernels import jit
from mocapdb.compression.payload import HEADER_BYTES, ByteSource, Header, Reader
from mocapdb.compression.pose.blocks import Block, CodedClip, read_block, write_block
from mocapdb.compression.pose.class_basis import DIGEST_BYTES, Basis
from mocapdb.compression.pose.range_coder import (
    N_SYMBOLS,
    ModelArray,
    code_number,
    code_signed,
    finish_writer,
    new_models,
    new_reader,
    new_writer,
)
from mocapdb.compression.pose.smooth_channels import (
    ORDERS,
    channels_from_smooth,
    chunks_of,
    order_changes,
    three_angle_joints,
)
from mocapdb.errors import CodecError
from mocapdb.motion.skeleton import Skeleton

__all__ = ["MAX_BLOCK_FRAMES", "PoseReader", "pack"]

MAX_BLOCK_FRAMES = 4096
"""Frames of a block; it bounds the memory that damaged bytes can ask for."""

_LAYOUT_VERSION = 1
_OWN, _SHARED = 1, 2  # bases; 0 for none
_CHECK_BYTES = 4
_VARINT_BYTES = 5
_SETTING_BITS = 12


def pack(coded: CodedClip, skeleton: Skeleton, header: bytes) -> bytes:
    """Return the payload of a clip.

    Parameters
    ----------
    coded : CodedClip
    skeleton : Skeleton
        The clip's own.
    header : bytes
        What the payload begins with (see `payload.pack_header`).
    """
    profiles = np.array([block.profile for block in coded.blocks])
    head_profile = np.median(profiles, axis=0).astype(np.int64)
    blocks = [write_block(block, head_profile) for block in coded.blocks]
    index = b"".join(map(_varint, [coded.block_frames, *map(len, blocks)]))
    front = bytes([_LAYOUT_VERSION]) + _pack_basis(coded) + index
    front += _write_head(coded, skeleton, head_profile)
    front = header + _varint(len(front)) + front
    seed = zlib.crc32(front)
    checked = (block + zlib.crc32(block, seed).to_bytes(_CHECK_BYTES, "little") for block in blocks)
    return front + b"".join(checked)


class PoseReader:
    """Decodes any frames of a payload, reading only the blocks that have them.

    Parameters
    ----------
    header : Header
    data : ByteSource
        The whole payload.
    skeleton : Skeleton
        The clip's own.
    bases : mapping of bytes to bytes
        What clips may refer to: bases by their digests.

    Raises
    ------
    CodecError
        If the bytes make no sense, or refer to a basis that is not there.
    """

    def __init__(
        self,
        header: Header,
        data: ByteSource,
        skeleton: Skeleton,
        bases: Mapping[bytes, bytes],
    ) -> None:
        self._data = data
        self._skeleton = skeleton
        self._n_frames = header.n_frames
        start = Reader(memoryview(data[HEADER_BYTES : HEADER_BYTES + _VARINT_BYTES]))
        size = _read_varint(start)
        at = HEADER_BYTES + start.at
        self._first = at + size
        if self._first > len(data):
            raise CodecError(f"Expected {size} bytes in front of the blocks, but there are fewer.")
        front = memoryview(data[at : self._first])
        self._seed = zlib.crc32(front, zlib.crc32(data[:at]))
        reader = Reader(front)
        if int(reader.array(np.uint8, 1, "layout version")[0]) != _LAYOUT_VERSION:
            raise CodecError("Expected a known layout of blocks. Update mocapdb to read it.")
        self._basis = _read_basis(reader, skeleton, bases)
        self._block_frames = _read_varint(reader)
        if not 0 < self._block_frames <= MAX_BLOCK_FRAMES:
            raise CodecError(
                f"Expected blocks of 1 to {MAX_BLOCK_FRAMES} frames, but got {self._block_frames}."
            )
        n_blocks = -(-header.n_frames // self._block_frames)
        sizes = [_read_varint(reader) for _ in range(n_blocks)]
        self._block_ends = np.zeros(n_blocks + 1, dtype=np.int64)
        np.cumsum([size + _CHECK_BYTES for size in sizes], out=self._block_ends[1:])
        if self._first + int(self._block_ends[-1]) != len(data):
            raise CodecError(
                f"Expected {int(self._block_ends[-1])} bytes of blocks, but got "
                f"{len(data) - self._first}. The payload is damaged."
            )
        head = reader.array(np.uint8, len(front) - reader.at, "head").astype(np.uint8)
        orders, self._profile = _read_head(head, skeleton, self._basis)
        self._changes = order_changes(skeleton, orders)
        self._last: tuple[int, Block] | None = None

    def channels(self, frames: slice | None = None) -> FloatArray:
        """Return the channels (F, C) of all frames, or of some.

        Raises
        ------
        CodecError
            If bytes are damaged.
        """
        frames = frames or slice(None)
        n_frames = len(range(*frames.indices(self._n_frames)))
        channels = np.empty((n_frames, self._skeleton.n_channels))
        for i, own, here in chunks_of(frames, self._n_frames, self._block_frames):
            first = int(own.min())
            values = self._block(i).values(first, int(own.max()) + 1)[own - first]
            if self._basis is not None:
                values = self._basis.expand(values)
            channels[here] = channels_from_smooth(self._changes, values)
        return channels

    def _block(self, i: int) -> Block:
        """Return a block, once its checksum is right; the last one read is kept."""
        if self._last is not None and self._last[0] == i:
            return self._last[1]
        first, last = (
            self._first + int(self._block_ends[i]),
            self._first + int(self._block_ends[i + 1]),
        )
        content = bytes(self._data[first:last])
        block, check = content[:-_CHECK_BYTES], content[-_CHECK_BYTES:]
        if zlib.crc32(block, self._seed) != int.from_bytes(check, "little"):
            raise CodecError(
                f"Expected block {i} and what is in front of the blocks to have the checksum "
                f"{check[::-1].hex()}, but they have another. The payload is damaged: build it "
                "again or restore a copy."
            )
        n_frames = min(self._block_frames, self._n_frames - i * self._block_frames)
        found = read_block(np.frombuffer(block, dtype=np.uint8), self._profile, n_frames)
        self._last = (i, found)
        return found


# -- what is in front of the blocks ----------------------------------------------------------------


def _pack_basis(coded: CodedClip) -> bytes:
    if coded.basis is None:
        return bytes([0])
    if coded.basis_is_shared:
        return bytes([_SHARED]) + coded.basis.digest
    content = coded.basis.to_bytes()
    return bytes([_OWN]) + _varint(len(content)) + content


def _read_basis(reader: Reader, skeleton: Skeleton, bases: Mapping[bytes, bytes]) -> Basis | None:
    kind = int(reader.array(np.uint8, 1, "kind of basis")[0])
    if kind == 0:
        return None
    if kind == _OWN:
        content = reader.array(np.uint8, _read_varint(reader), "basis").tobytes()
        return Basis.from_bytes(content, skeleton)
    if kind != _SHARED:
        raise CodecError(f"Expected a kind of basis from 0 to {_SHARED}, but got {kind}.")
    digest = reader.array(np.uint8, DIGEST_BYTES, "digest of a basis").tobytes()
    if digest not in bases:
        raise CodecError(
            f"Expected the basis {digest.hex()} that the clip refers to, but it is not at hand. "
            "Decode the clip through the library that it was built into."
        )
    return Basis.from_bytes(bases[digest], skeleton)


def _write_head(coded: CodedClip, skeleton: Skeleton, profile: IntArray) -> bytes:
    """Return the orders of axes, unless a basis has them, and the profile, entropy-coded."""
    free_joints = three_angle_joints(skeleton) if coded.basis is None else []
    orders = [ORDERS.index(coded.skeleton.rotation_orders[joint]) for joint in free_joints]
    settings = np.array([*orders, *np.diff(profile, prepend=0)], dtype=np.int64)
    data = np.zeros(16 * len(settings) + 64, dtype=np.uint8)
    coder = new_writer()
    _code_head(coder, data, _HEAD_MODELS.copy(), settings, len(orders))
    return finish_writer(coder, data)


def _read_head(
    data: ByteArray, skeleton: Skeleton, basis: Basis | None
) -> tuple[list[str], IntArray]:
    """Return the orders of axes (J,) and the profile (C,)."""
    free_joints = three_angle_joints(skeleton)
    n_orders = len(free_joints) if basis is None else 0
    settings = np.zeros(n_orders + skeleton.n_channels, dtype=np.int64)
    _code_head(new_reader(data), data, _HEAD_MODELS.copy(), settings, n_orders)
    indices = settings[:n_orders]
    if len(indices) and indices.max() >= len(ORDERS):
        raise CodecError(f"Expected one of {len(ORDERS)} orders of axes, but got {indices.max()}.")
    found = [ORDERS[index] for index in indices] if basis is None else basis.orders
    orders = list(skeleton.rotation_orders)
    for joint, order in zip(free_joints, found, strict=True):
        orders[joint] = order
    return orders, np.cumsum(settings[n_orders:])


_HEAD_MODELS = new_models(np.full((4, N_SYMBOLS), 1.0 / N_SYMBOLS))


@jit
def _code_head(
    coder: IntArray, data: ByteArray, models: ModelArray, settings: IntArray, n_orders: int
) -> None:
    """Write or read the orders of axes, and the differences of the profile."""
    for i in range(n_orders):
        settings[i] = code_number(coder, data, models, 0, settings[i], _SETTING_BITS)
    for i in range(n_orders, len(settings)):
        settings[i] = code_signed(coder, data, models, 2, settings[i], _SETTING_BITS)


def _varint(number: int) -> bytes:
    """Return a number in groups of seven bits, the lowest first."""
    groups = bytearray()
    while number > 0x7F:
        groups.append(0x80 | (number & 0x7F))
        number >>= 7
    groups.append(number)
    return bytes(groups)


def _read_varint(reader: Reader) -> int:
    number = 0
    for shift in range(0, 7 * _VARINT_BYTES, 7):
        group = int(reader.array(np.uint8, 1, "sizes")[0])
        number |= (group & 0x7F) << shift
        if group < 0x80:
            return number
    raise CodecError(f"Expected a size of at most {_VARINT_BYTES} bytes, but got more.")
