"""The least error within a number of bytes."""

import math

import pytest

from mocapdb.compression import ByteBudget, Target, encode
from mocapdb.compression.byte_search import least_error_within
from mocapdb.compression.okane.okane_search import OkaneOptions, OkaneSearch
from mocapdb.compression.payload import HEADER_BYTES, Payload
from mocapdb.corpus import synthetic
from mocapdb.errors import CodecError
from mocapdb.motion.joint_errors import joint_errors
from mocapdb.motion.skin import MotionError, PointError

WALK = synthetic.make_clip("walk", seed=1)[:150]
JOINTS = joint_errors(WALK.skeleton, WALK.channels, WALK.channels)


def codec(bytes_at, tried=None):
    """A codec whose payloads are as large as a function of the mean distance says."""

    def encode_to(mean_mm):
        if tried is not None:
            tried.append(mean_mm)
        error = MotionError(mean_mm, PointError(mean_mm, mean_mm, mean_mm))
        return Payload(bytes(int(bytes_at(mean_mm))), error, JOINTS, "made up", 0)

    return encode_to


@pytest.mark.parametrize("power", [0.3, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("bytes_per_frame", [2, 9, 300])
def test_nearly_all_of_the_bytes_are_used(power, bytes_per_frame):
    tried = []
    encode_to = codec(lambda mm: 1000 * mm**-power + 40, tried)
    payload = least_error_within(ByteBudget(bytes_per_frame), 100, encode_to)
    assert 0.97 * bytes_per_frame * 100 <= len(payload.data) <= bytes_per_frame * 100
    assert len(tried) <= 14


def test_a_step_in_the_bytes_is_not_overrun():
    payload = least_error_within(ByteBudget(5), 100, codec(lambda mm: 900 if mm < 0.37 else 300))
    assert len(payload.data) == 300
    assert payload.error.vertices.mean == pytest.approx(0.37, rel=0.01)


def test_what_loses_nothing_is_taken_at_once():
    tried = []

    def lossless(mean_mm):
        tried.append(mean_mm)
        error = MotionError(0.0, PointError(0.0, 0.0, 0.0))
        return Payload(bytes(300), error, JOINTS, "raw", 300)

    assert least_error_within(ByteBudget(5), 100, lossless).codec == "raw"
    assert len(tried) == 1


def test_fewer_bytes_than_a_header_are_refused():
    with pytest.raises(CodecError, match=r"at least 3 bytes a frame .* makes 300 bytes"):
        least_error_within(ByteBudget(HEADER_BYTES / 200), 100, codec(lambda mm: 300))


def test_fewer_bytes_than_the_coarsest_step_are_refused():
    with pytest.raises(CodecError, match=r"at least 3 bytes a frame .* makes 300 bytes"):
        least_error_within(ByteBudget(2), 100, codec(lambda mm: max(300, 500 / mm)))


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_number_of_bytes_is_positive(value):
    with pytest.raises(CodecError, match="positive number of bytes"):
        ByteBudget(value)


@pytest.mark.parametrize("options", [{}, {"codec": "okane", "transform": "dct"}], ids=str)
def test_more_bytes_give_less_error(options):
    clip = synthetic.make_clip("walk", seed=1)[:150]
    payloads = [encode(clip, ByteBudget(size), **options) for size in (12, 25, 60)]
    for size, payload in zip((12, 25, 60), payloads, strict=True):
        assert len(payload.data) <= size * len(clip)
    errors = [payload.error.vertices.mean for payload in payloads]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < errors[0]


def test_it_is_no_worse_than_a_target_of_as_many_bytes():
    clip = synthetic.make_clip("walk", seed=1)[:150]
    known = encode(clip, Target("mean_mm", 1.0, joint_share=0))
    found = encode(clip, ByteBudget(len(known.data) / len(clip)))
    assert found.error.vertices.mean <= 1.03 * known.error.vertices.mean


def test_raw_channels_keep_to_their_bytes_or_say_so():
    clip = synthetic.make_clip("walk", seed=1)[:50]
    assert encode(clip, ByteBudget(1000), codec="raw").codec == "raw"
    with pytest.raises(CodecError, match="coarsest step"):
        encode(clip, ByteBudget(100), codec="raw")


@pytest.mark.parametrize("bytes_per_frame", [0.01, 1])
def test_okane_says_how_many_bytes_it_needs(bytes_per_frame):
    clip = synthetic.make_clip("walk", seed=1)[:80]
    with pytest.raises(CodecError, match=r"at least [\d.]+ bytes a frame"):
        encode(clip, ByteBudget(bytes_per_frame), codec="okane", transform="dct")


@pytest.mark.parametrize(("n_bytes", "mean_mm"), [(800, 106.598), (2400, 16.272)])
def test_the_rough_guess_of_okane_takes_four_rounds(n_bytes, mean_mm):
    clip = synthetic.make_clip("walk", seed=1)[:120]
    options = OkaneOptions.checked(None, "dct", None, None, (), None)
    assert OkaneSearch(clip, options).likely_mean_mm(n_bytes) == pytest.approx(mean_mm, rel=0.01)
