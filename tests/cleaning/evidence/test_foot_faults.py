"""Feet that slide where they stand, or go through the floor: found, and held again."""

from __future__ import annotations

import numpy as np
import pytest

from mocapdb.cleaning import detect_faults, repair_spans
from mocapdb.cleaning.evidence import foot_faults
from mocapdb.cleaning.evidence.foot_faults import find_foot_faults, foot_paths
from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic.fault_kit import RECIPES, inject_recipe
from mocapdb.io.conventions import to_bvh_convention
from mocapdb.motion.frame_range import FrameRange

BY_NAME = {recipe.name: recipe for recipe in RECIPES}
NAMES = {"slide": "foot slide", "sink": "foot through the floor"}


def walk(convention="acclaim"):
    clip = synthetic.make_clip("walk", seed=2, duration_s=5)
    return to_bvh_convention(clip) if convention == "bvh" else clip


def faulty(kind, size_m=0.09, convention="acclaim", seed=3):
    recipe = BY_NAME[NAMES[kind]]._replace(size=(size_m, size_m), length_s=(0.4, 0.4))
    return inject_recipe(walk(convention), recipe, seed=seed)


@pytest.mark.parametrize("convention", ["acclaim", "bvh"])
@pytest.mark.parametrize("kind", ["slide", "sink"])
def test_a_foot_that_is_drawn_from_where_it_stands_is_found_and_held(kind, convention):
    injection = faulty(kind, convention=convention)
    (fault,) = injection.faults
    found = detect_faults(injection.clip, similarity=False)
    (span,) = [span for span in found.spans if span.kind == kind]
    assert span.joint == fault.joint
    assert span.overlap(FrameRange(fault.start, fault.end)) > 0.7 * (fault.end - fault.start)
    assert found.scores[span.frames, span.joint].min() >= found.threshold
    repaired, repairs = repair_spans(injection.clip, found, [span])
    assert repairs[0].method == "held"
    assert repairs[0].contact_mm < 5.0
    assert apart_mm(repaired, fault) < 0.3 * apart_mm(injection.clip, fault)
    changed = np.flatnonzero((repaired.channels != injection.clip.channels).any(axis=1))
    assert span.start <= changed[0] and changed[-1] < span.end
    again = detect_faults(repaired, similarity=False)
    assert not [span for span in again.spans if span.kind in NAMES]


@pytest.mark.parametrize("convention", ["acclaim", "bvh"])
def test_a_body_that_sinks_is_lifted(convention):
    right = synthetic.make_clip("walk", seed=2, duration_s=12)
    right = to_bvh_convention(right) if convention == "bvh" else right
    skeleton = right.skeleton
    column = int(skeleton.channel_starts[0]) + skeleton.dofs[0].index(
        "t" + "xyz"[skeleton.up_index]
    )
    channels = right.channels.copy()
    eased = np.minimum(1.0, np.minimum(np.arange(72), 71 - np.arange(72)) / 20)
    channels[400:472, column] -= 0.15 / skeleton.metres_per_unit * eased
    sunk = right.replace(channels=channels)
    found = detect_faults(sunk, similarity=False)
    (span,) = [span for span in found.spans if span.kind == "sink"]
    assert span.joint == 0
    repaired, (repair,) = repair_spans(sunk, found, [span])
    assert repair.method == "held"
    same = np.delete(repaired.channels == channels, column, axis=1)
    assert same.all()
    off_m = np.abs(repaired.channels - right.channels)[400:472, column] * skeleton.metres_per_unit
    assert off_m.mean() < 0.03


def apart_mm(clip, fault):
    """How far the foot is from where it was captured, on average over a fault."""
    convention = "acclaim" if clip.skeleton.convention == "acclaim" else "bvh"
    legs, before = foot_paths(walk(convention))
    i = [leg.foot for leg in legs].index(fault.joint)
    here = slice(fault.start, fault.end)
    apart = foot_paths(clip)[1][i][here, 0] - before[i][here, 0]
    return 1000.0 * np.linalg.norm(apart, axis=1).mean()


@pytest.mark.parametrize("motion", ["walk", "run", "hop", "box", "squat"])
def test_feet_of_untouched_clips_are_left_alone(motion):
    clip = synthetic.make_clip(motion, seed=3, duration_s=4, sensor_noise_deg=0.2)
    assert not [fault for fault in find_foot_faults(clip) if fault.confidence > 0.5]


def test_the_further_the_surer():
    sizes = (0.025, 0.05, 0.1)
    sure = [
        max((f.confidence for f in find_foot_faults(faulty("slide", size).clip)), default=0.0)
        for size in sizes
    ]
    assert sure == sorted(sure)
    assert sure[0] < 0.5
    assert sure[1] > 0.8


def test_a_foot_whose_leg_is_flagged_is_not_named_too():
    injection = faulty("sink")
    (fault,) = injection.faults
    hip = find_foot_faults(injection.clip)[0].leg.upper
    clip = injection.clip
    whole = clip.channels.copy()
    columns = clip.skeleton.rotation_columns(hip)
    whole[fault.start : fault.end, columns[0]] += 60.0
    found = detect_faults(clip.replace(channels=whole), similarity=False)
    assert any(span.joint == hip for span in found.spans)
    assert not [span for span in found.spans if span.kind in NAMES and span.joint == fault.joint]


def test_a_clip_of_a_moment_has_no_foot_faults():
    assert find_foot_faults(walk()[:3]) == []


FIGURES = {
    ("sink", 2, 1, 0.025): [("sink", 418, 476, 0.023, 0.635)],
    ("sink", 3, 1, 0.04): [("sink", 409, 468, 0.0329, 0.879)],
    ("sink", 5, 4, 0.09): [("sink", 75, 87, 0.0586, 0.987)],
    ("slide", 2, 4, 0.09): [],
    ("slide", 3, 1, 0.05): [("slide", 416, 464, 0.0468, 0.855)],
    ("slide", 3, 2, 0.035): [("slide", 208, 232, 0.0312, 0.538)],
}


@pytest.mark.parametrize(("kind", "seed", "step", "size_m"), list(FIGURES))
def test_figures(kind, seed, step, size_m):
    """What is found of feet that are drawn away, to the frame: no constant changes unnoticed."""
    clip = faulty(kind, size_m, seed=seed).clip
    clip = clip.replace(channels=clip.channels[::step], fps=clip.fps / step)
    found = [
        (f.kind, f.start, f.end, round(f.size_m, 4), round(f.confidence, 3))
        for f in find_foot_faults(clip)
        if f.confidence > 0.01
    ]
    assert found == FIGURES[kind, seed, step, size_m]


FPS = 120.0


def path_of(*legs_m_s, height_m=0.0, lift_m=0.0):
    """The path of a flat foot that stands, goes by (metres, seconds) after each other, and stands.

    Ways of 0 m are pauses. `height_m` is that of the stance over the lowest place, where the foot
    is at first; `lift_m` that of the pauses over the stance.
    """
    parts, heights, at = [np.zeros(60), np.zeros(60)], [np.zeros(60), np.full(60, height_m)], 0.0
    for way, seconds in legs_m_s:
        n = round(seconds * FPS)
        ramp = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, n + 1) / n)
        parts.append(at + way * ramp)
        heights.append(np.full(n, height_m + (0.0 if way else lift_m)))
        at += way
    parts.append(np.full(60, at))
    heights.append(np.full(60, height_m))
    path = np.zeros((sum(map(len, parts)), 2, 3))
    path[:, :, 0] = np.concatenate(parts)[:, None]
    path[:, :, 2] = np.concatenate(heights)[:, None] + np.array([0.0, 0.05])
    return path


def slides(*legs_m_s, **places):
    foot = foot_faults._foot(path_of(*legs_m_s, **places), FPS)
    return [size for _, size in foot_faults._slides(foot, FPS)]


@pytest.mark.parametrize(
    ("inside", "outside"),
    [
        ([(0.08, 0.2), (0, 0.9), (-0.08, 0.2)], [(0.08, 0.2), (0, 1.3), (-0.08, 0.2)]),
        ([(0.08, 0.2), (0, 0.2), (-0.056, 0.2)], [(0.08, 0.2), (0, 0.2), (-0.04, 0.2)]),
        ([(0.06, 0.3), (0, 0.2), (-0.06, 0.3)], [(0.06, 0.44), (0, 0.2), (-0.06, 0.44)]),
        ([(0.16, 0.14), (0, 0.2), (-0.16, 0.14)], [(0.16, 0.1), (0, 0.2), (-0.16, 0.1)]),
        ([(0.05, 0.065), (-0.05, 0.065)], [(0.05, 0.045), (-0.05, 0.045)]),
        (
            [(0.07, 0.2), (0, 0.1), (0.03, 0.1), (0, 0.1), (-0.1, 0.3)],
            [(0.05, 0.2), (0, 0.1), (0.05, 0.1), (0, 0.1), (-0.1, 0.3)],
        ),
    ],
    ids=["up to 1.5 s", "back to half", "at 0.25 m/s", "under 2 m/s", "for 0.15 s", "in one go"],
)
def test_which_slides_count(inside, outside):
    (size,) = slides(*inside)
    assert 0.03 < size < 0.17
    assert not slides(*outside)


def test_a_foot_that_is_lifted_or_stands_on_something_does_not_slide():
    aside = (0.08, 0.2), (0, 0.2), (-0.08, 0.2)
    assert slides(*aside, lift_m=0.024)
    assert not slides(*aside, lift_m=0.038)
    assert slides(*aside, height_m=0.085)
    assert not slides(*aside, height_m=0.12)


@pytest.mark.parametrize(
    ("speed_m_s", "frames", "lower_ground"),
    [(0.2, 12, False), (0.3, 12, True), (0.6, 5, False), (0.6, 7, True)],
)
def test_a_foot_that_lands_low_and_leaves_from_there_does_not_sink(speed_m_s, frames, lower_ground):
    """Swinging over most of 0.1 s, at either side: 12 frames."""
    path = path_of()
    foot = foot_faults._foot(path, FPS)
    level = np.zeros((len(path), 2, 2))
    low = FrameRange(50, 80)
    for start in (low.start - frames, low.end):
        level[start : start + frames, :, 0] = speed_m_s
    swinging = foot._replace(level=level)
    assert foot_faults._lands_and_leaves(swinging, low, FPS) == lower_ground
    level[: low.start] = 0.0
    assert not foot_faults._lands_and_leaves(swinging, low, FPS)
