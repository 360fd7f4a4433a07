import numpy as np
import pytest

from mocapdb.cycles.curve.flips import bridge_flips


def with_offset(clip, joint, frames, degrees):
    channels = clip.channels.copy()
    first = clip.skeleton.channel_starts[clip.skeleton.joint(joint)]
    channels[frames, first] += degrees
    return clip.replace(channels=channels)


def test_flips_are_bridged(synthetic_walk):
    flipped = with_offset(synthetic_walk, "lhand", slice(100, 107), 175.0)
    bridged, count = bridge_flips(flipped)
    assert count == 7
    np.testing.assert_allclose(bridged.channels, synthetic_walk.channels, atol=1.0)
    assert bridge_flips(synthetic_walk) == (synthetic_walk, 0)


def test_what_is_mostly_flipped_is_left_alone(synthetic_walk):
    flipped = with_offset(synthetic_walk, "lhand", slice(100, None), 175.0)
    bridged, _ = bridge_flips(flipped)
    np.testing.assert_allclose(bridged.channels[300:], flipped.channels[300:], atol=1e-9)


@pytest.mark.parametrize(("radians", "n_bridged"), [(1.7, 7), (1.3, 0)])
def test_only_impossible_steps_are_flips(synthetic_walk, radians, n_bridged):
    jumping = with_offset(synthetic_walk, "lhand", slice(100, 107), np.rad2deg(radians))
    assert bridge_flips(jumping).n_samples == n_bridged
