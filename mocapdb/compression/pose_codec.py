"""The production codec: splines in the metric of the skin (docs/format-motion-codec.md).

1. The channels become a smooth state (`state`), and the frames are cut into blocks (`blocks`).
2. The metric of the error points says for every frame what a miss of each channel costs
   (`sensitivity`).
3. Channel by channel, last joint first, each is fitted by a cubic B-spline with knots as far apart
   as pays, or by another of the `modes`, and brought to integers that make up for what the channels
   before it missed (`lattice`).
4. The integers are predicted and entropy-coded (`track`, `rangecoder`).

One number, the *step*, sets the error of everything, and is searched for until the goal is just
held. The decoder needs none of the metric: it is told the size of every channel's step.
"""

from __future__ import annotations

import numpy as np

from mocapdb._typing import ByteArray, FloatArray, IntArray
from mocapdb.compression.blocks import CodedClip, read_block, unzigzag, write_block, zigzag
from mocapdb.compression.goal import Goal, measure
from mocapdb.compression.holding import Holding
from mocapdb.compression.modes import TRANSFORM_MODES, PoseTransform
from mocapdb.compression.payload import Header, Reader, check_size
from mocapdb.compression.rangecoder import (
    N_SYMBOLS,
    ModelArray,
    code_number,
    finish_writer,
    new_models,
    new_reader,
    new_writer,
)
from mocapdb.compression.state import ORDERS, channels_of, turning_joints
from mocapdb.errors import CodecError
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skeleton import Skeleton

__all__ = ["POSE_CODEC", "CodedClip", "compress", "decode_body", "encode_at", "encode_body"]

POSE_CODEC = 2
"""The codec's number in a payload's header."""

BLOCK_VALUES = 6_000
"""About how many integers a block has: half a millisecond to decode."""

MAX_BLOCK_FRAMES = 4096
"""Frames of a block; it bounds the memory that damaged bytes can ask for."""

_LAYOUT_VERSION = 1
_SETTING_BITS = 12


def compress(
    clip: Clip,
    goal: Goal,
    *,
    transform: PoseTransform = "auto",
    block_values: int = BLOCK_VALUES,
) -> CodedClip | None:
    """Return the shortest integers found that hold a goal, or None where none do.

    Parameters
    ----------
    clip : Clip
    goal : Goal
        Held by what `decode_body` gives, on every frame.
    transform : {"auto", "spline", "dct32", "dct64", "dct", "dwt"}
        Over time.
    block_values : int
        About how many integers a block has: decoding one frame decodes its block.

    Raises
    ------
    CodecError
        If there is no such transform.
    """
    coded = Holding(clip, goal, _modes(transform, goal), block_values).hold()
    return coded if coded is not None and _holds(coded, clip, goal) else None


def encode_at(clip: Clip, goal: Goal, gain: int, *, transform: PoseTransform = "auto") -> CodedClip:
    """Return the integers for a step of ``2 ** (gain / 64)`` skeleton units, whatever is lost."""
    return Holding(clip, goal, _modes(transform, goal), BLOCK_VALUES).encode_at(gain)


def _holds(coded: CodedClip, clip: Clip, goal: Goal) -> bool:
    """Say whether what the bytes themselves decode to is within a goal."""
    skeleton = clip.skeleton
    header = Header(POSE_CODEC, skeleton.n_channels, len(clip))
    reader = Reader(memoryview(encode_body(coded, skeleton)))
    pose = forward_kinematics(skeleton, clip.channels)
    decoded = forward_kinematics(skeleton, decode_body(header, reader, skeleton))
    return goal.of(measure(skeleton, goal.points, pose, decoded)) <= goal.value


def _modes(transform: PoseTransform, goal: Goal) -> tuple[int, ...]:
    if transform not in TRANSFORM_MODES:
        raise CodecError(
            f"Expected a transform out of {', '.join(TRANSFORM_MODES)}, but got {transform!r}."
        )
    if transform == "auto" and goal.is_maximum:  # a transform cannot be finer at some frames
        return TRANSFORM_MODES["spline"]
    return TRANSFORM_MODES[transform]


# -- bytes -----------------------------------------------------------------------------------------


def encode_body(coded: CodedClip, skeleton: Skeleton) -> bytes:
    """Return the body of a payload.

    Parameters
    ----------
    coded : CodedClip
    skeleton : Skeleton
        The clip's own.
    """
    profiles = np.array([block.profile for block in coded.blocks])
    head_profile = np.median(profiles, axis=0).astype(np.int64)
    head = _write_head(coded, skeleton, head_profile)
    blocks = [write_block(block, head_profile) for block in coded.blocks]
    sizes = [len(head), coded.block_frames, *(len(block) for block in blocks)]
    return b"".join([bytes([_LAYOUT_VERSION]), *map(_varint, sizes), head, *blocks])


def decode_body(
    header: Header, reader: Reader, skeleton: Skeleton, frames: slice | None = None
) -> FloatArray:
    """Return the channels of a payload's body, of all frames or of some.

    Only the blocks that have some of the frames are decoded.

    Raises
    ------
    CodecError
        If the bytes make no sense.
    """
    check_size(header.n_frames, header.n_channels)
    if int(reader.array(np.uint8, 1, "layout version")[0]) != _LAYOUT_VERSION:
        raise CodecError("Expected a known layout of blocks. Update mocapdb to read it.")
    head_size, block_frames = _read_varint(reader), _read_varint(reader)
    if not 0 < block_frames <= MAX_BLOCK_FRAMES:
        raise CodecError(
            f"Expected blocks of 1 to {MAX_BLOCK_FRAMES} frames, but got {block_frames}."
        )
    n_blocks = -(-header.n_frames // block_frames)
    ends = np.cumsum([_read_varint(reader) for _ in range(n_blocks)], dtype=np.int64)
    head = reader.array(np.uint8, head_size, "head").astype(np.uint8)
    content = reader.array(np.uint8, int(ends[-1]), "blocks").astype(np.uint8)
    reader.finish()
    orders, profile = _read_head(head, skeleton)

    rows = np.arange(header.n_frames)[slice(None) if frames is None else frames]
    channels = np.empty((len(rows), header.n_channels))
    starts = [0, *ends]
    for i in np.unique(rows // block_frames):
        first = int(i) * block_frames
        n_frames = min(block_frames, header.n_frames - first)
        values = read_block(content[starts[i] : starts[i + 1]], profile, n_frames).values()
        here = rows // block_frames == i
        channels[here] = channels_of(skeleton, orders, values[rows[here] - first])
    return channels


def _write_head(coded: CodedClip, skeleton: Skeleton, profile: IntArray) -> bytes:
    """Return the orders of axes and the profile, entropy-coded."""
    turning = turning_joints(skeleton)
    settings = [_order_index(coded.skeleton, joint) for joint in turning]
    settings += [zigzag(int(change)) for change in np.diff(profile, prepend=0)]
    data = np.zeros(16 * len(settings) + 64, dtype=np.uint8)
    coder, models = new_writer(), _head_models()
    for i, setting in enumerate(settings):
        context = 0 if i < len(turning) else 2
        code_number(coder, data, models, context, setting, _SETTING_BITS)
    return finish_writer(coder, data)


def _read_head(data: ByteArray, skeleton: Skeleton) -> tuple[list[str], IntArray]:
    """Return the orders of axes (J,) and the profile (C,)."""
    copy = data.copy()
    coder, models = new_reader(copy), _head_models()
    orders = list(skeleton.rotation_orders)
    for joint in turning_joints(skeleton):
        index = code_number(coder, copy, models, 0, 0, _SETTING_BITS)
        if index >= len(ORDERS):
            raise CodecError(f"Expected one of {len(ORDERS)} orders of axes, but got {index}.")
        orders[joint] = ORDERS[index]
    changes = [
        unzigzag(code_number(coder, copy, models, 2, 0, _SETTING_BITS))
        for _ in range(skeleton.n_channels)
    ]
    return orders, np.cumsum(np.array(changes, dtype=np.int64))


def _head_models() -> ModelArray:
    return new_models(np.full((4, N_SYMBOLS), 1.0 / N_SYMBOLS))


def _order_index(skeleton: Skeleton, joint: int) -> int:
    return ORDERS.index(skeleton.rotation_orders[joint])


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
    for shift in range(0, 35, 7):
        group = int(reader.array(np.uint8, 1, "sizes")[0])
        number |= (group & 0x7F) << shift
        if group < 0x80:
            return number
    raise CodecError("Expected a size of at most five bytes, but got more.")
