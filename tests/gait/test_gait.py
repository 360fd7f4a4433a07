from dataclasses import replace

import made_bodies as made
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic.gait import RUN, WALK
from mocapdb.errors import GaitError
from mocapdb.gait import analyse_gait
from mocapdb.gait.calibration import calibrate
from mocapdb.gait.feet import point_speeds, understand_walker
from mocapdb.gait.foot_events import (
    find_foot_contacts,
    hinge,
    resting_speed,
    usual_resting_speed,
)
from mocapdb.gait.gait_analysis import told_of_refused
from mocapdb.gait.joint_angles import ANGLES, joint_angles
from mocapdb.motion.clip import Clip

DUTY = {"walk": WALK.duty, "run": RUN.duty}
MOST_OFF_MS = 10


def made_gait(kind, **options):
    clip, truth = synthetic.make(kind, seed=3, duration_s=3, **options)
    return clip, truth, analyse_gait(clip)


@pytest.fixture(scope="module")
def walk():
    return made_gait("walk")


@pytest.fixture(scope="module")
def run():
    return made_gait("run")


def misses_ms(gait, truth, kind):
    """How far each true event is from the next one that was found, off the ends of the clip."""
    fps = gait.clip.fps
    frames = np.arange(len(truth.phase))
    for side, contacts in enumerate(gait.contacts):
        cycle = truth.phase / (2 * np.pi) + 0.5 * side
        for what, share in (("strike", 0.0), ("toe_off", DUTY[kind])):
            found = [getattr(c, what) for c in contacts if getattr(c, what) is not None]
            for lap in range(int(np.ceil(cycle[0] - share)), int(cycle[-1] - share) + 1):
                true = np.interp(lap + share, cycle, frames)
                if 0.1 * fps < true < len(frames) - 0.2 * fps:
                    yield min(abs(each - true) for each in found) / fps * 1000


@pytest.mark.parametrize("kind", ["walk", "run"])
@pytest.mark.parametrize("fps", [120.0, 30.0])
@pytest.mark.parametrize("speed", [0.85, 1.2])
def test_events_are_where_they_are(kind, fps, speed):
    _, truth, gait = made_gait(kind, fps=fps, speed=speed)
    misses = list(misses_ms(gait, truth, kind))
    assert len(misses) >= 6
    assert max(misses) < MOST_OFF_MS
    assert np.median(misses) < 6


@pytest.mark.parametrize("kind", ["walk", "run"])
def test_strides_are_as_long_as_they_are(kind, walk, run):
    _, truth, gait = walk if kind == "walk" else run
    found = gait.spreads()
    hips = gait.walker.hips
    cycle = truth.phase / (2 * np.pi)
    laps = int(cycle[-1] - cycle[0])  # whole ones: the body surges within each
    last = np.interp(cycle[0] + laps, cycle, np.arange(len(cycle)))
    end = [np.interp(last, np.arange(len(hips)), hips[:, axis]) for axis in (0, 2)]
    way = np.linalg.norm(end - hips[0][[0, 2]])
    assert found["stride_time_s"].mean == pytest.approx(truth.period_s, rel=0.01)
    assert found["stride_length_m"].mean == pytest.approx(way / laps, rel=0.01)
    assert found["speed_m_s"].mean == pytest.approx(way / laps / truth.period_s, rel=0.01)
    assert found["step_length_m"].mean == pytest.approx(found["stride_length_m"].mean / 2, rel=0.02)
    assert found["stance_pct"].mean == pytest.approx(100 * DUTY[kind], abs=2)
    both = 100 * (2 * DUTY[kind] - 1)
    assert found["double_support_pct"].mean == pytest.approx(max(both, 0), abs=4)
    assert found["flight_pct"].mean == pytest.approx(max(-both, 0), abs=4)
    assert all(abs(index) < 3 for index in gait.asymmetry_pct().values() if np.isfinite(index))


def test_strides_are_the_way_between_contacts_of_a_foot(walk):
    gait = walk[2]
    for side, contacts in zip(("left", "right"), gait.contacts, strict=True):
        for stride in gait.of_side(side):
            ends = [
                next(c for c in contacts if c.strike == at) for at in (stride.start, stride.end)
            ]
            way = np.linalg.norm((ends[1].place - ends[0].place)[[0, 2]])
            assert stride.stride_length_m == pytest.approx(way, abs=0.01)


def test_angles_follow_the_curves_of_a_walk(walk):
    gait = walk[2]
    mean = {key: curve for key, (curve, _) in gait.mean_curves().items()}
    assert {key[1:] for key in mean} == set(ANGLES)
    assert 45 < mean["left", "knee", "flexion"].max() < 70
    assert 60 < mean["left", "knee", "flexion"].argmax() < 80
    assert 30 < np.ptp(mean["left", "hip", "flexion"]) < 55
    assert mean["left", "hip", "flexion"].argmin() == pytest.approx(52, abs=8)
    for joint, angle in ANGLES:
        left, right = mean["left", joint, angle], mean["right", joint, angle]
        assert np.abs(left - right).max() < 12, (joint, angle)
    assert mean["left", "shoulder", "flexion"][:10].mean() < mean["left", "shoulder", "flexion"][50]


def test_who_walks_in_place_walks_on_a_belt(walk):
    clip, truth, there = walk
    channels = clip.channels.copy()
    along = np.linspace(channels[0, 2], channels[-1, 2], len(clip))
    channels[:, 2] -= along - along[0]
    found = analyse_gait(clip.replace(channels=channels))
    assert any("in place" in note for note in found.notes)
    for name in ("stride_length_m", "speed_m_s"):
        assert found.spreads()[name].mean == pytest.approx(there.spreads()[name].mean, rel=0.05)
    assert np.median(list(misses_ms(found, truth, "walk"))) < 20


def test_turning_all_of_it_changes_nothing(walk):
    _, _, found = made_gait("walk", heading_deg=70.0)
    for name, spread in walk[2].spreads().items():
        if name != "turn_deg":
            assert found.spreads()[name].mean == pytest.approx(spread.mean, rel=0.01, abs=0.01)
    mean, same = walk[2].mean_curves(), found.mean_curves()
    for key in mean:
        assert np.abs(mean[key][0] - same[key][0]).max() < 1.0, key


def test_a_hinge_is_found_between_frames():
    time = np.arange(40) / 120
    at = 0.1573
    path = np.zeros((40, 3))
    path[:, 0] = 12.0 * np.maximum(0, at - time) ** 2
    assert hinge(path, 19, 120.0, 2.0, ground_is_after=True) / 120 == pytest.approx(at, abs=0.002)


def test_speeds_are_per_second():
    path = np.outer(np.arange(10.0), [0.0, 0.3, 0.4])
    assert point_speeds(path, 60.0) == pytest.approx(np.full(10, 30.0))


def test_zero_is_said(walk):
    assert walk[2].zero.startswith(("rest pose", "motion"))


def test_a_rest_pose_that_stands_is_zero():
    body = made.make_walk(90)
    walker = understand_walker(Clip(body.skeleton, body.channels, 30.0))
    assert calibrate(walker).zero.startswith("rest pose")
    angles = joint_angles(walker, calibrate(walker))["left"]
    columns = body.skeleton.channel_names.index
    assert angles["knee", "flexion"] == pytest.approx(
        body.channels[:, columns("left_knee.rx")], abs=0.1
    )
    assert angles["hip", "flexion"] == pytest.approx(
        -body.channels[:, columns("left_hip.rx")], abs=0.1
    )


def test_a_rest_pose_that_lies_gives_the_same_knee():
    body = made.make_walk(90)
    clips = [Clip(b.skeleton, b.channels, 30.0) for b in (body, made.along_x(body))]
    walkers = [understand_walker(clip) for clip in clips]
    zeros = [calibrate(walker) for walker in walkers]
    assert zeros[1].zero.startswith("motion")
    there, here = (joint_angles(*pair)["right"] for pair in zip(walkers, zeros, strict=True))
    for joint in ("hip", "knee", "ankle"):
        assert np.ptp(there[joint, "flexion"] - here[joint, "flexion"]) < 2.0


def test_a_bent_knee_reads_as_bent(walk):
    walker = understand_walker(walk[0])
    angles = joint_angles(walker, calibrate(walker))
    hip, knee, ankle = (walker.place(f"right_{part}") for part in ("hip", "knee", "ankle"))
    thigh, shank = hip - knee, knee - ankle
    cosine = np.sum(thigh * shank, axis=1) / np.linalg.norm(thigh, axis=1)
    bend = np.rad2deg(np.arccos(cosine / np.linalg.norm(shank, axis=1)))
    assert angles["right"]["knee", "flexion"] == pytest.approx(bend, abs=1.5)


def test_a_stride_that_is_never_completed(walk):
    with pytest.raises(GaitError, match=r"completes none in 0\.5"):
        analyse_gait(walk[0][:60])


def test_one_frame_is_no_motion(walk):
    with pytest.raises(GaitError, match="has 1 frame"):
        analyse_gait(walk[0][:1])


def test_standing_and_waving_are_no_gait():
    with pytest.raises(GaitError, match="Expected a stride"):
        analyse_gait(synthetic.make_clip("wave", seed=1, duration_s=2))


def test_a_body_without_legs(walk):
    skeleton = walk[0].skeleton
    kept = ["root", "lowerback", "upperback", "thorax"]
    joints = [skeleton.joint(name) for name in kept]
    stump = replace(
        skeleton,
        names=[skeleton.names[joint] for joint in joints],
        parents=np.array([-1, 0, 1, 2]),
        offsets=skeleton.offsets[joints],
        dofs=[skeleton.dofs[joint] for joint in joints],
        rotation_orders=[skeleton.rotation_orders[joint] for joint in joints],
        axis_deg=skeleton.axis_deg[joints],
    )
    with pytest.raises(GaitError, match="two legs and feet"):
        analyse_gait(Clip(stump, np.zeros((30, stump.n_channels)), 30.0))


def test_contacts_are_of_both_feet(walk):
    left, right = find_foot_contacts(understand_walker(walk[0]))
    assert abs(len(left) - len(right)) <= 1


def smoothed_gait(kind, smoothing_s):
    clip = synthetic.make_clip(kind, seed=4, fps=60.0, duration_s=3, speed=0.9)
    smooth = gaussian_filter1d(clip.channels, smoothing_s * clip.fps, axis=0)
    return analyse_gait(clip.replace(channels=smooth))


def test_a_smoothed_run_is_on_the_ground_while_its_hips_do_not_fall():
    assert smoothed_gait("run", 0.046).spreads()["stance_pct"].mean == pytest.approx(36, abs=7)


def test_a_sharp_clip_is_left_as_it_is(walk, run):
    for _, _, gait in (walk, run):
        assert resting_speed(gait.walker) < 1.05 * usual_resting_speed(gait.walker)


def test_a_walk_is_never_held_against_its_fall():
    # as fast as people walk, with more flight than the hips fall: no switch that a millimetre turns
    gait = smoothed_gait("walk", 0.06)
    assert resting_speed(gait.walker) == usual_resting_speed(gait.walker)


def test_a_little_noise_moves_events_a_little():
    clip = synthetic.make_clip("run", seed=4, fps=60.0, duration_s=3, speed=0.9)
    smooth = gaussian_filter1d(clip.channels, 0.046 * 60.0, axis=0)
    noise = np.random.default_rng(1).normal(0.0, 0.02, smooth.shape)
    noise[:, :3] = 0.0
    one, other = (
        analyse_gait(clip.replace(channels=channels)) for channels in (smooth, smooth + noise)
    )
    assert resting_speed(other.walker) == pytest.approx(resting_speed(one.walker), rel=0.08)
    for before, after in zip(one.contacts, other.contacts, strict=True):
        assert len(before) == len(after)
        for a, b in zip(before[1:-1], after[1:-1], strict=True):
            assert abs(a.strike - b.strike) < 1.0  # a frame
            assert abs(a.toe_off - b.toe_off) < 1.0


# -- what is left out, and what is told ------------------------------------------------------------


def test_held_ends_are_left_out(walk):
    clip, _, there = walk
    counts = np.ones(len(clip), dtype=int)
    counts[[0, -1]] = 101, 91
    held = np.repeat(clip.channels, counts, axis=0)
    found = analyse_gait(clip.replace(channels=held))
    assert any(f"frames 100:{100 + len(clip)} are live" in note for note in found.notes)
    assert len(found.strides) == len(there.strides)
    for one, other in zip(there.strides, found.strides, strict=True):
        assert other.start - 100 == pytest.approx(one.start, abs=1e-6)
        assert other.toe_off - 100 == pytest.approx(one.toe_off, abs=1e-6)
        assert other.stride_length_m == pytest.approx(one.stride_length_m, abs=1e-6)
    assert found.mean_curves()["left", "hip", "flexion"][0] == pytest.approx(
        there.mean_curves()["left", "hip", "flexion"][0], abs=1e-6
    )


def test_shares_do_not_depend_on_the_rate(walk):
    clip, _, there = walk
    for times in (2, 4):
        fewer = clip.replace(channels=clip.channels[::times], fps=clip.fps / times)
        found = analyse_gait(fewer).spreads()
        for name in ("stance_pct", "double_support_pct"):
            assert found[name].mean == pytest.approx(there.spreads()[name].mean, abs=0.6)


def test_refused_strides_are_told_in_a_few_lines():
    few = [f"left stride at {number} s is none" for number in range(3)]
    assert told_of_refused(3, few) == few
    told = told_of_refused(3, few * 4)
    assert "most strides are refused, 12 of 15" in told[0]
    assert told[-1] == "9 more strides are none"
    assert len(told) == 5


def test_a_stance_that_gravity_does_not_allow_is_noted(walk, run):
    told = [
        any("stance may be too short" in note for note in found.notes)
        for found in (smoothed_gait("run", 0.06), walk[2], run[2])
    ]
    assert told == [True, False, False]
