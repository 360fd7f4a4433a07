"""Kinds that no two edges of one joint tell: each is found where it was put, and repaired."""

import numpy as np
import pytest

from mocapdb.cleaning import clean_clip, detect_faults
from mocapdb.cleaning.evidence import exchanges
from mocapdb.cleaning.evidence.discontinuities import find_jumps
from mocapdb.cleaning.evidence.jitter import JITTER_EVIDENCE, find_jitter
from mocapdb.cleaning.evidence.straight_lines import find_straight_lines
from mocapdb.cleaning.joint_roles import joint_roles
from mocapdb.cleaning.local_rotations import local_rotations
from mocapdb.corpus import synthetic
from mocapdb.motion.clip import CODED

RECIPE = {recipe.name: recipe for recipe in synthetic.RECIPES}
LIMBS = [synthetic.make_skeleton().joint(name) for name in ("lfemur", "rhumerus")]


@pytest.fixture(scope="module")
def run():
    return synthetic.make_clip("run", seed=4, duration_s=5, sensor_noise_deg=0.02, phase_noise=0.2)


def spans_of(clip, kind):
    return {(s.joint, s.start, s.end) for s in detect_faults(clip).spans if s.kind == kind}


def test_an_exchange_is_found_on_both_sides_and_swapped_back(run):
    joints = [run.skeleton.joint(side + "femur") for side in "lr"]
    channels = run.channels.copy()
    left, right = (run.skeleton.rotation_columns(joint) for joint in joints)
    channels[200:260, left], channels[200:260, right] = (
        run.channels[200:260, right], run.channels[200:260, left],
    )  # fmt: skip
    cleaned = clean_clip(run.replace(channels=channels), hold_feet=False)
    found = {(s.joint, s.start, s.end) for s in cleaned.digression_map.spans}
    assert {(joint, 200, 260) for joint in joints} <= found
    assert np.abs(cleaned.clip.channels - run.channels)[:, [*left, *right]].max() < 1e-6


@pytest.mark.parametrize(("jump_deg", "found"), [(4.5, False), (5.5, True)])
def test_both_joints_of_an_exchange_jump_by_five_degrees_together(jump_deg, found):
    own = np.full(60, 0.1)
    own[[20, 40]] = jump_deg
    pair = exchanges._Pair((0, 1), own, np.full((4, 60), 0.05), 0.2)
    assert bool(exchanges._stretches(pair, fps=120.0)) == found


@pytest.mark.parametrize("seed", [1, 2])
def test_a_straight_line_is_found_to_the_frame(run, seed):
    injection = synthetic.inject_recipe(run, RECIPE["straight line"], seed=seed, joints=LIMBS)
    wanted = {(f.joint, f.start, f.end) for f in injection.faults}
    assert wanted & spans_of(injection.clip, "filled")


@pytest.mark.parametrize(
    ("turn_deg", "decimals", "found"),
    [(0.035, None, True), (0.025, None, False), (0.055, 3, True), (0.042, 3, False)],
)
def test_a_line_that_hardly_turns_is_rest(run, turn_deg, decimals, found):
    """0.03 degrees; in numbers of three decimals what these explain, 12 times."""
    channels = run.channels.copy()
    columns = run.skeleton.rotation_columns(LIMBS[0])
    channels[100:107, columns] = channels[100, columns]
    channels[100:107, columns[0]] += np.linspace(0.0, turn_deg, 7)
    if decimals is not None:
        channels = channels.round(decimals)
    clip = run.replace(channels=channels)
    texture = local_rotations(clip)
    lines = [h for h in find_straight_lines(clip, texture) if 100 <= h.start <= 102]
    assert bool(lines) == found


def test_a_root_jump_is_found_and_taken_back(run):
    injection = synthetic.inject_recipe(run, RECIPE["root jump"], seed=3)
    (fault,) = injection.faults
    cleaned = clean_clip(injection.clip, hold_feet=False)
    pops = [s for s in cleaned.digression_map.spans if s.kind == "pop"]
    assert [(s.joint, s.start, s.end) for s in pops] == [(fault.joint, fault.start, fault.end)]
    apart = np.abs(cleaned.clip.channels[:, :3] - run.channels[:, :3]).max()
    assert apart * run.skeleton.metres_per_unit < 0.01


def test_several_joints_at_once_are_no_cut(run):
    injection = synthetic.inject_recipe(run, RECIPE["several joints 45 to 90"], seed=2)
    mask = detect_faults(injection.clip).mask
    assert all(mask[f.start : f.end, f.joint].mean() > 0.5 for f in injection.faults)


def test_a_pop_by_half_a_turn_jumps_by_half_a_turn(run):
    injection = synthetic.inject_recipe(run, RECIPE["pop by 180"]._replace(frames=(1, 1)), seed=1)
    (fault,) = injection.faults
    texture = local_rotations(injection.clip)
    row = texture.joints.tolist().index(fault.joint)
    sizes = find_jumps(texture).sizes_deg[fault.start - 1 : fault.start + 1, row]
    assert sizes.min() > 170.0


def test_roles(run):
    roles = dict(zip(run.skeleton.names, joint_roles(run), strict=True))
    assert roles["lfemur"] == roles["rtibia"] == "leg"
    assert roles["ltoes"] == "toe"
    assert roles["rhand"] == roles["lthumb"] == "hand"
    assert roles["lhumerus"] == "arm"
    assert roles["thorax"] == "trunk"


def test_a_codec_draws_lines_too(run):
    straight = synthetic.inject_recipe(run, RECIPE["straight line"], seed=1, joints=LIMBS).clip
    decoded = straight.replace(step=f"{CODED} pose")
    assert find_straight_lines(straight, local_rotations(straight))
    assert not find_straight_lines(decoded, local_rotations(decoded))


@pytest.mark.parametrize(("recipe", "least"), [("jitter 20", 0.6), ("yaw drift", 0.5)])
def test_what_has_no_sharp_edges_at_both_ends_is_found(recipe, least):
    clip = synthetic.make_clip("walk", seed=4, duration_s=8, sensor_noise_deg=0.02, phase_noise=0.2)
    injection = synthetic.inject_recipe(clip, RECIPE[recipe], seed=2, joints=LIMBS)
    mask = detect_faults(injection.clip).mask
    (fault,) = injection.faults
    assert mask[fault.start : fault.end, fault.joint].mean() > least


def test_a_sensor_drifts_about_the_vertical_by_as_much_as_is_asked(run):
    injection = synthetic.inject_recipe(
        run, RECIPE["yaw drift"]._replace(size=(30.0, 30.0)), seed=3
    )
    assert [fault.size_deg for fault in injection.faults] == pytest.approx([30.0])


def test_how_far_a_joint_trembles(run):
    jittery = synthetic.inject_recipe(run, RECIPE["jitter 20"], seed=2, joints=LIMBS).clip
    at = JITTER_EVIDENCE.index("size")
    found = find_jitter(local_rotations(jittery))
    assert sum(h.evidence[at] for h in found) == pytest.approx(1.719, abs=1e-3)
