"""Flagged spans grow to where the fault ends, and no further."""

import numpy as np
import pytest

from mocapdb.cleaning import Span
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.cleaning.map.extents import grow_spans
from mocapdb.corpus import synthetic

JOINT, START, END = "rradius", 200, 260


@pytest.fixture(scope="module")
def walk():
    return synthetic.make_clip("walk", seed=3, duration_s=4, sensor_noise_deg=0.02)


def grown(walk, turns_deg, span):
    """The ends of a span of a kind in a walk whose elbow is turned so much in the fault."""
    joint = walk.skeleton.joint(JOINT)
    channels = walk.channels.copy()
    channels[START:END, int(walk.skeleton.channel_starts[joint])] += turns_deg
    native = local_rotations(walk.replace(channels=channels))
    start, end, kind = span
    (found,) = grow_spans([Span(start, end, joint, 0.9, kind)], native)
    return found.start, found.end


def test_jitter_grows_over_all_of_it(walk):
    noise = np.random.default_rng(1).normal(0, 20.0, END - START)
    start, end = grown(walk, noise, (220, 235, "noise"))
    assert abs(start - START) <= 1
    assert abs(end - END) <= 1


@pytest.mark.parametrize("kind", ["offset", "noise", "freeze", "filled"])
def test_sharp_edges_stay(walk, kind):
    assert grown(walk, 40.0, (START, END, kind)) == (START, END)


@pytest.mark.parametrize("ease", [10, 25])
def test_a_soft_edge_is_followed_to_where_it_begins(walk, ease):
    to_edge = np.minimum(np.arange(1, END - START + 1), np.arange(END - START, 0, -1))
    s = np.clip(to_edge / ease, 0.0, 1.0)
    start, end = grown(
        walk, 60.0 * s * s * (3.0 - 2.0 * s), (START + ease // 2, END - ease // 2, "offset")
    )
    assert abs(start - START) <= 0.3 * ease
    assert abs(end - END) <= 0.3 * ease


def test_no_edge_grows_by_more_than_300_ms(walk):
    """36 frames of a ramp that is longer and steady."""
    still = walk.replace(channels=np.repeat(walk.channels[:1], len(walk), axis=0))
    ramp = 90.0 * np.arange(1, END - START + 1) / (END - START)
    assert grown(still, ramp, (END - 5, END, "drift"))[0] == END - 5 - 36


@pytest.mark.parametrize(("start", "first"), [(18, 0), (19, 19)])
def test_a_drift_that_begins_with_the_clip_was_cut_off(walk, start, first):
    """Within 0.15 s."""
    joint = walk.skeleton.joint("head")
    still = walk.replace(channels=np.repeat(walk.channels[:1], len(walk), axis=0))
    (found,) = grow_spans([Span(start, 60, joint, 0.9, "drift")], local_rotations(still))
    assert found.start == first
