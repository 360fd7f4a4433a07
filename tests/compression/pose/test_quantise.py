"""The metric and the search in it."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from naive_codec import naive_metric
from strategies import clips

from mocapdb.compression.pose import entropy
from mocapdb.compression.pose.quantise import beam_search, feed_back_errors
from mocapdb.compression.pose.skin_metric import error_points, metric_factors, point_distances
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.skin import SHELL_RADIUS_M, skin_vertices


def shell_places(skeleton, values):
    pose = forward_kinematics(skeleton, values)
    radius = SHELL_RADIUS_M / skeleton.metres_per_unit
    places = pose.positions[:, :, None] + radius * np.swapaxes(pose.rotations, -1, -2)
    return places.reshape(len(values), -1, 3)


def skin_places(skeleton, values):
    return skin_vertices(skeleton, forward_kinematics(skeleton, values))


def metric(clip, name):
    pose = forward_kinematics(clip.skeleton, clip.channels)
    points = error_points(clip.skeleton, name)
    factors = metric_factors(clip.skeleton, clip.channels, pose, points)
    upper = np.triu(factors)
    return np.swapaxes(upper, 1, 2) @ upper


@settings(max_examples=25)
@given(clips(max_frames=3))
def test_the_shells_metric_equals_its_naive_twin(clip):
    expected = naive_metric(clip.skeleton, clip.channels, shell_places)
    scale = max(float(np.abs(expected).max()), 1e-12)
    np.testing.assert_allclose(metric(clip, "shell") / scale, expected / scale, atol=2e-3)


@settings(max_examples=25)
@given(clips(max_frames=3, shifts=False))
def test_the_skins_metric_equals_its_naive_twin(clip):
    if clip.skeleton.n_joints == 1:
        return
    expected = naive_metric(clip.skeleton, clip.channels, skin_places)
    scale = max(float(np.abs(expected).max()), 1e-12)
    np.testing.assert_allclose(metric(clip, "skin") / scale, expected / scale, atol=1e-2)


@settings(max_examples=10)
@given(clips(max_frames=4))
def test_misses_are_distances_between_points(clip):
    other = clip.channels + 0.5
    points = error_points(clip.skeleton, "shell")
    misses = point_distances(
        points,
        forward_kinematics(clip.skeleton, clip.channels),
        forward_kinematics(clip.skeleton, other),
    )
    moved = shell_places(clip.skeleton, clip.channels) - shell_places(clip.skeleton, other)
    np.testing.assert_allclose(misses, np.linalg.norm(moved, axis=-1), atol=1e-9)


@pytest.mark.parametrize("stride", [1, 3])
def test_what_channels_miss_of_their_goals_adds_up_to_the_error(stride):
    """The identity behind the nearest plane: sum of w (goal - decoded)^2 is |R e|^2."""
    rng = np.random.default_rng(0)
    n_frames, n_channels = 12, 5
    rows = np.arange(n_frames) // stride
    factors = np.triu(rng.normal(size=(4 if stride == 3 else 12, n_channels, n_channels)))
    factors[:, range(n_channels), range(n_channels)] = rng.uniform(
        0.5, 2.0, (len(factors), n_channels)
    )
    values = rng.normal(size=(n_frames, n_channels))
    errors = np.zeros_like(values)
    goal, weights = np.empty(n_frames), np.empty(n_frames)
    columns = np.ascontiguousarray(values.T)
    told = 0.0
    for channel in range(n_channels - 1, -1, -1):
        feed_back_errors(columns, factors, rows, errors, channel, goal, weights)
        decoded = np.rint(goal)
        told += weights @ (goal - decoded) ** 2
        errors[:, channel] = columns[channel] - decoded
    spread = np.einsum("fij,fj->fi", factors[rows], errors)
    assert told == pytest.approx((spread**2).sum())


def test_the_search_finds_the_best_track():
    rng = np.random.default_rng(3)
    best = rng.normal(size=4) * 1.5
    factor = np.zeros((4, 4))
    factor[:, 0] = 1.0
    factor[1:, 1] = 0.4
    bands = np.zeros(4, dtype=np.int64)

    def miss(values):
        change = np.array(values) - best
        rows = change.copy()
        rows[1:] += 0.4 * change[:-1]
        return (rows**2).sum()

    def reachable():
        for start, *indices in product(range(-4, 5), *[range(-6, 7)] * 3):
            filters, state, values = entropy.new_filters(1), 0, [start]
            entropy.update_filters(filters, 0, start, True)
            for index in indices:
                level = entropy.level_of(index, state >> 1)
                values.append(entropy.predict(filters, 0) + level)
                state = entropy.next_state(state, index)
                entropy.update_filters(filters, 0, values[-1], False)
            yield values

    found, _ = beam_search(best, factor, bands, 0.0, 64)
    assert miss(found) == pytest.approx(min(miss(values) for values in reachable()))


def test_a_dearer_bit_makes_shorter_tracks():
    best = np.random.default_rng(4).normal(size=200) * 2
    factor = np.zeros((200, 4))
    factor[:, 0] = 1.0
    bands = np.zeros(200, dtype=np.int64)
    bits = [beam_search(best, factor, bands, rate, 8)[1] for rate in (0.0, 0.3, 3.0)]
    assert bits[0] > bits[1] > bits[2]


def test_values_out_of_range_are_refused():
    _, bits = beam_search(np.array([1e12]), np.ones((1, 4)), np.zeros(1, dtype=np.int64), 1.0, 8)
    assert bits == np.inf


@pytest.mark.parametrize(("wanted", "chosen"), [(4.5, 0), (5.5, 6)])
def test_a_zero_is_tried_up_to_five_steps_away(wanted, chosen):
    """Where bits are dear and the first integer is fixed."""
    factor = np.zeros((2, 4))
    factor[:, 0] = 1e6, 1.0
    bands = np.zeros(2, dtype=np.uint8)
    assert beam_search(np.array([0.0, wanted]), factor, bands, 1000.0, 8)[0].tolist() == [0, chosen]
