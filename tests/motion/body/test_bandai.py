"""Walks, runs and resting feet of a body under a root that stands still, with positions at joints.

The laps are read by hand from a plot of the feet's heights (see `zoo_names.LAPS`); what feet slide
is put in by the test.
"""

from dataclasses import replace

import numpy as np
import pytest
from made_bodies import along_x, in_units, make_walk, turned_up, under_scene, with_positions
from zoo_names import LAPS, TOO_SHORT

from mocapdb.cleaning import remove_foot_skate
from mocapdb.cycles import extract_cycle
from mocapdb.errors import NoPeriodError
from mocapdb.io.bvh import read_bvh
from mocapdb.motion.clip import Clip
from mocapdb.motion.foot_contacts import find_contacts, find_legs, foot_slide_mm, runs
from mocapdb.motion.kinematics import forward_kinematics

SLIDE_M = 0.05
STANDING = ("bow_normal_001", "wave-both-hands_normal_001", "raise-up-left-hand_feminine_001")


def shifted(clip, joint, slide_m):
    """Return the clip with a joint shifted along x, by metres in each frame."""
    column = list(clip.skeleton.channel_names).index(f"{joint}.tx")
    channels = clip.channels.copy()
    channels[:, column] += slide_m / clip.skeleton.metres_per_unit
    return clip.replace(channels=channels)


def test_laps_are_those_of_the_feet(zoo):
    found = {name: extract_cycle(read_bvh(zoo / "bandai" / f"{name}.bvh")).laps for name in LAPS}
    assert found == {name: pytest.approx(laps, rel=0.06) for name, laps in LAPS.items()}


@pytest.mark.parametrize("name", TOO_SHORT)
def test_a_lap_alone_is_no_cycle(zoo, name):
    with pytest.raises(NoPeriodError, match="Choose a range with two laps"):
        extract_cycle(read_bvh(zoo / "bandai" / f"{name}.bvh"))


@pytest.mark.parametrize("words", STANDING)
def test_a_standing_body_that_slides(zoo, words):
    (path, *_) = sorted((zoo / "bandai").glob(f"*_{words}.bvh"))
    clip = read_bvh(path)
    assert remove_foot_skate(clip).slide_before_mm < 1.0
    ramp = np.linspace(0.0, SLIDE_M, len(clip))
    skate = remove_foot_skate(shifted(clip, "Hips", ramp))
    assert skate.slide_before_mm == pytest.approx(1000 * SLIDE_M / 4, rel=0.2)


def test_feet_of_walks_and_runs_that_slide_while_they_rest(zoo):
    seen = {}
    for name in LAPS:
        clip = read_bvh(zoo / "bandai" / f"{name}.bvh")
        skeleton = clip.skeleton
        positions = forward_kinematics(skeleton, clip.channels).positions
        sliding, away = positions.copy(), []
        for leg, rests in zip(
            find_legs(skeleton, positions),
            find_contacts(skeleton, positions, clip.fps).T,
            strict=True,
        ):
            for rest in runs(rests):
                ramp = np.linspace(0.0, SLIDE_M, len(rest))
                away.append(abs(ramp - ramp.mean()))
                sliding[rest[:, None], [leg.ankle, leg.ball], 0] += (
                    ramp[:, None] / skeleton.metres_per_unit
                )
        contacts = find_contacts(skeleton, sliding, clip.fps)
        seen[name] = foot_slide_mm(skeleton, sliding, contacts) / np.mean(
            1000 * np.concatenate(away)
        )
    assert seen == {name: pytest.approx(1.0, abs=0.2) for name in seen}


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("metres", [0.01, 0.0254])
def test_a_made_body_of_the_same_convention_that_slides(up, metres):
    walk = make_walk(90)
    standing = walk.channels.copy()
    legs = [
        any(part in name for part in ("hip", "knee", "ankle"))
        for name in walk.skeleton.channel_names
    ]
    standing[:, legs] = 0.0
    standing[:, list(walk.skeleton.channel_names).index("hips.ty")] = 0.98
    made = along_x(replace(walk, channels=standing))
    made = made if up == "y" else turned_up(made)
    made = under_scene(with_positions(in_units(made, metres), "places"))
    skeleton = replace(made.skeleton, up=up, metres_per_unit=metres)
    clip = Clip(skeleton, made.channels, 30.0)
    assert remove_foot_skate(clip).slide_before_mm == pytest.approx(0.0, abs=1e-6)
    skate = remove_foot_skate(shifted(clip, "hips", np.linspace(0.0, SLIDE_M, len(clip))))
    assert skate.contacts.all()
    assert skate.slide_before_mm == pytest.approx(1000 * SLIDE_M / 4, rel=0.03)
