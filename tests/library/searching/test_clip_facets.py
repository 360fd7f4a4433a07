"""What is measured of clips, held against what they were made to be."""

import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.library import tuning
from mocapdb.library.searching.clip_facets import measure_facets
from mocapdb.motion.clip import Clip
from mocapdb.motion.skeleton import Skeleton

WAVE = synthetic.make_clip("wave", seed=1, duration_s=3)
STAND = WAVE.replace(channels=np.repeat(WAVE.channels[:1], len(WAVE), axis=0))


def moved(way_m=0.0, turn_deg=0.0, noise_m=0.0):
    """The clip with its root gone along x, turned about the vertical axis, and shaken."""
    channels = STAND.channels.copy()
    share = np.linspace(0, 1, len(STAND))
    x, turn = (STAND.skeleton.channel_names.index(f"root.{name}") for name in ("tx", "ry"))
    shake = np.random.default_rng(0).normal(size=len(STAND)) * noise_m
    channels[:, x] += (share * way_m + shake) / STAND.skeleton.metres_per_unit
    channels[:, turn] += share * turn_deg
    return STAND.replace(channels=channels)


def test_speed_is_of_the_hips_over_the_ground():
    still = measure_facets(STAND).root_speed_ms
    assert still < 0.03
    assert measure_facets(moved(way_m=4.5)).root_speed_ms == pytest.approx(1.5, abs=0.03)


def test_the_noise_of_a_capture_is_no_speed(monkeypatch):
    noisy = moved(noise_m=0.001)
    speed = measure_facets(noisy).root_speed_ms
    assert speed < 0.04
    monkeypatch.setattr("mocapdb.library.searching.clip_facets.SPEED_SPAN_S", 0.067)
    assert measure_facets(noisy).root_speed_ms > 1.2 * speed
    assert tuning.SPEED_SPAN_S == 0.1


@pytest.mark.parametrize("turn_deg", [-90, 120, 540])
def test_turns_to_the_left_are_positive_and_add_up(turn_deg):
    assert measure_facets(moved(turn_deg=turn_deg)).turn_deg == pytest.approx(turn_deg, abs=15)


def test_contacts_are_counted():
    walk = synthetic.make_clip("walk", seed=2, duration_s=4)
    assert 5 <= measure_facets(walk).contacts <= 9
    assert measure_facets(STAND).contacts == 0


def test_a_body_without_legs_has_no_facets():
    stick = Skeleton(
        ["root"], [-1], [[0, 0, 0]], [("tx", "ty", "tz", "rz", "ry", "rx")], ["ZYX"],
        convention="bvh",
    )  # fmt: skip
    assert measure_facets(Clip(stick, np.zeros((50, 6)), 120.0)) is None


def test_both_feet_that_land_at_once_are_two_contacts():
    hop = synthetic.make_clip("hop", seed=13, skeleton=synthetic.subject(3), duration_s=3)
    for end in range(60, 360, 30):  # some ends leave one landing of both feet in one frame
        found = measure_facets(hop[:end])
        assert found is not None
        assert found.contacts >= 0
    assert found.contacts >= 4
