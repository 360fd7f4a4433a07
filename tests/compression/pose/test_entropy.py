"""Tracks: predicted, quantised by a trellis, coded, and read back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.compression.pose import entropy
from mocapdb.compression.pose.range_coder import finish_writer, new_reader, new_writer


def on_trellis(values):
    """Values near those given that a track can have."""
    filters, state, out = entropy.new_filters(1), 0, []
    for k, wanted in enumerate(values):
        value = wanted
        if k > 0:
            expected, odd = entropy.predict(filters, 0), state >> 1
            level = value - expected
            level += (level + odd) % 2 if level else 0
            state = entropy.next_state(state, entropy.index_of(level, odd))
            value = expected + level
        entropy.update_filters(filters, 0, value, k == 0)
        out.append(value)
    return np.array(out, dtype=np.int64)


def code(values, spacing, bands=None, n_frames=500):
    bands = np.zeros(len(values), dtype=np.int64) if bands is None else bands

    def run(coder, data, values):
        entropy.code_track(
            coder,
            data,
            entropy.new_track_models(),
            entropy.new_activity(n_frames),
            entropy.new_first_sizes(),
            entropy.new_filters(1),
            entropy.new_size_memory(1),
            bands,
            spacing,
            values,
        )

    data, coder = np.zeros(64 + 16 * len(values), dtype=np.uint8), new_writer()
    run(coder, data, values)
    written = np.frombuffer(finish_writer(coder, data), dtype=np.uint8).copy()
    read = np.zeros_like(values)
    run(new_reader(written), written, read)
    return len(written), read


@given(
    st.lists(st.integers(-(2**20), 2**20), min_size=1, max_size=60), st.sampled_from([0, 1, 4, 32])
)
def test_any_track_is_read_as_written(values, spacing):
    track = on_trellis(values)
    assert np.array_equal(code(track, spacing)[1], track)


@given(st.integers(-1000, 1000), st.integers(0, 1))
def test_indices_and_levels_are_inverse(index, odd):
    level = entropy.level_of(index, odd)
    assert entropy.index_of(level, odd) == index
    assert level == 0 or level % 2 == odd


def test_the_two_quantisers_together_have_every_level():
    levels = {entropy.level_of(index, odd) for index in range(-5, 6) for odd in (0, 1)}
    assert set(range(-9, 10)) <= levels


def test_a_steady_track_costs_less_than_a_wild_one():
    time = np.arange(400)
    steady = on_trellis(np.rint(300 * np.sin(time / 40)).astype(int).tolist())
    wild = on_trellis(np.random.default_rng(0).integers(-300, 300, 400).tolist())
    assert code(steady, 1)[0] < 0.4 * code(wild, 1)[0]


def test_a_constant_track_costs_next_to_nothing():
    assert code(np.full(1000, 77, dtype=np.int64), 1)[0] < 20


def test_bands_are_read_as_written():
    rng = np.random.default_rng(1)
    bands = np.arange(64) % 8
    scale = 200.0 / (1 + bands) ** 2
    values = np.zeros(64, dtype=np.int64)
    state, filters = 0, entropy.new_filters(1)
    for k in range(64):
        expected = entropy.predict(filters, 0) if bands[k] == 0 and k > 0 else 0
        index = int(rng.normal() * scale[k])
        values[k] = index if k == 0 else expected + entropy.level_of(index, state >> 1)
        state = entropy.next_state(state, index) if k > 0 else 0
        if bands[k] == 0:
            entropy.update_filters(filters, 0, int(values[k]), k == 0)
    assert np.array_equal(code(values, 0, bands)[1], values)


@pytest.mark.parametrize("slope", [0, 5, -300])
def test_the_bank_follows_a_line(slope):
    filters = entropy.new_filters(1)
    for k in range(80):
        entropy.update_filters(filters, 0, 1000 + slope * k, k == 0)
    assert abs(entropy.predict(filters, 0) - (1000 + slope * 80)) <= 1
