"""The kit of faults: each recipe changes what it names, there, and nothing else."""

import numpy as np
import pytest

from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic.fault_kit import RECIPES, Recipe, inject_recipe
from mocapdb.errors import ClipError
from mocapdb.motion.foot_contacts import find_legs
from mocapdb.motion.kinematics import forward_kinematics
from mocapdb.motion.quaternions import angles_deg


@pytest.fixture(scope="module")
def clip():
    return synthetic.make_clip("walk", seed=3, duration_s=7.0, sensor_noise_deg=0.02)


def recipe(name):
    return next(r for r in RECIPES if r.name == name)


def errors_of(clip, injection, fault):
    right, wrong = local_rotations(clip), local_rotations(injection.clip)
    row = right.joints.tolist().index(fault.joint)
    return angles_deg(right.quat_xyzw[:, row], wrong.quat_xyzw[:, row])


@pytest.mark.parametrize("name", [r.name for r in RECIPES if r.where != "root"])
def test_only_the_mask_is_wrong_and_faults_say_by_how_much(clip, name):
    injection = inject_recipe(clip, recipe(name), seed=5)
    right, wrong = local_rotations(clip), local_rotations(injection.clip)
    errors = angles_deg(right.quat_xyzw, wrong.quat_xyzw)
    mask = injection.mask[:, right.joints]
    assert errors[~mask].max() < 1e-5
    assert injection.faults
    for fault in injection.faults:
        apart = errors_of(clip, injection, fault)
        if recipe(name).where == "foot":  # whose size is in metres
            assert 0.02 <= fault.size_deg <= 0.13
        else:
            assert apart.max() == pytest.approx(fault.size_deg, abs=1e-3)


def test_a_foot_goes_as_far_as_asked_and_is_where_it_was_beside_the_fault(clip):
    for name, axis in (("foot slide", 0), ("foot through the floor", 1)):
        injection = inject_recipe(clip, recipe(name)._replace(size=(0.05, 0.05)), seed=5)
        (fault,) = injection.faults
        before, after = (
            forward_kinematics(each.skeleton, each.channels).positions
            for each in (clip, injection.clip)
        )
        legs = find_legs(clip.skeleton, before)
        ball = next(leg.ball for leg in legs if leg.foot == fault.joint)
        moved = (after - before)[:, ball] * clip.skeleton.metres_per_unit
        far = np.linalg.norm(moved, axis=1)
        assert far.max() == pytest.approx(fault.size_deg, abs=1e-9)
        assert far[: fault.start].max() == far[fault.end :].max() == 0.0
        up = np.abs(moved[:, clip.skeleton.up_index]).max()
        assert (up < 0.005) if axis == 0 else (up > 0.02)


def test_sizes_and_lengths_are_as_asked(clip):
    pop = inject_recipe(clip, recipe("pop by 180"), seed=1).faults[0]
    assert pop.size_deg == pytest.approx(180.0, abs=0.01)
    assert 1 <= pop.end - pop.start <= 3
    spike = inject_recipe(clip, recipe("spike, 1 frame"), seed=2).faults[0]
    assert spike.end - spike.start == 1
    several = inject_recipe(clip, recipe("several joints 20"), seed=2).faults
    assert 3 <= len(several) <= 5
    assert len({(f.start, f.end) for f in several}) == 1


def test_eased_faults_begin_and_end_small(clip):
    injection = inject_recipe(clip, recipe("eased offset 45 and 90"), seed=2)
    fault = injection.faults[0]
    apart = errors_of(clip, injection, fault)[fault.start : fault.end]
    assert max(apart[0], apart[-1]) < 0.2 * apart.max()


@pytest.mark.parametrize("seed", range(4))
def test_a_straight_line_is_straight_in_channels_or_on_the_sphere(clip, seed):
    injection = inject_recipe(clip, recipe("straight line"), seed=seed)
    fault = injection.faults[0]
    frames = slice(fault.start - 1, fault.end + 1)
    columns = clip.skeleton.rotation_columns(fault.joint)
    bends = np.abs(np.diff(injection.clip.channels[frames, columns], 2, axis=0)).max()
    texture = local_rotations(injection.clip)
    quats = texture.quat_xyzw[frames, texture.joints.tolist().index(fault.joint)]
    assert len(quats) >= 7
    steps = angles_deg(quats[:-1], quats[1:])
    assert min(bends, np.ptp(steps)) < 1e-6


def test_an_exchange_takes_the_opposite_joint_as_it_is_or_mirrored(clip):
    legs = [clip.skeleton.joint(name) for name in ("lfemur", "rfemur", "ltibia", "rtibia")]
    injection = inject_recipe(clip, recipe("left and right exchanged"), seed=1, joints=legs)
    names = [clip.skeleton.names[fault.joint] for fault in injection.faults]
    assert {name[0] for name in names} == {"l", "r"}
    fault = injection.faults[0]
    name = clip.skeleton.names[fault.joint]
    other = clip.skeleton.joint({"l": "r", "r": "l"}[name[0]] + name[1:])
    here = injection.clip.channels[fault.start : fault.end]
    there = clip.channels[fault.start : fault.end, clip.skeleton.rotation_columns(other)]
    assert np.allclose(np.abs(here[:, clip.skeleton.rotation_columns(fault.joint)]), np.abs(there))


def test_a_root_jump_moves_the_body_in_metres(clip):
    injection = inject_recipe(clip, recipe("root jump"), seed=4)
    fault = injection.faults[0]
    moved = injection.clip.channels[fault.start, :3] - clip.channels[fault.start, :3]
    metres = np.linalg.norm(moved) * clip.skeleton.metres_per_unit
    assert metres == pytest.approx(fault.size_deg, rel=0.05)


def test_no_room_is_said(clip):
    with pytest.raises(ClipError, match="found none"):
        inject_recipe(clip[:20], Recipe("long", "offset", length_s=(5.0, 5.0)), seed=1)
