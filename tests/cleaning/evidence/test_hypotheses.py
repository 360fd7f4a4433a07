"""The limits of what is an edge, and of what may stand between edges, one by one."""

from dataclasses import replace

import numpy as np
import pytest

from mocapdb.cleaning.evidence.discontinuities import Jumps, find_jumps
from mocapdb.cleaning.evidence.hypotheses import EVIDENCE, find_hypotheses, jump_scales
from mocapdb.cleaning.evidence.quieting import quieted
from mocapdb.cleaning.evidence.similarity_evidence import kind_of_turns
from mocapdb.cleaning.local_rotations import Texture
from mocapdb.corpus import synthetic
from mocapdb.motion.quaternions import continuous, from_rotation_vectors_deg

SKELETON = synthetic.make_skeleton()


def texture_of(*angles_deg, fps=120.0):
    """The texture of joints that turn about one axis by angles over time."""
    vectors = np.zeros((len(angles_deg[0]), len(angles_deg), 3))
    vectors[..., 0] = np.stack(angles_deg, axis=1)
    quats = continuous(from_rotation_vectors_deg(vectors))
    return Texture(SKELETON, np.arange(len(angles_deg)), quats, fps, "made")


def swing(n_frames=900, fps=120.0, size_deg=20.0):
    return size_deg * np.sin(2 * np.pi * np.arange(n_frames) / fps / 1.7)


def turned(start, end, degrees=40.0, **options):
    angles = swing(**options)
    angles[start:end] += degrees
    return angles


def found(texture, kind, cue="edges", halvings=0):
    """Return hypotheses of a texture, taken as it is: quieting is tested by itself."""
    several = find_hypotheses(texture, texture)
    return [h for h in several if (h.kind, h.cue, h.halvings) == (kind, cue, halvings)]


def evidence_of(hypothesis, name):
    return hypothesis.evidence[EVIDENCE.index(name)]


# -- edges -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("jumps", "fps", "scale"),
    [
        ([0.0] * 8, 120.0, 0.4),  # what no joint stays below
        ([0.0] * 8, 240.0, 0.4),
        ([0.0] * 8, 60.0, 0.8),
        ([9.0] * 8, 120.0, 2.5),  # what no joint does all the time
        ([0.25] * 8, 120.0, 1.0),  # 4 medians
        ([0.05] * 4 + [1.0] * 4, 120.0, 0.6),  # 12 quartiles, however large the others are
    ],
)
def test_what_a_joint_usually_jumps(jumps, fps, scale):
    sizes = np.array(jumps)[:, None]
    assert jump_scales(Jumps(np.zeros((8, 1, 3)), sizes), fps) == pytest.approx([scale])


@pytest.mark.parametrize(
    ("stretches", "scale"),
    [
        ([0.6, 0.6, 0.6, 0.6, 0.6], 1.2),  # twice the large jumps, however many are none
        ([0.0, 0.0, 0.0, 0.0, 0.9], 0.4),  # most of the clip is quiet
        ([0.4, 0.5, 0.7, 0.8, 0.9], 1.16),  # .4 of the way from the second to the third
    ],
)
def test_what_a_hand_or_toe_usually_jumps(stretches, scale):
    sizes = np.concatenate([[0.0] * 100 + [size] * 20 for size in stretches])[:, None]
    jumps, restless = Jumps(np.zeros((600, 1, 3)), sizes), np.array([True])
    assert jump_scales(jumps, 120.0, restless) == pytest.approx([scale])
    assert jump_scales(jumps, 120.0, ~restless) == pytest.approx([0.4])
    fewer = np.where(np.arange(600)[:, None] % 120 < 109, 0.0, sizes)  # less than a tenth
    assert jump_scales(Jumps(jumps.steps_deg, fewer), 120.0, restless) == pytest.approx([0.4])


@pytest.mark.parametrize(("degrees", "n"), [(2.4, 0), (2.7, 1)])
def test_an_edge_is_a_jump_of_2_5_degrees(degrees, n):
    assert len(found(texture_of(turned(300, 340, degrees)), "offset")) == n


@pytest.mark.parametrize(("degrees", "n"), [(3.8, 0), (4.4, 1)])
def test_and_of_four_times_the_usual(degrees, n):
    angles = turned(300, 340, degrees, size_deg=0.0)
    angles += 0.25 / 4 * (-1.0) ** np.arange(len(angles))  # every step differs by 0.25 degrees
    jumps = find_jumps(texture_of(angles))
    assert jump_scales(jumps, 120.0) == pytest.approx([1.0], rel=1e-3)
    assert len(found(texture_of(angles), "offset")) == n


@pytest.mark.parametrize(("fps", "halvings"), [(120.0, 2), (80.0, 1)])
def test_edges_are_looked_for_down_to_24_hz(fps, halvings):
    texture = texture_of(turned(300, 340, fps=fps), fps=fps)
    assert max(h.halvings for h in find_hypotheses(texture)) == halvings


# -- quieting ----------------------------------------------------------------------------------


def test_noise_goes_and_an_edge_stays():
    """As measured: what is left of noise of 1 degree, and of a jump of 12 degrees."""
    noise = np.random.default_rng(3).standard_normal(600)
    quiet = find_jumps(quieted(texture_of(noise))).sizes_deg
    assert np.median(quiet) == pytest.approx(0.00751, rel=0.05)
    edge = find_jumps(quieted(texture_of(turned(300, 340, 12.0, size_deg=0.0)))).sizes_deg[:, 0]
    assert edge[299] == pytest.approx(12.0, abs=1e-3)
    small = find_jumps(quieted(texture_of(turned(300, 340, 5.0, size_deg=0.0)))).sizes_deg[:, 0]
    assert small[299] == pytest.approx(4.32, abs=0.02)


# -- shapes ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("seconds", "n"), [(2.4, 1), (2.6, 0)])
def test_the_longest_fault(seconds, n):
    texture = texture_of(turned(200, 200 + round(120 * seconds)))
    assert len(found(texture, "offset")) == n


@pytest.mark.parametrize(("seconds", "n"), [(1.2, 1), (1.3, 0)])
def test_the_longest_fault_with_soft_edges(seconds, n):
    texture = texture_of(turned(200, 200 + round(120 * seconds)))
    assert len(found(texture, "offset", halvings=1)) == n


@pytest.mark.parametrize(("size", "kind"), [(145.0, "offset"), (155.0, "flip")])
def test_an_offset_over_150_degrees_is_a_flip(size, kind):
    assert len(found(texture_of(turned(300, 340, size)), kind)) == 1
    cut = [h.kind for h in find_hypotheses(texture_of(turned(0, 60, size))) if h.cue == "cut off"]
    assert kind in cut


@pytest.mark.parametrize(("back", "n"), [(0.55, 1), (0.45, 0)])
def test_the_turns_at_both_edges_of_an_offset_differ_by_half_at_most(back, n):
    angles = turned(300, 340, 40.0)
    angles[340:] += 40.0 * (1.0 - back)
    assert len(found(texture_of(angles), "offset")) == n


def test_a_small_offset_of_a_joint_that_moves_fits_without_its_noise():
    """It begins where the joint is quickest and ends where it turns back."""
    (h,) = [
        h
        for h in find_hypotheses(texture_of(turned(204, 255, 10.0)))
        if (h.kind, h.start, h.end, h.halvings) == ("offset", 204, 255, 0)
    ]
    assert evidence_of(h, "misfit") < 0.05
    assert evidence_of(h, "size") == pytest.approx(np.log(10.1), abs=0.05)


def test_the_misfit_of_an_offset_grows_with_its_length():
    (short,), (long,) = (
        found(texture_of(turned(300, end, size_deg=0.0)), "offset") for end in (420, 540)
    )
    misfits = [evidence_of(h, "misfit") for h in (short, long)]
    assert misfits == pytest.approx([0.02, 0.04], abs=1e-6)


@pytest.mark.parametrize(("n_edges", "n"), [(3, 0), (4, 1)])
def test_four_edges_together_are_noise(n_edges, n):
    angles = swing()
    for i in range(n_edges):  # each of these frames turns further: an edge, every fourth boundary
        angles[300 + 4 * i :] += 15.0
    assert len(found(texture_of(angles), "noise")) == n
    for i in range(n_edges):  # further apart they are edges of their own
        angles[300 + 4 * i + 4 : 300 + 5 * i + 5] -= 15.0
    assert len(found(texture_of(angles), "noise")) == 0 or n_edges < 4


@pytest.mark.parametrize(("gap", "n"), [(4, 1), (5, 0)])
def test_edges_of_one_stretch_of_noise_are_30_ms_apart_at_most(gap, n):
    angles = swing()
    for i in range(5):
        angles[300 + gap * i :] += 15.0
    assert len(found(texture_of(angles), "noise")) == n


def test_noise_reaches_12_ms_beyond_its_edges():
    angles = swing(fps=240.0, n_frames=1800)
    for i in range(5):
        angles[300 + 4 * i :] += 15.0
    (noise,) = found(texture_of(angles, fps=240.0), "noise")
    assert (noise.start, noise.end) == (300 - 3, 316 + 3)


def frozen(n_steps, **options):
    """A swing that stands for so many steps, and then jumps to where it should be."""
    angles = swing(**options)
    angles[300 : 300 + n_steps] = angles[299]
    return angles


@pytest.mark.parametrize(("n_steps", "n"), [(3, 0), (4, 1)])
def test_a_joint_is_frozen_that_stands_for_four_frames(n_steps, n):
    assert len(found(texture_of(frozen(n_steps)), "freeze")) == n


@pytest.mark.parametrize(("ratio", "n"), [(0.009, 1), (0.0115, 0)])
def test_standing_is_a_hundredth_of_the_usual_step(ratio, n):
    steps = np.full(900, 0.5)
    steps[400:] = -0.5
    steps[300:340] = 0.5 * ratio
    steps[340] = 20.0
    assert len(found(texture_of(np.cumsum(steps)), "freeze")) == n


@pytest.mark.parametrize(("share", "n"), [(0.68, 1), (0.72, 0)])
def test_a_joint_that_stands_most_of_the_time_is_not_frozen(share, n):
    steps = np.full(1000, 0.5)
    steps[: round(1000 * share)] = 0.0
    steps[round(1000 * share)] = 20.0
    assert len(found(texture_of(np.cumsum(steps)), "freeze")) == n


@pytest.mark.parametrize(("step_deg", "n"), [(0.9e-3, 0), (1.2e-3, 1)])
def test_a_joint_that_hardly_moves_is_not_frozen(step_deg, n):
    steps = np.full(900, step_deg)
    steps[300:340] = 0.0
    steps[340] = 20.0
    assert len(found(texture_of(np.cumsum(steps)), "freeze")) == n


@pytest.mark.parametrize(("jump_deg", "n"), [(0.8, 0), (1.3, 1)])
def test_a_joint_that_goes_on_from_where_it_stood_was_not_frozen(jump_deg, n):
    steps = np.full(900, 0.1)
    steps[300:340] = 0.0
    steps[340] += jump_deg
    assert len(found(texture_of(np.cumsum(steps)), "freeze")) == n


@pytest.mark.parametrize(("n_frames", "n"), [(11, 0), (13, 1)])
def test_a_joint_is_held_that_stays_for_a_tenth_of_a_second(n_frames, n):
    angles = swing(size_deg=120.0)
    middle = 200  # where it moves by 2 to 3 degrees a frame
    angles[middle : middle + n_frames] = angles[middle] + 0.3 * (-1.0) ** np.arange(n_frames)
    angles[middle + n_frames :] += 20.0
    stays = [h for h in found(texture_of(angles), "freeze", "held") if h.start >= middle - 1]
    assert len(stays) == n


@pytest.mark.parametrize(("tremble", "n"), [(1.8, 1), (2.3, 0)])
def test_what_is_held_stays_within_2_degrees(tremble, n):
    angles = swing(size_deg=120.0)
    angles[200:240] = angles[200] + tremble * np.sin(np.arange(40) * 2 * np.pi / 13)
    angles[240:] += 40.0
    assert len([h for h in found(texture_of(angles), "freeze", "held") if h.start >= 199]) == n


@pytest.mark.parametrize(("share", "n"), [(0.45, 1), (0.55, 0)])
def test_what_an_end_cuts_off_is_the_lesser_part(share, n):
    n_frames = 400
    texture = texture_of(turned(0, round(share * n_frames), n_frames=n_frames))
    before = [h for h in found(texture, "offset", "cut off") if h.start == 0]
    assert len(before) == n


# -- evidence ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("step_deg", "lower", "stands"), [
    (0.016, -30.0, True), (0.024, -30.0, False), (0.016, 60.0, False),
])  # fmt: skip
def test_a_joint_at_the_end_of_its_range_is_told_from_one_within(step_deg, lower, stands):
    """It stands if half of its steps are under 0.02 degrees."""
    angles = np.concatenate([np.linspace(lower, 0.0, 300), np.linspace(-60.0, -30.0, 300)])
    angles[200:240] = step_deg * (np.arange(40) % 2) + 40.0
    at_limit = [evidence_of(h, "at_limit") for h in found(texture_of(angles), "offset")]
    assert at_limit == [float(stands)]


@pytest.mark.parametrize(("share", "at_limit"), [(0.04, 1.0), (0.06, 0.0)])
def test_it_may_turn_further_in_one_frame_of_twenty(share, at_limit):
    angles = np.linspace(-60.0, -20.0, 1000)
    angles[200:240] = 5.0 + 0.004 * (np.arange(40) % 2)
    angles[-round(1000 * share) :] = np.linspace(40.0, 60.0, round(1000 * share))
    (offset,) = (h for h in found(texture_of(angles), "offset") if h.start == 200)
    assert evidence_of(offset, "at_limit") == at_limit


@pytest.mark.parametrize(("beyond_deg", "at_limit"), [(0.04, 1.0), (0.06, 0.0)])
def test_and_by_a_twentieth_of_a_degree_at_any_time(beyond_deg, at_limit):
    angles = np.linspace(-60.0, -20.0, 1000)
    angles[200:240] = 5.0 + 0.004 * (np.arange(40) % 2)
    angles[-300:] = 5.0 + beyond_deg
    (offset,) = (h for h in found(texture_of(angles), "offset") if h.start == 200)
    assert evidence_of(offset, "at_limit") == at_limit


def test_what_a_freeze_misses_and_how_it_is_let_go():
    steps = np.full(900, 0.5)
    steps[:264] = steps[380:] = 2.0  # further than 0.3 s away: of no account
    steps[300:340] = 0.0
    steps[340:344] = [20.0, 1.0, 1.0, 2.0]
    steps[344] = 9.0  # after the steps that are looked at
    (freeze,) = found(texture_of(np.cumsum(steps)), "freeze")
    assert evidence_of(freeze, "missed") == pytest.approx(np.log1p(0.5 * len(freeze)), rel=0.01)
    assert evidence_of(freeze, "release") == pytest.approx(np.log(20.1 / 2.1), rel=1e-3)


def test_the_shortest_stretches_count_as_a_tenth_of_a_second():
    (spike,) = found(texture_of(turned(300, 303)), "offset")
    (offset,) = found(texture_of(turned(300, 318)), "offset")
    assert evidence_of(spike, "length") == pytest.approx(np.log(0.1))
    assert evidence_of(offset, "length") == pytest.approx(np.log(0.15))


@pytest.mark.parametrize(
    ("turns", "kind"),
    [
        (np.full(20, 40.0), "offset"),
        (np.full(20, 160.0), "flip"),
        (np.linspace(0.0, 40.0, 20), "drift"),
        (np.linspace(10.0, 40.0, 20), "offset"),  # its median is 0.625 of its largest turn
        (np.linspace(5.0, 40.0, 20), "drift"),  # 0.56
        (40.0 * (-1.0) ** np.arange(20), "noise"),
        (np.where(np.arange(40) < 35, 40.0, -40.0), "offset"),  # one way by 0.75 of its size
        (np.where(np.arange(40) < 33, 40.0, -40.0), "noise"),  # 0.65
    ],
)  # fmt: skip
def test_the_kind_of_turns_away_from_similar_motion(turns, kind):
    vectors = np.zeros((len(turns), 3))
    vectors[:, 1] = turns
    assert kind_of_turns(vectors + 1e-9) == kind


# -- slow drifts of the root ---------------------------------------------------------------------


def drifting_root(start, end, degrees=40.0, sway_deg=0.0):
    """A root that drifts away over frames ``start:end`` and is right again at once."""
    angles = swing(1400, size_deg=0.3)
    angles[start:end] += degrees * np.arange(1, end - start + 1) / (end - start)
    rng = np.random.default_rng(5)
    angles += sway_deg * np.convolve(rng.standard_normal(1400), np.ones(30) / 30, "same")
    return replace(texture_of(angles, swing(1400)), root=0)


@pytest.mark.parametrize(
    ("seconds", "is_slow"), [(1.2, False), (1.7, True), (5.5, True), (7.0, False)]
)
def test_a_root_that_drifts_for_1_5_to_6_seconds_is_followed_to_its_onset(seconds, is_slow):
    start = 1200 - round(seconds * 120)
    texture = drifting_root(start, 1200)
    (drift,) = found(texture, "drift", "slow drift")
    assert (drift.row, drift.end) == (0, 1200)
    assert (abs(drift.start - start) < 6) == is_slow
    assert not found(replace(texture, root=1), "drift", "slow drift")


@pytest.mark.parametrize(
    ("seconds", "sway_deg", "start"), [(1.8, 4.0, 984), (1.8, 8.0, 996), (2.5, 8.0, 871)]
)
def test_where_a_slow_drift_of_a_swaying_root_sets_in(seconds, sway_deg, start):
    texture = drifting_root(1200 - round(seconds * 120), 1200, sway_deg=sway_deg)
    (drift,) = found(texture, "drift", "slow drift")
    assert drift.start == start


def test_of_half_turns_the_shortest_belong_together():
    """Noise must not decide which of four edges make pairs: here it favours the middle two."""
    angles = swing(size_deg=0.0)
    for edge, jump in ((300, 170.0), (328, -165.0), (360, 165.0), (400, -170.0)):
        angles[edge:] += jump
    spans = [(h.start, h.end) for h in found(texture_of(angles), "flip")]
    assert sorted(spans) == [(300, 328), (360, 400)]
