"""Bounds of gait analysis, each looked at from both sides: a tuned number that changes shows."""

from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocapdb.corpus import synthetic
from mocapdb.gait.calibration import calibrate
from mocapdb.gait.feet import UP, Foot, understand_walker
from mocapdb.gait.foot_events import FootContact, foot_contacts
from mocapdb.gait.strides import find_strides
from mocapdb.motion.clip import Clip
from mocapdb.motion.frame_range import FrameRange

FPS = 30.0


@pytest.fixture(scope="module")
def walker():
    return understand_walker(synthetic.make_clip("walk", seed=3, fps=FPS, duration_s=5))


# -- the belt --------------------------------------------------------------------------------------


def belt_of(speed, share=0.0, noise_deg=0.0):
    """Return the belt under a walk of which a share of the way is left."""
    clip = synthetic.make_clip(
        "walk", seed=3, duration_s=3, speed=speed, sensor_noise_deg=noise_deg
    )
    channels = clip.channels.copy()
    along = np.linspace(0.0, 1.0, len(clip)) * (channels[-1, 2] - channels[0, 2])
    channels[:, 2] -= (1.0 - share) * along
    return np.linalg.norm(understand_walker(clip.replace(channels=channels)).belt_m_s)


def test_a_belt_is_as_fast_as_a_slow_walk():
    assert belt_of(0.19) == 0.0
    assert 0.25 < belt_of(0.24) < 0.32


def test_who_travels_is_on_no_belt():
    assert belt_of(0.8, share=0.21) > 0.5  # of what the belt makes 0.27
    assert belt_of(0.8, share=0.25) == 0.0  # 0.33


def test_noise_hides_no_belt():
    assert belt_of(0.6, noise_deg=0.15) == pytest.approx(0.727, rel=0.02)


# -- contacts --------------------------------------------------------------------------------------


def path_of(speeds, fps):
    """Return a point that goes along z at such speeds."""
    way = np.concatenate([[0.0], np.cumsum(speeds)]) / fps
    return np.outer(way, [0.0, 0.0, 1.0])


def contacts_of(*paths, fps):
    heel, ball, tip = (paths * 3)[:3]
    return foot_contacts(Foot(heel, ball, tip, UP), fps, 0.5)


@pytest.mark.parametrize(("frames", "count"), [(6, 0), (9, 1)])
def test_a_short_rest_is_no_contact(frames, count):
    # at 120 Hz speeds are over two frames: one frame less is seen at rest than there is
    speeds = np.full(120, 2.0)
    speeds[60 : 60 + frames + 1] = 0.0
    assert len(contacts_of(path_of(speeds, 120.0), fps=120.0)) == count


@pytest.mark.parametrize(("frames", "count"), [(6, 1), (9, 2)])
def test_a_short_swing_is_no_swing(frames, count):
    speeds = np.full(120, 0.0)
    speeds[60 : 60 + frames - 1] = 2.0
    speeds[:20] = speeds[-20:] = 2.0
    assert len(contacts_of(path_of(speeds, 120.0), fps=120.0)) == count


# -- strides ---------------------------------------------------------------------------------------


def stride_of(walker, *, seconds=1.2, share=0.5, length=1.0, turn_deg=0.0):
    """Return what is said of one stride of the left foot; empty where it is one."""
    frames = np.arange(len(walker.positions))
    turns = Rotation.from_rotvec(np.outer(frames, UP) * turn_deg / (seconds * FPS), degrees=True)
    turned = turns.as_matrix()[:, None] @ walker.positions[..., None]
    ends = 20.0 + seconds * FPS * np.arange(2)

    def contact(strike, z):
        toe_off = strike + 0.6 * seconds * FPS
        place = np.array([0.0, 0.0, z * walker.leg_m])
        return FootContact(strike, toe_off, FrameRange(int(strike), int(toe_off)), place)

    left = [contact(ends[0], 0.0), contact(ends[1], length)]
    right = [contact(ends[0] + (share - back) * seconds * FPS, length / 2) for back in (1, 0)]
    strides, refused = find_strides(replace(walker, positions=turned[..., 0]), (left, right))
    return "; ".join(refused) if not strides else ""


@pytest.mark.parametrize(
    ("good", "bad", "why"),
    [
        ({"seconds": 0.4}, {"seconds": 0.3}, "expected 0.35 to 3"),
        ({"seconds": 2.6}, {"seconds": 3.4}, "expected 0.35 to 3"),
        ({"share": 0.28}, {"share": 0.21}, "other foot's strike at"),
        ({"share": 0.72}, {"share": 0.8}, "other foot's strike at"),
        ({"length": 0.29}, {"length": 0.21}, "too short for a leg"),
        ({"turn_deg": 65.0}, {"turn_deg": 85.0}, "turns by"),
    ],
)
def test_what_is_no_stride_is_refused(walker, good, bad, why):
    assert stride_of(walker, **good) == ""
    assert why in stride_of(walker, **bad)


# -- what zero means -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def standing():
    body = made.make_walk(30)
    return understand_walker(Clip(body.skeleton, body.channels, FPS))


def zero_of(walker, *, leg_deg=0.0, knee_deg=0.0, foot_deg=0.0):
    """Return what zero means with a rest pose that is so far from standing."""
    rest = walker.rest_positions.copy()
    hip, knee, ankle = (walker.parts[f"left_{part}"] for part in ("hip", "knee", "ankle"))
    shank = Rotation.from_euler("x", knee_deg, degrees=True).apply(rest[ankle] - rest[knee])
    leg = Rotation.from_euler("x", leg_deg, degrees=True)
    thigh = leg.apply(rest[knee] - rest[hip])
    rest[knee] = rest[hip] + thigh
    rest[ankle] = rest[knee] + leg.apply(shank)
    sole_up = Rotation.from_euler("x", foot_deg, degrees=True).apply(UP)
    feet = tuple(replace(foot, sole_up=sole_up) for foot in walker.feet)
    return calibrate(replace(walker, rest_positions=rest, feet=feet)).zero


@pytest.mark.parametrize(
    ("good", "bad", "why"),
    [
        ({"leg_deg": 31.0}, {"leg_deg": 40.0}, "left leg is over 35 degrees"),
        ({"knee_deg": 13.0}, {"knee_deg": 18.0}, "left knee is bent by over 15"),
        ({"foot_deg": 13.0}, {"foot_deg": 18.0}, "left foot is over 15 degrees"),
    ],
)
def test_who_stands_in_the_rest_pose(standing, good, bad, why):
    assert zero_of(standing, **good).startswith("rest pose")
    assert why in zero_of(standing, **bad)


@pytest.mark.parametrize(("bend_deg", "turned_deg"), [(21.0, 0.0), (30.0, 30.0)])
def test_a_knee_that_hardly_bends_has_the_axis_of_the_hips(standing, bend_deg, turned_deg):
    positions = standing.positions.copy()
    bend = np.outer(np.linspace(0.0, bend_deg, len(positions)), [1.0, 0.0, 0.0])
    bends = Rotation.from_rotvec(bend, degrees=True)
    outwards = Rotation.from_euler("y", 30.0, degrees=True)
    for side, x in (("left", 0.1), ("right", -0.1)):
        hip, knee, ankle = (standing.parts[f"{side}_{part}"] for part in ("hip", "knee", "ankle"))
        positions[:, hip] = (x, 1.0, 0.0)
        positions[:, knee] = (x, 0.55, 0.0)
        positions[:, ankle] = positions[:, knee] + outwards.apply(bends.apply([0.0, -0.45, 0.0]))
    still = np.broadcast_to(np.eye(3), standing.rotations.shape)
    lying = np.zeros_like(standing.rest_positions)
    moved = replace(standing, positions=positions, rotations=still, rest_positions=lying)
    to_right = calibrate(moved).axes["left_thigh"][:, 2]
    away = np.rad2deg(np.arccos(abs(to_right[0])))
    assert away == pytest.approx(turned_deg, abs=1.0)
