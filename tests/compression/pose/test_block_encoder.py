"""The encoder of a block: what choices cost, and which of them it makes."""

import numpy as np
import pytest

from mocapdb.compression.pose import block_encoder
from mocapdb.compression.pose.block_encoder import BlockEncoder
from mocapdb.compression.pose.modes import DCT, SAMPLES, STILL, mode_steps, track_bands
from mocapdb.compression.pose.spikes import is_spike
from mocapdb.compression.tuning import TRANSFORM_HANDICAP

STEPS = mode_steps(np.zeros(1, dtype=np.int64), 0)[0]
ONES = np.ones(64)
BANDS = np.zeros(67, dtype=np.uint8)


class Metric:
    """Of one channel, the same in all frames."""

    factors = np.ones((64, 1, 1))
    rows = np.arange(64)


def curve_cost(goal, spacing, step=1.0, bit_cost=1.0):
    return block_encoder._plain_curve(goal, ONES, BANDS, spacing, step, bit_cost, 8)


def test_a_value_without_error_costs_the_bits_of_its_mode_and_of_a_first_value():
    track, samples, cost = curve_cost(np.full(64, 5.0), 0)
    assert track.tolist() == [5]
    assert (samples == 5.0).all()
    assert cost == pytest.approx(10.0 + 4.0)


def transform_cost(estimate, sizes, weight, bit_cost):
    """Of a DCT of 64 frames, by its coefficients in steps."""
    return estimate(np.array(sizes), weight, track_bands(DCT, 64), bit_cost)


def test_a_transform_is_estimated_by_the_sizes_of_its_coefficients():
    """Of 3 steps two bits besides, and small ones are left out."""
    sizes = np.zeros(64)
    sizes[[0, 20]] = 3.0, -0.5
    cost = transform_cost(block_encoder._transform_cost, sizes, 1.0, 2.0)
    assert cost == pytest.approx(2.0 * (20.1 + 1.29 * (1.4 + 2.0 + 0.5 * 0.25)))


def test_a_constant_is_one_coefficient():
    """Of a DCT, here 8 times the value; a frame weighs the mean, in squared steps."""
    asked = block_encoder._transformed(np.full(64, 10.0), np.arange(64.0), DCT, 2.0, 1.0)
    assert asked[0][:2] == pytest.approx([40.0, 0.0])
    assert asked[1] == pytest.approx(4.0 * 31.5)
    track, cost = block_encoder._encode_transform(*asked)
    assert track.tolist() == [40]
    assert cost == pytest.approx(10.0 + 4.0)


def test_what_is_not_coded_of_a_transform_costs_its_square():
    sizes = np.zeros(64)
    sizes[[0, 20]] = 9.0, 0.5
    cost = transform_cost(block_encoder._encode_transform, sizes, 2.0, 1.0)[1]
    assert cost == pytest.approx(10.0 + 4.0 + 2.0 * 0.25)


@pytest.mark.parametrize(("estimate", "mode"), [(0.8, DCT), (0.9, STILL), (1.1, DCT), (1.2, STILL)])
def test_a_transform_is_coded_to_see_where_the_estimate_is_near(monkeypatch, estimate, mode):
    """Within 15 %: then what it is found to cost counts, here far more, or far less."""
    found = 1000.0 if estimate < 1.0 else 1.0
    monkeypatch.setattr(
        block_encoder, "_transform_cost", lambda *asked: 30.0 * estimate / TRANSFORM_HANDICAP
    )
    monkeypatch.setattr(block_encoder, "_encode_transform", lambda *asked: (ONES, found))
    encoder = BlockEncoder(np.zeros((64, 1)), Metric(), (SAMPLES, DCT))
    chosen, track = encoder._best_mode(np.zeros(64), ONES, STEPS, 1.0, STILL, 30.0)
    assert chosen == mode
    assert (track is ONES) == (estimate == 1.1)  # what was coded to see need not be coded again


@pytest.mark.parametrize(("last", "length"), [(0.55, 2), (0.65, 21)])
def test_coefficients_after_the_last_large_one_are_not_coded(last, length):
    """Those of at most 0.6 steps, whatever they might bring: here a bit costs next to nothing.

    After an odd index the trellis has the level 1 at every other place.
    """
    sizes = np.zeros(64)
    sizes[[0, 1, 20]] = 9.0, 2.0, last
    track, _ = transform_cost(block_encoder._encode_transform, sizes, 1.0, 1e-6)
    assert len(track) == length


@pytest.mark.parametrize(("cost", "mode"), [(0.94, DCT), (0.98, STILL)])
def test_a_transform_has_to_be_four_percent_cheaper(monkeypatch, cost, mode):
    """Its track leaves no activity for the channels after it to learn from."""
    monkeypatch.setattr(block_encoder, "_transform_cost", lambda *asked: 30.0 * cost)
    monkeypatch.setattr(block_encoder, "_encode_transform", lambda *asked: (None, 30.0 * cost))
    encoder = BlockEncoder(np.zeros((64, 1)), Metric(), (SAMPLES, DCT))
    assert encoder._best_mode(np.zeros(64), ONES, STEPS, 1.0, STILL, 30.0)[0] == mode


@pytest.mark.parametrize(("cost", "mode"), [(19.9, STILL), (20.1, DCT)])
def test_below_twenty_bits_no_transform_is_tried(monkeypatch, cost, mode):
    """A track of several integers cannot take less."""
    monkeypatch.setattr(block_encoder, "_transform_cost", lambda *asked: 1.0)
    encoder = BlockEncoder(np.zeros((64, 1)), Metric(), (SAMPLES, DCT))
    assert encoder._best_mode(np.zeros(64), ONES, STEPS, 1.0, STILL, cost)[0] == mode


@pytest.mark.parametrize(("bit_cost", "expected"), [(0.9, True), (1.1, False)])
def test_a_spike_costs_fourteen_bits(bit_cost, expected):
    goal = np.zeros(5)
    goal[2] = np.sqrt(14.0)
    assert is_spike(goal, np.zeros(5), np.ones(5), 2, bit_cost) is expected


def test_only_the_worst_of_three_neighbours_is_a_spike():
    goal = np.array([0.0, 50.0, 60.0, 50.0, 0.0])
    found = [is_spike(goal, np.zeros(5), np.ones(5), t, 1.0) for t in range(5)]
    assert found == [False, False, True, False, False]


def test_a_spike_does_not_move_the_curve():
    """Its frame keeps a millionth of its weight; the curve passes as if it were not there."""
    time = np.linspace(0, 3, 64)
    smooth = 40 * np.sin(time)
    goal = smooth.copy()
    goal[30] += 500.0
    _, spikes, samples, _ = block_encoder._fit_curve(goal, ONES, BANDS, 8, 0.01, 0.01, 1e-6, 8)
    assert np.flatnonzero(spikes).tolist() == [30]
    others = np.arange(64) != 30
    assert np.abs(samples - smooth)[others].max() < 0.05
    pulled = block_encoder._plain_curve(goal, ONES, BANDS, 8, 0.01, 1e-6, 8)[1]
    assert np.abs(pulled - smooth)[others].max() > 10.0


def test_a_spike_keeps_a_millionth_of_its_weight():
    """So much of it is left in the frames around it."""
    goal = np.zeros(64)
    goal[30] = 500.0
    samples = block_encoder._fit_curve(goal, ONES, BANDS, 8, 1e-9, 0.01, 1e-9, 8)[2]
    assert samples[29] == pytest.approx(6.47e-5, rel=0.01)


def test_a_bit_is_worth_what_the_trellis_makes_of_it():
    """Four times the slope of rate-distortion theory, 2 ln 2 / 12, at a step of 1."""
    costs = []

    class Noting(BlockEncoder):
        def _best_mode(self, goal, weights, steps, bit_cost, best, least):
            costs.append(bit_cost)
            return best, None

    encoder = Noting(np.zeros((64, 1)), Metric(), (SAMPLES, DCT))
    encoder.set_steps()
    for qp in (0, 64):
        encoder.encode(qp)
    assert costs == pytest.approx([4 * 2 * np.log(2) / 12, 16 * 2 * np.log(2) / 12], rel=1e-3)
