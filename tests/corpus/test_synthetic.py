"""The synthetic corpus: what it says about its clips is true."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocapdb.corpus import synthetic
from mocapdb.corpus.synthetic import CLASSES, SEQUENCE
from mocapdb.errors import ClipError, CorpusError, SkeletonError
from mocapdb.io import read_clip
from mocapdb.motion.clip import Clip
from mocapdb.motion.kinematics import forward_kinematics, to_metres
from mocapdb.motion.skeleton import Skeleton

KINDS = (*CLASSES, SEQUENCE)
FEET = ("lfoot", "rfoot")  # the joints at the balls of the feet
GAITS = ("walk", "run")


def positions_m(clip: Clip) -> np.ndarray:
    return to_metres(clip.skeleton, forward_kinematics(clip.skeleton, clip.channels).positions)


def joints(clip: Clip, *names: str) -> list[int]:
    return [clip.skeleton.joint(name) for name in names]


def channel(clip: Clip, name: str) -> np.ndarray:
    return clip.channels[:, clip.skeleton.channel_names.index(name)]


def best_lag(values: np.ndarray, longest: int) -> float:
    """The lag, to a fraction of a frame, at which values differ least from themselves."""
    lags = np.arange(longest // 3, longest)
    costs = np.array([np.mean((values[lag:] - values[:-lag]) ** 2) for lag in lags])
    k = int(np.clip(costs.argmin(), 1, len(lags) - 2))
    a, b, c = costs[k - 1 : k + 2]
    return float(lags[k] + 0.5 * (a - c) / (a - 2 * b + c))


def rotation_angle_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """By the chord, which keeps its digits where the angle is small."""
    chord = np.linalg.norm(a - b, axis=(1, 2)) / np.sqrt(8)
    return np.rad2deg(2 * np.arcsin(np.clip(chord, 0, 1)))


def bvh_clip(n_frames: int = 200) -> Clip:
    """A body with other names, orders and counts, End Sites, and a joint that moves."""
    skeleton = Skeleton(
        ["Hips", "Spine", "Head", "Head_end", "Arm", "Hand", "Hand_end"],
        [-1, 0, 1, 2, 1, 4, 5],
        np.array([(0, 0, 0), (0, 9, 0), (0, 5, 0), (0, 2, 0), (3, 4, 0), (5, 0, 0), (2, 0, 0)]),
        [
            ("tx", "ty", "tz", "rz", "rx", "ry"),
            ("rz", "ry", "rx"),
            ("ry", "rx", "rz"),
            (),
            ("tx", "ty", "tz", "rx", "ry", "rz"),
            ("rz", "rx"),
            (),
        ],
        ["ZXY", "ZYX", "YXZ", "", "XYZ", "ZX", ""],
        convention="bvh",
    )
    rng = np.random.default_rng(0)
    time = np.arange(n_frames)[:, None] / 30
    rates, shifts, sizes = rng.uniform([[1], [0], [5]], [[6], [6], [50]], (3, skeleton.n_channels))
    return Clip(skeleton, sizes * np.sin(rates * time + shifts), 30.0, name="other")


# -- bodies ------------------------------------------------------------------------------------


def test_skeleton_has_the_cmu_topology() -> None:
    skeleton = synthetic.make_skeleton()
    assert (skeleton.n_joints, skeleton.n_channels) == (31, 62)
    assert skeleton.convention == "acclaim"
    assert skeleton.names[:6] == ("root", "lhipjoint", "lfemur", "ltibia", "lfoot", "ltoes")
    counts = {joint: len(skeleton.dofs[skeleton.joint(joint)]) for joint in skeleton.names}
    assert counts["root"] == 6
    assert counts["lfemur"] == 3
    assert counts["ltibia"] == 1
    assert counts["lclavicle"] == 2
    assert counts["lhipjoint"] == 0


@given(
    height_m=st.floats(1.2, 2.2),
    leg=st.floats(0.85, 1.15),
    arm=st.floats(0.85, 1.15),
    shoulder=st.floats(0.85, 1.15),
)
@settings(max_examples=15, deadline=None)
def test_height_is_the_stature(height_m: float, leg: float, arm: float, shoulder: float) -> None:
    skeleton = synthetic.make_skeleton(height_m, leg=leg, arm=arm, shoulder=shoulder)
    assert skeleton.height * skeleton.metres_per_unit == pytest.approx(height_m, rel=1e-12)


def test_body_is_symmetric() -> None:
    skeleton = synthetic.subject(3)
    for joint in ("femur", "foot", "humerus", "thumb"):
        left, right = (skeleton.offsets[skeleton.joint(side + joint)] for side in "lr")
        np.testing.assert_allclose(left * [-1, 1, 1], right, atol=1e-12)


def test_average_body_stands_as_high_as_it_measures() -> None:
    clip = synthetic.make_clip("wave", seed=0, skeleton=synthetic.make_skeleton(1.8))
    head = positions_m(clip)[:, clip.skeleton.joint("head"), 1]
    assert head.mean() == pytest.approx(1.8, abs=0.02)


def test_subjects_differ_and_are_repeatable() -> None:
    bodies = [synthetic.subject(seed) for seed in range(6)]
    assert len({body.digest for body in bodies}) == 6
    assert synthetic.subject(4) == bodies[4]
    ratios = bodies[0].bone_lengths / bodies[1].bone_lengths
    assert np.ptp(ratios) > 0.01  # other proportions, not only another size
    heights_m = [body.height * body.metres_per_unit for body in bodies]
    assert all(1.4 < height < 2.05 for height in heights_m)


@pytest.mark.parametrize("bad", [{"height_m": 0.0}, {"leg": -1.0}, {"arm": np.nan}])
def test_impossible_bodies_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(SkeletonError, match="positive"):
        synthetic.make_skeleton(**bad)


# -- clips -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_same_seed_same_bytes(kind: str) -> None:
    options = {"sensor_noise_deg": 0.2, "phase_noise": 0.1, "period_jitter": 0.03}
    first = synthetic.make_clip(kind, seed=5, **options)
    again = synthetic.make_clip(kind, seed=5, **options)
    other = synthetic.make_clip(kind, seed=6, **options)
    assert first.channels.tobytes() == again.channels.tobytes()
    assert first.channels.shape != other.channels.shape or not np.array_equal(
        first.channels, other.channels
    )


def test_make_clip_is_the_clip_of_make() -> None:
    clip, _ = synthetic.make("box", seed=2, speed=1.2, name="punch")
    assert clip == synthetic.make_clip("box", seed=2, speed=1.2, name="punch")
    assert clip.name == "punch"


@pytest.mark.parametrize("kind", KINDS)
def test_labels(kind: str) -> None:
    clip, truth = synthetic.make(kind, seed=1)
    assert clip.label == truth.label == kind
    assert clip.name == f"{kind}_1"
    assert len(truth.phase) == len(truth.contacts) == len(clip)


def test_lengths() -> None:
    assert len(synthetic.make_clip("walk", seed=1)) == 600
    assert len(synthetic.make_clip("run", seed=1, duration_s=2.0, fps=60.0)) == 120
    clip, truth = synthetic.make("hop", seed=1, n_cycles=4)
    assert len(clip) == round(4 * truth.period_frames)
    assert len(synthetic.make_clip("walk", seed=1, duration_s=1 / 120)) == 1
    assert len(synthetic.make_clip(SEQUENCE, seed=1, duration_s=7.0)) == 840


@pytest.mark.parametrize("kind", CLASSES)
@pytest.mark.parametrize("speed", [0.8, 1.0, 1.3])
def test_period_is_the_autocorrelation_of_the_angles(kind: str, speed: float) -> None:
    clip, truth = synthetic.make(kind, seed=7, n_cycles=4, speed=speed)
    angles = clip.channels[:, clip.skeleton.rotation_channels]
    longest = round(1.5 * truth.period_frames)
    assert best_lag(angles, longest) == pytest.approx(truth.period_frames, abs=1.0)


@given(seed=st.integers(0, 2**31), kind=st.sampled_from(CLASSES))
@settings(max_examples=12, deadline=None)
def test_pose_is_a_function_of_phase(seed: int, kind: str) -> None:
    """Interpolating by phase, a wandering clip predicts a steady one."""
    skeleton = synthetic.subject(seed)
    steady, truth = synthetic.make(kind, seed=seed, skeleton=skeleton, n_cycles=2)
    uneven, uneven_truth = synthetic.make(
        kind, seed=seed, skeleton=skeleton, n_cycles=4, phase_noise=0.2, period_jitter=0.05
    )
    assert np.all(np.diff(uneven_truth.phase) > 0)
    turns = np.round((uneven_truth.phase.mean() - truth.phase.mean()) / (2 * np.pi))
    phase = truth.phase + 2 * np.pi * turns
    inside = (phase > uneven_truth.phase[0]) & (phase < uneven_truth.phase[-1])
    assert inside.any()
    for column in steady.skeleton.rotation_channels:
        predicted = np.interp(phase, uneven_truth.phase, uneven.channels[:, column])
        error = np.abs(predicted - steady.channels[:, column])[inside]
        assert np.quantile(error, 0.95) < 0.5, steady.skeleton.channel_names[column]
        assert error.max() < 4.0, steady.skeleton.channel_names[column]


def test_phase_advances_by_one_turn_a_period() -> None:
    _, truth = synthetic.make("walk", seed=3)
    steps = np.diff(truth.phase)
    np.testing.assert_allclose(steps, 2 * np.pi / truth.period_frames)


@pytest.mark.parametrize("kind", GAITS)
def test_left_foot_lands_at_whole_turns(kind: str) -> None:
    _, truth = synthetic.make(kind, seed=3)
    left = truth.contacts[:, 0]
    landings = np.flatnonzero(left[1:] & ~left[:-1]) + 1
    assert len(landings) >= 3
    turns = truth.phase[landings] / (2 * np.pi)
    assert np.all((turns % 1.0) * truth.period_frames < 1.0 + 1e-9)


def test_tempo_drift_is_the_change_of_tempo() -> None:
    _, truth = synthetic.make("walk", seed=3, tempo_drift=0.4)
    rate = np.diff(truth.phase)
    assert (rate[-1] - rate[0]) / rate.mean() == pytest.approx(0.4, abs=0.01)
    assert truth.period_s == pytest.approx(synthetic.make("walk", seed=3)[1].period_s, rel=0.01)


def test_period_jitter_makes_cycles_unequal() -> None:
    _, truth = synthetic.make("run", seed=3, n_cycles=60, period_jitter=0.05)
    whole = np.arange(np.ceil(truth.phase[0] / (2 * np.pi)), truth.phase[-1] // (2 * np.pi))
    landings = np.interp(2 * np.pi * whole, truth.phase, np.arange(len(truth.phase)))
    lengths = np.diff(landings)
    assert 0.02 < lengths.std() / lengths.mean() < 0.08


def test_sensor_noise_is_white_and_known() -> None:
    clip, truth = synthetic.make("squat", seed=3, sensor_noise_deg=0.5)
    noise = clip.channels - truth.clean.channels
    angles = clip.skeleton.rotation_channels
    assert noise[:, angles].std() == pytest.approx(0.5, rel=0.02)
    assert not np.delete(noise, angles, axis=1).any()
    assert truth.clean == synthetic.make_clip("squat", seed=3)


def test_heading_turns_the_whole_motion() -> None:
    straight = synthetic.make_clip("walk", seed=3)
    turned = synthetic.make_clip("walk", seed=3, heading_deg=120.0)
    before, after = positions_m(straight), positions_m(turned)
    angle = np.deg2rad(120.0)
    turn = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    np.testing.assert_allclose(after, before @ turn.T, atol=1e-9)
    assert np.abs(np.diff(turned.channels, axis=0)).max() < 20.0  # no jumps between Euler forms


@pytest.mark.parametrize(
    "bad",
    [
        {"kind": "swim"},
        {"duration_s": 0.0},
        {"duration_s": np.inf},
        {"n_cycles": -1},
        {"n_cycles": 2, "duration_s": 2.0},
        {"fps": 0.0},
        {"speed": -1.0},
        {"speed": np.nan},
        {"phase_noise": 30.0},
        {"tempo_drift": 3.0},
        {"kind": SEQUENCE, "n_cycles": 3},
    ],
)
def test_impossible_clips_are_refused(bad: dict[str, object]) -> None:
    options = {"kind": "walk", "seed": 1, **bad}
    with pytest.raises(ClipError, match="Expected"):
        synthetic.make_clip(**options)  # type: ignore[arg-type]


def test_other_skeletons_are_refused() -> None:
    with pytest.raises(SkeletonError, match="lfemur"):
        synthetic.make_clip("walk", seed=1, skeleton=bvh_clip().skeleton)


# -- what it looks like ------------------------------------------------------------------------


@given(seed=st.integers(0, 2**31), kind=st.sampled_from(KINDS), speed=st.floats(0.5, 2.0))
@settings(max_examples=20, deadline=None)
def test_feet_stay_on_the_ground_and_above_it(seed: int, kind: str, speed: float) -> None:
    clip, truth = synthetic.make(kind, seed=seed, skeleton=synthetic.subject(seed), speed=speed)
    positions = positions_m(clip)
    assert positions[:, :, 1].min() > -0.01
    balls = positions[:, joints(clip, *FEET)]
    lowest = positions[:, joints(clip, *FEET, "ltoes", "rtoes"), 1].reshape(-1, 2, 2).min(axis=1)
    assert lowest[truth.contacts].max() < 0.09  # a foot that touches with its heel
    assert balls[:, :, 1][~truth.contacts].max(initial=0.0) < 0.6
    if kind in ("box", "wave", "squat"):
        assert truth.contacts.all()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", CLASSES)
def test_stance_feet_hardly_slide(kind: str, seed: int) -> None:
    clip, truth = synthetic.make(kind, seed=seed, skeleton=synthetic.subject(seed))
    balls = positions_m(clip)[:, joints(clip, *FEET)]
    # while it rolls over the heel or the tip of the toes, the ball of a foot moves as it should
    resting = truth.contacts & (balls[:, :, 1] < 0.002)
    both = resting[1:] & resting[:-1]
    speed = np.linalg.norm(np.diff(balls, axis=0), axis=2)[both] * clip.fps
    assert both.mean() > 0.2
    assert speed.mean() < 0.02
    assert np.median(speed) < 1e-6


@pytest.mark.parametrize(("kind", "low", "high"), [("walk", 1.0, 1.5), ("run", 2.2, 3.5)])
def test_gaits_go_forward_facing_where_they_go(kind: str, low: float, high: float) -> None:
    clip = synthetic.make_clip(kind, seed=2)
    positions = positions_m(clip)
    way = positions[-1, 0] - positions[0, 0]
    assert low < way[2] / clip.duration_s < high
    assert abs(way[0]) < 0.1
    foot = positions[:, joints(clip, "ltoes")[0]] - positions[:, joints(clip, "lfoot")[0]]
    assert foot[:, 2].mean() > 0  # toes before the ball
    left, right = (positions[:, joints(clip, side + "hipjoint")[0], 0] for side in "lr")
    assert np.all(left > right)


def test_speed_makes_longer_and_quicker_strides() -> None:
    slow, fast = (synthetic.make("walk", seed=2, speed=speed) for speed in (0.8, 1.4))
    ways = [np.ptp(channel(clip, "root.tz")) / clip.duration_s for clip, _ in (slow, fast)]
    assert ways[1] / ways[0] == pytest.approx(1.4 / 0.8, rel=0.03)
    periods = [truth.period_s for _, truth in (slow, fast)]
    assert periods[0] / periods[1] == pytest.approx(np.sqrt(1.4 / 0.8), rel=1e-6)


def test_walk_has_double_support_and_run_has_flight() -> None:
    walk, run = (synthetic.make(kind, seed=2)[1].contacts.sum(axis=1) for kind in GAITS)
    assert set(np.unique(walk)) == {1, 2}
    assert set(np.unique(run)) == {0, 1}


@pytest.mark.parametrize("kind", ["run", "hop"])
def test_flight_is_ballistic(kind: str) -> None:
    clip, truth = synthetic.make(kind, seed=2)
    height_m = positions_m(clip)[:, 0, 1]
    acceleration = np.diff(height_m, 2) * clip.fps**2
    in_air = ~truth.contacts.any(axis=1)
    inside = in_air[:-2] & in_air[1:-1] & in_air[2:]
    assert inside.sum() > 20
    np.testing.assert_allclose(acceleration[inside], -9.81, rtol=1e-3)


def test_knees_and_elbows_bend_the_right_way() -> None:
    for kind in CLASSES:
        clip = synthetic.make_clip(kind, seed=4)
        for side in "lr":
            assert channel(clip, f"{side}tibia.rx").min() > 0
            assert channel(clip, f"{side}tibia.rx").max() < 150
            assert channel(clip, f"{side}radius.rx").min() > -1


def test_knee_lies_before_the_line_from_hip_to_ankle() -> None:
    clip = synthetic.make_clip("squat", seed=4)
    hip, knee, ankle = np.moveaxis(
        positions_m(clip)[:, joints(clip, "lhipjoint", "lfemur", "ltibia")], 1, 0
    )
    assert np.all(knee[:, 2] > ((hip + ankle) / 2)[:, 2])


@pytest.mark.parametrize(("kind", "limits"), [("walk", (5, 8, 6)), ("run", (11, 9, 10))])
def test_leg_follows_the_normative_curves(kind: str, limits: tuple[float, ...]) -> None:
    from mocapdb.corpus.synthetic.motions import MOTIONS

    gait = MOTIONS[kind].gait
    assert gait is not None
    clip, truth = synthetic.make(kind, seed=2, n_cycles=2)
    cycle = truth.phase / (2 * np.pi)
    solved = (
        (-channel(clip, "lfemur.rx"), gait.hip),
        (channel(clip, "ltibia.rx"), gait.knee),
        (-channel(clip, "lfoot.rx"), gait.ankle),
    )
    for (angle, curve), limit in zip(solved, limits, strict=True):
        assert np.sqrt(np.mean((angle - curve(cycle)) ** 2)) < limit


def test_arms_swing_against_the_legs() -> None:
    clip = synthetic.make_clip("walk", seed=4)
    hip = -channel(clip, "lfemur.rx")
    assert np.corrcoef(hip, channel(clip, "lhumerus.rx"))[0, 1] < -0.7
    assert np.corrcoef(hip, channel(clip, "rhumerus.rx"))[0, 1] > 0.7


def test_only_the_right_hand_waves_and_above_the_shoulder() -> None:
    clip = synthetic.make_clip("wave", seed=4)
    left, right, shoulder = np.moveaxis(
        positions_m(clip)[:, joints(clip, "lhand", "rhand", "rclavicle")], 1, 0
    )
    assert np.all(right[:, 1] > shoulder[:, 1])
    assert np.ptp(right[:, 0]) > 0.15
    assert np.ptp(left, axis=0).max() < 0.05


def test_jabs_alternate() -> None:
    clip, truth = synthetic.make("box", seed=4, n_cycles=3)
    left, right = np.moveaxis(positions_m(clip)[:, joints(clip, "lhand", "rhand")], 1, 0)
    cycle = (truth.phase / (2 * np.pi)) % 1.0
    assert cycle[left[:, 2].argmax()] == pytest.approx(0.25, abs=0.06)
    assert cycle[right[:, 2].argmax()] == pytest.approx(0.75, abs=0.06)


@given(seed=st.integers(0, 2**31), kind=st.sampled_from(KINDS))
@settings(max_examples=15, deadline=None)
def test_motion_is_smooth(seed: int, kind: str) -> None:
    clip = synthetic.make_clip(kind, seed=seed)
    body = [
        i
        for i, name in enumerate(clip.skeleton.channel_names)
        if name[1:].split(".")[0] not in ("toes", "foot")
    ]
    assert np.abs(np.diff(clip.channels[:, body], axis=0)).max() < 12.0
    assert np.abs(np.diff(clip.channels, axis=0)).max() < 30.0


# -- sequences ---------------------------------------------------------------------------------


@given(seed=st.integers(0, 2**31))
@settings(max_examples=8, deadline=None)
def test_sequence_segments_tile_the_clip(seed: int) -> None:
    clip, truth = synthetic.make(SEQUENCE, seed=seed)
    labels, starts, ends = zip(*((s.label, s.start, s.end) for s in truth.segments), strict=True)
    assert len(set(labels)) == len(labels) >= 3
    assert set(labels) <= set(CLASSES)
    assert starts[0] == 0
    assert ends[-1] == len(clip)
    assert starts[1:] == ends[:-1]
    assert np.isnan(truth.period_s)


def test_sequence_does_what_it_says() -> None:
    """Away from the transitions, a segment repeats with its own phase."""
    clip, truth = synthetic.make(SEQUENCE, seed=11)
    angles = clip.channels[:, clip.skeleton.rotation_channels]
    for segment in truth.segments:
        start, end = segment.start, segment.end
        inner = slice(start + 36, end - 36)
        phase, values = truth.phase[inner], angles[inner]
        later = np.interp(phase + 2 * np.pi, phase, np.arange(len(phase)), right=np.nan)
        repeats = np.flatnonzero(np.isfinite(later))
        if len(repeats) < 5:
            continue
        distance = values[np.rint(later[repeats]).astype(int)] - values[repeats]
        assert np.abs(distance).mean() < 0.6


def test_short_sequence() -> None:
    clip, truth = synthetic.make(SEQUENCE, seed=1, duration_s=3 / 120)
    assert len(clip) == 3
    assert [len(segment) for segment in truth.segments] == [1, 1, 1]


# -- warping -----------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.7, 2.0])
def test_warp_by_a_factor(factor: float) -> None:
    clip, truth = synthetic.make("walk", seed=1)
    warped, frames = synthetic.warp(clip, factor)
    assert len(warped) == len(frames) == int((len(clip) - 1) / factor) + 1
    assert frames[1] - frames[0] == pytest.approx(factor)
    whole = frames == np.rint(frames)
    np.testing.assert_array_equal(warped.channels[whole], clip.channels[frames[whole].astype(int)])
    angles = warped.channels[:, warped.skeleton.rotation_channels]
    period = truth.period_frames / factor
    assert best_lag(angles, round(1.5 * period)) == pytest.approx(period, abs=1.0)


def test_warp_by_a_curve_carries_the_phase() -> None:
    clip, truth = synthetic.make("run", seed=1)
    curve = synthetic.tempo_curve(len(clip), seed=4, strength=0.4)
    assert curve[0] == 0
    assert curve[-1] == pytest.approx(len(clip) - 1)
    speeds = np.diff(curve)
    assert 0.4 < speeds.min() < 0.9
    assert 1.1 < speeds.max() < 1.8
    warped, frames = synthetic.warp(clip, curve)
    phase = np.interp(frames, np.arange(len(clip)), truth.phase)
    knee = np.interp(phase, truth.phase, channel(clip, "ltibia.rx"))
    np.testing.assert_allclose(channel(warped, "ltibia.rx"), knee, atol=0.3)


def test_curve_of_no_strength_is_straight() -> None:
    np.testing.assert_allclose(synthetic.tempo_curve(50, seed=1, strength=0.0), np.arange(50))
    assert len(synthetic.tempo_curve(1, seed=1)) == 1


def test_warp_of_one_frame() -> None:
    still = synthetic.make_clip("walk", seed=1)[:1]
    warped, frames = synthetic.warp(still, 2.0)
    assert len(warped) == 1
    assert frames.tolist() == [0.0]


@pytest.mark.parametrize(
    "speed", [0.0, -1.0, np.nan, [0.0, 2.0, 1.0], [0.0, 1e6], [-1.0, 2.0], [], [[0.0]]]
)
def test_impossible_warps_are_refused(speed: object) -> None:
    clip = synthetic.make_clip("walk", seed=1, duration_s=0.5)
    with pytest.raises(ClipError, match="Expected"):
        synthetic.warp(clip, speed)  # type: ignore[arg-type]


@pytest.mark.parametrize("strength", [-0.1, 1.0, np.nan])
def test_impossible_curves_are_refused(strength: float) -> None:
    with pytest.raises(ClipError, match="strength"):
        synthetic.tempo_curve(10, seed=0, strength=strength)


# -- faults ------------------------------------------------------------------------------------

FAULT_KINDS = ("offset", "flip", "noise", "freeze", "drift")


def faulty_clips() -> list[Clip]:
    return [synthetic.make_clip("walk", seed=1), bvh_clip()]


@pytest.mark.parametrize("clip", faulty_clips(), ids=["acclaim", "bvh"])
@pytest.mark.parametrize("kind", FAULT_KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_fault_is_as_large_as_it_says(clip: Clip, kind: str, seed: int) -> None:
    faulty, _, faults = synthetic.inject_faults(clip, seed=seed, kinds=[kind], n=6)  # type: ignore[list-item]
    assert len(faults) == 6
    for fault in faults:
        span = slice(fault.start, fault.end)
        wrong, right = (synthetic.joint_rotations(c, fault.joint)[span] for c in (faulty, clip))
        angles = rotation_angle_deg(wrong, right)
        assert angles.max() == pytest.approx(fault.size_deg, abs=1e-5)
        if kind in ("offset", "flip"):
            np.testing.assert_allclose(angles, fault.size_deg, atol=1e-5)
        elif kind == "drift":
            share = np.arange(1, len(angles) + 1) / len(angles)
            np.testing.assert_allclose(angles, fault.size_deg * share, atol=1e-5)
        elif kind == "noise":
            assert angles.min() > 0
        else:
            assert np.ptp(wrong, axis=0).max() < 1e-12


@given(seed=st.integers(0, 2**31), n=st.integers(0, 25))
@settings(max_examples=20, deadline=None)
def test_nothing_else_is_touched(seed: int, n: int) -> None:
    for clip in faulty_clips():
        faulty, mask, faults = synthetic.inject_faults(clip, seed=seed, n=min(n, 8))
        assert mask.shape == (len(clip), clip.skeleton.n_joints)
        rebuilt = np.zeros_like(mask)
        allowed = np.zeros(clip.channels.shape, dtype=bool)
        starts = clip.skeleton.channel_starts
        for joint, start, end, _, _ in faults:
            assert not rebuilt[start - 1 : end + 1, joint].any()
            rebuilt[start:end, joint] = True
            allowed[start:end, starts[joint] : starts[joint + 1]] = True
        np.testing.assert_array_equal(mask, rebuilt)
        changed = faulty.channels != clip.channels
        assert not changed[~allowed].any()
        translations = np.ones(clip.skeleton.n_channels, dtype=bool)
        translations[clip.skeleton.rotation_channels] = False
        assert not changed[:, translations].any()
        assert [fault.start for fault in faults] == sorted(fault.start for fault in faults)


def test_faults_are_repeatable() -> None:
    clip = faulty_clips()[0]
    first, again, other = (
        synthetic.inject_faults(clip, seed=seed, n=7).clip.channels for seed in (1, 1, 2)
    )
    assert first.tobytes() == again.tobytes()
    assert first.tobytes() != other.tobytes()


def test_fault_options() -> None:
    clip = faulty_clips()[0]
    knee = clip.skeleton.joint("ltibia")
    _, mask, faults = synthetic.inject_faults(
        clip, seed=1, kinds=("offset", "drift"), size_deg=30.0, length_s=0.25, n=4, joints=[knee]
    )
    assert {fault.joint for fault in faults} == {knee}
    assert {fault.size_deg for fault in faults} == {30.0}
    assert {fault.end - fault.start for fault in faults} == {30}
    assert sorted(fault.kind for fault in faults) == ["drift", "drift", "offset", "offset"]
    assert mask.sum() == 120


def test_root_is_left_alone_unless_asked_for() -> None:
    clip = faulty_clips()[0]
    _, mask, _ = synthetic.inject_faults(clip, seed=1, n=30, length_s=0.1)
    assert not mask[:, 0].any()
    _, mask, _ = synthetic.inject_faults(clip, seed=1, n=1, joints=[0])
    assert mask[:, 0].any()


def test_frozen_joints_would_have_moved() -> None:
    clip = faulty_clips()[0]
    _, _, faults = synthetic.inject_faults(clip, seed=1, kinds=["freeze"], n=6, length_s=0.3)
    assert all(fault.size_deg > 3.0 for fault in faults)


@pytest.mark.parametrize(
    "bad",
    [
        {"kinds": ["wobble"]},
        {"kinds": []},
        {"size_deg": 0.0},
        {"size_deg": 200.0},
        {"size_deg": (40.0, 20.0)},
        {"size_deg": np.nan},
        {"length_s": -1.0},
        {"length_s": np.inf},
        {"length_s": 60.0},
        {"n": 200, "joints": [3], "length_s": 1.0},
    ],
)
def test_impossible_faults_are_refused(bad: dict[str, object]) -> None:
    with pytest.raises(ClipError, match="Expected"):
        synthetic.inject_faults(faulty_clips()[0], seed=1, **bad)  # type: ignore[arg-type]


@pytest.mark.parametrize("joints", [[], [1]])
def test_joints_that_cannot_turn_are_refused(joints: list[int]) -> None:
    with pytest.raises(SkeletonError, match="rotation channels"):
        synthetic.inject_faults(faulty_clips()[0], seed=1, joints=joints)


# -- on disk -----------------------------------------------------------------------------------


def test_written_corpus_reads_back(tmp_path) -> None:  # type: ignore[no-untyped-def]
    paths = synthetic.write_corpus(tmp_path / "made", subjects=2, bvh_clips=1, seed=3)
    assert len(paths) == 14
    with (tmp_path / "made" / "LABELS.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [tmp_path / "made" / row["path"] for row in rows] == paths
    assert {row["label"] for row in rows} == set(KINDS)
    assert len({row["clip"] for row in rows}) == len(rows)
    bodies = set()
    for row, path in zip(rows, paths, strict=True):
        clip = read_clip(path, fps=float(row["fps"]))
        assert clip.name == row["clip"] == path.stem
        assert path.suffix == f".{row['format']}"
        assert clip.fps == 120.0
        positions = positions_m(clip)
        assert -0.03 < positions[:, :, 1].min() < 0.03
        if row["skeleton"]:
            assert (tmp_path / "made" / row["skeleton"]).is_file()
            bodies.add(clip.skeleton.digest)
    assert len(bodies) == 2
    assert sorted(path.suffix for path in paths).count(".bvh") == 1
    assert not list((tmp_path / "made").rglob("*.partial"))


def test_written_corpus_is_repeatable(tmp_path) -> None:  # type: ignore[no-untyped-def]
    first, again, other = (
        synthetic.write_corpus(tmp_path / name, subjects=1, bvh_clips=0, seed=seed)
        for name, seed in (("a", 1), ("b", 1), ("c", 2))
    )
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in again]
    assert [path.read_bytes() for path in first] != [path.read_bytes() for path in other]


def test_impossible_corpora_are_refused(tmp_path) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(CorpusError, match="subject"):
        synthetic.write_corpus(tmp_path, subjects=0)
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(CorpusError, match="folder"):
        synthetic.write_corpus(tmp_path / "file", subjects=1)
