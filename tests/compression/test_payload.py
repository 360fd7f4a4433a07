import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.compression import Target, decode, encode
from mocapdb.compression.payload import Reader, pack_sparse, read_sparse, seal
from mocapdb.corpus import synthetic
from mocapdb.errors import CodecError
from mocapdb.motion.skeleton import Skeleton

WALK = synthetic.make_clip("walk", seed=1)[:60]
PAYLOADS = [
    encode(WALK, Target("mean_mm", 20.0), representation=name, transform=transform).data
    for name, transform in [("channels", "dct"), ("aligned", "dwt")]
] + [encode(WALK, Target("mean_mm", 20.0), codec="raw").data]


def resealed(data):
    """The bytes with a checksum that fits: damage that only the decoder can notice."""
    return data[:-4] + struct.pack("<I", zlib.crc32(data[:-4]))


def forged(body, codec_id=1, n_frames=60):
    return seal(codec_id, WALK.skeleton, n_frames, body)


# -- damage ----------------------------------------------------------------------------------------


@given(data=st.data(), payload=st.sampled_from(PAYLOADS))
def test_a_flipped_bit_is_noticed(data, payload):
    at = data.draw(st.integers(0, len(payload) - 1))
    bit = data.draw(st.integers(0, 7))
    damaged = bytearray(payload)
    damaged[at] ^= 1 << bit
    with pytest.raises(CodecError):
        decode(bytes(damaged), WALK.skeleton)


@given(data=st.data(), payload=st.sampled_from(PAYLOADS))
def test_a_cut_is_noticed(data, payload):
    with pytest.raises(CodecError):
        decode(payload[: data.draw(st.integers(0, len(payload) - 1))], WALK.skeleton)


@given(extra=st.binary(min_size=1, max_size=40), payload=st.sampled_from(PAYLOADS))
def test_extra_bytes_are_noticed(extra, payload):
    with pytest.raises(CodecError):
        decode(payload + extra, WALK.skeleton)
    with pytest.raises(CodecError):
        decode(resealed(payload + extra), WALK.skeleton)


@given(data=st.data(), payload=st.sampled_from(PAYLOADS))
def test_damage_under_a_fitting_checksum_is_refused_or_decodes_to_finite_channels(data, payload):
    damaged = bytearray(payload)
    for _ in range(data.draw(st.integers(1, 4))):
        # anywhere but the number of frames, whose every value within the limit is lawful
        at = data.draw(st.integers(12, len(payload) - 5) | st.integers(20, 60))
        damaged[at] = data.draw(st.integers(0, 255))
    if data.draw(st.booleans()):
        damaged = damaged[: data.draw(st.integers(24, len(damaged)))]
    try:
        channels = decode(resealed(bytes(damaged)), WALK.skeleton)
    except CodecError:
        return
    assert channels.shape == WALK.channels.shape
    assert np.isfinite(channels).all()


@given(noise=st.binary(max_size=300))
def test_noise_is_no_payload(noise):
    with pytest.raises(CodecError, match="Expected a clip payload starting with"):
        decode(noise, WALK.skeleton)


# -- lies ------------------------------------------------------------------------------------------


def layout(representation=0, transform=0, root_form=0, reserved=0, n_components=0xFFFFFFFF):
    return struct.pack("<BBBBI", representation, transform, root_form, reserved, n_components)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (b"", "bytes of layout"),
        (layout(representation=5), "Expected a known representation"),
        (layout(transform=3), "Expected a known representation"),
        (layout(transform=2), "bytes of length of a wavelet's name"),
        (layout(root_form=2), "Expected a known representation"),
        (layout(reserved=2), "Expected a known representation"),
        (layout(reserved=1), "bytes of digest of a basis"),
        (layout(n_components=57), "at most 56 principal components, but got 57"),
        (layout(n_components=0xFFFFFFFE), "at most 56 principal components"),
        (layout(n_components=5), "bytes of mean pose"),
        (layout(root_form=1), "bytes of root track"),
        (layout() + struct.pack("<6H", *[61] * 6), "at most 60 coefficients in a column"),
        (layout() + struct.pack("<6H", *[60] * 6), "bytes of coefficient indices"),
        (layout() + struct.pack("<7H", 1, 0, 0, 0, 0, 0, 60) + bytes(4), "indices below 60"),
        (
            layout() + struct.pack("<7Hf", 1, 0, 0, 0, 0, 0, 5, float("nan")),
            "finite coefficients",
        ),
    ],
)
def test_numbers_that_do_not_fit_are_refused(body, said):
    with pytest.raises(CodecError, match=said):
        decode(forged(body), WALK.skeleton)


@pytest.mark.parametrize("codec_id", [0, 1])
def test_a_clip_without_frames_is_refused(codec_id):
    with pytest.raises(CodecError, match="to have frames"):
        decode(forged(b"", codec_id, n_frames=0), WALK.skeleton)


@pytest.mark.parametrize("codec_id", [0, 1])
def test_four_thousand_million_frames_are_refused_before_anything_is_allocated(codec_id):
    with pytest.raises(CodecError, match="at most 134217728 values"):
        decode(forged(layout(), codec_id, n_frames=0xFFFFFFFF), WALK.skeleton)


def test_unknown_codecs_and_newer_versions_are_named():
    with pytest.raises(CodecError, match=r"pose, okane, raw, but got number 7\. Update mocapdb"):
        decode(forged(b"", codec_id=7), WALK.skeleton)
    newer = bytearray(PAYLOADS[0])
    newer[4] = 3
    with pytest.raises(CodecError, match=r"version 2 or older, but got version 3\. Update"):
        decode(resealed(bytes(newer)), WALK.skeleton)


def test_another_skeleton_is_refused_and_another_name_is_not():
    other = synthetic.make_skeleton(1.95)
    with pytest.raises(CodecError, match="Expected the skeleton with digest"):
        decode(PAYLOADS[0], other)
    renamed = WALK.skeleton.renamed("someone else")
    np.testing.assert_array_equal(decode(PAYLOADS[0], renamed), decode(PAYLOADS[0], WALK.skeleton))


def test_raw_channels_that_are_not_finite_are_refused():
    tiny = Skeleton(["root"], [-1], [[0, 0, 0]], [["tx"]], [""], convention="bvh")
    data = seal(0, tiny, 1, struct.pack("<d", float("inf")))
    with pytest.raises(CodecError, match="finite channels"):
        decode(data, tiny)


# -- sparse matrices -------------------------------------------------------------------------------


@given(st.integers(1, 20), st.integers(0, 6), st.floats(0, 1), st.integers(0, 2**32 - 1))
def test_sparse_matrices_come_back(length, n_columns, density, seed):
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(length, n_columns)).astype(np.float32).astype(np.float64)
    matrix[rng.random(matrix.shape) > density] = 0.0
    data = pack_sparse(matrix)
    assert len(data) == 2 * n_columns + 6 * np.count_nonzero(matrix)
    reader = Reader(memoryview(data))
    np.testing.assert_array_equal(read_sparse(reader, length, n_columns), matrix)
    reader.finish()


def test_long_columns_have_wider_indices():
    matrix = np.zeros((65536, 1))
    matrix[65535] = 1.5
    data = pack_sparse(matrix)
    assert data == struct.pack("<IIf", 1, 65535, 1.5)
    np.testing.assert_array_equal(read_sparse(Reader(memoryview(data)), 65536, 1), matrix)
