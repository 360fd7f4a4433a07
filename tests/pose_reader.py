"""A reader of pose payloads by what docs/format.md says of codec 2, and nothing else."""

from __future__ import annotations

import hashlib
import json
import math
import struct
import zlib
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import pywt
import scipy.fft

ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
SPACINGS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
G0 = (47919, 63892, 55907, 27520, 64420, 61824, 64975, 58475)
G1 = (30391, 92840, 48087, 5933, 96793, 58973, 59405, 58998)
G2 = (0, 0, 0, 0, 76503, 0, 0, 30422)
G3 = (65536, 65536, 60948, 39322, 65536, 39322, 22938, 65536)
USUAL = (3600, 2560, 1060, 990)
NEXT_STATE = ((0, 2), (2, 0), (1, 3), (3, 1))
HELD = 1 << 26


class Pose(NamedTuple):
    """A clip, and what of the format it took to say it."""

    channels: np.ndarray  # (F, C)
    modes: np.ndarray  # (blocks, C)
    n_spikes: int
    n_reordered: int  # joints whose angles had another order of axes


def read_pose(payload: bytes, skeleton: dict, bases: Mapping[bytes, bytes] | None = None) -> Pose:
    """Read a pose payload; `skeleton` is what a catalogue holds of it."""
    magic, version, codec, n_channels, n_frames = struct.unpack_from("<4sBBHI", payload)
    assert (magic, version, codec) == (b"MCDP", 2, 2)
    fields = {key: value for key, value in skeleton.items() if key != "name"}
    digest = hashlib.sha256(json.dumps(fields, sort_keys=True).encode()).digest()
    assert payload[12:20] == digest[:8]
    size, at = varint(payload, 20)
    end = at + size
    layout, kind = payload[at : at + 2]
    assert layout == 1
    at += 2
    basis = None
    if kind == 1:
        size, at = varint(payload, at)
        basis = payload[at : at + size]
        at += size
    elif kind == 2:
        basis = bases[payload[at : at + 8]]
        assert hashlib.sha256(basis).digest()[:8] == payload[at : at + 8]
        at += 8
    block_frames, at = varint(payload, at)
    assert 0 < block_frames <= 4096
    sizes = []
    for _ in range(-(-n_frames // block_frames)):
        size, at = varint(payload, at)
        sizes.append(size)

    head = Decoder(payload[at:end])
    coded = []
    at = end
    for size in sizes:
        block = payload[at : at + size]
        at += size + 4
        assert payload[at - 4 : at] == checksum(payload[:end] + block), "another checksum"
        coded.append(block)
    assert at == len(payload)

    dofs = [joint.split() for joint in skeleton["dofs"]]
    turning = [j for j, names in enumerate(dofs) if sum(name[0] == "r" for name in names) == 3]
    if basis is None:
        mixing = None
        model = even()
        orders = [head.number(model) for _ in turning]
    else:
        orders, mixing = unpack_basis(basis, len(turning), n_channels - len(dofs[0]))
    model = even()
    profile = np.cumsum([head.signed(model) for _ in range(n_channels)])
    blocks = [
        read_block(Decoder(block), profile, min(block_frames, n_frames - i * block_frames))
        for i, block in enumerate(coded)
    ]
    values, modes, spikes = zip(*blocks, strict=True)
    channels = np.concatenate(values)
    if mixing is not None:
        channels[:, len(dofs[0]) :] = channels[:, len(dofs[0]) :] @ mixing.T
    first = np.cumsum([0] + [len(names) for names in dofs])
    n_reordered = 0
    for joint, order in zip(turning, (ORDERS[o] for o in orders), strict=True):
        own = skeleton["rotation_orders"][joint]
        if own != order:
            place = {
                name[1].upper(): first[joint] + k
                for k, name in enumerate(dofs[joint])
                if name[0] == "r"
            }
            angles = channels[:, [place[axis] for axis in order]]
            channels[:, [place[axis] for axis in own]] = change_order(angles, order, own)
            n_reordered += 1
    return Pose(channels, np.array(modes), sum(spikes), n_reordered)


def checksum(data: bytes) -> bytes:
    return zlib.crc32(data).to_bytes(4, "little")


def varint(data: bytes, at: int) -> tuple[int, int]:
    """Return a varint and the place behind it."""
    value = 0
    for place in range(5):
        value |= (data[at + place] & 127) << 7 * place
        if data[at + place] < 128:
            return value, at + place + 1
    raise AssertionError("more than 5 bytes")


def unpack_basis(basis: bytes, n_turning: int, n_body: int) -> tuple[list[int], np.ndarray]:
    """Return the orders of axes, and the matrix (D, D) that takes z to x."""
    raw = zlib.decompress(basis)
    assert len(raw) == n_turning + n_body + n_body**2
    numbers = np.frombuffer(raw, np.int8, offset=n_turning).astype(float)
    scales = 2 ** (numbers[:n_body] / 3)
    return list(raw[:n_turning]), scales[:, None] * numbers[n_body:].reshape(n_body, -1) / 64


# -- range coder -----------------------------------------------------------------------------------


class Model:
    """A model of symbols 0 to 15."""

    def __init__(self, likely: list[float]) -> None:
        self.halves = [start(likely), start(likely)]
        self.next: Model | None = None

    def adapt(self, symbol: int) -> None:
        for entries, rate in zip(self.halves, (4, 6), strict=True):
            for i in range(1, 16):
                entries[i] += ((32752 + i if i > symbol else i) - entries[i]) >> rate


def start(likely: list[float]) -> list[int]:
    """Return the entries 0 to 16 of a model, from how likely the symbols (0 to 14 at least) are."""
    entries, total = [0], 0.0
    for i in range(1, 16):
        total += likely[i - 1]
        entries.append(math.floor(32752 * total) + i)
    return [*entries, 32768]


def even() -> Model:
    return number_model([1 / 16] * 16)


def number_model(likely: list[float]) -> Model:
    """Return a model of lengths, with the next one for lengths of 15 and more."""
    model = Model(likely)
    model.next = Model([1 / 16] * 16)
    return model


class Decoder:
    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 4
        self.low = int.from_bytes(data[:4].ljust(4, b"\0"), "big")
        self.width = 2**32 - 1

    def narrow(self, n: int, find: Callable[[int], tuple[int, int, int]]) -> int:
        part = self.width >> n
        symbol, below, parts = find(min(self.low // part, (1 << n) - 1))
        self.low -= part * below
        self.width = part * parts
        assert self.low < self.width
        while self.width < 1 << 24:
            byte = self.data[self.at] if self.at < len(self.data) else 0
            self.at += 1
            self.low = self.low << 8 | byte
            self.width <<= 8
        return symbol

    def symbol(self, model: Model) -> int:
        sums = [(a + b) >> 1 for a, b in zip(*model.halves, strict=True)]

        def find(value: int) -> tuple[int, int, int]:
            s = max(i for i in range(16) if sums[i] <= value)
            return s, sums[s], sums[s + 1] - sums[s]

        symbol = self.narrow(15, find)
        model.adapt(symbol)
        return symbol

    def bits(self, count: int) -> int:
        value = 0
        while count:
            n = min(count, 12)
            value = value << n | self.narrow(n, lambda v: (v, v, 1))
            count -= n
        return value

    def number(self, model: Model) -> int:
        length = self.symbol(model)
        if length == 15:
            length += self.symbol(model.next)
        return 1 << (length - 1) | self.bits(length - 1) if length else 0

    def signed(self, model: Model) -> int:
        folded = self.number(model)
        return -(folded + 1 >> 1) if folded & 1 else folded >> 1


# -- a block ---------------------------------------------------------------------------------------


class Shared:
    """What the tracks of a block share."""

    def __init__(self, n_frames: int) -> None:
        self.first = number_model([0.1125] * 8 + [0.0125] * 8)
        self.rest = number_model([0.4 / 2**s + 0.0125 for s in range(16)])
        self.indices = [index_models(), index_models()]
        self.usual = list(USUAL)
        self.activity = [2048] * (n_frames // 2 + 2)


def index_models() -> list[Model]:
    """Return the 32 models of indices; where sums come to 1 is a matter of how doubles round."""
    models = []
    root = np.sqrt(np.sqrt(2.0))
    mean = 1.0
    for _ in range(12):
        mean *= root
    mean /= 256
    for i in range(32):
        t = (np.sqrt(1 + mean * mean) - 1) / mean
        merged = 2 if i >= 28 else 1
        likely = [(1 - t) / (1 + t)]
        likely.append(2 * likely[0] * t)
        while len(likely) < 15 * merged:
            likely.append(likely[-1] * t)
        symbols = [sum(likely[s : s + merged]) for s in range(0, 15 * merged, merged)]
        models.append(Model(symbols))
        mean *= root
    return models


def read_block(
    coder: Decoder, profile: np.ndarray, n_frames: int
) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the values (F, C) of a block, its modes (C,), and how many spikes it has."""
    n_channels = len(profile)
    qp = coder.bits(14) - 8192
    by_mode = [Model(near(i)) for i in range(15)]
    modes = np.zeros(n_channels, int)
    mode = 5
    for c in reversed(range(n_channels)):
        modes[c] = mode = coder.symbol(by_mode[mode])
    assert modes.max() <= 14
    often_0 = [64 / 79] + [1 / 79] * 15
    model = number_model(often_0)
    profile = profile.copy()
    for c in reversed(range(n_channels)):
        profile[c] += coder.signed(model)
    assert np.abs(profile).max() <= 500
    length, count, gap, amount = even(), number_model(often_0), even(), even()
    shared = Shared(n_frames)
    n_spikes = 0
    block = np.zeros((n_frames, n_channels))
    for c in reversed(range(n_channels)):
        mode = modes[c]
        step = 2.0 ** (profile[c] / 3 + qp / 64)
        bands, whole = layout(mode, n_frames)
        track = np.zeros(len(bands))
        n_values = coder.number(length) if mode >= 11 else len(bands)
        spacing = SPACINGS[mode] if mode < 10 else 0
        track[:n_values] = read_track(coder, shared, bands[:n_values], spacing)
        block[:, c] = whole(track) * step * 2.0 ** shift(mode)
        if mode:
            frame = -1
            n = coder.number(count)
            n_spikes += n
            for _ in range(n):
                frame += 1 + coder.number(gap)
                block[frame, c] += coder.signed(amount) * step
    return block, modes, n_spikes


def near(i: int) -> list[float]:
    weights = [2.0 ** -abs(i - j) for j in range(16)]
    return [weight / sum(weights) for weight in weights]


def shift(mode: int) -> float:
    if mode == 10:
        return -2.0
    return -np.log2(0.3304 * SPACINGS[mode]) / 2 if 0 < mode < 10 else 0.0


def layout(mode: int, n_frames: int) -> tuple[list[int], Callable[[np.ndarray], np.ndarray]]:
    """Return the band of each value of a track, and what takes a track to frames."""
    if mode == 0:
        return [0] * n_frames, lambda track: track
    if mode < 10:
        spacing = SPACINGS[mode]
        n = -(-(n_frames - 1) // spacing) + 3
        x = np.arange(n_frames)[:, None] / spacing - (np.arange(n) - 1)
        x = np.abs(x)
        weights = np.where(x < 1, 2 / 3 - x**2 + x**3 / 2, np.clip(2 - x, 0, None) ** 3 / 6)
        return [0] * n, lambda track: weights @ track
    if mode == 10:
        return [0], lambda track: np.full(n_frames, track[0])
    if mode == 14:
        levels = pywt.dwt_max_level(n_frames, "bior4.4")
        parts = pywt.wavedec(np.zeros(n_frames), "bior4.4", "periodization", levels)
        ends = np.cumsum([len(part) for part in parts])
        bands = [band for band, part in enumerate(parts) for _ in part]

        def inverse(track: np.ndarray) -> np.ndarray:
            parts = np.split(track, ends[:-1])
            return pywt.waverec(parts, "bior4.4", "periodization")[:n_frames]

        return bands, inverse
    window = {11: 32, 12: 64, 13: n_frames}[mode]
    starts = range(0, n_frames, window)
    sizes = [min(window, n_frames - first) for first in starts]
    bands = [
        min(1 + math.floor(2 * math.log2(f) + 0.05), 15) if f else 0
        for size in sizes
        for f in range(size)
    ]

    def frames(track: np.ndarray) -> np.ndarray:
        pieces = np.split(track, starts[1:])
        return np.concatenate([scipy.fft.idct(piece, norm="ortho") for piece in pieces])

    return bands, frames


def read_track(coder: Decoder, shared: Shared, bands: list[int], spacing: int) -> list[int]:
    """Return the integers of a track; `spacing` is 0 for what is no spline."""
    if not bands:
        return []
    value = coder.number(shared.first)
    if value and coder.bits(1):
        value = -value
    values = [hold(value)]
    expect = Filters(values[0])
    fast, slow = 0, [0] * 16
    state = 0
    for n, band in enumerate(bands[1:]):
        usual = n < 4 and band == 0
        if usual:
            fast = slow[0] = shared.usual[n]
        elif slow[band] == 0:
            slow[band] = fast if n else shared.usual[0]
        expected = ((fast + slow[band]) >> 1) + 8
        level = e = quarters(expected)
        place = min((n + 1) * spacing // 2, len(shared.activity) - 1)
        if spacing:
            level = min(max(e + ((quarters(shared.activity[place]) - 44) >> 1), 0), 127)
        q = read_index(coder, shared, level, state)
        if spacing:
            adding = min((abs(q) * int(2**24 / 2 ** (e / 4))) >> 8, 1024)
            shared.activity[place] += adding - (shared.activity[place] >> 3)
        size = abs(q) << 8
        if usual:
            shared.usual[n] += (size - shared.usual[n]) >> 2
        fast += 5 * (size - fast) >> 4
        slow[band] += (size - slow[band]) * (65536 // (min(n + 1, 22) + 2)) >> 16
        value = 2 * q
        if state >= 2:
            value -= (q > 0) - (q < 0)
        state = NEXT_STATE[state][q & 1]
        if band == 0:
            value = hold(value + expect())
            expect.update(value)
        values.append(hold(value))
    return values


def hold(value: int) -> int:
    return min(max(value, -HELD), HELD)


def quarters(size: int) -> int:
    if size == 0:
        return 0
    more = 0
    while size >= 4096:
        size >>= 8
        more += 32
    return min((size**4).bit_length() - 1 + more, 127)


def read_index(coder: Decoder, shared: Shared, level: int, state: int) -> int:
    models = shared.indices[state >> 1]
    if level < 40:
        plain, model = 0, models[max(level - 12, 0)]
    else:
        plain, model = (level - 36) >> 2, models[28 + level % 4]
    high = coder.symbol(model)
    if high == 15:
        high += coder.number(shared.rest)
    size = high << plain | coder.bits(plain)
    return -size if size and coder.bits(1) else size


class Filters:
    """Eight filters that expect the next value; all numbers are times 65536."""

    def __init__(self, value: int) -> None:
        self.level = [value << 16] * 8
        self.trend = [0] * 8
        self.bend = [0] * 8
        self.score = [0] * 8
        self.find()

    def find(self) -> None:
        self.e = [
            level + trend + (bend >> 1)
            for level, trend, bend in zip(self.level, self.trend, self.bend, strict=True)
        ]

    def __call__(self) -> int:
        a, b = sorted(range(8), key=lambda i: self.score[i])[:2]
        return (self.e[a] + self.e[b] + 65536) >> 17

    def update(self, value: int) -> None:
        for i in range(8):
            d = (value << 16) - self.e[i]
            self.score[i] += (abs(d) >> 8) - (self.score[i] >> 5)
            self.level[i] = self.e[i] + (G0[i] * d >> 16)
            self.trend[i] = (G3[i] * (self.trend[i] + self.bend[i]) + G1[i] * d) >> 16
            self.bend[i] += G2[i] * d >> 16
        self.find()


# -- orders of axes --------------------------------------------------------------------------------


def change_order(angles_deg: np.ndarray, order: str, wanted: str) -> np.ndarray:
    """Return the angles (F, 3) of the same rotations in another order of axes."""
    rotation = np.eye(3)
    for axis, angle in zip(order, np.deg2rad(angles_deg).T, strict=True):
        rotation = rotation @ turn(axis, angle)
    i, j, k = ("XYZ".index(axis) for axis in wanted)
    sign = 1 if (j - i) % 3 == 1 else -1
    outer = np.arctan2(-sign * rotation[:, j, k], rotation[:, k, k])
    middle = np.arctan2(sign * rotation[:, i, k], np.hypot(rotation[:, i, i], rotation[:, i, j]))
    left = turn(wanted[0], -outer) @ rotation
    inner = np.arctan2(sign * left[:, j, i], left[:, j, j])
    return np.rad2deg(np.stack([outer, middle, inner], axis=1))


def turn(axis: str, angle: np.ndarray) -> np.ndarray:
    """Return the rotations (F, 3, 3) about an axis."""
    i = "XYZ".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    matrix = np.zeros((len(angle), 3, 3))
    matrix[:, i, i] = 1
    matrix[:, j, j] = matrix[:, k, k] = np.cos(angle)
    matrix[:, k, j] = np.sin(angle)
    matrix[:, j, k] = -matrix[:, k, j]
    return matrix
