"""Cycles on other bodies: of one kind, and human ones whose joints have nothing in common."""

from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest

from mocapdb.corpus import synthetic
from mocapdb.cycles import blend, extract_cycle, make_loop, transition
from mocapdb.cycles.cycle import joint_positions
from mocapdb.cycles.synthesis.loop import jerk, root_relative_positions
from mocapdb.cycles.synthesis.other_bodies import is_of_one_kind, on_body
from mocapdb.errors import CycleError, SkeletonError
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_legs
from mocapdb.motion.rotations import elementary


def cycle_of(body, name="made"):
    skeleton = replace(body.skeleton, metres_per_unit=body.unit_m, up=body.up)
    return extract_cycle(Clip(skeleton, body.channels, 30.0, name=name)).cycle


@pytest.fixture(scope="module")
def plain():
    return cycle_of(made.make_walk(90))


@pytest.fixture(scope="module")
def tall():
    return cycle_of(made.in_units(made.along_x(made.make_walk(90, legs=1.15)), 0.01))


def knee_peaks(cycle):
    positions = cycle.pose(np.arange(128) / 128).positions
    peaks = []
    for leg in find_legs(cycle.skeleton, positions):
        thigh = positions[:, leg.knee] - positions[:, leg.hip]
        shank = positions[:, leg.ankle] - positions[:, leg.knee]
        lengths = np.linalg.norm(thigh, axis=1) * np.linalg.norm(shank, axis=1)
        cosine = (thigh * shank).sum(axis=1) / lengths
        peaks.append(np.rad2deg(np.arccos(cosine)).max())
    return np.array(peaks)


def in_metres(cycle):
    """Joints by name, seen from the root, Y up, the left hip along x on average."""
    positions = joint_positions(cycle) * cycle.skeleton.metres_per_unit
    if cycle.skeleton.up == "z":
        positions = np.stack([positions[..., 0], positions[..., 2], -positions[..., 1]], axis=-1)
    found = dict(zip(cycle.skeleton.names, np.moveaxis(positions, 1, 0), strict=True))
    across = (found["left_hip"] - found["right_hip"]).mean(axis=0)
    turn = elementary("Y", np.arctan2(across[2], across[0]))
    return {name: here @ turn.T for name, here in found.items()}


@pytest.mark.parametrize(
    "change", [made.along_x, made.turned_up, lambda body: made.in_units(body, 0.01)]
)
def test_one_body_written_in_two_ways_moves_alike(plain, change):
    other = cycle_of(change(made.make_walk(90)))
    moved = on_body(plain, other)
    assert moved.skeleton == other.skeleton
    expected, found = in_metres(plain), in_metres(moved)
    for name in ("head", *(f"{s}_{j}" for s in ("left", "right") for j in (
        "knee", "ankle", "toe", "elbow", "wrist"))):  # fmt: skip
        assert np.abs(found[name] - expected[name]).max() < 0.02, name
    unit = moved.skeleton.metres_per_unit
    assert np.linalg.norm(moved.advance) * unit == pytest.approx(
        np.linalg.norm(plain.advance), rel=0.01
    )


def test_longer_legs_go_further_and_bend_the_same(plain, tall):
    moved = on_body(plain, tall)
    np.testing.assert_allclose(knee_peaks(moved), knee_peaks(plain), atol=0.5)
    way = np.linalg.norm(moved.advance) * moved.skeleton.metres_per_unit
    assert way == pytest.approx(1.15 * np.linalg.norm(plain.advance), rel=0.01)
    lowest = [
        cycle.pose(np.arange(128) / 128, "in-place").positions[..., 1].min()
        for cycle in (moved, tall)
    ]
    assert lowest[0] == pytest.approx(lowest[1], abs=1.0)  # centimetres


def test_an_acclaim_body_takes_what_a_bvh_does(plain, walk):
    for source, target in ((plain, walk), (walk, plain)):
        moved = on_body(source, target)
        np.testing.assert_allclose(knee_peaks(moved), knee_peaks(source), atol=2.0)
        channels = make_loop(moved, hold_feet=False).clip.channels
        assert np.abs(np.diff(channels, axis=0)).max() < 20.0  # no joint turns over


def test_a_blend_of_two_bodies(walk, tall):
    peaks = np.stack([knee_peaks(walk), knee_peaks(tall)])
    for body, own in enumerate((walk, tall)):
        mixed = blend([walk, tall], [0.5, 0.5], body=body)
        assert mixed.skeleton == own.skeleton
        found = knee_peaks(mixed)
        assert (found > peaks.min(axis=0) - 1.0).all()
        assert (found < peaks.max(axis=0) + 1.0).all()
        loop = make_loop(mixed, 60.0)
        assert loop.slide_after_mm < 3.0
        assert loop.pops == {}
    with pytest.raises(CycleError, match="body of one of 2"):
        blend([walk, tall], [0.5, 0.5], body=2)


def test_a_transition_between_two_bodies_jerks_no_more_than_it_may(walk, tall):
    clip = transition(walk, tall, duration_s=0.8, fps=60.0, body=1)
    assert clip.skeleton == tall.skeleton
    most = 0.8 * jerk(root_relative_positions(clip), 60.0, closed=False)
    calm = transition(walk, tall, duration_s=0.8, fps=60.0, body=1, most_jerk=most)
    assert jerk(root_relative_positions(calm), 60.0, closed=False) <= most


def test_bodies_of_one_kind_take_each_others_rotations(walk):
    other = extract_cycle(
        synthetic.make_clip("walk", seed=1, skeleton=synthetic.make_skeleton(1.95))
    ).cycle
    moved = on_body(walk, other)
    np.testing.assert_array_equal(moved.columns, walk.columns)
    ratio = other.skeleton.height / walk.skeleton.height
    np.testing.assert_allclose(moved.advance, ratio * walk.advance)
    assert on_body(walk, walk) is walk


@pytest.mark.parametrize(("angle_deg", "alike"), [(15.0, True), (25.0, False)])
def test_of_one_kind_are_bodies_whose_bones_point_the_same_ways(walk, angle_deg, alike):
    skeleton = walk.skeleton
    angle = np.deg2rad(angle_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0],
                     [0, 0, 1]])  # fmt: skip
    offsets = skeleton.offsets.copy()
    thigh = skeleton.joint("lfemur")
    offsets[thigh] = turn @ [0.0, -np.linalg.norm(offsets[thigh]), 0.0]
    straight = skeleton.offsets.copy()
    straight[thigh] = [0.0, -np.linalg.norm(offsets[thigh]), 0.0]
    bodies = [replace(skeleton, offsets=each) for each in (straight, offsets)]
    assert is_of_one_kind(*bodies) == alike


def test_short_bones_may_point_anywhere(walk):
    skeleton = walk.skeleton
    lengths = (
        np.linalg.norm(skeleton.offsets, axis=1) / np.linalg.norm(skeleton.offsets, axis=1).max()
    )
    for share, alike in ((0.25, True), (0.38, False)):
        joint = int(np.argmin(np.abs(lengths - share)))
        offsets = skeleton.offsets.copy()
        offsets[joint] *= -1
        assert is_of_one_kind(skeleton, replace(skeleton, offsets=offsets)) == alike


def test_an_animal_and_a_person_do_not_blend(plain):
    dog = made.make_dog()
    channels = np.tile(dog.channels, (3, 1))[: len(dog.channels)]
    animal = replace(
        plain,
        skeleton=dog.skeleton,
        columns=np.tile([1.0, 0, 0, 0, 1, 0], (128, dog.skeleton.n_joints, 1)),
        sway=np.tile(channels[0, :3], (128, 1)),
        translations=np.empty(0),
        name="dog",
    )
    for pair in ((plain, animal), (animal, plain)):
        with pytest.raises(SkeletonError, match=r"'dog' on skeleton .* no whole human body"):
            blend(pair, [0.5, 0.5])
    assert blend((animal, animal), [0.5, 0.5]).skeleton == dog.skeleton


def test_the_frames_of_foot_and_arm(walk, tall):
    moved = on_body(walk, tall)
    skeleton = moved.skeleton
    positions = joint_positions(moved)
    foot = positions[:, skeleton.joint("left_toe")] - positions[:, skeleton.joint("left_ankle")]
    foot /= np.linalg.norm(foot, axis=1)[:, None]
    # flat while the ankle is lowest, so that the sole is level on both bodies
    assert foot[:, 1].mean() == pytest.approx(-0.5495, abs=0.01)
    # turned about the axis of the elbow, which hardly bends
    upper = moved.columns[:, skeleton.joint("left_shoulder"), 4].mean()
    assert upper == pytest.approx(0.14942, abs=0.0006)
