"""The range coder: equal to its naive twin, and what is written is read."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive_codec import N_SYMBOLS, naive_symbols

from mocapdb.compression.pose import range_coder as rc

SYMBOLS = st.lists(st.integers(0, N_SYMBOLS - 1), max_size=300)


def skewed(power):
    weights = 1.0 / np.arange(1, N_SYMBOLS + 1) ** power
    return weights / weights.sum()


def write(actions, models):
    data = np.zeros(64 + 8 * len(actions), dtype=np.uint8)
    coder = rc.new_writer()
    for action in actions:
        action(coder, data, models)
    return rc.finish_writer(coder, data)


@given(SYMBOLS, st.sampled_from([0.0, 1.0, 8.0]))
def test_bytes_equal_the_naive_twins(symbols, power):
    actions = [
        lambda coder, data, models, s=s: rc.code_symbol(coder, data, models, 0, s) for s in symbols
    ]
    assert write(actions, rc.new_models(skewed(power)[None])) == naive_symbols(
        symbols, skewed(power)
    )


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("symbol"), st.integers(0, N_SYMBOLS - 1), st.just(0)),
            st.tuples(st.just("bits"), st.integers(0, 2**27 - 1), st.integers(0, 27)),
            st.tuples(st.just("number"), st.integers(0, 2**27 - 1), st.just(0)),
        ),
        max_size=200,
    )
)
def test_what_is_written_is_read(items):
    table = np.tile(skewed(1.0), (4, 1))

    def code(coder, data, models, kind, value, n_bits):
        if kind == "symbol":
            return rc.code_symbol(coder, data, models, 0, value)
        if kind == "bits":
            return rc.code_bits(coder, data, n_bits, value)
        return rc.code_number(coder, data, models, 2, value, 27)

    data = np.zeros(64 + 16 * len(items), dtype=np.uint8)
    coder, models = rc.new_writer(), rc.new_models(table)
    expected = []
    for kind, value, n_bits in items:
        kept = value & ((1 << n_bits) - 1) if kind == "bits" else value
        code(coder, data, models, kind, kept, n_bits)
        expected.append(kept)
    written = np.frombuffer(rc.finish_writer(coder, data), dtype=np.uint8).copy()

    coder, models = rc.new_reader(written), rc.new_models(table)
    assert [code(coder, written, models, kind, 0, n) for kind, _, n in items] == expected


def test_a_likely_symbol_costs_next_to_nothing():
    actions = [lambda coder, data, models: rc.code_symbol(coder, data, models, 0, 3)] * 2000
    assert len(write(actions, rc.new_models(skewed(0.0)[None]))) < 30


def test_every_symbol_stays_possible():
    models = rc.new_models(np.eye(N_SYMBOLS)[:1])
    data, coder = np.zeros(9000, dtype=np.uint8), rc.new_writer()
    for _ in range(2000):
        rc.code_symbol(coder, data, models, 0, 5)
    bounds = models.reshape(-1, N_SYMBOLS)
    assert np.diff(bounds, axis=1, prepend=0).min() >= 1
    assert (bounds[:, -1] == 2**15).all()


@given(st.binary(max_size=120), st.lists(st.sampled_from([0, 1, 12, 15]), max_size=200))
def test_damaged_bytes_never_lead_out_of_the_interval(data, kinds):
    """Kernels index by what they read, without checks: it has to stay in range, whatever it is."""
    writable = np.frombuffer(b"\xff\xff\xff\xff" + data, dtype=np.uint8).copy()
    coder, models = rc.new_reader(writable), rc.new_models(skewed(1.0)[None])
    for kind in kinds:
        if kind == 0:
            assert 0 <= rc.code_symbol(coder, writable, models, 0, 0) < N_SYMBOLS
        else:
            assert 0 <= rc.code_bits(coder, writable, kind, 0) < 1 << kind
        assert 0 <= coder[0] < coder[1]


@pytest.mark.parametrize("data", [b"", b"\0", b"\xff" * 7, bytes(range(256))])
def test_any_bytes_can_be_read(data):
    writable = np.frombuffer(data, dtype=np.uint8).copy()
    coder, models = rc.new_reader(writable), rc.new_models(skewed(1.0)[None])
    symbols = [rc.code_symbol(coder, writable, models, 0, 0) for _ in range(500)]
    assert all(0 <= symbol < N_SYMBOLS for symbol in symbols)
